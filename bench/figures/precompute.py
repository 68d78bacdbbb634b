"""Prints time and error of final gather with and without precomputed irradiance, and the ratio of times at equal error.

usage: precompute.py runs.csv     lines: precompute,spp,path of NAME.json and NAME-error.json
"""
import csv
import json
import math
import sys


def read(file):
    runs = {}
    with open(file, newline="") as rows:
        for precompute, spp, image in csv.reader(rows):
            with open(image + ".json") as stats, open(image + "-error.json") as error:
                seconds = json.load(stats)["seconds"]
                run = (seconds["total"] - seconds["read"], json.load(error)["relative_mse"])
            runs.setdefault(int(precompute), []).append(run)
            phases = " ".join(f"{name} {value:.2f}" for name, value in seconds.items() if name not in ("read", "total"))
            print(f"precompute={precompute} spp={spp:>4}: {run[0]:7.2f} s, relative MSE {run[1]:.3e}   ({phases})")
    return runs


def seconds_to(runs, error):
    """Straight in logarithms between two runs; None outside them."""
    for (t0, e0), (t1, e1) in zip(runs, runs[1:]):
        if e0 >= error >= e1 and e0 > e1:
            part = math.log(e0 / error) / math.log(e0 / e1)
            return t0 * (t1 / t0) ** part
    return None


def main(file):
    runs = read(file)
    for error in sorted({e for _, e in runs[4]} | {e for _, e in runs[0]}, reverse=True):
        precomputed, without = seconds_to(runs[4], error), seconds_to(runs[0], error)
        if precomputed and without:
            print(f"to a relative MSE of {error:.3e}: {without:.2f} s without, {precomputed:.2f} s with: {without / precomputed:.1f} times")


if __name__ == "__main__":
    main(sys.argv[1])
