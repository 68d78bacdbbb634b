// The numbers that drive emission: joint uniformity, uniformity of each, and independence of passes.
#include "lights/emission_net.h"

#include <gtest/gtest.h>

#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace emission_net_test {

using Point = std::array<float, 5>;

Point point(const EmissionNet& net, std::uint32_t path) {
    const EmissionNet::Point p = net.at(path);
    return {p.u.position.x, p.u.position.y, p.u.direction.x, p.u.direction.y, p.light};
}

// Calls visit(exponents) for all ways to divide 2^total boxes among `dimensions` dimensions.
template <typename Visit>
void for_each_cut(int dimensions, int total, std::vector<int>& exponents, Visit&& visit) {
    if (static_cast<int>(exponents.size()) + 1 == dimensions) {
        exponents.push_back(total);
        visit(exponents);
        exponents.pop_back();
        return;
    }
    for (int e = 0; e <= total; ++e) {
        exponents.push_back(e);
        for_each_cut(dimensions, total - e, exponents, visit);
        exponents.pop_back();
    }
}

// Returns whether every elementary interval of volume 2^-(k - t) holds exactly 2^t of the 2^k points. `axes`
// selects the dimensions.
bool is_net(const std::vector<Point>& points, const std::vector<std::size_t>& axes, int k, int t) {
    bool good = true;
    std::vector<int> exponents;
    for_each_cut(static_cast<int>(axes.size()), k - t, exponents, [&](const std::vector<int>& cut) {
        std::vector<int> count(std::size_t{1} << (k - t));
        for (const Point& p : points) {
            std::size_t box = 0;
            for (std::size_t a = 0; a < axes.size(); ++a) {
                const auto sides = static_cast<float>(1 << cut[a]);
                box = (box << cut[a]) + static_cast<std::size_t>(p[axes[a]] * sides);
            }
            ++count[box];
        }
        for (const int c : count) good = good && c == 1 << t;
    });
    return good;
}

std::vector<Point> points_of(std::uint32_t pass, std::uint32_t first, std::uint32_t n,
                             EmissionNet::Kind kind = EmissionNet::Kind::joint) {
    const EmissionNet net(7, Purpose::test, pass, kind);
    std::vector<Point> points;
    for (std::uint32_t i = 0; i < n; ++i) points.push_back(point(net, first + i));
    return points;
}

TEST(EmissionNet, ConsecutivePaths_AreNets) {
    // The quality t of a Sobol sequence is at most the sum of its polynomials' degrees less one each: here 0,
    // 0, 1, 2 and 2 for the five dimensions [Niederreiter 1992, 4.49].
    for (const std::uint32_t first : {0U, 512U, 0x12345600U}) {
        const auto points = points_of(3, first, 512);
        EXPECT_TRUE(is_net(points, {0, 1}, 9, 0));
        EXPECT_TRUE(is_net(points, {0, 2}, 9, 1));
        EXPECT_TRUE(is_net(points, {1, 3}, 9, 2));
        EXPECT_TRUE(is_net(points, {2, 3}, 9, 3));
        EXPECT_TRUE(is_net(points, {0, 1, 2, 3}, 9, 3));
        EXPECT_TRUE(is_net(points, {0, 1, 2, 3, 4}, 9, 5));
        for (std::size_t axis = 0; axis < 5; ++axis) EXPECT_TRUE(is_net(points, {axis}, 9, 0));
    }
    // Independent numbers form none of these nets.
    std::vector<Point> loose;
    for (std::uint32_t i = 0; i < 512; ++i) {
        Sampler sampler(1, Purpose::test, 0, i);
        loose.push_back({sampler.next(), sampler.next(), sampler.next(), sampler.next(), sampler.next()});
    }
    EXPECT_FALSE(is_net(loose, {0, 1, 2, 3, 4}, 9, 5));
    EXPECT_FALSE(is_net(loose, {0}, 9, 0));
}

