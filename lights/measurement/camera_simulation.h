// A camera that photographs what a virtual rig sees, and leaves files and a manifest like a real measurement.
//
// In Setup A the sensor lies in M. In Setup B M is a diffuse screen, a Lambertian transmitter, whose radiance
// is its irradiance times a constant in all directions. The camera is a pinhole, and a pixel counts the mean
// over its own area of the photograph (calibrated: lens falloff divided out).
//
// A lamp of several colours is photographed in three channels, behind filters with the responses of X, Y and
// Z as in an imaging colorimeter, so that no channel is negative. Files store them as R, G and B, which
// `to_xyz` in the manifest states.
#pragma once

#include <cstdint>
#include <filesystem>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/sampler.h"
#include "lights/measurement/manifest.h"
#include "lights/measurement/opacity.h"
#include "lights/measurement/photographs.h"
#include "lights/measurement/rig_file.h"

namespace lucerna {

// Writes photographs of every view behind both films and dark frames of every exposure into the folder, which
// is created if necessary, and `manifest.toml` after all of them. Throws InputError if a file cannot be
// written, if the camera does not see the whole screen, and when the user stops it.
void write_photographs(const FilterImages& images, const CameraModel& camera,
                       const std::filesystem::path& folder, const Workers& workers, Monitor& monitor);

// Returns true if write_photographs() may write files of this name.
bool is_photographs_name(const std::string& file);

// Checks before there are images what write_photographs() would reject; throws as it does. Creates the
// folder.
void check_photographs(const Rig& rig, const CameraModel& camera, const std::filesystem::path& folder);

// Returns the images that assemble() makes of write_photographs(), bit for bit, without files.
Assembly photographed(const FilterImages& images, const CameraModel& camera, const Workers& workers,
                      Monitor& monitor, const AssembleOptions& options = {});

// The camera's view of M.
struct CameraView {
    V2i size{0, 0};  // pixels of a photograph
    Corners corners;
};
CameraView camera_view(const Rig& rig, const CameraModel& camera);

// The conversion from electrons to counts: the largest count (0: floats, which are electrons) and counts per
// electron.
struct CountScale {
    int most = 0;
    double gain = 1;
    double pedestal = 0;
    CountScale(const CameraModel& camera);
};

// Returns the count of a pixel that is expected to collect `electrons`, including dark current.
float simulated_count(double electrons, const CameraModel& camera, const CountScale& scale, Sampler& sampler);

// Returns a Poisson variable of this mean, >= 0. It is exact below 64; above it is a normal variable with the
// Poisson's skewness.
double poisson(double mean, Sampler& sampler);

}  // namespace lucerna
