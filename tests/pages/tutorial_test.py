#!/usr/bin/env python3
"""Tests the tutorial docs/tutorial/lamp-to-lux.md: its commands run, with a shorter time limit, and give the numbers shown.

Usage: tutorial_test.py LUCERNA REPOSITORY
"""
import csv
import os
import re
import shutil
import subprocess
import sys
import tempfile


def blocks_of(page):
    """Yields blocks of indented code; a blank line ends one, but not within a here-document."""
    block, here = [], False
    for line in page.split("\n") + [""]:
        if line.startswith("    ") or (here and not line):
            block.append(line[4:])
            here = (here or "<<'END'" in line) and line.strip() != "END"
        elif block:
            yield "\n".join(block)
            block = []


def is_of_commands(block):
    return re.match(r"\$?lucerna[ =]|scenes/|cat >|mkdir ", block)


def main():
    lucerna, root = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    with open(os.path.join(root, "docs/tutorial/lamp-to-lux.md"), encoding="utf-8") as file:
        page = file.read()
    commands = [block for block in blocks_of(page) if is_of_commands(block)]
    assert len(commands) == 8, commands
    with tempfile.TemporaryDirectory() as folder:
        # The files that the page needs from a repository in which the program is built.
        os.makedirs(os.path.join(folder, "build/release"))
        os.symlink(lucerna, os.path.join(folder, "build/release/lucerna"))
        os.makedirs(os.path.join(folder, "scenes/lamps"))
        for name in ("make.sh", "tm25.py"):
            shutil.copy(os.path.join(root, "scenes", name), os.path.join(folder, "scenes"))
        shutil.copytree(os.path.join(root, "scenes/lamps/white-led"), os.path.join(folder, "scenes/lamps/white-led"))
        script = re.sub("--time [123]0s", "--time 3s", "\n".join(commands))
        ran = subprocess.run(["bash", "-e", "-c", script], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             text=True)
        assert ran.returncode == 0, ran.stdout
        with open(os.path.join(folder, "out/lux.csv"), encoding="utf-8") as file:
            points = [float(row["E [lx]"]) for row in csv.DictReader(file)]
        assert os.path.getsize(os.path.join(folder, "out/desk-lux.png")) > 1000
        with open(os.path.join(folder, "out/report.pdf"), "rb") as file:
            assert file.read(4) == b"%PDF"
    # Em is far from its limit, so that little time is enough to judge it as on the page.
    judged = re.compile(r"^ *Em +work plane .* (\w+)$", re.M)
    assert judged.search(ran.stdout).group(1) == judged.search(page).group(1), ran.stdout
    shown = re.search(r"work plane +planar +(\d+) x (\d+) +([\d.]+) ± [\d.]+ +([\d.]+) ± [\d.]+ +([\d.]+) ±", page)
    columns, rows, mean, least, greatest = (float(number) for number in shown.groups())
    assert len(points) == columns * rows, len(points)
    # Each point is accurate to 2 % (95 %), here and on the page; the extremes of 48 points may differ by four times that.
    for name, value, expected, tolerance in (("mean", sum(points) / len(points), mean, 0.01), ("least", min(points), least, 0.08),
                                             ("greatest", max(points), greatest, 0.08)):
        assert abs(value / expected - 1) < tolerance, f"{name}: {value}, the page shows {expected}"
    print(f"{len(commands)} blocks of commands; mean {sum(points) / len(points):.2f} lx, the page shows {mean}")


if __name__ == "__main__":
    main()
