# Channels of an OpenEXR file as numbers. It needs oiiotool and numpy.
import subprocess
import tempfile

import numpy

LUMINANCE = [0.2126, 0.7152, 0.0722]


def pixels(image, channels="R,G,B"):
    """Of three channels: height x width x 3."""
    with tempfile.NamedTemporaryFile(suffix=".pfm") as file:
        subprocess.run(["oiiotool", image, "--ch", channels, "-d", "float", "-o", file.name], check=True)
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        data = numpy.frombuffer(file.read(), order + "f4").astype(float)
    return data.reshape(height, width, 3)[::-1]


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
