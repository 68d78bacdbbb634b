# Every method on scenes that people have, in a given time: error against a converged reference, and the seconds that
# the whole command took.
#   usage: methods.py LUCERNA OUT_FOLDER PBRT_V4_FOLDER [--times 5,20,60] [--quick] [SCENE...]
# PBRT_V4_FOLDER holds the scenes of the pbrt-v4 collection, each with its reference.exr; these are shrunk to the size of
# the render by oiiotool (Debian's openimageio-tools). Where one overflows its half floats (a lamp that the camera sees),
# that pixel and those beside it are left out. All other references are rendered once, for some minutes, and kept in
# OUT_FOLDER. Nothing else should run meanwhile.
import json
import os
import subprocess
import sys
import time

METHODS = {
    "path": ["--integrator", "path"],
    "photonmap": ["--integrator", "photonmap"],
    "progressive": ["--integrator", "progressive"],
    "igi": ["--integrator", "igi", "--set", "compensate=true", "--set", "nsets=64"],
    "chosen": [],
}
# Where the picture comes from, its size, and by what its reference is made (None: it is given).
COLLECTION = {
    "veach-bidir": ("256x256", "progressive"),  # the given one lacks the spot that the lamp throws through the egg of glass
    "staircase2": ("256x256", None),
    "coffee": ("256x320", "path"),  # the given one is cut off at 2
    "water-caustic": ("256x256", "progressive"),  # the given one is a tenth darker under water than path, and overflows
}
GALLERY = {
    "cornell-caustic": ("cornell-caustic/cornell-caustic", "256x256", "progressive"),
    "room": ("room/room", "320x200", "progressive"),
    "cloister": ("cloister/by-flashlight", "320x214", "path"),
    "cathedral": ("cathedral/cathedral", "256x320", "path"),
    "office": ("office/office", "320x240", "path"),
    "projector": ("projector/projector", "320x240", "path"),
}


def run(words):
    begin = time.monotonic()
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}\n{done.stderr}")
    return done.stdout, time.monotonic() - begin


class Table:
    def __init__(self, program, out, collection, quick):
        self.program, self.out, self.collection, self.quick = program, out, collection, quick
        os.makedirs(out, exist_ok=True)

    def scene(self, name):
        if name in COLLECTION:
            return f"{self.collection}/{name}/scene-v4.pbrt", *COLLECTION[name]
        file, size, by = GALLERY[name]
        return f"scenes/{file}.pbrt", size, by

    def render(self, name, image, words):
        file, size, _ = self.scene(name)
        return run([self.program, "render", file, "--resolution", size, "-o", image, *words])

    def reference(self, name):
        image = f"{self.out}/{name}-reference.exr"
        _, size, by = self.scene(name)
        if not os.path.exists(image):
            if by is None:
                given = f"{self.collection}/{name}/reference.exr"
                overflow = ["--dup", "--clamp:max=60000", "--dilate", "3x3", "--subc", "59000", "--clamp:min=0",
                            "--mulc", "1e38", "--mulc", "1e38", "--add"]  # + 0, or + infinity
                run(["oiiotool", given, "--ch", "R,G,B", "--resize:filter=box", size, *overflow,
                     "-d", "float", "-o", image])
            else:
                seconds = "10s" if self.quick else "600s"
                self.render(name, image, ["--integrator", by, "--time", seconds, "--seed", "1000"])
        return image

    def error(self, name, image):
        text, _ = run([self.program, "compare", image, self.reference(name), "--no-flip", "--json", "-"])
        return json.loads(text[text.index("{"):])["error"]

    def row(self, name, seconds):
        cells, chosen = [], ""
        for method, words in METHODS.items():
            image = f"{self.out}/{name}-{method}-{seconds}s.exr"
            said, wall = self.render(name, image, ["--time", f"{seconds}s", *words])
            cells.append(f"{100 * self.error(name, image):.3g} %, {wall:.2f} s")
            for line in said.splitlines():
                if line.startswith("method "):
                    chosen = line.split()[2]
        return f"| {name} | {seconds} s | {' | '.join(cells)} | {chosen} |"


def main():
    words = sys.argv[1:]
    quick = "--quick" in words
    times = [5, 20, 60]
    if "--times" in words:
        at = words.index("--times")
        times = [int(t) for t in words[at + 1].split(",")]
        del words[at:at + 2]
    words = [w for w in words if w != "--quick"]
    if len(words) < 3:
        sys.exit("usage: methods.py LUCERNA OUT_FOLDER PBRT_V4_FOLDER [--times 5,20,60] [--quick] [SCENE...]")
    table = Table(words[0], words[1], words[2], quick)
    print(f"| scene | time | {' | '.join(METHODS)} | which |\n|{' --- |' * (len(METHODS) + 3)}")
    for name in words[3:] or [*COLLECTION, *GALLERY]:
        for seconds in times:
            print(table.row(name, seconds), flush=True)


main()
