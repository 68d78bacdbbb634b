#include "lights/field_pyramid.h"

#include <gtest/gtest.h>

#include "engine/base/sampler.h"
#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace field_pyramid_test {

using testing::random_field;
using testing::rig_a;
using testing::rig_b;
using testing::rig_c;
using testing::rig_d;
using testing::rig_e;

CellTable table_of(const LightField& field) {
    Monitor silent;
    return CellTable(field, Workers{1}, silent);
}

// S is divided into the squares of the pyramid or finer ones: kFine equal parts of each interval and axis.
constexpr int kFine = 16;

struct Squares {
    const Rig& rig;
    int across(int axis) const { return rig.intervals(axis) * kFine; }
    // Returns where a square begins; across() as index gives the end of the last one.
    double edge(int axis, int i) const {
        const int n = std::min(i / kFine, rig.intervals(axis) - 1);
        const double begin = rig.interval_edge(axis, n), end = rig.interval_edge(axis, n + 1);
        return begin + (i - n * kFine) * (end - begin) / kFine;
    }
    // Calls action(middle, area).
    template <typename Action>
    void for_each(Action&& action) const {
        for (int i = 0; i < across(0); ++i) {
            for (int j = 0; j < across(1); ++j) {
                const V2d low(edge(0, i), edge(1, j)), high(edge(0, i + 1), edge(1, j + 1));
                action(0.5 * (low + high), (high.x - low.x) * (high.y - low.y));
            }
        }
    }
    // Returns the square that holds a place.
    int at(int axis, double place) const {
        int n = 0;
        while (n + 1 < rig.intervals(axis) && rig.interval_edge(axis, n + 1) <= place) ++n;
        const double begin = rig.interval_edge(axis, n), end = rig.interval_edge(axis, n + 1);
        const auto within = static_cast<int>((place - begin) / (end - begin) * kFine);
        return n * kFine + std::clamp(within, 0, kFine - 1);
    }
};

// Returns a rig larger than the fixtures: with parts of several intervals, blocks beyond the last one, and
// several levels of M.
Rig many_views(bool travels) {
    Rig rig = travels ? rig_a() : rig_b();
    rig.views = {20, 37};
    rig.pixels = {13, 9};
    return rig;
}

struct Case {
    const char* name;
    LightField field;
};
std::vector<Case> cases() {
    std::vector<Case> all;
    all.push_back({"Setup A, negative coefficients", random_field(rig_a(), -1, 2, 51)});
    all.push_back({"Setup B, negative coefficients", random_field(rig_b(), -1, 2, 52)});
    all.push_back({"hats on planes finer in the middle", random_field(rig_c(), -1, 2, 53)});
    all.push_back({"hats on both planes", random_field(rig_d(), -1, 2, 54)});
    all.push_back({"hats on S, Setup A", random_field(rig_e(), -1, 2, 55)});
    all.push_back({"Setup A, many views", random_field(many_views(true), -1, 1.5F, 53)});
    all.push_back({"Setup B, many views", random_field(many_views(false), -1, 1.5F, 54)});
    Rig one = rig_b();
    one.views = {1, 1}, one.pixels = {1, 1};
    all.push_back({"one view, one pixel", random_field(one, 1, 2, 55)});
    Rig pixel = rig_b();
    pixel.pixels = {1, 1};
    all.push_back({"one pixel", random_field(pixel, -1, 2, 56)});
    // All coefficients but one are zero.
    std::vector<float> e(rig_b().coefficients());
    e[rig_b().index(2, 1, 3, 4)] = 1;
    all.push_back({"one coefficient", {rig_b(), std::move(e)}});
    return all;
}

// Places far away, between S and M, near S, far to the side, and behind S (where the lamp's body may be).
const std::vector<V3d> kPlaces{{0.01, 0.004, 0.7},   {0.002, 0.01, 0.05}, {-0.012, 0.02, 0.0013},
                               {0.3, 0.1, 0.5},      {0.9, 0.01, 0.3},    {0.003, -0.004, -0.04},
                               {0.011, 0.003, 0.081}};

