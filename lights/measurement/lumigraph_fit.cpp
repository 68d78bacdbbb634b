#include "lights/measurement/lumigraph_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "engine/base/error.h"
#include "engine/base/stats.h"
#include "lights/measurement/ray_passage.h"
#include "lights/measurement/spectral_fit.h"

namespace lucerna {
namespace {

// The share of the flux beyond each face of the lamp's box, so that a stray thousandth does not widen it.
constexpr double kTail = 1.2e-3;
// More stray flux does not widen the box far: the core leaves out this share of the flux on each side.
constexpr double kStray = 0.02;
constexpr double kBeyondCore = 0.5;  // how far the box may exceed the core, in the core's largest side
constexpr std::size_t kBoxRays = 4'000'000;  // at most this many find the box
constexpr double kOneSlab = 0.993;           // the default of FitOptions::capture
constexpr double kOfSlab = 0.999;  // as above for one of six slabs, whose shares end before grazing angles

std::vector<SlabAxes> sides(std::initializer_list<int> numbers) {
    std::vector<SlabAxes> axes;
    for (const int side : numbers) axes.push_back(SlabAxes::facing(side));
    return axes;
}

SlabShares shares_of(const std::vector<SlabAxes>& axes) {
    std::vector<V3d> normals;
    for (const SlabAxes& a : axes) normals.push_back(a.n);
    return SlabShares(std::move(normals));
}

// Returns each slab's light and, last, the light without a slab.
std::vector<double> light_by_slab(const RaySet& set, const std::vector<SlabAxes>& axes) {
    const SlabShares shares = shares_of(axes);
    std::vector<double> light(axes.size() + 1), share(axes.size());
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        shares.of(V3d(set.rays[i].d), share);
        double held = 0;
        for (std::size_t k = 0; k < axes.size(); ++k)
            light[k] += set.light_of(i) * share[k], held += share[k];
        if (held == 0) light.back() += set.light_of(i);
    }
    return light;
}

// Returns all six sides except those with hardly any light, which the others share.
std::vector<SlabAxes> sides_with_light(const RaySet& set, double usable) {
    std::vector<SlabAxes> axes = sides({0, 1, 2, 3, 4, 5});
    for (;;) {
        const std::vector<double> light = light_by_slab(set, axes);
        const auto least = std::min_element(light.begin(), light.end() - 1) - light.begin();
        if (axes.size() == 1 || light[static_cast<std::size_t>(least)] > kNegligible * usable) return axes;
        std::vector<SlabAxes> rest = axes;
        rest.erase(rest.begin() + least);
        if (light_by_slab(set, rest).back() > kNegligible * usable) return axes;
        axes = std::move(rest);
    }
}

// Returns the slab's share of a set's light, in the slab's frame.
RaySet rays_of_slab(const RaySet& set, const std::vector<SlabAxes>& axes, std::size_t slab) {
    const SlabShares shares = shares_of(axes);
    std::vector<double> share(axes.size());
    RaySet part;
    part.unit = set.unit;
    part.xyz = set.xyz;
    part.lumens_per_watt = set.lumens_per_watt;
    part.provenance = set.provenance;
    const auto turned = [&](const V3f& p) {
        const V3d q = axes[slab].to_slab(V3d(p));
        return V3f(static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z));
    };
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        const LampRay& ray = set.rays[i];
        shares.of(V3d(ray.d), share);
        if (!(share[slab] > 0)) continue;
        part.rays.push_back(
            {turned(ray.o), turned(ray.d), static_cast<float>(double{ray.flux} * share[slab])});
        if (set.coloured()) part.tristimulus.push_back(set.tristimulus[i]);
        part.flux += part.light_of(part.rays.size() - 1);
    }
    return part;
}

// Returns the point that is closest to some of the lines: the least Σ φ |distance|².
V3d middle_of(const RaySet& set, std::span<const std::size_t> some) {
    // It solves Σ φ (1 - d dᵀ) m = Σ φ (1 - d dᵀ) o.
    double a[3][4] = {};
    double flux = 0;
    V3d mean(0, 0, 0);
    for (const std::size_t i : some) {
        const LampRay& ray = set.rays[i];
        const V3d o(ray.o), d(ray.d);
        const auto f = double{ray.flux};
        const double along = o.dot(d);
        for (int row = 0; row < 3; ++row) {
            for (int k = 0; k < 3; ++k) a[row][k] += f * ((row == k ? 1 : 0) - d[row] * d[k]);
            a[row][3] += f * (o[row] - along * d[row]);
        }
        flux += f;
        mean += f * o;
    }
    mean /= flux;  // > 0, because the caller's rays carry flux
    // Parallel lines have no centre along them; a weak pull towards where they start determines one.
    constexpr double kPull = 1e-6;
    for (int i = 0; i < 3; ++i) a[i][i] += kPull * flux, a[i][3] += kPull * flux * mean[i];
    // The matrix is symmetric and positive definite, so no pivoting is needed.
    for (int i = 0; i < 3; ++i) {
        for (int row = i + 1; row < 3; ++row) {
            const double factor = a[row][i] / a[i][i];
            for (int k = i; k < 4; ++k) a[row][k] -= factor * a[i][k];
        }
    }
    V3d m;
    for (int i = 2; i >= 0; --i) {
        m[i] = a[i][3];
        for (int k = i + 1; k < 3; ++k) m[i] -= a[i][k] * m[k];
        m[i] /= a[i][i];
    }
    return m;
}

