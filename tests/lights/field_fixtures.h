// Small light fields for tests, and integrals of them that share no code with the library.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/sampler.h"
#include "lights/light_field.h"

namespace lucerna::testing {

// Stores the lines that it receives.
class ListeningMonitor : public Monitor {
  public:
    void info(std::string_view line) override { infos.emplace_back(line); }
    void warn(std::string_view line) override { warnings.emplace_back(line); }
    std::vector<std::string> infos, warnings;
};

inline Rig rig_b() {  // the screen is stationary
    Rig rig;
    rig.views = {3, 2};
    rig.spacing = {0.01, 0.02};
    rig.pixels = {4, 5};
    rig.pixel = {0.03, 0.02};
    rig.distance = 0.08;
    rig.centre = {0.001, -0.002, 0.003};
    return rig;
}

inline Rig rig_a() {  // the sensor moves with the filter
    Rig rig = rig_b();
    rig.pixel = {0.01 / 2, 0.02 / 3};
    rig.shift = {2, 3};
    return rig;
}

inline Rig rig_c() {  // hats on M, both planes finer in the middle
    Rig rig = rig_b();
    rig.s_coordinate.c = 0.02;
    rig.m_coordinate.c = 0.05;
    rig.basis = PixelBasis::hat;
    return rig;
}

inline Rig rig_d() {  // canned, stationary pixels: hats on both planes
    Rig rig = rig_b();
    rig.filter_basis = FilterBasis::hat;
    rig.basis = PixelBasis::hat;
    return rig;
}

inline Rig rig_e() {  // canned, moving sensor: hats on S
    Rig rig = rig_a();
    rig.filter_basis = FilterBasis::hat;
    return rig;
}

inline std::vector<Rig> all_rigs() {
    return {rig_a(), rig_b(), rig_c(), rig_d(), rig_e()};
}

// Returns a field with random coefficients in [low, high].
inline LightField random_field(const Rig& rig, float low, float high, std::uint64_t seed,
                               LightFieldInfo info = {}) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    std::vector<float> e(rig.coefficients());
    for (float& x : e) x = low + (high - low) * sampler.next();
    return {rig, std::move(e), std::move(info)};
}

// Returns a Lambertian disc of radiance 1 on S. Each coefficient is the flux density at its filter and pixel,
// times the share of the filter's square that the disc covers. It is accurate to second order in the spacing
// and the pixel size.
inline LightField lambertian_disc(const Rig& rig, double radius, LightFieldInfo info = {}) {
    constexpr int kSteps = 16;
    std::vector<float> e(rig.coefficients());
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            const V2d at(rig.filter(0, m), rig.filter(1, n));
            double share = 0;
            for (int i = 0; i < kSteps * kSteps; ++i) {
                const V2d step((i % kSteps + 0.5) / kSteps - 0.5, (i / kSteps + 0.5) / kSteps - 0.5);
                share += (at + step * rig.spacing).length() < radius ? 1.0 / (kSteps * kSteps) : 0.0;
            }
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    const V2d sensor(rig.shift.x > 0 ? at.x : 0.0, rig.shift.y > 0 ? at.y : 0.0);
                    const V2d on_m = sensor + V2d((k + 0.5 - 0.5 * rig.pixels.x) * rig.pixel.x,
                                                  (l + 0.5 - 0.5 * rig.pixels.y) * rig.pixel.y);
                    e[rig.index(m, n, k, l)] = static_cast<float>(share * rig.geometric_term(at, on_m));
                }
            }
        }
    }
    return {rig, std::move(e), std::move(info)};
}

// Φ, implemented independently of the library.
inline double phi(double x) {
    x = std::fabs(x);
    return x <= 0.5 ? 1 - 2 * x * x : x <= 1 ? 2 * (1 - x) * (1 - x) : 0.0;
}

// The coordinates of PlaneCoordinate, implemented independently of the library, and their inverse by
// bisection.
inline double coordinate_of(const PlaneCoordinate& x, double s) {
    return x.c > 0 ? 2 * x.c * std::tan(0.5 * std::atan(s / x.c)) : s;
}
inline double place_of(const PlaneCoordinate& x, double at) {
    double low = -1, high = 1;  // metres; the tests stay within this range
    for (int i = 0; i < 100; ++i)
        (coordinate_of(x, 0.5 * (low + high)) < at ? low : high) = 0.5 * (low + high);
    return 0.5 * (low + high);
}
inline double slope_of(const PlaneCoordinate& x, double s) {
    const double step = 1e-6;
    return (coordinate_of(x, s + step) - coordinate_of(x, s - step)) / (2 * step);
}

