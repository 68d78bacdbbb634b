"""A white LED as rays with spectra: a blue core, and a ring of phosphor around it.

    make.py [FILE]      default: white-led.tm25ray beside this file

The core, 1 mm square, emits the blue that the phosphor over it leaves, cos^2 about the axis; a disc of 3.5 mm emits
the phosphor's yellow by Lambert's law, half as densely over the core as in the ring. So both the near field and the
far field have colours: blue in the middle of the lamp, yellow at its rim; bluish ahead, yellowish to the sides.
"""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
import tm25  # noqa: E402

RAYS, WATTS = 200_000, 1.0
BLUE_SHARE = 0.24         # of the watts
CORE, RADIUS = 1.0, 1.75  # mm
OVER_CORE = 0.5           # the phosphor's density over the core, beside 1 in the ring
BLUE, PHOSPHOR = tm25.gaussian(450, 8.5, 10.5), tm25.gaussian(560, 38, 62)


def in_core(x, y):
    return max(abs(x), abs(y)) < CORE / 2


def phosphor_point(dice):
    while True:
        r, phi = RADIUS * math.sqrt(dice.random()), 2 * math.pi * dice.random()
        x, y = r * math.cos(phi), r * math.sin(phi)
        if not in_core(x, y) or dice.random() < OVER_CORE:
            return x, y


def main():
    dice = random.Random(2003)
    rays, which = [], []
    for i in range(RAYS):
        blue = math.floor((i + 1) * BLUE_SHARE) > math.floor(i * BLUE_SHARE)
        if blue:
            x, y = CORE * (dice.random() - 0.5), CORE * (dice.random() - 0.5)
        else:
            x, y = phosphor_point(dice)
        rays.append((x, y, 0.0) + tm25.cosine_direction(dice, 2 if blue else 1))
        which.append(0 if blue else 1)
    tm25.write_tm25(tm25.target(__file__, "white-led.tm25ray"), "white LED, blue core and phosphor ring, made by formula",
                    WATTS, rays, [BLUE, PHOSPHOR], which)


main()
