// The camera of a rig: what turns irradiance on a sensor into the numbers of a photograph.
//
// A pixel collects electrons in proportion to irradiance and time, and a dark current on top; it counts them
// with shot noise and with the noise of reading out; it is full at `full_well`; and what it has collected is
// written in whole steps of its bits. A series of exposures covers more range than one can.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/toml.h"
#include "engine/base/vec.h"

namespace lucerna {

struct CameraModel {
    std::vector<double> exposures{1};  // seconds, rising, all > 0
    int bits = 16;  // of a number in a photograph, 8 to 16; 32: floats, neither rounded nor clipped
    double full_well = 50000;  // electrons at which a pixel is full
    double read_noise = 0;     // electrons, standard deviation
    bool shot_noise = false;   // the number of electrons is a Poisson variable
    double dark_current = 0;   // electrons per second and pixel
    double hot_pixels = 0;     // share of the pixels whose dark current is hot_factor times that
    double hot_factor = 100;
    // Electrons per (flux unit / m²) and second. 0: the brightest pixel of all views fills `fill` of the well
    // in the shortest exposure.
    double sensitivity = 0;
    double fill = 0.8;
    std::uint64_t seed = 1;
    // Photographs finer than M's pixels: sensor pixels per pixel of M and axis, and a margin around them that
    // is to be cropped, in sensor pixels.
    V2i oversampling{1, 1};
    V2i margin{0, 0};
    // Setup B only: a pinhole that looks at the screen's back; in metres, in the rig's frame (S at z = 0, the
    // screen at z = D), and the photograph's size. A place of z = 0: straight behind the screen, far enough.
    Imath::V3d place{0, 0, 0};
    V2i photograph{0, 0};  // pixels; 0: oversampling times M's
    // Counts of no light; below 0: six deviations of the read noise, so that noise is not cut off at black.
    double pedestal = -1;
    int darks = 4;               // photographs of no light, of every exposure time
    std::string format = "png";  // of photographs: png, tiff, or exr for floats
};

// The table [camera]; what it lacks stays as above. Throws InputError naming line and column.
CameraModel read_camera(const TomlTable& table);

}  // namespace lucerna
