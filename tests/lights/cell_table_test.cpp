#include "lights/cell_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <fstream>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace cell_table_test {

using ::testing::HasSubstr;
using testing::random_field;
using testing::rig_a;
using testing::rig_b;

CellTable build(const LightField& field, int threads = 1) {
    Monitor silent;
    return {field, Workers{threads}, silent};
}

std::array<float, 4> four(Sampler& sampler) {
    const V2f a = sampler.next2();
    const V2f b = sampler.next2();
    return {a.x, a.y, b.x, b.y};
}

// Returns the clamped flux of every cell, by the midpoint rule over its definition, in the order of CellId.
std::vector<double> brute_cells(const LightField& field, int fine) {
    const Rig& rig = field.rig();
    std::vector<double> flux;
    for (int n = 0; n < rig.intervals(0); ++n) {
        for (int o = 0; o < rig.intervals(1); ++o) {
            for (int p = 0; p < rig.columns(0); ++p) {
                for (int q = 0; q < rig.columns(1); ++q) {
                    const V2d m(rig.column_edge(0, n, p) + 0.5 * rig.pixel.x,
                                rig.column_edge(1, o, q) + 0.5 * rig.pixel.y);
                    double sum = 0;
                    for (int i = 0; i < fine * fine; ++i) {
                        const V2d s(rig.interval_edge(0, n) + (i % fine + 0.5) / fine * rig.spacing.x,
                                    rig.interval_edge(1, o) +
                                        (static_cast<double>(i / fine) + 0.5) / fine * rig.spacing.y);
                        sum += std::max(0.0, testing::brute_h(field, s, m));
                    }
                    flux.push_back(sum / fine / fine * rig.cell_volume());
                }
            }
        }
    }
    return flux;
}

RC_GTEST_PROP(ConditionalTables, Draw_AnyWeights_IsTheInverseOfTheSums, ()) {
    const auto items = *rc::gen::inRange(1, 300);
    std::vector<double> weights;
    double total = 0;
    for (int i = 0; i < items; ++i) {
        weights.push_back(*rc::gen::element(0, 0, 0, 1, 2, 5, 1000));
        total += weights.back();
    }
    ConditionalTables table(2, items);
    table.set(1, weights.data());
    RC_ASSERT(table.sound());
    RC_PRE(total > 0);
    for (int i = 0; i < 64; ++i) {
        const float u = static_cast<float>(*rc::gen::inRange(0, 1 << 24)) * 0x1p-24F;
        int item = 0;
        while (!(table.upto()[static_cast<std::size_t>(items + item)] > u)) ++item;
        const auto draw = table.draw(1, u);
        RC_ASSERT(draw.item == item);
        RC_ASSERT(weights[static_cast<std::size_t>(item)] > 0);
        RC_ASSERT(std::fabs(double{draw.probability} - weights[static_cast<std::size_t>(item)] / total) <
                  1e-6);
        RC_ASSERT(draw.probability == table.probability(1, item));
        RC_ASSERT(draw.remainder >= 0 && draw.remainder < 1);
    }
}

TEST(CellTable, Probabilities_SignedFields_AreTheCellsClampedFlux) {
    for (const Rig& rig : {rig_a(), rig_b()}) {
        const LightField field = random_field(rig, -1, 1, 12);
        const CellTable table = build(field);
        const std::vector<double> truth = brute_cells(field, 24);
        ASSERT_EQ(truth.size(), table.cells());
        double total = 0;
        double largest = 0;
        for (const double f : truth) total += f, largest = std::max(largest, f);
        EXPECT_NEAR(table.flux(), total, 1e-3 * total);
        EXPECT_NEAR(table.flux(), field.clamped_flux({}), 1e-9 * total);
        for (CellId id = 0; id < table.cells(); ++id) {
            const Cell cell = *table.cell(id);
            EXPECT_EQ(table.id(cell), id);
            EXPECT_NEAR(table.probability(cell) * total, truth[id], 2e-3 * largest) << id;
        }
        EXPECT_FALSE(table.cell(static_cast<CellId>(table.cells())));
        EXPECT_FALSE(table.cell(kNoCell));
    }
}

