// Edits of lamps against the transformed emission of the originals: by flux, by radiance along lines, by
// irradiance at points, and by chi-square of the emitted particles.
#include "lights/lamp_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "lights/measured.h"
#include "lights/measurement/acquire.h"
#include "tests/support/error_of.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace lamp_edit_test {

using testing::chi_square_tail;
using ::testing::HasSubstr;
using testing::kFalseAlarm;

constexpr double kSize = 0.01;  // half width of the emitter along x [m]

// Returns a rectangle that is brightest in one corner and shines more to one side: no symmetry is left.
LightField lopsided_field(bool coloured = false) {
    EmitterModel model = cosine_emitter(EmitterModel::Outline::rectangle, {kSize, 0.6 * kSize}, 100, 2,
                                        [](const V2d& p) { return (1.2 + p.x) * (1.5 - p.y); });
    model.radiance = [even = model.radiance](const V2d& p, const V3d& d) {
        return even(p, d) * (1 + 0.6 * d.x - 0.3 * d.y);
    };
    model.setback = 0.002;
    model.info.unit = FluxUnit::lumen;
    if (coloured) set_colours(model, {Rgb(1.0F), Rgb(2.0F, 0.7F, 0.3F), {}});
    Rig rig;
    rig.views = {9, 7};
    rig.spacing = {0.004, 0.004};
    rig.pixels = {14, 12};
    rig.pixel = {0.02, 0.02};
    rig.distance = 0.05;
    rig.centre = {0.003, -0.002, 0.004};
    Monitor silent;
    AcquireOptions coarse;
    coarse.s_nodes = coarse.m_nodes = 2;
    return acquire(model, rig, Workers{2}, silent, coarse);
}

const LightField& lopsided() {
    static const LightField field = lopsided_field();
    return field;
}

// Returns a lamp of slabs towards +z, with half of the light, and towards +x.
Lumigraph two_sided() {
    std::vector<Slab> slabs{{SlabAxes{}, dimmed(Lumigraph(lopsided()), 0.5).slabs()[0].field},
                            {SlabAxes::facing(2), lopsided()}};
    return {std::move(slabs), Box3d(V3d(-0.01, -0.012, -0.005), V3d(0.006, 0.012, 0.006))};
}

// Turns and shifts about no special axis.
LampPlacement askew() {
    return LampPlacement::turn(0, 25)
        .then(LampPlacement::turn(2, -70))
        .then(LampPlacement::move({0.02, 0.03, -0.01}))
        .then(LampPlacement::turn(1, 90));
}

std::unique_ptr<Light> light_of(Lumigraph lamp) {
    Monitor silent;
    std::vector<CellTable> tables;
    for (const LightField* field : fields_of(lamp)) tables.emplace_back(*field, Workers{2}, silent);
    return make_measured_light(std::move(lamp), std::move(tables), MeasuredSettings{}, silent);
}

struct Particle {
    V3d p, d;
    double flux;
    CellId cell;
};
std::vector<Particle> particles(const Light& light, int count, std::uint64_t seed) {
    std::vector<Particle> all;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
        LeSampleU u;
        u.position = sampler.next2();
        u.direction = sampler.next2();
        u.salt = sampler.bits();
        if (const auto one = light.sample_Le(u))
            all.push_back({V3d(one->from.p), V3d(one->d), double{luminance(one->weight)} / count, one->cell});
    }
    return all;
}

// Returns the particles in the frame of the lamp before it was placed.
std::vector<Particle> taken_back(std::vector<Particle> all, const LampPlacement& place) {
    const auto back = [&](const V3d& d) { return V3d(d.dot(place.x), d.dot(place.y), d.dot(place.z)); };
    for (Particle& one : all) one.p = back(one.p - place.origin), one.d = back(one.d);
    return all;
}

// Bins a line by its point on the plane through the lamp, and by its direction.
constexpr int kAcross = 5;
std::size_t bin_of(const Particle& one) {
    const SlabAxes axes = SlabAxes::facing(one.d.z > one.d.x ? 0 : 2);
    const V3d p = axes.to_slab(one.p), d = axes.to_slab(one.d);
    const auto index = [](double x) {
        return static_cast<std::size_t>(std::clamp(static_cast<int>((x + 1) / 2 * kAcross), 0, kAcross - 1));
    };
    const double back = p.z / d.z;
    std::size_t bin = axes.straight() ? 0 : 1;
    for (const double x : {(p.x - back * d.x) / kSize, (p.y - back * d.y) / kSize, d.x, d.y})
        bin = bin * kAcross + index(x);
    return bin;
}

