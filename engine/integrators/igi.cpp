// Instant global illumination as a recipe [Keller 1997; Wald 2002; Pharr 2004]: indirect light from sets of
// VPLs, on surfaces and where media scatter. What is seen then: igi_estimator.h.
#include <fmt/format.h>

#include <bit>

#include "engine/integrators/energy_report.h"
#include "engine/integrators/igi_estimator.h"
#include "engine/integrators/igi_thinning.h"
#include "engine/integrators/steering.h"

namespace lucerna {
namespace {

class IgiIntegrator final : public Integrator {
  public:
    explicit IgiIntegrator(const IgiSettings& settings) : settings_(settings) {}

    std::unique_ptr<const Estimator> prepare(const PassContext& context) const override {
        const IgiSettings settings = with_distance(context.scene, settings_);
        auto pre_pass = learn_emission(settings, context);
        if (context.monitor.stopped()) return nullptr;
        VplParameters parameters;
        parameters.sets = sets();
        parameters.paths = paths();
        parameters.seed = context.seed;
        parameters.pass = context.pass;
        parameters.gloss = vpl_gloss(settings);
        if (pre_pass) parameters.emission = &pre_pass->importance.emission;
        const std::uint32_t factor = pre_pass && thins() ? thinning(parameters) : 1;
        parameters.paths *= factor;
        VplSets lights = build_vpls(context.scene, parameters, context.workers, context.monitor);
        if (context.monitor.stopped()) return nullptr;
        if (factor > 1) {
            context.report.numbers["virtual_lights.tried"] = static_cast<double>(lights.lights.size());
            lights = thin_vpls(lights, factor, pre_pass->seen, settings, context);
            if (context.monitor.stopped()) return nullptr;
        }
        report_energy(lights.ledger, context.report);
        warn_of_endless_light(lights.ledger, context.monitor);
        context.report.numbers["virtual_lights.total"] = static_cast<double>(lights.lights.size());
        context.report.numbers["virtual_lights.sets"] = parameters.sets;
        Phase phase(context.monitor, "virtual point lights in order", 1);
        IgiVpls ordered(lights, parameters.paths, settings, context.workers);
        phase.advance(1);
        context.report.numbers["virtual_lights.bytes"] = static_cast<double>(ordered.bytes());
        IgiCaustics caustics(settings, context, parameters.emission);
        if (context.monitor.stopped()) return nullptr;
        return make_igi_estimator(context.scene, settings, std::move(ordered), std::move(caustics),
                                  pre_pass ? std::move(pre_pass->guides) : std::nullopt);
    }

    std::vector<std::string> describe(const Scene& scene) const override {
        std::vector<std::string> lines;
        if (settings_.pre_pass > 0) lines.push_back(describe_pre_pass(settings_.pre_pass));
        lines.push_back(
            fmt::format("{} sets of virtual point lights from {} light paths each", sets(), paths()));
        if (thins())
            lines.push_back("of those of more paths, the virtual point lights that the picture needs");
        if (settings_.caustics == CausticMethod::map && throws_caustics(scene)) {
            lines.push_back(fmt::format("a Caustic map of {} light paths", settings_.caustic_paths));
        }
        return lines;
    }

  private:
    // A defensive weight of 1 leaves all as it is.
    bool thins() const { return settings_.pre_pass > 0 && settings_.pre_pass_defensive_weight < 1; }
    std::uint32_t sets() const { return std::bit_ceil(static_cast<std::uint32_t>(settings_.nsets)); }
    std::uint32_t paths() const { return std::bit_ceil(static_cast<std::uint32_t>(settings_.nlights)); }

    IgiSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_igi(const IgiSettings& settings) {
    return std::make_unique<IgiIntegrator>(settings);
}

}  // namespace lucerna
