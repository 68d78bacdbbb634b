// The computations of `lucerna lux`: of the lamps themselves, of their far fields, of colours, and of the
// lamps' bootstrap replicates.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/cli/command_files.h"
#include "engine/cli/photometry/photometry_options.h"
#include "engine/cli/photometry/surface_options.h"
#include "engine/photometry/en12464.h"
#include "engine/photometry/far_field_error.h"
#include "engine/photometry/glare.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/light_colour.h"
#include "engine/photometry/maintenance.h"
#include "engine/photometry/measurement_uncertainty.h"
#include "engine/photometry/requirement_table.h"

namespace lucerna {

struct LuxCommand {
    PhotometryOptions common;
    std::string image, html, pdf, plan, picture;
    SurfaceOptions surfaces;
    IlluminanceOptions options;
    RequiredLighting requirements;
    MaintenanceFactors maintenance;
    std::vector<std::pair<std::string, std::string>> about;
    double eye_height = 1.2;  // m
    double hours = 0;         // of use in a year; 0: not given
    bool daylight_factor = false, far_field_error = false, replicates = false, colour = false;
    bool has_precision = false;

    bool has_page() const { return !html.empty() || !pdf.empty(); }
    bool draws_plans() const { return has_page() || !plan.empty(); }
    bool requires_any() const {
        return std::ranges::any_of(requirements.limits, [](const auto& range) { return range.has_value(); });
    }
    bool computes_colour() const {
        return colour || required(requirements.limits, Requirement::ra).has_value();
    }
};

struct LuxResults {
    IlluminanceReport report;
    std::vector<GlareReport> glare;  // of the requirements' observers
    std::vector<Judgement> judgements;
    FarFieldErrors errors;
    ColourReport colour;
    MeasurementUncertainty uncertainty;
};

class LuxRuns {
  public:
    // Finds the surfaces of the command and of its requirements, and declares the replicates of the lamps as
    // inputs. `clock`, `lamps` and `monitor` must outlive this object. `clock` began with the command. Throws
    // InputError for options that do not go together or that the scene has nothing for.
    LuxRuns(const LuxCommand& command, const Stopwatch& clock, const std::set<std::filesystem::path>& lamps,
            const Job& job, CommandFiles& files, Monitor& monitor);

    const RoomSurfaces& room() const { return room_; }
    std::span<const CalculationSurface> surfaces() const { return room_.surfaces; }
    LuxResults compute(Job job) const;
    // Throws Stopped if the user ended the computation, or if parts of the results are missing.
    void throw_if_stopped(const LuxResults& results) const;

  private:
    std::vector<GlareReport> glare() const;

    LuxCommand command_;  // with the precision that its outputs ask for
    const Stopwatch& clock_;
    const std::set<std::filesystem::path>& lamps_;
    Monitor& monitor_;
    RoomSurfaces room_;
    double sky_ = 0;  // illuminance that daylight factors are relative to
    int replicates_ = 0;
};

}  // namespace lucerna