TEST(FieldPyramid, Density_OverS_IntegratesToOne_AndEachPartToItself) {
    for (const auto& [name, field] : cases()) {
        const FieldPyramid pyramid(field, table_of(field), 16, {});
        const Squares squares{field.rig()};
        // At the other places a block spans more columns than the grid resolves: there the pyramid's squares
        // are finer than kFine parts.
        for (const V3d& x : {kPlaces[0], kPlaces[1], kPlaces[5], kPlaces[6]}) {
            double whole = 0, part = 0, squares_in_parts = 0;
            squares.for_each([&](const V2d& on_s, double area) {
                const FieldPyramid::Density density = pyramid.density(x, on_s);
                whole += density.whole * area;
                part += density.part * area;
            });
            // The expected number is that of parts with flux.
            const CellTable table = table_of(field);
            const Rig& rig = field.rig();
            std::vector<V2i> seen;
            for (int n = 0; n < rig.intervals(0); ++n) {
                for (int o = 0; o < rig.intervals(1); ++o) {
                    const V2i first = pyramid.part_of(n, o);
                    if (table.interval_probability(n, o) > 0 &&
                        std::find(seen.begin(), seen.end(), first) == seen.end())
                        seen.push_back(first), squares_in_parts += 1;
                }
            }
            EXPECT_NEAR(whole, 1, 1e-5) << name << ", z " << x.z;
            EXPECT_NEAR(part, squares_in_parts, 1e-5 * squares_in_parts) << name << ", z " << x.z;
        }
    }
}

