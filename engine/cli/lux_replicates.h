// lucerna lux --replicates: illuminance by each bootstrap replicate of a scene's lamps.
#pragma once

#include <filesystem>
#include <set>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/photometry_options.h"
#include "engine/photometry/illuminance.h"

namespace lucerna {

// The time of a command, shared out among runs of the same length: what one leaves is the others'.
class RunTimes {
  public:
    RunTimes(const Stopwatch& clock, double seconds, int runs)
        : clock_(clock), seconds_(seconds), runs_(runs) {}
    // Of the next run; may be 0 or less.
    double next() { return (seconds_ - clock_.seconds()) / runs_--; }

  private:
    const Stopwatch& clock_;
    double seconds_;
    int runs_;
};

// How many replicates there are of each of these light fields; of some more than of others: of the fewest,
// with a warning. Declares them as inputs. Throws InputError: no light field, one with fewer than
// kLeastReplicates, or one whose replicates are not its own.
int replicates_of(const std::set<std::filesystem::path>& lamps, const std::string& scene, CommandFiles& files,
                  Monitor& monitor);

// The points of `whole` once more by each of the replicates 1 to `count`, each of all lamps at once, with as
// many samples and random numbers of its own. Those that were completed before the time ended or the user
// stopped.
std::vector<IlluminanceReport> by_replicates(const PhotometryOptions& common,
                                             std::span<const CalculationSurface> surfaces,
                                             const IlluminanceReport& whole, IlluminanceOptions options,
                                             int count, RunTimes& times, Monitor& monitor);

}  // namespace lucerna