// Returns the p-value of both sets of particles having one distribution, flux included.
double same_distribution(const std::vector<Particle>& a, const std::vector<Particle>& b) {
    struct Bin {
        double a = 0, b = 0, variance = 0;
        int count = 0;
    };
    std::vector<Bin> bins(2 * kAcross * kAcross * kAcross * kAcross);
    for (const bool first : {true, false}) {
        for (const Particle& one : first ? a : b) {
            Bin& bin = bins[bin_of(one)];
            (first ? bin.a : bin.b) += one.flux;
            bin.variance += sqr(one.flux);
            ++bin.count;
        }
    }
    double sum = 0;
    int degrees = 0;
    for (const Bin& bin : bins) {
        if (bin.count < 20) continue;
        sum += sqr(bin.a - bin.b) / bin.variance;
        ++degrees;
    }
    return chi_square_tail(sum, degrees);
}

constexpr int kParticles = 200'000;

// Returns the greatest difference of the radiance along lines before and after, over the greatest radiance.
double radiance_difference(const Lumigraph& lamp, const Lumigraph& edited, const LampPlacement& place) {
    const auto before = light_of(lamp), after = light_of(edited);
    double most = 0, worst = 0;
    for (const Particle& one : particles(*before, 2000, 3)) {
        const V3d far = one.p + 0.5 * one.d;
        const auto seen = before->Le({V3f(far), V3f(-one.d)});
        const auto there = after->Le({V3f(place.point(far)), V3f(-place.vector(one.d))});
        if (!seen) {
            ADD_FAILURE() << "a line of the lamp is not found";
            return INFINITY;
        }
        const double before_edit{luminance(seen->radiance)};
        const double after_edit = there ? double{luminance(there->radiance)} : 0.0;
        most = std::max(most, before_edit);
        worst = std::max(worst, std::fabs(before_edit - after_edit));
    }
    return worst / most;
}

