#include "lights/measurement/plane_irradiance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "lights/measurement/basis_shares.h"

namespace lucerna {
namespace {

constexpr int kSamplesPerPixel = 8;  // per axis, over which a pixel's mean is taken
constexpr int kMostPerSide = 16384;
constexpr double kTail = 0.02;   // share of the light that a frame leaves out on each side
constexpr double kMargin = 1.1;  // factor by which a frame is wider than that
constexpr int kCoarse = 256;     // pixels per side of the projection from which a frame is found

// Returns, along one axis, what each filter sends through each pixel to the mean over [from, to] of the plane
// at z, or to a point if the two are equal.
std::vector<BasisShare> shares(const Rig& rig, int axis, double z, double from, double to) {
    const int samples = to > from ? kSamplesPerPixel : 1;
    const auto pixels = static_cast<std::size_t>(rig.pixels[axis]);
    std::vector<double> sums(static_cast<std::size_t>(rig.views[axis]) * pixels);
    for (int i = 0; i < samples; ++i) {
        const double x = from + (i + 0.5) / samples * (to - from);
        // Rays satisfy s = u + (x - u) D/z.
        const double ratio = z > 0 ? rig.distance / z : 1.0;
        for (const BasisShare& share :
             z == 0 ? basis_shares_at(rig, axis, x) : basis_shares(rig, axis, x * ratio, 1 - ratio)) {
            sums[static_cast<std::size_t>(share.filter) * pixels + static_cast<std::size_t>(share.pixel)] +=
                share.weight * ratio / samples;
        }
    }
    std::vector<BasisShare> all;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        if (sums[i] > 0) all.push_back({static_cast<int>(i / pixels), static_cast<int>(i % pixels), sums[i]});
    }
    return all;
}

// Sums over filters and pixels of the first axis; the rest depends on (n, l) alone.
void contract(const LightField& field, const std::vector<BasisShare>& shares, std::vector<double>& rest) {
    const Rig& rig = field.rig();
    const auto height = static_cast<std::size_t>(rig.pixels.y);
    std::fill(rest.begin(), rest.end(), 0.0);
    for (const BasisShare& share : shares) {
        for (int n = 0; n < rig.views.y; ++n) {
            const float* e = &field.coefficients()[rig.index(share.filter, n, share.pixel, 0)];
            double* sum = &rest[static_cast<std::size_t>(n) * height];
            for (std::size_t l = 0; l < height; ++l) sum[l] += share.weight * double{e[l]};
        }
    }
}

double apply(const std::vector<BasisShare>& shares, const std::vector<double>& rest, std::size_t height) {
    double sum = 0;
    for (const BasisShare& share : shares) {
        sum += share.weight *
               rest[static_cast<std::size_t>(share.filter) * height + static_cast<std::size_t>(share.pixel)];
    }
    return sum;
}

std::size_t rest_size(const Rig& rig) {
    return static_cast<std::size_t>(rig.views.y) * static_cast<std::size_t>(rig.pixels.y);
}

void require(const PlanePatch& patch) {
    if (const std::string fault = patch.fault(); !fault.empty()) throw InputError("plane: " + fault);
}

double edge(const PlanePatch& patch, int axis, int i) {
    return patch.centre[axis] + (static_cast<double>(i) / patch.pixels[axis] - 0.5) * patch.size[axis];
}

// Returns the narrowest [from, to] of a row of weights that leaves out kTail at each end, in units of the
// row.
std::array<double, 2> without_tails(const std::vector<double>& weights) {
    double total = 0;
    for (const double w : weights) total += std::max(0.0, w);
    std::array<double, 2> ends{0, static_cast<double>(weights.size())};
    double sum = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        sum += std::max(0.0, weights[i]);
        if (sum < kTail * total) ends[0] = static_cast<double>(i + 1);
        if (sum <= (1 - kTail) * total) ends[1] = static_cast<double>(i + 2);
    }
    return ends;
}

}  // namespace

