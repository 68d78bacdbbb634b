#include "engine/photometry/glare.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/quantity.h"
#include "engine/text/plain_text.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/lamp_set.h"
#include "lights/luminous_opening.h"

namespace lucerna {
namespace {

// Number of batches of one luminaire's samples. The means of batches are nearly normal.
constexpr int kBatches = 32;
// The random numbers of luminaires begin here, beyond those that measure the background.
constexpr std::uint64_t kLuminaires = std::uint64_t{1} << 62;
// Branches of a sample's random numbers for the two traversals of media.
constexpr std::uint32_t kWayBranch = 0x3a, kSecondWayBranch = 0x3b;

// The contribution of one direction sampled towards a luminaire, divided by its probability density.
struct LuminaireSample {
    double luminance = 0;    // cd/m², as emitted towards the eye
    double solid_angle = 0;  // 1 / density
    double flux = 0;         // L dω as it arrives, the illuminance without its cosine
    double position = 1;     // position index
    double square = 0;       // L² dω / p² of the filtered luminance
    V3f w{0.0F};             // direction
    double distance = 0;     // to the luminaire
};
using LuminaireSamples = std::array<std::vector<LuminaireSample>, kBatches>;

// Returns the luminance, > 0, above which the luminous part of a luminaire lies.
double luminous_limit(const LuminaireSamples& samples) {
    std::vector<std::pair<double, double>> lights;  // luminance and contribution to the light
    double rest = 0;
    for (const auto& batch : samples) {
        for (const LuminaireSample& sample : batch) {
            lights.emplace_back(sample.luminance, sample.luminance * sample.solid_angle);
            rest += kLuminousShare * lights.back().second;
        }
    }
    std::sort(lights.begin(), lights.end(), std::greater<>());
    for (const auto& [luminance, light] : lights) {
        rest -= light;
        if (!(rest > 0)) return luminance;
    }
    return lights.back().first;
}

class Eye {
  public:
    Eye(const Scene& scene, const Observer& observer, const GlareOptions& options)
        : scene_(scene),
          observer_(observer),
          options_(options),
          at_(V3f(observer.eye - scene.origin())),
          medium_(medium_around(scene, {at_}, observer.view)) {}

    std::vector<GlareSource> sources() const {
        std::vector<GlareSource> all;
        for (std::uint32_t light = 0; light < scene_.lights().size(); ++light) {
            const Light& lamp = *scene_.lights()[light];
            // The sky has no place, and a point no luminance.
            if (!(lamp.power() > 0) || !lamp.bounds() || lamp.is_delta()) continue;
            if (const auto source = look_at(light, lamp)) all.push_back(*source);
        }
        return all;
    }

