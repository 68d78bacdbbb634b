#include "lights/photometric.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/base/sampler.h"
#include "lights/gauss.h"
#include "lights/photometric_cell.h"
#include "tests/support/error_of.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace photometric_test {

using testing::chi_square;
using testing::error_of;
using ::testing::HasSubstr;

double radians(double degrees) {
    return degrees * kPiD / 180;
}

// Returns a grid with uneven angles, without symmetry, and with dark entries.
PhotometricGrid rough_grid(PhotometricPlanes planes, std::uint64_t seed = 5) {
    PhotometricGrid grid{planes, {}, {}, {}};
    const bool c = planes == PhotometricPlanes::c;
    grid.polar = c ? std::vector<double>{0, 7, 20, 45, 80, 90, 130, 180}
                   : std::vector<double>{30, 41, 60, 75, 90, 100, 128, 150};
    grid.azimuth = c ? std::vector<double>{0, 30, 90, 110, 200, 290, 360}
                     : std::vector<double>{-60, -42, -10, 0, 15, 44, 70};
    Sampler s(seed, Purpose::test, 0, 0);
    for (std::size_t i = 0; i < grid.polar.size() * grid.azimuth.size(); ++i)
        grid.candela.push_back(i % 11 == 3 ? 0.0F : 100 * s.next());
    if (c) std::copy_n(grid.candela.begin(), 8, grid.candela.end() - 8);  // 360° equals 0°
    return grid;
}

// Integrates f over a box of the grid's own coordinates, in degrees, by a fine midpoint rule.
template <typename F>
double by_midpoints(double polar0, double polar1, double azimuth0, double azimuth1, int steps, F&& f) {
    const double dp = (polar1 - polar0) / steps, da = (azimuth1 - azimuth0) / steps;
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        const double polar = polar0 + (i + 0.5) * dp;
        for (int j = 0; j < steps; ++j) sum += f(polar, azimuth0 + (j + 0.5) * da) * std::sin(radians(polar));
    }
    return sum * radians(dp) * radians(da);
}

// Returns intensities f(γ, C), angles in degrees.
template <typename F>
PhotometricWeb web_of(F&& f) {
    PhotometricGrid grid{PhotometricPlanes::c, {}, {0, 90, 180, 270, 360}, {}};
    for (int i = 0; i <= 360; ++i) grid.polar.push_back(0.5 * i);
    for (const double c : grid.azimuth) {
        for (const double gamma : grid.polar) grid.candela.push_back(static_cast<float>(f(gamma, c)));
    }
    return PhotometricWeb(grid);
}

TEST(PhotometricWeb, Beam_IsBetweenTheOutermostDirectionsAtItsShareOfThePeak) {
    const auto cosine_power = [](double n) {
        return web_of([n](double gamma, double) {
            return gamma < 90 ? 50 * std::pow(std::cos(radians(gamma)), n) : 0.0;
        });
    };
    const auto angle = [](double share, double n) {
        return 2 * std::acos(std::pow(share, 1 / n)) / radians(1);
    };
    for (const double n : {1.0, 4.0, 100.0}) {
        const Beam beam = beam_of(cosine_power(n));
        EXPECT_FLOAT_EQ(static_cast<float>(beam.peak), 50);
        EXPECT_NEAR(beam.brightest.z, 1, 1e-12);
        for (const std::size_t plane : {0U, 1U}) {
            EXPECT_NEAR(beam.beam_angle[plane], angle(0.5, n), 0.1);
            EXPECT_NEAR(beam.field_angle[plane], angle(0.1, n), 0.1);
        }
    }
    const Beam all_around = beam_of(web_of([](double, double) { return 7.0; }));
    EXPECT_EQ(all_around.beam_angle[0], 360);
    const Beam up =
        beam_of(web_of([](double gamma, double) { return gamma > 90 ? -std::cos(radians(gamma)) : 0.0; }));
    EXPECT_NEAR(up.beam_angle[0], 120, 0.1);
    const Beam both_ways = beam_of(web_of([](double gamma, double) {
        const double cosine = std::cos(radians(gamma));
        return cosine > 0 ? 100 * cosine : -80 * cosine;
    }));
    EXPECT_NEAR(both_ways.beam_angle[0], 120, 0.1) << "the light upwards is another beam";
    EXPECT_NEAR(both_ways.field_angle[0], angle(0.1, 1), 0.1);
    const Beam bulb = beam_of(
        web_of([](double gamma, double) { return 1 + std::cos(radians(gamma)); }));  // 50 % at 90 degrees
    EXPECT_NEAR(bulb.beam_angle[0], 180, 0.1);
    EXPECT_NEAR(bulb.field_angle[0], 2 * std::acos(-0.8) / radians(1), 0.1);
    // Two wings at 40° in the plane C0-C180; half as bright at 30° on one side of the other plane.
    const Beam wings = beam_of(web_of([](double gamma, double c) {
        const double middle = c == 90 ? 30 : 40, peak = c == 0 || c == 180 || c == 360 ? 100
                                                        : c == 90                      ? 60
                                                                                       : 0;
        return peak * std::max(0.0, 1 - std::fabs(gamma - middle) / 10);
    }));
    EXPECT_NEAR(wings.beam_angle[0], 2 * 45, 1e-3);
    EXPECT_NEAR(wings.field_angle[0], 2 * 49, 1e-3);
    EXPECT_NEAR(wings.beam_angle[1], 2 * 10 * (1 - 50.0 / 60), 1e-3) << "on one side of the axis";
    EXPECT_NEAR(wings.brightest.x, std::sin(radians(40)), 1e-6);
}

