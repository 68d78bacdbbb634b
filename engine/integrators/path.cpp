// Implements the path tracer: unbiased, with next-event estimation and MIS at every vertex. It is the
// reference for all other methods.
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "engine/guiding/chain_guide.h"
#include "engine/guiding/directional_guide.h"
#include "engine/guiding/guide.h"
#include "engine/image/image.h"
#include "engine/integrators/integrator.h"

#include "engine/base/defensive.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/follow.h"
#include "photon/density_estimate.h"

namespace lucerna {
namespace {

// These parameters control the Russian roulette of paths that sample the lights at every bounce. The first
// bounces bring most of the light and of its variance, and always survive. Later ones survive more often than
// their throughput suggests, because ending them that early would save less time than it adds variance.
constexpr int kPathRouletteFrom = 2;
constexpr float kPathSurvival = 3;

// Returns the survival probability. Where guiding draws important directions more densely, each carries less
// throughput; the density ratio makes up for that, or roulette would end them as unimportant.
float path_survival(const EyePath& path) {
    if (path.bounces < kPathRouletteFrom) return 1;
    return std::min(kMaxSurvival, kPathSurvival * std::max(path.density_ratio, 1.0F) * path.survival());
}

// Photons guide this many first bounces. Later ones bring little, and each look-up costs as much.
constexpr int kGuidedBounces = 3;

// Chains to small lamps are searched for at the first place that is no mirror, since light there shows in
// single pixels, and at later ones with this probability.
constexpr float kLaterChains = 1.0F / 8;
constexpr std::uint32_t kChainBranch = 0xc4a1;

class PathEstimator final : public Estimator {
  public:
    // The guides outlive the estimator. Null means unguided.
    PathEstimator(const Scene& scene, const GuideMap* light_guides, const DirectionGuideMap* guides,
                  const ChainGuide* chains)
        : scene_(scene), light_guides_(light_guides), guides_(guides), chains_(chains), lights_(scene) {}

    void follow(const EyePath& path, Sampler& sampler) const override {
        lucerna::follow(scene_, path, sampler, Visitor{{}, *this, nullptr});
    }
    // Follows a path, and returns the ratio of the density of its directions to that without guides.
    float follow_weighed(const EyePath& path, Sampler& sampler) const {
        float density_ratio = 1;
        lucerna::follow(scene_, path, sampler, Visitor{{}, *this, &density_ratio});
        return density_ratio;
    }

  private:
    struct Visitor : EyeVisitor {
        static constexpr bool kSplitsMedia = false, kFindsPassedLamps = true;
        const PathEstimator& of;
        float* density_ratio;  // receives that of the whole path so far; null: not wanted

        static float survival(const EyePath& path) { return path_survival(path); }
        const LightChooser& lights() const { return of.lights_; }

        bool at_surface(EyePath& path, const Vertex& at, Sampler& sampler) const {
            // Sample the lights.
            const V3f& p = at.hit.at.p;
            const bool guided = of.guides_ && path.bounces < kGuidedBounces;
            const GuidedBsdf directions(at.bsdf, at.wo,
                                        guided ? of.guides_->at(p, at.bsdf, at.wo) : DirectionGuide());
            const LightChoice choice = of.choice_at(at, path.bounces);
            next_event(of.scene_, at, sampler, choice, directions, path);
            const ChainGuide::Place place{at, directions, path.separates_caustics() ? 1 : kLaterChains,
                                          path.left};
            if (of.chains_) of.chains_->add_light(place, sampler.split(kChainBranch), path);

            // Choose a direction.
            const auto drawn = directions.sample({sampler.next(), sampler.next2()});
            if (!drawn) return false;
            path.turn(at, drawn->sample, EmissionRule::mis(drawn->sample.pdf_w, choice));
            if (of.chains_ && !drawn->sample.delta)
                path.chain = of.chains_->chance_chain(place, path.ray.d, drawn->sample.pdf_w);
            path.density_ratio *= drawn->ratio;
            if (density_ratio) *density_ratio = path.density_ratio;
            return drawn->sample.straight || path.survives(path_survival(path), sampler);
        }

        bool at_medium(EyePath& path, const MediumVertex& at, const Rgb& /*sigma_s*/,
                       Sampler& sampler) const {
            const LightChoice choice = of.lights_.at(at.p);
            next_event(of.scene_, at, sampler, choice, path.times(path.direct_share));
            const V3f wi = at.phase.sample(at.wo, sampler.next2());
            path.turn(at, wi, EmissionRule::mis(at.pdf_w(wi), choice));
            return path.survives(path_survival(path), sampler);
        }
    };

