// Assembles photographs behind the filters into a light field.
//
// Photographs in colour (manifest.channel "rgb") make a field of several colours: each channel is merged and
// rectified as it is, and X, Y and Z are linear combinations of the three (CameraCalibration::to_xyz).
//
// For each view and film, the dark level is subtracted, the exposures are merged, and the rate is scaled to
// irradiance and rectified to the pixels of M; then the films are subtracted [Goesele 2003, 4, 6.2]. Noise is
// carried along by error propagation. Besides the result, at most two views per thread are in memory.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/image/photograph.h"
#include "lights/measurement/manifest.h"
#include "lights/measurement/opacity.h"

namespace lucerna {

// Identifies a photograph: either of a view behind a film, with its exposures numbered from 0 in ascending
// order, or a dark frame.
struct ShotId {
    bool dark = false;
    int number = 0;  // of the exposure, or of the dark frame in Manifest::darks
    int m = 0, n = 0;
    FilterSign sign = FilterSign::positive;
};

// Reads a photograph; called from many threads.
using PhotographReader = std::function<Photograph(const Shot& shot, const ShotId& which)>;

struct AssembleOptions {
    bool deviations = false;  // also compute those of all coefficients
};

struct Assembly {
    FilterImages images;  // the light field is field_of(images)
    // The standard deviation of every coefficient of Y [flux unit / m⁴], laid out by Rig::index; empty unless
    // requested.
    std::vector<float> deviations;

    std::uint64_t photographs = 0;
    V2i size{0, 0};               // pixels of a photograph
    double density = 0;           // pixels of a photograph per pixel of M
    std::uint64_t hot = 0;        // pixels of all dark frames that have their own level
    std::uint64_t saturated = 0;  // pixels of merged photographs that are full in every exposure
    double signal = 0;            // root mean square of the coefficients
    double noise = 0;  // root mean square of their standard deviations [flux unit / m⁴]; 0 if the camera's
                       // noise is unknown
};

// Reads every photograph once. Warns of pixels that are full in every exposure, of noise that is large
// compared with the signal, and of photographs coarser than M. Throws InputError naming file and cause for
// photographs that are missing (all are checked before any work), cannot be read, differ in size, or lack a
// dark frame where others have one, and when the user stops it.
Assembly assemble(const Manifest& manifest, const Workers& workers, Monitor& monitor,
                  const AssembleOptions& options = {});

// As above, from a reader instead of files.
Assembly assemble(const Manifest& manifest, const PhotographReader& reader, const Workers& workers,
                  Monitor& monitor, const AssembleOptions& options = {});

}  // namespace lucerna
