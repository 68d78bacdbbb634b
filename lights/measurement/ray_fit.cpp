// Chooses the planes for a ray set.
#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "lights/measurement/held_out.h"
#include "lights/measurement/ray_passage.h"
#include "lights/measurement/ray_projection.h"
#include "lights/measurement/round_to_rays.h"

namespace lucerna {
namespace {

constexpr double kNearlyAll = 0.99;  // of the flux, so that a few stray rays do not decide
// At most this many rays choose the planes; more would change no choice.
constexpr std::size_t kPlaneRays = 10'000'000;

// Returns the indices of the rays that leave towards +z with flux.
std::vector<std::size_t> forward_rays(const RaySet& set) {
    std::vector<std::size_t> forward;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        if (double{set.rays[i].d.z} > kGrazingRay && set.rays[i].flux > 0) forward.push_back(i);
    }
    if (forward.empty())
        throw InputError("ray set: no ray carries flux towards +z; turn the lamp so that it shines there");
    return forward;
}

void check(const FitOptions& o) {
    for (int a = 0; a < 2; ++a) {
        if (o.views[a] < 0 || o.views[a] > 1024)
            throw InputError(fmt::format("views {}; 1 to 1024, or 0 for a choice from the rays", o.views[a]));
        if (o.pixels[a] < 0 || o.pixels[a] > 8192)
            throw InputError(
                fmt::format("pixels {}; 1 to 8192, or 0 for a choice from the rays", o.pixels[a]));
    }
    if (!(o.distance >= 0) || !std::isfinite(o.distance)) {
        throw InputError(
            fmt::format("plane distance {} m; positive, or 0 for a choice from the rays", o.distance));
    }
    if (!(o.capture > 0 && o.capture < 1))
        throw InputError(fmt::format("capture {}; between 0 and 1", o.capture));
    if (o.z && !std::isfinite(*o.z)) throw InputError("the height of S is not finite");
}

// The box on S without the margin.
struct Box {
    V2d centre, half;
    bool holds(const V2d& p) const {
        return std::fabs(p.x - centre.x) <= half.x && std::fabs(p.y - centre.y) <= half.y;
    }
};

// Returns how far from `centre` nearly all rays start, per axis.
V2d reach_of_starts(const RaySet& set, std::span<const std::size_t> forward, const V2d& centre) {
    V2d reach;
    std::vector<Weighed> values(forward.size());
    for (int a = 0; a < 2; ++a) {
        for (std::size_t i = 0; i < forward.size(); ++i) {
            const LampRay& ray = set.rays[forward[i]];
            values[i] = {std::fabs(double{ray.o[a]} - centre[a]), double{ray.flux}};
        }
        reach[a] = weighted_quantile(values, kNearlyAll);
    }
    return reach;
}

Box box_on_s(const RaySet& set, std::span<const std::size_t> forward, double height,
             const FitOptions& options) {
    const double tail = (1 - options.capture) / 16;
    Box box;
    std::vector<Weighed> values(forward.size());
    V2d low, high, middle;
    for (int a = 0; a < 2; ++a) {
        for (std::size_t i = 0; i < forward.size(); ++i) {
            const LampRay& ray = set.rays[forward[i]];
            values[i] = {pass(ray, height)[a], double{ray.flux}};
        }
        middle[a] = weighted_quantile(values, 0.5);
        low[a] = weighted_quantile(values, tail);
        high[a] = weighted_quantile(values, 1 - tail);
    }
    const V2d most = kWidestS * reach_of_starts(set, forward, middle);
    for (int a = 0; a < 2; ++a) {
        if (options.begin) {
            const Box3d& lamp = *options.begin;
            const double depth = std::max(std::fabs(lamp.max.z - height), std::fabs(height - lamp.min.z));
            low[a] = std::max(low[a], std::min(middle[a], lamp.min[a] - kWidestS * depth));
            high[a] = std::min(high[a], std::max(middle[a], lamp.max[a] + kWidestS * depth));
        } else if (most[a] > 0) {  // rays from a point have no reach, so that their box is not limited
            low[a] = std::max(low[a], middle[a] - most[a]);
            high[a] = std::min(high[a], middle[a] + most[a]);
        }
        box.centre[a] = 0.5 * (low[a] + high[a]);
        box.half[a] = 0.5 * (high[a] - low[a]);
    }
    // The box of a point or line source must have an area, too.
    const double least = std::max(1e-5, 1e-3 * std::max(box.half.x, box.half.y));
    for (int a = 0; a < 2; ++a) box.half[a] = std::max(box.half[a], least);
    return box;
}

// Returns the half size of M's box, from the rays that pass the box on S.
V2d half_of_m(const RaySet& set, std::span<const std::size_t> forward, const Box& box, double height,
              const FitOptions& options, double distance) {
    std::vector<Weighed> radius;
    std::vector<V2d> at;
    std::vector<double> weight;
    double total = 0;
    for (const std::size_t i : forward) {
        const LampRay& ray = set.rays[i];
        total += double{ray.flux};
        if (!box.holds(pass(ray, height))) continue;
        at.push_back(pass(ray, height + distance) - box.centre);
        weight.push_back(double{ray.flux});
    }
    if (at.empty()) throw InputError("ray set: no ray passes the plane S inside its box");
    // The box has the lobe's proportion, from the inner part of the flux; one factor makes it reach the
    // share.
    V2d proportion;
    radius.resize(at.size());
    for (int a = 0; a < 2; ++a) {
        for (std::size_t i = 0; i < at.size(); ++i) radius[i] = {std::fabs(at[i][a]), weight[i]};
        proportion[a] = std::max(weighted_quantile(radius, 0.8), 1e-3 * box.half[a]);
    }
    double inside = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
        radius[i] = {std::max(std::fabs(at[i].x) / proportion.x, std::fabs(at[i].y) / proportion.y),
                     weight[i]};
        inside += weight[i];
    }
    const double factor = weighted_quantile(radius, std::min(1.0, options.capture * total / inside));
    return proportion * (std::max(factor, 1e-3) * 1.0001);  // the last ray is inside, not on the edge
}

