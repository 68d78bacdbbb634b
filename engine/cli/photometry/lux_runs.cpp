#include "engine/cli/photometry/lux_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "engine/base/error.h"
#include "engine/cli/photometry/luminaire_types.h"
#include "engine/cli/photometry/lux_replicates.h"
#include "engine/photometry/daylight_factor.h"
#include "lights/lumigraph.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/measurement/ray_bootstrap.h"

namespace lucerna {
namespace {

constexpr double kPrecisionOfReports = 0.005;

std::vector<CalculationSurface> surfaces_of(const LuxCommand& command, const Job& job) {
    std::vector<CalculationSurface> surfaces = command.surfaces.all(job);
    if (surfaces.empty()) {
        if (const std::string& option = command.surfaces.shaped_by; !option.empty() && !job.surfaces.empty())
            throw InputError(
                {option},
                "applies to --height, --floors and --surface only, and not to the scene's surfaces");
        surfaces = job.surfaces;
    }
    if (surfaces.empty()) {
        throw InputError({command.common.scene},
                         "has no CalculationSurface; use --height 0.75, --floors 0.75 or --surface "
                         "NAME=X,Y,Z:X,Y,Z:X,Y,Z");
    }
    return surfaces;
}

RoomSurfaces room_of(const LuxCommand& command, const Job& job) {
    return room_surfaces(job.scene, surfaces_of(command, job), command.requirements.limits,
                         command.eye_height, command.surfaces.up(job), is_right_handed(job));
}

// Returns the illuminance that daylight factors are relative to.
double sky_of(const LuxCommand& command, const Scene& scene) {
    for (const auto& [is_set, option] :
         {std::pair(command.far_field_error, "--far-field-error"),
          std::pair(command.replicates, "--replicates"), std::pair(command.colour, "--colour")}) {
        if (is_set) throw InputError({option}, "is about lamps, which a daylight factor leaves out");
    }
    for (const auto& [is_set, option] : {std::pair(command.maintenance.applies(), "--maintenance-factor"),
                                         std::pair(command.requires_any(), "--require")}) {
        if (is_set) throw InputError({option}, "is about illuminances, not about daylight factors");
    }
    try {
        return sky_illuminance(scene);
    } catch (const InputError& error) {
        throw InputError({command.common.scene}, error.what());
    }
}

struct ByFarField {
    IlluminanceReport report;
    double floor = 0;          // the largest error of the lamps' grids
    bool has_opening = false;  // of any lamp
};

// Measures the same points with the lamps' far fields, which shine from a point or from the luminous opening
// that `light farfield` writes.
ByFarField by_far_field(const LuxCommand& command, std::span<const CalculationSurface> surfaces,
                        double seconds, bool from_point, Monitor& monitor) {
    ByFarField result;
    PhotometryOptions common = command.common;
    const Workers& workers = command.options.workers;
    std::size_t lamps = 0;
    FarFieldGrid as_rendered;
    as_rendered.as_rendered = true;
    common.overrides.far_field = [&](const std::filesystem::path& file) {
        ++lamps;
        PhotometricWeb made = far_field_of(file, as_rendered, workers, monitor);
        result.floor = std::max(result.floor, made.info().grid_error);
        result.has_opening = result.has_opening || made.info().opening.faces().second > 0;
        if (from_point) made.set_opening({});
        return made;
    };
    CommandFiles same;  // the files of the first reading
    Job job = common.read(workers, same, monitor);
    if (lamps == 0) {
        throw InputError({command.common.scene},
                         "has no measured lamp; --far-field-error compares the near field of a light field "
                         "or ray file with its far field");
    }
    IlluminanceOptions options = command.options;
    // Independent of the other computations.
    options.seed ^= from_point ? 0x9e3779b97f4a7c15U : 0xd1b54a32d192ed03U;
    options.seconds = seconds;
    result.report = illuminance_on(surfaces, std::move(job), options, monitor);
    maintain(result.report, command.maintenance);
    return result;
}

// The run from the opening is left out if no lamp has one, as ray files have not.
FarFieldErrors far_field_errors_of(const LuxCommand& command, std::span<const CalculationSurface> surfaces,
                                   const IlluminanceReport& near, RunTimes& times, Monitor& monitor) {
    FarFieldErrors errors;
    const ByFarField point = by_far_field(command, surfaces, times.by_lamps(), true, monitor);
    errors.floor = point.floor;
    errors.from_point = far_field_errors(near, point.report);
    if (!point.has_opening) return errors;
    const ByFarField opening = by_far_field(command, surfaces, times.by_lamps(), false, monitor);
    errors.from_opening = far_field_errors(near, opening.report);
    return errors;
}

constexpr int kColourRuns = 4;  // at most

// Returns no colours, with a warning, if it was stopped.
ColourReport colour_of(const LuxCommand& command, const std::set<std::filesystem::path>& lamps,
                       const IlluminanceReport& report, RunTimes& times, Monitor& monitor) {
    const auto read = [&](const WorkingSpace& intervals) {
        SceneOverrides overrides = command.common.overrides;
        overrides.colours = intervals;
        return read_scene(command.common.scene, overrides, command.options.workers, monitor);
    };
    ColourReport colour;
    try {
        colour = colour_on(
            report, read, command.options, [&times] { return times.by_lamps(); }, monitor);
    } catch (const Stopped& stopped) {
        monitor.warn(fmt::format("colours are not computed: {}", stopped.what()));
        return colour;
    }
    for (const std::filesystem::path& lamp : lamps) {
        const Lumigraph fields = read_lumigraph(lamp);
        for (const LightField* field : fields_of(fields))
            colour.spectra_error = std::max(colour.spectra_error, field->info().spectra.error);
    }
    return colour;
}

// Returns no uncertainty, with a warning, if there are too few replicates.
MeasurementUncertainty uncertainty_of(const IlluminanceReport& report,
                                      const std::vector<IlluminanceReport>& by_replicate, int asked,
                                      Monitor& monitor) {
    const int done = static_cast<int>(by_replicate.size());
    if (done < kLeastReplicates) {
        monitor.warn(fmt::format("{} of {} replicates were computed; an uncertainty needs at least {}", done,
                                 asked, kLeastReplicates));
        return {};
    }
    if (done < asked) monitor.warn(fmt::format("{} of {} replicates were computed", done, asked));
    return measurement_uncertainty(report, by_replicate);
}

}  // namespace

LuxRuns::LuxRuns(const LuxCommand& command, const Stopwatch& clock,
                 const std::set<std::filesystem::path>& lamps, const Job& job, CommandFiles& files,
                 Monitor& monitor)
    : command_(command), clock_(clock), lamps_(lamps), monitor_(monitor) {
    if (command.has_page() && !command.has_precision) command_.options.precision = kPrecisionOfReports;
    if (command.daylight_factor) sky_ = sky_of(command, job.scene);
    room_ = room_of(command, job);
    if (command.replicates) replicates_ = replicates_of(lamps, command.common.scene, files, monitor);
}

std::vector<GlareReport> LuxRuns::glare() const {
    constexpr double kShare = 0.2;  // of the time
    if (room_.observers.empty()) return {};
    GlareOptions options;
    options.seed = command_.options.seed;
    options.workers = command_.options.workers;
    options.seconds = kShare * command_.options.seconds;
    CommandFiles same;  // the files of the first reading
    return glare_at(room_.observers, command_.common.read(options.workers, same, monitor_), options,
                    monitor_);
}

LuxResults LuxRuns::compute(Job job) const {
    LuxResults results;
    results.glare = glare();
    IlluminanceOptions options = command_.options;
    const int runs = 1 + (command_.far_field_error ? 2 : 0) + (command_.computes_colour() ? kColourRuns : 0);
    RunTimes times(clock_, command_.options.seconds, runs, replicates_);
    options.seconds = times.by_lamps();
    IlluminanceReport& report = results.report;
    report = illuminance_on(surfaces(), std::move(job), options, monitor_);
    if (command_.daylight_factor) report = daylight_factors(std::move(report), sky_);
    maintain(report, command_.maintenance);
    if (command_.far_field_error)
        results.errors = far_field_errors_of(command_, surfaces(), report, times, monitor_);
    if (command_.computes_colour() && report.ended_by != "user")
        results.colour = colour_of(command_, lamps_, report, times, monitor_);
    results.judgements =
        judge(room_, report.surfaces, results.glare, results.colour, command_.requirements.limits);
    if (replicates_ == 0 || report.ended_by == "user") return results;
    std::vector<IlluminanceReport> by_replicate =
        by_replicates(command_.common, surfaces(), report, command_.options, replicates_, times, monitor_);
    for (IlluminanceReport& of_replicate : by_replicate) maintain(of_replicate, command_.maintenance);
    results.uncertainty = uncertainty_of(report, by_replicate, replicates_, monitor_);
    if (results.uncertainty.replicates == 0) return results;
    for (const std::filesystem::path& lamp : lamps_)
        results.uncertainty.fields.push_back(field_error(lamp.string(), fields_of(read_lumigraph(lamp))));
    return results;
}

void LuxRuns::throw_if_stopped(const LuxResults& results) const {
    if (results.report.ended_by == "user")
        throw Stopped("interrupted: the confidence intervals are wider than --precision");
    if (command_.computes_colour() && results.colour.surfaces.empty() && monitor_.stopped())
        throw Stopped("interrupted: colours are not computed");
    if (results.uncertainty.replicates < replicates_ && monitor_.stopped()) {
        throw Stopped(fmt::format("interrupted: {} of {} replicates are in the uncertainty",
                                  results.uncertainty.replicates, replicates_));
    }
}

}  // namespace lucerna