TEST(CellTable, Draws_OfARandomSignedField_FollowTheFluxOfTheCells) {
    for (const Rig& rig : {rig_a(), rig_b()}) {
        const LightField field = random_field(rig, -1, 1, 13);
        const CellTable table = build(field);
        std::vector<double> expected = brute_cells(field, 48);
        std::vector<std::uint64_t> observed(expected.size());
        constexpr int kDraws = 400000;
        RunningStats remainder[4];
        RunningStats product;
        for (int i = 0; i < kDraws; ++i) {
            Sampler sampler(1, Purpose::test, 0, static_cast<std::uint64_t>(i));
            const auto draw = table.draw(four(sampler));
            ++observed[draw.id];
            EXPECT_NEAR(draw.probability, table.probability(draw.cell), 1e-12);
            for (std::size_t k = 0; k < 4; ++k) remainder[k].add(double{draw.remainder[k]});
            product.add(double{draw.remainder[0]} * double{draw.remainder[1]} * double{draw.remainder[2]} *
                        double{draw.remainder[3]});
        }
        const auto scale_to_draws = [&](std::vector<double> weights) {
            double total = 0;
            for (const double w : weights) total += w;
            for (double& w : weights) w = std::max(w * kDraws / total, 1e-9);  // midpoints may miss a sliver
            return weights;
        };
        EXPECT_TRUE(testing::chi_square(observed, scale_to_draws(expected)).accepted());
        for (const RunningStats& r : remainder) EXPECT_TRUE(testing::agrees(r, 0.5));
        EXPECT_TRUE(testing::agrees(product, 1.0 / 16));
        // The same test rejects cells weighted by their plain sums instead of the clamped ones.
        std::vector<double> plain;
        for (CellId id = 0; id < table.cells(); ++id)
            plain.push_back(std::max(0.0, field.members(*table.cell(id)).signed_mean()));
        EXPECT_FALSE(testing::chi_square(observed, scale_to_draws(plain)).accepted());
    }
}

TEST(CellTable, Draws_InABlock_AreTheSingleOnes) {
    const CellTable table = build(random_field(rig_a(), -1, 1, 20));
    for (const std::size_t size : {std::size_t{1}, std::size_t{5}, CellTable::Block::kSize}) {
        std::vector<std::array<float, 4>> u(size);
        CellTable::Block block;
        for (std::size_t i = 0; i < size; ++i) {
            Sampler sampler(3, Purpose::test, 0, i);
            u[i] = four(sampler);
            for (std::size_t axis = 0; axis < 4; ++axis) block.u[axis][i] = u[i][axis];
        }
        table.draw(block, size);
        for (std::size_t i = 0; i < size; ++i) {
            const CellTable::Draw one = table.draw(u[i]);
            EXPECT_EQ(block.id[i], one.id);
            EXPECT_EQ(block.probability(i), one.probability);
            for (std::size_t axis = 0; axis < 4; ++axis) {
                EXPECT_EQ(block.remainder[axis][i], one.remainder[axis]);
            }
            EXPECT_EQ(table.id({block.n[i], block.o[i], block.p[i], block.q[i]}), one.id);
        }
    }
    CellTable::Block none;
    table.draw(none, 0);
}

