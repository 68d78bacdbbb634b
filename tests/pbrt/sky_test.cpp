// LightSource "sky": strength, sun, place, ground and errors.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "lights/sky_luminance.h"
#include "lights/sun_position.h"
#include "tests/support/scene_text.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace sky_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

const std::string kPhotometric = "Option \"string unit\" \"photometric\"\n";
const std::string kRadiometric = "Option \"string unit\" \"radiometric\"\n";
const std::string kSun = "\"vector3 sun\" [0 0.5 0.8660254]";
const std::string kJena =
    "\"float latitude\" 50.9 \"float longitude\" 11.6 \"string time\" \"2026-06-21T13:00:00+02:00\"";

std::vector<std::unique_ptr<Light>> lights_of(const std::string& options, const std::string& world,
                                              bool without_sun = false) {
    RecordingMonitor monitor;
    SceneOverrides overrides;
    overrides.without_sun = without_sun;
    Draft draft = read_draft(options + std::string(kHead) + world + "\nShape \"sphere\"", "scene.pbrt",
                             overrides, monitor);
    return assemble(std::move(draft), {1}, monitor).parts.lights;
}
std::string sky(const std::string& type, const std::string& parameters = "") {
    return fmt::format("LightSource \"sky\" \"string type\" \"{}\" {} ", type, parameters);
}
double luminance_towards(const Light& light, const V3f& w) {
    const auto seen = light.Le(Ray{{0, 0, 0}, w.normalized()});
    return seen ? double{luminance(seen->radiance)} : 0.0;
}

// Estimates the irradiance of a plane by the light's own samples.
RunningStats irradiance(const Light& light, const V3f& normal) {
    RunningStats stats;
    Sampler s(3, Purpose::test, 0, 0);
    for (int i = 0; i < 40000; ++i) {
        const auto drawn = light.sample_Li({0, 0, 0}, s.next2());
        stats.add(drawn ? double{luminance(drawn->weight) * std::max(0.0F, drawn->w.dot(normal))} : 0.0);
    }
    return stats;
}

TEST(Sky, EveryType_HasTheLuminancesOfItsModel) {
    for (int type = 1; type <= kCieSkies; ++type) {
        const auto lights = lights_of(kPhotometric, sky(fmt::format("cie-{}", type), kSun));
        ASSERT_EQ(lights.size(), 1U) << type;
        const SkyModel model = cie_sky(type).value();
        const V3d sun(0, 0.5, std::sqrt(0.75));
        const double zenith = luminance_towards(*lights[0], {0, 0, 1});
        Sampler s(4, Purpose::test, 0, 0);
        for (int i = 0; i < 300; ++i) {
            V3f w = square_to_sphere(s.next2());
            w.z = std::fabs(w.z);
            if (w.z < 0.2F) continue;  // where a texel is coarse beside the gradation
            const double truth =
                model.relative_luminance(V3d(w).normalized(), sun) / model.relative_luminance({0, 0, 1}, sun);
            EXPECT_NEAR(luminance_towards(*lights[0], w) / zenith, truth, 0.03 * truth) << type << ' ' << w;
        }
    }
}

TEST(Sky, Strength_IsTheIlluminanceOfAHorizontalPlane) {
    for (const char* type : {"cie-1", "cie-5", "cie-12", "cie-16"}) {
        const auto usual = lights_of(kPhotometric, sky(type, kSun));
        EXPECT_NEAR(usual[0]->sky_irradiance().value(), 10000, 0.1) << type;
        EXPECT_TRUE(agrees(irradiance(*usual[0], {0, 0, 1}), 10000)) << type;
        EXPECT_FALSE(agrees(irradiance(*usual[0], {0, 1, 0}), 10000)) << type << ", of a wall";
        const auto stated =
            lights_of(kPhotometric, sky(type, kSun + " \"float illuminance\" 500 \"float scale\" 2"));
        EXPECT_NEAR(stated[0]->sky_irradiance().value(), 1000, 0.01) << type;
    }
}

TEST(Sky, WithoutAStatedUnit_CountsInLumens) {
    EXPECT_EQ(lights_of("", sky("cie-16"))[0]->unit(), FluxUnit::lumen);
    EXPECT_EQ(lights_of(kRadiometric, sky("cie-16", "\"float illuminance\" 50"))[0]->unit(), FluxUnit::watt);
    EXPECT_THAT(refusal_of_file(kRadiometric + std::string(kHead) + sky("cie-16")),
                HasSubstr("lacks its strength in W/m²"));
}

