#include "engine/render/unseen_lights.h"

#include <fmt/format.h>

namespace lucerna {
namespace {

// What a method leaves out of a light that only particles carry; empty: nothing.
struct LeftOut {
    std::string_view operator()(const PathSettings&) const { return "light is"; }
    std::string_view operator()(const DirectSettings&) const { return "light is"; }
    std::string_view operator()(const IgiSettings&) const { return "direct light is"; }
    std::string_view operator()(const PhotonMapSettings& s) const {
        return s.direct == DirectMethod::map ? "" : "direct light is";
    }
    std::string_view operator()(const ProgressiveSettings& s) const {
        return s.direct == DirectMethod::map ? "" : "direct light is";
    }
};

}  // namespace

void warn_of_unseen_lights(const Scene& scene, const IntegratorSettings& method, Monitor& monitor) {
    const std::string_view missing = std::visit(LeftOut{}, method);
    if (missing.empty()) return;
    std::uint64_t unseen = 0;
    std::string_view kind;
    for (const auto& light : scene.lights()) {
        if (!light->only_particles() || !(light->power() > 0)) continue;
        if (unseen++ == 0) kind = light->kind();
    }
    if (unseen == 0) return;
    monitor.warn(
        fmt::format("{} of kind \"{}\" can be met by particles only: the {} missing from this "
                    "picture; photonmap with \"string direct\" \"map\" shows it",
                    unseen == 1 ? "a light" : fmt::format("{} lights", unseen), kind, missing));
}

void warn_of_glowing_media(const Scene& scene, const IntegratorSettings& method, Monitor& monitor) {
    if (std::holds_alternative<PathSettings>(method)) return;
    for (const Medium& medium : scene.media().all) {
        if (!medium.emits()) continue;
        monitor.warn(fmt::format(
            "medium \"{}\" emits light, which is missing from this picture; path shows it", medium.name));
        return;
    }
}

}  // namespace lucerna
