"""A narrow beam as rays: a disc of light, 2 degrees wide at half its intensity.

    make.py [FILE]      default: narrow-beam.tm25ray beside this file

The disc of 20 mm is evenly bright; about the axis the intensity falls as a Gaussian of the angle. Light of a halogen
lamp's black body, 3200 K.
"""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
import tm25  # noqa: E402

RAYS, WATTS, KELVIN = 20_000, 0.5, 3200  # the watts are those from 360 to 830 nm
RADIUS, WIDTH = 10.0, 2.0                # mm; degrees, full width at half maximum


def main():
    dice = random.Random(2)
    sigma = math.radians(WIDTH) / (2 * math.sqrt(2 * math.log(2)))
    rays = []
    for _ in range(RAYS):
        r, phi = RADIUS * math.sqrt(dice.random()), 2 * math.pi * dice.random()
        # A Gaussian of two dimensions by its angle's distribution, 1 - exp(-angle^2 / (2 sigma^2)).
        angle, turn = sigma * math.sqrt(-2 * math.log(1 - dice.random())), 2 * math.pi * dice.random()
        d = (math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), math.cos(angle))
        rays.append((r * math.cos(phi), r * math.sin(phi), 0.0) + d)
    tm25.write_tm25(tm25.target(__file__, "narrow-beam.tm25ray"), "narrow beam of 2 degrees, made by formula",
                    WATTS, rays, [tm25.planck(KELVIN)])


main()
