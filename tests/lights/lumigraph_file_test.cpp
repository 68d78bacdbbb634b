// The file format of a lamp with several slabs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <numeric>
#include <span>

#include "engine/system/files.h"
#include "lights/cell_table.h"
#include "lights/lumigraph.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace lumigraph_file_test {

using lucerna::testing::error_of;
using lucerna::testing::random_field;
using lucerna::testing::rig_a;
using lucerna::testing::rig_b;
using lucerna::testing::rig_c;
using ::testing::HasSubstr;

const Box3d kBox(V3d(-0.01, -0.02, -0.03), V3d(0.01, 0.02, 0.04));

Lumigraph three_sides() {
    LightFieldInfo info;
    info.provenance = "three sides";
    info.captured = 3;
    info.missed = 0.5;
    const Rig coloured = rig_c();
    std::vector<Slab> slabs;
    slabs.push_back({SlabAxes::facing(0), random_field(rig_b(), -1, 3, 1, info)});
    slabs.push_back({SlabAxes::facing(3), random_field(rig_a(), 0, 1, 2, info)});
    const auto channel = [&](std::uint64_t seed) {
        const LightField field = random_field(coloured, 0, 1, seed);
        return std::vector<float>(field.coefficients().begin(), field.coefficients().end());
    };
    slabs.push_back({SlabAxes::facing(4), LightField(coloured, channel(3), channel(4), channel(5), info)});
    return {std::move(slabs), kBox};
}

// Replaces one byte, `ahead` bytes after the start of the first (or last) occurrence of `name`.
std::string replaced(std::string bytes, const std::string& name, std::size_t ahead, char value,
                     bool last = false) {
    const std::size_t at = last ? bytes.rfind(name) : bytes.find(name);
    EXPECT_NE(at, std::string::npos);
    bytes[at + ahead] = value;
    return bytes;
}

TEST(SlabAxes, SidesOfABox_AreRightHandedAndDifferent) {
    for (int side = 0; side < SlabAxes::kSides; ++side) {
        const SlabAxes axes = SlabAxes::facing(side);
        EXPECT_EQ(axes.fault(), "");
        EXPECT_EQ(axes.straight(), side == 0);
        const V3d p(0.3, -0.2, 0.7);
        EXPECT_LT((axes.to_lamp(axes.to_slab(p)) - p).length(), 1e-15);
        for (int other = 0; other < side; ++other) EXPECT_NE(axes.name(), SlabAxes::facing(other).name());
    }
    EXPECT_NE((SlabAxes{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}.fault()), "");
    EXPECT_NE((SlabAxes{{1, 0, 0}, {0.1, 1, 0}, {0, 0, 1}}.fault()), "");
}