TEST(CellTable, Intervals_Drawn_HaveTheirMarginal) {
    const LightField field = random_field(rig_a(), -1, 1, 14);
    const CellTable table = build(field);
    double sum = 0;
    for (int n = 0; n < 4; ++n) {
        for (int o = 0; o < 3; ++o) {
            double cells = 0;
            for (int p = 0; p < field.rig().columns(0); ++p) {
                for (int q = 0; q < field.rig().columns(1); ++q) cells += table.probability({n, o, p, q});
            }
            EXPECT_NEAR(double{table.interval_probability(n, o)}, cells, 1e-6);
            sum += cells;
        }
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    const auto at = table.draw_interval({0.4F, 0.7F});
    const auto whole = table.draw({0.4F, 0.7F, 0.1F, 0.2F});
    EXPECT_EQ(at.n, whole.cell.n);
    EXPECT_EQ(at.o, whole.cell.o);
    EXPECT_EQ(at.probability, table.interval_probability(at.n, at.o));
}

TEST(CellTable, Extremes_OneCoefficientZerosAndNegativeRows_AreRight) {
    Rig one = rig_b();
    one.views = one.pixels = {1, 1};
    const CellTable single = build({one, {2.0F}});
    EXPECT_NEAR(single.flux(), 2 * one.cell_volume(), 1e-6 * one.cell_volume());
    EXPECT_EQ(single.cells(), 4U);
    for (CellId id = 0; id < 4; ++id) EXPECT_NEAR(single.probability(*single.cell(id)), 0.25, 1e-6);

    EXPECT_EQ(build({one, {0.0F}}).flux(), 0);
    EXPECT_EQ(build({one, {-1.0F}}).flux(), 0);

    // In this field the lower views are all negative: nothing is ever drawn from cells that have only those.
    std::vector<float> e(rig_b().coefficients(), 1.0F);
    for (int k = 0; k < 4; ++k) {
        for (int l = 0; l < 5; ++l) {
            for (int m = 0; m < 3; ++m) e[rig_b().index(m, 0, k, l)] = -1;
        }
    }
    const CellTable table = build({rig_b(), e});
    for (int n = 0; n < 4; ++n) EXPECT_EQ(table.interval_probability(n, 0), 0.0F);
    for (int i = 0; i < 10000; ++i) {
        Sampler sampler(2, Purpose::test, 0, static_cast<std::uint64_t>(i));
        EXPECT_GT(table.draw(four(sampler)).cell.o, 0);
    }
}

TEST(CellTable, TooManyCells_AreRefusedBeforeTheyAreAllocated) {
    Rig rig;
    rig.views = {60000, 1};
    rig.pixels = {1, 1};
    rig.shift = {300, 300};
    rig.spacing = {0.3, 0.3};
    rig.pixel = {0.001, 0.001};
    rig.distance = 1;
    EXPECT_THROW(build({rig, std::vector<float>(rig.coefficients(), 1.0F)}), InputError);
}

TEST(CellTable, Threads_AnyNumber_MakeTheSameTable) {
    const testing::TemporaryFolder folder;
    const LightField field = random_field(rig_a(), -1, 1, 15);
    build(field, 1).save(folder / "1.cells");
    build(field, 7).save(folder / "7.cells");
    EXPECT_EQ(read_text(folder / "1.cells"), read_text(folder / "7.cells"));
}

CellTable kept_table(const std::filesystem::path& lamp, const LightField& field, Monitor& monitor) {
    const LightField* const fields[] = {&field};
    return std::move(load_or_build_cell_tables(lamp, fields, {}, monitor).front());
}

TEST(CellTableFile, Kept_IsReusedOnlyForItsOwnField) {
    const testing::TemporaryFolder folder;
    const LightField field = random_field(rig_a(), -1, 1, 16);
    const std::filesystem::path lamp = folder / "lamp.exr";
    testing::ListeningMonitor monitor;
    const CellTable first = kept_table(lamp, field, monitor);
    EXPECT_EQ(monitor.infos.size(), 1U);
    ASSERT_TRUE(std::filesystem::exists(folder / "lamp.cells"));
    const CellTable second = kept_table(lamp, field, monitor);
    EXPECT_EQ(monitor.infos.size(), 1U);
    EXPECT_EQ(second.flux(), first.flux());
    EXPECT_EQ(first.bytes(), CellTable::bytes_for(field.rig()));
    for (CellId id = 0; id < first.cells(); ++id)
        EXPECT_EQ(first.probability(*first.cell(id)), second.probability(*second.cell(id)));

    const LightField other = random_field(rig_a(), -1, 1, 17);
    kept_table(lamp, other, monitor);
    ASSERT_EQ(monitor.infos.size(), 2U);
    EXPECT_THAT(monitor.infos[1], HasSubstr("another light field"));
    EXPECT_TRUE(monitor.warnings.empty());
}

TEST(CellTableFile, Damage_AnyByteOrLength_IsNeverTrusted) {
    const testing::TemporaryFolder folder;
    const LightField field = random_field(rig_b(), -1, 1, 18);
    build(field).save(folder / "lamp.cells");
    const std::string good = read_text(folder / "lamp.cells");
    std::string reason;
    ASSERT_TRUE(CellTable::load(folder / "lamp.cells", field, reason)) << reason;
    const auto loads = [&](const std::string& bytes) {
        std::ofstream(folder / "bad.cells", std::ios::binary) << bytes;
        return CellTable::load(folder / "bad.cells", field, reason).has_value();
    };
    for (std::size_t i = 0; i < good.size(); i += 7) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ 0x10);
        EXPECT_FALSE(loads(bad)) << i;
    }
    for (std::size_t length = 0; length < good.size(); length += 97)
        EXPECT_FALSE(loads(good.substr(0, length)));
    EXPECT_FALSE(loads(good + "x"));
}

TEST(CellTableFile, FolderThatCannotBeWritten_IsAWarning) {
    const testing::TemporaryFolder folder;
    testing::ListeningMonitor monitor;
    const LightField field = random_field(rig_b(), 0, 1, 19);
    const CellTable table = kept_table(folder / "nowhere" / "lamp.exr", field, monitor);
    EXPECT_GT(table.flux(), 0);
    ASSERT_EQ(monitor.warnings.size(), 1U);
    EXPECT_THAT(monitor.warnings[0], HasSubstr("is not saved"));
}

}  // namespace cell_table_test
}  // namespace lucerna
