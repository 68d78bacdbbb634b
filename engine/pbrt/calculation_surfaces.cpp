// Reads CalculationSurface "name", a surface on which `lucerna lux` computes illuminance. pbrt has no such
// directive.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/pbrt/shapes.h"
#include "engine/pbrt/state.h"
#include "engine/pbrt/transforms.h"

namespace lucerna {
namespace {

using Type = Param::Type;

ReceiverKind read_receiver_kind(Params& params) {
    const std::string word = params.string("kind", kReceiverKinds[0]);
    const std::optional<ReceiverKind> kind = receiver_kind(word);
    if (!kind) {
        fail(params.place_of("kind"), "kind \"{}\" is unknown; expected {}", shown(word),
             fmt::join(kReceiverKinds, ", "));
    }
    return *kind;
}

// Reads a direction and returns it as a unit vector in the world; `fallback` is one.
V3f read_direction(const Reading& reading, Params& params, std::string_view name, const V3d& fallback) {
    const Param* param = params.find(name, {Type::vector3, Type::normal3, Type::point3});
    if (!param) return V3f(fallback);
    require_count(*param, param->numbers.size(), 3);
    const V3d given(param->numbers[0], param->numbers[1], param->numbers[2]);
    const V3d w = transform_vector(reading.state.ctm, given);
    if (!(w.length() > 0) || !std::isfinite(w.length()))
        fail(param->values, "\"{}\" is ({:g} {:g} {:g}), which is not a direction", name, given.x, given.y,
             given.z);
    return V3f(w.normalized());
}

V2i read_grid(Params& params, const CalculationSurface& surface) {
    if (const Param* param = params.find("points", {Type::integer})) {
        require_count(*param, param->numbers.size(), 2);
        for (const double n : param->numbers) {
            if (!(n >= 1 && n <= static_cast<double>(kMostSurfacePoints)))
                fail(param->values, "{:g} points along a side; expected 1 to {}", n, kMostSurfacePoints);
        }
        return {static_cast<int>(param->numbers[0]), static_cast<int>(param->numbers[1])};
    }
    if (!params.has("spacing")) return default_points(surface.u.length(), surface.v.length());
    const double spacing = params.real("spacing", 0);
    const double longest = std::max(surface.u.length(), surface.v.length());
    if (!(spacing > 0) || !(longest / spacing < static_cast<double>(kMostSurfacePoints))) {
        fail(params.place_of("spacing"),
             "a spacing of {:g} on sides of up to {:g}; expected more than 0, and at most {} points", spacing,
             longest, kMostSurfacePoints);
    }
    return points_apart(surface.u.length(), surface.v.length(), spacing);
}

}  // namespace

void read_calculation_surface(Reading& reading, const std::string& name, Params& params) {
    const auto& surfaces = reading.draft.surfaces;
    if (std::any_of(surfaces.begin(), surfaces.end(), [&](const auto& s) { return s.name == name; }))
        fail(params.place(), "a calculation surface \"{}\" already exists; use a different name",
             shown(name));
    const Param* corners = params.find("P", {Type::point3});
    if (!corners) {
        fail(params.place(), "{} lacks \"point3 P\": a corner and the other ends of the two sides from it",
             params.owner());
    }
    require_count(*corners, corners->numbers.size(), 9);
    const std::vector<V3d> p = triples(*corners);
    const M44d& ctm = reading.state.ctm;
    CalculationSurface surface;
    surface.name = name;
    surface.corner = transform_point(ctm, p[0]);
    surface.u = transform_point(ctm, p[1]) - surface.corner;
    surface.v = transform_point(ctm, p[2]) - surface.corner;
    surface.kind = read_receiver_kind(params);
    // The default side is the one from which u turns to v counterclockwise in the text's coordinates.
    V3d above = surface.u.cross(surface.v);
    if (swaps_handedness(ctm)) above = -above;
    if (above.length() > 0) above.normalize();
    surface.up = read_direction(reading, params, "up", above);
    if (params.has("facing") && !has_facing(surface.kind))
        fail(params.place_of("facing"), "{}", no_facing_text(surface.kind));
    surface.normal = read_direction(reading, params, "facing",
                                    surface.kind == ReceiverKind::cylindrical ? V3d(surface.up) : above);
    surface.points = read_grid(params, surface);
    check_surface(surface, params.place().location());
    reading.draft.surfaces.push_back(std::move(surface));
}

}  // namespace lucerna
