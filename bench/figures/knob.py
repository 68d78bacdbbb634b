# Tests render --error and --time as users write them: the requested error against the error that the render states and that
# against a reference, on ten scenes; and the requested time against the actual one.
#   usage: knob.py LUCERNA OUT_FOLDER [--quick] [SCENE...]     default: all, and the times
# References are made once and kept: by the path tracer, or by `direct` for the picture that it shows.
import json
import math
import os
import subprocess
import sys
import time

# The errors are large enough to be distinguished from that of a reference of some minutes.
SCENES = {
    "cornell": ("cornell/cornell", 0.03),
    "cornell-caustic": ("cornell-caustic/cornell-caustic", 0.1),
    "cornell-fog": ("cornell-fog/cornell-fog", 0.5),
    "flashlight": ("cloister/by-flashlight", 0.5),
    "led": ("led/near", 0.15),
    "office": ("office/office", 0.15),
    "projector": ("projector/projector", 0.15),
    "cathedral": ("cathedral/cathedral", 0.5),
    "stadium": ("stadium/stadium", 0.25),
    "many-lights": ("many-lights/many-lights", 0.1),
}
TIMES = {"5s": 5, "20s": 20, "60s": 60, "300s": 300}


def percent(share):
    return "no error is stated" if share is None else f"{share:.2%}"


class Knob:
    def __init__(self, program, folder, quick):
        self.program, self.folder, self.quick = program, folder, quick
        self.size = "32x24" if quick else "64x48"
        os.makedirs(folder, exist_ok=True)

    def run(self, *words):
        begin = time.monotonic()
        done = subprocess.run([self.program, *words], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr)
        return done.stdout + done.stderr, time.monotonic() - begin

    def render(self, scene, name, *words):
        image, stats = f"{self.folder}/{name}.exr", f"{self.folder}/{name}.json"
        _, wall = self.run("render", f"scenes/{scene}.pbrt", "--resolution", self.size, "--quiet", "-o", image,
                           "--stats", stats, *words)
        with open(stats) as file:
            return image, json.load(file), wall

    def error(self, image, reference):
        text, _ = self.run("compare", image, reference, "--json", "-")
        return json.loads(text[text.index("{"):])["error"]

    def reference(self, name, scene, method="path"):
        judge = "direct" if method == "direct" else "path"
        stem = f"{name}-reference" if judge == "path" else f"{name}-reference-{judge}"
        image = f"{self.folder}/{stem}.exr"
        if not os.path.exists(image):
            seconds = "2s" if self.quick else "120s"
            self.render(scene, stem, "--integrator", judge, "--time", seconds, "--seed", "1000")
        with open(image.replace(".exr", ".json")) as file:
            return image, json.load(file)["numbers"].get("error.relative")

    def beyond(self, image, reference, noise):
        """The square of the image's error, without what is known of the reference's."""
        return self.error(image, reference) ** 2 - (noise or 0) ** 2

    def errors(self, names):
        print("| scene | asked | method | seconds | said | measured | said / measured | reference's noise |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- |")
        for name in names:
            scene, asked = SCENES[name]
            for words in (["--error", f"{asked}"], ["--error", f"{asked}", "--integrator", "path", "--time", "5min"]):
                image, stats, wall = self.render(scene, f"{name}-{len(words)}", *words)
                reference, noise = self.reference(name, scene, stats["integrator"])
                said = stats["numbers"].get("error.relative")
                if said is not None:
                    said = math.hypot(said, stats.get("choice", {}).get("beyond_noise", 0))
                measured = math.sqrt(max(self.beyond(image, reference, noise), 0))
                ratio = "—" if said is None else f"{said / measured if measured > 0 else math.inf:.2f}"
                print(f"| {name} | {asked:.0%} | {stats['integrator']}{' (chosen)' if 'choice' in stats else ''} | "
                      f"{wall:.1f} | {percent(said)} | {measured:.2%} | {ratio} | {percent(noise)} |", flush=True)

    def times(self):
        print("\n| scene | asked | took | of it | method | error |\n| --- | --- | --- | --- | --- | --- |")
        for name in ("cornell", "flashlight", "office"):
            scene, _ = SCENES[name]
            reference, noise = self.reference(name, scene)
            for text, seconds in list(TIMES.items())[:1 if self.quick else None]:
                image, stats, wall = self.render(scene, f"{name}-{text}", "--time", text, "--png")
                beyond, half = self.beyond(image, reference, noise), (noise or 0) / 2
                # An error below half of the reference's own cannot be distinguished from none.
                measured = f"{math.sqrt(beyond):.2%}" if beyond > half ** 2 else f"< {half:.1%}"
                print(f"| {name} | {text} | {wall:.2f} s | {wall / seconds:.1%} | {stats['integrator']} | "
                      f"{measured} |", flush=True)


def main():
    knob = Knob(sys.argv[1], sys.argv[2], "--quick" in sys.argv)
    names = [word for word in sys.argv[3:] if word != "--quick"]
    knob.errors(names or SCENES)
    if not names:
        knob.times()


main()
