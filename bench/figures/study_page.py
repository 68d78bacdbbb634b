#!/usr/bin/env python3
"""A picture of a study's page, for docs/tutorial/reproduce-a-study.md.  Usage: study_page.py STUDY.html PICTURE.png

What the window shows at first, in 256 colours."""
import pathlib
import sys

from PIL import Image

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests" / "pages"))
import chromium

if not chromium.browser():
    sys.exit("no Chromium here (scripts/deps.sh installs it)")
page, picture = sys.argv[1:]
with chromium.Page(page, width=1180, height=1420) as opened:
    opened.evaluate("study.ready.then(() => new Promise((resolve) => setTimeout(resolve, 300)))")
    opened.screenshot(picture)
# Median cut drops the small marks; octree keeps their colours.
Image.open(picture).convert("RGB").quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(picture, optimize=True)
