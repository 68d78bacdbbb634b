// Progressive photon mapping in memoryless passes [Knaus and Zwicker 2011; photon/radius_schedule.h].
//
// A pass builds maps of its own, a function of (seed, pass), and looks at them once per camera sample: at the
// first diffuse surface all photons within a fixed radius count. Direct light is sampled (or read from the
// Direct map), mirrors, glass and gloss are followed, all as in photon_mapping.cpp. The radius of pass i at x
// is
//
//   r_i(x)² = s_i r_1(x)²,
//
// s_i the sequence of photon/radius_schedule.h and r_1(x) the radius that holds k photons near x in pre-pass
// maps, which are made once, before the first pass, of as many light paths as a pass has.
//
// Why that is consistent. The pre-pass's photons are those of no pass. Given r_1, which is then a fixed
// function of the place with a positive lower and a finite upper bound, the passes are independent and each
// is the estimate of a fixed radius that the theory speaks of; so the mean converges for whatever r_1 the
// pre-pass happened to find, and therefore on the average over pre-passes. A radius found in the pass's own
// map would be a function of the photons it then averages over: unbiased in the limit only if photons fell
// independently of each other, which those of one light path, and those of a net, do not.
#include <array>

#include "engine/base/stopwatch.h"
#include "engine/integrators/integrator.h"
#include "engine/integrators/needed_maps.h"
#include "engine/integrators/photon_mapping.h"
#include "engine/integrators/steering.h"
#include "photon/local_radius.h"
#include "photon/radius_schedule.h"

namespace lucerna {
namespace {

// The largest first radius, as a share of the scene's diagonal: where the pre-pass has too few photons.
constexpr float kLargestRadius = 0.05F;

// The pre-pass's place among the passes: none of them ever has that number.
constexpr std::uint32_t kRadiusPrePass = 0xffffffffU;

// Points at which the first radius is known, at most, per map. Radii change as slowly as the light does.
constexpr std::size_t kPrePassPoints = 8192;

// r_1: one length, or what the pre-pass found near by.
class FirstRadii {
  public:
    explicit FirstRadii(float radius) : largest_(radius) {}
    FirstRadii(const PhotonMaps& maps, const DensityEstimateSettings& how, const Workers& workers)
        : largest_(how.radius) {
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            const PhotonMap* map = maps.find(static_cast<MapKind>(kind));
            if (map && kind == static_cast<std::size_t>(MapKind::volume)) {
                volume_ = radius_in_space(*map, how.k);
            } else if (map) {
                found_[kind].emplace(*map, how, kPrePassPoints, workers);
            }
        }
    }

    void report(RenderReport& report) const {
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            if (!found_[kind]) continue;
            report.numbers[fmt::format("radius.first.{}", map_name(static_cast<MapKind>(kind)))] =
                found_[kind]->mean();
        }
    }

    // Scene units, > 0.
    float at(MapKind kind, const V3f& x, const V3f& n) const {
        const auto& found = found_[static_cast<std::size_t>(kind)];
        return found ? found->at(x, n) : largest_;
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
    float radius(MapKind map, const V3f& x, const V3f& n) const override {
        return scale_ * first_.at(map, x, n);
    }
    float volume_radius() const override { return volume_scale_ * first_.volume(); }

  private:
    const FirstRadii& first_;
    float scale_, volume_scale_;
};

// The state that all passes share: first radii and the importance pre-pass.
struct ProgressiveState final : SharedState {
    ProgressiveState(FirstRadii r, std::optional<ImportancePrePass> p)
        : radii(std::move(r)), pre_pass(std::move(p)) {}

    FirstRadii radii;
    std::optional<ImportancePrePass> pre_pass;
};

class ProgressiveIntegrator final : public Integrator {
  public:
    explicit ProgressiveIntegrator(const ProgressiveSettings& settings) : settings_(settings) {}

    int samples_per_pass() const override { return settings_.samples; }

    std::unique_ptr<const SharedState> shared_state(const PassContext& context) const override {
        DensityEstimateSettings how;
        how.k = settings_.k;
        how.radius = settings_.radius > 0 ? settings_.radius : kLargestRadius * diagonal(context.scene);
        how.ratio = settings_.ratio;
        how.kernel = settings_.kernel;
        how.metric = settings_.metric;
        auto pre_pass = learn_emission(photon_settings(), how, context);
        if (context.monitor.stopped()) return nullptr;
        if (settings_.radius > 0) {
            return std::make_unique<ProgressiveState>(FirstRadii(settings_.radius), std::move(pre_pass));
        }
        const Stopwatch watch;
        MapParameters parameters;
        parameters.emission = pre_pass ? &pre_pass->emission : nullptr;
        parameters.paths = settings_.photons;
        parameters.seed = context.seed;
        parameters.pass = kRadiusPrePass;
        parameters.volume_direct = settings_.direct == DirectMethod::map;
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            parameters.wanted[kind] =
                map_need(static_cast<MapKind>(kind), photon_settings(), context.scene).build;
        }
        const PhotonMaps maps =
            build_photon_maps(context.scene, parameters, context.workers, context.monitor);
        if (context.monitor.stopped()) return nullptr;
        auto state =
            std::make_unique<ProgressiveState>(FirstRadii(maps, how, context.workers), std::move(pre_pass));
        state->radii.report(context.report);
        context.report.seconds.emplace_back("radii", watch.seconds());
        return state;
    }

    std::unique_ptr<const Estimator> prepare(const PassContext& context) const override {
        const auto& state = static_cast<const ProgressiveState&>(*context.shared_state);
        const double share = RadiusSchedule(static_cast<double>(settings_.alpha)).r2_ratio(context.pass);
        context.report.numbers["radius.share"] = std::sqrt(share);  // of the first
        return prepare_photon_maps(photon_settings(), context,
                                   std::make_unique<PassRadii>(state.radii, share),
                                   state.pre_pass ? &state.pre_pass->emission : nullptr);
    }

    std::vector<std::string> describe(const Scene& scene) const override {
        std::vector<std::string> lines{fmt::format("for every pass: {} light paths", settings_.photons)};
        for (std::size_t i = 0; i < kMapKinds; ++i) {
            const auto kind = static_cast<MapKind>(i);
            if (map_need(kind, photon_settings(), scene).build)
                lines.push_back(fmt::format("a {} map", map_name(kind)));
        }
        lines.push_back(
            settings_.radius > 0
                ? fmt::format("the first radius is {:g}", settings_.radius)
                : fmt::format("once: pre-pass maps, whose radius for {} photons is the first radius",
                              settings_.k));
        if (settings_.pre_pass > 0) lines.push_back("once: " + describe_pre_pass(settings_.pre_pass));
        return lines;
    }

  private:
    PhotonMapSettings photon_settings() const {
        PhotonMapSettings settings;
        settings.photons = settings_.photons;
        settings.direct = settings_.direct;
        settings.lights = settings_.lights;
        settings.indirect = IndirectMethod::map;
        settings.ratio = settings_.ratio;
        settings.kernel = settings_.kernel;
        settings.metric = settings_.metric;
        settings.max_specular_depth = settings_.max_specular_depth;
        settings.quantity = settings_.quantity;
        settings.boundary = settings_.boundary;
        settings.pre_pass = settings_.pre_pass;
        settings.pre_pass_defensive_weight = settings_.pre_pass_defensive_weight;
        return settings;
    }

    ProgressiveSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_progressive(const ProgressiveSettings& settings) {
    return std::make_unique<ProgressiveIntegrator>(settings);
}

}  // namespace lucerna
