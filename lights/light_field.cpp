#include "lights/light_field.h"

#include <bit>
#include <cmath>

#include "engine/base/error.h"
#include "engine/colour/spectrum.h"
#include "engine/system/hash.h"

namespace lucerna {

std::string Rig::fault() const {
    for (int axis = 0; axis < 2; ++axis) {
        const char* name = axis == 0 ? "across" : "down";
        if (views[axis] < 1 || views[axis] > 65534)
            return fmt::format("{} views {}; 1 to 65534", views[axis], name);
        if (pixels[axis] < 1 || pixels[axis] > 65535)
            return fmt::format("{} pixels {}; 1 to 65535", pixels[axis], name);
        if (shift[axis] < 0 || columns(axis) > 65535)
            return fmt::format("a shift of {} pixels {}", shift[axis], name);
        if (!std::isfinite(spacing[axis]) || !(spacing[axis] > 0)) {
            return fmt::format("a filter spacing of {} m {}; it must be finite and positive", spacing[axis],
                               name);
        }
        if (!std::isfinite(pixel[axis]) || !(pixel[axis] > 0)) {
            return fmt::format("a pixel size of {} m {}; it must be finite and positive", pixel[axis], name);
        }
        const double shift_m = shift[axis] * pixel[axis];
        if (shift[axis] > 0 && std::fabs(shift_m - spacing[axis]) > 1e-5 * spacing[axis]) {
            return fmt::format("a shift of {} pixels of {} m {}, which is not the filter spacing of {} m",
                               shift[axis], pixel[axis], name, spacing[axis]);
        }
    }
    if (const std::string words = fault_of_basis(); !words.empty()) return words;
    if (!std::isfinite(distance) || !(distance > 0)) {
        return fmt::format("a plane distance of {} m; it must be finite and positive", distance);
    }
    if (!std::isfinite(centre.x) || !std::isfinite(centre.y) || !std::isfinite(centre.z))
        return "a centre that is not finite";
    const double volume = cell_volume();
    if (!std::isfinite(1 / volume) || !(volume > 0)) return "lengths whose product is out of range";
    return {};
}

std::string Rig::fault_of_basis() const {
    for (int axis = 0; axis < 2; ++axis) {
        const bool even = s_coordinate.c == 0 && m_coordinate.c == 0;
        if (shift[axis] != 0 && (!even || basis != PixelBasis::box))
            return "a moving sensor with pixels that are not uniform boxes";
        const auto fits = [](const PlaneCoordinate& x, double reach) {
            return x.c == 0 || (std::isfinite(x.c) && x.c > 0 && reach < 2 * x.c);
        };
        const double s_reach = -interval_edge_x(axis, 0);
        const double m_reach = (0.5 * pixels[axis] + overhang()) * pixel[axis];
        if (!fits(s_coordinate, s_reach))
            return fmt::format("filters to {} m in a coordinate that ends at {} m", s_reach,
                               2 * s_coordinate.c);
        if (!fits(m_coordinate, m_reach))
            return fmt::format("pixels to {} m in a coordinate that ends at {} m", m_reach,
                               2 * m_coordinate.c);
    }
    return {};
}

std::size_t Rig::coefficients() const {
    return static_cast<std::size_t>(views.x) * static_cast<std::size_t>(views.y) *
           static_cast<std::size_t>(pixels.x) * static_cast<std::size_t>(pixels.y);
}

LightField::LightField(const Rig& rig, const std::vector<float>& coefficients, LightFieldInfo info)
    : rig_(rig), coefficients_(coefficients.begin(), coefficients.end()), info_(std::move(info)) {
    if (const std::string fault = rig_.fault(); !fault.empty()) throw InputError("light field: " + fault);
    if (coefficients_.size() != rig_.coefficients()) {
        throw InputError(fmt::format("light field: {} coefficients, but the geometry has {}",
                                     coefficients_.size(), rig_.coefficients()));
    }
    for (std::size_t i = 0; i < coefficients_.size(); ++i) {
        if (std::isfinite(coefficients_[i])) continue;
        const auto per_view =
            static_cast<std::size_t>(rig_.pixels.x) * static_cast<std::size_t>(rig_.pixels.y);
        const auto h = static_cast<std::size_t>(rig_.views.y);
        const auto t = static_cast<std::size_t>(rig_.pixels.y);
        throw InputError(fmt::format(
            "light field: coefficient {} in view ({}, {}), pixel ({}, {}); expected finite numbers",
            coefficients_[i], i / per_view / h, i / per_view % h, i % per_view / t, i % per_view % t));
    }
}

LightField::LightField(const Rig& rig, const std::vector<float>& x, const std::vector<float>& y,
                       const std::vector<float>& z, LightFieldInfo info, std::optional<V3d> weight)
    : LightField(rig, y, std::move(info)) {
    // These checks are those of the constructor above.
    const LightField checked_x(rig, x), checked_z(rig, z);
    const V3d flux(checked_x.flux(), this->flux(), checked_z.flux());
    if (!(flux.y > 0))
        throw InputError(fmt::format("light field: a luminous flux of {:g} beside other colours", flux.y));
    // A channel with hardly any light would make particles follow its noise.
    constexpr double kHardlyAny = 0.01;
    int channels = 0;
    for (int c = 0; c < 3; ++c) channels += flux[c] > kHardlyAny * flux.y;
    for (int c = 0; c < 3; ++c)
        colour_.weight[c] = flux[c] > kHardlyAny * flux.y ? flux.y / (channels * flux[c]) : 0.0;
    if (weight) {
        // The accepted range is that of the weights above: up to three channels, none with less than a
        // hundredth of Y's light.
        const auto is_share = [](double w, double least, double most) {
            return std::isfinite(w) && w >= least && w <= most;
        };
        const double most = 1 / kHardlyAny;
        if (!is_share(weight->x, 0, most) || !is_share(weight->y, 0.25, 1) || !is_share(weight->z, 0, most)) {
            throw InputError(
                fmt::format("light field: weights {} {} {} of X, Y and Z; expected 0.25 to 1 for Y and 0 to "
                            "{} for the others",
                            weight->x, weight->y, weight->z, most));
        }
        colour_.weight = *weight;
    }
    const double scale_y = storage_scale(coefficients_);
    colour_.scale_x = storage_scale(x);
    colour_.scale_z = storage_scale(z);
    colour_.pairs.resize(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
        const ColourChannels::Pair pair{stored_half(x[i], colour_.scale_x),
                                        stored_half(z[i], colour_.scale_z)};
        colour_.pairs[i] = pair;
        const double others = colour_.weight.x * double{from_stored(pair.x, colour_.scale_x)} +
                              colour_.weight.z * double{from_stored(pair.z, colour_.scale_z)};
        // Y is recovered as W minus the other terms. Where it is far smaller than they, rounding may give
        // another half; the loop then continues with that one until it recovers itself.
        half stored = stored_half(y[i], scale_y);
        for (int round = 0; round < 4; ++round) {
            coefficients_[i] =
                static_cast<float>(colour_.weight.y * double{from_stored(stored, scale_y)} + others);
            const half found = stored_half(luminance_of(i), scale_y);
            if (found.bits() == stored.bits()) break;
            stored = found;
        }
        if (!std::isfinite(coefficients_[i]) || !std::isfinite(luminance_of(i)))
            throw InputError("light field: colours whose sum is out of range");
    }
    info_.colour = colour_of_luminance_one(xyz_to_rgb(xyz()));
}

float LightField::luminance_of(std::size_t i) const {
    if (!coloured()) return coefficients_[i];
    const ColourChannels::Pair& pair = colour_.pairs[i];
    const double others = colour_.weight.x * double{from_stored(pair.x, colour_.scale_x)} +
                          colour_.weight.z * double{from_stored(pair.z, colour_.scale_z)};
    return static_cast<float>((double{coefficients_[i]} - others) / colour_.weight.y);  // > 0: Y carries flux
}

LightField LightField::channel(int c) const {
    std::vector<float> e(coefficients_.size());
    const V3d one = coloured() ? V3d(0) : rgb_to_xyz(info_.colour);
    for (std::size_t i = 0; i < e.size(); ++i) {
        if (!coloured())
            e[i] = static_cast<float>(one[c] * double{coefficients_[i]});
        else if (c == 1)
            e[i] = luminance_of(i);
        else
            e[i] = c == 0 ? from_stored(colour_.pairs[i].x, colour_.scale_x)
                          : from_stored(colour_.pairs[i].z, colour_.scale_z);
    }
    LightFieldInfo info = info_;
    info.colour = Rgb(1);
    return LightField(rig_, e, std::move(info));
}

V3d LightField::xyz() const {
    if (!coloured()) return rgb_to_xyz(info_.colour);
    V3d sum(0, 0, 0);
    for (std::size_t i = 0; i < coefficients_.size(); ++i) {
        sum += V3d(double{from_stored(colour_.pairs[i].x, colour_.scale_x)}, double{luminance_of(i)},
                   double{from_stored(colour_.pairs[i].z, colour_.scale_z)});
    }
    return sum / sum.y;  // > 0: checked by the constructor, and halves preserve it
}

LightField::ColourCell LightField::colour_members(const Cell& cell) const {
    const int k[2] = {cell.p, cell.p - rig_.shift.x};
    const int l[2] = {cell.q, cell.q - rig_.shift.y};
    const auto in = [](int i, int size) { return static_cast<unsigned>(i) < static_cast<unsigned>(size); };
    ColourCell c;
    c.x.basis = c.z.basis = rig_.filter_basis;
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
            const int m = cell.n - 1 + i, n = cell.o - 1 + j;
            if (!in(m, rig_.views.x) || !in(n, rig_.views.y) || !in(k[i], rig_.pixels.x) ||
                !in(l[j], rig_.pixels.y))
                continue;
            const ColourChannels::Pair& pair = colour_.pairs[rig_.index(m, n, k[i], l[j])];
            c.x.e[i][j] = from_stored(pair.x, colour_.scale_x);
            c.z.e[i][j] = from_stored(pair.z, colour_.scale_z);
        }
    }
    return c;
}