TEST(Sky, Weather_GivesBothLightsByItsEfficacies) {
    const std::string weather = "\"float directirradiance\" 600 \"float diffuseirradiance\" 120 ";
    SkyWeather input;
    input.direct_normal = 600;
    input.diffuse_horizontal = 120;
    const AllWeatherSky truth = all_weather_sky(input, kPiD / 6);
    for (const char* type : {"perez", "cie-12"}) {
        const auto lights = lights_of(kPhotometric, sky(type, weather + kSun));
        ASSERT_EQ(lights.size(), 2U) << type;
        EXPECT_NEAR(lights[0]->sky_irradiance().value(), 120 * truth.diffuse_efficacy, 0.2) << type;
        const V3f towards(0, 0.5F, 0.8660254F);
        const double sun = 600 * truth.direct_efficacy;
        EXPECT_NEAR(irradiance(*lights[1], towards).mean(), sun, 1e-5 * sun) << type;
        EXPECT_FALSE(lights[1]->sky_irradiance());
        const auto in_watts = lights_of(kRadiometric, sky(type, weather + kSun));
        EXPECT_NEAR(in_watts[0]->sky_irradiance().value(), 120, 1e-3) << type;
        EXPECT_NEAR(irradiance(*in_watts[1], towards).mean(), 600, 1e-5 * 600) << type;
    }
}

TEST(Sky, Sun_StandsWhereTimeAndPlaceSay) {
    const V3d w = sun_position(parse_time("2026-06-21T13:00:00+02:00").value(), {50.9, 11.6}).direction();
    const auto expect_sun = [](const std::string& world, const V3d& towards) {
        const auto lights = lights_of(kPhotometric, world);
        ASSERT_EQ(lights.size(), 2U);
        EXPECT_GT(luminance_towards(*lights[1], V3f(towards)), 1e8) << world;
        EXPECT_EQ(luminance_towards(*lights[1], V3f(towards + V3d(0.01, 0, 0))), 0) << world;
    };
    const std::string sunny = kJena + " \"float sunilluminance\" 80000 ";
    expect_sun(sky("cie-12", sunny), w);
    expect_sun(sky("cie-12", sunny + "\"vector3 up\" [0 1 0]"), {w.x, w.z, -w.y});
    expect_sun(sky("cie-12", sunny + "\"vector3 north\" [1 0 0]"), {w.y, -w.x, w.z});
    // The current transformation turns sky and sun.
    expect_sun("Rotate -90 1 0 0 " + sky("cie-12", sunny), {w.x, w.z, -w.y});
    EXPECT_GT(w.z, 0.8) << "near noon of midsummer";
    EXPECT_LT(w.y, 0) << "in the south";
}

TEST(Sky, WeatherFile_GivesPlaceTimeAndStrength) {
    const TemporaryFolder folder;
    std::ofstream out(folder / "jena.epw");
    out << "LOCATION,Jena,-,-,none,0,50.9,11.6,1.0,150\n2\n3\n4\n5\n6\n7\n8\n"
        << "2026,6,21,12,0,x,21,10,55,101000,1300,1330,300,700,620,140\n";
    out.close();
    const std::string file = fmt::format("\"string epw\" \"{}\" ", (folder / "jena.epw").string());
    const auto lights = lights_of(kPhotometric, sky("perez", file + "\"string time\" \"06-21T11:20\""));
    ASSERT_EQ(lights.size(), 2U);
    const V3d sun = sun_position(days_since_2000(2026, 6, 21, 10.5), {50.9, 11.6}).direction();
    EXPECT_GT(luminance_towards(*lights[1], V3f(sun)), 1e8);
    SkyWeather weather;
    weather.direct_normal = 620;
    weather.diffuse_horizontal = 140;
    weather.precipitable_water = precipitable_water(10);
    weather.sun_distance = apparent_sun(days_since_2000(2026, 6, 21, 10.5)).distance;
    const double efficacy = all_weather_sky(weather, std::acos(sun.z)).diffuse_efficacy;
    EXPECT_NEAR(lights[0]->sky_irradiance().value(), 140 * efficacy, 0.2);
    EXPECT_THAT(refusal_of_world(sky("perez", file + "\"string time\" \"06-22T11:20\"")),
                HasSubstr("there is no line for 06-22T11:20"));
}

