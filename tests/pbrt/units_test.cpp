// The unit that a scene states for all of its light: the meaning of its numbers in lx, cd/m² and lm, the
// conversions, and what is refused.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "engine/render/render.h"
#include "engine/scene/quantity.h"
#include "lights/light_field.h"
#include "lights/ray_set.h"
#include "tests/support/error_of.h"
#include "tests/support/scene_text.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace units_test {

using namespace lucerna::testing;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::string_view kPhotometric = "Option \"string unit\" \"photometric\"\n";
constexpr std::string_view kRadiometric = "Option \"string unit\" \"radiometric\"\n";

// ---- independent of the engine's own tables

// V(λ) every 10 nm from 380 to 780 [CIE 018:2019, the standard's abridged table].
constexpr double kV[] = {0.000039, 0.00012, 0.000396, 0.00121, 0.004,   0.0116,   0.023,    0.038,    0.06,
                         0.09098,  0.13902, 0.20802,  0.323,   0.503,   0.71,     0.862,    0.954,    0.99495,
                         0.995,    0.952,   0.87,     0.757,   0.631,   0.503,    0.381,    0.265,    0.175,
                         0.107,    0.061,   0.032,    0.017,   0.00821, 0.004102, 0.002091, 0.001047, 0.00052,
                         0.000249, 0.00012, 0.00006,  0.00003, 0.000015};
constexpr double kStep = 10, kFrom = 380;

// Returns 683 lm/W ∫ s V dλ by the trapezoidal rule, which the abridged table is intended for.
template <typename Spectrum>
double luminance_of(const Spectrum& per_nanometre) {
    double sum = 0, nm = kFrom;
    for (const double v : kV) {
        sum += per_nanometre(nm) * v * kStep;
        nm += kStep;
    }
    return 683 * sum;
}

// Returns Planck's law in W/(m² sr nm), from h, c and k.
double planck(double kelvin, double nm) {
    constexpr double h = 6.62607015e-34, c = 299792458, k = 1.380649e-23;
    const double m = nm * 1e-9;
    return 2 * h * c * c / std::pow(m, 5) / std::expm1(h * c / (m * k * kelvin)) * 1e-9;
}

std::string samples_of_planck(double kelvin) {
    std::string text;
    for (double nm = 360; nm <= 830; nm += 5) text += fmt::format(" {} {:.8g}", nm, planck(kelvin, nm));
    return text;
}

// ---- a meter at the origin, facing +z

struct Method {
    const char* integrator;
    std::vector<std::pair<std::string, std::string>> set = {};
};
const Method kMethods[] = {{"path"},
                           {"direct"},
                           {"photonmap", {{"photons", "10000"}}},
                           {"igi", {{"nlights", "64"}, {"nsets", "4"}}}};

Job meter_job(const std::string& lights, const Method& method, std::string_view unit) {
    SceneOverrides overrides;
    overrides.strict = true;
    overrides.integrator = method.integrator;
    overrides.set = method.set;
    overrides.set.emplace_back("quantity", "illuminance");
    overrides.spp = 64;
    Monitor monitor;
    const std::string text = std::string(unit) +
                             "LookAt 0.3 0 0.4  0 0 0  0 0 1 Camera \"perspective\" \"float fov\" 1\n"
                             "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16 WorldBegin\n"
                             "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-2 -2 0 "
                             "2 -2 0 2 2 0 -2 2 0]\n"
                             "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n" +
                             lights;
    return read_scene_text(text, "scene.pbrt", overrides, {1}, monitor);
}

// Returns the illuminance E and checks that the image states lx.
double lux(const std::string& lights, const Method& method = kMethods[0]) {
    Monitor silent;
    const RenderResult result = render(meter_job(lights, method, kPhotometric), {3, Workers{1}}, silent);
    EXPECT_EQ(result.image.attributes.at("lucerna.unit"), "lx") << method.integrator;
    return luminance_stats(result.image).mean();
}