// Returns this point for all lines but stray ones, which are the farthest from it.
V3d middle_of(const RaySet& set) {
    constexpr int kRounds = 3;
    std::vector<std::size_t> some;
    for (std::size_t i = 0; i < set.rays.size(); ++i)
        if (set.rays[i].flux > 0) some.push_back(i);
    if (some.empty()) throw InputError("ray set: no ray carries flux");
    V3d middle = middle_of(set, some);
    for (int round = 0; round < kRounds; ++round) {
        std::vector<Weighed> distance2;
        for (const LampRay& ray : set.rays) {
            distance2.push_back({(V3d(ray.o) - middle).cross(V3d(ray.d)).length2(), double{ray.flux}});
        }
        std::vector<Weighed> sorted = distance2;
        const double farthest = weighted_quantile(sorted, 1 - kStray);
        some.clear();
        for (std::size_t i = 0; i < set.rays.size(); ++i)
            if (set.rays[i].flux > 0 && distance2[i].value <= farthest) some.push_back(i);
        middle = middle_of(set, some);
    }
    return middle;
}

// Returns the ends that leave out a tail of the weight on either side.
std::pair<double, double> all_but(double tail, std::vector<Weighed>& values) {
    const double low = weighted_quantile(values, tail);
    return {low, weighted_quantile(values, 1 - tail)};
}

void book(const FluxAccount& a, FluxAccount& all) {
    all.captured += a.captured;
    all.backward += a.backward;
    all.beside_s += a.beside_s;
    all.beside_m += a.beside_m;
    all.not_in_basis += a.not_in_basis;
}

LumigraphFit fit_one(const RaySet& set, const FitOptions& options, const Workers& workers, Monitor& monitor) {
    Projection made = fit_light_field(set, options, workers, monitor);
    return {Lumigraph(std::move(made.field)), made.account, {made.account}};
}

// Returns the account of the whole set, before its slabs are added.
FluxAccount account_of(const RaySet& set, const std::vector<SlabAxes>& axes) {
    FluxAccount all;
    all.total = set.flux;
    all.skipped = set.skipped_flux;
    all.backward = light_by_slab(set, axes).back();
    return all;
}

// The first slab also gets the missed flux that belongs to no slab, so that the slabs' sum is the lamp's.
Lumigraph lamp_of(std::vector<Slab> slabs, const Box3d& box, const FluxAccount& all) {
    LightFieldInfo info = slabs[0].field.info();
    info.missed += all.backward + all.skipped;
    slabs[0].field = std::move(slabs[0].field).with(std::move(info));
    return Lumigraph(std::move(slabs), box);
}

LumigraphFit fit_several(const RaySet& set, const std::vector<SlabAxes>& axes, const FitOptions& options,
                         const Workers& workers, Monitor& monitor) {
    const Box3d box = box_of(set);
    FluxAccount all = account_of(set, axes);
    std::vector<Slab> slabs;
    std::vector<FluxAccount> books;
    for (std::size_t k = 0; k < axes.size(); ++k) {
        const RaySet part = rays_of_slab(set, axes, k);
        if (part.rays.empty()) continue;
        FitOptions of_slab = options;
        if (axes.size() > 2 && options.capture == kOneSlab) of_slab.capture = kOfSlab;
        // Lines begin at the box wherever S is, so S lies where they are closest together.
        const double reach = std::fabs(axes[k].n.dot(box.size())) / 2, middle = axes[k].n.dot(box.center());
        of_slab.z = std::clamp(waist_of(part).z, middle - reach, middle + reach);
        of_slab.begin = Box3d();
        for (int corner = 0; corner < 8; ++corner)
            of_slab.begin->extendBy(axes[k].to_slab(box_corner(box, corner)));
        monitor.info(fmt::format("slab {}:", axes[k].name()));
        Projection made = fit_light_field(part, of_slab, workers, monitor);
        books.push_back(made.account);
        book(made.account, all);
        slabs.push_back({axes[k], std::move(made.field)});
    }
    if (slabs.empty()) throw InputError("ray set: no ray carries flux");
    return {lamp_of(std::move(slabs), box, all), all, std::move(books)};
}

}  // namespace

