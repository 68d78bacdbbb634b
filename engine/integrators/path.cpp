// The path tracer: unbiased, with next-event estimation and MIS at every vertex. The judge of everything
// else.
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "engine/base/image.h"
#include "engine/base/path_limits.h"
#include "engine/guiding/directional_guide.h"
#include "engine/guiding/guide.h"
#include "engine/integrators/integrator.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/medium.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/specular_chain.h"
#include "photon/density_estimate.h"

namespace lucerna {
namespace {

// Russian roulette of paths that ask the lights at every bounce. What the first bounces bring is most of the
// light and of its variance; later ones are taken as often as they count, and that is more often than by
// their throughput: paths that end as early as that save less time than they add variance.
constexpr int kPathRouletteFrom = 2;
constexpr float kPathSurvival = 3;

float path_survival(const Rgb& throughput, float eta_scale) {
    return std::min(kMaxSurvival, kPathSurvival * survival_of(throughput, eta_scale));
}

// Photons guide so many bounces of a path at the most: those after them bring little, and a look-up costs as
// much at each.
constexpr int kGuidedBounces = 3;
// Defensive mixture weight: the least share of the plain choice of a light.
constexpr float kLeastPlainChoice = 0.25F;

class PathEstimator final : public Estimator {
  public:
    // Guides outlive it; null: none.
    PathEstimator(const Scene& scene, const PathSettings& settings, const GuideMap* light_guides,
                  const DirectionGuideMap* guides)
        : scene_(scene),
          settings_(settings),
          light_guides_(light_guides),
          guides_(guides),
          lights_(scene, settings.lights) {}

    Rgb Li(const Ray& ray, Sampler& sampler) const override { return Li_of(CameraRay{ray}, sampler); }
    Rgb Li_of(const CameraRay& camera, Sampler& sampler) const override {
        const bool meter = settings_.quantity == Quantity::illuminance;
        const PartsSink parts(camera.parts);
        Path path{camera.ray};
        path.receiver = camera.receiver;
        path.rule = camera.rule();
        const Rgb result =
            follow(path, kGlassSplits, sampler, meter ? parts.times(meter_reading(Rgb(1))) : parts);
        return meter ? meter_reading(result) : result;
    }

    // The same, with how many times more densely its directions were drawn than without guides.
    struct Weighed {
        Rgb radiance;
        float density_ratio;
    };
    Weighed weighed(const Ray& camera_ray, Sampler& sampler) const {
        Weighed result{Rgb(0), 1};
        result.radiance = follow({camera_ray}, kGlassSplits, sampler, {}, &result.density_ratio);
        return result;
    }

  private:
    LightChoice choice_at(const Vertex& x, int bounce) const {
        const LightChoice plain = lights_.at(x.hit.at, x.bsdf, x.wo);
        if (!light_guides_ || bounce >= kGuidedBounces) return plain;
        const Guide guide = light_guides_->at(x.hit.at.p, x.normal());
        return plain.guided(guide, std::max(kLeastPlainChoice, guide.defensive_weight()));
    }

    struct Path {
        Ray ray;
        Rgb throughput{1.0F};
        float eta_scale = 1;
        EmissionRule rule = EmissionRule::all();
        int bounce = 0;
        const Hit* receiver = nullptr;  // in the place of the first surface
        // How many times more densely directions were drawn than by the BSDFs alone.
        float density_ratio = 1;
    };

