// Which method, with which settings, makes the best image in a time, or one that is good enough soonest: by a
// short trial of each and by how errors are known to fall with more work (docs/explanation/choosing.md).
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/render/job.h"
#include "engine/render/stop_rule.h"

namespace lucerna {

struct MethodChoice {
    IntegratorSettings settings;
    // Expected, as Film::relative_error() counts it (not a number where nothing was tried); and seconds of
    // preparation and image.
    double error = 0, seconds = 0;
    // The part of the error that more samples do not mend, as large as it may well be: what photons or
    // VPLs of their number leave. 0 where there is none.
    double beyond_noise = 0;
    std::string tried;  // every method and what was expected of it, for people
};

struct Method {
    IntegratorSettings settings;  // of its trial: few photons, few sets of VPLs
    double least_seconds;         // with which it is worth trying
    // One of each kind looks at every picture whose error is asked for: what the others cannot see, none of
    // their errors tells.
    bool always = false;
};
// Returns the methods that show the same image as `asked`, the unbiased one first; `asked` alone if there are
// none.
std::vector<Method> methods_like(const IntegratorSettings& asked);

// By limits.error if there is one, else by limits.seconds. Takes a seventh of the time, or of what the best
// method is expected to need, or little more; of a second or two nothing, and takes progressive passes
// unseen, or paths where a medium glows. Where the job asks for light groups, what cannot tell of them is
// left aside. None if there is nothing to choose from or the user stopped it.
std::optional<MethodChoice> choose_method(const Job& job, const Limits& limits, std::uint64_t seed,
                                          const Workers& workers, Monitor& monitor);

// How a method's error falls with time: laws known beforehand (docs/explanation/choosing.md), with what a
// trial measured.
inline constexpr double kNever = std::numeric_limits<double>::infinity();

// The estimates of a method after its trial; errors are relative to luminance.
struct MethodCost {
    enum class Kind {
        rays,    // every sample is worth the same, and nothing else matters
        maps,    // photons or VPLs are made once: more of them, or more samples
        passes,  // all is made anew in every pass
    } kind = Kind::rays;
    double once = 0;      // seconds before it that do not grow with the work: a pre-pass, guides
    double prepare = 0;   // seconds; of a pass
    double sample = 0;    // seconds, of one sample of every pixel of the image; of a pass, all of its samples
    double variance = 0;  // of one sample (pass), squared share, mean over pixels
    // Where rare samples have most of it: the variance of N times as many samples, as they show it, is N^tail
    // times as large. The trial's were `seen` samples of each pixel of the image, on average: far fewer
    // than 1.
    double tail = 0, seen = 1;
    double beyond = 0;     // squared share: of what was made for `prepare`; of the passes of the trial
    double power = 0;      // `beyond` falls with so much more work by that power
    double passes = 0;     // of the trial
    double most_work = 1;  // times that of the trial, for maps
};

// Returns the variance of one sample as it appears in an image of `samples` samples per pixel.
double variance_in(double samples, const MethodCost& cost);

// The exponent `tail` of MethodCost for samples that deviate from their means by so much, relative to them,
// not negative: 2/a - 1 where the largest are as a distribution of tail index a < 2, whose variance is
// infinite; else 0. The index is Hill's estimate [Hill 1975] from the largest fiftieth.
double tail_exponent(std::vector<double> deviations);

struct Expectation {
    double error = 0, seconds = 0;  // infinite: cannot be done
    double beyond = 0;              // squared share
    double work = 1;                // times the trial's, a power of two: photons or sets of VPLs
};
// The least error in the time; infinite where it is too short for one sample of every pixel, or two passes.
Expectation best_in(double seconds, const MethodCost& cost);
// The shortest time to the error, of which at most half is beyond noise; infinite where no work gets there.
Expectation soonest_below(double error, const MethodCost& cost);

}  // namespace lucerna