// Computes h by its definition, a sum over all coefficients, in the coordinates of the planes: without the
// clamp, or with each pixel's sum clamped at 0.
inline double brute_h_of_coordinates(const LightField& field, const V2d& x_s, const V2d& x_m, bool clamped) {
    const Rig& rig = field.rig();
    double sum = 0;
    // A pixel is a place on M; with a moving sensor its place differs for each view.
    const auto chi = [&](double pixels) {
        if (rig.basis == PixelBasis::hat) return std::max(0.0, 1 - std::fabs(pixels));
        return pixels >= -0.5 && pixels < 0.5 ? 1.0 : 0.0;
    };
    const auto phi_or_hat = [&](double x) {
        return rig.filter_basis == FilterBasis::hat ? std::max(0.0, 1 - std::fabs(x)) : phi(x);
    };
    const V2i global(rig.pixels.x + rig.shift.x * rig.views.x, rig.pixels.y + rig.shift.y * rig.views.y);
    const V2d first(rig.shift.x > 0 ? -0.5 * (rig.views.x - 1) * rig.spacing.x : 0.0,
                    rig.shift.y > 0 ? -0.5 * (rig.views.y - 1) * rig.spacing.y : 0.0);
    for (int k = 0; k < global.x; ++k) {
        const double across = chi((x_m.x - first.x) / rig.pixel.x + 0.5 * rig.pixels.x - k - 0.5);
        if (across == 0) continue;
        for (int l = 0; l < global.y; ++l) {
            const double up = chi((x_m.y - first.y) / rig.pixel.y + 0.5 * rig.pixels.y - l - 0.5);
            if (up == 0) continue;
            double h = 0;
            for (int m = 0; m < rig.views.x; ++m) {
                for (int n = 0; n < rig.views.y; ++n) {
                    const int own_k = k - m * rig.shift.x, own_l = l - n * rig.shift.y;
                    if (own_k < 0 || own_l < 0 || own_k >= rig.pixels.x || own_l >= rig.pixels.y) continue;
                    h += phi_or_hat(x_s.x / rig.spacing.x - (m - (rig.views.x - 1) / 2.0)) *
                         phi_or_hat(x_s.y / rig.spacing.y - (n - (rig.views.y - 1) / 2.0)) *
                         double{field.coefficients()[rig.index(m, n, own_k, own_l)]};
                }
            }
            sum += across * up * (clamped ? std::max(0.0, h) : h);
        }
    }
    return sum;
}

// Returns the same density at places on the planes, per m⁴.
inline double brute_h(const LightField& field, const V2d& on_s, const V2d& on_m, bool clamped = false) {
    const Rig& rig = field.rig();
    double density = 1;
    V2d x_s, x_m;
    for (int a = 0; a < 2; ++a) {
        x_s[a] = coordinate_of(rig.s_coordinate, on_s[a]);
        x_m[a] = coordinate_of(rig.m_coordinate, on_m[a]);
        density *= slope_of(rig.s_coordinate, on_s[a]) * slope_of(rig.m_coordinate, on_m[a]);
    }
    return density * brute_h_of_coordinates(field, x_s, x_m, clamped);
}

