// How a method's error falls with time: laws known beforehand (docs/choosing.md), with what a trial measured.
#pragma once

#include <limits>

namespace lucerna {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

// What is known of a method after its trial; errors are shares of luminance.
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
    double beyond = 0;    // squared share: of what was made for `prepare`; of the passes of the trial
    double power = 0;     // `beyond` falls with so much more work by that power
    double passes = 0;    // of the trial
    double most_work = 1;  // times that of the trial, for maps
};

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
