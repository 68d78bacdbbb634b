#include "lights/light_tree.h"

#include <gtest/gtest.h>

#include <functional>

#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "lights/analytic.h"
#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace light_tree_test {

using Lights = std::vector<std::unique_ptr<Light>>;

V3f random_point(Sampler& sampler, float size) {
    const V2f a = sampler.next2();
    return size * (2.0F * V3f(a.x, a.y, sampler.next()) - V3f(1.0F));
}
V3f random_direction(Sampler& sampler) {
    return square_to_sphere(sampler.next2()).normalized();
}

std::unique_ptr<Light> random_triangle(Sampler& sampler, float size) {
    const V3f p = random_point(sampler, size);
    TriangleEmitter shape;
    shape.p = {p, p + random_point(sampler, 0.2F), p + random_point(sampler, 0.2F),
               p + random_point(sampler, 0.2F)};
    shape.triangles = {{0, 1, 2}, {0, 3, 1}};
    shape.reverse = sampler.next() < 0.5F;
    return make_area_light(std::move(shape), Rgb(sampler.next()), sampler.next() < 0.2F);
}

std::unique_ptr<Light> random_lamp(Sampler& sampler, float size) {
    Rig rig = testing::rig_b();
    MeasuredSettings settings;
    settings.world_from_light.rotate(V3d(random_point(sampler, 3)));
    settings.world_from_light.scale(V3d(2));
    for (int a = 0; a < 3; ++a) settings.world_from_light[3][a] = double{random_point(sampler, size)[a]};
    Monitor silent;
    LightField field = testing::random_field(rig, 0, 1, sampler.bits());
    CellTable table(field, {}, silent);
    return make_measured_light(std::move(field), std::move(table), settings, silent);
}

// Returns lights of every kind that has a position, at random places.
Lights lights_of_every_kind(std::uint64_t seed, int count, float size) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    Lights lights;
    for (int i = 0; i < count; ++i) {
        const V3f p = random_point(sampler, size);
        const V3f d = random_direction(sampler);
        const Rgb power(0.1F + 5 * sampler.next());
        switch (i % 6) {
            case 0:
                lights.push_back(make_point_light(p, power));
                break;
            case 1:
                lights.push_back(make_spot_light(p, d, power, {5 + 150 * sampler.next(), 5}));
                break;
            case 2:
                lights.push_back(make_area_light(DiskEmitter{p, d, 0.3F}, power, false));
                break;
            case 3:
                lights.push_back(
                    make_area_light(SphereEmitter{p, 0.1F, sampler.next() < 0.3F}, power, false));
                break;
            case 4:
                lights.push_back(random_triangle(sampler, size));
                break;
            default:
                lights.push_back(random_lamp(sampler, size));
        }
    }
    return lights;
}

TEST(LightBounds, EveryParticle_StartsInsideAndFliesWithinTheCone) {
    for (const auto& light : lights_of_every_kind(1, 60, 3)) {
        const auto bounds = light->bounds();
        ASSERT_TRUE(bounds) << light->kind();
        Box3f box = bounds->box;
        box.min -= V3f(1e-5F);
        box.max += V3f(1e-5F);
        int emitted = 0;
        for (std::uint64_t i = 0; i < 300; ++i) {
            Sampler sampler(2, Purpose::test, 0, i);
            const LeSampleU u{sampler.next2(), sampler.next2(), sampler.bits()};
            const auto e = light->sample_Le(u);
            if (!e) continue;
            ++emitted;
            EXPECT_TRUE(box.intersects(e->from.p)) << light->kind() << " " << e->from.p;
            const float along = bounds->axis.dot(e->d);
            const float angle =
                std::acos(std::clamp(bounds->two_sided ? std::fabs(along) : along, -1.0F, 1.0F));
            EXPECT_LE(angle, bounds->theta_o + bounds->theta_e + 1e-3F) << light->kind();
        }
        EXPECT_GT(emitted, 0) << light->kind();
    }
}

