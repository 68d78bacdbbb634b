// Free flights through media, against closed forms and quadrature.
#include "engine/scene/media_traversal.h"

#include <gtest/gtest.h>

#include <array>

#include "engine/base/stats.h"
#include "tests/support/media.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace flight_test {

using testing::agrees;

const Ray kAlongX{{-1, 0.4F, 0.6F}, {1, 0, 0}};
const V3d kLow(0, 0, 0), kHigh(2, 1, 1);  // crossed from t = 1 to t = 3

using Colour = std::array<RunningStats, 3>;

void add(Colour& stats, const Rgb& value) {
    for (int k = 0; k < 3; ++k) stats[static_cast<std::size_t>(k)].add(static_cast<double>(value[k]));
}

Colour transmitted(const SceneMedia& media, int samples) {
    Colour stats;
    Sampler sampler(1, Purpose::test, 0, 0);
    for (int i = 0; i < samples; ++i)
        add(stats, transmittance(MediaAlong(media, kNoMedium, kAlongX, 10), sampler));
    return stats;
}

// Means over flights: the light that reaches the end, that is emitted, and that scatters before t = `before`.
struct Flights {
    Colour passed, emitted, scattered;
};
Flights flown(const SceneMedia& media, int samples, const Rgb& throughput = Rgb(1),
              double before = INFINITY) {
    Flights flights;
    for (int i = 0; i < samples; ++i) {
        Sampler sampler(1, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const Flight flight = fly(MediaAlong(media, kNoMedium, kAlongX, 10), throughput, sampler);
        add(flights.passed, flight.scattered ? Rgb(0) : flight.throughput);
        add(flights.scattered, flight.scattered && flight.t < before ? flight.throughput : Rgb(0));
        add(flights.emitted, flight.emitted);
    }
    return flights;
}

TEST(Transmittance, HomogeneousSlab_IsBeersLawExactly) {
    const auto media =
        testing::regions({testing::in_box(testing::homogeneous({0.1F, 0.5F, 2}, {0.2F, 0, 1}), kLow, kHigh)});
    Sampler sampler(1, Purpose::test, 0, 0);
    const Rgb passing = transmittance(MediaAlong(media, kNoMedium, kAlongX, INFINITY), sampler);
    EXPECT_NEAR(passing.x, std::exp(-0.6), 1e-6);
    EXPECT_NEAR(passing.y, std::exp(-1.0), 1e-6);
    EXPECT_NEAR(passing.z, std::exp(-6.0), 1e-8);
}

TEST(Transmittance, UnboundedMediumToInfinity_IsZeroWhereItAbsorbsAndOneWhereItDoesNot) {
    SceneMedia media;
    media.all.push_back(testing::homogeneous({0.1F, 0, 0}, Rgb(0)));
    Sampler sampler(1, Purpose::test, 0, 0);
    EXPECT_EQ(transmittance(MediaAlong(media, 0, kAlongX, INFINITY), sampler), Rgb(0, 1, 1));
    EXPECT_EQ(transmittance(MediaAlong(media, kNoMedium, kAlongX, INFINITY), sampler), Rgb(1, 1, 1));
}

// The density rises linearly from 0 to 1 over the box, constant in its outer half cells: its mean is 1/2 for
// any number of cells.
TEST(Transmittance, LinearGrid_AgreesWithTheClosedFormAndNotWithAnother) {
    const auto media = testing::regions(
        {testing::rising_along_x(testing::homogeneous({0.3F, 1, 2}, {0, 0.5F, 0.2F}), kLow, kHigh, 16)});
    const Colour stats = transmitted(media, 200'000);
    const double sigma_t[] = {0.3, 1.5, 2.2};
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_TRUE(agrees(stats[k], std::exp(-sigma_t[k]))) << k << ' ' << stats[k].mean();
        EXPECT_FALSE(agrees(stats[k], std::exp(-1.02 * sigma_t[k]))) << k;
    }
}

TEST(Transmittance, Exponential_AgreesWithTheClosedForm) {
    Medium medium = testing::in_box(testing::homogeneous(Rgb(0.2F), Rgb(0.4F)), kLow, kHigh);
    medium.density = ExponentialDensity{3, 2, V3d(1, 0, 0), kLow};
    const Colour stats = transmitted(testing::regions({medium}), 200'000);
    const double depth = 0.6 * 3 * (1 - std::exp(-4.0)) / 2;
    EXPECT_TRUE(agrees(stats[0], std::exp(-depth))) << stats[0].mean();
    EXPECT_FALSE(agrees(stats[0], std::exp(-1.02 * depth)));
}

TEST(Transmittance, DenseGrid_IsUnbiasedThroughRoulette) {
    const auto media =
        testing::regions({testing::even_grid(testing::homogeneous(Rgb(1.5F), Rgb(0)), kLow, kHigh, 2)});
    const Colour stats = transmitted(media, 200'000);
    EXPECT_TRUE(agrees(stats[0], std::exp(-6.0))) << stats[0].mean();
    EXPECT_FALSE(agrees(stats[0], std::exp(-6.0) * 1.5));
}

// One distance is sampled for three channels of very different extinction.
TEST(Flight, ColouredSlab_PassesAndScattersAsTheFormulaSays) {
    const Rgb sigma_a(0.1F, 1, 0), sigma_s(0.3F, 2, 0.02F), throughput(0.2F, 1, 3);
    const auto media =
        testing::regions({testing::in_box(testing::homogeneous(sigma_a, sigma_s), kLow, kHigh)});
    const Flights flights = flown(media, 200'000, throughput, 1.7);
    for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const double s = static_cast<double>(sigma_s[k]), sigma_t = s + static_cast<double>(sigma_a[k]);
        const double begin = static_cast<double>(throughput[k]);
        EXPECT_TRUE(agrees(flights.passed[at], begin * std::exp(-2 * sigma_t))) << k;
        EXPECT_TRUE(agrees(flights.scattered[at], begin * s / sigma_t * (1 - std::exp(-0.7 * sigma_t)))) << k;
        EXPECT_FALSE(
            agrees(flights.scattered[at], 1.04 * begin * s / sigma_t * (1 - std::exp(-0.7 * sigma_t))));
    }
}

TEST(Flight, AnyThroughput_GrowsToNoMoreThanItsSum) {
    const auto media =
        testing::regions({testing::in_box(testing::homogeneous(Rgb(0), {0.01F, 1, 30}), kLow, kHigh)});
    for (std::uint64_t i = 0; i < 20'000; ++i) {
        Sampler sampler(2, Purpose::test, 0, i);
        const Flight flight = fly(MediaAlong(media, kNoMedium, kAlongX, 10), {1, 2, 3}, sampler);
        ASSERT_LE(max_component(flight.throughput), 6.0001F);
        ASSERT_TRUE(is_finite(flight.throughput));
    }
}

// A uniform region, a linear grid and an exponential density overlap; the truth is by quadrature.
TEST(Flight, OverlappingMedia_AddUp) {
    Medium haze = testing::in_box(testing::homogeneous({0.1F, 0.2F, 0.3F}, {0.3F, 0.1F, 0.4F}), {0.5, -1, -1},
                                  {4, 2, 2});
    haze.emission = Rgb(0.2F, 0, 0.1F);
    Medium grid =
        testing::rising_along_x(testing::homogeneous({0.5F, 0, 0.1F}, {0.4F, 1, 2}), kLow, kHigh, 12);
    grid.emission = Rgb(0, 1, 0.5F);
    Medium fog = testing::in_box(testing::homogeneous(Rgb(0.1F), Rgb(0.2F)), {1, 0, 0}, {3, 1, 1});
    fog.density = ExponentialDensity{2, 1.5, V3d(1, 0, 0), V3d(1, 0, 0)};
    const auto density = [](int medium, double x) {  // x = t - 1
        if (medium == 0) return x > 0.5 && x < 4 ? 1.0 : 0.0;
        if (medium == 1) return x > 0 && x < 2 ? std::clamp(x / 2, 0.5 / 12, 11.5 / 12) : 0.0;
        return x > 1 && x < 3 ? 2 * std::exp(-1.5 * (x - 1)) : 0.0;
    };
    const Medium* const list[] = {&haze, &grid, &fog};
    const auto sum = [&](double x, int k, auto member) {
        double result = 0;
        for (int m = 0; m < 3; ++m) result += density(m, x) * static_cast<double>(((*list[m]).*member)[k]);
        return result;
    };
    const Flights flights = flown(testing::regions({haze, grid, fog}), 300'000, Rgb(1), 2.5);
    constexpr int kSteps = 200'000;
    for (int k = 0; k < 3; ++k) {
        double depth = 0, scattered = 0, emitted = 0;
        for (int i = 0; i < kSteps; ++i) {
            const double dx = 5.0 / kSteps, x = (i + 0.5) * dx;
            const double sigma_s = sum(x, k, &Medium::sigma_s),
                         sigma_t = sigma_s + sum(x, k, &Medium::sigma_a);
            const double here = std::exp(-depth - sigma_t * dx / 2);
            if (x < 1.5) scattered += here * sigma_s * dx;
            emitted += here * sum(x, k, &Medium::emission) * dx;
            depth += sigma_t * dx;
        }
        const auto at = static_cast<std::size_t>(k);
        EXPECT_TRUE(agrees(flights.passed[at], std::exp(-depth))) << k;
        EXPECT_TRUE(agrees(flights.scattered[at], scattered)) << k;
        EXPECT_TRUE(agrees(flights.emitted[at], emitted))
            << k << ' ' << flights.emitted[at].mean() << ' ' << emitted;
        EXPECT_FALSE(agrees(flights.scattered[at], 1.05 * scattered)) << k;
    }
    EXPECT_FALSE(agrees(flights.emitted[1], 1.05 * flights.emitted[1].mean()));
}

TEST(Flight, ChosenMedium_TurnsLightInProportionToWhatItScatters) {
    Medium forward = testing::in_box(testing::homogeneous(Rgb(0), {3, 1, 0}, 0.5F), kLow, kHigh);
    Medium back = testing::in_box(testing::homogeneous(Rgb(0), {1, 1, 2}, -0.5F), kLow, kHigh);
    const auto media = testing::regions({forward, back});
    Colour by_forward, all;
    for (std::uint64_t i = 0; i < 100'000; ++i) {
        Sampler sampler(3, Purpose::test, 0, i);
        const Flight flight = fly(MediaAlong(media, kNoMedium, kAlongX, 10), Rgb(1), sampler);
        add(all, flight.scattered ? flight.throughput : Rgb(0));
        add(by_forward, flight.scattered && flight.g > 0 ? flight.throughput : Rgb(0));
    }
    const double share[] = {0.75, 0.5, 0}, sigma_t[] = {4, 2, 2};
    for (std::size_t k = 0; k < 3; ++k) {
        const double scattered = 1 - std::exp(-2 * sigma_t[k]);
        EXPECT_TRUE(agrees(all[k], scattered)) << k;
        EXPECT_TRUE(agrees(by_forward[k], share[k] * scattered)) << k;
    }
}

TEST(Flight, PureEmission_IsFoundWhereNothingCollides) {
    Medium glow = testing::in_box(Medium{}, kLow, kHigh);
    glow.emission = Rgb(1, 2, 0);
    const Flights flights = flown(testing::regions({glow}), 50'000);
    EXPECT_TRUE(agrees(flights.emitted[0], 2));
    EXPECT_TRUE(agrees(flights.emitted[1], 4));
    EXPECT_FALSE(agrees(flights.emitted[1], 4.1));
    EXPECT_EQ(flights.emitted[2].mean(), 0);
    EXPECT_NEAR(flights.passed[0].mean(), 1, 1e-6);
}

TEST(Flight, NoMediumMet_PassesWithoutAChange) {
    SceneMedia media =
        testing::regions({testing::in_box(testing::homogeneous(Rgb(1), Rgb(1)), {0, 5, 0}, {1, 6, 1})});
    EXPECT_TRUE(MediaAlong(media, kNoMedium, kAlongX, INFINITY).empty());
}

// --- A scattering point before an end that is used in any case

// Means of flow·sigma_s·F over many draws, for F = 1 and F = t, and the share of draws that gave a point.
struct Within {
    Colour whole, moment;
    double found = 0;
};
Within drawn_within(const SceneMedia& media, int samples, const Rgb& throughput = Rgb(1)) {
    Within sums;
    int found = 0;
    for (int i = 0; i < samples; ++i) {
        Sampler sampler(4, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const auto place = scatter_within(MediaAlong(media, kNoMedium, kAlongX, 10), throughput, sampler);
        const Rgb value = place ? place->flow * place->sigma_s : Rgb(0);
        add(sums.whole, value);
        add(sums.moment, value * static_cast<float>(place ? place->t : 0));
        found += place ? 1 : 0;
    }
    sums.found = static_cast<double>(found) / samples;
    return sums;
}

// The truth is ∫ σ_s e^{-σ_t (t - 1)} dt, and the same integral with a factor t, for t from 1 to 3.
TEST(ScatterWithin, ColouredSlab_IntegratesAsTheFormulaSaysAndLosesNoDraw) {
    const Rgb sigma_a(0.1F, 1, 0), sigma_s(0.3F, 2, 0.02F);
    const auto media =
        testing::regions({testing::in_box(testing::homogeneous(sigma_a, sigma_s), kLow, kHigh)});
    const Within sums = drawn_within(media, 200'000, Rgb(0.2F, 1, 3));
    EXPECT_EQ(sums.found, 1);
    for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const double s = static_cast<double>(sigma_s[k]), t = s + static_cast<double>(sigma_a[k]);
        const double whole = s / t * (1 - std::exp(-2 * t));
        const double moment = whole + s * (1 / (t * t) - std::exp(-2 * t) * (2 / t + 1 / (t * t)));
        EXPECT_TRUE(agrees(sums.whole[at], whole)) << k;
        EXPECT_TRUE(agrees(sums.moment[at], moment)) << k;
        EXPECT_FALSE(agrees(sums.whole[at], 1.02 * whole)) << k;
    }
}

TEST(ScatterWithin, ThinFog_HasNoNoiseToSpeakOf) {
    const auto media =
        testing::regions({testing::in_box(testing::homogeneous(Rgb(0), Rgb(0.01F)), kLow, kHigh)});
    const Within sums = drawn_within(media, 1000);
    EXPECT_NEAR(sums.whole[0].mean() / (1 - std::exp(-0.02)), 1, 1e-4);
}

TEST(ScatterWithin, GapsAndOverlaps_AddUp) {
    // The boxes span 1 to 3 and 2 to 5: three segments, and no medium between the last one and 10.
    const auto media = testing::regions(
        {testing::in_box(testing::homogeneous(Rgb(0.2F), {0.5F, 0, 1}), kLow, kHigh),
         testing::in_box(testing::homogeneous(Rgb(0), {0.1F, 0.4F, 0}), {1, -1, -1}, {4, 2, 2})});
    const Within sums = drawn_within(media, 200'000);
    const double a[] = {0.5, 0, 1}, b[] = {0.1, 0.4, 0};
    for (std::size_t k = 0; k < 3; ++k) {
        const double first = a[k] + 0.2, both = first + b[k], last = b[k];
        const double met = a[k] / first * (1 - std::exp(-first)) +
                           std::exp(-first) * (a[k] + b[k]) / both * (1 - std::exp(-both)) +
                           std::exp(-first - both) * (1 - std::exp(-2 * last));
        EXPECT_TRUE(agrees(sums.whole[k], met)) << k << ' ' << sums.whole[k].mean() << ' ' << met;
        EXPECT_FALSE(agrees(sums.whole[k], 1.03 * met)) << k;
    }
}

TEST(ScatterWithin, VaryingDensity_IntegratesWhatFlightsDo) {
    const auto media = testing::regions(
        {testing::rising_along_x(testing::homogeneous({0.3F, 1, 2}, {1, 0.5F, 0.2F}), kLow, kHigh, 16)});
    const Within sums = drawn_within(media, 200'000, Rgb(1, 2, 1));
    const double sigma_s[] = {1, 0.5, 0.2}, sigma_t[] = {1.3, 1.5, 2.2};
    for (std::size_t k = 0; k < 3; ++k) {
        const double met = sigma_s[k] / sigma_t[k] * (1 - std::exp(-sigma_t[k]));
        EXPECT_TRUE(agrees(sums.whole[k], met)) << k << ' ' << sums.whole[k].mean() << ' ' << met;
        EXPECT_FALSE(agrees(sums.whole[k], 1.05 * met)) << k;
    }
}

TEST(ScatterWithin, UnboundedDenseOrClearMedia_HaveAnAnswer) {
    SceneMedia dense;
    dense.all.push_back(testing::homogeneous(Rgb(0), Rgb(1e6F)));
    SceneMedia clear = testing::regions({testing::in_box(testing::homogeneous(Rgb(1), Rgb(0)), kLow, kHigh)});
    for (std::uint64_t i = 0; i < 1000; ++i) {
        Sampler sampler(4, Purpose::test, 0, i);
        const auto place = scatter_within(MediaAlong(dense, 0, kAlongX, INFINITY), Rgb(1, 0, 0), sampler);
        ASSERT_TRUE(place);
        ASSERT_NEAR(place->flow.x * place->sigma_s.x, 1, 1e-5);
        ASSERT_FALSE(scatter_within(MediaAlong(clear, kNoMedium, kAlongX, 10), Rgb(1), sampler));
    }
}

TEST(Flight, WhereNothingScatters_EveryFlightArrivesWeakened) {
    const auto media =
        testing::regions({testing::in_box(testing::homogeneous({0.1F, 1, 3}, Rgb(0)), kLow, kHigh)});
    const Flights flights = flown(media, 100);
    EXPECT_NEAR(flights.passed[1].mean(), std::exp(-2.0), 1e-6);
    EXPECT_LT(flights.passed[1].standard_error(), 1e-8);
}

}  // namespace flight_test
}  // namespace lucerna