double LightField::flux() const {
    double sum = 0;
    for (const float e : coefficients_) sum += double{e};
    return sum * rig_.cell_volume();
}

double LightField::clamped_flux(const Workers& workers) const {
    const std::int64_t rows = std::int64_t{rig_.intervals(0)} * rig_.intervals(1);
    std::vector<double> sums(static_cast<std::size_t>(rows));
    parallel_chunks(workers, rows, [&](std::int64_t row) {
        Cell cell{static_cast<int>(row / rig_.intervals(1)), static_cast<int>(row % rig_.intervals(1)), 0, 0};
        double sum = 0;
        for (cell.p = 0; cell.p < rig_.columns(0); ++cell.p) {
            for (cell.q = 0; cell.q < rig_.columns(1); ++cell.q) sum += members(cell).clamped_mean();
        }
        sums[static_cast<std::size_t>(row)] = sum;
    });
    double sum = 0;
    for (const double s : sums) sum += s;
    return sum * rig_.cell_volume();
}

std::optional<LightField::Place> LightField::place_of(const V2d& on_s, const V2d& on_m) const {
    Place place;
    for (int axis = 0; axis < 2; ++axis) {
        const double x = rig_.intervals_to(axis, on_s[axis]);
        if (!(x >= 0 && x < rig_.intervals(axis))) return std::nullopt;
        place.interval[axis] = static_cast<int>(x);
        place.within[axis] = static_cast<float>(x - place.interval[axis]);
        const double overhang = rig_.overhang();
        const double p = rig_.columns_to(axis, place.interval[axis], on_m[axis]) - overhang;
        if (!(p >= -2 * overhang && p < rig_.columns(axis))) return std::nullopt;
        const double floor = std::floor(p);
        place.column[axis] = static_cast<int>(floor);
        place.upper[axis] = rig_.basis == PixelBasis::hat ? static_cast<float>(p - floor) : 0.0F;
    }
    return place;
}