TEST(LightBounds, Together_HoldBothCones) {
    for (std::uint64_t i = 0; i < 3000; ++i) {
        Sampler sampler(3, Purpose::test, 0, i);
        const auto random = [&] {
            const V3f p = random_point(sampler, 1);
            LightBounds bounds{Box3f(p, p + V3f(0.1F)), random_direction(sampler)};
            bounds.theta_o = sampler.next() < 0.3F ? 0 : kPi * sampler.next();
            bounds.power = sampler.next();
            bounds.two_sided = sampler.next() < 0.3F;
            return bounds;
        };
        const LightBounds a = random();
        LightBounds b = random();
        if (i % 10 == 0) b.axis = -a.axis;
        if (i % 10 == 1) b.axis = a.axis;
        const LightBounds all = union_of(a, b);
        EXPECT_FLOAT_EQ(all.power, a.power + b.power);
        EXPECT_NEAR(all.axis.length(), 1, 1e-5F);
        for (const LightBounds& one : {a, b}) {
            EXPECT_TRUE(all.box.intersects(one.box.min) && all.box.intersects(one.box.max));
            const float along = all.axis.dot(one.axis);
            EXPECT_TRUE(all.two_sided || !one.two_sided);
            const float apart = std::acos(std::clamp(all.two_sided ? std::fabs(along) : along, -1.0F, 1.0F));
            EXPECT_LE(std::min(apart + one.theta_o, kPi), all.theta_o + 1e-3F);
        }
        EXPECT_LE(all.theta_o, kPi);
    }
}

// Returns the probability that any part of the light is picked.
double probability_of(const LightTree& tree, const Lights& lights, const V3f& x, const V3f& n,
                      std::uint32_t light) {
    const std::size_t parts = lights[light]->part_bounds().size();
    if (parts == 0) return double{tree.probability(x, n, light)};
    double sum = 0;
    for (CellId part = 0; part < parts; ++part) sum += double{tree.probability(x, n, light, part)};
    return sum;
}

TEST(LightTree, Picks_ComeWithTheProbabilityStated_AndTheTestSeesWhenTheyDoNot) {
    Lights lights = lights_of_every_kind(4, 50, 3);
    lights.push_back(make_infinite_light(Rgb(1.0F), {{0, 0, 0}, 5}));
    lights.push_back(make_distant_light({0, -1, 0}, Rgb(1.0F), {{0, 0, 0}, 5}));
    lights.push_back(make_point_light({0, 0, 0}, Rgb(0.0F)));
    const LightTree tree(lights);
    constexpr int kDraws = 40'000;
    for (std::uint64_t place = 0; place < 6; ++place) {
        Sampler where(5, Purpose::test, 0, place);
        const V3f x = random_point(where, 3);
        const V3f n = place % 2 == 0 ? V3f(0.0F) : random_direction(where);
        std::vector<std::uint64_t> observed(lights.size() + 1);
        for (std::uint64_t i = 0; i < kDraws; ++i) {
            Sampler sampler(6, Purpose::test, 0, i);
            const auto pick = tree.pick(x, n, sampler.next());
            ++observed[pick ? pick->light : lights.size()];
            if (!pick) continue;
            EXPECT_NEAR(pick->probability, tree.probability(x, n, pick->light, pick->part), 1e-6F);
        }
        std::vector<double> expected;
        double sum = 0;
        for (std::uint32_t i = 0; i < lights.size(); ++i) {
            expected.push_back(kDraws * probability_of(tree, lights, x, n, i));
            sum += expected.back();
        }
        expected.push_back(std::max(0.0, kDraws - sum));
        EXPECT_EQ(tree.probability(x, n, static_cast<std::uint32_t>(lights.size() - 1)), 0);
        EXPECT_TRUE(testing::chi_square(observed, expected).accepted());
        // The probabilities of another place must be rejected.
        std::vector<double> wrong;
        for (std::uint32_t i = 0; i < lights.size(); ++i) {
            wrong.push_back(kDraws * probability_of(tree, lights, x + V3f(0.3F), n, i));
        }
        wrong.push_back(0);
        EXPECT_FALSE(testing::chi_square(observed, wrong).accepted());
    }
}

TEST(LightTree, FewSuns_AreNotPicked_ManyAre) {
    const SceneSphere sphere{{0, 0, 0}, 5};
    for (const std::size_t suns : {std::size_t{1}, LightTree::kMostSuns, LightTree::kMostSuns + 1}) {
        Lights lights;
        lights.push_back(make_infinite_light(Rgb(1.0F), sphere));
        for (std::size_t i = 0; i < suns; ++i)
            lights.push_back(make_distant_light({0, -1, 0}, Rgb(1.0F), sphere));
        const LightTree tree(lights);
        const bool asked_beside = suns <= LightTree::kMostSuns;
        EXPECT_EQ(tree.suns().size(), asked_beside ? suns : 0);
        const V3f x(0, 0, 0), up(0, 1, 0);
        EXPECT_FLOAT_EQ(tree.probability(x, up, 0),
                        asked_beside ? 1.0F : 1.0F / static_cast<float>(suns + 1));
        EXPECT_EQ(tree.probability(x, up, 1) > 0, !asked_beside);
        for (const float u : {0.0F, 0.3F, 0.999F}) {
            const auto pick = tree.pick(x, up, u);
            ASSERT_TRUE(pick);
            if (asked_beside) {
                EXPECT_EQ(pick->light, 0U);
            }
        }
    }
}