TEST(SlabShares, OfAnyDirection_AddUpToOneWithoutSteps) {
    std::vector<V3d> normals;
    for (int side = 0; side < SlabAxes::kSides; ++side) normals.push_back(SlabAxes::facing(side).n);
    const SlabShares six(normals), two({normals[0], normals[1]}), one({normals[0]});
    std::array<double, 6> share{}, near{};
    for (int i = 0; i < 2000; ++i) {
        Sampler sampler(4, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V3d d =
            V3d(double{sampler.next()} - 0.5, double{sampler.next()} - 0.5, double{sampler.next()} - 0.5)
                .normalized();
        six.of(d, share);
        EXPECT_NEAR(std::accumulate(share.begin(), share.end(), 0.0), 1, 1e-12);
        six.of((d + V3d(1e-4, -1e-4, 5e-5)).normalized(), near);
        for (std::size_t k = 0; k < 6; ++k) {
            EXPECT_NEAR(share[k], near[k], 2e-3);
            EXPECT_TRUE(share[k] == 0 || d.dot(normals[k]) > SlabShares::kCut);
        }
        two.of(d, std::span(share).first(2));
        EXPECT_EQ(share[d.z > 0 ? 0 : 1], 1);
        one.of(d, std::span(share).first(1));
        EXPECT_EQ(share[0], d.z > 0 ? 1 : 0);
    }
}

TEST(LumigraphFile, SeveralSlabs_RoundTrip) {
    const testing::TemporaryFolder folder;
    const Lumigraph lamp = three_sides();
    write_lumigraph(folder / "lamp.exr", lamp);
    const Lumigraph back = read_lumigraph(folder / "lamp.exr");
    ASSERT_EQ(back.slabs().size(), 3U);
    EXPECT_EQ(content_hash(back), content_hash(lamp));
    EXPECT_EQ(back.box().min, kBox.min);
    EXPECT_EQ(back.box().max, kBox.max);
    EXPECT_EQ(back.captured(), 9);
    EXPECT_EQ(back.missed(), 1.5);
    EXPECT_EQ(back.provenance(), "three sides");
    EXPECT_NEAR(back.flux(), lamp.flux(), 1e-3 * lamp.flux());
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(back.slabs()[i].axes.name(), lamp.slabs()[i].axes.name());
        EXPECT_EQ(content_hash(back.slabs()[i].field), content_hash(lamp.slabs()[i].field));
    }
    write_lumigraph(folder / "again.exr", back);
    EXPECT_EQ(read_text(folder / "again.exr"), read_text(folder / "lamp.exr"));
    // A lamp with another orientation has another hash.
    Lumigraph turned = lamp;
    turned.slabs()[1].axes = SlabAxes::facing(2);
    EXPECT_NE(content_hash(turned), content_hash(lamp));
    EXPECT_THAT(error_of([&] { read_light_field(folder / "lamp.exr"); }), HasSubstr("several parts"));
}

TEST(LumigraphFile, OneSlab_IsTheLightFieldsOwnFile) {
    const testing::TemporaryFolder folder;
    const LightField field = random_field(rig_c(), -1, 3, 7);
    write_light_field(folder / "field.exr", field);
    write_lumigraph(folder / "lamp.exr", Lumigraph(field));
    EXPECT_EQ(read_text(folder / "lamp.exr"), read_text(folder / "field.exr"));
    EXPECT_TRUE(read_lumigraph(folder / "field.exr").simple());
    EXPECT_EQ(content_hash(read_lumigraph(folder / "field.exr")), content_hash(field));
    // A single slab that faces another side is written as one part that states its side; it cannot be read as
    // a light field.
    std::vector<Slab> slabs;
    slabs.push_back({SlabAxes::facing(2), field});
    write_lumigraph(folder / "side.exr", Lumigraph(std::move(slabs), kBox));
    EXPECT_EQ(read_lumigraph(folder / "side.exr").slabs()[0].axes.name(), "+x");
    EXPECT_THAT(error_of([&] { read_light_field(folder / "side.exr"); }), HasSubstr("several sides"));
}

