#include "engine/photometry/light_colour.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/photometry/path_rounds.h"
#include "engine/render/chance_light.h"
#include "engine/scene/path_account.h"
#include "engine/scene/quantity.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

constexpr std::size_t kColourBatches = 16;
constexpr double kFirstInterval = 400, kLastInterval = 700;  // nm
constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

// T_g in intervals of wavelengths at all points, for each batch of sensors.
struct ArrivingLight {
    std::size_t groups = 0, intervals = 0;
    std::vector<double> values;  // [point][batch][group][interval]

    // Returns where the first interval of a group is.
    std::size_t index(std::size_t point, std::size_t batch, std::size_t group) const {
        return ((point * kColourBatches + batch) * groups + group) * intervals;
    }
};

// Reads the three intervals of a run.
ArrivingLight read_run(const RenderResult& result, const std::vector<std::string>& groups, std::size_t points,
                       std::size_t sensors) {
    const Image& parts = result.parts.value();
    ArrivingLight read{groups.size(), 3, std::vector<double>(points * kColourBatches * groups.size() * 3)};
    const std::size_t each = sensors / kColourBatches;  // a multiple, by place_sensors()
    for (std::size_t g = 0; g < groups.size(); ++g) {
        const std::size_t first = find_channel(parts, kLightGroupPrefix + groups[g] + ".R").value();
        for (std::size_t pixel = 0; pixel < points * sensors; ++pixel) {
            const float* rgb = &parts.data[pixel * parts.channels.size() + first];
            const std::size_t to = read.index(pixel / sensors, pixel % sensors / each, g);
            for (std::size_t c = 0; c < 3; ++c)
                read.values[to + c] += double{rgb[c]} / static_cast<double>(each);
        }
    }
    return read;
}

bool is_grey(const ArrivingLight& run) {
    constexpr double kRounding = 1e-5;
    for (std::size_t i = 0; i < run.values.size(); i += 3) {
        const auto [least, most] = std::minmax({run.values[i], run.values[i + 1], run.values[i + 2]});
        if (most - least > kRounding * most) return false;
    }
    return true;
}

// Puts the intervals of a run behind those of earlier ones.
void append(ArrivingLight& all, const ArrivingLight& run) {
    ArrivingLight joined{run.groups, all.intervals + run.intervals, {}};
    const std::size_t rows = run.values.size() / run.intervals;
    for (std::size_t row = 0; row < rows; ++row) {
        for (const ArrivingLight* from : {static_cast<const ArrivingLight*>(&all), &run}) {
            const auto begin = from->values.begin() + static_cast<std::ptrdiff_t>(row * from->intervals);
            joined.values.insert(joined.values.end(), begin,
                                 begin + static_cast<std::ptrdiff_t>(from->intervals));
        }
    }
    all = std::move(joined);
}

// Keeps every second interval, from `first` on.
ArrivingLight every_second(const ArrivingLight& all, std::size_t first) {
    ArrivingLight kept{all.groups, 0, {}};
    for (std::size_t i = first; i < all.intervals; i += 2) ++kept.intervals;
    for (std::size_t i = 0; i < all.values.size(); ++i)
        if (i % all.intervals % 2 == first) kept.values.push_back(all.values[i]);
    return kept;
}
std::vector<double> every_second(const std::vector<double>& all, std::size_t first) {
    std::vector<double> kept;
    for (std::size_t i = first; i < all.size(); i += 2) kept.push_back(all[i]);
    return kept;
}

// Shares of two neighbouring intervals at a wavelength.
struct Between {
    std::size_t lower, upper;
    double share;  // of the upper one
};
std::array<Between, kBands> between(const std::vector<double>& middles) {
    std::array<Between, kBands> all;
    for (std::size_t i = 0; i < kBands; ++i) {
        const double nm = BandSpectrum::nanometres(i);
        const auto upper = std::ranges::upper_bound(middles, nm) - middles.begin();
        const auto last = static_cast<std::ptrdiff_t>(middles.size()) - 1;
        const auto a = static_cast<std::size_t>(std::max<std::ptrdiff_t>(upper - 1, 0));
        const auto b = static_cast<std::size_t>(std::min(upper, last));
        all[i] = {a, b, a == b ? 0.0 : (nm - middles[a]) / (middles[b] - middles[a])};
    }
    return all;
}

