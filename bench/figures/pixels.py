# Reads channels of an OpenEXR file as numbers, with the Python module.
import numpy

from module import lucerna

LUMINANCE = [0.2126, 0.7152, 0.0722]


def pixels(image, channels="R,G,B"):
    """Of three channels: height x width x 3."""
    held = lucerna.read_image(image)
    return numpy.stack([held.channel(name) for name in channels.split(",")], axis=-1).astype(float)


def luminance(image, channels="R,G,B"):
    """Height x width."""
    return pixels(image, channels) @ LUMINANCE


def smoothed(values):
    """Means over 3 x 3 pixels."""
    padded = numpy.pad(values, 1, mode="edge")
    height, width = values.shape
    return sum(padded[y:y + height, x:x + width] for y in range(3) for x in range(3)) / 9


def error(image, halves, most=None, noisy=False, worst=0):
    """The root mean square of an image's relative error, as `lucerna compare` has it. Of a reference in two independent halves a and b
    the mean of (image - a)(image - b) is the squared error from what both converge to, without their noise. Pixels of the reference
    above `most` are left out. Of a noisy reference, errors are relative to means over 3 x 3 pixels. `worst`: the share of the pixels
    with the largest errors that is left out."""
    a, b = halves[0], halves[-1]
    mean = (a + b) / 2
    valid = numpy.isfinite(mean) & (mean <= (most or numpy.inf))
    level = smoothed(mean) if noisy else mean
    scale = level[valid] ** 2 + (0.1 * mean[valid].mean()) ** 2
    square = ((image - a) * (image - b))[valid] / scale
    square = numpy.sort(square)[:square.size - int(worst * square.size)]
    return numpy.sign(square.mean()) * numpy.sqrt(abs(square.mean()))