TEST(LumigraphFile, Contradictions_AreRefused) {
    const testing::TemporaryFolder folder;
    write_lumigraph(folder / "lamp.exr", three_sides());
    const std::string good = read_text(folder / "lamp.exr");
    const auto error = [&](const std::string& bytes) {
        std::ofstream(folder / "bad.exr", std::ios::binary) << bytes;
        return error_of([&] { read_lumigraph(folder / "bad.exr"); });
    };
    EXPECT_EQ(error(good), "no error");
    // The layout of an attribute: name, NUL, type, NUL, four bytes of size, value.
    const auto behind = [](const std::string& name, const std::string& type) {
        return name.size() + type.size() + 6;
    };
    EXPECT_THAT(error(replaced(good, "lightfieldSlabs", behind("lightfieldSlabs", "int"), 5)),
                HasSubstr("5 slabs"));
    EXPECT_THAT(error(replaced(good, "lightfieldVersion", behind("lightfieldVersion", "int"), 2)),
                HasSubstr("version 2"));
    EXPECT_THAT(error(replaced(good, "lightfieldVersion", behind("lightfieldVersion", "int"), 9)),
                HasSubstr("version 9"));
    EXPECT_THAT(error(replaced(good, "lightfieldAxisN", behind("lightfieldAxisN", "v3d") + 23, 0x41)),
                HasSubstr("orthonormal"));
    EXPECT_THAT(error(replaced(good, "lightfieldBoxMax", behind("lightfieldBoxMax", "v3d") + 6, 0x11, true)),
                HasSubstr("box"));
    EXPECT_THAT(error(replaced(good, "lightfieldBoxMin", behind("lightfieldBoxMin", "v3d"), 'x') + ""),
                HasSubstr("box"));
    EXPECT_THAT(error(replaced(good, "chunkCount", behind("chunkCount", "int") + 3, 0x70)),
                HasSubstr("chunk count"));
    EXPECT_THAT(error(replaced(good, "scanlineimage", 0, 'S')), HasSubstr("bad.exr"));
    // The slabs have different units.
    std::vector<Slab> slabs;
    LightFieldInfo lumens;
    lumens.unit = FluxUnit::lumen;
    slabs.push_back({SlabAxes::facing(0), random_field(rig_b(), 0, 1, 1)});
    slabs.push_back({SlabAxes::facing(1), random_field(rig_b(), 0, 1, 2, lumens)});
    EXPECT_THAT(error_of([&] { Lumigraph(std::move(slabs), kBox); }), HasSubstr("units"));
    EXPECT_THAT(error_of([&] { Lumigraph(std::vector<Slab>{}, kBox); }), HasSubstr("0 slabs"));
}

TEST(LumigraphFile, Damage_AnyByteOrLength_NeverCrashes) {
    const testing::TemporaryFolder folder;
    write_lumigraph(folder / "lamp.exr", three_sides());
    const std::string good = read_text(folder / "lamp.exr");
    const auto survives = [&](const std::string& bytes) {
        std::ofstream(folder / "bad.exr", std::ios::binary) << bytes;
        try {
            const Lumigraph lamp = read_lumigraph(folder / "bad.exr");
            for (const Slab& slab : lamp.slabs()) {
                EXPECT_EQ(slab.field.rig().fault(), "");
                EXPECT_EQ(slab.axes.fault(), "");
            }
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr("bad.exr"));
        }
    };
    Sampler sampler(12, Purpose::test, 0, 0);
    for (std::size_t length = 1; length < good.size(); length += 1 + good.size() / 60)
        survives(good.substr(0, length));
    for (int i = 0; i < 300; ++i) {
        std::string bad = good;
        const auto at = static_cast<std::size_t>(sampler.next() * static_cast<float>(good.size()));
        bad[std::min(at, good.size() - 1)] = static_cast<char>(sampler.bits());
        survives(bad);
    }
}

TEST(LumigraphFile, Tables_AreKeptTogetherBesideIt) {
    const testing::TemporaryFolder folder;
    const Lumigraph lamp = three_sides();
    testing::ListeningMonitor monitor;
    const auto tables = [&](const Lumigraph& of) {
        return load_or_build_cell_tables(folder / "lamp.exr", fields_of(of), {}, monitor);
    };
    const auto first = tables(lamp);
    EXPECT_EQ(monitor.infos.size(), 1U);
    const auto second = tables(lamp);
    EXPECT_EQ(monitor.infos.size(), 1U);
    ASSERT_EQ(second.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(first[i].flux(), second[i].flux());
        EXPECT_EQ(first[i].field_hash(), second[i].field_hash());
    }
    // A lamp with fewer slabs is another lamp, although its slabs are the first ones of this lamp: the tables
    // are not reused.
    std::vector<Slab> two(lamp.slabs().begin(), lamp.slabs().end() - 1);
    EXPECT_EQ(tables(Lumigraph(std::move(two), kBox)).size(), 2U);
    EXPECT_EQ(monitor.infos.size(), 2U);
    EXPECT_EQ(tables(lamp).size(), 3U);
    EXPECT_EQ(monitor.infos.size(), 3U);
    EXPECT_TRUE(monitor.warnings.empty());
}

}  // namespace lumigraph_file_test
}  // namespace lucerna
