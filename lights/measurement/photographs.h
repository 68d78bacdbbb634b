// Photographs behind the filters, assembled into a light field.
//
// Photographs in colour (manifest.channel "rgb") make one of several colours: each channel is merged and
// rectified as it is, and X, Y and Z are sums of the three (CameraCalibration::to_xyz).
//
// View by view and film by film: the dark level is subtracted, the exposures are merged, the rate is scaled
// to irradiance and rectified to the pixels of M; then the films are subtracted [Goesele 2003, 4, 6.2]. Noise
// is carried along by error propagation, so that a field knows how good it is. Two views at most per thread
// are in memory besides the result.
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

// One photograph of a measurement: of a view behind a film, its exposures counted from 0 as they rise; or the
// number of a dark frame.
struct ShotId {
    bool dark = false;
    int number = 0;  // of the exposure, or of the dark frame in Manifest::darks
    int m = 0, n = 0;
    FilterSign sign = FilterSign::positive;
};

// Gives a photograph; called from many threads.
using PhotographReader = std::function<Photograph(const Shot& shot, const ShotId& which)>;

struct AssembleOptions {
    bool deviations = false;  // also give every coefficient's
};

struct Assembly {
    FilterImages images;  // field_of(images) is the light field
    // Standard deviation of every coefficient of Y [flux unit / m⁴], as Rig::index says; empty unless asked
    // for.
    std::vector<float> deviations;

    std::uint64_t photographs = 0;
    V2i size{0, 0};               // pixels of a photograph
    double density = 0;           // pixels of a photograph per pixel of M
    std::uint64_t hot = 0;        // pixels of all dark frames that have a level of their own
    std::uint64_t saturated = 0;  // pixels of merged photographs that were full in every exposure
    double signal = 0;            // root mean square of the coefficients …
    double noise = 0;  // … and of their standard deviations [flux unit / m⁴]; 0 if the camera's is unknown
};

// Reads every photograph once. Warns of pixels that are full in every exposure, of noise that is large
// against the signal, and of photographs coarser than M. Throws InputError naming file and cause: photographs
// that are missing (all of them, before any work), cannot be read, are of different sizes, or have no dark
// frame where others have; and when the user stops it.
Assembly assemble(const Manifest& manifest, const Workers& workers, Monitor& monitor,
                  const AssembleOptions& options = {});

// The same of photographs that are no files.
Assembly assemble(const Manifest& manifest, const PhotographReader& reader, const Workers& workers,
                  Monitor& monitor, const AssembleOptions& options = {});

}  // namespace lucerna