// Compares the drawn points with the density, and the densities that draw() returns with those of density().
testing::ChiSquare draws_against(const FieldPyramid& pyramid, const Rig& rig, const V3d& x,
                                 std::optional<V2i> interval, double spoil) {
    constexpr int kDraws = 60000;
    const Squares squares{rig};
    // A bin is one interval if there are many intervals, else one square.
    const int bin = rig.intervals(0) > 10 ? kFine : 1;
    const auto bin_of = [&](const V2d& on_s) {
        const auto at = [&](int a) { return squares.at(a, on_s[a]) / bin; };
        return static_cast<std::size_t>(at(0) * (squares.across(1) / bin) + at(1));
    };
    const auto bins = static_cast<std::size_t>(squares.across(0) / bin * (squares.across(1) / bin));
    std::vector<std::uint64_t> observed(bins);
    std::vector<double> expected(bins);
    squares.for_each([&](const V2d& on_s, double area) {
        const FieldPyramid::Density density = pyramid.density(x, on_s);
        double p = density.whole;
        if (interval) {
            const V2i part = pyramid.part_of(squares.at(0, on_s.x) / kFine, squares.at(1, on_s.y) / kFine);
            p = part == pyramid.part_of(interval->x, interval->y) ? density.part : 0;
        }
        // A wrong density: it is too large on one half of S.
        if (spoil != 0) p *= on_s.x < 0 ? 1 + spoil : 1 - spoil;
        expected[bin_of(on_s)] += p * area * kDraws;
    });
    int apart = 0;
    for (int i = 0; i < kDraws; ++i) {
        Sampler sampler(61, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const auto drawn = pyramid.draw(x, sampler.next2(), interval);
        EXPECT_TRUE(drawn.has_value());
        if (!drawn) break;
        ++observed[bin_of(drawn->on_s)];
        const FieldPyramid::Density again = pyramid.density(x, drawn->on_s);
        apart += again.whole != drawn->density.whole || again.part != drawn->density.part;
    }
    // By rounding, a point on the edge between two squares may count for the other one.
    EXPECT_LE(apart, 3);
    return testing::chi_square(observed, expected);
}

TEST(FieldPyramid, Long_Points_FallByTheirDensity_AndAWrongOneIsSeen) {
    for (const auto& [name, field] : cases()) {
        const FieldPyramid pyramid(field, table_of(field), 16, {});
        for (const V3d& x : {kPlaces[0], kPlaces[1], kPlaces[5]}) {
            EXPECT_TRUE(draws_against(pyramid, field.rig(), x, {}, 0).accepted()) << name << ", z " << x.z;
        }
        EXPECT_FALSE(draws_against(pyramid, field.rig(), kPlaces[0], {}, 0.2).accepted()) << name;
    }
}

TEST(FieldPyramid, PointsOfAPart_FallByTheirDensity) {
    for (const bool travels : {false, true}) {
        const LightField field = random_field(many_views(travels), -1, 1.5F, 57);
        const FieldPyramid pyramid(field, table_of(field), 16, {});
        const V2i interval(7, 21);
        ASSERT_NE(pyramid.part_of(7, 21), interval);  // a part of several intervals
        for (const V3d& x : {kPlaces[0], kPlaces[1]}) {
            EXPECT_TRUE(draws_against(pyramid, field.rig(), x, interval, 0).accepted()) << "z " << x.z;
        }
    }
}

// Returns the irradiance on a plane that faces the lamp, by the midpoint rule over the part of S that x sees
// through M.
double irradiance(const LightField& field, const V3d& x) {
    constexpr int kSteps = 360;
    const Rig& rig = field.rig();
    const double stretch = rig.distance / x.z;
    V2d low, step;
    for (int a = 0; a < 2; ++a) {
        // Bounds u such that u + (x - u) D/z lies within the union of the sensors.
        const double seen = rig.m_edge(a, rig.intervals(a) - 1, true);
        const double ends[2] = {(seen - x[a] * stretch) / (1 - stretch),
                                (-seen - x[a] * stretch) / (1 - stretch)};
        low[a] = std::max(rig.interval_edge(a, 0), std::min(ends[0], ends[1]));
        const double high = std::min(rig.interval_edge(a, rig.intervals(a)), std::max(ends[0], ends[1]));
        if (!(high > low[a])) return 0;
        step[a] = (high - low[a]) / kSteps;
    }
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const V2d s(low.x + (i + 0.5) * step.x, low.y + (j + 0.5) * step.y);
            const V3d way(x.x - s.x, x.y - s.y, x.z);
            const V2d m(s.x + way.x * stretch, s.y + way.y * stretch);
            const double h = testing::brute_h(field, s, m, true);
            if (h > 0) sum += h / rig.geometric_term(s, m) * sqr(x.z) / sqr(way.length2());
        }
    }
    return sum * step.x * step.y;
}

