#!/usr/bin/env python3
"""Measures the error of a lamp's far field, from a point and from its luminous opening, for docs/explanation/near-and-far.md.

Each lamp lights a square that faces it, with 9 x 9 points. It is as wide as its distance, or as WIDTH times that. `lucerna lux --far-field-error`
computes the illuminance by the near field and by both far fields. Distances are from S, in sizes of the lamp, which are given
in metres. Prints a table in Markdown.

usage: bench/figures/far_field_columns.py LUCERNA NAME=LAMP.exr=SIZE[=WIDTH]...
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

DISTANCES = (1.5, 3, 5, 10)

SCENE = """Option "string unit" "photometric"
Camera "perspective" WorldBegin
LightSource "lightfield" "string filename" "{lamp}" {efficacy}
Material "diffuse" "rgb reflectance" [0 0 0]
Translate 0 0 {below} Shape "disk" "float radius" 1e-4
"""


def measure(lucerna, lamp, distance, side, in_watts):
    """Returns the report of lucerna lux on the square, as read from JSON."""
    with tempfile.TemporaryDirectory() as folder:
        efficacy = '"float efficacy" 1' if in_watts else ""
        scene, report = Path(folder) / "scene.pbrt", Path(folder) / "lux.json"
        scene.write_text(SCENE.format(lamp=Path(lamp).resolve(), efficacy=efficacy, below=-distance))
        half = side / 2
        plane = f"square={-half},{-half},{distance}:{-half},{half},{distance}:{half},{-half},{distance}"
        subprocess.run([lucerna, "lux", scene, "--surface", plane, "--facing", "0,0,-1", "--spacing", str(side / 8.9),
                        "--far-field-error", "--precision", "0.3%", "--json", report, "--quiet"], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return json.loads(report.read_text())


def main():
    lucerna, lamps = sys.argv[1], sys.argv[2:]
    print("| lamp | distance | point, mean | point, RMS | opening, mean | opening, RMS |")
    print("| --- | --- | --- | --- | --- | --- |")
    for lamp in lamps:
        name, file, size, *width = lamp.split("=")
        info = subprocess.run([lucerna, "info", file], capture_output=True, text=True, check=True).stdout
        in_watts = " W (" in info.split("flux", 1)[1].split("\n")[0]
        for sizes in DISTANCES:
            distance = sizes * float(size)
            side = distance * float(width[0] if width else 1)
            surface = measure(lucerna, file, distance, side, in_watts)["surfaces"][0]
            cells = []
            for kind in ("point", "opening"):
                of = surface["far_field_error"].get(kind)
                if of is None or of["mean"]["value"] is None:
                    cells += ["none", "none"]
                    continue
                cells += [f"{100 * of['mean']['value']:+.1f} %", f"{100 * of['rms_over_points']:.1f} %"]
            print(f"| {name} | {sizes:g} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
