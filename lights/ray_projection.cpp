// Ray sets onto light fields: where the planes go, and the projection itself [LF 2, as a sum over rays].
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "lights/bell.h"
#include "lights/ray_projection.h"

namespace lucerna {
namespace {

constexpr double kGrazing = 1e-6;  // rays with a smaller d.z do not leave towards +z

// Where a ray passes the plane z = height, in the frame of the rays. d.z > 0.
V2d pass(const LampRay& ray, double height) {
    const double t = (height - double{ray.o.z}) / double{ray.d.z};
    return {double{ray.o.x} + t * double{ray.d.x}, double{ray.o.y} + t * double{ray.d.y}};
}

struct Weighed {
    double value, weight;
};

// The value below which `share` of the weight lies. Not empty; weights >= 0 with a positive sum.
double quantile(std::vector<Weighed>& values, double share) {
    std::sort(values.begin(), values.end(),
              [](const Weighed& a, const Weighed& b) { return a.value < b.value; });
    double total = 0;
    for (const Weighed& v : values) total += v.weight;
    double sum = 0;
    for (const Weighed& v : values) {
        sum += v.weight;
        if (sum >= share * total) return v.value;
    }
    return values.back().value;
}

// 1 / Σ p² over the cells of a grid on the box |x| <= half: the share of the box that has light, roughly.
class Occupancy {
  public:
    Occupancy(const V2d& half_size, int side)
        : half_(half_size),
          side_(side),
          bin_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side)) {}
    void add(const V2d& at, double weight) {
        int cell[2];
        for (int a = 0; a < 2; ++a) {
            const double x = 0.5 * (at[a] / half_[a] + 1) * side_;
            if (!(x >= 0 && x < side_)) return;
            cell[a] = static_cast<int>(x);
        }
        bin_[static_cast<std::size_t>(cell[0] * side_ + cell[1])] += weight;
        total_ += weight;
        squares_ += weight * weight;
    }
    double share() const {
        if (!(total_ > 0)) return 1;
        double sum = -squares_;  // what the finite number of rays alone contributes
        for (const double b : bin_) sum += b * b;
        const double cells = static_cast<double>(bin_.size());
        return sum > 0 ? std::clamp(total_ * total_ / sum / cells, 1 / cells, 1.0) : 1.0;
    }

  private:
    V2d half_;
    int side_;
    std::vector<double> bin_;
    double total_ = 0, squares_ = 0;
};

// The rays that leave towards +z with some flux, as indices.
std::vector<std::size_t> forward_rays(const RaySet& set) {
    std::vector<std::size_t> forward;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        if (double{set.rays[i].d.z} > kGrazing && set.rays[i].flux > 0) forward.push_back(i);
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

// The box on S: centre and half size, without the margin.
struct Box {
    V2d centre, half;
    bool holds(const V2d& p) const {
        return std::fabs(p.x - centre.x) <= half.x && std::fabs(p.y - centre.y) <= half.y;
    }
};

Box box_on_s(const RaySet& set, std::span<const std::size_t> forward, double height, double capture) {
    const double tail = (1 - capture) / 16;
    Box box;
    std::vector<Weighed> values(forward.size());
    for (int a = 0; a < 2; ++a) {
        for (std::size_t i = 0; i < forward.size(); ++i) {
            const LampRay& ray = set.rays[forward[i]];
            values[i] = {pass(ray, height)[a], double{ray.flux}};
        }
        const double low = quantile(values, tail);
        const double high = quantile(values, 1 - tail);
        box.centre[a] = 0.5 * (low + high);
        box.half[a] = 0.5 * (high - low);
    }
    // A point or a line source still needs a box that has an area.
    const double least = std::max(1e-5, 1e-3 * std::max(box.half.x, box.half.y));
    for (int a = 0; a < 2; ++a) box.half[a] = std::max(box.half[a], least);
    return box;
}

// Half size of M's box, for the rays that pass the box on S.
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
    // The lobe's own proportion, from the middle of the flux; then one factor that reaches the share.
    V2d proportion;
    radius.resize(at.size());
    for (int a = 0; a < 2; ++a) {
        for (std::size_t i = 0; i < at.size(); ++i) radius[i] = {std::fabs(at[i][a]), weight[i]};
        proportion[a] = std::max(quantile(radius, 0.8), 1e-3 * box.half[a]);
    }
    double inside = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
        radius[i] = {std::max(std::fabs(at[i].x) / proportion.x, std::fabs(at[i].y) / proportion.y),
                     weight[i]};
        inside += weight[i];
    }
    const double factor = quantile(radius, std::min(1.0, options.capture * total / inside));
    return proportion * (std::max(factor, 1e-3) * 1.0001);  // the last ray is inside, not on the edge
}

// Pixels and views from the number of rays and where they are.
void choose_resolution(const RaySet& set, std::span<const std::size_t> forward, const Box& box,
                       const V2d& half_m, const FitOptions& options, Rig& rig) {
    Occupancy on_s(box.half, 16);
    Occupancy on_m(half_m, 64);
    double total = 0;
    double squares = 0;
    for (const std::size_t i : forward) {
        const LampRay& ray = set.rays[i];
        const double flux = double{ray.flux};
        on_s.add(pass(ray, rig.centre.z) - box.centre, flux);
        on_m.add(pass(ray, rig.centre.z + rig.distance) - box.centre, flux);
        total += flux, squares += flux * flux;
    }
    const double rays = total * total / squares;                 // rays of equal flux that would be as noisy
    const double side2 = std::sqrt(rays / kRaysPerCoefficient);  // views times pixels, of those with light
    const double views = std::sqrt(0.75 * side2 / on_s.share());
    const double pixels = std::sqrt(side2 / 0.75 / on_m.share());
    for (int a = 0; a < 2; ++a) {
        rig.views[a] =
            options.views[a] > 0 ? options.views[a] : static_cast<int>(std::clamp(views + 2, 4.0, 64.0));
        rig.pixels[a] =
            options.pixels[a] > 0 ? options.pixels[a] : static_cast<int>(std::clamp(pixels, 4.0, 256.0));
    }
}

