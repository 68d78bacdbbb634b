# Measures every method on realistic scenes in a given time: the denoised picture's error against a converged reference, and the
# seconds of the whole command.
#   usage: methods.py LUCERNA OUT_FOLDER DATA_FOLDER [--times 5,20,60] [--methods path,…] [--reference SECONDS] [--large] [SCENE...]
# DATA_FOLDER holds the scenes of the pbrt-v4 collection in pbrt/pbrt-v4, each with its reference.exr, and cornellglass in
# references. Given references are resized to the size of the render by oiiotool (Debian's openimageio-tools). Where one
# overflows its half floats (a visible lamp), that pixel and its neighbours are left out. All other references are rendered once
# and kept in OUT_FOLDER: two halves of some minutes each, whose mean is the reference (without what only one of them has, such
# as glints of lamps). Half of their difference is its noise, which is subtracted. --large renders 640 x 480 pixels or as many.
# Run nothing else meanwhile.
import json
import math
import os
import subprocess
import sys
import time

METHODS = {
    "path": ["--integrator", "path"],
    "photonmap": ["--integrator", "photonmap"],
    "progressive": ["--integrator", "progressive"],
    "igi": ["--integrator", "igi", "--set", "gathersamples=1", "--set", "nsets=64"],
    "chosen": [],
}
# The methods that make references. Without caustics, compensated virtual lights show all that path shows, with less noise.
REFERENCES = {
    "path": METHODS["path"],
    "progressive": METHODS["progressive"],
    "igi": ["--integrator", "igi", "--set", "gathersamples=1", "--set", "nsets=4096"],
}
# Each scene has its file, its size, and the method of its reference ("given": it exists).
SCENES = {
    # The given reference lacks the spot that the lamp casts through the glass egg.
    "veach-bidir": ("{data}/pbrt/pbrt-v4/veach-bidir/scene-v4.pbrt", (256, 256), "progressive"),
    "staircase2": ("{data}/pbrt/pbrt-v4/staircase2/scene-v4.pbrt", (256, 256), "given"),
    "coffee": ("{data}/pbrt/pbrt-v4/coffee/scene-v4.pbrt", (256, 320), "path"),  # the given reference is clipped at 2
    # The given reference is a tenth darker under water than path, and overflows.
    "water-caustic": ("{data}/pbrt/pbrt-v4/water-caustic/scene-v4.pbrt", (256, 256), "progressive"),
    "cornellglass": ("{data}/references/cornellglass.pbrt", (256, 256), "given"),
    "room": ("scenes/room/room.pbrt", (320, 200), "progressive"),
    "cloister": ("scenes/cloister/by-flashlight.pbrt", (320, 214), "igi"),
    "cathedral": ("scenes/cathedral/cathedral.pbrt", (256, 320), "path"),
    "office": ("scenes/office/office.pbrt", (320, 240), "path"),
    "projector": ("scenes/projector/projector.pbrt", (320, 240), "path"),
}
# A visible lamp smaller than a pixel dominates every mean, so pixels above this are left out.
MASKS = {"water-caustic": 50}


def run(words):
    begin = time.monotonic()
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}\n{done.stderr}")
    return done.stdout, time.monotonic() - begin


