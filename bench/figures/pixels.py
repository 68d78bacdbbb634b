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


def error(image, halves, most=None):
    """The root mean square of an image's relative error, as `lucerna compare` has it. Of a reference in two independent halves a and b
    the mean of (image - a)(image - b) is the squared error from what both converge to, without their noise. Pixels of the reference
    above `most` are left out."""
    a, b = halves[0], halves[-1]
    mean = (a + b) / 2
    valid = numpy.isfinite(mean) & (mean <= (most or numpy.inf))
    scale = mean[valid] ** 2 + (0.1 * mean[valid].mean()) ** 2
    square = ((image - a) * (image - b))[valid] / scale
    return numpy.sign(square.mean()) * numpy.sqrt(abs(square.mean()))
