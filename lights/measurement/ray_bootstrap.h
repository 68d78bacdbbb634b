// The bootstrap of a ray file [Efron 1979; Efron and Tibshirani 1993, 6]: what the finite number of measured
// rays leaves uncertain in whatever is computed from a lamp.
//
// The rays are a sample of the lamp's light. As many of them, drawn with replacement, are a sample that might
// have been measured as well. A replicate of the lamp is the light field that the import makes of such a
// sample, with all of its choices made anew: slabs, planes, resolution and smoothing depend on the rays, so
// that the bias of the field and the effect of the clamp differ from one measurement to the next. What is
// computed from each of several replicates therefore scatters as it would from one import of so many rays to
// the next, or somewhat more: the drawn rays have the noise of half as many independent ones, and so have the
// choices that are made by them. The part of the bias that all replicates share is in none of the scatter;
// nor is what is wrong with all rays alike.
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

// As many rays as `set` has, drawn from it with replacement, each with its colour. A ray that is drawn
// several times stands in the result once, with so many times its flux: two copies would not be independent
// of each other, and held-out rays (held_out.h) must not be known to the field that they judge. The flux of
// the set is what its header states, if it states one in the set's unit; else it changes with the rays' sum.
// Skipped rays stay as they are. The same for any number of threads.
RaySet resampled(const RaySet& set, const BootstrapKey& key, const Workers& workers);

// "lamp.exr" -> "lamp-replicate-01.exr"; `replicate` counts from 1.
std::filesystem::path replicate_file(const std::filesystem::path& lamp, int replicate);

// How many replicates there are beside a lamp's file, numbered from 1 without a gap. Each is read: throws
// InputError, which names the file, if it is not of the lamp as it is now (LightFieldInfo::replicate_of), and
// for any file that cannot be read.
int count_replicates(const std::filesystem::path& lamp);

}  // namespace lucerna