class Table:
    def __init__(self, program, out, data, seconds, large):
        self.program, self.out, self.data, self.seconds, self.large = program, out, data, seconds, large
        os.makedirs(out, exist_ok=True)

    def size(self, name):
        width, height = SCENES[name][1]
        by = 2 if self.large else 1
        return f"{by * width}x{by * height}"

    def render(self, name, image, words):
        file = SCENES[name][0].format(data=self.data)
        return run([self.program, "render", file, "--resolution", self.size(name), "-o", image, "--png", *words])

    def reference(self, name):
        """The reference's file, and its noise."""
        image = f"{self.out}/{name}-{self.size(name)}-reference"
        by = SCENES[name][2]
        if by == "given":
            given = {"cornellglass": "references/cornellglass-4096.exr"}.get(name, f"pbrt/pbrt-v4/{name}/reference.exr")
            if not os.path.exists(f"{image}.exr"):
                overflow = ["--dup", "--clamp:max=60000", "--dilate", "3x3", "--subc", "59000", "--clamp:min=0",
                            "--mulc", "1e38", "--mulc", "1e38", "--add"]  # adds 0 or +infinity
                run(["oiiotool", f"{self.data}/{given}", "--ch", "R,G,B", "--resize:filter=box", self.size(name),
                     *overflow, "-d", "float", "-o", f"{image}.exr"])
            return f"{image}.exr", 0
        halves = self.reference_halves(name)
        # A lamp's glint that only one half hit is absent from the other, so no half counts for more than twice the other.
        clean = [f"{image}-{half}-clean.exr" for half in range(2)]
        if not os.path.exists(f"{image}.exr"):
            for half, file in enumerate(clean):
                run(["oiiotool", *halves, "--min", "--mulc", "2", halves[half], "--min", "--ch", "R,G,B",
                     "-d", "float", "-o", file])
            run(["oiiotool", *clean, "--add", "--mulc", "0.5", "-d", "float", "-o", f"{image}.exr"])
        return f"{image}.exr", self.difference(name, *clean) / 2

    def reference_halves(self, name):
        """Two independent files, rendered where they are not there yet."""
        halves = [f"{self.out}/{name}-{self.size(name)}-reference-{half}.exr" for half in range(2)]
        for half, file in enumerate(halves):
            if not os.path.exists(file):
                self.render(name, file, ["--no-denoise", *REFERENCES[SCENES[name][2]], "--time", f"{self.seconds / 2}s",
                                         "--seed", str(1000 + half)])
        return halves

    def compared(self, name, image, reference, *options):
        """What `lucerna compare` says of an image."""
        mask = ["--mask", str(MASKS[name])] if name in MASKS else []
        text, _ = run([self.program, "compare", image, reference, *options, *mask, "--json", "-"])
        return json.loads(text[text.index("{"):])

    def difference(self, name, image, reference):
        return self.compared(name, image, reference, "--no-flip")["error"]

    @staticmethod
    def denoised(image):
        """The denoised picture of an image, as a file of its own: what else is in a file is not compared."""
        denoised = image.replace(".exr", "-denoised.exr")
        run(["oiiotool", image, "--ch", "R=denoised.R,G=denoised.G,B=denoised.B", "-d", "float", "-o", denoised])
        return denoised

    def error(self, name, image):
        reference, noise = self.reference(name)
        square = self.difference(name, self.denoised(image), reference) ** 2 - noise ** 2
        return f"{100 * math.sqrt(square):.3g} %" if square > noise ** 2 / 4 else f"< {50 * noise:.2g} %"

    def row(self, name, seconds, methods):
        cells, chosen = [], ""
        for method in methods:
            image = f"{self.out}/{name}-{self.size(name)}-{method}-{seconds}s.exr"
            said, wall = self.render(name, image, ["--denoise", "--time", f"{seconds}s", *METHODS[method]])
            cells.append(f"{self.error(name, image)}, {wall:.2f} s")
            for line in said.splitlines():
                if line.startswith("method "):
                    chosen = line.split()[2]
        return f"| {name} | {seconds} s | {' | '.join(cells)} | {chosen} |"


def option(words, name, default):
    if name not in words:
        return default
    at = words.index(name)
    value = words[at + 1]
    del words[at:at + 2]
    return value


def main():
    words = sys.argv[1:]
    times = [int(t) for t in option(words, "--times", "5,20,60").split(",")]
    methods = option(words, "--methods", ",".join(METHODS)).split(",")
    seconds = float(option(words, "--reference", "600"))
    large = "--large" in words
    words = [w for w in words if w != "--large"]
    if len(words) < 3:
        sys.exit("usage: methods.py LUCERNA OUT_FOLDER DATA_FOLDER [--times 5,20,60] [--methods path,…] "
                 "[--reference SECONDS] [--large] [SCENE...]")
    table = Table(words[0], words[1], words[2], seconds, large)
    print(f"| scene | time | {' | '.join(methods)} | which |\n|{' --- |' * (len(methods) + 3)}")
    for name in words[3:] or SCENES:
        print(f"{name}: the reference's noise {100 * table.reference(name)[1]:.2g} %", file=sys.stderr, flush=True)
        for t in times:
            print(table.row(name, t, methods), flush=True)


if __name__ == "__main__":
    main()