// Estimates the irradiance by sample_Li(); `wrong` multiplies every second weight.
RunningStats found_at(const Light& light, const V3d& x, float wrong) {
    RunningStats stats;
    for (int i = 0; i < 10000; ++i) {
        Sampler sampler(63, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const auto in = light.sample_Li(V3f(x), sampler.next2());
        if (!in) {
            stats.add(0);
            continue;
        }
        stats.add(double{luminance(in->weight)} * std::fabs(double{in->w.z}) *
                  (i % 2 == 0 ? double{wrong} : 1.0));
        const auto back = light.Le(Ray{V3f(x), in->w});
        EXPECT_TRUE(back.has_value());
    }
    return stats;
}

TEST(FieldPyramid, MeanOfSampleLi_IsTheIrradianceByBruteForce_AndAWrongWeightIsSeen) {
    Monitor silent;
    for (const auto& [name, field] : cases()) {
        if (field.rig().intervals(0) > 10 && field.rig().shift.x == 0) continue;  // one large field suffices
        const auto light = make_measured_light(field, table_of(field), {}, silent);
        const V3d centre(field.rig().centre);
        const double gain = field.flux() / field.clamped_flux({});
        for (const V3d& x : kPlaces) {
            const RunningStats found = found_at(*light, x + centre, 1);
            if (x.z < 0) {
                EXPECT_EQ(found.mean(), 0);
                continue;
            }
            const double truth = gain * irradiance(field, x);
            // The midpoint rule errs by a few thousandths.
            EXPECT_NEAR(found.mean(), truth, 4 * found.standard_error() + 4e-3 * truth)
                << name << ", z " << x.z;
        }
        const double truth = gain * irradiance(field, kPlaces[0]);
        if (truth > 0) {
            const RunningStats wrong = found_at(*light, kPlaces[0] + centre, 1.2F);
            EXPECT_GT(std::fabs(wrong.mean() - truth), 4 * wrong.standard_error() + 4e-3 * truth) << name;
        }
    }
}

// Every view emits in one direction only: a place sees light from only a few intervals of S.
TEST(FieldPyramid, NarrowBeams_AreFoundWithATenthOfTheVariance) {
    Monitor silent;
    Rig rig = rig_b();
    rig.views = {16, 16};
    rig.pixels = {32, 32};
    rig.spacing = {0.005, 0.005};
    rig.pixel = {0.005, 0.005};
    std::vector<float> e(rig.coefficients());
    for (int m = 0; m < 16; ++m) {
        for (int n = 0; n < 16; ++n) e[rig.index(m, n, 2 * m, 2 * n)] = 1;  // each view shines one way
    }
    const LightField field(rig, std::move(e));
    const CellTable table = table_of(field);
    const FieldPyramid pyramid(field, table, 16, {});
    RunningStats ours, by_flux;
    const V3d x(0.013, -0.021, 0.4);
    for (int i = 0; i < 20000; ++i) {
        Sampler sampler(65, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f u = sampler.next2();
        const auto value = [&](const V2d& s) {
            const V2d m(s.x + (x.x - s.x) * rig.distance / x.z, s.y + (x.y - s.y) * rig.distance / x.z);
            return double{field.flux_density(s, m)};
        };
        const auto drawn = pyramid.draw(x, u);
        ASSERT_TRUE(drawn);
        ours.add(value(drawn->on_s) / drawn->density.whole);
        const auto at = table.draw_interval(u);
        by_flux.add(value({rig.interval_edge(0, at.n) + double{at.remainder.x} * rig.spacing.x,
                           rig.interval_edge(1, at.o) + double{at.remainder.y} * rig.spacing.y}) /
                    (double{at.probability} / (rig.spacing.x * rig.spacing.y)));
    }
    EXPECT_GT(ours.mean(), 0);
    EXPECT_NEAR(ours.mean(), by_flux.mean(), 4 * (ours.standard_error() + by_flux.standard_error()));
    EXPECT_LT(sqr(ours.standard_error()), 0.1 * sqr(by_flux.standard_error()));
}

TEST(FieldPyramid, Memory_InSetupB_IsNineTenthsOfTheCoefficients) {
    Rig rig = rig_b();
    rig.views = {63, 63};
    rig.pixels = {32, 32};
    const LightField field = random_field(rig, 0, 1, 58);
    const FieldPyramid pyramid(field, table_of(field), 16, {});
    EXPECT_LT(static_cast<double>(pyramid.bytes()),
              0.95 * static_cast<double>(field.coefficients().size_bytes()));
}

TEST(FieldPyramid, Built_ByAnyNumberOfThreads_IsTheSame) {
    const LightField field = random_field(many_views(true), -1, 1.5F, 59);
    const CellTable table = table_of(field);
    const FieldPyramid one(field, table, 16, Workers{1}), three(field, table, 16, Workers{3});
    for (int i = 0; i < 1000; ++i) {
        Sampler sampler(66, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f u = sampler.next2();
        const V3d x(sampler.next() - 0.5, sampler.next() - 0.5, sampler.next() + 0.001);
        const auto a = one.draw(x, u), b = three.draw(x, u);
        ASSERT_TRUE(a && b);
        EXPECT_EQ(a->on_s, b->on_s);
        EXPECT_EQ(a->density.whole, b->density.whole);
    }
}

}  // namespace field_pyramid_test
}  // namespace lucerna