TEST(PhotometricScene, DiscOfLuminanceL_LightsThePlaneByPiLSin2) {
    constexpr double kRadius = 0.5, kHeight = 0.8, kLuminance = 5000;
    const double sin2 = kRadius * kRadius / (kRadius * kRadius + kHeight * kHeight);
    const std::string disc =
        "AttributeBegin Translate 0 0 0.8 Rotate 180 1 0 0 AreaLightSource \"diffuse\" {} Shape \"disk\" "
        "\"float "
        "radius\" 0.5 AttributeEnd";
    for (const Method& method : kMethods) {
        const double e = lux(fmt::format(fmt::runtime(disc), "\"rgb L\" [5000 5000 5000]"), method);
        EXPECT_NEAR(e / (M_PI * kLuminance * sin2), 1, 0.01) << method.integrator;
    }
    // A Lambertian disc has Φ = π L A, so E = Φ sin²/A.
    const double of_power = lux(fmt::format(fmt::runtime(disc), "\"blackbody L\" 3000 \"float power\" 800"));
    EXPECT_NEAR(of_power / (800 * sin2 / (M_PI * kRadius * kRadius)), 1, 0.01);
    // The luminance of a colour is its Y.
    const double of_colour = lux(fmt::format(fmt::runtime(disc), "\"rgb L\" [9000 2000 700]"));
    const double y = 0.212671 * 9000 + 0.715160 * 2000 + 0.072169 * 700;
    EXPECT_NEAR(of_colour / (M_PI * y * sin2), 1, 0.01);
}

TEST(PhotometricScene, PointOfCandela_LightsByICosOverD2) {
    // The light at (0.6, 0, 0.8) is a metre away, at cos 0.8.
    const std::string from = " \"point3 from\" [0.6 0 0.8] ";
    for (const Method& method : kMethods) {
        EXPECT_NEAR(lux("LightSource \"point\" \"rgb I\" [250 250 250]" + from, method) / (250 * 0.8), 1,
                    1e-3)
            << method.integrator;
    }
    EXPECT_NEAR(lux("LightSource \"point\" \"blackbody I\" 2700 \"float power\" 1000" + from) /
                    (1000 / (4 * M_PI) * 0.8),
                1, 1e-3);
    const std::string spot =
        "LightSource \"spot\" \"rgb I\" [250 250 250] \"float scale\" 4 \"point3 to\" [0 0 0]" + from;
    EXPECT_NEAR(lux(spot) / (1000 * 0.8), 1, 1e-3);
}

TEST(PhotometricScene, Sky_LightsByPiL_AndIlluminanceIsInLux) {
    for (const Method& method : kMethods) {
        EXPECT_NEAR(lux("LightSource \"infinite\" \"rgb L\" [4000 4000 4000]", method) / (M_PI * 4000), 1,
                    0.01)
            << method.integrator;
    }
    EXPECT_NEAR(lux("LightSource \"infinite\" \"float illuminance\" 12000") / 12000, 1, 0.01);
    // The sun's direction is at cos 0.8 to the meter's normal.
    const std::string sun = "LightSource \"distant\" \"point3 from\" [0.6 0 0.8] \"point3 to\" [0 0 0] ";
    EXPECT_NEAR(lux(sun + "\"blackbody L\" 5800 \"float illuminance\" 100000") / 80000, 1, 1e-3);
    EXPECT_NEAR(lux(sun + "\"rgb L\" [100000 100000 100000]") / 80000, 1, 1e-3) << "L is lx, facing it";
}

double power_of(const std::string& light, std::string_view unit = kPhotometric) {
    RecordingMonitor monitor;
    Draft draft = read_draft(std::string(unit) + std::string(kHead) + light, "scene.pbrt", {}, monitor);
    const SceneParts parts = assemble(std::move(draft), {1}, monitor).parts;
    return parts.lights.at(0)->power();
}
double candela(const std::string& colour, std::string_view unit = kPhotometric) {
    return power_of("LightSource \"point\" \"" + colour, unit) / (4 * M_PI);
}