    // What a path brings from there on. At the first `splits` smooth boundaries, if the eye sees them, it is
    // followed both ways. `parts`: of the path, but for its throughput.
    Rgb follow(Path path, int splits, Sampler& sampler, PartsSink parts, float* ratio = nullptr) const {
        Rgb result(0);
        auto& [ray, throughput, eta_scale, rule, bounce, receiver, density_ratio] = path;
        while (bounce < kMaxBounces) {
            const auto hit = bounce == 0 && receiver ? std::optional(*receiver) : scene_.intersect(ray);
            const bool metered = settings_.quantity == Quantity::illuminance && bounce == 0;
            if (settings_.max_depth > 0 && bounce >= settings_.max_depth) {
                result += throughput *
                          emission_ahead(scene_, ray, hit, rule, kNoMedium, sampler, parts.times(throughput));
                break;
            }
            if (!metered) result += throughput * emission(scene_, ray, hit, rule, parts.times(throughput));
            if (!hit) break;

            // Sample the lights.
            const Bsdf bsdf = metered ? white_receiver(*hit) : scene_.bsdf(*hit);
            const V3f wo = -ray.d;
            const bool specular = bsdf.is_delta();
            const LightChoice choice = specular ? LightChoice() : choice_at({*hit, bsdf, wo}, bounce);
            const bool guided_here = guides_ && bounce < kGuidedBounces;
            const GuidedBsdf directions(bsdf, wo,
                                        guided_here ? guides_->at(hit->at.p, bsdf, wo) : DirectionGuide());
            if (!specular) {
                result += throughput * next_event(scene_, {*hit, bsdf, wo}, sampler, choice, directions,
                                                  parts.times(throughput));
            }

            // Go on.
            BsdfU u{sampler.next(), sampler.next2()};
            const float u_survive = sampler.next();
            if (!specular) splits = 0;
            if (splits > 0) {
                Sampler own = sampler.split_alike(kGlassBranch);
                if (const auto split = split_at_glass(bsdf, wo, own)) {
                    --splits;
                    if (const auto& way = split->fainter) {
                        const Ray other{hit->at.towards(way->wi), way->wi};
                        result += follow({other, throughput * way->weight, eta_scale * way->eta_scale,
                                          rule.after(*way, ray, hit->t), bounce + (way->straight ? 0 : 1),
                                          nullptr, density_ratio},
                                         splits, own, past(parts, *way));
                    }
                    u = split->brighter;
                    throughput *= split->share;
                }
            }
            const auto guided = directions.sample(u);
            if (!guided) break;
            const BsdfSample& sample = guided->sample;
            throughput *= sample.weight;
            parts = past(parts, sample);
            eta_scale *= sample.eta_scale;
            density_ratio *= guided->ratio;
            rule = sample.delta ? rule.after(sample, ray, hit->t) : EmissionRule::mis(sample.pdf_w, choice);
            ray = Ray{hit->at.towards(sample.wi), sample.wi};
            if (sample.straight) continue;

            // Russian roulette by the throughput that is left. Directions that were drawn more densely
            // because they matter carry less of it: without that they would be ended as unimportant.
            if (++bounce < kPathRouletteFrom) continue;
            const float survival = path_survival(throughput * std::max(density_ratio, 1.0F), eta_scale);
            if (!(u_survive < survival)) break;  // also when the throughput is black: survival is 0
            throughput /= survival;
        }
        if (ratio) *ratio = density_ratio;
        return result;
    }

    const Scene& scene_;
    PathSettings settings_;
    const GuideMap* light_guides_;
    const DirectionGuideMap* guides_;
    LightChooser lights_;
};

// The path tracer in participating media: as above, and between two surfaces a path may be scattered.
//
// A path carries the medium that borders put it in; regions are found from the ray alone. Lights are asked
// at surfaces and in media alike.

constexpr std::uint32_t kPathLampBranch = 0x1a;

class MediaPathEstimator final : public Estimator {
  public:
    MediaPathEstimator(const Scene& scene, const PathSettings& settings)
        : scene_(scene), media_(scene.media()), settings_(settings), lights_(scene, settings.lights) {}

    Rgb Li(const Ray& ray, Sampler& sampler) const override { return Li_of(CameraRay{ray}, sampler); }
    Rgb Li_of(const CameraRay& camera, Sampler& sampler) const override;

  private:
    struct Path {
        Ray ray;
        PartsSink parts = {};  // of the path, but for its throughput
        EmissionRule rule = EmissionRule::all();
        std::int32_t medium = kNoMedium;
        Rgb throughput{1.0F};
        Rgb result{0.0F};
        float eta_scale = 1;
    };
    // The end of a segment: scattered in a medium, or a surface, or neither (the path is over).
    struct Segment {
        std::optional<Hit> hit;
        std::optional<MediumVertex> scattered;
    };

    Segment propagate(Path& path, Sampler& sampler) const;
    Segment metered_segment(Path& path) const;
    void add_impostors(Path& path, const std::optional<Hit>& hit, Sampler& sampler) const;
    enum class Next { bounce, straight, end };
    Next scatter(Path& path, const Segment& segment, bool metered, Sampler& sampler) const;
    bool pass_straight(Path& path, const Segment& segment) const;