    LightChoice choice_at(const Vertex& x, int bounce) const {
        const LightChoice plain = lights_.at(x.hit.at, x.bsdf, x.wo);
        if (!light_guides_ || bounce >= kGuidedBounces) return plain;
        const Guide guide = light_guides_->at(x.hit.at.p, x.normal());
        return plain.guided(guide, std::max(kDefensiveWeight, guide.defensive_weight()));
    }

    const Scene& scene_;
    const GuideMap* light_guides_;
    const DirectionGuideMap* guides_;
    const ChainGuide* chains_;
    LightChooser lights_;
};

// Tells whether guided paths pay, from a pilot that looks at pixels all over the view. A guided path of value
// x whose directions were drawn r times more densely also estimates what unguided paths would do: their
// second moment is the mean of r x². Costs are constants, not the clock's: the same settings give the same
// image.
bool guides_pay(const PathEstimator& guided, const PathSettings& settings, const RenderContext& context) {
    constexpr std::size_t kPixels = 512;
    constexpr int kSamples = 8;
    constexpr double kCost = 1.5;  // cost of a guided path relative to an unguided one, pessimistic
    struct Pixel {
        double mean = 0, guided = 0, plain = 0;  // `guided` and `plain` are second moments
    };
    std::vector<Pixel> pixels(kPixels);
    const View& view = *context.view;
    parallel_each(context.workers, kPixels, 4, [&](std::size_t i) {
        Sampler where =
            Sampler::stratified(context.seed, Purpose::importance, 1, static_cast<std::uint32_t>(i));
        const V2f pixel = view.begin + where.next2() * (view.end - view.begin);
        for (std::uint32_t n = 0; n < kSamples; ++n) {
            Sampler sampler = where.split(n);
            SampleAccount account;
            EyePath path = EyePath::begin(context.scene, view.camera->ray(pixel, sampler.next2()),
                                          settings.quantity, settings.max_depth, account);
            path.splits = 0;  // smooth glass would give the path two ratios
            const double ratio{guided.follow_weighed(path, sampler)};
            const double x = is_finite(account.radiance()) ? double{luminance(account.radiance())} : 0.0;
            pixels[i].mean += x / kSamples;
            pixels[i].guided += x * x / kSamples;
            pixels[i].plain += x * x * ratio / kSamples;
        }
    });
    double mean = 0;
    for (const Pixel& pixel : pixels) mean += pixel.mean / kPixels;
    // A few bright paths dominate such sums, so guiding must pay in every quarter of the pixels.
    std::array<double, 4> of_guided{}, of_plain{};
    for (std::size_t i = 0; i < kPixels; ++i) {
        const Pixel& pixel = pixels[i];
        const double scale = error_scale2(pixel.mean, mean);
        if (!(scale > 0)) continue;
        const double variance = (pixel.guided - sqr(pixel.mean)) * kSamples / (kSamples - 1);
        const double square = sqr(pixel.mean) - variance / kSamples;  // unbiased, of the true mean
        of_guided[i % of_guided.size()] += variance / scale;
        of_plain[i % of_plain.size()] += (pixel.plain - square) / scale;
    }
    bool pays = true;
    for (std::size_t i = 0; i < of_plain.size(); ++i) pays = pays && of_plain[i] > kCost * of_guided[i];
    return pays;
}

// Returns the share of the image's light that goes to surfaces over mirrors and glass, from a pilot that
// looks at pixels all over the view. A path counts for at most a few times the mean, so that a rare bright
// one does not decide.
double light_over_chains(const PathEstimator& paths, const PathSettings& settings,
                         const RenderContext& context) {
    constexpr std::size_t kPixels = 1024;
    const View& view = *context.view;
    std::vector<V2d> found(kPixels);
    parallel_each(context.workers, kPixels, 4, [&](std::size_t i) {
        Sampler sampler =
            Sampler::stratified(context.seed, Purpose::importance, 2, static_cast<std::uint32_t>(i));
        const V2f pixel = view.begin + sampler.next2() * (view.end - view.begin);
        SampleAccount account;
        const EyePath path = EyePath::begin(context.scene, view.camera->ray(pixel, sampler.next2()),
                                            settings.quantity, settings.max_depth, account);
        paths.follow(path, sampler);
        if (is_finite(account.radiance()))
            found[i] = {double{luminance(account.by_chance)}, double{luminance(account.radiance())}};
    });
    constexpr double kMost = 3;
    double mean = 0;
    for (const V2d& sample : found) mean += sample.y / kPixels;
    V2d sum(0.0);
    for (const V2d& sample : found)
        sum += V2d(std::min(sample.x, kMost * mean), std::min(sample.y, kMost * mean));
    return sum.y > 0 ? sum.x / sum.y : 0;
}

class PathSession final : public Session {
  public:
    PathSession(const Scene& scene, std::optional<GuideMap> light_guides,
                std::optional<DirectionGuideMap> guides, std::unique_ptr<const ChainGuide> chains)
        : scene_(scene),
          light_guides_(std::move(light_guides)),
          guides_(std::move(guides)),
          chains_(std::move(chains)) {}
    std::unique_ptr<const Estimator> pass(std::uint32_t /*index*/, Monitor& /*monitor*/,
                                          PassStatistics& /*statistics*/) const override {
        return std::make_unique<PathEstimator>(scene_, light_guides_ ? &*light_guides_ : nullptr,
                                               guides_ ? &*guides_ : nullptr, chains_.get());
    }

