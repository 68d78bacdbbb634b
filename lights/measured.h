// The measured lamp as a light: its fields, their cell tables, its place in the scene, its impostor.
//
// Source: [Goesele 2003].
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/colour/working_space.h"
#include "lights/cell_emission.h"
#include "lights/cell_table.h"
#include "lights/light.h"
#include "lights/light_field.h"
#include "lights/lumigraph.h"
#include "lights/ray_set.h"

namespace lucerna {

struct MeasuredSettings {
    std::filesystem::path file;
    M44d world_from_light;  // rotation, translation and uniform scale; relative to the scene's origin. The
                            // lamp's file is in metres; its flux does not change with the scale
    float power_scale = 1;  // multiplies the flux, that of `power` too
    float power = 0;        // if > 0: the lamp's flux in place of the file's, in the light's unit
    LampUnit unit = {};     // what the light counts in; the file's own unless it says another
    EmissionMode mode = EmissionMode::exact;
    Reconstruction reconstruction = Reconstruction::exact;  // approximate: with EmissionMode::exact alone
    WorkingSpace colours = {};
};

// The file to read in the place of a lamp's.
using LampFileOf = std::function<std::filesystem::path(const std::filesystem::path& lamp)>;

// Loads the light field, and its cell table from beside it (built and saved there if it is missing or stale;
// a folder that cannot be written is a warning). Throws InputError naming file and cause. With a shape, which
// then must carry this light in the scene, the lamp is seen on it instead of on S; if more than a hundredth
// of its light misses the shape there is a warning.
std::unique_ptr<Light> make_measured_light(const MeasuredSettings& settings, const Workers& workers,
                                           Monitor& monitor,
                                           std::unique_ptr<const LampShape> shape = nullptr);

// The same from a field in memory and its table; settings.file only names it in messages.
//
// What it emits: particles follow max(0, h), and the whole is scaled so that their flux is the *measured* one
// (the sum of all coefficients, negative ones included), or `power`, times power_scale. Without that,
// clamping would add the noise of a coarse ray file to the lamp's flux; radiance is scaled alike, so that
// sample_Le(), sample_Li() and Le() speak of one lamp. (In `constant` mode the particles follow h's mean over
// each cell instead: the paper's approximation.) By the approximate reconstruction each particle and each
// radiance is multiplied by how far the two differ along its line: flux() stays that of the exact one. A
// field whose measured flux is not positive emits nothing (a warning if some of it is bright).
std::unique_ptr<Light> make_measured_light(LightField field, CellTable table,
                                           const MeasuredSettings& settings, Monitor& monitor,
                                           std::unique_ptr<const LampShape> shape = nullptr,
                                           const Workers& workers = {});

// The same of several slabs, with a table for each: one light. Each slab sends out the flux that was measured
// of it; radiance along a line, and the density of finding it, are sums over the slabs. Without a shape lines
// begin where they leave the lamp's box (those that miss it, where they pass its middle), not on S.
std::unique_ptr<Light> make_measured_light(Lumigraph lamp, std::vector<CellTable> tables,
                                           const MeasuredSettings& settings, Monitor& monitor,
                                           std::unique_ptr<const LampShape> shape = nullptr,
                                           const Workers& workers = {});

// A ray file as a light: its rays, emitted as they are. The comparison case for light fields.
//
// A handful of lines in space, however many, meets no point of a surface: nothing but particles can carry
// this light. Photon maps show it; methods that ask a light for its radiance see nothing of it.

struct RayLightSettings {
    std::filesystem::path file;
    M44d world_from_light;  // rotation, translation and uniform scale; relative to the scene's origin. The
                            // rays are in metres; their flux does not change with the scale
    float power_scale = 1;  // multiplies the flux, that of `power` too
    float power = 0;        // if > 0: the rays' flux in place of the file's, in the light's unit
    LampUnit unit = {};     // as in MeasuredSettings
    WorkingSpace colours = {};
};

// Reads the rays. Throws InputError naming file and cause.
std::unique_ptr<Light> make_ray_light(const RayLightSettings& settings, Monitor& monitor);

// The same from rays in memory; settings.file only names them in messages. Each emission is a ray of the set,
// chosen in proportion to its flux in constant time, and carries the flux of all usable rays. Rays with
// colours of their own (RaySet::tristimulus) are chosen by the mean of their channels, and each carries its
// colour; together they have the set's flux and RaySet::colour().
std::unique_ptr<Light> make_ray_light(RaySet rays, const RayLightSettings& settings);

}  // namespace lucerna
