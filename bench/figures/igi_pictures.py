"""Puts pictures side by side, two rows of them, named after their files.

usage: igi_pictures.py sheet picture.png...
"""
import math
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def main(sheet, files):
    pictures = [plt.imread(file) for file in files]
    height, width = pictures[0].shape[:2]
    columns = math.ceil(len(files) / 2)
    figure, axes = plt.subplots(2, columns, figsize=(2.4 * columns, 2 * (2.4 * height / width + 0.3)))
    for axis in axes.flat:
        axis.axis("off")
    for axis, picture, file in zip(axes.flat, pictures, files):
        axis.imshow(picture, interpolation="nearest")
        axis.set_title(os.path.splitext(os.path.basename(file))[0], fontsize=8)
    figure.tight_layout(pad=0.4)
    figure.savefig(sheet, dpi=100)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