// Sets of VPLs use consecutive paths: each set is a net, and so are all together [Wald 2002; Pharr 2004].
TEST(EmitNetInPairs, EverySetAndAllSetsTogether_AreNetsInPlaceAndDirection) {
    constexpr std::uint32_t kPaths = 16, kSets = 32;
    const auto expect_nets = [](std::uint32_t first, std::uint32_t n, int k) {
        const auto points = points_of(3, first, n, EmissionNet::Kind::pairs);
        EXPECT_TRUE(is_net(points, {0, 1}, k, 0)) << "place, from " << first;
        EXPECT_TRUE(is_net(points, {2, 3}, k, 0)) << "direction, from " << first;
        EXPECT_TRUE(is_net(points, {4}, k, 0)) << "light, from " << first;
    };
    for (std::uint32_t set = 0; set < kSets; ++set) expect_nets(set * kPaths, kPaths, 4);
    expect_nets(0, kPaths * kSets, 9);
    // The directions of the joint sequence are no such net: this is why pairs exist.
    EXPECT_FALSE(is_net(points_of(3, 0, kPaths * kSets), {2, 3}, 9, 0));
}

TEST(EmitNetInPairs, PlaceSaysNothingOfDirectionOrLight) {
    for (const auto& [a, b] : {std::pair(0, 2), {1, 3}, {0, 4}, {2, 4}}) {
        RunningStats product;
        for (std::uint32_t pass = 0; pass < 20000; ++pass) {
            const Point p = point(EmissionNet(5, Purpose::test, pass, EmissionNet::Kind::pairs), 9);
            product.add((double{p[static_cast<std::size_t>(a)]} - 0.5) *
                        (double{p[static_cast<std::size_t>(b)]} - 0.5));
        }
        EXPECT_TRUE(testing::agrees(product, 0)) << a << ' ' << b;
    }
}

TEST(EmissionNet, OnePathOverPasses_IsUniformInFiveDimensions) {
    constexpr int kPasses = 40000;
    for (const std::uint32_t path : {0U, 1U, 777U}) {
        std::vector<std::uint64_t> boxes(243), steps(320);
        for (std::uint32_t pass = 0; pass < kPasses; ++pass) {
            const Point p = point(EmissionNet(11, Purpose::test, pass), path);
            std::size_t box = 0;
            for (std::size_t a = 0; a < 5; ++a) {
                box = 3 * box + static_cast<std::size_t>(p[a] * 3);
                ++steps[64 * a + static_cast<std::size_t>(p[a] * 64)];
            }
            ++boxes[box];
        }
        EXPECT_TRUE(testing::chi_square(boxes, std::vector<double>(243, kPasses / 243.0)).accepted());
        for (std::size_t a = 0; a < 5; ++a) {
            const std::vector<std::uint64_t> one(steps.begin() + static_cast<std::ptrdiff_t>(64 * a),
                                                 steps.begin() + static_cast<std::ptrdiff_t>(64 * a + 64));
            EXPECT_TRUE(testing::chi_square(one, std::vector<double>(64, kPasses / 64.0)).accepted());
        }
    }
}

TEST(EmissionNet, Passes_AreIndependent) {
    // The numbers of one pass are not correlated with those of another at the same path.
    for (std::size_t axis = 0; axis < 5; ++axis) {
        RunningStats product;
        for (std::uint32_t pass = 0; pass < 20000; ++pass) {
            const Point a = point(EmissionNet(5, Purpose::test, 2 * pass), 9);
            const Point b = point(EmissionNet(5, Purpose::test, 2 * pass + 1), 9);
            product.add((double{a[axis]} - 0.5) * (double{b[axis]} - 0.5));
        }
        EXPECT_TRUE(testing::agrees(product, 0)) << axis;
    }
    EXPECT_NE(point(EmissionNet(5, Purpose::test, 0), 9), point(EmissionNet(6, Purpose::test, 0), 9));
    EXPECT_NE(point(EmissionNet(5, Purpose::test, 0), 9), point(EmissionNet(5, Purpose::bench, 0), 9));
    EXPECT_EQ(point(EmissionNet(5, Purpose::test, 1), 9), point(EmissionNet(5, Purpose::test, 1), 9));
    EXPECT_NE(EmissionNet(5, Purpose::test, 0).at(1).u.salt, EmissionNet(5, Purpose::test, 0).at(2).u.salt);
}

