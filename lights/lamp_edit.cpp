#include "lights/lamp_edit.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/error.h"

namespace lucerna {
namespace {

constexpr double kTail = 1e-3;  // share of the flux that passes S beyond each side of a simple lamp's box

// Makes the field again from its coefficients, each channel of which is changed by `change`.
template <typename Change>
LightField remade(const LightField& field, const Rig& rig, LightFieldInfo info, Change change) {
    const auto channel = [&](int c) {
        const LightField one = field.channel(c);
        return change(one.coefficients());
    };
    if (field.coloured())
        return {rig, channel(0), channel(1), channel(2), std::move(info), field.colour_channels().weight};
    return {rig, change(field.coefficients()), std::move(info)};
}

LightField scaled(const LightField& field, double factor, LightFieldInfo info) {
    info.captured *= factor;
    info.missed *= factor;
    return remade(field, field.rig(), std::move(info), [factor](std::span<const float> e) {
        std::vector<float> made(e.size());
        for (std::size_t i = 0; i < e.size(); ++i) made[i] = static_cast<float>(factor * double{e[i]});
        return made;
    });
}

// Returns the field whose coordinates u and s have the opposite sign.
LightField flipped(const LightField& field) {
    Rig rig = field.rig();
    rig.centre.x = -rig.centre.x;
    return remade(field, rig, field.info(), [&rig](std::span<const float> e) {
        std::vector<float> made(e.size());
        for (int m = 0; m < rig.views.x; ++m) {
            for (int n = 0; n < rig.views.y; ++n) {
                for (int k = 0; k < rig.pixels.x; ++k) {
                    for (int l = 0; l < rig.pixels.y; ++l) {
                        made[rig.index(m, n, k, l)] =
                            e[rig.index(rig.views.x - 1 - m, n, rig.pixels.x - 1 - k, l)];
                    }
                }
            }
        }
        return made;
    });
}

Slab placed_slab(const Slab& slab, const LampPlacement& place) {
    Slab made{{place.vector(slab.axes.u), place.vector(slab.axes.v), place.vector(slab.axes.n)},
              place.mirrors() ? flipped(slab.field) : slab.field};
    if (place.mirrors()) made.axes.u = -made.axes.u;
    const V3d centre = made.field.rig().centre + made.axes.to_slab(place.origin);
    made.field = std::move(made.field).at(centre);
    return made;
}

// Returns the filters [first, last] along an axis of S whose light is all but kTail on either side.
std::pair<int, int> lit_filters(const LightField& field, int axis) {
    const Rig& rig = field.rig();
    std::vector<double> light(static_cast<std::size_t>(rig.views[axis]));
    const std::size_t pixels =
        static_cast<std::size_t>(rig.pixels.x) * static_cast<std::size_t>(rig.pixels.y);
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            double sum = 0;
            for (const float e : field.coefficients().subspan(rig.index(m, n, 0, 0), pixels))
                sum += double{e};
            light[static_cast<std::size_t>(axis == 0 ? m : n)] += sum;
        }
    }
    double all = 0;
    for (double& of_filter : light) {
        of_filter = std::max(0.0, of_filter);  // noise may make the sum of a filter negative
        all += of_filter;
    }
    const auto unlit = [&](auto begin, auto end) {
        double sum = 0;
        int count = 0;
        for (auto i = begin; i != end && sum + *i <= kTail * all; ++i, ++count) sum += *i;
        return count;
    };
    if (!(all > 0)) return {0, rig.views[axis] - 1};
    return {unlit(light.begin(), light.end()), rig.views[axis] - 1 - unlit(light.rbegin(), light.rend())};
}

std::size_t closest_side(const V3d& d) {
    std::size_t best = 0;
    for (int side = 1; side < SlabAxes::kSides; ++side) {
        if (SlabAxes::facing(side).n.dot(d) > SlabAxes::facing(static_cast<int>(best)).n.dot(d))
            best = static_cast<std::size_t>(side);
    }
    return best;
}

