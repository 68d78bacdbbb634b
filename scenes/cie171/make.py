#!/usr/bin/env python3
"""The luminaire that a scene of this folder reads, which git keeps: a Lambertian one of 1000 cd as LM-63.

usage: make.py
"""
import math

with open("lambertian.ies", "w") as file:
    file.write("IESNA:LM-63-2002\n[TEST] CIE 171:2006, 5.2: diffuse source, I = 1000 cd cos(gamma)\n[MANUFAC] none\n"
               "[LUMCAT] none\n[LUMINAIRE] Lambertian point\n[LAMPCAT] none\n[LAMP] none\nTILT=NONE\n"
               "1 3141.593 1 91 1 1 2 0 0 0\n1 1 0\n")
    for row in ([f"{g}" for g in range(91)], ["0"], [f"{1000 * math.cos(math.radians(g)):.4f}" for g in range(91)]):
        for start in range(0, len(row), 13):
            file.write(" ".join(row[start:start + 13]) + "\n")
