#include "engine/cli/render/run_report.h"

#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "engine/base/elementary.h"
#include "engine/base/parallel.h"
#include "engine/base/version.h"
#include "engine/cli/parallel_job.h"
#include "engine/cli/run.h"
#include "engine/render/chance_light.h"
#include "engine/scene/arithmetic.h"
#include "engine/system/memory.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

using Json = nlohmann::ordered_json;

// Returns parameters with their own types instead of text.
Json settings_json(IntegratorSettings settings) {
    Json json = Json::object();
    for (const Field& field : fields(settings)) {
        const std::string name(field.name);
        if (!field.choices.empty()) {
            json[name] = field.text();
        } else {
            std::visit([&](const auto* value) { json[name] = *value; }, field.target);
        }
    }
    return json;
}

}  // namespace

std::string statistics_json(const RunFacts& facts, const Job& job, const RenderReport& report,
                            const std::filesystem::path& image_file) {
    Json json;
    json["program"] = "lucerna";
    json["version"] = program_version();
    json["arithmetic"] = arithmetic();
    json["scene"] = facts.scene.string();
    json["integrator"] = integrator_name(job.integrator);
    json["settings"] = settings_json(job.integrator);
    json["seed"] = facts.seed;
    json["threads"] = facts.threads;
    json["image"] = {{"width", job.film.rendered_size().x},
                     {"height", job.film.rendered_size().y},
                     {"file", image_file.string()}};
    if (const auto error = picture_error(facts, report)) json["image"]["error"] = *error;
    json["samples"] = {{"asked", job.spp == kNoEndOfSamples ? Json() : Json(job.spp)},
                       {"done", report.samples_done}};
    if (report.whole_after > 0) json["whole_after"] = facts.read_seconds + report.whole_after;
    json["complete"] = report.complete;
    Json seconds = {{"read", facts.read_seconds}};
    if (facts.choice) seconds["choose"] = facts.choose_seconds;
    for (const PhaseSeconds* phases : {&report.once.seconds, &report.passes.seconds, &report.seconds}) {
        for (const auto& [phase, time] : *phases) seconds[phase] = time;
    }
    seconds["total"] = facts.read_seconds + facts.choose_seconds + facts.render_seconds;
    json["seconds"] = std::move(seconds);
    if (facts.choice) {
        json["choice"] = {{"tried", facts.choice->tried},
                          {"expected_error", facts.choice->error},
                          {"expected_seconds", facts.choice->seconds},
                          {"beyond_noise", facts.choice->beyond_noise}};
    }
    json["numbers"] = report.numbers();
    json["notes"] = report.notes();
    json["warnings"] = facts.warnings;
    json["peak_memory_bytes"] = peak_memory();
    for (const RankReport& rank : report.ranks) {
        json["ranks"].push_back(
            {{"host", rank.host},
             {"threads", rank.threads},
             {"tiles", rank.tiles},
             {"rays", rank.rays},
             {"seconds", {{"prepare", rank.prepare_seconds}, {"image", rank.image_seconds}}},
             {"processor_seconds",
              {{"prepare", rank.prepare_processor_seconds}, {"image", rank.image_processor_seconds}}},
             {"peak_memory_bytes", rank.peak_memory}});
    }
    for (const auto& [what, traffic] : report.traffic) {
        json["traffic"][what] = {{"calls", traffic.calls},
                                 {"bytes", traffic.bytes},
                                 {"waited_seconds", traffic.waited},
                                 {"seconds", traffic.seconds}};
    }
    // File names need not be UTF-8; an invalid byte must not lose the statistics.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::optional<double> picture_error(const RunFacts& facts, const RenderReport& report) {
    if (report.denoised_error)
        return std::isfinite(*report.denoised_error) ? report.denoised_error : std::nullopt;
    if (!report.relative_error) return std::nullopt;
    return hypot(*report.relative_error, facts.choice ? facts.choice->beyond_noise : 0);
}

std::map<std::string, std::string> header_attributes(const RunFacts& facts, const Job& job,
                                                     const RenderReport& report) {
    std::map<std::string, std::string> attributes{
        {"lucerna.version", std::string(program_version())},
        {"lucerna.arithmetic", arithmetic()},
        {"lucerna.scene", facts.scene.string()},
        {"lucerna.integrator", std::string(integrator_name(job.integrator))},
        {"lucerna.seed", fmt::format("{}", facts.seed)},
        {"lucerna.spp", fmt::format("{}", report.samples_done)},
        {"lucerna.seconds", fmt::format("{:.3f}", facts.render_seconds)},
    };
    if (!job.film.colours.is_srgb()) attributes["lucerna.colourspace"] = std::string(job.film.colours.name());
    if (!report.complete) attributes["lucerna.stopped"] = fmt::format("{} spp", report.samples_done);
    if (report.passes_done > 0) attributes["lucerna.passes"] = fmt::format("{}", report.passes_done);
    if (report.blur && *report.blur > 0) attributes["lucerna.blur"] = fmt::format("{:.4g}", *report.blur);
    if (facts.choice) attributes["lucerna.tried"] = facts.choice->tried;
    for (const auto& [name, value] : describe(job.integrator)) attributes["lucerna." + name] = value;
    return attributes;
}

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