// Every light that contributes to a surface has a positive probability.
TEST(LightTree, LightThatArrives_HasAChance) {
    const Lights lights = lights_of_every_kind(7, 90, 3);
    const LightTree tree(lights);
    int arrived = 0;
    for (std::uint64_t i = 0; i < 3000; ++i) {
        Sampler sampler(8, Purpose::test, 0, i);
        const V3f x = random_point(sampler, 3);
        const V3f n = i % 3 == 0 ? V3f(0.0F) : random_direction(sampler);
        for (std::uint32_t l = 0; l < lights.size(); ++l) {
            const auto in = lights[l]->sample_Li(x, sampler.next2());
            if (!in || !(luminance(in->weight) > 0)) continue;
            if (n != V3f(0.0F) && !(n.dot(in->w) > 0)) continue;
            ++arrived;
            EXPECT_GT(tree.probability(x, n, l, in->part ? in->part->part : kNoCell), 0)
                << lights[l]->kind() << " at " << x;
        }
    }
    EXPECT_GT(arrived, 10'000);
}

// The estimator is the irradiance from one picked light over its probability: its mean equals that of picking
// by power, with less noise.
TEST(LightTree, AmongManyLamps_NearOnesAreAsked) {
    Lights lights;
    for (int i = 0; i < 400; ++i) {
        lights.push_back(
            make_point_light({static_cast<float>(i % 20), 0, static_cast<float>(i / 20)}, Rgb(1.0F)));
    }
    const LightTree tree(lights);
    EXPECT_EQ(tree.lights_in_tree(), 400U);
    const LightPicker picker(lights);
    const V3f x(7.3F, -0.4F, 11.6F);
    const V3f up(0, 1, 0);
    const auto arriving = [&](std::uint32_t light) {
        const auto in = lights[light]->sample_Li(x, {});
        return double{in->weight.x} * std::max(0.0, double{in->w.dot(up)});
    };
    double truth = 0;
    for (std::uint32_t i = 0; i < lights.size(); ++i) truth += arriving(i);
    RunningStats by_tree, by_power;
    for (std::uint64_t i = 0; i < 20'000; ++i) {
        Sampler sampler(9, Purpose::test, 0, i);
        const float u = sampler.next();
        const auto from_tree = tree.pick(x, up, u);
        by_tree.add(arriving(from_tree->light) / double{from_tree->probability});
        const auto from_power = picker.pick(u);
        by_power.add(arriving(from_power->light) / double{from_power->probability});
    }
    EXPECT_TRUE(testing::agrees(by_tree, truth));
    EXPECT_TRUE(testing::agrees(by_power, truth));
    EXPECT_LT(by_tree.standard_error(), 0.4 * by_power.standard_error());
}

// A measured lamp that emits all its light into one corner of its bounds' cone.
std::unique_ptr<Light> narrow_lamp(const V3d& at, int corner) {
    Rig rig = testing::rig_b();
    std::vector<float> e(rig.coefficients());
    for (int m = 0; m < rig.views.x; ++m)
        for (int n = 0; n < rig.views.y; ++n)
            for (int k = 0; k < rig.pixels.x / 4; ++k)
                for (int l = 0; l < rig.pixels.y / 4; ++l)
                    e[rig.index(m, n, corner == 0 ? k : rig.pixels.x - 1 - k, l)] = 1;
    MeasuredSettings settings;
    for (int a = 0; a < 3; ++a) settings.world_from_light[3][a] = at[a];
    settings.power = 1;
    Monitor silent;
    LightField field(rig, e);
    CellTable table(field, {}, silent);
    return make_measured_light(std::move(field), std::move(table), settings, silent);
}

TEST(LightTree, OfTwoMeasuredLamps_TheOneWhoseLightArrivesIsAsked) {
    const Rig rig = testing::rig_b();
    Lights lights;
    lights.push_back(narrow_lamp({0, 0, 0}, 0));
    lights.push_back(narrow_lamp({1e-4, 0, 0}, 1));  // beside the first: with the same importance by bounds
    const LightTree tree(lights);
    const double far = 20;  // times the distance of M
    for (const int corner : {0, 1}) {
        const double across = 0.375 * rig.pixels.x * rig.pixel.x, down = 0.375 * rig.pixels.y * rig.pixel.y;
        const V3f x(V3d(corner == 0 ? -across : across, -down, rig.distance) * far);
        const auto lit = static_cast<std::uint32_t>(corner);
        EXPECT_GT(tree.probability(x, V3f(0.0F), lit), 0.9F) << corner;
        EXPECT_GT(tree.probability(x, V3f(0.0F), 1 - lit), 0.0F) << "an estimate is no proof of darkness";
    }
}

// The estimate is compared with the quotient of irradiance and flux from an integral over S by sample_Li(),
// for a lamp that emits less to its sides.
TEST(MeasuredLight, Arriving_IsTheIrradianceOverTheFlux) {
    Rig rig;
    rig.views = {8, 8};
    rig.spacing = {0.004, 0.004};
    rig.pixels = {32, 32};
    rig.pixel = {0.006, 0.006};
    rig.distance = 0.1;
    std::vector<float> e(rig.coefficients());
    for (int m = 0; m < 8; ++m)
        for (int n = 0; n < 8; ++n)
            for (int k = 0; k < 32; ++k)
                for (int l = 0; l < 32; ++l)
                    e[rig.index(m, n, k, l)] =
                        std::exp(-0.005F * static_cast<float>((k - 16) * (k - 16) + (l - 12) * (l - 12)));
    MeasuredSettings settings;
    settings.world_from_light.scale(V3d(2));
    Monitor silent;
    LightField field(rig, e);
    CellTable table(field, {}, silent);
    const auto light = make_measured_light(std::move(field), std::move(table), settings, silent);
    Sampler sampler(11, Purpose::test, 0, 0);
    for (const float away : {0.1F, 1.0F, 100.0F}) {
        for (const V3f& towards : {V3f(0, 0, 1), V3f(0.3F, 0, 1), V3f(-0.2F, -0.5F, 1), V3f(0.4F, 0.4F, 1)}) {
            const V3f x = away * towards;
            const auto stated = light->arriving(x);
            ASSERT_TRUE(stated);
            double found = 0;
            constexpr int kDraws = 4000;
            for (int i = 0; i < kDraws; ++i) {
                if (const auto sample = light->sample_Li(x, sampler.next2()))
                    found += double{luminance(sample->weight)} / kDraws / light->power();
            }
            // At close range the estimate treats S as if all of it were at its centre.
            EXPECT_NEAR(double{*stated} / found, 1, away < 1 ? 0.25 : 0.1) << x;
        }
    }
}

TEST(LightTree, FewOrNone_HaveADefinedAnswer) {
    const LightTree nothing;
    EXPECT_FALSE(nothing.pick({0, 0, 0}, {0, 0, 0}, 0.5F));
    EXPECT_FALSE(LightTree(Lights{}).pick({0, 0, 0}, {0, 1, 0}, 0.5F));

    Lights one;
    one.push_back(make_spot_light({0, 1, 0}, {0, -1, 0}, Rgb(1.0F), {20, 5}));
    const LightTree single(one);
    EXPECT_EQ(single.pick({0, 0, 0}, {0, 1, 0}, 0.99F)->probability, 1);
    EXPECT_FALSE(single.pick({0, 2, 0}, {0, 1, 0}, 0.5F));  // behind the spot light
    EXPECT_EQ(single.probability({0, 2, 0}, {0, 1, 0}, 0), 0);

    Lights sky;
    sky.push_back(make_infinite_light(Rgb(1.0F), {{0, 0, 0}, 1}));
    EXPECT_EQ(LightTree(sky).pick({0, 0, 0}, {0, 1, 0}, 0.99F)->probability, 1);

    // A thousand lights at one place, with powers from 1e-20 to 1e20.
    Lights heap;
    for (int i = 0; i < 1000; ++i) {
        heap.push_back(make_point_light({1, 1, 1}, Rgb(std::pow(10.0F, static_cast<float>(i % 41 - 20)))));
    }
    const LightTree deep(heap);
    for (const V3f& x : {V3f(0, 0, 0), V3f(1, 1, 1), V3f(1e6F, 0, 0)}) {
        double sum = 0;
        for (std::uint32_t i = 0; i < 1000; ++i) sum += double{deep.probability(x, {0, 0, 0}, i)};
        EXPECT_NEAR(sum, 1, 1e-4);
        EXPECT_TRUE(deep.pick(x, {0, 0, 0}, 0.999F));
    }
}

}  // namespace light_tree_test
}  // namespace lucerna
