"""Writes a description that asks the same of tiny pictures: does every method and setting still run?

usage: quick.py STUDY.toml QUICK.toml

Numbers are cut down by their names alone, so that a description needs to know nothing of this. Scenes of which something has to be made
first (meshes, lamps) are left out where it is not there, and those of lamps that take long to read.
"""
import os
import re
import sys

LARGEST = 8 << 20  # bytes of a lamp that is read as a whole
MOST = {"photons": 2000, "nsets": 4, "nlights": 16, "gatherrays": 4, "k": 20, "gatherk": 20, "guidephotons": 2000}


def cut(match):
    """KEY=A|B|C with numbers no larger than MOST, each once."""
    key, values = match[1], match[2].split("|")
    if key not in MOST:
        return match[0]
    kept = dict.fromkeys(value if float(value) <= MOST[key] else str(MOST[key]) for value in values)
    return f"{key}={'|'.join(kept)}"


def few_samples(match):
    counts = [int(n) for n in re.findall(r"\d+", match[1])]
    kept = dict.fromkeys(min(n, 2 + i) for i, n in enumerate(counts[:2]))
    return f"spp = [{', '.join(map(str, kept))}]"


def why_not(scene):
    """Of the files that a scene and what it includes name, those that are not there or large, in words."""
    folder = os.path.dirname(scene)
    with open(scene, encoding="utf-8") as file:
        text = re.sub(r"#.*", "", file.read())
    faults = []
    for name in re.findall(r'"([^"\n]*\.(?:exr|ply|png|pbrt|ies|ldt))"', re.sub(r"Film .*", "", text)):
        path = os.path.join(folder, name)
        if not os.path.exists(path):
            faults.append(f"there is no {path}")
        elif name.endswith(".pbrt"):
            faults += why_not(path)
        elif os.path.getsize(path) > LARGEST:
            faults.append(f"{path} is large")
    return faults


def reduced(block, source, target):
    """A table of the description; empty if its scene cannot be rendered."""
    named = re.search(r'file = "([^"]*)"', block)
    if named:
        scene = os.path.normpath(os.path.join(os.path.dirname(source), named[1]))
        faults = why_not(scene)
        if faults:
            print(f"{scene} is left out: {faults[0]}", file=sys.stderr)
            return ""
        block = block.replace(named[1], os.path.relpath(scene, os.path.dirname(target)))
    block = re.sub(r'resolution = "[^"]*"', 'resolution = "12x8"', block)
    block = re.sub(r"spp = \[([^\]]*)\]", few_samples, block)
    block = re.sub(r"^seeds = .*", "seeds = 2", block, flags=re.M)
    return re.sub(r"\b(\w+)=([\d.|]+)", cut, block)


def told_apart(blocks):
    """The second method of a name gets a number: cut down, their settings may have become the same."""
    seen = {}
    for block in blocks:
        name = re.search(r'^name = "([^"]*)"', block, flags=re.M)
        if block.startswith("[[method]]") and name:
            seen[name[1]] = seen.get(name[1], 0) + 1
            if seen[name[1]] > 1:
                block = block.replace(name[0], f'name = "{name[1]} {seen[name[1]]}"', 1)
        yield block


def main(source, target):
    with open(source, encoding="utf-8") as file:
        blocks = re.split(r"(?m)^(?=\[)", file.read())
    blocks = [reduced(block.rstrip() + "\n\n" if block.startswith("[") else block, source, target) for block in blocks]
    with open(target, "w", encoding="utf-8") as file:
        file.write("".join(told_apart(blocks)))


if __name__ == "__main__":
    main(*sys.argv[1:3])