    const Scene& scene_;
    const SceneMedia& media_;
    PathSettings settings_;
    LightChooser lights_;
};

Rgb MediaPathEstimator::Li_of(const CameraRay& camera, Sampler& sampler) const {
    const PartsSink parts(camera.parts);
    Path path;
    path.ray = camera.ray;
    path.rule = camera.rule();
    path.medium = camera.medium.value_or(media_.camera);
    const bool meter = settings_.quantity == Quantity::illuminance;
    path.parts = meter ? parts.times(meter_reading(Rgb(1))) : parts;
    int bounce = 0;
    while (bounce < kMaxBounces) {
        const bool metered = meter && bounce == 0;
        const bool received = camera.receiver && bounce == 0;
        const Segment segment = received  ? Segment{*camera.receiver, {}}
                                : metered ? metered_segment(path)
                                          : propagate(path, sampler);
        if (!segment.hit && !segment.scattered) break;
        if (settings_.max_depth > 0 && bounce >= settings_.max_depth) {
            if (!pass_straight(path, segment)) break;
            continue;
        }
        const Next next = scatter(path, segment, metered, sampler);
        if (next == Next::end) break;

        // Russian roulette by the throughput that is left.
        const float u_survive = sampler.next();
        if (is_black(path.throughput)) break;
        if (next == Next::straight || ++bounce < kPathRouletteFrom) continue;
        const float survival = path_survival(path.throughput, path.eta_scale);
        if (!(u_survive < survival)) break;
        path.throughput /= survival;
    }
    return meter ? meter_reading(path.result) : path.result;
}

// The first surface, for a meter that lies on it: what is between it and the camera does not matter.
MediaPathEstimator::Segment MediaPathEstimator::metered_segment(Path& path) const {
    for (int borders = 0; borders < kMaxBorders; ++borders) {
        const auto hit = scene_.intersect_with_borders(path.ray);
        if (!hit) return {};
        if (!scene_.is_border(*hit)) return {hit, {}};
        path.medium = medium_towards(hit->media, hit->at.n, path.ray.d, path.medium);
        path.ray = Ray{hit->at.towards(path.ray.d), path.ray.d};
    }
    return {};
}

// From one vertex to the next, through borders, with what is emitted on the way.
MediaPathEstimator::Segment MediaPathEstimator::propagate(Path& path, Sampler& sampler) const {
    Ray& rest = path.ray;  // from the last border on
    for (int borders = 0; borders < kMaxBorders; ++borders) {
        const auto hit = scene_.intersect_with_borders(rest);
        add_impostors(path, hit, sampler);
        const double end = static_cast<double>(hit ? hit->t : rest.t_max);
        const MediumPiece piece{rest, end, path.medium, MediaAlong(media_, path.medium, rest, end)};
        if (!piece.along.empty()) {
            const Flight flight = fly(piece.along, path.throughput, sampler);
            path.result += flight.emitted;
            path.parts.glow(flight.emitted);
            path.throughput = flight.throughput;
            if (is_black(path.throughput)) return {};
            if (flight.scattered) {
                const V3f p = scattering_point(piece, flight.t, hit);
                return {{}, MediumVertex{p, HenyeyGreenstein(flight.g), -rest.d, path.medium}};
            }
        }
        const bool border = hit && scene_.is_border(*hit);
        if (!border) {
            path.result += path.throughput *
                           surface_emission(scene_, rest, hit, path.rule, path.parts.times(path.throughput));
            if (!hit) return {};
            return {hit, {}};
        }
        // The vertex sees all that lies before it as one ray: the densities of lights go by it.
        path.rule = path.rule.behind(rest, hit->t);
        path.medium = medium_towards(hit->media, hit->at.n, rest.d, path.medium);
        rest = Ray{hit->at.towards(rest.d), rest.d};
    }
    return {};
}

// Light from what is no surface: a lamp's impostor within reach, or the sky if nothing is met.
void MediaPathEstimator::add_impostors(Path& path, const std::optional<Hit>& hit, Sampler& sampler) const {
    if (path.rule.kind == EmissionRule::Kind::none || scene_.impostors().empty()) return;
    Sampler more = sampler.split(kPathLampBranch);
    for_each_impostor(
        scene_, path.ray, hit, path.rule, [&](const Rgb& radiance, float distance, std::uint32_t light) {
            const MediaAlong along(media_, path.medium, path.ray, static_cast<double>(distance));
            const Rgb arriving = path.throughput * transmittance(along, more) * radiance;
            path.result += arriving;
            path.parts.met(arriving, light, path.rule.kind == EmissionRule::Kind::all);
        });
}

// A path that may not bounce any more still sees what lies straight behind a pane, as shadow rays do. False:
// it ends.
bool MediaPathEstimator::pass_straight(Path& path, const Segment& segment) const {
    if (!segment.hit) return false;
    const Hit& hit = *segment.hit;
    path.throughput *= scene_.bsdf(hit).straight_share(-path.ray.d);
    if (is_black(path.throughput)) return false;
    path.rule = path.rule.behind(path.ray, hit.t);
    path.medium = medium_towards(hit.media, hit.at.n, path.ray.d, path.medium);
    path.ray = Ray{hit.at.towards(path.ray.d), path.ray.d};
    return true;
}

// Samples the lights, and chooses where the path goes on.
MediaPathEstimator::Next MediaPathEstimator::scatter(Path& path, const Segment& segment, bool metered,
                                                     Sampler& sampler) const {
    if (segment.scattered) {
        const LightChoice choice = lights_.at(segment.scattered->p);
        path.result += path.throughput * next_event(scene_, *segment.scattered, sampler, choice,
                                                    path.parts.times(path.throughput));
        path.parts = path.parts.in_medium();
        const V3f wi = segment.scattered->phase.sample(segment.scattered->wo, sampler.next2());
        path.rule = EmissionRule::mis(segment.scattered->pdf_w(wi), choice);
        path.ray = Ray{segment.scattered->p, wi};
        return Next::bounce;
    }
    const Hit& hit = *segment.hit;
    const Bsdf bsdf = metered ? white_receiver(hit) : scene_.bsdf(hit);
    const V3f wo = -path.ray.d;
    const bool specular = bsdf.is_delta();
    const LightChoice choice = specular ? LightChoice() : lights_.at(hit.at, bsdf, wo);
    if (!specular) {
        const Vertex vertex{hit, bsdf, wo, path.medium};
        path.result +=
            path.throughput * next_event(scene_, vertex, sampler, choice, path.parts.times(path.throughput));
    }
    const BsdfU u{sampler.next(), sampler.next2()};
    const auto sample = bsdf.sample(wo, u, Transport::radiance);
    if (!sample) return Next::end;
    path.throughput *= sample->weight;
    path.parts = past(path.parts, *sample);
    path.eta_scale *= sample->eta_scale;
    path.rule =
        sample->delta ? path.rule.after(*sample, path.ray, hit.t) : EmissionRule::mis(sample->pdf_w, choice);
    path.medium = medium_towards(hit.media, hit.at.n, sample->wi, path.medium);
    path.ray = Ray{hit.at.towards(sample->wi), sample->wi};
    return sample->straight ? Next::straight : Next::bounce;
}

// Whether guided paths pay: a pilot looks at pixels all over the view. A guided path of value x whose
// directions were drawn r times more densely says what paths without guides would do, too: their second
// moment is the mean of r x². No clock is asked, so that the same settings give the same image.
bool guides_pay(const PathEstimator& guided, const RenderContext& context) {
    constexpr std::size_t kPixels = 512;
    constexpr int kSamples = 8;
    constexpr double kCost = 1.5;  // of a guided path beside a plain one, pessimistically
    struct Pixel {
        double mean = 0, guided = 0, plain = 0;  // second moments
    };
    std::vector<Pixel> pixels(kPixels);
    const View& view = *context.view;
    parallel_each(context.workers, kPixels, 4, [&](std::size_t i) {
        Sampler where =
            Sampler::stratified(context.seed, Purpose::importance, 1, static_cast<std::uint32_t>(i));
        const V2f pixel = view.begin + where.next2() * (view.end - view.begin);
        for (std::uint32_t n = 0; n < kSamples; ++n) {
            Sampler sampler = where.split(n);
            const V2f lens = sampler.next2();
            const auto path = guided.weighed(view.camera->ray(pixel, lens), sampler);
            const double x = is_finite(path.radiance) ? double{luminance(path.radiance)} : 0.0;
            pixels[i].mean += x / kSamples;
            pixels[i].guided += x * x / kSamples;
            pixels[i].plain += x * x * double{path.density_ratio} / kSamples;
        }
    });
    double mean = 0;
    for (const Pixel& pixel : pixels) mean += pixel.mean / kPixels;
    // Rare bright paths decide such sums: every quarter of the pixels must say that it pays.
    std::array<double, 4> of_guided{}, of_plain{};
    for (std::size_t i = 0; i < kPixels; ++i) {
        const Pixel& pixel = pixels[i];
        const double scale = error_scale2(pixel.mean, mean);
        if (!(scale > 0)) continue;
        const double variance = (pixel.guided - sqr(pixel.mean)) * kSamples / (kSamples - 1);
        const double square = sqr(pixel.mean) - variance / kSamples;  // of the true mean
        of_guided[i % of_guided.size()] += variance / scale;
        of_plain[i % of_plain.size()] += (pixel.plain - square) / scale;
    }
    bool pays = true;
    for (std::size_t i = 0; i < of_plain.size(); ++i) pays = pays && of_plain[i] > kCost * of_guided[i];
    return pays;
}

class PathSession final : public Session {
  public:
    PathSession(const Scene& scene, const PathSettings& settings, std::optional<GuideMap> light_guides,
                std::optional<DirectionGuideMap> guides)
        : scene_(scene),
          settings_(settings),
          light_guides_(std::move(light_guides)),
          guides_(std::move(guides)) {}
    std::unique_ptr<const Estimator> pass(std::uint32_t /*index*/, Monitor& /*monitor*/,
                                          PassStatistics& /*statistics*/) const override {
        if (!scene_.media().empty()) return std::make_unique<MediaPathEstimator>(scene_, settings_);
        return std::make_unique<PathEstimator>(scene_, settings_, light_guides_ ? &*light_guides_ : nullptr,
                                               guides_ ? &*guides_ : nullptr);
    }

