// The sums of an acquisition that was stopped, on their way to being taken up again. A cache made by us, for
// this machine's byte order, and never trusted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "lights/measurement/ray_projection.h"
#include "photon/luminaire.h"

namespace lucerna {

struct AcquisitionState {
    std::uint64_t key = 0;    // names the work: same key, same blocks
    std::int64_t blocks = 0;  // done
    LuminaireFlux flux;
    FilterSums sums;
};

// Replaces the file. Throws InputError.
void save_state(const std::filesystem::path& file, const AcquisitionState& state);

// The state in the file; none if there is no file. Throws InputError if it is damaged, or belongs to other
// work than that of `key` and `rig`.
std::optional<AcquisitionState> load_state(const std::filesystem::path& file, std::uint64_t key,
                                           const Rig& rig);

}  // namespace lucerna
