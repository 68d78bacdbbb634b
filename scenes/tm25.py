"""TM-25 ray files, and directions to fill them with. Python's standard library only; the same bytes on every run.

A ray is (x, y, z, dx, dy, dz) in millimetres with a unit direction; all rays of a file carry the same flux.
"""
import array
import math
import os
import struct
import sys

NAN = float("nan")


def cosine_direction(random, exponent):
    """About +z, with an intensity of cos^exponent: the exponent 1 is Lambert's."""
    z = random.random() ** (1 / (exponent + 1))
    r, phi = math.sqrt(max(0.0, 1 - z * z)), 2 * math.pi * random.random()
    return (r * math.cos(phi), r * math.sin(phi), z)


def gaussian(peak, below, above):
    """A spectrum of one lobe, its standard deviations in nm below and above the peak: pairs (nm, weight) every 2 nm."""
    def weight(nm):
        return math.exp(-0.5 * ((nm - peak) / (below if nm < peak else above)) ** 2)
    return [(nm, weight(nm)) for nm in range(380, 782, 2)]


def planck(kelvin):
    """A black body's spectrum, every 5 nm, 1 at 560 nm."""
    def weight(nm):
        return nm ** -5 / math.expm1(1.438777e7 / (nm * kelvin))
    return [(nm, weight(nm) / weight(560)) for nm in range(360, 835, 5)]


def write_tm25(path, text, watts, rays, spectra, which=None):
    """Rays of `watts` together. which[i]: the place of ray i's spectrum in `spectra`, from 0; None: all have the first."""
    header = bytearray(36288)

    def put(form, at, *values):
        struct.pack_into("<" + form, header, at, *values)
    put("4s i", 0, b"TM25", 2013)
    put("f f Q", 12, NAN, watts, len(rays))
    put("i f f f i", 60, 3 if which is None else 4, NAN, NAN, NAN, len(spectra))
    put("8i", 256, 1, 1, 1, 0, 0, 0, 0, 0 if which is None else 1)
    for i, letter in enumerate(text[:999]):
        put("I", 288 + 4 * i, ord(letter))
    tables = bytearray()
    for spectrum in spectra:
        tables += struct.pack("<i", len(spectrum))
        for pair in spectrum:
            tables += struct.pack("<2f", *pair)
    tables += bytes(-(len(header) + len(tables)) % 32)
    rows = array.array("f")
    share = watts / len(rays)
    for i, ray in enumerate(rays):
        rows.extend(ray)
        rows.append(share)
        if which is not None:
            rows.append(which[i] + 1)  # TM-25 counts spectra from 1
    if sys.byteorder == "big":
        rows.byteswap()
    os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    with open(path + ".part", "wb") as out:
        out.write(header + tables)
        rows.tofile(out)
    os.replace(path + ".part", path)
    print("   %s: %d rays" % (os.path.relpath(path), len(rays)))


def target(script, name):
    """Where a lamp's make.py writes: the first argument, else `name` beside the script."""
    return sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(script)), name)