constexpr PhotometricPlanes kAllPlanes[] = {PhotometricPlanes::c, PhotometricPlanes::b, PhotometricPlanes::a};

TEST(PhotometricWeb, Directions_FollowTheStandardsConventions) {
    const auto direction = [](PhotometricPlanes planes, double polar, double azimuth) {
        return PhotometricWeb(rough_grid(planes)).direction(polar, azimuth);
    };
    const auto near = [](const V3d& a, const V3d& b) { return (a - b).length() < 1e-12; };
    using P = PhotometricPlanes;
    EXPECT_TRUE(near(direction(P::c, 0, 0), V3d(0, 0, 1))) << "nadir";
    EXPECT_TRUE(near(direction(P::c, 90, 0), V3d(1, 0, 0)));
    EXPECT_TRUE(near(direction(P::c, 90, 90), V3d(0, -1, 0))) << "counterclockwise from above";
    // The grid's polar angle is 90 + H or 90 + V.
    EXPECT_TRUE(near(direction(P::b, 90, 0), V3d(0, 0, 1))) << "nadir";
    EXPECT_TRUE(near(direction(P::b, 90, 90), V3d(1, 0, 0))) << "photometric horizontal";
    EXPECT_TRUE(near(direction(P::b, 180, 0), V3d(0, 1, 0))) << "H = 90: clockwise from above";
    EXPECT_TRUE(near(direction(P::a, 90, 0), V3d(1, 0, 0))) << "photometric horizontal";
    EXPECT_TRUE(near(direction(P::a, 0, 0), V3d(0, 0, 1))) << "V = -90: nadir";
    EXPECT_TRUE(near(direction(P::a, 90, 90), V3d(0, 1, 0)));
}

TEST(PhotometricWeb, Intensity_IsTheTableAtItsPointsAndBilinearBetween) {
    for (const PhotometricPlanes planes : kAllPlanes) {
        const PhotometricGrid grid = rough_grid(planes);
        const PhotometricWeb web(grid);
        for (std::size_t j = 0; j + 1 < grid.azimuth.size(); ++j) {
            for (std::size_t i = 0; i + 1 < grid.polar.size(); ++i) {
                if (grid.polar[i] > 0) {  // at a pole all planes share one direction
                    EXPECT_NEAR(web.intensity(web.direction(grid.polar[i], grid.azimuth[j])),
                                double{grid.at(j, i)}, 1e-6 * web.peak());
                }
                const double polar = 0.25 * grid.polar[i] + 0.75 * grid.polar[i + 1];
                const double azimuth = 0.5 * (grid.azimuth[j] + grid.azimuth[j + 1]);
                const double low = 0.5 * (double{grid.at(j, i)} + double{grid.at(j + 1, i)});
                const double high = 0.5 * (double{grid.at(j, i + 1)} + double{grid.at(j + 1, i + 1)});
                EXPECT_NEAR(web.intensity(web.direction(polar, azimuth)), 0.25 * low + 0.75 * high,
                            1e-6 * web.peak());
            }
        }
    }
}

TEST(PhotometricWeb, BeyondTheGrid_IsDark) {
    const PhotometricWeb web(rough_grid(PhotometricPlanes::b));
    EXPECT_EQ(web.intensity(web.direction(20, 0)), 0);
    EXPECT_EQ(web.intensity(web.direction(90, 80)), 0);
    EXPECT_EQ(web.intensity(web.direction(90, 200)), 0);
    EXPECT_GT(web.intensity(web.direction(90, 69.9)), 0);
}

TEST(PhotometricWeb, Flux_IsTheIntegralOfTheInterpolant) {
    for (const PhotometricPlanes planes : kAllPlanes) {
        const PhotometricGrid grid = rough_grid(planes);
        const PhotometricWeb web(grid);
        double sum = 0;
        for (std::size_t i = 0; i + 1 < grid.polar.size(); ++i) {
            for (std::size_t j = 0; j + 1 < grid.azimuth.size(); ++j) {
                sum += by_midpoints(grid.polar[i], grid.polar[i + 1], grid.azimuth[j], grid.azimuth[j + 1],
                                    60, [&](double polar, double azimuth) {
                                        return web.intensity(web.direction(polar, azimuth));
                                    });
            }
        }
        EXPECT_NEAR(web.flux() / sum, 1, 1e-4);
    }
}