float LightField::flux_density(const V2d& on_s, const V2d& on_m) const {
    float sum = 0;
    for_each_pixel(on_s, on_m, [&](const Cell& cell, float x, float y, float weight) {
        sum += weight * std::max(0.0F, members(cell).value(x, y));
    });
    return sum;
}

float LightField::approximate_radiance(const V2d& on_s, const V2d& on_m) const {
    const double here = rig_.slope(on_s, on_m);
    float sum = 0;
    for_each_pixel(on_s, on_m, [&](const Cell& cell, float x, float y, float weight) {
        const V2d pixel(
            rig_.m_coordinate.on_plane(rig_.column_edge_x(0, cell.n, cell.p) + 0.5 * rig_.pixel.x),
            rig_.m_coordinate.on_plane(rig_.column_edge_x(1, cell.o, cell.q) + 0.5 * rig_.pixel.y));
        BellCell scaled = members(cell);
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                // Filters beyond the first and last may lie outside the coordinate's range; their
                // coefficients are 0.
                if (scaled.e[i][j] == 0) continue;
                const V2d filter(rig_.filter(0, cell.n - 1 + i), rig_.filter(1, cell.o - 1 + j));
                const double g = rig_.geometric_term(filter, pixel);  // > 0 at finite positions
                scaled.e[i][j] =
                    static_cast<float>(double{scaled.e[i][j]} / g * (rig_.slope(filter, pixel) / here));
            }
        }
        sum += weight * std::max(0.0F, scaled.value(x, y));
    });
    return sum;
}

