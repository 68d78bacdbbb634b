// The sums of an interrupted acquisition, for its continuation. The file is a cache in this machine's byte
// order and is checked when it is read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "lights/measurement/ray_projection.h"
#include "photon/luminaire.h"

namespace lucerna {

struct AcquisitionState {
    std::uint64_t key = 0;    // hash of the work; equal keys have equal blocks
    std::int64_t blocks = 0;  // number completed
    LuminaireFlux flux;
    FilterSums sums;
};

// Replaces the file. Throws InputError.
void save_state(const std::filesystem::path& file, const AcquisitionState& state);

// Returns the state in the file, or nothing if there is no file. Throws InputError if it is damaged or
// belongs to work with another `key` or `rig`.
std::optional<AcquisitionState> load_state(const std::filesystem::path& file, std::uint64_t key,
                                           const Rig& rig);

}  // namespace lucerna