PlanePatch frame_of(const PlaneIrradiance& wide, int pixels) {
    PlanePatch patch = wide.patch;
    double side = 0;
    for (int axis = 0; axis < 2; ++axis) {
        std::vector<double> marginal(static_cast<std::size_t>(wide.patch.pixels[axis]));
        for (int y = 0; y < wide.patch.pixels.y; ++y) {
            for (int x = 0; x < wide.patch.pixels.x; ++x)
                marginal[static_cast<std::size_t>(axis == 0 ? x : y)] += wide.at(x, y);
        }
        const auto [from, to] = without_tails(marginal);
        const double pixel = wide.patch.size[axis] / wide.patch.pixels[axis];
        patch.centre[axis] = edge(wide.patch, axis, 0) + 0.5 * (from + to) * pixel;
        side = std::max(side, (to - from) * pixel);
    }
    patch.size = V2d(std::max(side * kMargin, 1e-9));
    patch.pixels = {pixels, pixels};
    return patch;
}

std::string PlanePatch::fault() const {
    if (!std::isfinite(distance)) return "a distance that is not finite";
    for (int axis = 0; axis < 2; ++axis) {
        if (!(size[axis] > 0) || !std::isfinite(size[axis]) || !std::isfinite(centre[axis]))
            return fmt::format("a size of {:g} x {:g} m; finite and positive", size.x, size.y);
        if (pixels[axis] < 1 || pixels[axis] > kMostPerSide)
            return fmt::format("{} x {} pixels; 1 to {} per side", pixels.x, pixels.y, kMostPerSide);
    }
    return {};
}

double PlaneIrradiance::flux() const {
    double sum = 0;
    for (const double e : values) sum += e;
    return sum * patch.pixel_area();
}

double PlaneIrradiance::peak() const {
    return *std::max_element(values.begin(), values.end());  // a patch has at least one pixel
}

namespace {

// Computes irradiance by the approximate reconstruction.
class ApproximatePlane {
  public:
    ApproximatePlane(const LightField& field, const Workers& workers)
        : rig_(field.rig()), radiance_(rig_.coefficients()) {
        parallel_chunks(workers, rig_.views.x, [&](std::int64_t chunk) {
            const int m = static_cast<int>(chunk);
            for (int n = 0; n < rig_.views.y; ++n) {
                for (int k = 0; k < rig_.pixels.x; ++k) {
                    for (int l = 0; l < rig_.pixels.y; ++l) {
                        const std::size_t i = rig_.index(m, n, k, l);
                        radiance_[i] =
                            static_cast<float>(double{field.coefficients()[i]} * per_term(m, n, k, l));
                    }
                }
            }
        });
    }

    // Returns the nodes along one axis at height z, to be combined by at().
    std::vector<BasisNode> nodes(int axis, double z, double x) const {
        constexpr int kNodes = 3;  // between knots
        const double ratio = z > 0 ? rig_.distance / z : 1.0;
        return z == 0 ? basis_nodes_at(rig_, axis, x, kNodes)
                      : basis_nodes(rig_, axis, x * ratio, 1 - ratio, kNodes);
    }
    double at(const std::vector<BasisNode>& across, const std::vector<BasisNode>& down, double z) const {
        const double ratio = z > 0 ? rig_.distance / z : 1.0;
        double sum = 0;
        for (const BasisNode& v : down) {
            for (const BasisNode& u : across) {
                const double g = rig_.geometric_term({u.on_s, v.on_s}, {u.on_m, v.on_m});
                sum += u.weight * v.weight * g * radiance(u, v);
            }
        }
        return sum * ratio * ratio;
    }

