// The sums of an acquisition that was stopped, on their way to being taken up again. A cache made by us, for
// this machine's byte order, and never trusted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "lights/filter_sums.h"
#include "photon/luminaire.h"

namespace lucerna {

struct AcquisitionState {
    std::uint64_t key = 0;    // names the work: same key, same blocks
    std::int64_t blocks = 0;  // done
    LuminaireTally tally;
    FilterSums sums;
};

// Replaces the file. Throws InputError.
void save_state(const std::filesystem::path& file, const AcquisitionState& state);

// The state in the file; none if there is no file. Throws InputError if it is damaged, or belongs to other
// work than that of `key` and `rig`.
std::optional<AcquisitionState> load_state(const std::filesystem::path& file, std::uint64_t key,
                                           const Rig& rig);

// A step of the hash by which work is named, FNV-1a's on words with the high half folded down.
class WorkKey {
  public:
    void add(std::uint64_t word) {
        value_ = (value_ ^ word) * 0x100000001b3U;
        value_ ^= value_ >> 29;
    }
    void add(double number);
    void add(const Rig& rig);
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 0xcbf29ce484222325U;
};

}  // namespace lucerna