  private:
    const Scene& scene_;
    PathSettings settings_;
    std::optional<GuideMap> light_guides_;
    std::optional<DirectionGuideMap> guides_;
};

class PathIntegrator final : public Integrator {
  public:
    explicit PathIntegrator(const PathSettings& settings) : settings_(settings) {}
    bool takes_receivers() const override { return true; }
    std::unique_ptr<const Session> begin(const RenderContext& context,
                                         OnceStatistics& statistics) const override {
        std::optional<GuideMap> light_guides;
        std::optional<DirectionGuideMap> guides;
        // Places where media scatter have no photons of their own here: such scenes stay plain.
        if (context.scene.media().empty()) {
            if (settings_.guide_lights > 0 && !nothing_to_choose(context.scene))
                light_guides = make_light_guides(context, statistics);
            if (settings_.guide_paths > 0 && !context.monitor.stopped())
                guides = make_guides(context, statistics);
            if (context.monitor.stopped()) return nullptr;
        }
        return std::make_unique<PathSession>(context.scene, settings_, std::move(light_guides),
                                             std::move(guides));
    }

  private:
    GuideMap make_light_guides(const RenderContext& context, OnceStatistics& statistics) const {
        const Stopwatch building;
        GuideParameters parameters{settings_.guide_lights, context.seed, 0, {}, settings_.lights};
        parameters.settings.radius = largest_radius(diagonal(context.scene));
        GuideMap guides = build_guides(context.scene, parameters, context.workers, context.monitor);
        statistics.seconds.add("guide", building.seconds());
        return guides;
    }

    // None where they do not pay.
    std::optional<DirectionGuideMap> make_guides(const RenderContext& context,
                                                 OnceStatistics& statistics) const {
        const Stopwatch building;
        DirectionGuideParameters parameters{settings_.guide_paths, context.seed, settings_.lights, {}};
        parameters.settings.radius = largest_radius(diagonal(context.scene));
        parameters.settings.defensive_weight = settings_.bsdf_share;
        std::optional<DirectionGuideMap> guides(
            build_direction_guides(context.scene, parameters, context.workers, context.monitor));
        if (context.monitor.stopped()) return std::nullopt;
        const bool any = guides->stations() > 0;
        if (!any || (context.view && !guides_pay({context.scene, settings_, nullptr, &*guides}, context))) {
            guides.reset();
        }
        statistics.seconds.add("guide", building.seconds());
        statistics.guides = {guides ? guides->photons() : 0, guides ? guides->stations() : 0};
        return guides;
    }

    PathSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_path(const PathSettings& settings) {
    return std::make_unique<PathIntegrator>(settings);
}

}  // namespace lucerna