bool is_among(std::span<const SlabAxes> sides, const V3d& d) {
    const V3d n = SlabAxes::facing(static_cast<int>(closest_side(d))).n;
    return std::any_of(sides.begin(), sides.end(), [&](const SlabAxes& side) { return side.n == n; });
}

// Returns the luminous efficacy of a lamp in watts; 0 if it is not known, and for a lamp in lumens.
double efficacy_of(const Lumigraph& lamp) {
    return lamp.unit() == FluxUnit::watt ? lamp.lumens_per_watt() : 0.0;
}

void turn_into_lumens(Lumigraph& lamp, const std::string& name) {
    if (lamp.unit() == FluxUnit::lumen) return;
    if (!(efficacy_of(lamp) > 0)) {
        throw InputError(
            {name},
            "its flux is in W and has no known luminous efficacy, which adding it to lamps in lm "
            "or of another efficacy requires; import its rays with --efficacy or --colours");
    }
    for (Slab& slab : lamp.slabs()) {
        LightFieldInfo info = slab.field.info();
        const double efficacy = info.lumens_per_watt > 0 ? info.lumens_per_watt : efficacy_of(lamp);
        info.unit = FluxUnit::lumen;
        info.lumens_per_watt = 0;
        slab.field = scaled(slab.field, efficacy, std::move(info));
    }
}

}  // namespace

LampPlacement LampPlacement::then(const LampPlacement& next) const {
    return {next.vector(x), next.vector(y), next.vector(z), next.point(origin)};
}

LampPlacement LampPlacement::turn(int axis, double degrees) {
    const double quarters = degrees / 90;
    double sine = 0, cosine = 1;
    if (quarters == std::nearbyint(quarters)) {
        const int quarter = static_cast<int>(std::fmod(std::fmod(quarters, 4) + 4, 4));
        sine = quarter == 1 ? 1 : quarter == 3 ? -1 : 0;
        cosine = quarter == 0 ? 1 : quarter == 2 ? -1 : 0;
    } else {
        const double angle = degrees * (kPiD / 180);
        sine = sin(angle), cosine = cos(angle);
    }
    LampPlacement made;
    V3d* const axes[] = {&made.x, &made.y, &made.z};
    V3d &a = *axes[(axis + 1) % 3], &b = *axes[(axis + 2) % 3];
    const V3d before_a = a, before_b = b;
    a = cosine * before_a + sine * before_b;
    b = cosine * before_b - sine * before_a;
    return made;
}

LampPlacement LampPlacement::mirror(int axis) {
    LampPlacement made;
    V3d* const axes[] = {&made.x, &made.y, &made.z};
    *axes[axis] = -*axes[axis];
    return made;
}

Box3d beginning_of(const Lumigraph& lamp) {
    if (!lamp.simple()) return lamp.box();
    const Rig& rig = lamp.slabs()[0].field.rig();
    Box3d box;
    V2d low, high;
    for (int axis = 0; axis < 2; ++axis) {
        const auto [first, last] = lit_filters(lamp.slabs()[0].field, axis);
        low[axis] = rig.filter(axis, first);
        high[axis] = rig.filter(axis, last);
        // A single filter's light passes the middle half of its support.
        if (first == last) {
            low[axis] = 0.5 * (low[axis] + rig.interval_edge(axis, first));
            high[axis] = 0.5 * (high[axis] + rig.interval_edge(axis, last + 2));
        }
    }
    box.extendBy(rig.centre + V3d(low.x, low.y, 0));
    box.extendBy(rig.centre + V3d(high.x, high.y, 0));
    return box;
}