using Quantities = std::array<double, kColourCount>;

// Computes quantities of the mean light of some points.
class ColourOf {
  public:
    ColourOf(const ArrivingLight& arriving, const std::vector<BandSpectrum>& spectra,
             const std::vector<double>& middles)
        : arriving_(arriving), spectra_(spectra), between_(between(middles)) {}

    std::array<Reading95, kColourCount> of(std::span<const std::size_t> points) const {
        std::vector<BandSpectrum> batches;
        BandSpectrum all;
        for (std::size_t batch = 0; batch < kColourBatches; ++batch) {
            batches.push_back(irradiance(points, batch));
            all += batches.back();
        }
        const Quantities whole = colour_quantities(1.0 / kColourBatches * all);
        std::array<RunningStats, kColourCount> without;
        for (const BandSpectrum& batch : batches) {
            BandSpectrum rest = all;
            rest += -1.0 * batch;
            const Quantities q = colour_quantities(1.0 / (kColourBatches - 1) * rest);
            for (std::size_t i = 0; i < q.size(); ++i) without[i].add(q[i]);
        }
        std::array<Reading95, kColourCount> readings;
        for (std::size_t i = 0; i < whole.size(); ++i) {
            // The jackknife's variance is (n - 1)²/n times the sample variance of the values without one
            // batch.
            const double error = (kColourBatches - 1) * without[i].standard_error();
            readings[i] = {whole[i], student_95(kColourBatches) * error};
        }
        return readings;
    }

    // Returns the values alone.
    Quantities value(std::span<const std::size_t> points) const {
        BandSpectrum all;
        for (std::size_t batch = 0; batch < kColourBatches; ++batch) all += irradiance(points, batch);
        return colour_quantities(1.0 / kColourBatches * all);
    }

  private:
    BandSpectrum irradiance(std::span<const std::size_t> points, std::size_t batch) const {
        BandSpectrum sum;
        for (std::size_t g = 0; g < arriving_.groups; ++g) {
            std::vector<double> t(arriving_.intervals);
            for (const std::size_t point : points) {
                const double* from = &arriving_.values[arriving_.index(point, batch, g)];
                for (std::size_t b = 0; b < t.size(); ++b)
                    t[b] += from[b] / static_cast<double>(points.size());
            }
            for (std::size_t i = 0; i < kBands; ++i) {
                const Between& at = between_[i];
                sum.at[i] += spectra_[g].at[i] * std::lerp(t[at.lower], t[at.upper], at.share);
            }
        }
        return sum;
    }

    const ArrivingLight& arriving_;
    const std::vector<BandSpectrum>& spectra_;
    std::array<Between, kBands> between_;
};

// The runs of one computation, all with the same random numbers, so that they differ by the intervals alone.
class ColourRuns {
  public:
    ColourRuns(const IlluminanceReport& measured, const ReadInIntervals& read,
               const IlluminanceOptions& options, const std::function<double()>& seconds, Monitor& monitor)
        : measured_(measured), read_(read), options_(options), seconds_(seconds), monitor_(monitor) {
        for (const SurfaceIlluminance& surface : measured.surfaces) surfaces_.push_back(surface.surface);
    }