// Radiance by the approximate reconstruction: each coefficient is divided by the geometric term of its
// filter's and its pixel's centres, in the planes' coordinates. It supports rigs with a stationary sensor;
// nothing is clamped.
class ApproximateRadiance {
  public:
    explicit ApproximateRadiance(const LightField& field) : field_(field) {
        const Rig& rig = field.rig();
        for (int a = 0; a < 2; ++a) {
            for (int m = 0; m < rig.views[a]; ++m)
                filters_[a].push_back(
                    centre(rig.s_coordinate, (m - 0.5 * (rig.views[a] - 1)) * rig.spacing[a]));
            for (int k = 0; k < rig.pixels[a]; ++k)
                pixels_[a].push_back(
                    centre(rig.m_coordinate, (k + 0.5 - 0.5 * rig.pixels[a]) * rig.pixel[a]));
        }
    }
    double operator()(const V2d& on_s, const V2d& on_m) const {
        const Rig& rig = field_.rig();
        std::vector<double> under[2], across[2];
        for (int a = 0; a < 2; ++a) {
            const double x = coordinate_of(rig.s_coordinate, on_s[a]);
            const double y = coordinate_of(rig.m_coordinate, on_m[a]);
            for (const Centre& c : filters_[a]) {
                const double at = (x - c.x) / rig.spacing[a];
                under[a].push_back(rig.filter_basis == FilterBasis::hat ? hat(at) : phi(at));
            }
            for (const Centre& c : pixels_[a]) {
                const double at = (y - c.x) / rig.pixel[a];
                across[a].push_back(rig.basis == PixelBasis::hat ? hat(at)
                                    : at >= -0.5 && at < 0.5     ? 1.0
                                                                 : 0.0);
            }
        }
        double sum = 0;
        for (std::size_t m = 0; m < under[0].size(); ++m) {
            for (std::size_t k = 0; k < across[0].size(); ++k) {
                if (under[0][m] * across[0][k] == 0) continue;
                for (std::size_t n = 0; n < under[1].size(); ++n) {
                    for (std::size_t l = 0; l < across[1].size(); ++l) {
                        const double basis = under[0][m] * across[0][k] * under[1][n] * across[1][l];
                        if (basis == 0) continue;
                        const Centre &u = filters_[0][m], &v = filters_[1][n], &s = pixels_[0][k],
                                     &t = pixels_[1][l];
                        const double r2 = sqr(s.place - u.place) + sqr(t.place - v.place) + sqr(rig.distance);
                        sum +=
                            basis * u.slope * v.slope * s.slope * t.slope * sqr(r2 / rig.distance) *
                            double{
                                field_.coefficients()[rig.index(static_cast<int>(m), static_cast<int>(n),
                                                                static_cast<int>(k), static_cast<int>(l))]};
                    }
                }
            }
        }
        return sum;
    }

  private:
    struct Centre {
        double x, place, slope;
    };
    static Centre centre(const PlaneCoordinate& coordinate, double x) {
        const double place = place_of(coordinate, x);
        return {x, place, slope_of(coordinate, place)};
    }
    static double hat(double x) { return std::max(0.0, 1 - std::fabs(x)); }

    const LightField& field_;
    std::vector<Centre> filters_[2], pixels_[2];
};

// Computes ∫∫∫∫ f h, clamped, by the midpoint rule in the planes' coordinates, with `s` points per interval
// and axis on S and `m` per pixel on M.
inline double integrate(const LightField& field, int s, int m,
                        const std::function<double(const V2d& on_s, const V2d& on_m)>& f) {
    const Rig& rig = field.rig();
    // Points along one axis, as coordinates and as places on the plane.
    struct Points {
        std::vector<double> x, place;
        double step;
    };
    const auto points = [](double span, int count, const PlaneCoordinate& coordinate) {
        Points p{{}, {}, span / count};
        for (int i = 0; i < count; ++i) {
            p.x.push_back(span * ((i + 0.5) / count - 0.5));
            p.place.push_back(place_of(coordinate, p.x.back()));
        }
        return p;
    };
    Points on_s[2], on_m[2];
    for (int a = 0; a < 2; ++a) {
        on_s[a] = points((rig.views[a] + 1) * rig.spacing[a], (rig.views[a] + 1) * s, rig.s_coordinate);
        // M extends over all sensors and the overhang of the hats.
        const int more = (rig.shift[a] > 0 ? rig.shift[a] * (rig.views[a] - 1) : 0) +
                         (rig.basis == PixelBasis::hat ? 1 : 0);
        on_m[a] = points((rig.pixels[a] + more) * rig.pixel[a], (rig.pixels[a] + more) * m, rig.m_coordinate);
    }
    double sum = 0;
    for (std::size_t i = 0; i < on_s[0].x.size(); ++i) {
        for (std::size_t j = 0; j < on_s[1].x.size(); ++j) {
            for (std::size_t p = 0; p < on_m[0].x.size(); ++p) {
                for (std::size_t q = 0; q < on_m[1].x.size(); ++q) {
                    const double h = brute_h_of_coordinates(field, {on_s[0].x[i], on_s[1].x[j]},
                                                            {on_m[0].x[p], on_m[1].x[q]}, true);
                    if (h > 0)
                        sum +=
                            h * f({on_s[0].place[i], on_s[1].place[j]}, {on_m[0].place[p], on_m[1].place[q]});
                }
            }
        }
    }
    return sum * on_s[0].step * on_s[1].step * on_m[0].step * on_m[1].step;
}

}  // namespace lucerna::testing
