// Progressive photon mapping in memoryless passes [Knaus and Zwicker 2011; photon/radius_schedule.h].
//
// A pass builds maps of its own, a function of (seed, pass), and has some camera samples of every pixel. One
// of them looks at the maps, and stands for all: at the first diffuse surface all photons within a fixed
// radius count. An estimate costs as much as several camera samples, and photons are of one pass whoever
// looks at them. Direct light is sampled by every sample (or read from the Direct map with the estimate),
// mirrors, glass and gloss are followed, all as in photon_mapping.cpp. The radius of pass i at x is
//
//   r_i(x)² = s_i r_1(x)²,
//
// s_i the sequence of photon/radius_schedule.h and r_1(x) the radius that holds k photons near x in pre-pass
// maps, which are made once, before the first pass, of as many light paths as a pass has; where the light on
// a wider disc is even by their word (photon/evenness.h), the radius that holds up to 4 k [Lin 2020].
//
// How wide. Noise falls as 1/k, the bias grows as k; both shrink with the passes by the same sequences, so
// that the k that balances them in the first pass does so in all of them. Unevenness that the test of 4 k
// photons does not find is no larger than their noise, and neither is its bias: there the wider disc has a
// quarter of the variance. Whether a disc is cut off by edges or walls, so that estimates need probes, is
// found at the same places once: as radii shrink, what is whole stays whole.
//
// Why that is consistent. The pre-pass's photons are those of no pass. Given r_1, which is then a fixed
// function of the place with a positive lower and a finite upper bound, the passes are independent and each
// is the estimate of a fixed radius that the theory speaks of; so the mean converges for whatever r_1 the
// pre-pass happened to find, whether or not it missed structure, and therefore on the average over
// pre-passes. Probes correct a bias that vanishes with the radius: where they are left out by mistake the
// mean converges, too. A radius found in the pass's own map would be a function of the photons it then
// averages over: unbiased in the limit only if photons fell independently of each other, which those of one
// light path, and those of a net, do not.
#include <fmt/format.h>

#include <array>

#include "engine/base/monitor.h"
#include "engine/integrators/integrator.h"
#include "engine/integrators/photon_mapping.h"
#include "photon/density_estimate.h"
#include "photon/radius_schedule.h"

namespace lucerna {
namespace {

// The pre-pass's place among the passes: none of them ever has that number.
constexpr std::uint32_t kRadiusPrePass = 0xffffffffU;

// Points at which the first radius is known, at most, per map. Radii change as slowly as the light does.
constexpr std::size_t kPrePassPoints = 8192;

// A caustic's own structure is finer than that of indirect light: its discs hold one photon in so many of k.
constexpr int kCausticShare = 2;

// r_1: one length, or what the pre-pass found near by.
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
                // Caustics are estimated by photon, with neither wider discs nor probes.
                const bool caustic = kind == static_cast<std::size_t>(MapKind::caustic);
                parameters.how.k = caustic ? (how.k + kCausticShare - 1) / kCausticShare : how.k;
                parameters.wider_where_even = !caustic;
                parameters.scene = caustic ? nullptr : &context.scene;
                found_[kind].emplace(*map, parameters, context.workers);
            }
        }
    }

    // Of each map; none where there is no map to find them in.
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
    // Of a ball that holds k photons where they are as dense as on the average over the box around them all.
    float radius_in_space(const PhotonMap& map, int k) const {
        Box3f box;
        for (const V3f& p : map.positions()) box.extendBy(p);
        if (box.isEmpty()) return largest_;
        const V3d size(box.size());
        const double radius =
            std::cbrt(0.75 / M_PI * size.x * size.y * size.z * k / static_cast<double>(map.size()));
        return radius > 0 ? std::min(static_cast<float>(radius), largest_) : largest_;
    }

    float largest_;
    float volume_ = largest_;
    std::array<std::optional<LocalRadius>, kMapKinds> found_;
};

// r_i: all of them smaller by the same share. In space a ball holds as many photons as its r³ is large: that
// is what shrinks there by the sequence, so that the variance grows as it does on surfaces; the bias, r²,
// falls as N^(2(α-1)/3).
class PassRadii final : public RadiusRule {
  public:
    PassRadii(const FirstRadii& first, double share)
        : first_(first),
          scale_(static_cast<float>(std::sqrt(share))),
          volume_scale_(static_cast<float>(std::cbrt(share))) {}
    LocalRadius::At radius(MapKind map, const V3f& x, const V3f& n) const override {
        const LocalRadius::At first = first_.at(map, x, n);
        return {scale_ * first.radius, first.whole};
    }
    float volume_radius() const override { return volume_scale_ * first_.volume(); }

  private:
    const FirstRadii& first_;
    float scale_, volume_scale_;
};

// Probes of an estimate: passes are averaged, and a few are right in the mean.
constexpr ProbeEffort kPassProbes{.photons = 4, .directions = 1, .places = 8};

// The maps that every pass builds and looks at.
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
          context_(context.prepared_by({})),  // of every pass alike
          pre_pass_(std::move(pre_pass)),
          radii_(std::move(radii)) {
        if (context.view && samples_ > 1) edges_ = PixelEdges(context.scene, *context.view, context.workers);
    }

    std::unique_ptr<const Estimator> pass(std::uint32_t index, Monitor& monitor,
                                          PassStatistics& statistics) const override {
        const double share = schedule_.r2_ratio(index);
        statistics.radius_share = std::sqrt(share);
        PhotonMapPass parts;
        parts.radii = std::make_unique<PassRadii>(radii_, share);
        parts.emission = pre_pass_ ? &pre_pass_->emission : nullptr;
        parts.samples = samples_;
        parts.edges = &edges_;
        return photon_map_pass(settings_, {context_.told_to(monitor), index, statistics}, std::move(parts));
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
// Pre-pass maps, of as many light paths as a pass has, and the radii found in them; of fewer where there is
// not the time for them. None if the monitor stopped it.
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
            // All passes are of as many as there was time for here: they must not differ in what they blur.
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