  private:
    // Returns the factor from a coefficient to radiance, between the centres of its filter and its pixel.
    double per_term(int m, int n, int k, int l) const {
        const auto middle = [&](int axis, int filter, int pixel) {
            const double edge = rig_.column_edge_x(axis, filter + 1, pixel);
            return rig_.m_coordinate.on_plane(edge + 0.5 * rig_.pixel[axis]);
        };
        const V2d filter(rig_.filter(0, m), rig_.filter(1, n)), pixel(middle(0, m, k), middle(1, n, l));
        return rig_.slope(filter, pixel) / rig_.geometric_term(filter, pixel);  // > 0 at finite places
    }
    double radiance(const BasisNode& u, const BasisNode& v) const {
        const auto in = [](int i, int size) { return i >= 0 && i < size; };
        double sum = 0;
        for (int i = 0; i < 2; ++i) {
            for (int a = 0; a < 2; ++a) {
                const double across = u.under[i] * u.across[a];
                const int m = u.filter + i, k = u.pixel[i] + a;
                if (!(across > 0) || !in(m, rig_.views.x) || !in(k, rig_.pixels.x)) continue;
                for (int j = 0; j < 2; ++j) {
                    for (int b = 0; b < 2; ++b) {
                        const double down = v.under[j] * v.across[b];
                        const int n = v.filter + j, l = v.pixel[j] + b;
                        if (!(down > 0) || !in(n, rig_.views.y) || !in(l, rig_.pixels.y)) continue;
                        sum += across * down * double{radiance_[rig_.index(m, n, k, l)]};
                    }
                }
            }
        }
        return sum;
    }

    const Rig& rig_;
    std::vector<float> radiance_;  // per coefficient
};

PlaneIrradiance project_approximately(const LightField& field, const PlanePatch& patch,
                                      const Workers& workers, Monitor& monitor) {
    const ApproximatePlane plane(field, workers);
    const auto across = [&](int axis, std::int64_t i) {
        const int from = static_cast<int>(i);
        return plane.nodes(axis, patch.distance,
                           0.5 * (edge(patch, axis, from) + edge(patch, axis, from + 1)));
    };
    std::vector<std::vector<BasisNode>> columns(static_cast<std::size_t>(patch.pixels.x));
    parallel_chunks(workers, patch.pixels.x,
                    [&](std::int64_t x) { columns[static_cast<std::size_t>(x)] = across(0, x); });
    PlaneIrradiance result{patch, {}};
    result.values.resize(columns.size() * static_cast<std::size_t>(patch.pixels.y));
    Phase phase(monitor, "projection", static_cast<std::uint64_t>(patch.pixels.y));
    parallel_chunks(workers, patch.pixels.y, [&](std::int64_t y) {
        if (monitor.stopped()) throw Stopped("projection: stopped");
        const std::vector<BasisNode> down = across(1, y);
        for (std::size_t x = 0; x < columns.size(); ++x) {
            result.values[static_cast<std::size_t>(y) * columns.size() + x] =
                plane.at(columns[x], down, patch.distance);
        }
        phase.advance(1);
    });
    return result;
}

}  // namespace

PlaneIrradiance project(const LightField& field, const PlanePatch& patch, const Workers& workers,
                        Monitor& monitor, Reconstruction reconstruction) {
    require(patch);
    if (!(patch.distance >= 0))
        throw InputError(fmt::format("plane: {:g} m in front of S; expected 0 or more", patch.distance));
    if (reconstruction == Reconstruction::approximate)
        return project_approximately(field, patch, workers, monitor);
    const Rig& rig = field.rig();
    const auto across = [&](int axis, std::int64_t i) {
        return shares(rig, axis, patch.distance, edge(patch, axis, static_cast<int>(i)),
                      edge(patch, axis, static_cast<int>(i) + 1));
    };
    std::vector<std::vector<BasisShare>> rows(static_cast<std::size_t>(patch.pixels.y));
    parallel_chunks(workers, patch.pixels.y,
                    [&](std::int64_t y) { rows[static_cast<std::size_t>(y)] = across(1, y); });
    PlaneIrradiance result{patch, {}};
    const auto width = static_cast<std::size_t>(patch.pixels.x);
    result.values.resize(width * rows.size());
    Phase phase(monitor, "projection", static_cast<std::uint64_t>(patch.pixels.x));
    parallel_chunks(workers, patch.pixels.x, [&](std::int64_t x) {
        if (monitor.stopped()) throw Stopped("projection: stopped");
        std::vector<double> rest(rest_size(rig));
        contract(field, across(0, x), rest);
        for (std::size_t y = 0; y < rows.size(); ++y) {
            result.values[y * width + static_cast<std::size_t>(x)] =
                apply(rows[y], rest, static_cast<std::size_t>(rig.pixels.y));
        }
        phase.advance(1);
    });
    return result;
}