TEST(PhotometricWeb, EvenIntensity_HasFourPiOfFlux) {
    const PhotometricWeb web({PhotometricPlanes::c, {0, 180}, {0, 360}, std::vector<float>(4, 7.0F)});
    EXPECT_NEAR(web.flux(), 4 * kPiD * 7, 1e-12 * web.flux());
}

TEST(PhotometricWeb, LambertianTable_HasPiOfFlux) {
    PhotometricGrid grid{PhotometricPlanes::c, {}, {0, 360}, {}};
    for (int i = 0; i <= 90; ++i) grid.polar.push_back(i);
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i <= 90; ++i) grid.candela.push_back(static_cast<float>(std::cos(radians(i))));
    }
    EXPECT_NEAR(PhotometricWeb(grid).flux(), kPiD, 3e-5 * kPiD) << "1 degree: of second order in the step";
}

TEST(PolarStep, Integrals_EqualQuadratureInWideAndThinSteps) {
    for (const double width : {1.5, 0.3, 0.01, 1e-5}) {
        for (const double from : {0.0, 1e-6, 0.7, 1.6}) {
            const PolarStep step{from, width};
            for (const double t : {0.3, 1.0}) {
                double solid = 0, rising = 0;
                for (int piece = 0; piece < 8; ++piece) {
                    for (const GaussNode& node : gauss_rule(5)) {
                        const double x = (piece + node.x) / 8 * t;
                        const double light = node.weight / 8 * t * width * std::sin(from + x * width);
                        solid += light, rising += x * light;
                    }
                }
                EXPECT_NEAR(step.solid(t) / solid, 1, 1e-9) << from << ", " << width;
                EXPECT_NEAR(step.rising(t) / rising, 1, 1e-7) << from << ", " << width;
            }
        }
    }
}

struct Histogram {
    std::vector<std::uint64_t> counts;
    std::vector<double> expected;
};

// Counts draws in bins that do not align with the grid, and integrates the intensity over each bin.
Histogram histogram(const PhotometricWeb& drawn_from, const PhotometricWeb& expected_of, int draws) {
    constexpr int kSteps = 12;
    Histogram h;
    h.counts.resize(kSteps * kSteps);
    Sampler s(17, Purpose::test, 0, 0);
    for (int i = 0; i < draws; ++i) {
        const auto drawn = drawn_from.draw(s.next2());
        if (!drawn) continue;
        const V3d w(drawn->w);
        const double theta = std::acos(std::clamp(w.z, -1.0, 1.0)), phi = std::atan2(w.y, w.x);
        const auto row = std::min(static_cast<int>(theta / kPiD * kSteps), kSteps - 1);
        const auto column = std::min(static_cast<int>((phi / kPiD + 1) / 2 * kSteps), kSteps - 1);
        ++h.counts[static_cast<std::size_t>(row * kSteps + column)];
    }
    for (int row = 0; row < kSteps; ++row) {
        for (int column = 0; column < kSteps; ++column) {
            const double part =
                by_midpoints(180.0 * row / kSteps, 180.0 * (row + 1) / kSteps, 360.0 * column / kSteps - 180,
                             360.0 * (column + 1) / kSteps - 180, 60, [&](double polar, double azimuth) {
                                 const double t = radians(polar), p = radians(azimuth);
                                 return expected_of.intensity(
                                     {std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)});
                             });
            h.expected.push_back(part / expected_of.flux() * draws);
        }
    }
    return h;
}

