// What the readers of materials share: colours, roughness, refractive indices, varnish, relief.
#pragma once

#include <filesystem>
#include <optional>

#include "engine/base/vec.h"
#include "engine/pbrt/state.h"

namespace lucerna {

// A material's own name tells which version it is written in: matte, glass, metal and plastic are version
// 3's and older, diffuse, dielectric and conductor version 4's. The old names say "roughness" differently in
// version 3 and before; the rest of the scene tells which (Reading::old_dialect).
enum class Dialect : std::uint8_t { v2, v3, v4 };

// A number in [least, most], or a texture of floats, which is held there wherever it is looked up.
FloatTexture read_number(Reading& reading, Params& params, std::string_view name, double fallback,
                         double least, double most);
// A ratio that may exceed 1: rgb, a named spectrum of a metal ("metal-Cu-eta"), any other, or a texture.
RgbTexture read_index_spectrum(Reading& reading, Params& params, std::string_view name, const Rgb& fallback);
// The refractive index of glass: a float, a named glass, a spectrum (its luminance), or a texture of floats.
FloatTexture read_glass_eta(Reading& reading, Params& params, std::string_view name, double fallback);

// "roughness", and "uroughness" and "vroughness" in its place, all with `prefix`; "remaproughness".
Roughness read_roughness(Reading& reading, Params& params, double fallback, Dialect dialect,
                         const std::string& prefix = "");
// A cover of this index and roughness; those of one scene are shared.
std::shared_ptr<const CoatTable> cover_of(Reading& reading, float eta, const Roughness& roughness);
// Varnish, as pbrt-v4 has it, its parameters under `prefix`.
Coat read_coat(Reading& reading, Params& params, const std::string& prefix);

// The nearest of ours in the place of a material of pbrt's that is not here, which is said; nothing if the
// kind is none of those.
std::optional<MaterialModel> read_stand_in(Reading& reading, const std::string& kind, Params& params);

// "bumpmap", "displacement", "normalmap".
Relief read_relief(Reading& reading, Params& params);

// Tables of measured or computed reflection, as a few numbers that fit them.

// Seen and lit from some 45 degrees (isotropic half-angle tables: from the front).
struct TableFit {
    Rgb diffuse, gloss, transmitted;  // shares of what arrives
    float alpha = 0.2F;               // of the gloss, GGX
    float eta = 1.5F;                 // of what transmits
};

// Of version 3's Fourier tables (.bsdf) and MERL's isotropic ones (.binary, .brdf), whichever the file's
// beginning shows. Nothing if it is neither, or damaged.
std::optional<TableFit> fit_bsdf_table(const std::filesystem::path& file);

}  // namespace lucerna