  private:
    std::optional<GlareSource> look_at(std::uint32_t light, const Light& lamp) const {
        LuminaireSamples samples;
        const LampSet others = others_than(*lamp.bounds());
        const int in_a_batch = std::max(1, options_.samples / kBatches);
        parallel_each(options_.workers, kBatches, 1, [&](std::size_t batch) {
            for (int i = 0; i < in_a_batch; ++i) {
                Sampler sampler = sampler_of(light, batch, i);
                if (const auto sample = draw(lamp, others, sampler)) samples[batch].push_back(*sample);
            }
        });
        const auto per_sample = [&](const std::function<double(const LuminaireSample&)>& value) {
            RunningStats batches;
            for (const auto& batch : samples) {
                double sum = 0;
                for (const LuminaireSample& sample : batch) sum += value(sample);
                batches.add(sum / in_a_batch);
            }
            return reading_95(batches);
        };
        const auto flux_over = [&](int power) {
            return per_sample([power](const LuminaireSample& sample) {
                       return sample.flux / pow(sample.position, power);
                   })
                .value;
        };
        const double flux = flux_over(0);
        if (!(flux > 0)) return std::nullopt;
        // Weights samples by their share in the luminous part, so that to first order the result does not
        // depend on the estimated limit. The weight is continuous at the limit, where all samples of a
        // uniform luminaire are.
        const double limit = luminous_limit(samples);
        const auto luminous = [limit](const LuminaireSample& sample) {
            const double relative = sample.luminance / limit;
            const double above = relative > 1 ? 1 - relative : 0;
            return sample.solid_angle * (above / kLuminousShare + relative);
        };
        GlareSource source;
        source.light = light;
        source.kind = std::string(lamp.kind());
        source.solid_angle = per_sample(luminous).value;
        source.luminance = flux / source.solid_angle;
        source.position = flux / flux_over(1);
        // The estimate is the product of the mean luminance and the integral of L / p². Its half-width is
        // that of the first-order expansion in all three means.
        const double over_p2 = flux_over(2);
        source.even = {source.luminance * over_p2, per_sample([&](const LuminaireSample& sample) {
                                                       return source.luminance * over_p2 *
                                                              (sample.flux / flux +
                                                               sample.flux / sqr(sample.position) / over_p2 -
                                                               luminous(sample) / source.solid_angle);
                                                   }).half_width};
        source.seen = per_sample([](const LuminaireSample& sample) { return sample.square; });
        if (options_.blur > 0) {
            std::vector<std::vector<SeenLight>> lights(kBatches);
            for (std::size_t batch = 0; batch < kBatches; ++batch) {
                for (const LuminaireSample& sample : samples[batch])
                    lights[batch].push_back({sample.w, sample.distance, sample.flux, sample.position});
            }
            source.effective = effective_part(lights, in_a_batch, options_.blur);
        }
        return source;
    }

    // Returns the light that arrives here through panes and media, which are attenuated as for camera paths.
    Rgb arriving(const LightSample& towards, Sampler& sampler) const {
        return passing(scene_, Ray{at_, towards.w, towards.distance}, medium_, sampler, false);
    }

    std::optional<LuminaireSample> draw(const Light& lamp, const LampSet& others, Sampler& sampler) const {
        const auto towards = lamp.sample_Li(at_, sampler.next2());
        const V2f u_blur = sampler.next2();
        // The sample is divided by its density, so a density of 0 is rejected.
        if (!towards || !(towards->pdf_w > 0)) return std::nullopt;
        LuminaireSample sample;
        sample.position = position_index(observer_, towards->w);
        if (!std::isfinite(sample.position)) return std::nullopt;
        Sampler way = sampler.split(kWayBranch), second_way = sampler.split(kSecondWayBranch);
        sample.flux = double{luminance(towards->weight * arriving(*towards, way))};
        if (!(sample.flux > 0)) return std::nullopt;
        sample.solid_angle = 1 / double{towards->pdf_w};
        sample.w = towards->w;
        sample.distance = double{towards->distance};
        sample.luminance = double{luminance(towards->weight)} / sample.solid_angle;
        const double again =
            options_.blur > 0
                ? luminance_along(blurred(*towards, u_blur), others, second_way)
                : double{luminance(towards->weight * arriving(*towards, second_way))} / sample.solid_angle;
        sample.square = sample.flux * again / sqr(sample.position);
        return sample;
    }

    // Returns the lights that the filter does not mix with a luminaire: the sky, and lamps further from it
    // than the filter is wide. Nearer lamps, such as the chips of one module, are seen as one.
    LampSet others_than(const LightBounds& luminaire) const {
        LampSet others(scene_.lights().size());
        Box3f near = luminaire.box;
        near.min -= V3f(static_cast<float>(options_.blur));
        near.max += V3f(static_cast<float>(options_.blur));
        for (std::uint32_t light = 0; light < scene_.lights().size(); ++light) {
            const auto bounds = scene_.lights()[light]->bounds();
            if (!bounds || !near.intersects(bounds->box)) others.add(light);
        }
        return others;
    }

