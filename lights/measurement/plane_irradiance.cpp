#include "lights/measurement/plane_irradiance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/monitor.h"

namespace lucerna {
namespace {

constexpr int kSamplesPerPixel = 8;  // per axis, over which a pixel's mean is taken
constexpr int kMostPerSide = 16384;
constexpr double kTail = 0.02;   // share of the light that a frame leaves out on each side
constexpr double kMargin = 1.1;  // by which a frame is wider than that
constexpr int kCoarse = 256;     // pixels per side from which a frame is found

// One axis of the projection: for a position x on the plane, the bells' integrals over the parts of S from
// which x is seen through each pixel.
class AxisProjection {
  public:
    AxisProjection(const Rig& rig, int axis, double z) : rig_(rig), axis_(axis), z_(z) {}

    // For the mean over [from, to]; a point if they are equal.
    std::vector<BellShare> shares(double from, double to) const {
        const int samples = to > from ? kSamplesPerPixel : 1;
        std::vector<BellShare> all;
        for (int filter = 0; filter < rig_.views[axis_]; ++filter) {
            std::vector<double> through(static_cast<std::size_t>(rig_.pixels[axis_]));
            for (int i = 0; i < samples; ++i)
                add(filter, from + (i + 0.5) / samples * (to - from), 1.0 / samples, through);
            for (int pixel = 0; pixel < rig_.pixels[axis_]; ++pixel) {
                const double weight = through[static_cast<std::size_t>(pixel)];
                if (weight > 0) all.push_back({filter, pixel, weight});
            }
        }
        return all;
    }

  private:
    void add(int filter, double x, double share, std::vector<double>& through) const {
        const double spacing = rig_.spacing[axis_], centre = rig_.filter(axis_, filter);
        if (z_ == 0) {
            // On S itself: the light of all pixels, each weighed by its own width.
            const double weight = share * bell((x - centre) / spacing) * rig_.pixel[axis_];
            for (double& t : through) t += weight;
            return;
        }
        // The pixel's number along S, s(u) = u + (x - u) D/z in pixels from the image's lower edge, is
        // linear.
        const double ratio = rig_.distance / z_;
        const double sensor = rig_.shift[axis_] > 0 ? centre : 0.0;
        const auto pixel_at = [&](double u) {
            return (u + (x - u) * ratio - sensor) / rig_.pixel[axis_] + 0.5 * rig_.pixels[axis_];
        };
        const double middle = pixel_at(centre), slope = pixel_at(centre + spacing) - middle;
        share_bell(middle, slope, rig_.pixels[axis_], [&](int k, double of_bell) {
            through[static_cast<std::size_t>(k)] += share * spacing * of_bell * ratio;
        });
    }

    const Rig& rig_;
    int axis_;
    double z_;
};

// Σ over filters and pixels of the first axis: what is left depends on (n, l) alone.
void contract(const LightField& field, const std::vector<BellShare>& shares, std::vector<double>& rest) {
    const Rig& rig = field.rig();
    const auto height = static_cast<std::size_t>(rig.pixels.y);
    std::fill(rest.begin(), rest.end(), 0.0);
    for (const BellShare& share : shares) {
        for (int n = 0; n < rig.views.y; ++n) {
            const float* e = &field.coefficients()[rig.index(share.filter, n, share.pixel, 0)];
            double* sum = &rest[static_cast<std::size_t>(n) * height];
            for (std::size_t l = 0; l < height; ++l) sum[l] += share.weight * double{e[l]};
        }
    }
}

double apply(const std::vector<BellShare>& shares, const std::vector<double>& rest, std::size_t height) {
    double sum = 0;
    for (const BellShare& share : shares) {
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

// The narrowest [from, to] of a row of weights that leaves out kTail at each end. In units of the row.
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

// The square about what is bright in a wide projection.
PlanePatch about_the_light(const PlaneIrradiance& wide, int pixels) {
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

}  // namespace

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

PlaneIrradiance project(const LightField& field, const PlanePatch& patch, const Workers& workers,
                        Monitor& monitor) {
    require(patch);
    if (!(patch.distance >= 0))
        throw InputError(fmt::format("plane: {:g} m before S; 0 or more is accepted", patch.distance));
    const Rig& rig = field.rig();
    const AxisProjection across(rig, 0, patch.distance), up(rig, 1, patch.distance);
    std::vector<std::vector<BellShare>> rows(static_cast<std::size_t>(patch.pixels.y));
    parallel_chunks(workers, patch.pixels.y, [&](std::int64_t y) {
        rows[static_cast<std::size_t>(y)] =
            up.shares(edge(patch, 1, static_cast<int>(y)), edge(patch, 1, static_cast<int>(y) + 1));
    });
    PlaneIrradiance result{patch, {}};
    const auto width = static_cast<std::size_t>(patch.pixels.x);
    result.values.resize(width * rows.size());
    Phase phase(monitor, "projection", static_cast<std::uint64_t>(patch.pixels.x));
    parallel_chunks(workers, patch.pixels.x, [&](std::int64_t x) {
        if (monitor.stopped()) throw Stopped("projection: stopped");
        std::vector<double> rest(rest_size(rig));
        contract(field,
                 across.shares(edge(patch, 0, static_cast<int>(x)), edge(patch, 0, static_cast<int>(x) + 1)),
                 rest);
        for (std::size_t y = 0; y < rows.size(); ++y) {
            result.values[y * width + static_cast<std::size_t>(x)] =
                apply(rows[y], rest, static_cast<std::size_t>(rig.pixels.y));
        }
        phase.advance(1);
    });
    return result;
}

double irradiance(const LightField& field, const V3d& point) {
    if (!(point.z >= 0) || !std::isfinite(point.x + point.y + point.z))
        throw InputError(fmt::format("a point {:g} m before S; 0 or more, and finite, is accepted", point.z));
    const Rig& rig = field.rig();
    std::vector<double> rest(rest_size(rig));
    contract(field, AxisProjection(rig, 0, point.z).shares(point.x, point.x), rest);
    return apply(AxisProjection(rig, 1, point.z).shares(point.y, point.y), rest,
                 static_cast<std::size_t>(rig.pixels.y));
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
            inside = inside && i >= 0 && i < patch.pixels[axis];  // false for infinities
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
        // The rays from the edge of S through the far edge of M reach furthest.
        const double on_s = 0.5 * rig.intervals(axis) * rig.spacing[axis];
        const double moved = rig.shift[axis] > 0 ? rig.filter(axis, rig.views[axis] - 1) : 0.0;
        const double on_m = 0.5 * rig.pixels[axis] * rig.pixel[axis] + moved;
        const double part = distance / rig.distance;  // D > 0
        wide.size[axis] = 2 * (on_s * std::fabs(1 - part) + on_m * part);
        wide.size[axis] = std::max(wide.size[axis], 2 * on_s);
    }
    return about_the_light(project(field, wide, workers, monitor), pixels);
}

PlanePatch frame_light(const RaySet& rays, double distance, int pixels) {
    // The box that holds all but the flattest rays.
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
    return about_the_light(project(rays, wide), pixels);
}

}  // namespace lucerna