// The engine's table has steps of 1 nm; the abridged one is accurate to some 1e-4 for smooth spectra.
TEST(PhotometricSpectra, OfSamples_AreWattsAsTheEyeSeesThem) {
    for (const double kelvin : {2041.4, 2856.0, 6500.0}) {
        const double expected = luminance_of([&](double nm) { return planck(kelvin, nm); });
        EXPECT_NEAR(candela("spectrum I\" [" + samples_of_planck(kelvin) + "]") / expected, 1, 5e-4)
            << kelvin;
    }
    // The former definition of the candela: a black body at platinum's freezing point has 60 cd/cm².
    EXPECT_NEAR(luminance_of([](double nm) { return planck(2041.4, nm); }) / 600'000, 1, 0.01);
    // Tests a line of 1 W/sr at 555 nm and an equal-energy spectrum of 1 W/(sr nm).
    EXPECT_NEAR(candela("spectrum I\" [554 0 555 1 556 0]"), 683, 0.5);
    EXPECT_NEAR(candela("spectrum I\" [360 1 830 1]") / luminance_of([](double) { return 1.0; }), 1, 2e-4);
    const TemporaryFolder folder;
    std::ofstream(folder / "lamp.spd") << samples_of_planck(2856);
    EXPECT_NEAR(candela("spectrum I\" \"" + (folder / "lamp.spd").string() + "\"") /
                    luminance_of([&](double nm) { return planck(2856, nm); }),
                1, 5e-4);
    // If another parameter sets the strength, the spectrum is only a colour.
    EXPECT_NEAR(power_of("LightSource \"point\" \"spectrum I\" [400 5 700 5] \"float power\" 60"), 60, 1e-3);
}

TEST(PhotometricSpectra, WithoutAScaleOfTheirOwn_HaveLuminanceScale) {
    for (const char* colour :
         {"blackbody I\" 2856 \"float scale\" 40", "blackbody I\" 9000 \"float scale\" 40",
          "spectrum I\" \"stdillum-A\" \"float scale\" 40",
          "spectrum I\" \"stdillum-F11\" \"float scale\" 40", "rgb I\" [40 40 40]"}) {
        EXPECT_NEAR(candela(colour) / 40, 1, 1e-4) << colour;
    }
    // The colour is that of the same integral. The test of colour_of() covers its ratios; here a photometric
    // scene must not change it.
    const auto colour_of = [](std::string_view unit) {
        const Read read = read_file_text(std::string(unit) + std::string(kHead) +
                                         "LightSource \"point\" \"spectrum I\" [ 400 1 600 3 700 4 ]");
        const Rgb rgb = std::get<PointSpec>(read.draft.lights.at(0).spec).intensity;
        return rgb / luminance(rgb);
    };
    const Rgb apart = colour_of(kPhotometric) - colour_of(kRadiometric);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(apart[c], 0, 1e-6) << c;
}

TEST(RadiometricScene, CountsAsAScenesWithoutAUnit) {
    for (const char* colour : {"spectrum I\" [400 5 700 5]", "blackbody I\" 2856", "blackbody I\" [2856 7]",
                               "rgb I\" [1 2 3]", "spectrum I\" \"stdillum-A\""}) {
        EXPECT_EQ(candela(colour, kRadiometric), candela(colour, "")) << colour;
    }
    EXPECT_EQ(candela("spectrum I\" [360 5 830 5]", kRadiometric), candela("rgb I\" [5 5 5]", kRadiometric));
}

// The image of a scene whose light is given in rgb has the same bits in every unit.
TEST(StatedUnit, ChangesNoBitOfWhatNeedsNoConversion) {
    const std::string lights =
        "LightSource \"infinite\" \"rgb L\" [1 2 3] LightSource \"point\" \"rgb I\" [3 2 1] \"point3 from\" "
        "[0.6 0 0.8]";
    Monitor silent;
    for (const Method& method : kMethods) {
        const Image none = render(meter_job(lights, method, ""), {3, Workers{1}}, silent).image;
        EXPECT_EQ(none.attributes.at("lucerna.unit"), "W/m^2");
        for (const std::string_view unit : {kPhotometric, kRadiometric}) {
            const Image stated = render(meter_job(lights, method, unit), {3, Workers{1}}, silent).image;
            EXPECT_EQ(stated.data, none.data) << method.integrator;
        }
    }
}

TEST(StatedUnit, IsThatOfTheImage_AndTheCommandLineWins) {
    const auto unit_with = [](std::string_view option, std::optional<FluxUnit> asked) {
        SceneOverrides overrides;
        overrides.unit = asked;
        Monitor silent;
        const Job job = read_scene_text(std::string(option) + std::string(kHead) + "LightSource \"point\"",
                                        "scene.pbrt", overrides, {1}, silent);
        EXPECT_EQ(job.scene.lights()[0]->unit(), scene_unit(job.scene));
        return unit_text(Quantity::radiance, scene_unit(job.scene));
    };
    EXPECT_EQ(unit_with("", {}), "W/(m^2 sr)");
    EXPECT_EQ(unit_with(kPhotometric, {}), "cd/m^2");
    EXPECT_EQ(unit_with(kRadiometric, {}), "W/(m^2 sr)");
    EXPECT_EQ(unit_with("", FluxUnit::lumen), "cd/m^2");
    EXPECT_EQ(unit_with(kRadiometric, FluxUnit::lumen), "cd/m^2");
    EXPECT_EQ(unit_with(kPhotometric, FluxUnit::watt), "W/(m^2 sr)");
    // A scene lit only by a glowing medium has no lights that could state a unit.
    const std::string glow =
        "MakeNamedMedium \"gas\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 1 1] \"rgb Le\" [1 1 1]\n"
        "MediumInterface \"gas\" \"\" Material \"interface\" Shape \"sphere\"";
    Monitor silent;
    const Job job =
        read_scene_text(std::string(kPhotometric) + std::string(kHead) + glow, "scene.pbrt", {}, {1}, silent);
    EXPECT_EQ(scene_unit(job.scene), FluxUnit::lumen);
}

TEST(StatedUnit, OfAnotherName_OrTooLate_IsRefused) {
    const std::string head(kHead);
    EXPECT_THAT(
        refusal_of_file("\nOption \"string unit\" \"lumen\" " + head),
        AllOf(HasSubstr("scene.pbrt:2:"), HasSubstr("\"lumen\"; expected photometric or radiometric")));
    EXPECT_THAT(error_of([&] { read_file_text("Option \"string unit\" \"lumen\" " + head); }),
                HasSubstr("lumen"))
        << "not only of a strict reader";
    EXPECT_THAT(refusal_of_file("Option \"float unit\" 1 " + head), HasSubstr("photometric or radiometric"));
    EXPECT_THAT(refusal_of_file("MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" " +
                                std::string(kPhotometric) + head),
                HasSubstr("put it before MakeNamedMedium"));
    EXPECT_THAT(read_file_text(std::string(kPhotometric) + head).warnings, IsEmpty());
    // The unit holds for all frames of a file.
    RecordingMonitor monitor;
    const SceneOverrides none;
    const Workers workers{1};
    SceneFrames frames(std::string(kPhotometric) + head +
                           "LightSource \"point\" WorldEnd WorldBegin LightSource "
                           "\"point\" WorldEnd",
                       "scene.pbrt", none, workers, monitor);
    for (int frame = 0; frame < 2; ++frame)
        EXPECT_EQ(frames.next().value().scene.stated_unit(), FluxUnit::lumen);
}

// ---- lamps that are measured in one unit

class LampsOfAUnit : public ::testing::Test {
  protected:
    void SetUp() override {
        std::ofstream(folder / "lamp.ies")
            << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 180\n0\n100 100\n";
        Rig rig;
        rig.views = rig.pixels = {2, 2};
        rig.spacing = rig.pixel = {0.01, 0.01};
        rig.distance = 0.05;
        for (const FluxUnit unit : {FluxUnit::watt, FluxUnit::lumen}) {
            const std::string name(flux_unit_name(unit));
            LightFieldInfo info;
            info.unit = unit;
            write_light_field(folder / ("field-" + name + ".exr"),
                              LightField(rig, std::vector<float>(16, 1e6F), info));
            RaySet set;
            set.unit = unit;
            set.flux = 2;
            for (int i = 0; i < 4; ++i)
                set.rays.push_back({V3f(0.001F * static_cast<float>(i), 0, 0), V3f(0, 0, 1), 0.5F});
            write_rays(folder / ("rays-" + name + ".ray"), set);
            if (unit == FluxUnit::lumen) continue;
            info.lumens_per_watt = 310;
            write_light_field(folder / "known.exr", LightField(rig, std::vector<float>(16, 1e6F), info));
        }
    }
    std::string lamp(const std::string& kind, const std::string& name, const std::string& more = "") const {
        return fmt::format("LightSource \"{}\" \"string filename\" \"{}\" {} ", kind,
                           (folder / name).string(), more);
    }
    std::string refusal(const std::string& light, std::string_view unit) const {
        return error_of([&] { power_of(light, unit); });
    }

    TemporaryFolder folder;
};

TEST_F(LampsOfAUnit, NeedAnEfficacyInASceneOfTheOther) {
    struct Case {
        std::string kind, watts, lumens;
    };
    for (const auto& [kind, watts, lumens] :
         {Case{"lightfield", "field-W.exr", "field-lm.exr"}, Case{"rayfile", "rays-W.ray", "rays-lm.ray"},
          Case{"ies", "", "lamp.ies"}}) {
        const double lm = power_of(lamp(kind, lumens), "");
        ASSERT_GT(lm, 0) << kind;
        EXPECT_EQ(power_of(lamp(kind, lumens), kPhotometric), lm) << kind;
        EXPECT_EQ(power_of(lamp(kind, lumens, "\"float efficacy\" 300"), kPhotometric), lm) << "not needed";
        EXPECT_NEAR(power_of(lamp(kind, lumens, "\"float efficacy\" 300"), kRadiometric) / (lm / 300), 1,
                    1e-6);
        EXPECT_NEAR(power_of(lamp(kind, lumens, "\"float power\" 7"), kRadiometric), 7, 1e-5) << "W";
        EXPECT_THAT(refusal(lamp(kind, lumens), kRadiometric),
                    AllOf(HasSubstr("scene.pbrt:3:"), HasSubstr(lumens), HasSubstr("measured in lm"),
                          HasSubstr("radiometric"), HasSubstr("\"float efficacy\""),
                          HasSubstr("\"float power\" in W")))
            << kind;
        if (watts.empty()) continue;
        const double w = power_of(lamp(kind, watts), "");
        EXPECT_EQ(power_of(lamp(kind, watts), kRadiometric), w) << kind;
        EXPECT_NEAR(power_of(lamp(kind, watts, "\"float efficacy\" 300 \"float scale\" 2")) / (600 * w), 1,
                    1e-6);
        EXPECT_NEAR(power_of(lamp(kind, watts, "\"float power\" 800")), 800, 1e-3) << "lm";
        EXPECT_THAT(refusal(lamp(kind, watts), kPhotometric),
                    AllOf(HasSubstr("scene.pbrt:3:"), HasSubstr(watts), HasSubstr("measured in W"),
                          HasSubstr("photometric"), HasSubstr("\"float efficacy\""),
                          HasSubstr("\"float power\" in lm")))
            << kind;
    }
}

TEST_F(LampsOfAUnit, ThatKnowTheirEfficacy_NeedNone_AndTheScenesWins) {
    const double w = power_of(lamp("lightfield", "known.exr"), "");
    EXPECT_NEAR(power_of(lamp("lightfield", "known.exr")) / (310 * w), 1, 1e-6);
    EXPECT_NEAR(power_of(lamp("lightfield", "known.exr", "\"float efficacy\" 200")) / (200 * w), 1, 1e-6);
    // The unit is checked for a lamp on a shape too.
    const std::string on =
        fmt::format("AreaLightSource \"lightfield\" \"string filename\" \"{}\" Shape \"sphere\"",
                    (folder / "known.exr").string());
    EXPECT_NEAR(power_of(on) / (310 * w), 1, 1e-6);
}

TEST_F(LampsOfAUnit, EfficacyThatNoLightHas_OrThatHasNoUseYet_IsRefused) {
    for (const char* bad : {"0", "-3", "683.5"}) {
        EXPECT_THAT(refusal(lamp("lightfield", "field-W.exr", fmt::format("\"float efficacy\" {}", bad)),
                            kPhotometric),
                    AllOf(HasSubstr("scene.pbrt:3:"), HasSubstr("at most 683.002")))
            << bad;
    }
    EXPECT_THAT(refusal(lamp("ies", "lamp.ies", "\"float efficacy\" 300"), ""),
                AllOf(HasSubstr("the scene states none"), HasSubstr("Option \"string unit\"")));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"float efficacy\" 300"), HasSubstr("efficacy"))
        << "no lamp that is measured";
}