    double luminance_along(const V3f& w, const LampSet& others, Sampler& sampler) const {
        const Ray ray{at_, w};
        SampleAccount seen;
        const EyePath path(PathAccount(seen), ray, medium_, EmissionRule::all_except(&others));
        add_emission_ahead(scene_, path, scene_.intersect(ray), sampler);
        return double{luminance(seen.radiance())};
    }

    // Samples a direction that is normally distributed around the first with twice the filter's variance.
    V3f blurred(const LightSample& towards, const V2f& u) const {
        const double sigma = std::sqrt(2.0) * options_.blur / kFwhmOverSigma / double{towards.distance};
        const double r = sigma * std::sqrt(-2 * log1p(-double{u.x})), phi = 2 * kPiD * double{u.y};
        const V3f local(V3d(r * cos(phi), r * sin(phi), 1));
        return Frame(towards.w).to_world(local).normalized();
    }

    Sampler sampler_of(std::uint32_t light, std::size_t batch, int sample) const {
        return Sampler::stratified(options_.seed, Purpose::receiver,
                                   kLuminaires + (std::uint64_t{light} << 8) + batch,
                                   static_cast<std::uint32_t>(sample));
    }

    const Scene& scene_;
    const Observer& observer_;
    const GlareOptions& options_;
    V3f at_;
    std::int32_t medium_;
};

// Tells whether the background differs significantly from 0.
bool is_known(const Reading95& background) {
    return background.value > background.half_width;
}

template <typename TermOf>
Reading95 rating(const std::vector<GlareSource>& sources, const Reading95& background, TermOf&& term_of) {
    double sum = 0, square = 0;
    for (const GlareSource& source : sources) {
        const Reading95& term = term_of(source);
        sum += term.value;
        square += sqr(term.half_width);
    }
    if (!(sum > 0)) return {-INFINITY, 0};
    if (!is_known(background)) return {NAN, NAN};
    const double relative = hypot(std::sqrt(square) / sum, background.half_width / background.value);
    return {8 * log10(0.25 / background.value * sum), 8 / std::numbers::ln10 * relative};
}

void check(const Observer& observer) {
    if (!(observer.view.cross(observer.up).length() > 1e-3F)) {
        throw InputError(
            {observer.name},
            "looks straight up or down, where UGR is not defined; use a line of sight that is not vertical");
    }
}

// Warns of the observer with the greatest share of lamps seen over mirrors or solid glass, which UGR has no
// terms for.
void warn_of_mirrored_lamps(const std::vector<SurfaceIlluminance>& eyes, Monitor& monitor) {
    constexpr double kLeastWarned = 0.01;  // of E_v
    const auto share = [](const SurfaceIlluminance& eye) {
        const PointIlluminance& at_eye = eye.points.front();
        return at_eye.mirrored > 0 ? at_eye.mirrored / at_eye.all.value : 0.0;
    };
    const auto most = most_affected(eyes, share, kLeastWarned);
    if (!most) return;
    const PointIlluminance& at_eye = most->surface->points.front();
    monitor.warn(fmt::format(
        "observer \"{}\": {:.3g} lx of the {:.4g} lx at the eye come from lights that are seen over mirrors, "
        "lenses or solid glass; they count in the background luminance, and UGR has no terms for them{}",
        plain_text(most->surface->surface.name), at_eye.mirrored, at_eye.all.value, most->others));
}

}  // namespace

std::vector<GlareReport> glare_at(std::span<const Observer> observers, Job job, const GlareOptions& options,
                                  Monitor& monitor) {
    const Stopwatch clock;
    if (scene_unit(job.scene) != FluxUnit::lumen) {
        throw InputError(
            "the lights of the scene are not all in lm, and glare is computed from luminance; state Option "
            "\"string unit\" \"photometric\" in the scene, or use --unit photometric");
    }
    std::vector<CalculationSurface> eyes;
    for (const Observer& observer : observers) {
        check(observer);
        const Frame frame(observer.view);
        CalculationSurface& eye = eyes.emplace_back();
        constexpr double kTiny = 1e-4;  // m, the size of a calculation surface that stands for a point
        eye.name = observer.name;
        eye.u = kTiny * V3d(frame.s);
        eye.v = kTiny * V3d(frame.t);
        eye.corner = observer.eye - 0.5 * (eye.u + eye.v);
        eye.normal = eye.up = observer.view;
        eye.points = {1, 1};
    }
    std::size_t without_extent = 0;
    for (const auto& light : job.scene.lights())
        without_extent += light->power() > 0 && light->bounds() && light->is_delta();
    if (without_extent > 0) {
        monitor.warn(
            fmt::format("{} of the scene's lights {} no extent, and so no luminance; not rated, though part "
                        "of E_v and of the light that the room reflects",
                        without_extent, without_extent == 1 ? "has" : "have"));
    }
    std::vector<GlareReport> reports;
    for (const Observer& observer : observers) {
        GlareReport& report = reports.emplace_back();
        report.observer = observer;
        report.sources = Eye(job.scene, observer, options).sources();
    }
    const bool daylight = has_daylight(job.scene);
    const IntegratorSettings integrator = job.integrator;
    for (std::size_t i = 0; (daylight || options.view) && i < observers.size(); ++i) {
        DaylightOptions how;
        how.seed = options.seed;
        how.workers = options.workers;
        how.threshold = options.threshold;
        how.pixels = options.view_pixels;
        how.precision = 0.25 * options.precision;
        // All views share half of the time evenly; illuminance gets the other half.
        how.seconds = (0.5 * options.seconds - clock.seconds()) / static_cast<double>(observers.size() - i);
        job.integrator = integrator;
        const LuminanceView view = luminance_view(observers[i], job, how, monitor);
        if (options.view) options.view(i, view);
        if (daylight)
            reports[i].daylight =
                daylight_glare(view, observers[i], job.scene, options.threshold, options.seed);
    }
    job.integrator = integrator;
    IlluminanceOptions how;
    how.seed = options.seed;
    how.workers = options.workers;
    how.seconds = options.seconds - clock.seconds();
    how.precision = options.precision;
    how.indirect = true;  // the background luminance follows from indirect light
    const bool has_luminaires =
        std::any_of(job.scene.lights().begin(), job.scene.lights().end(),
                    [](const auto& light) { return light->power() > 0 && light->bounds(); });
    const IlluminanceReport illuminance = illuminance_on(eyes, std::move(job), how, monitor);
    if (has_luminaires) warn_of_mirrored_lamps(illuminance.surfaces, monitor);
    for (std::size_t i = 0; i < reports.size(); ++i) {
        GlareReport& report = reports[i];
        const PointIlluminance& at_eye = illuminance.surfaces[i].points[0];
        report.vertical = at_eye.all;
        report.background = {at_eye.indirect.value / kPiD, at_eye.indirect.half_width / kPiD};
        if (!report.sources.empty() && !is_known(report.background)) {
            monitor.warn(fmt::format(
                "observer \"{}\": the background luminance of {:.2g} ± {:.2g} cd/m² is not told from 0, and "
                "UGR, which divides by it, is undefined",
                plain_text(report.observer.name), report.background.value, report.background.half_width));
        }
        const auto rating_by = [&](const auto& term_of) {
            return rating(report.sources, report.background, term_of);
        };
        report.ugr_even = rating_by([](const GlareSource& by) -> const Reading95& { return by.even; });
        report.ugr = rating_by([](const GlareSource& by) -> const Reading95& { return by.seen; });
        report.ugr_effective =
            rating_by([](const GlareSource& by) -> const Reading95& { return by.effective.term; });
        if (report.daylight) report.daylight->dgp = daylight_rating(*report.daylight, report.vertical);
    }
    return reports;
}

}  // namespace lucerna