// One ray, on the rig's planes.
struct Passage {
    int base[2];                    // the filter at or below it, per axis
    std::array<double, 4> dual[2];  // of filters base - 1 ... base + 2
    int pixel[2][4];                // the pixel each of those sees it in; -1: none
    bool misses_s;                  // none of the filters exists

    Passage(const LampRay& ray, const Rig& rig) : base{}, pixel{}, misses_s(false) {
        const V2d centre(rig.centre.x, rig.centre.y);
        const V2d on_s = pass(ray, rig.centre.z) - centre;
        const V2d on_m = pass(ray, rig.centre.z + rig.distance) - centre;
        for (int a = 0; a < 2; ++a) {
            const double x = (on_s[a] - rig.filter(a, 0)) / rig.spacing[a];
            if (!(x >= -2 && x < rig.views[a] + 1)) {
                misses_s = true;
                return;
            }
            const double floor = std::floor(x);
            base[a] = static_cast<int>(floor);
            dual[a] = bell_dual_weights(x - floor);
            for (int i = 0; i < 4; ++i) {
                const int filter = base[a] - 1 + i;
                const double k = (on_m[a] - rig.column_edge(a, filter + 1, 0)) / rig.pixel[a];
                pixel[a][i] = k >= 0 && k < rig.pixels[a] ? static_cast<int>(k) : -1;
            }
        }
    }
    bool exists(const Rig& rig, int axis, int i) const {
        const int filter = base[axis] - 1 + i;
        return filter >= 0 && filter < rig.views[axis];
    }
};

// Books one ray's flux: what its filters record, and what they do not.
void account_for(const LampRay& ray, const Rig& rig, FluxAccount& account) {
    const double flux = double{ray.flux};
    if (!(double{ray.d.z} > kGrazing)) {
        account.backward += flux;
        return;
    }
    const Passage at(ray, rig);
    if (at.misses_s) {
        account.beside_s += flux;
        return;
    }
    double held = 0;
    double off_m = 0;
    bool any_pixel = false;
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) {
            if (!at.exists(rig, 0, i) || !at.exists(rig, 1, j)) continue;
            const bool seen = at.pixel[0][i] >= 0 && at.pixel[1][j] >= 0;
            const auto zi = static_cast<std::size_t>(i);
            const auto zj = static_cast<std::size_t>(j);
            (seen ? held : off_m) += flux * at.dual[0][zi] * at.dual[1][zj];
            any_pixel = any_pixel || seen;
        }
    }
    if (!any_pixel) {
        account.beside_m += flux;
        return;
    }
    account.beside_m += off_m;
    account.not_in_basis += flux - held - off_m;
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

Rig choose_rig(const RaySet& set, const FitOptions& options) {
    check(options);
    const std::vector<std::size_t> forward = forward_rays(set);
    Rig rig;
    if (options.z) {
        rig.centre.z = *options.z;
    } else {
        std::vector<Weighed> heights;
        for (const std::size_t i : forward)
            heights.push_back({double{set.rays[i].o.z}, double{set.rays[i].flux}});
        rig.centre.z = quantile(heights, 0.5);
    }
    const Box box = box_on_s(set, forward, rig.centre.z, options.capture);
    rig.centre.x = box.centre.x;
    rig.centre.y = box.centre.y;
    rig.distance = options.distance > 0 ? options.distance : 5 * 2 * std::max(box.half.x, box.half.y);
    const V2d half_m = half_of_m(set, forward, box, rig.centre.z, options, rig.distance);
    choose_resolution(set, forward, box, half_m, options, rig);
    for (int a = 0; a < 2; ++a) {
        rig.spacing[a] =
            2 * box.half[a] / std::max(1, rig.views[a] - 3);  // one filter outside on either side
        rig.pixel[a] = 2 * half_m[a] / rig.pixels[a];
    }
    return rig;
}

Projection project_rays(const RaySet& set, const Rig& rig, const Workers& workers, Monitor& monitor) {
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    Phase phase(monitor, "projecting rays", static_cast<std::uint64_t>(rig.views.y));
    const auto bins = rays_by_interval(set, rig);
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
    for (const LampRay& ray : set.rays) account_for(ray, rig, account);
    LightFieldInfo info;
    info.colour = set.colour;
    info.unit = set.unit;
    info.provenance = set.provenance;
    LightField bare(rig, std::move(coefficients));
    account.captured = bare.flux();
    info.captured = account.captured;
    info.missed = account.missed();
    return {std::move(bare).with(std::move(info)), account};
}

Projection fit_light_field(const RaySet& set, const FitOptions& options, const Workers& workers,
                           Monitor& monitor) {
    Projection made = project_rays(set, choose_rig(set, options), workers, monitor);
    const FluxAccount& a = made.account;
    monitor.info(fmt::format(
        "flux {:.6g} {}: {:.6g} captured; missed {:.4g} (unusable {:.4g}, backwards {:.4g}, beside S "
        "{:.4g}, beside M {:.4g}, not in the basis {:.4g})",
        a.total, flux_unit_name(set.unit), a.captured, a.missed(), a.skipped, a.backward, a.beside_s,
        a.beside_m, a.not_in_basis));
    return made;
}

}  // namespace lucerna