TEST_F(LampsOfAUnit, BesideOtherLights_AreMixedUntilTheSceneStatesOne) {
    const auto read = [&](std::string_view unit) {
        RecordingMonitor monitor;
        const std::string measured = lamp("ies", "lamp.ies", unit.empty() ? "" : "\"float efficacy\" 300");
        Draft draft = read_draft(std::string(unit) + std::string(kHead) + "LightSource \"point\" " +
                                     measured + " Shape \"sphere\"",
                                 "scene.pbrt", {}, monitor);
        const SceneParts parts = assemble(std::move(draft), {1}, monitor).parts;
        return std::pair(common_unit(parts.lights), monitor.warnings);
    };
    const auto [none, said] = read("");
    EXPECT_EQ(none, std::nullopt);
    EXPECT_THAT(said, Contains(AllOf(HasSubstr("is in lm, but the point light at scene.pbrt:2:1 is in W"),
                                     HasSubstr("Option \"string unit\" \"photometric\""))));
    EXPECT_EQ(read(kPhotometric), (std::pair(std::optional(FluxUnit::lumen), std::vector<std::string>())));
    EXPECT_EQ(read(kRadiometric), (std::pair(std::optional(FluxUnit::watt), std::vector<std::string>())));
}

}  // namespace units_test
}  // namespace lucerna