// Returns the share of the flux that passes both boxes.
double share_through(const RaySet& set, std::span<const std::size_t> forward, const Box& box,
                     const V2d& half_m, double height, double distance) {
    double through = 0, all = 0;
    for (const std::size_t i : forward) {
        const LampRay& ray = set.rays[i];
        all += double{ray.flux};
        const V2d at = pass(ray, height + distance) - box.centre;
        if (box.holds(pass(ray, height)) && std::fabs(at.x) <= half_m.x && std::fabs(at.y) <= half_m.y)
            through += double{ray.flux};
    }
    return through / all;  // > 0: forward rays carry flux
}

// Returns the height below which nearly all rays start, because the lamp is behind it. Rays that start on a
// surface around the lamp, far wider than their waist, do not tell where the lamp ends.
constexpr double kAround = 8;

double front_of(const RaySet& set, std::span<const std::size_t> forward, const Waist& waist) {
    std::vector<Weighed> heights;
    V3d mean(0, 0, 0);
    double flux = 0;
    for (const std::size_t i : forward) {
        const LampRay& ray = set.rays[i];
        heights.push_back({double{ray.o.z}, double{ray.flux}});
        mean += double{ray.flux} * V3d(ray.o);
        flux += double{ray.flux};
    }
    mean /= flux;  // > 0, because forward rays carry flux
    double spread2 = 0;
    for (const std::size_t i : forward)
        spread2 += double{set.rays[i].flux} * (V3d(set.rays[i].o) - mean).length2() / flux;
    if (std::sqrt(spread2) > kAround * waist.spread && waist.spread > 0) return -INFINITY;
    return weighted_quantile(heights, kNearlyAll);
}

}  // namespace

