// The bootstrap of a ray file [Efron 1979; Efron and Tibshirani 1993, 6]: what the finite number of measured
// rays leaves uncertain in whatever is computed from a lamp.
//
// The rays are a sample of the lamp's light. As many of them, drawn with replacement, are a sample that might
// have been measured as well; a light field of such a sample is a replicate of the lamp's. What is computed
// from each of several replicates scatters as it would from one measurement with so many rays to the next.
// Every replicate has the planes and weights of the lamp itself, so that what these smooth away, the bias of
// the field, is in none of the scatter; nor is what is wrong with all rays alike.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "lights/lumigraph.h"
#include "lights/ray_set.h"

namespace lucerna {

inline constexpr int kLeastReplicates = 5;  // fewer do not tell a standard deviation
inline constexpr int kMostReplicates = 999;

// What a draw is made from: `replicate` counts from 1, `part` is the number of the file among those of a
// lamp. Other numbers draw independently.
struct BootstrapKey {
    std::uint64_t seed = 0;
    int replicate = 1;
    std::uint32_t part = 0;
};

// As many rays as `set` has, drawn from it with replacement, each with its colour. The flux of the set is
// what its header states, if it states one in the set's unit; else it changes with the rays' sum. Skipped
// rays stay as they are. The same for any number of threads.
RaySet resampled(const RaySet& set, const BootstrapKey& key, const Workers& workers);

// "lamp.exr" -> "lamp-replicate-01.exr"; `replicate` counts from 1.
std::filesystem::path replicate_file(const std::filesystem::path& lamp, int replicate);

// How many replicates there are beside a lamp's file, numbered from 1 without a gap. Each is read: throws
// InputError, which names the file, if it is not of the lamp as it is now (LightFieldInfo::replicate_of), and
// for any file that cannot be read.
int count_replicates(const std::filesystem::path& lamp);

}  // namespace lucerna
