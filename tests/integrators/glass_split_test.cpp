// Tests splitting at smooth glass: following both reflection and transmission has the mean of following one,
// with less noise.
#include <gtest/gtest.h>

#include "engine/base/stats.h"
#include "engine/transport/follow.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace glass_split_test {

const V3f kUp(0, 0, 1), kAcross(1, 0, 0);
const DielectricLobe kGlass{1.5F, Rgb(1.0F), Rgb(0.8F), 0, 0};

Bsdf surface(const Lobe& lobe) {
    return {lobe, kUp, kUp, kAcross};
}
V3f outwards(float cosine) {
    return {std::sqrt(1 - cosine * cosine), 0, cosine};
}

TEST(ReflectChance, OfGlassAndPanes_IsWhereSamplesTurn) {
    for (const Lobe& lobe : {Lobe(kGlass), Lobe(ThinDielectricLobe{1.5F, Rgb(0.9F)}),
                             Lobe(ThinDielectricLobe{1.5F, Rgb(1), 0.5F})}) {
        for (const float cosine : {1.0F, 0.5F, 0.1F, -0.9F}) {
            const Bsdf bsdf = surface(lobe);
            const auto chance = bsdf.reflect_chance(outwards(cosine));
            ASSERT_TRUE(chance);
            const auto transmits = [&](float u) {
                return bsdf.sample(outwards(cosine), {u, V2f(0.5F)}, Transport::radiance)->transmission;
            };
            EXPECT_FALSE(transmits(*chance - 1e-5F)) << cosine;
            EXPECT_TRUE(transmits(*chance + 1e-5F)) << cosine;
        }
    }
    EXPECT_FALSE(surface(MirrorLobe{Rgb(0.9F)}).reflect_chance(kUp));
    DielectricLobe rough = kGlass;
    rough.alpha_x = rough.alpha_y = 0.2F;
    EXPECT_FALSE(surface(rough).reflect_chance(kUp));
}

// The radiance seen by reflection and by transmission: a bright reflection before a dim background.
struct Seen {
    float mirrored, behind;
    float operator()(const BsdfSample& way) const {
        return luminance(way.weight) * (way.transmission ? behind : mirrored);
    }
};

struct Noise {
    RunningStats one_way, both_ways;
};
Noise look(float cosine, const Seen& seen, float mistake = 1) {
    const Bsdf glass = surface(kGlass);
    const V3f wo = outwards(cosine);
    Noise noise;
    for (std::uint64_t i = 0; i < 40'000; ++i) {
        Sampler sampler(5, Purpose::test, 0, i);
        const BsdfU u{sampler.next(), sampler.next2()};
        noise.one_way.add(double{seen(*glass.sample(wo, u, Transport::radiance))});
        const auto split = follow_detail::split_at_glass(glass, wo, sampler);
        BsdfSample brighter = *glass.sample(wo, split->brighter, Transport::radiance);
        brighter.weight *= split->share;
        double sum{seen(brighter)};
        if (split->fainter) sum += static_cast<double>(mistake * seen(*split->fainter));
        noise.both_ways.add(sum);
    }
    return noise;
}

// Three comparisons at 4 sigmas: false alarms below 2e-4.
TEST(GlassSplit, BothWays_HaveTheMeanOfOneInLessNoise) {
    for (const float cosine : {1.0F, 0.3F, -0.8F}) {
        const Noise noise = look(cosine, {20, 0.3F});
        const double error = std::hypot(noise.one_way.standard_error(), noise.both_ways.standard_error());
        EXPECT_LT(std::fabs(noise.one_way.mean() - noise.both_ways.mean()), 4 * error) << cosine;
        EXPECT_LT(noise.both_ways.variance(), 0.5 * noise.one_way.variance()) << cosine;
    }
}

TEST(GlassSplit, AFaintWayThatWeighsHalfAsMuch_IsSeen) {
    const Noise noise = look(1, {20, 0.3F}, 0.5F);
    const double error = std::hypot(noise.one_way.standard_error(), noise.both_ways.standard_error());
    EXPECT_GT(std::fabs(noise.one_way.mean() - noise.both_ways.mean()), 4 * error);
}

TEST(GlassSplit, TotalReflection_HasOneWay) {
    Sampler sampler(5, Purpose::test, 0, 0);
    EXPECT_FALSE(follow_detail::split_at_glass(surface(kGlass), outwards(-0.3F), sampler));
}

}  // namespace glass_split_test
}  // namespace lucerna
