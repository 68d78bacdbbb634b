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
    int interval[2];
    int column[2];
    float within[2];
    for (int axis = 0; axis < 2; ++axis) {
        const double x = (on_s[axis] - rig_.interval_edge(axis, 0)) / rig_.spacing[axis];
        if (!(x >= 0 && x < rig_.intervals(axis))) return std::nullopt;
        interval[axis] = static_cast<int>(x);
        within[axis] = static_cast<float>(x - interval[axis]);
        const double p = (on_m[axis] - rig_.column_edge(axis, interval[axis], 0)) / rig_.pixel[axis];
        if (!(p >= 0 && p < rig_.columns(axis))) return std::nullopt;
        column[axis] = static_cast<int>(p);
    }
    return Place{{interval[0], interval[1], column[0], column[1]}, {within[0], within[1]}};
}

float LightField::flux_density(const V2d& on_s, const V2d& on_m) const {
    const auto place = place_of(on_s, on_m);
    if (!place) return 0;
    return std::max(0.0F, members(place->cell).value(place->within[0], place->within[1]));
}

float LightField::approximate_radiance(const V2d& on_s, const V2d& on_m) const {
    const auto place = place_of(on_s, on_m);
    if (!place) return 0;
    const Cell& cell = place->cell;
    const V2d pixel(rig_.column_edge(0, cell.n, cell.p) + 0.5 * rig_.pixel.x,
                    rig_.column_edge(1, cell.o, cell.q) + 0.5 * rig_.pixel.y);
    BellCell scaled = members(cell);
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
            // Also of the filters before the first and after the last, whose coefficients are 0.
            const V2d filter(rig_.filter(0, cell.n - 1 + i), rig_.filter(1, cell.o - 1 + j));
            const double g = rig_.geometric_term(filter, pixel);  // > 0: the pixel lies at a finite place
            scaled.e[i][j] = static_cast<float>(double{scaled.e[i][j]} / g);
        }
    }
    return std::max(0.0F, scaled.value(place->within[0], place->within[1]));
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