// Describes the numbers beside the methods, expectations for whole renders from much shorter trials.
std::string expectations_text(const Limits& limits) {
    return limits.error > 0
               ? fmt::format("expected times to {:g} %, from short trials", 100 * limits.error)
               : fmt::format("expected errors after {}, from short trials", duration_text(limits.seconds));
}

}  // namespace

namespace {

// Sets the job's method to the one with the smallest estimated error within the limits, and says which it is.
// Returns nothing, without changes, if no other method gives the same image or the user stopped it.
std::optional<MethodChoice> select_method(Job& job, const RenderOptions& options, const ChoiceLimits& limits,
                                          Monitor& monitor) {
    auto choice =
        choose_method(job, limits.limits, options.seed, options.workers, monitor, limits.head_start);
    if (!choice) {
        if (!monitor.stopped())
            monitor.info(
                fmt::format("method   {}, as in the scene: no other method computes the same picture",
                            integrator_name(job.integrator)));
        return std::nullopt;
    }
    job.integrator = choice->settings;
    // Without mirrors and glass there are no chains, so that the option would say nothing.
    if (auto* path = std::get_if<PathSettings>(&job.integrator); path && !job.scene.has_specular())
        path->chains = PathSettings().chains;
    monitor.info(fmt::format("method   {}", options_text(job.integrator)));
    monitor.info(std::isnan(choice->error)
                     ? fmt::format("tried    {}", choice->tried)
                     : fmt::format("tried    {} ({})", choice->tried, expectations_text(limits.limits)));
    return choice;
}

}  // namespace

RenderResult render_by_choice(Job& job, const RenderOptions& options, RunFacts& facts, Monitor& monitor) {
    Ranks* const ranks = options.workers.ranks;
    std::optional<ChanceLight> hidden;
    const auto choose = [&](const ChoiceLimits& limits) {
        const Stopwatch clock;
        if (!ranks || ranks->leads()) facts.choice = select_method(job, options, limits, monitor);
        if (ranks) share_settings(*ranks, job.integrator);
        RenderOptions rest = options;
        rest.limits = limits.limits;
        hidden = light_that_paths_hardly_find(job, rest, monitor);
        facts.choose_seconds = clock.seconds();
        // Subtracts the error that more samples do not reduce, which a choice keeps below half of the limit,
        // and leaves the rest for noise. With two halves of samples the render measures that error itself.
        const double error = limits.limits.error;
        if (job.film.two_halves || !facts.choice) return error;
        return std::sqrt(std::max(sqr(error) - sqr(facts.choice->beyond_noise), 0.0));
    };
    RenderResult result = render_choosing(job, options, monitor, choose);
    if (hidden && std::holds_alternative<PathSettings>(job.integrator) && (!ranks || ranks->leads()))
        warn_of_missing_light(job, *hidden, result, monitor);
    return result;
}

RenderResult render_as_asked(Job& job, const RenderOptions& options, Monitor& monitor) {
    const Stopwatch clock;
    const std::optional<ChanceLight> hidden = light_that_paths_hardly_find(job, options, monitor);
    RenderOptions rest = options;
    rest.limits.seconds -= clock.seconds();
    RenderResult result = render(job, rest, monitor);
    if (hidden && (!options.workers.ranks || options.workers.ranks->leads()))
        warn_of_missing_light(job, *hidden, result, monitor);
    return result;
}

namespace {

// Linux lists every processor, all of one kind.
std::string processor_name() {
    std::ifstream in("/proc/cpuinfo");
    for (std::string line; std::getline(in, line);) {
        if (!line.starts_with("model name")) continue;
        const std::size_t colon = line.find(':');
        if (colon != std::string::npos && line.size() > colon + 2) return line.substr(colon + 2);
    }
    return "unknown processor";
}

}  // namespace

std::string machine_text() {
    const int processors = Workers{}.threads;
    return fmt::format("{}, {} processor{}", processor_name(), processors, processors == 1 ? "" : "s");
}

std::string today_text() {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    gmtime_r(&now, &parts);
    return fmt::format("{:04d}-{:02d}-{:02d}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday);
}

}  // namespace lucerna
