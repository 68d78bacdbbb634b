#!/usr/bin/env python3
"""Prints the polynomials of engine/base/elementary.cpp: near-minimax approximations in the power basis, by interpolation at Chebyshev
points in high precision. Usage: elementary_coefficients.py"""
import mpmath as mp

mp.mp.dps = 60


def polynomial(function, low, high, terms):
    """Returns `terms` coefficients, lowest first, and the largest error relative to function at 2000 points."""
    nodes = [(low + high) / 2 + (high - low) / 2 * mp.cos(mp.pi * (2 * i + 1) / (2 * terms)) for i in range(terms)]
    matrix = mp.matrix(terms, terms)
    values = mp.matrix(terms, 1)
    for i, x in enumerate(nodes):
        values[i] = function(x)
        for j in range(terms):
            matrix[i, j] = x**j
    solution = mp.lu_solve(matrix, values)
    coefficients = [float(solution[j]) for j in range(terms)]
    worst = 0
    for i in range(2001):
        x = low + (high - low) * mp.mpf(i) / 2000
        y = sum(mp.mpf(c) * x**j for j, c in enumerate(coefficients))
        worst = max(worst, abs(y / function(x) - 1))
    return coefficients, worst


def show(name, function, low, high, terms):
    coefficients, worst = polynomial(function, mp.mpf(low), mp.mpf(high), terms)
    print(f"// relative error 2^{float(mp.log(worst, 2)):.1f}")
    print(f"constexpr double {name}[] = {{" + ", ".join(c.hex() for c in coefficients) + "};")


tiny = mp.mpf(10) ** -12  # below it the first term of the series is exact to 2e-24


def exp_tail(x):  # (e^x - 1 - x) / x²
    return mp.mpf(1) / 2 + x / 6 if abs(x) < tiny else (mp.expm1(x) - x) / x**2


def log_tail(z):  # (2 atanh(s) - 2 s - 2/3 s³) / s⁵ with z = s²
    if z < tiny:
        return mp.mpf(2) / 5 + 2 * z / 7
    s = mp.sqrt(z)
    return (2 * mp.atanh(s) - 2 * s - 2 * s * z / 3) / s**5


def sin_tail(z):  # (sin x - x) / x³ with z = x²
    if z < tiny:
        return -mp.mpf(1) / 6 + z / 120
    x = mp.sqrt(z)
    return (mp.sin(x) - x) / x**3


def cos_tail(z):  # (cos x - 1 + x²/2) / x⁴ with z = x²
    if z < tiny:
        return mp.mpf(1) / 24 - z / 720
    x = mp.sqrt(z)
    return (mp.cos(x) - 1 + z / 2) / z**2


def atan_tail(z):  # (atan t - t) / t³ with z = t²
    if z < tiny:
        return -mp.mpf(1) / 3 + z / 5
    t = mp.sqrt(z)
    return (mp.atan(t) - t) / t**3


half_ln2 = mp.log(2) / 2 * (1 + mp.mpf(2) ** -20)
show("kExp", exp_tail, -half_ln2, half_ln2, 11)
show("kLog", log_tail, 0, ((mp.sqrt(2) - 1) / (mp.sqrt(2) + 1)) ** 2, 9)
quarter = (mp.pi / 4 * (1 + mp.mpf(2) ** -20)) ** 2
show("kSin", sin_tail, 0, quarter, 7)
show("kCos", cos_tail, 0, quarter, 7)
show("kAtan", atan_tail, 0, mp.tan(mp.pi / 8) ** 2, 14)
