// The bootstrap of a ray file [Efron 1979; Efron and Tibshirani 1993, 6]: the uncertainty of everything that
// is computed from a lamp, because of its finite number of measured rays.
//
// The rays are a sample of the lamp's light. As many rays, drawn from them with replacement, are a sample
// that might equally have been measured. A replicate of the lamp is the light field that the import makes
// from such a sample, with all its choices made again: slabs, planes, resolution and smoothing depend on the
// rays, so that the field's bias and the effect of clamping differ between measurements. Results computed
// from several replicates therefore scatter like results from several imports of as many rays, or somewhat
// more, because the drawn rays, and the choices made by them, have the noise of half as many independent
// ones. The scatter contains neither the share of the bias that all replicates have in common nor errors
// common to all rays.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "lights/lumigraph.h"
#include "lights/ray_set.h"

namespace lucerna {

inline constexpr int kLeastReplicates = 5;  // fewer do not estimate a standard deviation
inline constexpr int kMostReplicates = 999;

// The key of a draw: `replicate` counts from 1, and `part` is the number of the file among those of a lamp.
// Different keys draw independently.
struct BootstrapKey {
    std::uint64_t seed = 0;
    int replicate = 1;
    std::uint32_t part = 0;
};

// Draws as many rays as `set` has, with replacement, each with its colour. A ray that is drawn several times
// appears once with its flux multiplied: two copies would be correlated, and held-out rays (held_out.h) must
// be unknown to the field that they judge. The set's flux is that of its header, if that states one in the
// set's unit; otherwise it changes with the rays' sum. Skipped rays stay as they are. The result does not
// depend on the number of threads.
RaySet resampled(const RaySet& set, const BootstrapKey& key, const Workers& workers);

// Maps "lamp.exr" to "lamp-replicate-01.exr"; `replicate` counts from 1.
std::filesystem::path replicate_file(const std::filesystem::path& lamp, int replicate);

// Returns the number of replicates beside a lamp's file, numbered from 1 without a gap. Reads each of them,
// and throws InputError naming the file if it cannot be read or does not belong to the current lamp
// (LightFieldInfo::replicate_of).
int count_replicates(const std::filesystem::path& lamp);

}  // namespace lucerna
