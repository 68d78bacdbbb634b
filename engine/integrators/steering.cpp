#include "engine/integrators/steering.h"

#include <algorithm>
#include <cmath>

#include "engine/integrators/needed_maps.h"

namespace lucerna {
namespace {

// Photons of the pre-pass in an estimate: its disc is then about as wide as one of the image's. Fewer than
// the least say little; more than the most take long.
constexpr double kLeastPhotons = 8, kMostPhotons = 32;

int pre_pass_photons(const PhotonMapSettings& settings, int k) {
    if (k == 0) return static_cast<int>(kMostPhotons);
    const double share = static_cast<double>(settings.pre_pass) / static_cast<double>(settings.photons);
    return static_cast<int>(std::clamp(std::ceil(k * share), kLeastPhotons, kMostPhotons));
}

// Why emission stays plain; nothing: it need not.
std::string_view why_plain(std::int64_t paths, const PassContext& context, bool reads) {
    if (paths == 0) return "plain: prepass = 0";
    if (!context.view) return "plain: there is no camera";
    if (context.map_files && context.map_files->any()) return "plain: maps in files serve every camera";
    if (!reads) return "plain: no map is read";
    if (scatters(context.scene.media())) return "plain: a medium scatters";
    if (!(context.scene.picker().total_power() > 0)) return "plain: no light shines";
    return "";
}

void report(const ImportancePrePass& pre_pass, std::int64_t paths, const Scene& scene, RenderReport& report) {
    report.notes["emission"] = "steered by an importance pre-pass";
    report.numbers["prepass.paths"] = static_cast<double>(paths);
    report.numbers["prepass.importons"] = static_cast<double>(pre_pass.importons);
    report.numbers["prepass.useful"] = pre_pass.useful;
    report.numbers["prepass.blocks"] = static_cast<double>(pre_pass.emission.blocks());
    // How far the choice of lights was moved: the share of paths that go to another light.
    double moved = 0;
    for (std::uint32_t light = 0; light < scene.lights().size(); ++light) {
        moved += std::fabs(pre_pass.emission.probability(light) - double{scene.picker().probability(light)});
    }
    report.numbers["prepass.share_of_lights"] = 0.5 * moved;
    report.seconds.emplace_back("prepass", pre_pass.seconds);
}

}  // namespace

std::optional<ImportancePrePass> learn_emission(const PhotonMapSettings& settings,
                                                const DensityEstimateSettings& estimate,
                                                const PassContext& context) {
    ImportancePrePassSettings how;
    how.paths = settings.pre_pass;
    how.defensive_weight = settings.pre_pass_defensive_weight;
    how.seed = context.seed;
    how.gather = settings.indirect == IndirectMethod::gather;
    how.meter = settings.quantity == Quantity::illuminance;
    how.estimate = estimate;
    how.estimate.k = pre_pass_photons(settings, estimate.k);
    how.specular_below = settings.specular_below;
    bool reads = false;
    for (const MapKind kind : {MapKind::direct, MapKind::global, MapKind::caustic}) {
        const auto i = static_cast<std::size_t>(kind);
        const bool built = map_need(kind, settings, context.scene).build;
        how.landed[i] = built && how.gather;
        how.seen[i] = built && !(how.gather && kind == MapKind::global);
        reads = reads || built;
    }
    if (const auto why = why_plain(settings.pre_pass, context, reads); !why.empty()) {
        context.report.notes["emission"] = why;
        return std::nullopt;
    }
    auto pre_pass =
        run_importance_pre_pass(context.scene, *context.view, how, context.workers, context.monitor);
    if (pre_pass) {
        report(*pre_pass, how.paths, context.scene, context.report);
    } else {
        context.report.notes["emission"] = "plain: the pre-pass saw nothing";
    }
    return pre_pass;
}

std::optional<IgiPrePass> learn_emission(const IgiSettings& settings, const PassContext& context) {
    if (const auto why = why_plain(settings.pre_pass, context, true); !why.empty()) {
        context.report.notes["emission"] = why;
        return std::nullopt;
    }
    auto pre_pass = run_igi_pre_pass(settings, context);
    if (pre_pass) {
        report(pre_pass->importance, settings.pre_pass, context.scene, context.report);
    } else {
        context.report.notes["emission"] = "plain: the pre-pass saw nothing";
    }
    return pre_pass;
}

}  // namespace lucerna