double irradiance(const LightField& field, const V3d& point, Reconstruction reconstruction) {
    if (!(point.z >= 0) || !std::isfinite(point.x + point.y + point.z))
        throw InputError(
            fmt::format("a point {:g} m in front of S; expected a finite value, 0 or more", point.z));
    if (reconstruction == Reconstruction::approximate) {
        const ApproximatePlane plane(field, {});
        return plane.at(plane.nodes(0, point.z, point.x), plane.nodes(1, point.z, point.y), point.z);
    }
    const Rig& rig = field.rig();
    std::vector<double> rest(rest_size(rig));
    contract(field, shares(rig, 0, point.z, point.x, point.x), rest);
    return apply(shares(rig, 1, point.z, point.y, point.y), rest, static_cast<std::size_t>(rig.pixels.y));
}

PlaneIrradiance project(const RaySet& rays, const PlanePatch& patch) {
    require(patch);
    PlaneIrradiance result{patch, {}};
    result.values.resize(static_cast<std::size_t>(patch.pixels.x) * static_cast<std::size_t>(patch.pixels.y));
    const double per_area = 1 / patch.pixel_area();  // sizes are positive
    for (const LampRay& ray : rays.rays) {
        const double way = patch.distance - double{ray.o.z};
        if (!(ray.d.z > 0)) continue;
        std::size_t pixel[2];
        bool inside = true;
        for (int axis = 0; axis < 2; ++axis) {
            const double at = double{ray.o[axis]} + way / double{ray.d.z} * double{ray.d[axis]};
            const double i = ((at - patch.centre[axis]) / patch.size[axis] + 0.5) * patch.pixels[axis];
            inside = inside && i >= 0 && i < patch.pixels[axis];  // false also for infinities
            pixel[axis] = inside ? static_cast<std::size_t>(i) : 0;
        }
        if (!inside) continue;
        result.values[pixel[1] * static_cast<std::size_t>(patch.pixels.x) + pixel[0]] +=
            double{ray.flux} * per_area;
    }
    return result;
}

PlanePatch frame_light(const LightField& field, double distance, int pixels, const Workers& workers,
                       Monitor& monitor) {
    const Rig& rig = field.rig();
    PlanePatch wide{distance, {0, 0}, {0, 0}, {kCoarse, kCoarse}};
    for (int axis = 0; axis < 2; ++axis) {
        // The rays from the edge of S through the opposite edge of M reach furthest.
        const double on_s = -rig.interval_edge(axis, 0);
        const double on_m = rig.m_edge(axis, rig.intervals(axis) - 1, true);
        const double part = distance / rig.distance;  // D > 0
        wide.size[axis] = 2 * (on_s * std::fabs(1 - part) + on_m * part);
        wide.size[axis] = std::max(wide.size[axis], 2 * on_s);
    }
    return frame_of(project(field, wide, workers, monitor), pixels);
}

PlanePatch frame_light(const RaySet& rays, double distance, int pixels) {
    // `wide` is the square that holds all but the flattest rays.
    std::vector<double> reach;
    for (const LampRay& ray : rays.rays) {
        if (!(ray.d.z > 0)) continue;
        const double way = (distance - double{ray.o.z}) / double{ray.d.z};
        reach.push_back(std::max(std::fabs(double{ray.o.x} + way * double{ray.d.x}),
                                 std::fabs(double{ray.o.y} + way * double{ray.d.y})));
    }
    if (reach.empty())
        throw InputError(fmt::format("no ray passes the plane at {:g} m towards +z", distance));
    const auto nth =
        reach.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(reach.size() - 1));
    std::nth_element(reach.begin(), nth, reach.end());
    const PlanePatch wide{distance, {0, 0}, V2d(std::max(2.02 * *nth, 1e-9)), {kCoarse, kCoarse}};
    return frame_of(project(rays, wide), pixels);
}

}  // namespace lucerna