float LightField::over_exact(Reconstruction reconstruction, const V2d& on_s, const V2d& on_m) const {
    if (reconstruction == Reconstruction::exact) return 1;
    const float exact = radiance(on_s, on_m);
    return exact > 0 ? approximate_radiance(on_s, on_m) / exact : 0.0F;
}

float LightField::radiance(const V2d& on_s, const V2d& on_m) const {
    const float h = flux_density(on_s, on_m);
    if (!(h > 0)) return 0;  // also where g itself is 0: rays that pass M at infinity
    return static_cast<float>(double{h} / rig_.geometric_term(on_s, on_m));
}

double storage_scale(std::span<const float> coefficients) {
    constexpr int kLargestExponent = 10;  // 2^10 = 1024
    float largest = 0;
    for (const float e : coefficients) largest = std::max(largest, std::fabs(e));
    double scale = 1;
    for (int round = 0; round < 2 && largest > 0; ++round) {
        int exponent = 0;
        std::frexp(largest, &exponent);  // largest < 2^exponent
        scale = std::ldexp(1.0, exponent - kLargestExponent);
        largest = from_stored(stored_half(largest, scale), scale);  // rounding may give the next power of 2
    }
    return scale;
}

void add_planes(WordHash& hash, const Rig& rig) {
    for (int axis = 0; axis < 2; ++axis) {
        for (const int i : {rig.views[axis], rig.pixels[axis], rig.shift[axis]}) hash.add(i);
        hash.add(rig.spacing[axis]);
        hash.add(rig.pixel[axis]);
    }
    hash.add(rig.distance);
    // Uniform boxes add nothing here, so their hashes do not depend on these members.
    if (rig.s_coordinate.c != 0 || rig.m_coordinate.c != 0 || rig.basis != PixelBasis::box) {
        hash.add(rig.s_coordinate.c);
        hash.add(rig.m_coordinate.c);
        hash.add(static_cast<int>(rig.basis));
    }
    if (rig.filter_basis != FilterBasis::bell) hash.add(static_cast<int>(rig.filter_basis));
}

std::uint64_t content_hash(const LightField& field) {
    WordHash hash;
    add_planes(hash, field.rig());
    if (field.coloured()) {
        // Coloured fields already hold what a file holds.
        for (const float e : field.coefficients()) hash.add(e == 0 ? 0.0F : e);  // -0 hashes as 0
        for (const ColourChannels::Pair& pair : field.colour_channels().pairs) {
            hash.add(static_cast<int>(pair.x.bits()));
            hash.add(static_cast<int>(pair.z.bits()));
        }
        return hash.value();
    }
    const double scale = storage_scale(field.coefficients());
    for (const float e : field.coefficients()) {
        const float held = from_stored(stored_half(e, scale), scale);
        hash.add(held == 0 ? 0.0F : held);  // -0 hashes as 0
    }
    return hash.value();
}

}  // namespace lucerna