TEST(Sky, Ground_ReflectsSkyAndSun) {
    const std::string sunny = kSun + " \"float sunilluminance\" 50000 \"float ground\" 0.2";
    const double sine = std::sqrt(0.75);
    for (const bool without_sun : {false, true}) {
        const auto lights = lights_of(kPhotometric, sky("cie-12", sunny), without_sun);
        EXPECT_EQ(lights.size(), without_sun ? 1U : 2U);
        const double on_ground = 10000 + (without_sun ? 0 : 50000 * sine);
        EXPECT_NEAR(luminance_towards(*lights[0], {0.3F, 0.2F, -0.01F}), 0.2 * on_ground / kPiD, 0.1);
        EXPECT_NEAR(lights[0]->sky_irradiance().value(), 10000, 0.1) << "the ground lights nothing upwards";
    }
    EXPECT_EQ(luminance_towards(*lights_of(kPhotometric, sky("cie-12", kSun))[0], {0, 0, -1}), 0);
}

TEST(Sky, Faults_AreRefused) {
    const auto expect_refused = [](const std::string& world, const std::string& message) {
        EXPECT_THAT(refusal_of_world(world), HasSubstr(message)) << world;
    };
    expect_refused("LightSource \"sky\"", "scene.pbrt:2:1: LightSource \"sky\" lacks \"string type\"");
    for (const char* type : {"cie-0", "cie-17", "cie-", "cie-1.5", "clear"})
        expect_refused(sky(type), "is unknown; expected cie-1 to cie-16, or perez");
    expect_refused(sky("cie-12"), "lacks the sun's place: \"vector3 sun\"; or \"float latitude\"");
    expect_refused(sky("cie-12", "\"vector3 sun\" [0 0 0]"), "which is not a direction");
    expect_refused(sky("cie-12", "\"vector3 sun\" [0 1 -1]"), "the sun is 45.00 degrees below the horizon");
    expect_refused(sky("cie-12", kSun + kJena), "states the sun's place more than once");
    expect_refused(sky("cie-12", "\"float latitude\" 50 \"string time\" \"2026-06-21T12:00Z\""),
                   "lacks \"float longitude\"");
    expect_refused(sky("cie-12", "\"float latitude\" 50 \"float longitude\" 11"),
                   "has \"latitude\" but lacks \"string time\"");
    expect_refused(sky("cie-12", "\"float latitude\" 50 \"float longitude\" 11 \"string time\" \"noon\""),
                   "\"noon\" is no time; expected date, time and zone");
    expect_refused(sky("cie-12",
                       "\"float latitude\" 95 \"float longitude\" 11 \"string time\" "
                       "\"2026-06-21T12:00Z\""),
                   "latitude of LightSource \"sky\": 95 is not accepted; expected -90 to 90");
    expect_refused(sky("perez", kSun), "\"perez\" lacks the weather");
    expect_refused(sky("perez", kSun + "\"float directirradiance\" 500"),
                   "lacks \"float diffuseirradiance\"");
    expect_refused(sky("perez", kSun + "\"float diffuseirradiance\" 0"),
                   "the sky gives no light at this time");
    expect_refused(sky("cie-1", "\"float sunilluminance\" 1000"), "lacks the sun's place");
    expect_refused(sky("cie-1", "\"vector3 up\" [0 1 0] \"vector3 north\" [0 1 0]"), "is along \"up\"");
    expect_refused(sky("cie-1", "\"float ground\" 1.5"), "expected 0 to 1");
    expect_refused(sky("cie-1", "\"float grund\" 0.5"), "grund");
    expect_refused(sky("perez", "\"string epw\" \"none.epw\" \"string time\" \"06-21T12:30\""), "none.epw");
    EXPECT_EQ(refusal_of_world(sky("cie-16", "\"float ground\" 0.2")), "");
}

TEST(Pane, Transmittance_IsReadAndLimited) {
    const auto pane = [](const std::string& parameters) {
        return "Material \"thindielectric\" " + parameters + " Shape \"sphere\"";
    };
    EXPECT_EQ(refusal_of_world(pane("\"float transmittance\" 0.8")), "");
    EXPECT_THAT(refusal_of_world(pane("\"float transmittance\" 0.95")),
                HasSubstr("is 0.95; expected more than 0 and at most 0.923"));
    EXPECT_THAT(refusal_of_world(pane("\"float transmittance\" 0")), HasSubstr("expected more than 0"));
    const Read read = read_world(pane("\"float eta\" 1.52 \"float transmittance\" 0.88"));
    const auto& material = std::get<ThinDielectricMaterial>(read.draft.materials.back().model);
    EXPECT_EQ(material.transmittance, 0.88F);
}

}  // namespace sky_test
}  // namespace lucerna