// Returns the irradiance at a point, on a plane of this normal.
RunningStats irradiance_at(const Light& light, const V3d& x, const V3d& normal, int samples = 20'000) {
    RunningStats stats;
    for (int i = 0; i < samples; ++i) {
        Sampler sampler(21, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const auto towards = light.sample_Li(V3f(x), sampler.next2(), {});
        stats.add(towards ? double{luminance(towards->weight)} * std::max(0.0, normal.dot(V3d(towards->w)))
                          : 0.0);
    }
    return stats;
}

void expect_same_emission(const Lumigraph& lamp, const LampPlacement& place) {
    const Lumigraph edited = placed(lamp, place);
    EXPECT_NEAR(edited.flux() / lamp.flux(), 1, 1e-6);
    EXPECT_LT(radiance_difference(lamp, edited, place), 1e-3);
    const auto before = light_of(lamp), after = light_of(edited);
    EXPECT_GT(same_distribution(particles(*before, kParticles, 1),
                                taken_back(particles(*after, kParticles, 2), place)),
              kFalseAlarm);
    const V3d x(0.06, 0.02, 0.1), normal = V3d(-0.3, 0.1, -1).normalized();
    const RunningStats e = irradiance_at(*before, x, normal);
    EXPECT_TRUE(testing::agrees(irradiance_at(*after, place.point(x), place.vector(normal)), e.mean()));
    EXPECT_LT(e.standard_error(), 0.02 * e.mean());
}

TEST(LampEdit, TurnedAndMovedLamp_EmitsTheTurnedAndMovedLight) {
    expect_same_emission(Lumigraph(lopsided()), askew());
    expect_same_emission(two_sided(), askew());
}

TEST(LampEdit, MirroredLamp_EmitsTheMirroredLight) {
    for (const int axis : {0, 1, 2}) expect_same_emission(Lumigraph(lopsided()), LampPlacement::mirror(axis));
    expect_same_emission(two_sided(), LampPlacement::mirror(0).then(askew()));
}

TEST(LampEdit, LampMirroredTwice_IsTheLampBitForBit) {
    const LampPlacement mirror = LampPlacement::mirror(0);
    const Lumigraph lamp(lopsided());
    EXPECT_EQ(content_hash(placed(placed(lamp, mirror), mirror)), content_hash(lamp));
    EXPECT_NE(content_hash(placed(lamp, mirror)), content_hash(lamp));
    EXPECT_TRUE(placed(lamp, mirror).simple()) << "a mirror at a plane through the normal keeps the frame";
    const Lumigraph turned = placed(two_sided(), LampPlacement::turn(1, -90));
    EXPECT_EQ(turned.slabs()[0].axes.name(), "-x") << "quarter turns are exact";
    EXPECT_EQ(turned.slabs()[1].axes.name(), "+z");
}

TEST(LampEdit, SensorThatTravels_IsMirroredToo) {
    Rig rig;
    rig.views = {5, 4};
    rig.spacing = {0.004, 0.003};
    rig.pixels = {9, 8};
    rig.pixel = {0.002, 0.003};
    rig.distance = 0.03;
    rig.shift = {2, 1};
    std::vector<float> e(rig.coefficients());
    for (std::size_t i = 0; i < e.size(); ++i) e[i] = Sampler(4, Purpose::test, 0, i).next();
    const LightField field(rig, e);
    const Lumigraph mirrored = placed(Lumigraph(field), LampPlacement::mirror(0));
    for (int i = 0; i < 1000; ++i) {
        Sampler sampler(5, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f a = sampler.next2(), b = sampler.next2();
        const V2d s((double{a.x} - 0.5) * 0.02, (double{a.y} - 0.5) * 0.015);
        const V2d m((double{b.x} - 0.5) * 0.03, (double{b.y} - 0.5) * 0.03);
        EXPECT_NEAR(field.flux_density(s, m),
                    mirrored.slabs()[0].field.flux_density({-s.x, s.y}, {-m.x, m.y}), 1e-5);
    }
}

TEST(LampEdit, FieldOfSeveralColours_KeepsThemInTheMirror) {
    const LightField field = lopsided_field(true);
    ASSERT_TRUE(field.coloured());
    const Lumigraph mirrored = placed(Lumigraph(field), LampPlacement::mirror(1));
    EXPECT_LT((mirrored.xyz() - field.xyz()).length(), 1e-4);
    for (const int c : {0, 1, 2}) {
        EXPECT_LT(
            radiance_difference(Lumigraph(field.channel(c)), mirrored.channel(c), LampPlacement::mirror(1)),
            2e-3);
    }
}

// The tests above must reject a mirror that forgets the planes: axes that are turned in place of mirrored.
TEST(LampEdit, MirrorThatForgetsThePlanes_IsRejected) {
    const Lumigraph lamp(lopsided());
    const LampPlacement mirror = LampPlacement::mirror(0);
    EXPECT_GT(radiance_difference(lamp, lamp, mirror), 0.2);
    // The planes are mirrored, but the centre of S is not.
    const Rig& rig = lopsided().rig();
    const Lumigraph off(LightField(placed(lamp, mirror).slabs()[0].field).at(rig.centre));
    EXPECT_GT(radiance_difference(lamp, off, mirror), 0.05);
    for (const Lumigraph& wrong : {lamp, off}) {
        EXPECT_LT(same_distribution(particles(*light_of(lamp), kParticles, 1),
                                    taken_back(particles(*light_of(wrong), kParticles, 2), mirror)),
                  kFalseAlarm);
    }
}

TEST(LampEdit, DimmedLamp_HasThatShareOfAllLight) {
    const Lumigraph lamp = two_sided(), half = dimmed(lamp, 0.25);
    EXPECT_NEAR(half.flux() / lamp.flux(), 0.25, 1e-6);
    EXPECT_NEAR(half.missed() / lamp.missed(), 0.25, 1e-9);
    EXPECT_NEAR(half.captured() / lamp.captured(), 0.25, 1e-9);
    const auto whole = light_of(lamp), dim = light_of(half);
    for (const Particle& one : particles(*whole, 200, 4)) {
        const Ray ray{V3f(one.p + 0.2 * one.d), V3f(-one.d)};
        EXPECT_NEAR(luminance(dim->Le(ray)->radiance) / luminance(whole->Le(ray)->radiance), 0.25, 1e-4);
    }
}

const std::vector<std::string> kTwoNames{"first.exr", "second.exr"};

// Both lamps face +z side by side, so that lines lie in the planes of both.
TEST(LampEdit, AddedLamps_EmitTheSumOfTheirLight) {
    const Lumigraph first(lopsided());
    const LampPlacement beside = LampPlacement::mirror(0).then(LampPlacement::move({0.012, 0.004, 0}));
    const Lumigraph second = dimmed(placed(first, beside), 0.5);
    const Lumigraph sum = added({first, second}, kTwoNames);
    EXPECT_NEAR(sum.flux(), first.flux() + second.flux(), 1e-4);
    EXPECT_EQ(sum.slabs().size(), 2U);
    const auto a = light_of(first), b = light_of(second), both = light_of(sum);
    std::vector<Particle> of_parts = particles(*a, kParticles, 1);
    for (const Particle& one : particles(*b, kParticles / 2, 2)) of_parts.push_back(one);
    EXPECT_GT(same_distribution(of_parts, particles(*both, kParticles, 3)), kFalseAlarm);
    EXPECT_LT(same_distribution(particles(*a, kParticles, 1), particles(*both, kParticles, 3)), kFalseAlarm);
    const V3d x(0.03, -0.02, 0.08), normal(0, 0, -1);
    const RunningStats e = irradiance_at(*both, x, normal, 100'000);
    EXPECT_TRUE(testing::agrees(
        e, irradiance_at(*a, x, normal, 100'000).mean() + irradiance_at(*b, x, normal, 100'000).mean(), 5));
    EXPECT_LT(e.standard_error(), 0.01 * e.mean());
}

// A direction leads to one part. Together the parts must find all light, also that of a lamp whose lines lie
// in the planes of another lamp that is dark there.
TEST(LampEdit, PartsOfAddedLamps_FindAllLight) {
    const Lumigraph first(lopsided());
    const Lumigraph second = placed(first, LampPlacement::move({0.015, 0, 0}));
    const auto both = light_of(added({first, second}, kTwoNames));
    std::set<CellId> parts;
    for (const Particle& one : particles(*both, 40'000, 6)) parts.insert(both->part_of(one.cell));
    const V3d x(0.01, 0.01, 0.05);
    RunningStats of_parts;
    for (int i = 0; i < 4000; ++i) {
        Sampler sampler(22, Purpose::test, 0, static_cast<std::uint64_t>(i));
        double sum = 0;
        for (const CellId part : parts) {
            const auto towards = both->sample_Li(V3f(x), sampler.next2(), part);
            if (towards) sum += double{luminance(towards->weight)} * std::fabs(double{towards->w.z});
        }
        of_parts.add(sum);
    }
    const RunningStats whole = irradiance_at(*both, x, {0, 0, -1}, 200'000);
    EXPECT_NEAR(of_parts.mean() / whole.mean(), 1,
                5 * (of_parts.standard_error() + whole.standard_error()) / whole.mean());
    EXPECT_LT(of_parts.standard_error(), 0.02 * whole.mean());
}

TEST(LampEdit, LampsOfDifferentUnits_AreAddedInLumens) {
    const auto in_watts = [](double efficacy) {
        LightFieldInfo info = lopsided().info();
        info.unit = FluxUnit::watt;
        info.lumens_per_watt = efficacy;
        return Lumigraph(LightField(lopsided()).with(std::move(info)));
    };
    const Lumigraph lamp(lopsided());
    const double flux = lamp.flux();
    const Lumigraph mixed = added({lamp, in_watts(200)}, kTwoNames);
    EXPECT_EQ(mixed.unit(), FluxUnit::lumen);
    EXPECT_NEAR(mixed.flux() / flux, 201, 1e-3);
    const Lumigraph alike = added({in_watts(200), in_watts(200)}, kTwoNames);
    EXPECT_EQ(alike.unit(), FluxUnit::watt);
    EXPECT_NEAR(alike.flux() / flux, 2, 1e-5);
    EXPECT_NEAR(added({in_watts(100), in_watts(200)}, kTwoNames).flux() / flux, 300, 1e-3);
    EXPECT_THAT(testing::error_of([&] {
                    added({lamp, in_watts(0)}, kTwoNames);
                }),
                ::testing::AllOf(HasSubstr("second.exr"), HasSubstr("no known luminous efficacy")));
}

TEST(LampEdit, TooManySlabs_AreRefused) {
    std::vector<Lumigraph> lamps(Lumigraph::kMostSlabs + 1, Lumigraph(lopsided()));
    const std::vector<std::string> names(lamps.size(), "lamp.exr");
    EXPECT_THAT(testing::error_of([&] { added(std::move(lamps), names); }), HasSubstr("65 slabs"));
}

TEST(LampEdit, CutLamp_KeepsTheSlabsOfTheseSides) {
    const Lumigraph lamp = two_sided();
    const std::vector<SlabAxes> right{SlabAxes::facing(2), SlabAxes::facing(3)}, below{SlabAxes::facing(1)};
    const Lumigraph cut = cut_to_sides(lamp, right);
    EXPECT_NEAR(cut.flux(), lamp.slabs()[1].field.flux(), 1e-9);
    EXPECT_EQ(cut.slabs()[0].axes.name(), "+x");
    EXPECT_THAT(testing::error_of([&] { cut_to_sides(lamp, below); }), HasSubstr("slabs face +z, +x"));
    // A slab that is turned by less than 45 degrees stays on its side.
    EXPECT_NEAR(cut_to_sides(placed(lamp, LampPlacement::turn(1, 20)), right).flux(), cut.flux(), 1e-6);
}

TEST(LampEdit, Rays_AreEditedOneByOne) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    for (int i = 0; i < 1000; ++i) {
        Sampler sampler(7, Purpose::test, 0, static_cast<std::uint64_t>(i));
        set.rays.push_back({V3f(sampler.next(), 0, 0), square_to_sphere(sampler.next2()), 1});
    }
    set.flux = 1100, set.skipped_flux = 100;
    const LampPlacement place = LampPlacement::mirror(1).then(askew());
    const RaySet turned = placed(set, place);
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        EXPECT_LT((V3d(turned.rays[i].o) - place.point(V3d(set.rays[i].o))).length(), 1e-6);
        EXPECT_LT((V3d(turned.rays[i].d) - place.vector(V3d(set.rays[i].d))).length(), 1e-6);
    }
    EXPECT_NEAR(dimmed(set, 0.5).flux, 550, 1e-9);
    EXPECT_NEAR(dimmed(set, 0.5).rays[3].flux, 0.5, 1e-9);
    const std::vector<SlabAxes> up{SlabAxes::facing(0)};
    const RaySet cut = cut_to_sides(set, up);
    for (const LampRay& ray : cut.rays) EXPECT_GE(ray.d.z, std::max(std::fabs(ray.d.x), std::fabs(ray.d.y)));
    EXPECT_NEAR(cut.flux, 1.1 * static_cast<double>(cut.rays.size()), 1e-9);
    EXPECT_NEAR(static_cast<double>(cut.rays.size()), 1000.0 / 6, 5 * std::sqrt(1000 * 5.0 / 36));
    const std::vector<SlabAxes> right{SlabAxes::facing(2)};
    EXPECT_THAT(testing::error_of([&] { cut_to_sides(cut, right); }), HasSubstr("no ray leaves"));
}

TEST(LampEdit, EditedLamp_IsReadBackFromItsFile) {
    const testing::TemporaryFolder folder;
    const Lumigraph lamp = added({Lumigraph(lopsided()), placed(Lumigraph(lopsided()), askew())}, kTwoNames);
    write_lumigraph(folder / "lamp.exr", lamp);
    const Lumigraph read = read_lumigraph(folder / "lamp.exr");
    ASSERT_EQ(read.slabs().size(), 2U);
    EXPECT_EQ(read.slabs()[1].axes.u, lamp.slabs()[1].axes.u);
    EXPECT_EQ(read.box().min, lamp.box().min);
    EXPECT_NEAR(read.flux() / lamp.flux(), 1, 1e-3);
}

}  // namespace lamp_edit_test
}  // namespace lucerna