  private:
    const Scene& scene_;
    std::optional<GuideMap> light_guides_;
    std::optional<DirectionGuideMap> guides_;
    std::unique_ptr<const ChainGuide> chains_;
};

class PathIntegrator final : public Integrator {
  public:
    explicit PathIntegrator(const PathSettings& settings) : settings_(settings) {}
    bool takes_receivers() const override { return true; }
    std::unique_ptr<const Session> begin(const RenderContext& context,
                                         OnceStatistics& statistics) const override {
        std::optional<GuideMap> light_guides;
        std::optional<DirectionGuideMap> guides;
        if (settings_.guide_lights > 0 && !nothing_to_choose(context.scene))
            light_guides = make_light_guides(context, statistics);
        if (settings_.guide_paths > 0 && !context.monitor.stopped())
            guides = make_guides(context, statistics);
        std::unique_ptr<const ChainGuide> chains;
        if (settings_.chains > 0 && !context.monitor.stopped()) chains = make_chains(context, statistics);
        if (context.monitor.stopped()) return nullptr;
        return std::make_unique<PathSession>(context.scene, std::move(light_guides), std::move(guides),
                                             std::move(chains));
    }

  private:
    GuideMap make_light_guides(const RenderContext& context, OnceStatistics& statistics) const {
        const Stopwatch building;
        GuideParameters parameters{settings_.guide_lights, context.seed, 0, {}};
        parameters.settings.radius = largest_radius(diagonal(context.scene));
        GuideMap guides = build_guides(context.scene, parameters, context.workers, context.monitor);
        statistics.seconds.add("guide", building.seconds());
        return guides;
    }

    // Returns none where guides do not pay.
    std::optional<DirectionGuideMap> make_guides(const RenderContext& context,
                                                 OnceStatistics& statistics) const {
        const Stopwatch building;
        DirectionGuideParameters parameters{settings_.guide_paths, context.seed, {}};
        parameters.settings.radius = largest_radius(diagonal(context.scene));
        std::optional<DirectionGuideMap> guides(
            build_direction_guides(context.scene, parameters, context.workers, context.monitor));
        if (context.monitor.stopped()) return std::nullopt;
        const bool any = guides->records() > 0;
        if (!any ||
            (context.view && !guides_pay({context.scene, nullptr, &*guides, nullptr}, settings_, context))) {
            guides.reset();
        }
        statistics.seconds.add("guide", building.seconds());
        statistics.guides = {guides ? guides->photons() : 0, guides ? guides->records() : 0};
        return guides;
    }

    // Returns null where the search for chains does not pay. Without a view it is not known, and points in
    // space are far from the photons.
    std::unique_ptr<const ChainGuide> make_chains(const RenderContext& context,
                                                  OnceStatistics& statistics) const {
        constexpr double kLeastShare = 0.01;  // of the image's light
        if (!context.view) return nullptr;
        constexpr std::int64_t kPilot = 1 << 17;
        const Stopwatch building;
        const auto build = [&](std::int64_t paths) {
            return build_chain_guide(context.scene, {paths, context.seed}, context.workers, context.monitor);
        };
        std::unique_ptr<const ChainGuide> chains = build(std::min(settings_.chains, kPilot));
        if (chains) {
            const PathEstimator paths(context.scene, nullptr, nullptr, chains.get());
            if (light_over_chains(paths, settings_, context) < kLeastShare) chains.reset();
        }
        // A pilot that ended before all of its paths has found enough photons.
        if (chains && chains->paths() == kPilot && settings_.chains > kPilot)
            chains = build(settings_.chains);
        statistics.seconds.add("guide", building.seconds());
        return chains;
    }

    PathSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_path(const PathSettings& settings) {
    return std::make_unique<PathIntegrator>(settings);
}

}  // namespace lucerna
