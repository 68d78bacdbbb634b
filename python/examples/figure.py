"""A figure: a lamp with four chips as its near field, and as the IES file of its far field.

    PYTHONPATH=build/release/python python3 python/examples/figure.py figure.png

Above, pins on paper 6 mm below the lamp: each chip casts a shadow of its own by the near field, one point
casts one hard shadow by the far field. Below, the illuminance along a line on the paper, without the pins.
"""

import os
import sys
import tempfile

import lucerna
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

HEIGHT = 0.006  # height of the lamp above the paper, m
FLUX = 100.0  # lm


def four_chips():
    """A light field: chips of 1 mm, 3 mm apart, Lambertian, on S; M is 10 mm away and 50 mm wide."""
    views, pixels, spacing, pixel, distance = 16, 64, 0.4e-3, 50e-3 / 64, 10e-3
    on_s = (np.arange(views) - (views - 1) / 2) * spacing
    on_m = (np.arange(pixels) - (pixels - 1) / 2) * pixel
    lit = (np.abs(np.abs(on_s) - 1.5e-3) < 0.5e-3).astype(float)
    u, v, s, t = np.meshgrid(on_s, on_s, on_m, on_m, indexing="ij", sparse=True)
    r2 = (s - u) ** 2 + (t - v) ** 2 + distance**2
    # The radiance is constant over the chips, and the flux density is radiance times D^2 / R^4.
    density = lit[:, None, None, None] * lit[None, :, None, None] * distance**2 / r2**2
    steps = (spacing, spacing), (pixel, pixel)
    field = lucerna.LightField.from_array(density, *steps, distance, unit="lm", basis="hat")
    return field.with_array(field.array * (FLUX / field.flux))


def bench(folder, kind, file):
    """Pins on paper under the lamp; lengths in metres."""
    b = lucerna.SceneBuilder(folder)
    b.film(xresolution=240, yresolution=180)
    b.look_at((0, -0.026, 0.024), (0, 0, 0.001), (0, 0, 1))
    b.camera(fov=32)
    with b.attributes():
        b.translate(0, 0, HEIGHT)
        b.rotate(180, 1, 0, 0)  # light leaves a lamp along +z, here downwards
        b.light_source(kind, filename=file)
    b.material("diffuse", reflectance=(0.8, 0.8, 0.8))
    side = 0.03
    b.mesh([[-side, -side, 0], [side, -side, 0], [side, side, 0], [-side, side, 0]], [[0, 1, 2], [0, 2, 3]])
    b.material("diffuse", reflectance=(0.6, 0.1, 0.1))
    for x, y in ((-0.0045, -0.002), (0.0, 0.004), (0.0045, -0.002)):
        with b.attributes():
            b.translate(x, y, 0)
            b.shape("cylinder", radius=0.0003, zmin=0, zmax=0.0025)
            b.translate(0, 0, 0.0025)
            b.shape("sphere", radius=0.0006)
    return b.scene()


def main(output):
    lamp = four_chips()
    web = lamp.far_field(polar_step=1, azimuth_step=15)
    with tempfile.TemporaryDirectory() as folder:
        lamp.save(os.path.join(folder, "lamp.exr"))
        web.write_ies(os.path.join(folder, "lamp.ies"), "four chips")
        near = lucerna.render(bench(folder, "lightfield", "lamp.exr"), "direct", spp=32, denoise=True)
        far = lucerna.render(bench(folder, "ies", "lamp.ies"), "direct", spp=32, denoise=True)

    # The profile is along y = 1.5 mm, under two of the chips.
    x = np.linspace(-0.015, 0.015, 301)
    y = 1.5e-3
    row = lamp.project(HEIGHT, (x[-1] - x[0], 1e-4), (301, 1), centre=(0, y))[0]
    to = np.stack([x, np.full_like(x, -y), np.full_like(x, HEIGHT)], axis=1)
    distance = np.linalg.norm(to, axis=1)
    point = web.intensity(to) * HEIGHT / distance**3

    figure = plt.figure(figsize=(7, 5.2), constrained_layout=True)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.4, 1])
    white = np.quantile(far.denoised, 0.99)
    for column, (result, title) in enumerate(((near, "near field"), (far, "far field (IES)"))):
        axes = figure.add_subplot(grid[0, column])
        axes.imshow(np.clip(result.denoised / white, 0, 1) ** (1 / 2.2))
        axes.set_title(title)
        axes.axis("off")
    axes = figure.add_subplot(grid[1, :])
    axes.plot(1e3 * x, row * 1e-3, label="near field")
    axes.plot(1e3 * x, point * 1e-3, "--", label="far field")
    axes.set_xlabel("x on the paper, mm")
    axes.set_ylabel("illuminance, klx")
    axes.legend()
    figure.savefig(output, dpi=150)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "figure.png")
