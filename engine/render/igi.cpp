// Instant global illumination as a recipe [igi 1-3]: indirect light from sets of virtual lights, on surfaces
// and where media scatter. What is seen then: igi_estimator.h.
#include <fmt/format.h>

#include <bit>

#include "engine/render/energy_report.h"
#include "engine/render/igi_estimator.h"
#include "engine/render/igi_thinning.h"
#include "engine/render/steering.h"

namespace lucerna {
namespace {

class IgiIntegrator final : public Integrator {
  public:
    explicit IgiIntegrator(const IgiSettings& settings) : settings_(settings) {}

    std::unique_ptr<const Estimator> prepare(const PassContext& context) const override {
        const IgiSettings settings = with_distance(context.scene, settings_);
        auto pilot = learn_emission(settings, context);
        if (context.monitor.stopped()) return nullptr;
        VirtualLightPlan plan;
        plan.sets = sets();
        plan.paths = paths();
        plan.seed = context.seed;
        plan.pass = context.pass;
        plan.gloss = virtual_light_gloss(settings);
        if (pilot) plan.emission = &pilot->pilot.plan;
        const std::uint32_t factor = pilot && thins() ? thinning(plan) : 1;
        plan.paths *= factor;
        VirtualLightSets lights = build_virtual_lights(context.scene, plan, context.workers, context.monitor);
        if (context.monitor.stopped()) return nullptr;
        if (factor > 1) {
            context.report.numbers["virtual_lights.tried"] = static_cast<double>(lights.lights.size());
            lights = thin_virtual_lights(lights, factor, pilot->seen, settings, context);
            if (context.monitor.stopped()) return nullptr;
        }
        report_energy(lights.ledger, context.report);
        warn_of_endless_light(lights.ledger, context.monitor);
        context.report.numbers["virtual_lights.total"] = static_cast<double>(lights.lights.size());
        context.report.numbers["virtual_lights.sets"] = plan.sets;
        Phase phase(context.monitor, "virtual lights in order", 1);
        IgiLights ordered(lights, plan.paths, settings, context.workers);
        phase.advance(1);
        context.report.numbers["virtual_lights.bytes"] = static_cast<double>(ordered.bytes());
        IgiCaustics caustics(settings, context, plan.emission);
        if (context.monitor.stopped()) return nullptr;
        return make_igi_estimator(context.scene, settings, std::move(ordered), std::move(caustics),
                                  pilot ? std::move(pilot->guides) : std::nullopt);
    }

    std::vector<std::string> plan(const Scene& scene) const override {
        std::vector<std::string> lines;
        if (settings_.pilot > 0) lines.push_back(pilot_line(settings_.pilot));
        lines.push_back(fmt::format("{} sets of virtual lights from {} light paths each", sets(), paths()));
        if (thins()) lines.push_back("of those of more paths, the virtual lights that the picture needs");
        if (settings_.caustics == CausticMethod::map && throws_caustics(scene)) {
            lines.push_back(fmt::format("a Caustic map of {} light paths", settings_.caustic_paths));
        }
        return lines;
    }

  private:
    // A floor of 1 leaves all as it is.
    bool thins() const { return settings_.pilot > 0 && settings_.pilot_floor < 1; }
    std::uint32_t sets() const { return std::bit_ceil(static_cast<std::uint32_t>(settings_.nsets)); }
    std::uint32_t paths() const { return std::bit_ceil(static_cast<std::uint32_t>(settings_.nlights)); }

    IgiSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_igi(const IgiSettings& settings) {
    return std::make_unique<IgiIntegrator>(settings);
}

}  // namespace lucerna
