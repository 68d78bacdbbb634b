// Tests a light that can only emit particles: which part of its light each method shows, and that it warns of
// the rest.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/warp.h"
#include "engine/render/render.h"
#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace ray_light_test {

using ::testing::HasSubstr;

constexpr float kAlbedo = 0.5F, kFlux = 8;

// Returns a grey sphere of radius 1 lit by rays from its centre, uniform in direction.
Scene lit_sphere() {
    RaySet set;
    constexpr int kRays = 4000;
    for (int i = 0; i < kRays; ++i) {
        Sampler sampler = Sampler::stratified(31, Purpose::test, 0, static_cast<std::uint32_t>(i));
        set.rays.push_back({V3f(0.0F), square_to_sphere(sampler.next2()), kFlux / kRays});
    }
    set.flux = double{kFlux};
    testing::SceneMaker make;
    make.sphere(V3f(0.0F), 1.0F, make.diffuse(Rgb(kAlbedo)));
    make.light(make_ray_light(std::move(set), RayLightSettings{"rays", M44d(), 1, 0}));
    return make.build();
}

struct Seen {
    double mean;
    std::vector<std::string> warnings;
};

Seen look(const IntegratorSettings& method) {
    testing::ListeningMonitor monitor;
    const Camera inside = testing::camera(V3f(0.0F), {0, 0, 1}, 8, 8, 90);
    const Job job = testing::make_job(lit_sphere(), inside, method, 4);
    const RenderResult result = render(job, {5, Workers{2}}, monitor);
    return {testing::luminance_stats(result.image).mean(), monitor.warnings};
}

TEST(RayLight, InASphere_EachMethodShowsItsShareAndWarnsOfTheRest) {
    // Irradiance in a sphere of radius 1: directly Φ/4π, and ρ/(1 - ρ) times that by reflection.
    const double direct = double{kFlux} / (4 * M_PI) * double{kAlbedo} / M_PI;
    const double reflected = direct * double{kAlbedo} / (1 - double{kAlbedo});
    PhotonMapSettings mapped;
    mapped.photons = 40'000;
    mapped.direct = DirectMethod::map;
    mapped.indirect = IndirectMethod::map;
    const Seen all = look(mapped);
    EXPECT_NEAR(all.mean / (direct + reflected), 1, 0.04);
    EXPECT_TRUE(all.warnings.empty());

    PhotonMapSettings asking = mapped;
    asking.direct = DirectMethod::mc;
    const Seen some = look(asking);
    EXPECT_NEAR(some.mean / reflected, 1, 0.04);
    ASSERT_EQ(some.warnings.size(), 1U);
    EXPECT_THAT(some.warnings[0], HasSubstr("the direct light is missing"));

    IgiSettings igi;
    igi.nlights = 64;
    igi.nsets = 4;
    const Seen vpls = look(igi);
    EXPECT_GT(vpls.mean, 0);
    ASSERT_EQ(vpls.warnings.size(), 1U);
    EXPECT_THAT(vpls.warnings[0], HasSubstr("the direct light is missing"));

    for (const IntegratorSettings& method :
         {IntegratorSettings(PathSettings{}), IntegratorSettings(DirectSettings{})}) {
        const Seen none = look(method);
        EXPECT_EQ(none.mean, 0);
        ASSERT_EQ(none.warnings.size(), 1U);
        EXPECT_THAT(none.warnings[0], HasSubstr("the light is missing"));
        EXPECT_THAT(none.warnings[0], HasSubstr("\"rayfile\""));
    }
}

}  // namespace ray_light_test
}  // namespace lucerna
