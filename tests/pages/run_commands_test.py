#!/usr/bin/env python3
"""Runs every command line on the pages, page by page, each page's commands in their order in one folder.

Files that a page does not make itself are provided under the names that it uses: a small room, its lamp, rays, images. Long
work is shortened (times, samples, photons, resolution, the rig that is measured); nothing else of a command line is changed.
Mentions without a file, and usage lines (STUDY.toml, DIR, $scene), are counted but not run.

The test leaves docs/tutorial/lamp-to-lux.md to tutorial_test.py, which runs it with a shorter time limit.

Usage: run_commands_test.py LUCERNA REPOSITORY [PAGE...]
"""
import glob
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

from commands_test import commands_of, pages_of

# The values of these options are replaced by those in SHORT; those in SETTINGS are upper limits.
SHORT = {"--time": "1s", "--error": "60%", "--spp": "2", "--passes": "2", "--resolution": "32x24", "--rays": "2000",
         "--samples": "4", "--precision": "50%", "--replicates": "5"}
REFERENCE = "docs/reference/commands.md"
SETTINGS = {"photons": 2000, "indirectphotons": 2000, "causticphotons": 2000, "guidepaths": 2000, "prepass": 256, "nsets": 4,
            "nlights": 16}
ENDS = ("--time", "--error", "--spp", "--passes", "--samples", "--precision")
# Options that limit a command which states no limit itself.
ENDED_BY = {"render": ["--spp", "2"], "lux": ["--samples", "4"], "glare": ["--precision", "50%"]}
OUTPUTS = ("-o", "--output", "--html", "--json", "--plan", "--signed", "--save-maps", "--checkpoint", "--resume",
           "--photographs", "--csv")
FILE = re.compile(r"(?:[\w./-]*/)?[\w.-]+\.(?:pbrt|toml|exr|tm25ray|dat|ray|ies|ldt|glb|gltf|obj|photons)$|^tasks\.csv(?=#)")

ROOM = """Option "string unit" "photometric"
LookAt 2 1.5 0.5  2 1.2 4  0 1 0
Camera "perspective" "float fov" 70
Film "rgb" "integer xresolution" 32 "integer yresolution" 24
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
Shape "bilinearmesh" "point3 P" [ 0 0 0  0 0 5  4 0 0  4 0 5 ]
Shape "bilinearmesh" "point3 P" [ 0 3 0  4 3 0  0 3 5  4 3 5 ]
Shape "bilinearmesh" "point3 P" [ 0 0 5  4 0 5  0 3 5  4 3 5 ]
CalculationSurface "work plane" "point3 P" [ 0.5 0.75 0.5  0.5 0.75 4.5  3.5 0.75 0.5 ] "integer points" [ 4 3 ]
"""
LAMP = """AttributeBegin
    Translate 2 2.9 2.5
    Rotate 90 1 0 0
    LightSource "lightfield" "string filename" "FILE" "float power" 2000 GROUP
AttributeEnd
"""
# An EULUMDAT file of a rotationally symmetric luminaire: 100 cd per 1000 lm at nadir, falling to zero at the side.
LDT = "\n".join(["maker", "1", "1", "1", "0", "3", "45", "report", "street", "1", "street.ldt", "today", "500", "0", "100", "400", "0",
                 "0", "0", "0", "0", "100", "100", "1", "0", "1", "1", "LED", "1000", "3000", "80", "20", *10 * ["0.5"], "0",
                 "0", "45", "90", "100", "70", "0"]) + "\n"
RIG = """[rig]
setup = "A"
views = [5, 5]
filter = "20mm"
pixels = [12, 12]
sensor = ["60mm", "60mm"]
distance = "40mm"

[emitter]
kind = "disc"
radius = "10mm"
setback = "5mm"
exponent = 1
flux = 100
unit = "lm"
"""
STUDY = """title = "A small study"
seeds = 2
[[scene]]
file = "ROOM"
resolution = "16x12"
[reference]
integrator = "path"
spp = [16]
[[method]]
name = "path"
integrator = "path"
spp = [1, 2]
"""
TRIANGLE = {
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,"
                                          "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
}


