// Functions that readers of materials share, for colours, roughness, refractive index, varnish and relief.
#pragma once

#include <filesystem>
#include <optional>

#include "engine/base/vec.h"
#include "engine/pbrt/state.h"

namespace lucerna {

// The version of a material, which its name tells: matte, glass, metal and plastic belong to version 3 and
// older, diffuse, dielectric and conductor to version 4. The old names define "roughness" differently before
// version 3, which the rest of the scene tells (Reading::old_dialect).
enum class Dialect : std::uint8_t { v2, v3, v4 };

// Reads a number in [least, most], or a texture of floats that is clamped to it at each lookup.
FloatTexture read_number(Reading& reading, Params& params, std::string_view name, double fallback,
                         double least, double most);
// Reads a ratio that may exceed 1: rgb, a metal's spectrum ("metal-Cu-eta"), any other, or a texture.
RgbTexture read_index_spectrum(Reading& reading, Params& params, std::string_view name, const Rgb& fallback);
// Reads the refractive index of glass: a float, a named glass, a spectrum's luminance, or a texture.
FloatTexture read_glass_eta(Reading& reading, Params& params, std::string_view name, double fallback);

// Reads "roughness", or "uroughness" and "vroughness", with `prefix`, and "remaproughness".
Roughness read_roughness(Reading& reading, Params& params, double fallback, Dialect dialect,
                         const std::string& prefix = "");
// Returns a coat of this index and roughness; coats of one scene are shared.
std::shared_ptr<const CoatTable> cover_of(Reading& reading, float eta, const Roughness& roughness);
// Reads pbrt-v4's coating, with parameter names under `prefix`.
Coat read_coat(Reading& reading, Params& params, const std::string& prefix);

// Returns the nearest available model for an unsupported material of pbrt, and reports it. Returns nothing if
// the kind is not one of these.
std::optional<MaterialModel> read_stand_in(Reading& reading, const std::string& kind, Params& params);

// Reads "bumpmap", "displacement" and "normalmap".
Relief read_relief(Reading& reading, Params& params);

// Fits tables of measured or computed reflection by a few numbers.

// A fit for viewing and illumination at some 45 degrees (at 0 degrees for isotropic half-angle tables).
struct TableFit {
    Rgb diffuse, gloss, transmitted;  // shares of the incident light
    float alpha = 0.2F;               // of the gloss lobe, GGX
    float eta = 1.5F;                 // refractive index of transmission
};

// Fits version 3's Fourier tables (.bsdf) and MERL's isotropic ones (.binary, .brdf), depending on the
// beginning of the file. Returns nothing if it is neither or damaged.
std::optional<TableFit> fit_bsdf_table(const std::filesystem::path& file);

}  // namespace lucerna
