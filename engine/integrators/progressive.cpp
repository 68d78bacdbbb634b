// Implements progressive photon mapping in memoryless passes [Knaus and Zwicker 2011;
// photon/radius_schedule.h].
//
// Each pass builds photon maps of its own, a function of (seed, pass), and takes some camera samples of every
// pixel. One of them estimates density on behalf of all (where a pixel shows an edge, every one): at the
// first diffuse surface all photons within a fixed radius count. An estimate costs as much as several camera
// samples, and all samples of a pass share its photons. Every sample samples direct light (or reads it from
// the Direct map with the estimate) and follows mirrors, glass and gloss as in photon_mapping.cpp. The radius
// of pass i at x is
//
//   r_i(x)² = s_i r_1(x)²,
//
// where s_i is the sequence of photon/radius_schedule.h and r_1(x) is the radius that holds k photons near x
// in pre-pass maps. These are built once, before the first pass, from as many light paths as a pass has.
// Where they show even light on a wider disc (photon/evenness.h), r_1 holds up to 4 k photons [Lin 2020].
//
// Choice of k. Variance falls as 1/k, and bias grows as k. Both change from pass to pass by the same
// sequences, so that the k that balances them in the first pass does so in all. Unevenness that the test of
// 4 k photons misses is no larger than their noise, and neither is its bias, while the wider disc has a
// quarter of the variance. The same places also record once whether edges or walls cut off the disc, so that
// estimates need probes: a disc that is not cut off stays so as radii shrink.
//
// Consistency. No pass uses the photons of the pre-pass. Given r_1, a fixed function of the place with a
// positive lower and a finite upper bound, the passes are independent, and each is an estimate of fixed
// radius, as the theory requires. Their mean therefore converges for whatever r_1 the pre-pass found, even if
// it missed structure, and hence on the average over pre-passes. Probes correct a bias that vanishes with the
// radius, so the mean converges even where they are left out by mistake. A radius found in the pass's own map
// would depend on the photons that it averages over. The mean would then converge only if photons fell
// independently of each other, which those of one light path, and those of a low-discrepancy net, do not.
#include <fmt/format.h>

#include <array>

#include "engine/base/elementary.h"
#include "engine/base/monitor.h"
#include "engine/integrators/integrator.h"
#include "engine/integrators/photon_mapping.h"
#include "photon/density_estimate.h"
#include "photon/radius_schedule.h"

namespace lucerna {
namespace {

// The pre-pass has this pass number, which no other pass has.
constexpr std::uint32_t kRadiusPrePass = 0xffffffffU;

// The first radius is known at this many points per map, at most. Radii vary as slowly as the light does.
constexpr std::size_t kPrePassPoints = 8192;

// Discs of caustics, whose structure is finer than that of indirect light, hold k / kCausticShare photons.
constexpr int kCausticShare = 2;

// Returns r_1: one length everywhere, or the radius that the pre-pass found near a point.
class FirstRadii {
  public:
    explicit FirstRadii(float radius) : largest_(radius) {}
    FirstRadii(const PhotonMaps& maps, const DensityEstimateSettings& how, const RenderContext& context)
        : largest_(how.radius) {
        LocalRadius::Parameters parameters{.how = how, .points = kPrePassPoints, .seed = context.seed};
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            const PhotonMap* map = maps.find(static_cast<MapKind>(kind));
            if (map && kind == static_cast<std::size_t>(MapKind::volume)) {
                volume_ = radius_in_space(*map, how.k);
            } else if (map) {
                // Caustics have a radius for each photon, and need neither wider discs nor probes.
                const bool caustic = kind == static_cast<std::size_t>(MapKind::caustic);
                parameters.how.k = caustic ? (how.k + kCausticShare - 1) / kCausticShare : how.k;
                parameters.wider_where_even = !caustic;
                parameters.scene = caustic ? nullptr : &context.scene;
                found_[kind].emplace(*map, parameters, context.workers);
            }
        }
    }

    // Returns the mean of each map; none where there is no map to find radii in.
    std::array<std::optional<double>, kMapKinds> means() const {
        std::array<std::optional<double>, kMapKinds> result;
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            if (found_[kind]) result[kind] = found_[kind]->mean();
        }
        return result;
    }

    LocalRadius::At at(MapKind kind, const V3f& x, const V3f& n) const {
        const auto& found = found_[static_cast<std::size_t>(kind)];
        return found ? found->at(x, n) : LocalRadius::At{largest_, false};
    }
    float volume() const { return volume_; }

  private:
    // Returns the radius of a ball that holds k photons at the average density over their bounding box.
    float radius_in_space(const PhotonMap& map, int k) const {
        Box3f box;
        for (const V3f& p : map.positions()) box.extendBy(p);
        if (box.isEmpty()) return largest_;
        const V3d size(box.size());
        const double radius =
            cbrt(0.75 / M_PI * size.x * size.y * size.z * k / static_cast<double>(map.size()));
        return radius > 0 ? std::min(static_cast<float>(radius), largest_) : largest_;
    }

    float largest_;
    float volume_ = largest_;
    std::array<std::optional<LocalRadius>, kMapKinds> found_;
};

// Returns r_i by shrinking all first radii by the same factor. In space the number of photons in a ball goes
// as r³, so r³ shrinks by the sequence and the variance grows as it does on surfaces; the bias, r², falls as
// N^(2(α-1)/3).
class PassRadii final : public RadiusRule {
  public:
    PassRadii(const FirstRadii& first, double share)
        : first_(first),
          scale_(static_cast<float>(std::sqrt(share))),
          volume_scale_(static_cast<float>(cbrt(share))) {}
    LocalRadius::At radius(MapKind map, const V3f& x, const V3f& n) const override {
        const LocalRadius::At first = first_.at(map, x, n);
        return {scale_ * first.radius, first.whole};
    }
    float volume_radius() const override { return volume_scale_ * first_.volume(); }