Box3d box_of(const RaySet& all) {
    RaySet few;
    const RaySet& set = few_of(all, kBoxRays, few);
    const V3d middle = middle_of(set);
    Box3d box, core;
    for (int a = 0; a < 3; ++a) {
        std::vector<Weighed> starts, nearest;
        for (const LampRay& ray : set.rays) {
            if (!(ray.flux > 0)) continue;
            const V3d o(ray.o), d(ray.d);
            starts.push_back({o[a], double{ray.flux}});
            nearest.push_back({(o + (middle - o).dot(d) * d)[a], double{ray.flux}});
        }
        const auto middle_part = [&](double tail, bool also_starts) {
            std::pair<double, double> ends = all_but(tail, nearest);
            if (!also_starts) return ends;
            const auto [low, high] = all_but(tail, starts);
            return std::pair(std::max(ends.first, low), std::min(ends.second, high));
        };
        // Starts far to one side of the lamp tell nothing about its box.
        const auto both = middle_part(kStray, true);
        const bool also_starts = both.first <= both.second;
        std::tie(core.min[a], core.max[a]) = middle_part(kStray, also_starts);
        std::tie(box.min[a], box.max[a]) = middle_part(kTail, also_starts);
    }
    // Stray rays from far around the lamp do not belong to it.
    const V3d core_size = core.size();
    const double most = kBeyondCore * std::max({core_size.x, core_size.y, core_size.z});
    for (int a = 0; a < 3; ++a) {
        box.min[a] = std::max(box.min[a], core.min[a] - most);
        box.max[a] = std::min(box.max[a], core.max[a] + most);
    }
    // The box of a point-like or flat lamp must have a volume, too.
    const V3d size = box.size();
    const double least = std::max(1e-5, 1e-3 * std::max({size.x, size.y, size.z}));
    for (int a = 0; a < 3; ++a) {
        const double missing = std::max(0.0, least - size[a]);
        box.min[a] -= 0.5 * missing, box.max[a] += 0.5 * missing;
    }
    return box;
}

namespace {

// Chooses the slabs and fits them.
LumigraphFit fit_slabs(const RaySet& set, const LumigraphOptions& options, const Workers& workers,
                       Monitor& monitor) {
    const double usable = set.flux - set.skipped_flux;
    // A smaller --capture lowers what suffices.
    const double wanted = std::min(kHeld, options.fit.capture - (kOneSlab - kHeld)) * usable;
    const auto enough = [&](const LumigraphFit& made) { return made.account.captured >= wanted; };
    const auto several = [&](const std::vector<SlabAxes>& axes) {
        return fit_several(set, axes, options.fit, workers, monitor);
    };
    if (options.sides.size() > 1 || (options.sides.size() == 1 && !options.sides[0].straight()))
        return several(options.sides);
    if (options.slabs == 1 || options.sides.size() == 1 || options.fit.z)
        return fit_one(set, options.fit, workers, monitor);
    if (options.slabs == 2) return several(sides({0, 1}));
    if (options.slabs == 0) {
        double forward = 0, flat = 0;
        for (std::size_t i = 0; i < set.rays.size(); ++i) {
            const double z = double{set.rays[i].d.z};
            if (z > kGrazingRay) forward += set.light_of(i);
            if (std::fabs(z) < 1 / std::sqrt(1 + sqr(kWidestM))) flat += set.light_of(i);
        }
        if (forward >= wanted) {
            LumigraphFit one = fit_one(set, options.fit, workers, monitor);
            if (enough(one)) return one;
        }
        // Two slabs hold flat light no better than one.
        if (forward < wanted && usable - flat >= wanted) {
            LumigraphFit two = several(sides({0, 1}));
            if (enough(two)) return two;
        }
    }
    if (!(usable > 0)) return fit_one(set, options.fit, workers, monitor);  // which reports the error
    return several(sides_with_light(set, usable));
}

}  // namespace

LumigraphFit fit_lumigraph(const RaySet& set, const LumigraphOptions& options, const Workers& workers,
                           Monitor& monitor) {
    LumigraphFit made = fit_slabs(set, options, workers, monitor);
    const SpectralBasis spectra = spectral_basis(set);
    for (Slab& slab : made.lamp.slabs()) {
        LightFieldInfo info = slab.field.info();
        info.spectra = spectra;
        slab.field = std::move(slab.field).with(std::move(info));
    }
    return made;
}

}  // namespace lucerna
