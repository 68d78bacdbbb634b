#include "engine/cli/method_selection.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/units.h"

namespace lucerna {
namespace {

std::string options_text(const IntegratorSettings& settings) {
    std::string text = fmt::format("--integrator {}", integrator_name(settings));
    const auto defaults = describe(make_settings(integrator_name(settings), {}));
    const auto values = describe(settings);
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (values[i] != defaults[i]) text += fmt::format(" --set {}={}", values[i].first, values[i].second);
    }
    return text;
}

std::string limits_text(const Limits& limits) {
    return limits.error > 0 ? fmt::format("to {:g} %", 100 * limits.error)
                            : fmt::format("in {}", duration_text(limits.seconds));
}

}  // namespace

std::optional<MethodChoice> select_method(Job& job, RenderOptions& options, Monitor& monitor) {
    auto choice = choose_method(job, options.limits, options.seed, options.workers, monitor);
    if (!choice) {
        if (!monitor.stopped())
            monitor.info(fmt::format("method   {}, the scene's own: no other shows the same picture",
                                     integrator_name(job.integrator)));
        return std::nullopt;
    }
    job.integrator = choice->settings;
    monitor.info(fmt::format("method   {}", options_text(job.integrator)));
    monitor.info(fmt::format("tried    {} ({})", choice->tried, limits_text(options.limits)));
    // What more samples do not mend is half of the error at most and leaves that much less for noise.
    options.limits.error = std::sqrt(std::max(sqr(options.limits.error) - sqr(choice->beyond_noise), 0.0));
    return choice;
}

}  // namespace lucerna