class Stage:
    """The files that pages assume to exist: made once, by the program itself."""

    def __init__(self, lucerna, folder):
        self.folder = folder
        (folder / "rig.toml").write_text(RIG)

        self.lucerna = lucerna

        def run(*words):
            subprocess.run([lucerna, *map(str, words), "--quiet"], check=True, cwd=folder, stdout=subprocess.DEVNULL)

        run("light", "acquire", "rig.toml", "-o", "lamp.exr", "--photographs", "shots")
        # Each ray set has one colour and the lamp's flux, like the ray files of vendors.
        for name in ("rays.tm25ray", "rays.dat"):
            run("light", "emit", "lamp.exr", "--rays", 20000, "-o", name)
        # Makes the lamp from a ray file, with the replicates that lux --replicates reads and the spectrum that lux --colour needs.
        (folder / "light.spd").write_text("400 1\n700 1\n")
        run("light", "import", "rays.tm25ray", "-o", "lamp.exr", "--views", "5x5", "--pixels", "12x12", "--replicates", 5,
            "--colours", "light.spd")
        run("light", "farfield", "lamp.exr", "-o", "lamp.ies")
        run("light", "assemble", "shots/manifest.toml", "--side=-x=shots/manifest.toml", "-o", "bulb.exr")
        (folder / "lamp.ldt").write_text(LDT)
        (folder / "tasks.csv").write_text("reference,task,Em,U0,UGR\n34.2,reading,500,0.6,19\n")
        self.with_groups([])
        run("render", "room.pbrt", "-o", "maps.exr", "--integrator", "photonmap", "--set", "photons=2000", "--spp", 1,
            "--save-maps", "maps.photons")
        (folder / "study.toml").write_text(STUDY.replace("ROOM", str(folder / "room.pbrt")))
        (folder / "model.gltf").write_text(json.dumps(TRIANGLE))
        (folder / "model.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        data = json.dumps(TRIANGLE).encode()
        data += b" " * (-len(data) % 4)
        (folder / "model.glb").write_bytes(b"glTF" + (2).to_bytes(4, "little") + (20 + len(data)).to_bytes(4, "little") +
                                           len(data).to_bytes(4, "little") + b"JSON" + data)

    def with_groups(self, groups):
        """Writes the room with a lamp in each of these light groups, or with one lamp in none, and renders its image."""
        lamp = LAMP.replace("FILE", str(self.folder / "lamp.exr"))
        lamps = [lamp.replace("GROUP", f'"string lightgroup" "{group}"') for group in groups] or [lamp.replace("GROUP", "")]
        (self.folder / "room.pbrt").write_text(ROOM + "".join(lamps))
        subprocess.run([self.lucerna, "render", "room.pbrt", "--integrator", "path", "--spp", "4", "--layers", "-o", "image.exr",
                        "--quiet"], check=True, cwd=self.folder, stdout=subprocess.DEVNULL)

    def source_of(self, command, name):
        """Returns the file that replaces one of that name as an input of that command."""
        kind = pathlib.Path(name).suffix
        if kind == ".exr":
            if pathlib.Path(name).name == "bulb.exr":  # emits to more than one side
                return self.folder / "bulb.exr"
            return self.folder / ("lamp.exr" if command[0] == "light" else "image.exr")
        if kind == ".toml":
            return self.folder / {"acquire": "rig.toml", "assemble": "shots/manifest.toml", "study": "study.toml"}[command[-1]]
        return self.folder / {".pbrt": "room.pbrt", ".tm25ray": "rays.tm25ray", ".dat": "rays.dat", ".ray": "rays.tm25ray",
                              ".ies": "lamp.ies", ".ldt": "lamp.ldt", ".glb": "model.glb", ".gltf": "model.gltf",
                              ".obj": "model.obj", ".photons": "maps.photons", ".csv": "tasks.csv"}[kind]


def command_of(words):
    """Returns the command's name: two words for `light`, as in `light info`, else one."""
    return words[:2] if words[0] == "light" else words[:1]


def shortened(words):
    command, words = command_of(words), list(words)
    if "--display" in words:  # there is no viewer
        at = words.index("--display")
        del words[at:at + 2]
    for i, (before, word) in enumerate(zip(["", *words], words)):
        if before in SHORT and word[0].isdigit():  # the option may have no value, as --replicates of lux
            words[i] = SHORT[before]
        setting = re.fullmatch(r"(\w+)=(\d+)", word)
        if setting and setting[1] in SETTINGS:
            words[i] = f"{setting[1]}={min(int(setting[2]), SETTINGS[setting[1]])}"
    if command[0] == "render" and "--resolution" not in words:
        words += ["--resolution", SHORT["--resolution"]]
    if command == ["light", "project"] and "--pixels" not in words:
        words += ["--pixels", "32x32"]
    if command == ["light", "import"] and "--drive" in words and "--views" not in words:  # rays of several colours take long
        words += ["--views", "5x5", "--pixels", "8x8"]
    if command == ["light", "acquire"] and not any(word.endswith(".toml") or word == "--pixels" for word in words):
        words += ["--pixels", "12x12"]
    if command[0] in ("lux", "glare") and "--height" in words and "--spacing" not in words:
        words += ["--spacing", "2"]
    if command[0] in ENDED_BY and not any(end in words for end in ENDS):
        words += ENDED_BY[command[0]]
    return words


def is_to_be_run(words):
    """Tells whether a command is neither a mention nor a usage line: it has a file, or an option such as --help."""
    text = " ".join(words)
    if re.search(r"\$|…|\.\.\.|\b(?!UGR\b)[A-Z]{3,}\b|\b[NK]\b|\bWxH\b", text):
        return False
    return (any(FILE.search(word) for word in words) or words[0] in ("--version", "--manual") or
            words[-1] in ("--help", "--integrators"))


def provide(stage, root, work, words):
    """Provides the files that the command reads. The files of the repository that a page names must exist."""
    command = command_of(words)
    for before, word in zip(["", *words], words):
        if before in OUTPUTS or word.split("=")[0] in OUTPUTS:
            continue
        name = FILE.search(word.split("=")[-1].split(",")[0])
        if not name or (work / name[0]).exists() or name[0].startswith("scenes/"):
            continue
        target = work / name[0]
        target.parent.mkdir(parents=True, exist_ok=True)
        if name[0].startswith("bench/") and not (root / name[0]).exists():
            raise FileNotFoundError(name[0])
        source = stage.source_of(command, name[0])
        if command[0] == "merge" and word.startswith("part"):
            parts = [word for word in words if word.startswith("part")]
            shared = ["--resolution", "32x24", "--spp", "2", "--denoise", "--quiet"]
            subprocess.run([stage.lucerna, "render", stage.folder / "room.pbrt", "--part", f"{parts.index(word) + 1}/{len(parts)}",
                            "-o", target, *shared], check=True, stdout=subprocess.DEVNULL)
        elif command[-1] == "assemble":
            shutil.copytree(source.parent, target.parent, dirs_exist_ok=True)
        else:
            shutil.copy(source, target)
    for before, word in zip(words, words[1:]):  # the program creates no folders
        if before in OUTPUTS:
            (work / word).parent.mkdir(parents=True, exist_ok=True)


def parts_of(words):
    """Returns the command; for one that makes one part of several, returns those of all, with three parts."""
    if "--part" not in words:
        return [words]
    at = words.index("--part") + 1
    number = words[at].split("/")[0]
    return [[f"{part}/3" if i == at else word.replace(f"part{number}", f"part{part}") for i, word in enumerate(words)]
            for part in (1, 2, 3)]


class Scenes:
    """The repository's scenes as links, so that a written file replaces a link. Generated files are made when a command
    misses them; the stage's lamp replaces missing lamps."""

    def __init__(self, root, folder, stage):
        self.root, self.folder, self.stage = root, folder, stage

    def beside(self, work):
        if not self.folder.exists():
            shutil.copytree(self.root / "scenes", self.folder, copy_function=os.symlink,
                            ignore=shutil.ignore_patterns("*.part", "__pycache__"))
            build = self.folder.parent / "build" / "release"
            build.mkdir(parents=True)
            (build / "lucerna").symlink_to(self.stage.lucerna)
        (work / "scenes").symlink_to(self.folder)

    def make(self, said):
        """Makes the file that a message reports missing; tells whether it exists now."""
        missed = re.search(r"(\S*scenes/\S+?): no such file", said)
        if not missed:
            return False
        file = self.folder / missed[1].split("scenes/", 1)[1]
        if file.suffix == ".exr":
            shutil.copy(self.stage.folder / "lamp.exr", file)
            return True
        scene = file.parent.relative_to(self.folder)
        while not (self.folder / scene / "make.py").exists():
            if scene == scene.parent:
                return False
            scene = scene.parent
        subprocess.run(["bash", self.folder / "make.sh", scene], check=True, stdout=subprocess.DEVNULL)
        return file.exists()


def run_one(lucerna, scenes, words, work):
    words = [file for word in words for file in (sorted(glob.glob(word, root_dir=work)) if "*" in word else [word])]
    for _ in range(8):
        said = subprocess.run([lucerna, *words], cwd=work, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              stdin=subprocess.DEVNULL, timeout=120)
        if said.returncode == 0:
            return
        if not scenes.make(said.stdout):
            break
    raise RuntimeError(said.stdout[-1500:])


def run_page(lucerna, root, stage, scenes, page, commands, work):
    """Returns (number of commands run, number left out, faults)."""
    ran, left, faults = 0, 0, []
    if any("scenes/" in word for _, words in commands for word in words):
        scenes.beside(work)
    groups = {words[i + 1].split("=")[0] for _, words in commands for i, word in enumerate(words[:-1]) if word == "--group"}
    stage.with_groups(sorted(groups))
    for line, words in commands:
        if not is_to_be_run(words):
            left += 1
            continue
        ran += 1
        if page == REFERENCE:  # its examples are independent of each other
            shutil.rmtree(work)
            work.mkdir()
            scenes.beside(work)
        try:
            rig = next((word for word in words if word.startswith("scenes/") and word.endswith(".toml")), None)
            if words[:2] == ["light", "acquire"] and rig:
                if not (root / rig).exists():
                    raise FileNotFoundError(rig)
                words = ["rig.toml" if word == rig else word for word in words]  # a rig that is measured quickly
            for each in parts_of(shortened(words)):
                provide(stage, root, work, each)
                run_one(lucerna, scenes, each, work)
        except (FileNotFoundError, RuntimeError, subprocess.TimeoutExpired, subprocess.CalledProcessError, KeyError) as error:
            faults.append(f"{page}:{line}: lucerna {' '.join(words)}\n    {error}")
    return ran, left, faults


def main():
    lucerna, root = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
    ran, left, faults = 0, 0, []
    with tempfile.TemporaryDirectory(prefix="lucerna-pages-") as folder:
        folder = pathlib.Path(folder)
        (folder / "stage").mkdir()
        stage = Stage(lucerna, folder / "stage")
        scenes = Scenes(root, folder / "repository" / "scenes", stage)
        # The test must detect a command that the program refuses.
        (folder / "wrong").mkdir()
        wrong = run_page(lucerna, root, stage, scenes, "wrong", [(1, ["render", "room.pbrt", "--spp", "2", "--tone", "no-such-curve"])],
                         folder / "wrong")
        assert wrong[0] == 1 and len(wrong[2]) == 1, wrong
        pages = sys.argv[3:] or [page for page in pages_of(root) if page != "docs/tutorial/lamp-to-lux.md"]
        for number, page in enumerate(pages):
            work = folder / str(number)
            work.mkdir()
            begun = time.monotonic()
            of_page = run_page(lucerna, root, stage, scenes, page, list(commands_of((root / page).read_text(encoding="utf-8"))), work)
            shutil.rmtree(work)
            ran, left, faults = ran + of_page[0], left + of_page[1], faults + of_page[2]
            if of_page[0]:
                print(f"{page}: {of_page[0]} run, {of_page[1]} mentions, {time.monotonic() - begun:.1f} s", flush=True)
    print("\n".join(faults) or f"{ran} command lines run, {left} mentions and usage lines not")
    if not sys.argv[3:] and ran < 250:
        sys.exit("too few command lines run")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