TEST(PhotometricWeb, Draw_FollowsTheIntensity) {
    for (const PhotometricPlanes planes : kAllPlanes) {
        const PhotometricWeb web(rough_grid(planes));
        const Histogram h = histogram(web, web, 40'000);
        EXPECT_TRUE(chi_square(h.counts, h.expected).accepted());
    }
}

TEST(PhotometricWeb, Draw_OfAnotherLamp_IsRejected) {
    PhotometricGrid brighter = rough_grid(PhotometricPlanes::c);
    for (std::size_t i = 0; i < brighter.candela.size(); i += 2) brighter.candela[i] *= 1.3F;
    const PhotometricWeb web(rough_grid(PhotometricPlanes::c));
    const Histogram h = histogram(PhotometricWeb(brighter), web, 40'000);
    EXPECT_FALSE(chi_square(h.counts, h.expected).accepted());
}

TEST(PhotometricWeb, Draw_TellsItsDensityAndIntensity) {
    const PhotometricWeb web(rough_grid(PhotometricPlanes::c));
    Sampler s(3, Purpose::test, 0, 0);
    for (int i = 0; i < 1000; ++i) {
        const auto drawn = web.draw(s.next2());
        ASSERT_TRUE(drawn);
        const double value = web.intensity(V3d(drawn->w));
        EXPECT_NEAR(double{drawn->value.x}, value, 2e-4 * web.peak());
        EXPECT_NEAR(double{drawn->pdf_w}, double{drawn->value.x} / web.flux(), 1e-6);
    }
}

TEST(PhotometricWeb, Dark_DrawsNothing) {
    const PhotometricWeb web({PhotometricPlanes::c, {0, 90}, {0, 360}, std::vector<float>(4)});
    EXPECT_FALSE(web.draw({0.5F, 0.5F}));
    EXPECT_EQ(web.flux(), 0);
}

TEST(PhotometricWeb, Resampled_OnItsOwnGrid_IsTheSame) {
    PhotometricGrid grid{PhotometricPlanes::c, {}, {}, {}};
    Sampler s(8, Purpose::test, 0, 0);
    for (int i = 0; i <= 180; i += 30) grid.polar.push_back(i);
    for (int j = 0; j <= 360; j += 45) grid.azimuth.push_back(j);
    for (std::size_t i = 0; i < 9 * 7; ++i) grid.candela.push_back(s.next());
    for (std::size_t j = 0; j < 9; ++j) grid.candela[7 * j] = 1, grid.candela[7 * j + 6] = 2;  // poles
    std::copy_n(grid.candela.begin(), 7, grid.candela.end() - 7);
    const PhotometricWeb web(grid), again = resampled({web}, 30, 45);
    for (std::size_t i = 0; i < grid.candela.size(); ++i)
        EXPECT_NEAR(again.grid().candela[i], grid.candela[i], 1e-6F) << i;
    EXPECT_THAT(error_of([&] { resampled({web}, 7, 45); }), HasSubstr("step of 7 degrees"));
}

TEST(PhotometricWeb, NoGrid_IsRefusedWithTheCause) {
    const auto refusal = [](PhotometricGrid grid) {
        return error_of([&] { PhotometricWeb{std::move(grid)}; });
    };
    const PhotometricGrid good{PhotometricPlanes::c, {0, 90}, {0, 360}, std::vector<float>(4)};
    EXPECT_EQ(refusal(good), "no error");
    PhotometricGrid bad = good;
    bad.polar = {0, 200};
    EXPECT_THAT(refusal(bad), HasSubstr("0 to 180"));
    bad = good, bad.azimuth = {0, 361};
    EXPECT_THAT(refusal(bad), HasSubstr("360"));
    bad = good, bad.polar = {90, 0};
    EXPECT_THAT(refusal(bad), HasSubstr("ascending"));
    bad = good, bad.candela[1] = -1;
    EXPECT_THAT(refusal(bad), HasSubstr("-1 cd"));
    bad = good, bad.candela[1] = NAN;
    EXPECT_THAT(refusal(bad), HasSubstr("nan"));
    bad = good, bad.candela.pop_back();
    EXPECT_THAT(refusal(bad), HasSubstr("3 intensities for 2 x 2"));
}

TEST(PhotometricLight, EmitsItsFluxAndLightsByIntensityOverDistanceSquared) {
    const auto web = std::make_shared<const PhotometricWeb>(rough_grid(PhotometricPlanes::c));
    // The lamp's z axis points along -y, its x axis along -z.
    const LightAxes axes{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}};
    const V3f at(0.5F, 2, 1);
    const auto light = make_photometric_light("ies", web, {at, axes}, Rgb(2, 1, 0.5F));
    EXPECT_EQ(light->unit(), FluxUnit::lumen);
    EXPECT_EQ(light->kind(), "ies");
    EXPECT_NEAR(double{light->flux().y}, web->flux(), 1e-5 * web->flux());
    const auto emitted = light->sample_Le({{0.3F, 0.6F}, {0.2F, 0.7F}, 1});
    ASSERT_TRUE(emitted);
    EXPECT_NEAR(double{emitted->weight.x}, 2 * web->flux(), 1e-4 * web->flux()) << "all photons alike";
    const V3d local = web->direction(40, 70);
    const V3d world = local.x * V3d(axes.x) + local.y * V3d(axes.y) + local.z * V3d(axes.z);
    const auto light_sample = light->sample_Li(at + V3f(3.0 * world), {0.5F, 0.5F});
    ASSERT_TRUE(light_sample);
    EXPECT_NEAR(double{light_sample->weight.y}, web->intensity(local) / 9, 1e-4 * web->peak());
    EXPECT_NEAR((light_sample->w + V3f(world)).length(), 0, 1e-5F);
}

}  // namespace photometric_test
}  // namespace lucerna
