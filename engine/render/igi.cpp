// Instant global illumination, as the note has it [igi 1-3]: indirect light from a set of virtual lights, on
// surfaces and where media scatter. A set lights surfaces, and the places along a ray at which media scatter.
#include <bit>

#include "engine/render/direct_light.h"
#include "engine/render/energy_report.h"
#include "engine/render/integrator.h"
#include "engine/render/specular_chain.h"
#include "photon/virtual_lights.h"

namespace lucerna {
namespace {

float smoothstep(float low, float high, float x) {
    if (x <= low) return 0;
    if (x >= high) return 1;  // also when low == high: the divisor below is never 0
    const float t = (x - low) / (high - low);
    return t * t * (3 - 2 * t);
}

// Of the scene's diagonal: wide enough to hide the bright spots of some ten virtual lights per set.
constexpr float kDefaultMinDist = 0.02F;

class IgiEstimator final : public Estimator {
  public:
    IgiEstimator(const Scene& scene, const IgiSettings& settings, VirtualLightSets sets, std::uint32_t paths)
        : scene_(scene), settings_(settings), sets_(std::move(sets)), paths_(static_cast<float>(paths)) {
        if (settings_.mindist < 0) settings_.mindist = kDefaultMinDist * diagonal(scene);
    }

    Rgb radiance(const Ray& ray, Stream& stream) const override {
        // One well-distributed number chooses the set.
        const auto count = static_cast<float>(sets_.begins.size() - 1);
        const auto set = static_cast<std::size_t>(stream.next() * count);
        const auto shade = [&](const Vertex& vertex) {
            DirectLight shaded = direct_light(scene_, vertex, stream);
            if (!vertex.bsdf.is_black()) shaded.radiance += indirect(vertex, set, stream);
            return shaded;
        };
        if (settings_.quantity == Quantity::illuminance) return meter_and_shade(scene_, ray, shade);
        const auto source = [&](const MediumVertex& vertex, const Rgb& sigma_s) {
            return sigma_s * (direct_light(scene_, vertex, stream) + indirect(vertex, set, stream));
        };
        return follow_and_shade(scene_, ray, settings_.max_specular_depth, stream, shade, source);
    }

  private:
    // The sum over one set is one sample per light path: it is divided by the number of paths. (The note's
    // listing divides by the number of virtual lights, of which a path makes several; that loses their
    // energy.)
    template <typename Place>
    Rgb indirect(const Place& place, std::size_t set, Stream& stream) const {
        Rgb sum(0);
        Stream roulette = stream.split(1);
        for (std::uint32_t i = sets_.begins[set]; i < sets_.begins[set + 1]; ++i) {
            sum += shade(place, sets_.lights[i], roulette);
        }
        return sum;
    }

    template <typename Place>
    Rgb shade(const Place& place, const VirtualLight& light, Stream& roulette) const {
        const float u_shadow = roulette.next();
        const SurfacePoint x = place.from();
        const V3f way = light.at.p - x.p;
        const float d2 = way.length2();
        // A virtual light on the very point lights nothing: where d² cannot be told from 0, G has no value.
        if (!(d2 > sqr(x.error + light.at.error))) return Rgb(0);
        const float min2 = sqr(settings_.mindist);
        const float fade = smoothstep(0.8F * min2, 1.2F * min2, d2);
        const float d = std::sqrt(d2);
        const V3f w = way / d;
        const float sent = light.towards(-w);
        if (!(fade > 0) || !(sent > 0)) return Rgb(0);  // on a surface they shine on their side only

        Rgb value =
            place.value(w) * light.contribution * (fade * settings_.indirect_scale * sent / d2 / paths_);
        if (is_black(value)) return value;

        // Faint lights get their shadow ray only sometimes.
        if (luminance(value) < settings_.rr_threshold) {
            if (!(u_shadow < settings_.rr_continue)) return Rgb(0);
            value /= settings_.rr_continue;  // at least 1e-6
        }
        if (!visible_between(scene_, x, light.at)) return Rgb(0);
        return value * passage(scene_, x, w, d, place.medium_towards(w), roulette);
    }

    const Scene& scene_;
    IgiSettings settings_;
    VirtualLightSets sets_;
    float paths_;
};

class IgiIntegrator final : public Integrator {
  public:
    explicit IgiIntegrator(const IgiSettings& settings) : settings_(settings) {}

    std::unique_ptr<const Estimator> prepare(const PassContext& context) const override {
        VirtualLightPlan plan;
        plan.sets = sets();
        plan.paths = paths();
        plan.seed = context.seed;
        plan.pass = context.pass;
        VirtualLightSets lights = build_virtual_lights(context.scene, plan, context.workers, context.monitor);
        if (context.monitor.stopped()) return nullptr;
        report_energy(lights.ledger, context.report);
        context.report.numbers["virtual_lights.total"] = static_cast<double>(lights.lights.size());
        context.report.numbers["virtual_lights.sets"] = plan.sets;
        return std::make_unique<IgiEstimator>(context.scene, settings_, std::move(lights), plan.paths);
    }

    std::vector<std::string> plan(const Scene& /*scene*/) const override {
        return {fmt::format("{} sets of virtual lights from {} light paths each", sets(), paths())};
    }

  private:
    std::uint32_t sets() const { return std::bit_ceil(static_cast<std::uint32_t>(settings_.nsets)); }
    std::uint32_t paths() const { return std::bit_ceil(static_cast<std::uint32_t>(settings_.nlights)); }

    IgiSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_igi(const IgiSettings& settings) {
    return std::make_unique<IgiIntegrator>(settings);
}

}  // namespace lucerna
