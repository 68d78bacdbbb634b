"""Prints what indirect light by virtual point lights adds to the time of direct light alone, and errors beside other methods.

usage: igi_cost.py FOLDER ROUNDS     the folder as igi_cost.sh fills it
"""
import json
import sys

RUNS = {
    "direct": "direct light alone",
    "igi-few": "igi, nlights=4",
    "igi": "igi, the defaults (nlights=64 shadowrays=4)",
    "igi-one-ray": "igi, shadowrays=1",
    "igi-all-rays": "igi, shadowrays=0: one for every light",
    "igi-note": "igi, rrthreshold=0.0001: roulette by a threshold",
    "gather": "final gather, one ray per sample, 500,000 photons",
    "path": "path tracer",
}


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def main():
    folder, rounds = sys.argv[1], int(sys.argv[2])
    stats = {run: [load(f"{folder}/{run}-{r}.json") for r in range(1, rounds + 1)] for run in RUNS}
    # The minimum over rounds counts, because other load on the machine only adds time.
    seconds = {run: min(s["seconds"]["total"] for s in many) for run, many in stats.items()}
    print("| method | seconds, all phases | added to direct | rays | relative MSE | MSE x seconds | mean over reference's |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for run, label in RUNS.items():
        error = load(f"{folder}/{run}-error.json")
        ratio = [c["ratio"] for c in error["channels"].values() if "ratio" in c]
        mse, rays = error["relative_mse"], stats[run][0]["numbers"]["rays.total"]
        added = seconds[run] / seconds["direct"] - 1
        print(f"| {label} | {seconds[run]:.2f} | {added:+.1%} | {rays / 1e6:.2f} M | {mse:.4f} | {mse * seconds[run]:.4f} "
              f"| {sum(ratio) / len(ratio):.3f} |")


if __name__ == "__main__":
    main()
