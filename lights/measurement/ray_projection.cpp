// The projection itself [Goesele 2003, 3.1, as a sum over rays].
#include "lights/measurement/ray_projection.h"

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/memory.h"
#include "lights/measurement/ray_passage.h"
#include "lights/measurement/ray_resolution.h"

namespace lucerna {
namespace {

// Books one ray's flux: what its filters record, and what they do not. Returns the sum of the squares of what
// they record.
double account_for(const LampRay& ray, const Rig& rig, FluxAccount& account) {
    const double flux = double{ray.flux};
    if (!(double{ray.d.z} > kGrazing)) {
        account.backward += flux;
        return 0;
    }
    const Passage at(ray, rig);
    if (at.misses_s) {
        account.beside_s += flux;
        return 0;
    }
    double held = 0;
    double off_m = 0;
    double squares = 0;
    bool any_pixel = false;
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) {
            if (!at.exists(rig, 0, i) || !at.exists(rig, 1, j)) continue;
            const bool seen = at.pixel[0][i] >= 0 && at.pixel[1][j] >= 0;
            const auto zi = static_cast<std::size_t>(i);
            const auto zj = static_cast<std::size_t>(j);
            const double part = flux * at.dual[0][zi] * at.dual[1][zj];
            (seen ? held : off_m) += part;
            if (seen) squares += part * part;
            any_pixel = any_pixel || seen;
        }
    }
    if (!any_pixel) {
        account.beside_m += flux;
        return 0;
    }
    account.beside_m += off_m;
    account.not_in_basis += flux - held - off_m;
    return squares;
}

// Adds a ray to the filters in row n. `scale` turns flux times dual into W/m⁴.
void add_to_row(const LampRay& ray, const Rig& rig, int n, double scale, std::vector<double>& e) {
    const Passage at(ray, rig);
    const int j = n - at.base[1] + 1;
    if (at.misses_s || j < 0 || j > 3 || at.pixel[1][j] < 0) return;
    const double weight = scale * double{ray.flux} * at.dual[1][static_cast<std::size_t>(j)];
    for (int i = 0; i < 4; ++i) {
        if (!at.exists(rig, 0, i) || at.pixel[0][i] < 0) continue;
        e[rig.index(at.base[0] - 1 + i, n, at.pixel[0][i], at.pixel[1][j])] +=
            weight * at.dual[0][static_cast<std::size_t>(i)];
    }
}

// For each row of filters the rays it may see, in the rays' own order.
std::vector<std::vector<std::size_t>> rays_by_interval(const RaySet& set, const Rig& rig) {
    std::vector<std::vector<std::size_t>> bins(static_cast<std::size_t>(rig.views.y) +
                                               3);  // base = -2 ... views
    for (std::size_t r = 0; r < set.rays.size(); ++r) {
        if (!(double{set.rays[r].d.z} > kGrazing)) continue;
        const Passage at(set.rays[r], rig);
        if (!at.misses_s) bins[static_cast<std::size_t>(at.base[1] + 2)].push_back(r);
    }
    return bins;
}

}  // namespace

Projection project_rays(const RaySet& set, const Rig& rig, const Workers& workers, Monitor& monitor) {
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    Phase phase(monitor, "projecting rays", static_cast<std::uint64_t>(rig.views.y));
    const auto bins = rays_by_interval(set, rig);
    require_memory(bytes_of(rig.coefficients(), 2 * sizeof(double)),
                   fmt::format("a light field of {} coefficients", rig.coefficients()),
                   "fewer views or pixels are accepted");
    std::vector<double> sums(rig.coefficients());
    const double scale = 1 / rig.cell_volume();  // > 0: Rig::fault
    // Each row of filters has coefficients of its own and sees its rays in their order: the same sum on any
    // machine.
    parallel_chunks(workers, rig.views.y, [&](std::int64_t row) {
        const int n = static_cast<int>(row);
        for (int base = n - 2; base <= n + 1; ++base) {
            for (const std::size_t r : bins[static_cast<std::size_t>(base + 2)]) {
                add_to_row(set.rays[r], rig, n, scale, sums);
            }
        }
        phase.advance(1);
    });
    std::vector<float> coefficients(sums.begin(), sums.end());

    FluxAccount account;
    account.total = set.flux;
    account.skipped = set.skipped_flux;
    CoefficientNoise noise;  // of E times a cell's volume, as the books are in flux
    for (const LampRay& ray : set.rays) noise.variance += account_for(ray, rig, account);
    for (const double e : sums) noise.square += sqr(e * rig.cell_volume());
    LightFieldInfo info;
    info.colour = set.colour;
    info.unit = set.unit;
    info.provenance = set.provenance;
    LightField bare(rig, std::move(coefficients));
    account.captured = bare.flux();
    info.captured = account.captured;
    info.missed = account.missed();
    return {std::move(bare).with(std::move(info)), account, noise.relative()};
}

}  // namespace lucerna
