// lucerna lux --replicates: computes illuminance with each bootstrap replicate of a scene's lamps.
#pragma once

#include <algorithm>
#include <filesystem>
#include <set>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/photometry/photometry_options.h"
#include "engine/photometry/illuminance.h"

namespace lucerna {

// Distributes a command's time among its runs; each run leaves its unused time to the following ones.
class RunTimes {
  public:
    // Plans `runs` with the lamps themselves or their far fields, and one with each replicate. The former get
    // a third each of the total time of the replicates, because the Monte Carlo noise of the results counts
    // in full, while that of the replicates is subtracted.
    RunTimes(const Stopwatch& clock, double seconds, int runs, int replicates)
        : clock_(clock),
          seconds_(seconds),
          of_lamps_(std::max(1.0, replicates / 3.0)),
          shares_(of_lamps_ * runs + replicates) {}

    double left() const { return seconds_ - clock_.seconds(); }
    // Returns the time of the next run, possibly <= 0.
    double by_lamps() { return next(of_lamps_); }
    // Returns at least `least` if that is left, so that little time means fewer replicates.
    double by_replicate(double least) { return std::min(left(), std::max(next(1), least)); }

  private:
    double next(double shares) {
        const double time = left() * shares / shares_;
        shares_ -= shares;
        return time;
    }

    const Stopwatch& clock_;
    double seconds_;
    double of_lamps_;
    double shares_;  // of the remaining runs
};

// Returns how many replicates these light fields have, the smallest number with a warning if it differs
// between them. Declares the replicates as inputs. Throws InputError if there is no light field, one has
// fewer than kLeastReplicates, or its replicates belong to another lamp.
int replicates_of(const std::set<std::filesystem::path>& lamps, const std::string& scene, CommandFiles& files,
                  Monitor& monitor);

// Computes the points of `whole` with each of the replicates 1 to `count`, each of all lamps at once, with as
// many samples as time allows, at most those of `whole`, and independent random numbers. Returns those
// completed before the time ended or the user stopped.
std::vector<IlluminanceReport> by_replicates(const PhotometryOptions& common,
                                             std::span<const CalculationSurface> surfaces,
                                             const IlluminanceReport& whole, IlluminanceOptions options,
                                             int count, RunTimes& times, Monitor& monitor);

}  // namespace lucerna