  private:
    const FirstRadii& first_;
    float scale_, volume_scale_;
};

// A few probes per estimate suffice, because they are right in the mean and passes are averaged.
constexpr ProbeEffort kPassProbes{.photons = 4, .directions = 1, .places = 8};

// Returns the settings of the maps that every pass builds and reads.
PhotonMapSettings map_settings(const ProgressiveSettings& of) {
    PhotonMapSettings settings;
    settings.photons = of.photons;
    settings.direct = of.direct;
    settings.indirect = IndirectMethod::map;
    settings.estimate = of.estimate;
    settings.estimate.probes = kPassProbes;
    settings.index = of.index;
    settings.pre_pass = of.pre_pass;
    settings.max_depth = of.max_depth;
    settings.quantity = of.quantity;
    return settings;
}

class ProgressiveSession final : public Session {
  public:
    ProgressiveSession(const ProgressiveSettings& settings, const RenderContext& context,
                       std::optional<ImportancePrePass> pre_pass, FirstRadii radii)
        : settings_(map_settings(settings)),
          samples_(settings.samples),
          schedule_(static_cast<double>(settings.alpha)),
          context_(context.with_deadline({})),  // no deadline: all passes must be alike
          pre_pass_(std::move(pre_pass)),
          radii_(std::move(radii)) {
        if (context.view && samples_ > 1) edges_ = PixelEdges(context.scene, *context.view, context.workers);
    }

    std::unique_ptr<const Estimator> pass(std::uint32_t index, Monitor& monitor,
                                          PassStatistics& statistics) const override {
        const double share = schedule_.r2_ratio(index);
        statistics.radius_share = std::sqrt(share);
        FirstPassResult parts;
        parts.radii = std::make_unique<PassRadii>(radii_, share);
        parts.emission = pre_pass_ ? &pre_pass_->emission : nullptr;
        parts.samples = samples_;
        parts.edges = &edges_;
        return photon_map_pass(settings_, {context_.with_monitor(monitor), index, statistics},
                               std::move(parts));
    }

  private:
    PhotonMapSettings settings_;
    int samples_;
    RadiusSchedule schedule_;
    RenderContext context_;
    std::optional<ImportancePrePass> pre_pass_;
    FirstRadii radii_;
    PixelEdges edges_;
};

struct RadiusPrePass {
    FirstRadii radii;
    std::int64_t paths;
};
// Builds pre-pass maps from as many light paths as a pass has, or fewer if time is short, and finds the first
// radii in them. Returns none if the monitor stopped it.
std::optional<RadiusPrePass> find_first_radii(const ProgressiveSettings& settings,
                                              const DensityEstimateSettings& how,
                                              const RenderContext& context, const LearnedEmission* emission) {
    PassStatistics unused;
    MapParameters parameters = map_parameters(map_settings(settings), {context, kRadiusPrePass, unused});
    parameters.emission = emission;
    const PhotonMaps maps = build_photon_maps(context.scene, parameters, context.workers, context.monitor);
    if (context.monitor.stopped()) return std::nullopt;
    return RadiusPrePass{FirstRadii(maps, how, context), static_cast<std::int64_t>(maps.ledger.paths)};
}

class ProgressiveIntegrator final : public Integrator {
  public:
    explicit ProgressiveIntegrator(const ProgressiveSettings& settings) : settings_(settings) {}

    int samples_per_pass() const override { return settings_.samples; }

    std::unique_ptr<const Session> begin(const RenderContext& context,
                                         OnceStatistics& statistics) const override {
        DensityEstimateSettings how = settings_.estimate;
        how.boundary = Boundary::none;
        how.radius = largest_radius(diagonal(context.scene), how.radius);
        auto pre_pass = learn_emission(map_settings(settings_), how, context, statistics);
        if (context.monitor.stopped()) return nullptr;
        std::optional<FirstRadii> radii;
        ProgressiveSettings settings = settings_;
        if (settings_.estimate.radius > 0) {
            radii.emplace(settings_.estimate.radius);
        } else {
            const Stopwatch watch;
            auto found = find_first_radii(settings_, how, context, pre_pass ? &pre_pass->emission : nullptr);
            if (!found) return nullptr;
            radii = std::move(found->radii);
            // All passes get as many paths as there was time for here, because all must blur equally.
            settings.photons = std::min(settings.photons, found->paths);
            statistics.first_radius = radii->means();
            statistics.seconds.add("radii", watch.seconds());
        }
        return std::make_unique<ProgressiveSession>(settings, context, std::move(pre_pass),
                                                    std::move(*radii));
    }

    std::vector<std::string> describe(const Scene& scene) const override {
        std::vector<std::string> lines{fmt::format("for every pass: {} light paths", settings_.photons)};
        for (std::size_t i = 0; i < kMapKinds; ++i) {
            const auto kind = static_cast<MapKind>(i);
            if (map_need(kind, map_settings(settings_), scene).build)
                lines.push_back(fmt::format("a {} map", map_name(kind)));
        }
        lines.push_back(
            settings_.estimate.radius > 0
                ? fmt::format("the first radius is {:g}", settings_.estimate.radius)
                : fmt::format("once: maps of a pre-pass, whose radius for {} photons is the first radius",
                              settings_.estimate.k));
        if (settings_.pre_pass > 0) lines.push_back("once: " + describe_pre_pass(settings_.pre_pass));
        return lines;
    }

  private:
    ProgressiveSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_progressive(const ProgressiveSettings& settings) {
    return std::make_unique<ProgressiveIntegrator>(settings);
}

}  // namespace lucerna
