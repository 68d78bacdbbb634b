#!/usr/bin/env python3
"""Hashes of 48 small images, six scenes by eight methods: a change that should change no image changes no line.

usage: bench/figures/image_hashes.py LUCERNA [FOLDER]     FOLDER keeps the images; a temporary one by default
The scenes' lamps are made by scenes/make.sh room projector. A hash is of the pixels alone (all channels, as they are
packed), not of the header, which names the settings.
"""
import hashlib
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

SCENES = ["cornell/cornell", "cornell-caustic/cornell-caustic", "cornell-fog/cornell-fog", "many-lights/many-lights",
          "room/room", "projector/projector"]
METHODS = {
    "path": ["path"],
    "direct": ["direct"],
    "photonmap": ["photonmap", "photons=20000"],
    "photonmap-maps": ["photonmap", "photons=20000", "direct=map", "indirect=map"],
    "photonmap-guided": ["photonmap", "photons=20000", "direct=guided", "precompute=0"],
    "igi": ["igi", "nlights=16", "nsets=4", "causticpaths=20000"],
    "igi-compensated": ["igi", "nlights=16", "nsets=4", "causticpaths=20000", "gathersamples=1"],
    "progressive": ["progressive", "photons=5000"],
}
LINES_OF_BLOCK = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}  # by OpenEXR's compression method


def pixels_of(file):
    """What follows an OpenEXR image's header and its table of offsets."""
    data = file.read_bytes()
    at, header = 8, {}
    while data[at]:
        name = data[at:data.index(b"\0", at)]
        at += len(name) + 1
        at = data.index(b"\0", at) + 1
        (size,) = struct.unpack_from("<i", data, at)
        header[name.decode()] = data[at + 4:at + 4 + size]
        at += 4 + size
    _, top, _, bottom = struct.unpack("<4i", header["dataWindow"])
    block = LINES_OF_BLOCK[header["compression"][0]]
    return data[at + 1 + 8 * -(-(bottom - top + 1) // block):]


def main():
    lucerna = Path(sys.argv[1]).resolve()
    scenes = Path(__file__).resolve().parents[2] / "scenes"
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[2] if len(sys.argv) > 2 else temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for scene in SCENES:
            for name, (integrator, *settings) in METHODS.items():
                image = folder / f"{Path(scene).name}-{name}.exr"
                length = ["--passes", "4"] if integrator == "progressive" else ["--spp", "2"]
                subprocess.run([lucerna, "render", scenes / f"{scene}.pbrt", "-o", image, "--quiet", "--resolution",
                                "64x48", "--integrator", integrator, *length,
                                *(word for setting in settings for word in ("--set", setting))], check=True)
                print(hashlib.sha256(pixels_of(image)).hexdigest()[:16], image.stem, flush=True)


if __name__ == "__main__":
    main()