// The sum over the marginals' cells of (count - expected)² / expected. For independent particles its mean is,
// for each marginal, the number of cells less one.
struct Marginals {
    std::array<std::vector<double>, 4> expected;
    std::array<std::vector<double>, 4> count;

    Marginals(const CellTable& table, int particles) {
        for (CellId id = 0; id < table.cells(); ++id) {
            add(expected, *table.cell(id), table.probability(*table.cell(id)) * particles);
        }
    }
    static void add(std::array<std::vector<double>, 4>& sums, const Cell& cell, double weight) {
        const int at[4] = {cell.n, cell.o, cell.p, cell.q};
        for (std::size_t a = 0; a < 4; ++a) {
            sums[a].resize(std::max(sums[a].size(), static_cast<std::size_t>(at[a]) + 1));
            sums[a][static_cast<std::size_t>(at[a])] += weight;
        }
    }
    double spread() const {
        double sum = 0;
        for (std::size_t a = 0; a < 4; ++a) {
            for (std::size_t i = 0; i < expected[a].size(); ++i) {
                if (!(expected[a][i] > 0)) continue;
                const double there = i < count[a].size() ? count[a][i] : 0;
                sum += sqr(there - expected[a][i]) / expected[a][i];
            }
        }
        return sum;
    }
};

TEST(EmissionNet, ParticlesOfALamp_SpreadFarMoreEvenlyThanIndependentOnes) {
    Rig rig = testing::rig_a();
    rig.views = {6, 6};
    rig.pixels = {12, 10};
    const LightField field = testing::random_field(rig, 0, 1, 40);
    Monitor silent;
    const CellTable table(field, {}, silent);
    constexpr int kParticles = 4096, kPasses = 40;
    const Marginals empty(table, kParticles);
    RunningStats even, loose, mean_u;
    for (std::uint32_t pass = 0; pass < kPasses; ++pass) {
        Marginals net_count = empty, loose_count = empty;
        const EmissionNet net(12, Purpose::test, pass);
        double sum = 0;
        for (std::uint32_t i = 0; i < kParticles; ++i) {
            const LeSampleU u = net.at(i).u;
            const auto draw = table.draw({u.position.x, u.position.y, u.direction.x, u.direction.y});
            Marginals::add(net_count.count, draw.cell, 1);
            sum += draw.cell.p * draw.cell.q + draw.cell.n;
            Sampler sampler(13, Purpose::test, pass, i);
            Marginals::add(loose_count.count,
                           table.draw({sampler.next(), sampler.next(), sampler.next(), sampler.next()}).cell,
                           1);
        }
        even.add(net_count.spread());
        loose.add(loose_count.spread());
        mean_u.add(sum / kParticles);
    }
    const double ratio = even.mean() / loose.mean();
    ::testing::Test::RecordProperty("variance_ratio", fmt::format("{:.4f}", ratio));
    EXPECT_LT(ratio, 0.25) << even.mean() << " for " << loose.mean();
    double truth = 0;
    for (CellId id = 0; id < table.cells(); ++id) {
        const Cell cell = *table.cell(id);
        truth += table.probability(cell) * (cell.p * cell.q + cell.n);
    }
    EXPECT_TRUE(testing::agrees(mean_u, truth)) << mean_u.mean() << " for " << truth;
}

}  // namespace emission_net_test
}  // namespace lucerna