Waist waist_of(const RaySet& set) {
    const std::vector<std::size_t> forward = forward_rays(set);
    // A line is q + z m with slope m, weighted as stated. Var(q + z m) is a parabola in z.
    V2d q_mean(0, 0), m_mean(0, 0);
    double weight = 0, start = 0;
    const auto each = [&](auto&& f) {
        for (const std::size_t i : forward) {
            const LampRay& ray = set.rays[i];
            const V2d m(double{ray.d.x} / double{ray.d.z}, double{ray.d.y} / double{ray.d.z});  // d.z > 0
            f(pass(ray, 0), m, double{ray.flux} * sqr(double{ray.d.z}), double{ray.o.z});
        }
    };
    each([&](const V2d& q, const V2d& m, double w, double z) {
        q_mean += w * q, m_mean += w * m, weight += w, start += w * z;
    });
    q_mean /= weight, m_mean /= weight, start /= weight;  // > 0: forward rays carry flux
    double qq = 0, qm = 0, mm = 0;
    each([&](const V2d& q, const V2d& m, double w, double) {
        qq += w * (q - q_mean).length2(), qm += w * (q - q_mean).dot(m - m_mean);
        mm += w * (m - m_mean).length2();
    });
    // Slopes that differ by less than a microradian determine no waist.
    const double z = mm > 1e-12 * weight ? -qm / mm : start;
    return {z, std::sqrt(std::max(0.0, qq + 2 * z * qm + z * z * mm) / weight)};
}

const RaySet& few_of(const RaySet& set, std::size_t most, RaySet& few) {
    if (set.rays.size() <= most) return set;
    const std::size_t run = (set.rays.size() + most - 1) / most;
    for (std::size_t first = 0; first < set.rays.size(); first += run) {
        // Files may be sorted, or alternate between a lamp's parts.
        Sampler draw(0, Purpose::acquisition, 2, first);
        const std::size_t r = first + draw.bits() % std::min(run, set.rays.size() - first);
        few.take(set, r);
    }
    few.unit = set.unit;
    few.spectra = set.spectra;
    return few;
}

RayPlanes choose_planes(const RaySet& all, const FitOptions& options, const Workers& workers,
                        Monitor& monitor) {
    check(options);
    RaySet few;
    const RaySet& set = few_of(all, kPlaneRays, few);
    const std::vector<std::size_t> forward = forward_rays(set);
    RayPlanes planes;
    Rig& rig = planes.rig;
    if (options.z) {
        rig.centre.z = *options.z;
    } else {
        const Waist waist = waist_of(set);
        rig.centre.z = std::max(waist.z, front_of(set, forward, waist));
    }
    const Box box = box_on_s(set, forward, rig.centre.z, options);
    rig.distance = options.distance > 0 ? options.distance : 5 * 2 * std::max(box.half.x, box.half.y);
    V2d half_m = half_of_m(set, forward, box, rig.centre.z, options, rig.distance);
    for (int a = 0; a < 2; ++a) half_m[a] = std::min(half_m[a], kWidestM * rig.distance);
    PlaneBoxes boxes;
    boxes.centre_s = box.centre, boxes.half_s = box.half, boxes.half_m = half_m;
    boxes.held = share_through(set, forward, box, half_m, rig.centre.z, rig.distance) - (1 - options.capture);
    boxes.views = options.views, boxes.pixels = options.pixels;
    // This is > 0, because forward_rays() throws if there is none.
    boxes.rays =
        static_cast<std::size_t>(static_cast<double>(forward.size()) / static_cast<double>(set.rays.size()) *
                                 static_cast<double>(all.rays.size()));
    choose_resolution(set, forward, boxes, planes, workers, monitor);
    return planes;
}

Projection fit_light_field(const RaySet& set, const FitOptions& options, const Workers& workers,
                           Monitor& monitor) {
    RayPlanes planes = choose_planes(set, options, workers, monitor);
    Projection made = project_rays(set, planes.rig, workers, monitor, planes.weights);
    LightField rounded = rounded_to_rays(made.field, set);
    if (planes.judge) planes.judge->add_change(planes.errors, made.field, rounded, workers);
    LightFieldInfo info = rounded.info();
    info.errors = std::move(planes.errors);
    info.captured = rounded.flux();
    FluxAccount& a = made.account;
    a.not_in_basis += a.captured - info.captured;
    a.captured = info.captured;
    info.missed = a.missed();
    made.field = std::move(rounded).with(std::move(info));
    monitor.info(fmt::format(
        "flux {:.6g} {}: {:.6g} captured; missed {:.4g} (unusable {:.4g}, backwards {:.4g}, beside S "
        "{:.4g}, beside M {:.4g}, not in the basis {:.4g})",
        a.total, flux_unit_name(set.unit), a.captured, a.missed(), a.skipped, a.backward, a.beside_s,
        a.beside_m, a.not_in_basis));
    return made;
}

}  // namespace lucerna