    ArrivingLight run(const std::array<double, 4>& limits) {
        Job job = read_(WorkingSpace::of_intervals(limits));
        if (scene_unit(job.scene) != FluxUnit::lumen) {
            throw InputError(
                "colours need light in lumens; state Option \"string unit\" \"photometric\" in the scene, or "
                "use --unit photometric");
        }
        if (has_chance_light(job.scene)) warn_once();
        place_sensors(surfaces_, job);
        const std::size_t points = job.receivers.points.size();
        const auto sensors = static_cast<std::size_t>(job.receivers.sensors);
        spectra_ = job.scene.light_groups().spectra;
        const std::vector<std::string> groups = job.scene.light_groups().names;
        PathRounds rounds(job, Quantity::illuminance, measured_.samples, options_.seed, options_.workers,
                          seconds_());
        const RenderResult result = rounds.render(monitor_);
        if (!result.report.complete && result.report.samples_done == 0)
            throw Stopped("ended before every point had a sample of its colour");
        return read_run(result, groups, points, sensors);
    }
    // Returns what arrives in 3 `runs` intervals.
    ArrivingLight run_all(int runs) {
        const std::vector<double> limits = interval_limits(runs);
        ArrivingLight all;
        for (std::size_t i = 0; i < static_cast<std::size_t>(runs); ++i)
            append(all, run({limits[3 * i], limits[3 * i + 1], limits[3 * i + 2], limits[3 * i + 3]}));
        return all;
    }
    const std::vector<BandSpectrum>& spectra() const { return spectra_; }

  private:
    void warn_once() {
        if (!warned_) {
            monitor_.warn(
                "colours do not include light that comes over mirrors, lenses or solid glass from lamps that "
                "are too small for path tracing to meet");
        }
        warned_ = true;
    }

    const IlluminanceReport& measured_;
    const ReadInIntervals& read_;
    const IlluminanceOptions& options_;
    const std::function<double()>& seconds_;
    Monitor& monitor_;
    std::vector<CalculationSurface> surfaces_;
    std::vector<BandSpectrum> spectra_;
    bool warned_ = false;
};

LightColour no_colour() {
    LightColour none;
    none.values.fill({kNoValue, kNoValue});
    return none;
}

// Calls visit(points, colour) for each point that counts, and for all of a surface together.
template <typename Visit>
void for_each_colour(const IlluminanceReport& measured, std::vector<SurfaceColour>& surfaces,
                     const Workers& workers, Visit&& visit) {
    std::size_t first = 0;
    for (std::size_t s = 0; s < surfaces.size(); ++s) {
        const std::vector<PointIlluminance>& points = measured.surfaces[s].points;
        std::vector<std::size_t> lit;
        for (std::size_t i = 0; i < points.size(); ++i)
            if (!points[i].is_cut_off()) lit.push_back(first + i);
        parallel_chunks(workers, static_cast<std::int64_t>(lit.size()), [&](std::int64_t i) {
            const std::size_t point = lit[static_cast<std::size_t>(i)];
            visit(std::span(&point, 1), surfaces[s].points[point - first]);
        });
        if (!lit.empty()) visit(std::span<const std::size_t>(lit), surfaces[s].mean);
        first += points.size();
    }
}

// Sets the error by the intervals to the greater of the two differences that every second interval makes. For
// smooth reflectances the difference is about three times the error, for the steepest paints nearly twice.
void set_errors(const IlluminanceReport& measured, const ArrivingLight& fine,
                const std::vector<BandSpectrum>& spectra, int runs, const Workers& workers,
                std::vector<SurfaceColour>& surfaces) {
    for (const std::size_t first : {0U, 1U}) {
        const ArrivingLight wide = every_second(fine, first);
        const ColourOf colour(wide, spectra, every_second(interval_middles(runs), first));
        for_each_colour(measured, surfaces, workers,
                        [&](std::span<const std::size_t> points, LightColour& to) {
                            const Quantities other = colour.value(points);
                            for (std::size_t i = 0; i < kColourCount; ++i)
                                to.by_intervals[i] =
                                    std::max(to.by_intervals[i], std::fabs(other[i] - to.values[i].value));
                        });
    }
}

}  // namespace

std::array<double, kColourCount> colour_quantities(const BandSpectrum& irradiance) {
    Quantities q;
    q.fill(kNoValue);
    if (const auto rendition = colour_rendition(irradiance)) {
        q = {rendition->temperature.kelvin,
             rendition->temperature.duv,
             rendition->general,
             rendition->r9(),
             rendition->fidelity,
             rendition->gamut,
             0};
    }
    q.back() = melanopic_edi(irradiance);
    return q;
}

