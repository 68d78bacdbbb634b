// Tests incident light stored in a few sectors of directions.
#include "photon/incident_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "tests/support/photons.h"

namespace lucerna {
namespace incident_light_test {

using testing::kUp;

struct Arriving {
    Rgb irradiance;
    V3f wi;
};

// Returns an irradiance of 1 W/m² from directions that `direction(u)` draws in proportion to radiance times
// cosine.
template <typename Direction>
std::vector<Arriving> arriving(Direction&& direction) {
    constexpr int kParts = 4096;
    Sampler sampler(5, Purpose::test, 0, 0);
    std::vector<Arriving> all;
    for (int i = 0; i < kParts; ++i) all.push_back({Rgb(1.0F / kParts), direction(sampler.next2())});
    return all;
}

IncidentLight sectors_of(const std::vector<Arriving>& all) {
    IncidentLightSum sum(kUp);
    for (const Arriving& light : all) sum.add(light.irradiance, light.wi);
    return sum.light();
}

// The reference: sums over all directions.
Rgb exact(const std::vector<Arriving>& all, const Bsdf& bsdf, const V3f& wo) {
    Rgb sum(0.0F);
    for (const Arriving& light : all) {
        sum += bsdf.f(wo, light.wi, Transport::radiance) * light.irradiance *
               shading_cosine_ratio(bsdf, light.wi);
    }
    return sum;
}

// Treats all light as coming from its mean direction, which the test must reject.
Rgb by_one_direction(const std::vector<Arriving>& all, const Bsdf& bsdf, const V3f& wo) {
    V3f mean(0.0F);
    for (const Arriving& light : all) mean += luminance(light.irradiance) * light.wi;
    mean.normalize();
    return bsdf.f(wo, mean, Transport::radiance) * shading_cosine_ratio(bsdf, mean);
}

V3f cosine_sky(const V2f& u) {
    return square_to_cosine_hemisphere(u);
}
// Returns directions from a window low on one side, with twice the light of the sky above.
V3f window(const V2f& u) {
    if (u.x < 0.33F) return square_to_cosine_hemisphere({u.x / 0.33F, u.y});
    return V3f(std::cos(0.2F * u.y), std::sin(0.2F * u.y), 0.15F + 0.1F * u.x).normalized();
}

const V3f kObliquely = V3f(0.6F, 0.2F, 0.5F).normalized();

Bsdf bsdf_of(const Lobe& lobe, const V3f& ns = kUp) {
    return {lobe, ns, kUp, V3f(1, 0, 0)};
}

TEST(IncidentLight, OnALambertianSurface_IsItsIrradiance) {
    for (const auto direction : {&cosine_sky, &window}) {
        const Rgb radiance =
            sectors_of(arriving(direction)).radiance(bsdf_of(DiffuseLobe{Rgb(0.5F)}), kObliquely, kUp);
        EXPECT_NEAR(radiance.x, 0.5F / kPi, 1e-5F);
    }
}

// For varnish, which reflects most at grazing incidence, and Oren and Nayar's rough surface, the error is
// within 2 % of the sum over all directions. For a normal bent by 20 degrees towards a window or away from it
// it is within 6 %, as light from below the bent horizon counts, too, which the mean direction of a sector
// does not represent. A single mean direction has a larger error.
TEST(IncidentLight, OnOtherSurfacesWithoutAPeak_IsNearlyTheSumOverAllDirections) {
    const V3f towards = V3f(std::sin(0.35F), 0, std::cos(0.35F)), away(-towards.x, 0, towards.z);
    const std::vector<Bsdf> surfaces = {
        bsdf_of(DiffuseLobe{Rgb(0.5F)}, towards), bsdf_of(DiffuseLobe{Rgb(0.5F)}, away),
        bsdf_of(SubstrateBaseLobe{Rgb(0.5F), Rgb(0.04F)}), bsdf_of(oren_nayar(Rgb(0.5F), 0.6F))};
    double worst_of_one = 0;
    for (const auto direction : {&cosine_sky, &window}) {
        const std::vector<Arriving> all = arriving(direction);
        const IncidentLight light = sectors_of(all);
        for (const Bsdf& surface : surfaces) {
            const double right{exact(all, surface, kObliquely).x};
            const bool bent = surface.shading_normal() != kUp;
            EXPECT_NEAR(double{light.radiance(surface, kObliquely, kUp).x} / right, 1, bent ? 0.06 : 0.02);
            const double one{by_one_direction(all, surface, kObliquely).x};
            worst_of_one = std::max(worst_of_one, std::fabs(one / right - 1));
        }
    }
    EXPECT_GT(worst_of_one, 0.05) << "the same comparison must see what a single direction loses";
}

TEST(IncidentLight, FromBelowTheHorizonOfThePlace_CountsAsComingAlongIt) {
    IncidentLightSum sum(kUp);
    sum.add(Rgb(1.0F), V3f(0.999F, 0, 0.0447F).normalized());
    const V3f turned = V3f(-0.3F, 0, 1).normalized();  // the light is below its horizon
    const Bsdf bsdf(DiffuseLobe{Rgb(1.0F)}, turned, turned, V3f(0, 1, 0));
    EXPECT_NEAR(sum.light().radiance(bsdf, turned, turned).x, 1 / kPi, 1e-4F);
}

TEST(IncidentLight, Black_IsBlackEverywhere) {
    EXPECT_TRUE(is_black(IncidentLightSum(kUp).light().radiance(bsdf_of(DiffuseLobe{Rgb(1.0F)}), kUp, kUp)));
}

}  // namespace incident_light_test
}  // namespace lucerna
