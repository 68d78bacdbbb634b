// lucerna lux --replicates: illuminance by each bootstrap replicate of a scene's lamps.
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

// The time of a command, shared out among its runs: what one leaves is the others'.
class RunTimes {
  public:
    // A run by the lamps themselves, one by their far fields if wanted, and one by each replicate. Each of
    // the first two gets a third of what all replicates get: the Monte Carlo noise of the numbers themselves
    // counts in full, that of the replicates is taken off.
    RunTimes(const Stopwatch& clock, double seconds, bool far_field, int replicates)
        : clock_(clock),
          seconds_(seconds),
          of_lamps_(std::max(1.0, replicates / 3.0)),
          shares_(of_lamps_ * (far_field ? 2 : 1) + replicates) {}

    double left() const { return seconds_ - clock_.seconds(); }
    // Of the next run; may be 0 or less.
    double by_lamps() { return next(of_lamps_); }
    // At least `least`, if that is left: with little time there are fewer replicates.
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
    double shares_;  // that are left
};

// How many replicates there are of each of these light fields; of some more than of others: of the fewest,
// with a warning. Declares them as inputs. Throws InputError: no light field, one with fewer than
// kLeastReplicates, or one whose replicates are not its own.
int replicates_of(const std::set<std::filesystem::path>& lamps, const std::string& scene, CommandFiles& files,
                  Monitor& monitor);

// The points of `whole` once more by each of the replicates 1 to `count`, each of all lamps at once, with as
// many samples, or those that there is time for, and random numbers of its own. Those that were completed
// before the time ended or the user stopped.
std::vector<IlluminanceReport> by_replicates(const PhotometryOptions& common,
                                             std::span<const CalculationSurface> surfaces,
                                             const IlluminanceReport& whole, IlluminanceOptions options,
                                             int count, RunTimes& times, Monitor& monitor);

}  // namespace lucerna
