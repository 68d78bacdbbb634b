// Chooses the method, with its settings, that renders the best image in a given time or reaches a given error
// soonest: by a short trial of each method, and by how errors are known to fall with more work
// (docs/explanation/choosing.md).
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
    // Expected error, as of Film::relative_error() (NaN without trials), and expected seconds of preparation
    // and rendering.
    double error = 0, seconds = 0;
    // The part of the error that more samples do not reduce, estimated on the safe side: that of the finite
    // number of photons or VPLs. 0 if there is none.
    double beyond_noise = 0;
    std::string tried;  // every method and its expected result, as text
};

struct Method {
    IntegratorSettings settings;  // for its trial: few photons, few sets of VPLs
    double least_seconds;         // least time of a useful trial
    // Whether it is always tried if an error is requested. One method of each kind is, since no error of the
    // other methods reveals light that they all miss.
    bool always = false;
};
// Returns the methods that show the same image as `asked`, the unbiased one first, then the other kinds, then
// variants of these; `asked` alone if there are none. `aimed`: all photons are emitted by an importance
// pre-pass; otherwise variants alone have one.
std::vector<Method> methods_like(const IntegratorSettings& asked, bool aimed = false);

// Chooses by limits.error if there is one, else by limits.seconds. Trials take at most a tenth of the time,
// and are cut when it is over, or a tenth of the time that the best method is expected to need to the error.
// With a second or two there are no trials: it chooses progressive passes, or path tracing if a medium emits
// light. If the job requests light groups, methods that do not support them are left out. Returns none if
// there is only one method or the user stopped it. `head_start`: the seconds in which the first of the
// methods has already rendered a sample of each pixel, which are not part of limits.seconds; 0: it has not.
std::optional<MethodChoice> choose_method(const Job& job, const Limits& limits, std::uint64_t seed,
                                          const Workers& workers, Monitor& monitor, double head_start = 0);

// Model of how a method's error falls with time: known laws (docs/explanation/choosing.md) with the
// measurements of a trial.
inline constexpr double kNever = std::numeric_limits<double>::infinity();

// The estimates of a method after its trial; errors are relative to luminance.
struct MethodCost {
    enum class Kind {
        rays,    // all samples are alike, and there is no other cost
        maps,    // photons or VPLs are made once; more of them, or more samples, help
        passes,  // every pass makes new photons
    } kind = Kind::rays;
    double once = 0;      // seconds of preparation that do not grow with the work
    double prepare = 0;   // seconds of other preparation, or of that of a pass
    double sample = 0;    // seconds for one sample of every pixel, or for all samples of a pass
    double growth = 0;    // with twice the work, a sample takes longer by this share of `sample`
    double variance = 0;  // of one sample (pass), relative, mean over pixels
    // If rare samples dominate, the variance found by N times as many samples is N^tail times as large. The
    // trial had `seen` samples per pixel of the image, on average far fewer than 1.
    double tail = 0, seen = 1;
    // Above 0: the image is denoised, which leaves this share of its squared noise to the power of
    // kDenoisedPower.
    double left = 0;
    double missed = 0;     // variance of one sample by light that samples miss, which no denoiser restores
    double beyond = 0;     // squared relative error beyond noise, of the trial's photons, VPLs or passes
    double power = 0;      // `beyond` falls with the work to this power
    double passes = 0;     // passes of the trial
    double most_work = 1;  // largest work relative to the trial, for maps
};

// Returns the variance of one sample as it appears in an image of `samples` samples per pixel.
double variance_in(double samples, const MethodCost& cost);

// Returns the squared noise of an image of `samples` samples per pixel, or what the denoiser leaves of it.
double noise2_in(double samples, const MethodCost& cost);
// Measured in ten scenes of 256 x 256 pixels, of paths and virtual lights alike: where noise is large, so is
// the share that is removed.
inline constexpr double kDenoisedPower = 0.6;

// Returns the exponent `tail` of MethodCost for samples with these absolute relative deviations from their
// means: 2/a - 1 if the largest follow a distribution of tail index a < 2, whose variance is infinite; else
// 0. The index is Hill's estimate [Hill 1975] from the largest fiftieth.
double tail_exponent(std::vector<double> deviations);

struct Expectation {
    double error = 0, seconds = 0;  // infinite: not attainable
    double beyond = 0;              // squared relative error
    double work = 1;                // photons or sets of VPLs relative to the trial, a power of two
};
// Returns the least error in the time; infinite if it is too short for one sample of every pixel, or two
// passes.
Expectation best_in(double seconds, const MethodCost& cost);
// Returns the shortest time to the error, at most half of which may be beyond noise; infinite if no work
// reaches it.
Expectation soonest_below(double error, const MethodCost& cost);

}  // namespace lucerna
