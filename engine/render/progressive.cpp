// Progressive photon mapping in memoryless passes (Knaus and Zwicker 2011) [photon-maps 5; photon/shrink.h].
//
// A pass builds maps of its own, a function of (seed, pass), and looks at them once per camera sample: at the
// first diffuse surface all photons within a fixed radius count. Direct light is sampled (or read from the
// Direct map), mirrors, glass and gloss are followed, all as in photon_estimator.h. The radius of pass i at x
// is
//
//   r_i(x)² = s_i r_1(x)²,
//
// s_i the sequence of photon/shrink.h and r_1(x) the radius that holds k photons near x in pilot maps, which
// are made once, before the first pass, of as many light paths as a pass has.
//
// Why that is consistent. The pilot's photons are those of no pass. Given r_1, which is then a fixed function
// of the place with a positive lower and a finite upper bound, the passes are independent and each is the
// estimate of a fixed radius that the theory speaks of; so the mean converges for whatever r_1 the pilot
// happened to find, and therefore on the average over pilots. A radius found in the pass's own map would be a
// function of the photons it then averages over: unbiased in the limit only if photons fell independently of
// each other, which those of one light path, and those of a net, do not.
#include <array>

#include "engine/base/stopwatch.h"
#include "engine/render/integrator.h"
#include "engine/render/needed_maps.h"
#include "engine/render/photon_mapping.h"
#include "engine/render/steering.h"
#include "photon/local_radius.h"
#include "photon/shrink.h"

namespace lucerna {
namespace {

// The largest first radius, as a share of the scene's diagonal: where the pilot has too few photons.
constexpr float kLargestRadius = 0.05F;

// The pilot's place among the passes: none of them ever has that number.
constexpr std::uint32_t kPilotPass = 0xffffffffU;

// Points at which the first radius is known, at most, per map. Radii change as slowly as the light does.
constexpr std::size_t kPilotPoints = 8192;

// r_1: one length, or what the pilot found near by.
class FirstRadii {
  public:
    explicit FirstRadii(float radius) : largest_(radius) {}
    FirstRadii(const PhotonMaps& maps, const GatherSettings& how, const Workers& workers)
        : largest_(how.radius) {
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            const PhotonMap* map = maps.find(static_cast<MapKind>(kind));
            if (map && kind == static_cast<std::size_t>(MapKind::volume)) {
                volume_ = radius_in_space(*map, how.k);
            } else if (map) {
                found_[kind].emplace(*map, how, kPilotPoints, workers);
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

// What every pass goes by.
struct Ahead final : Groundwork {
    Ahead(FirstRadii r, std::optional<Pilot> e) : radii(std::move(r)), emission(std::move(e)) {}

    FirstRadii radii;
    std::optional<Pilot> emission;
};

class ProgressiveIntegrator final : public Integrator {
  public:
    explicit ProgressiveIntegrator(const ProgressiveSettings& settings) : settings_(settings) {}

    int samples_per_pass() const override { return settings_.samples; }

    std::unique_ptr<const Groundwork> groundwork(const PassContext& context) const override {
        GatherSettings how;
        how.k = settings_.k;
        how.radius = settings_.radius > 0 ? settings_.radius : kLargestRadius * diagonal(context.scene);
        how.ratio = settings_.ratio;
        how.kernel = settings_.kernel;
        how.metric = settings_.metric;
        auto emission = learn_emission(photon_settings(), how, context);
        if (context.monitor.stopped()) return nullptr;
        if (settings_.radius > 0) {
            return std::make_unique<Ahead>(FirstRadii(settings_.radius), std::move(emission));
        }
        const Stopwatch watch;
        MapPlan plan;
        plan.emission = emission ? &emission->plan : nullptr;
        plan.paths = settings_.photons;
        plan.seed = context.seed;
        plan.pass = kPilotPass;
        plan.volume_direct = settings_.direct == DirectMethod::map;
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            plan.wanted[kind] = map_need(static_cast<MapKind>(kind), photon_settings(), context.scene).build;
        }
        const PhotonMaps maps = build_photon_maps(context.scene, plan, context.workers, context.monitor);
        if (context.monitor.stopped()) return nullptr;
        auto ahead = std::make_unique<Ahead>(FirstRadii(maps, how, context.workers), std::move(emission));
        ahead->radii.report(context.report);
        context.report.seconds.emplace_back("radii", watch.seconds());
        return ahead;
    }

    std::unique_ptr<const Estimator> prepare(const PassContext& context) const override {
        const auto& ahead = static_cast<const Ahead&>(*context.groundwork);
        const double share = Shrink(static_cast<double>(settings_.alpha)).share(context.pass);
        context.report.numbers["radius.share"] = std::sqrt(share);  // of the first
        return prepare_photon_maps(photon_settings(), context,
                                   std::make_unique<PassRadii>(ahead.radii, share),
                                   ahead.emission ? &ahead.emission->plan : nullptr);
    }

    std::vector<std::string> plan(const Scene& scene) const override {
        std::vector<std::string> lines{fmt::format("for every pass: {} light paths", settings_.photons)};
        for (std::size_t i = 0; i < kMapKinds; ++i) {
            const auto kind = static_cast<MapKind>(i);
            if (map_need(kind, photon_settings(), scene).build)
                lines.push_back(fmt::format("a {} map", map_name(kind)));
        }
        lines.push_back(settings_.radius > 0
                            ? fmt::format("the first radius is {:g}", settings_.radius)
                            : fmt::format("once: pilot maps, whose radius for {} photons is the first radius",
                                          settings_.k));
        if (settings_.pilot > 0) lines.push_back("once: " + pilot_line(settings_.pilot));
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
        settings.pilot = settings_.pilot;
        settings.pilot_floor = settings_.pilot_floor;
        return settings;
    }

    ProgressiveSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_progressive(const ProgressiveSettings& settings) {
    return std::make_unique<ProgressiveIntegrator>(settings);
}

}  // namespace lucerna
