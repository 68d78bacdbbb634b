// Tables of measured or computed reflection, as a few numbers that fit them.
#pragma once

#include <filesystem>
#include <optional>

#include "engine/base/vec.h"

namespace lucerna {

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
