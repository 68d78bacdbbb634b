# Channels of an OpenEXR file as numbers. It needs oiiotool and numpy.
import struct
import subprocess
import tempfile

import numpy

LUMINANCE = [0.2126, 0.7152, 0.0722]


def pixels(image, channels="R,G,B"):
    """Of three channels: height x width x 3."""
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        subprocess.run(["oiiotool", image, "--ch", channels, "--chnames", "x,y,z", "-d", "float", "--compression", "none", "-o",
                        file.name], check=True)
        with open(file.name, "rb") as plain:
            data = plain.read()
    # Attributes (name, type, bytes, value), and then a line after the other: its number, its bytes, and channel by channel its values.
    at, window = 8, None
    while data[at]:
        name, kind, rest = data[at:at + 100_000].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        size, = struct.unpack_from("<i", data, at)
        if name == b"dataWindow":
            window = struct.unpack_from("<4i", data, at + 4)
        at += 4 + size
    width, height = window[2] - window[0] + 1, window[3] - window[1] + 1
    at += 1 + 8 * height
    lines = numpy.frombuffer(data, "<i4", height * (2 + 3 * width), at).reshape(height, 2 + 3 * width)
    return lines[:, 2:].copy().view("<f4").reshape(height, 3, width).transpose(0, 2, 1).astype(float)


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
