// Which method, with which settings, makes the best image in a time, or one that is good enough soonest: by a
// short trial of each and by how errors are known to fall with more work (docs/choosing.md).
#pragma once

#include <cstdint>
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
    // Expected, as Film::relative_error() counts it; and seconds of preparation and image.
    double error = 0, seconds = 0;
    // The part of the error that more samples do not mend, as large as it may well be: what photons or
    // VPLs of their number leave. 0 where there is none.
    double beyond_noise = 0;
    std::string tried;  // every method and what was expected of it, for people
};

struct Method {
    IntegratorSettings settings;  // of its trial: few photons, few sets of VPLs
    double least_seconds;         // with which it is worth trying
};
// What shows the same picture as `asked`, first the one that has no bias; `asked` alone if nothing else does.
std::vector<Method> methods_like(const IntegratorSettings& asked);

// By limits.error if there is one, else by limits.seconds. Takes a twelfth of the time, or of what the best
// method is expected to need, or little more. None if there is nothing to choose from or the user stopped it.
std::optional<MethodChoice> choose_method(const Job& job, const Limits& limits, std::uint64_t seed,
                                          const Workers& workers, Monitor& monitor);

}  // namespace lucerna
