// A camera that photographs what a virtual rig sees: files and a manifest as a real measurement leaves them.
//
// In Setup A the sensor lies in M. In Setup B M is a diffuse screen, a Lambertian transmitter, so its
// radiance is its irradiance times a constant from wherever a camera looks; the camera is a pinhole, and a
// pixel counts the mean over its own area of the photograph (calibrated: lens falloff divided out).
//
// A lamp of several colours is photographed in three channels, behind filters that see X, Y and Z as an
// imaging colorimeter's do: what each collects is light, never negative. A file has them as R, G and B, and
// the manifest says so by `to_xyz`.
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

// Photographs of every view behind both films and dark frames of every exposure into the folder, which is
// made if it is not there, and `manifest.toml` when all of them are written. Throws InputError if a file
// cannot be written, if the camera does not see the whole screen, and when the user stops it.
void write_photographs(const FilterImages& images, const CameraModel& camera,
                       const std::filesystem::path& folder, const Workers& workers, Monitor& monitor);

// Whether files that it writes may have this name.
bool is_photographs_name(const std::string& file);

// What can be known to be wrong with write_photographs before there are images: throws as it does. Makes the
// folder.
void check_photographs(const Rig& rig, const CameraModel& camera, const std::filesystem::path& folder);

// The images as they come back from such photographs, without files: assemble() of write_photographs(), bit
// for bit.
Assembly photographed(const FilterImages& images, const CameraModel& camera, const Workers& workers,
                      Monitor& monitor, const AssembleOptions& options = {});

// --- the parts of it

// How the camera sees M.
struct CameraView {
    V2i size{0, 0};  // pixels of a photograph
    Corners corners;
};
CameraView camera_view(const Rig& rig, const CameraModel& camera);

// From electrons to counts: the largest count (0: floats, electrons themselves), and how many an electron
// makes.
struct CountScale {
    int most = 0;
    double gain = 1;
    double pedestal = 0;
    CountScale(const CameraModel& camera);
};

// What a pixel counts that is expected to collect `electrons`, dark ones included.
float simulated_count(double electrons, const CameraModel& camera, const CountScale& scale, Sampler& sampler);

// A Poisson variable of this mean, >= 0: exact below 64, above by a normal variable with the Poisson's
// skewness.
double poisson(double mean, Sampler& sampler);

}  // namespace lucerna