Lumigraph placed(const Lumigraph& lamp, const LampPlacement& place) {
    std::vector<Slab> slabs;
    for (const Slab& slab : lamp.slabs()) slabs.push_back(placed_slab(slab, place));
    if (lamp.simple() && slabs[0].axes.straight()) return Lumigraph(std::move(slabs[0].field));
    Box3d box;
    const Box3d before = beginning_of(lamp);
    for (int corner = 0; corner < 8; ++corner) box.extendBy(place.point(box_corner(before, corner)));
    return {std::move(slabs), box};
}

RaySet placed(RaySet rays, const LampPlacement& place) {
    for (LampRay& ray : rays.rays) {
        ray.o = V3f(place.point(V3d(ray.o)));
        ray.d = V3f(place.vector(V3d(ray.d)));
    }
    return rays;
}

Lumigraph dimmed(const Lumigraph& lamp, double factor) {
    assert(factor > 0 && std::isfinite(factor));
    Lumigraph made = lamp;
    for (Slab& slab : made.slabs()) slab.field = scaled(slab.field, factor, slab.field.info());
    return made;
}

RaySet dimmed(RaySet rays, double factor) {
    assert(factor > 0 && std::isfinite(factor));
    for (LampRay& ray : rays.rays) ray.flux = static_cast<float>(factor * double{ray.flux});
    for (double* flux : {&rays.flux, &rays.skipped_flux, &rays.header_lumens, &rays.header_watts})
        *flux *= factor;
    return rays;
}

Lumigraph cut_to_sides(const Lumigraph& lamp, std::span<const SlabAxes> sides) {
    std::vector<Slab> slabs;
    std::string names;
    for (const Slab& slab : lamp.slabs()) {
        if (is_among(sides, slab.axes.n)) slabs.push_back(slab);
        names += (names.empty() ? "" : ", ") + slab.axes.name();
    }
    if (slabs.empty())
        throw InputError(fmt::format("no light leaves towards these sides; the lamp's slabs face {}", names));
    if (lamp.simple()) return lamp;
    return {std::move(slabs), lamp.box()};
}

RaySet cut_to_sides(RaySet rays, std::span<const SlabAxes> sides) {
    double before = 0, after = 0;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < rays.rays.size(); ++i) {
        before += rays.light_of(i);
        if (!is_among(sides, V3d(rays.rays[i].d))) continue;
        after += rays.light_of(i);
        rays.rays[kept] = rays.rays[i];
        if (rays.coloured()) rays.tristimulus[kept] = rays.tristimulus[i];
        if (!rays.spectrum.empty()) rays.spectrum[kept] = rays.spectrum[i];
        ++kept;
    }
    if (!(after > 0)) throw InputError("no ray leaves towards these sides");
    rays.rays.resize(kept);
    if (rays.coloured()) rays.tristimulus.resize(kept);
    if (!rays.spectrum.empty()) rays.spectrum.resize(kept);
    // The flux of a ray file may differ from the sum of its rays; skipped rays are in the same proportion.
    for (double* flux : {&rays.flux, &rays.skipped_flux}) *flux *= after / before;
    rays.header_lumens = rays.header_watts = 0;
    return rays;
}

Lumigraph added(std::vector<Lumigraph> lamps, std::span<const std::string> names) {
    assert(!lamps.empty() && names.size() == lamps.size());
    const bool alike = std::all_of(lamps.begin(), lamps.end(), [&](const Lumigraph& lamp) {
        return lamp.unit() == lamps[0].unit() && efficacy_of(lamp) == efficacy_of(lamps[0]);
    });
    for (std::size_t i = 0; i < lamps.size() && !alike; ++i) turn_into_lumens(lamps[i], names[i]);
    if (lamps.size() == 1) return std::move(lamps[0]);
    Box3d box;
    std::vector<Slab> slabs;
    for (Lumigraph& lamp : lamps) {
        box.extendBy(beginning_of(lamp));
        for (Slab& slab : lamp.slabs()) slabs.push_back(std::move(slab));
    }
    return {std::move(slabs), box};
}

}  // namespace lucerna