std::vector<double> interval_limits(int runs) {
    std::vector<double> limits;
    for (int i = 0; i <= 3 * runs; ++i)
        limits.push_back(std::lerp(kFirstInterval, kLastInterval, i / (3.0 * runs)));
    return limits;
}

std::vector<double> interval_middles(int runs) {
    const std::vector<double> limits = interval_limits(runs);
    std::vector<double> middles;
    for (std::size_t i = 1; i < limits.size(); ++i) middles.push_back(0.5 * (limits[i - 1] + limits[i]));
    return middles;
}

ColourReport colour_on(const IlluminanceReport& measured, const ReadInIntervals& read,
                       const IlluminanceOptions& options, const std::function<double()>& seconds,
                       Monitor& monitor, int fine_runs) {
    ColourRuns runs(measured, read, options, seconds, monitor);
    ArrivingLight arriving = runs.run_all(1);
    const bool grey = is_grey(arriving);
    if (!grey) arriving = runs.run_all(fine_runs);
    const int done = grey ? 1 : fine_runs;
    ColourReport report;
    if (!grey) report.intervals = 3 * fine_runs;
    for (const SurfaceIlluminance& surface : measured.surfaces) {
        report.surfaces.push_back(
            {std::vector<LightColour>(surface.points.size(), no_colour()), no_colour()});
    }
    const Phase phase(monitor, "colours", 0);
    const ColourOf colour(arriving, runs.spectra(), interval_middles(done));
    for_each_colour(
        measured, report.surfaces, options.workers,
        [&](std::span<const std::size_t> points, LightColour& to) { to.values = colour.of(points); });
    if (!grey) set_errors(measured, arriving, runs.spectra(), fine_runs, options.workers, report.surfaces);
    return report;
}

std::string colour_heading() {
    return "colour of the mean light; ± is the half-width of the 95 % confidence interval";
}

std::vector<std::vector<std::string>> colour_rows(const IlluminanceReport& measured,
                                                  const ColourReport& colour) {
    std::vector<std::vector<std::string>> rows{{"surface"}};
    for (const ColourQuantity& quantity : kColourQuantities) {
        rows[0].push_back(quantity.unit.empty() ? std::string(quantity.name)
                                                : fmt::format("{} [{}]", quantity.name, quantity.unit));
    }
    for (std::size_t s = 0; s < colour.surfaces.size(); ++s) {
        std::vector<std::string>& row = rows.emplace_back();
        row.push_back(plain_text(measured.surfaces[s].surface.name));
        for (const Reading95& value : colour.surfaces[s].mean.values)
            row.push_back(std::isnan(value.value) ? "-" : reading_text(value));
    }
    return rows;
}

std::vector<std::string> colour_lines(const ColourReport& colour) {
    std::vector<std::string> lines;
    if (colour.intervals > 1) {
        std::array<double, kColourCount> most{};
        for (const SurfaceColour& surface : colour.surfaces) {
            for (std::size_t i = 0; i < kColourCount; ++i)
                most[i] = std::max(most[i], surface.mean.by_intervals[i]);
        }
        std::string errors;
        for (std::size_t i = 0; i < kColourCount; ++i) {
            errors += fmt::format("{}{} {:.2g}{}{}", i == 0 ? "" : ", ", kColourQuantities[i].name, most[i],
                                  kColourQuantities[i].unit.empty() ? "" : " ", kColourQuantities[i].unit);
        }
        lines.push_back(fmt::format(
            "reflectances in {} intervals of wavelengths (red, green and blue are interpolated) add an "
            "error of at most: {}",
            colour.intervals, errors));
    }
    if (colour.spectra_error > 0) {
        lines.push_back(fmt::format(
            "the lamps' spectra as mixtures of few have an error of at most {:.2g} % (root mean square, in "
            "intervals of 20 nm)",
            100 * colour.spectra_error));
    }
    return lines;
}

std::string colour_text(const IlluminanceReport& measured, const ColourReport& colour) {
    if (colour.surfaces.empty()) return {};
    std::string text = colour_heading() + '\n' + table_text(colour_rows(measured, colour));
    for (const std::string& line : colour_lines(colour)) text += line + '\n';
    return text;
}

}  // namespace lucerna
