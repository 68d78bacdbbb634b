#include "lights/light_field.h"

#include <bit>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/files.h"

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
        return "a centre not finite";
    const double volume = cell_volume();
    if (!std::isfinite(1 / volume) || !(volume > 0))
        return "lengths whose product leaves the range of numbers";
    return {};
}

std::string Rig::fault_of_basis() const {
    for (int axis = 0; axis < 2; ++axis) {
        const bool even = s_coordinate.c == 0 && m_coordinate.c == 0;
        if (shift[axis] != 0 && (!even || basis != PixelBasis::box))
            return "a sensor that moves, and pixels that are not even boxes";
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
        throw InputError(fmt::format("light field: {} coefficients where the geometry has {}",
                                     coefficients_.size(), rig_.coefficients()));
    }
    for (std::size_t i = 0; i < coefficients_.size(); ++i) {
        if (std::isfinite(coefficients_[i])) continue;
        const auto per_view =
            static_cast<std::size_t>(rig_.pixels.x) * static_cast<std::size_t>(rig_.pixels.y);
        const auto h = static_cast<std::size_t>(rig_.views.y);
        const auto t = static_cast<std::size_t>(rig_.pixels.y);
        throw InputError(fmt::format(
            "light field: coefficient {} in view ({}, {}), pixel ({}, {}); finite numbers are "
            "accepted",
            coefficients_[i], i / per_view / h, i / per_view % h, i % per_view / t, i % per_view % t));
    }
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

template <typename Value>
float LightField::reconstruct(const Place& place, Value&& value) const {
    float sum = 0;
    for (int a = 0; a < 2; ++a) {
        const float across = a == 0 ? 1 - place.upper[0] : place.upper[0];
        if (!(across > 0)) continue;
        for (int b = 0; b < 2; ++b) {
            const float weight = across * (b == 0 ? 1 - place.upper[1] : place.upper[1]);
            if (!(weight > 0)) continue;
            sum += weight * std::max(0.0F, value(Cell{place.interval[0], place.interval[1],
                                                      place.column[0] + a, place.column[1] + b}));
        }
    }
    return sum;
}

float LightField::flux_density(const V2d& on_s, const V2d& on_m) const {
    const auto place = place_of(on_s, on_m);
    if (!place) return 0;
    const float density = reconstruct(
        *place, [&](const Cell& cell) { return members(cell).value(place->within[0], place->within[1]); });
    return static_cast<float>(double{density} * rig_.slope(on_s, on_m));
}

float LightField::approximate_radiance(const V2d& on_s, const V2d& on_m) const {
    const auto place = place_of(on_s, on_m);
    if (!place) return 0;
    return reconstruct(*place, [&](const Cell& cell) {
        const V2d pixel(
            rig_.m_coordinate.on_plane(rig_.column_edge_x(0, cell.n, cell.p) + 0.5 * rig_.pixel.x),
            rig_.m_coordinate.on_plane(rig_.column_edge_x(1, cell.o, cell.q) + 0.5 * rig_.pixel.y));
        BellCell scaled = members(cell);
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                // Filters before the first and after the last have no place in every coordinate.
                if (scaled.e[i][j] == 0) continue;
                const V2d filter(rig_.filter(0, cell.n - 1 + i), rig_.filter(1, cell.o - 1 + j));
                const double g = rig_.geometric_term(filter, pixel);  // > 0: the pixel lies at a finite place
                scaled.e[i][j] = static_cast<float>(double{scaled.e[i][j]} * rig_.slope(filter, pixel) / g);
            }
        }
        return scaled.value(place->within[0], place->within[1]);
    });
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
        largest = from_stored(stored_half(largest, scale), scale);  // may have become a power of 2
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
    // Fields of even boxes have the names that they had when there were no others.
    if (rig.s_coordinate.c != 0 || rig.m_coordinate.c != 0 || rig.basis != PixelBasis::box) {
        hash.add(rig.s_coordinate.c);
        hash.add(rig.m_coordinate.c);
        hash.add(static_cast<int>(rig.basis));
    }
}

std::uint64_t content_hash(const LightField& field) {
    WordHash hash;
    add_planes(hash, field.rig());
    const double scale = storage_scale(field.coefficients());
    for (const float e : field.coefficients()) {
        const float held = from_stored(stored_half(e, scale), scale);
        hash.add(held == 0 ? 0.0F : held);  // one zero
    }
    return hash.value();
}

}  // namespace lucerna
