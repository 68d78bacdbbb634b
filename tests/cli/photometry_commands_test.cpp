// `lucerna lux` and `lucerna glare`: what they write, print and refuse.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "engine/base/vec.h"
#include "engine/image/image.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace photometry_commands_test {

using ::testing::HasSubstr;
using ::testing::Not;
using RunPhotometry = testing::RunTest;
using testing::lucerna_run;
using testing::Outcome;

std::string level(double z) {
    return fmt::format("Shape \"bilinearmesh\" \"point3 P\" [0 0 {0} 4 0 {0} 0 5 {0} 4 5 {0}]\n", z);
}

// Writes three slabs one above the other, under a sky that is visible from the sides.
void write_house() {
    std::ofstream("house.pbrt") << "Option \"string unit\" \"photometric\"\nLookAt 2 -3 1.6 2 5 1.6 0 0 1\n"
                                   "Camera \"perspective\" Film \"rgb\" WorldBegin\n"
                                   "LightSource \"infinite\" \"rgb L\" [5000 5000 5000]\n"
                                   "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n"
                                << level(0) << level(3) << level(6);
}

std::string text_of(const std::string& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
}

TEST_F(RunPhotometry, Floors_AreSurfacesOfTheirOwn) {
    write_house();
    const Outcome lux = lucerna_run({"lux", "house.pbrt", "--floors", "0.75", "--spacing", "2", "--samples",
                                     "4", "-o", "lux.csv", "--quiet"});
    EXPECT_EQ(lux.code, 0) << lux.err;
    EXPECT_THAT(lux.out, HasSubstr("floor 1 at 0, height 0.75"));
    EXPECT_THAT(lux.out, HasSubstr("floor 2 at 3, height 0.75"));
    EXPECT_THAT(lux.out, Not(HasSubstr("floor 3")));
    EXPECT_THAT(text_of("lux.csv"), HasSubstr(",3.75,"));
}

TEST_F(RunPhotometry, DaylightFactor_IsInAllOutputs) {
    write_house();
    const Outcome lux = lucerna_run({"lux", "house.pbrt", "--height", "0.75", "--spacing", "2", "--samples",
                                     "4", "--daylight-factor", "-o", "lux.csv", "--json", "lux.json",
                                     "--html", "lux.html", "--image", "lux.exr", "--quiet"});
    EXPECT_EQ(lux.code, 0) << lux.err;
    EXPECT_THAT(lux.out,
                HasSubstr("daylight factor in %; ± is the half-width of the 95 % confidence interval; "
                          "100 % is 15708 lx, the illuminance of an unobstructed horizontal plane"));
    EXPECT_THAT(text_of("lux.csv"), HasSubstr("z,D [%],half-width of 95 % [%],direct [%],indirect [%]\n"));
    EXPECT_THAT(text_of("lux.html"), HasSubstr("<h2>Daylight factor</h2>"));
    EXPECT_THAT(text_of("lux.html"), HasSubstr("mean [%]"));
    EXPECT_EQ(read_exr("lux.exr").attributes.at("lucerna.unit"), "%");
    const auto json = nlohmann::json::parse(text_of("lux.json"));
    EXPECT_EQ(json["quantity"], "daylight factor");
    EXPECT_EQ(json["unit"], "%");
    EXPECT_NEAR(json["sky_illuminance"].get<double>(), kPiD * 5000, 1);
    const Outcome plain = lucerna_run({"lux", "house.pbrt", "--height", "0.75", "--spacing", "2", "--samples",
                                       "4", "--json", "plain.json", "--quiet"});
    EXPECT_EQ(plain.code, 0) << plain.err;
    const auto in_lux = nlohmann::json::parse(text_of("plain.json"));
    EXPECT_EQ(in_lux["quantity"], "illuminance");
    for (const char* number : {"mean", "least", "greatest"}) {
        const double lx = in_lux["surfaces"][0][number]["value"].get<double>();
        EXPECT_NEAR(json["surfaces"][0][number]["value"].get<double>(), 100 * lx / (kPiD * 5000), 1e-4)
            << number;
    }
}

TEST_F(RunPhotometry, DaylightFactor_OfOtherLights_IsRefused) {
    const auto refused = [](const std::string& lights, const std::vector<std::string>& more,
                            const std::string& message) {
        std::ofstream("room.pbrt") << "Camera \"perspective\" Film \"rgb\" WorldBegin\n"
                                   << lights << level(0) << level(3);
        std::vector<std::string> line{"lux", "room.pbrt", "--height", "0.75", "--daylight-factor"};
        line.insert(line.end(), more.begin(), more.end());
        const Outcome outcome = lucerna_run(line);
        EXPECT_NE(outcome.code, 0) << message;
        EXPECT_THAT(outcome.err, HasSubstr(message));
    };
    const std::string sky = "LightSource \"sky\" \"string type\" \"cie-16\"\n";
    refused("LightSource \"point\"\n", {}, "room.pbrt: the scene has a point light, but a daylight factor");
    refused(sky + "LightSource \"distant\"\n", {}, "the scene has a distant light");
    refused(sky + sky, {}, "the scene has more than one sky");
    refused(sky, {"--far-field-error"}, "--far-field-error: is about lamps");
    refused(sky, {"--replicates"}, "--replicates: is about lamps");
}

TEST_F(RunPhotometry, Glare_UnderASky_HasDgpAndAView) {
    write_house();
    const Outcome glare = lucerna_run({"glare", "house.pbrt", "--image", "view.exr", "-o", "glare.csv",
                                       "--json", "glare.json", "--precision", "10%", "--quiet"});
    EXPECT_EQ(glare.code, 0) << glare.err;
    EXPECT_THAT(glare.out, HasSubstr("DGP"));
    EXPECT_THAT(text_of("glare.csv"), HasSubstr("DGP,half-width of 95 % of DGP,UGR CIE 232\n"));
    EXPECT_THAT(text_of("glare.json"), HasSubstr("\"dgp\""));
    const Image view = read_exr("view.exr");
    EXPECT_EQ(view.width, view.height);
    EXPECT_EQ(view.attributes.at("lucerna.unit"), "cd/m^2");
    EXPECT_EQ(view.rgb_at(0, 0), Rgb(0));
    // Straight ahead lies the sky between two slabs, above it a slab that is darker.
    EXPECT_NEAR(view.rgb_at(view.width / 2, view.height / 2).y, 5000, 10);
    EXPECT_LT(view.rgb_at(view.width / 2, view.height / 4).y, 4500);
    EXPECT_EQ(lucerna_run({"falsecolour", "view.exr", "-o", "view.svg", "--layer", "denoised"}).code, 0);
}

TEST_F(RunPhotometry, Long_Glare_OnAGridUnderASky_HasAPlanOfDgp) {
    write_house();
    const Outcome glare =
        lucerna_run({"glare", "house.pbrt", "--floors", "1.2", "--margin", "1", "--spacing", "9", "--view",
                     "0,1,0", "--plan", "ugr.svg", "--precision", "20%", "--quiet"});
    EXPECT_EQ(glare.code, 0) << glare.err;
    for (const char* file : {"ugr.svg", "ugr-dgp.svg", "ugr-2.svg", "ugr-2-dgp.svg"})
        EXPECT_TRUE(std::filesystem::exists(file)) << file;
    EXPECT_THAT(text_of("ugr-dgp.svg"), HasSubstr(">DGP</text>"));
    EXPECT_THAT(text_of("ugr-dgp.svg"), HasSubstr("class=\"value\""));
}

TEST_F(RunPhotometry, Glare_WithoutASky_HasNoDgp) {
    std::ofstream("room.pbrt") << "Option \"string unit\" \"photometric\"\nLookAt 2 1 1.6 2 5 1.6 0 0 "
                                  "1\nCamera \"perspective\" Film "
                                  "\"rgb\" WorldBegin\n"
                                  "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5000 5000 "
                                  "5000]\nTranslate 0 0 2.9 Scale 1 1 -1\n"
                               << level(0) << "AttributeEnd\n"
                               << level(0);
    const Outcome glare = lucerna_run({"glare", "room.pbrt", "--precision", "10%", "--quiet"});
    EXPECT_EQ(glare.code, 0) << glare.err;
    EXPECT_THAT(glare.out, Not(HasSubstr("DGP")));
}

// Writes a point lamp of 100 cd, 2 m above the level z = 0 and beside the points.
void write_point() {
    std::ofstream("point.pbrt") << "Option \"string unit\" \"photometric\"\nLookAt 0 0 -3  0 0 0  0 1 0\n"
                                   "Camera \"perspective\" Film \"rgb\" WorldBegin\n"
                                   "LightSource \"point\" \"rgb I\" [100 100 100] \"point3 from\" [1 2 2]\n";
}

TEST_F(RunPhotometry, LuxColour_IsThatOfALampOfKnownSpectrum) {
    write_point();
    const auto lux = [](const std::string& scene) {
        return lucerna_run({"lux", scene, "--surface", "eye=0,0,0:0,0,1e-5:1e-5,0,0", "--facing", "0,0,1",
                            "--colour", "--samples", "4", "--quiet", "--json", "-", "-o", "eye.csv", "--html",
                            "eye.html"});
    };
    const Outcome unknown = lux("point.pbrt");
    EXPECT_EQ(unknown.code, 1);
    EXPECT_THAT(unknown.err, HasSubstr("point.pbrt:4:"));
    EXPECT_THAT(unknown.err, HasSubstr("the spectrum of this light is not known"));
    std::string text = text_of("point.pbrt");
    text.replace(text.find("\"rgb I\" [100 100 100]"), 21, "\"blackbody I\" 3000");
    std::ofstream("warm.pbrt") << text;
    const Outcome warm = lux("warm.pbrt");
    EXPECT_EQ(warm.code, 0) << warm.err;
    const auto of = nlohmann::json::parse(warm.out)["surfaces"][0];
    const auto value = [&of](const char* name) { return of["colour"][name]["value"].get<double>(); };
    EXPECT_NEAR(value("CCT"), 3000, 2);
    EXPECT_NEAR(value("R_a"), 100, 0.1);
    EXPECT_NEAR(value("R_f"), 100, 0.1);
    // A black body of 3000 K has a melanopic DER between those of 2856 K, 0.496, and of 4000 K.
    const double der = value("m-EDI") / of["mean"]["value"].get<double>();
    EXPECT_GT(der, 0.50);
    EXPECT_LT(der, 0.56);
    EXPECT_THAT(text_of("eye.csv"), HasSubstr(",m-EDI [lx],"));
    EXPECT_THAT(text_of("eye.html"), HasSubstr("Colour of the light"));
}

TEST_F(RunPhotometry, Lux_OfAKindWithoutAFacing_RefusesOne) {
    write_point();
    const auto lux = [](const std::string& kind, const std::string& facing) {
        std::vector<std::string> line{"lux",     "point.pbrt", "--surface", "p=0,0,0:0,0,1e-5:1e-5,0,0",
                                      "--kind",  kind,         "--samples", "4",
                                      "--quiet", "--json",     "-"};
        if (!facing.empty()) line.insert(line.end(), {"--facing", facing});
        return lucerna_run(line);
    };
    for (const char* kind : {"cylindrical", "spherical"}) {
        const Outcome turned = lux(kind, "1,0,0");
        EXPECT_EQ(turned.code, 1);
        EXPECT_THAT(turned.err,
                    HasSubstr(std::string("a ") + kind + " sensor receives light from all sides"));
        EXPECT_THAT(turned.err, HasSubstr("--surface"));
    }
    // For 100 cd at 3 m a cylinder along y reads sin ε = √5/3 over π.
    const Outcome upright = lux("cylindrical", "");
    EXPECT_EQ(upright.code, 0) << upright.err;
    EXPECT_NEAR(nlohmann::json::parse(upright.out)["surfaces"][0]["mean"]["value"].get<double>(),
                100.0 / 9 * std::sqrt(5.0) / 3 / kPiD, 0.02);
    for (const char* kind : {"planar", "hemispherical"}) EXPECT_EQ(lux(kind, "1,0,0").code, 0) << kind;
    EXPECT_EQ(lux("semicylindrical", "1,0,0").code, 0);
    // The surface may also be given in the scene.
    std::ofstream("named.pbrt", std::ios::app)
        << text_of("point.pbrt")
        << "CalculationSurface \"p\" \"point3 P\" [0 0 0 0 0 1 1 0 0] \"string kind\" "
           "\"cylindrical\" \"vector3 facing\" [1 0 0]\n";
    const Outcome named = lucerna_run({"lux", "named.pbrt", "--quiet"});
    EXPECT_EQ(named.code, 1);
    EXPECT_THAT(named.err, HasSubstr("named.pbrt:5"));
    EXPECT_THAT(named.err, HasSubstr("a cylindrical sensor"));
}

TEST_F(RunPhotometry, Lengths_AreMetresOrHaveAUnit) {
    write_house();
    const auto lux = [](const std::string& height, const std::string& margin, const std::string& spacing,
                        const std::string& surface) {
        return lucerna_run({"lux", "house.pbrt", "--height", height, "--margin", margin, "--spacing", spacing,
                            "--surface", surface, "--samples", "2", "--quiet"});
    };
    const Outcome plain = lux("0.75", "0.5", "1", "desk=1,1,0.75:2,1,0.75:1,2,0.75"),
                  units = lux("75cm", "500mm", "1m", "desk=1m,100cm,750mm:2,1,0.75:1,2000mm,75cm");
    EXPECT_EQ(plain.code, 0) << plain.err;
    EXPECT_EQ(units.code, 0) << units.err;
    const auto table = [](const std::string& out) { return out.substr(0, out.rfind("samples")); };
    EXPECT_EQ(table(plain.out), table(units.out));
    const Outcome eye = lucerna_run(
        {"glare", "house.pbrt", "--eye", "a=1,-100cm,1200mm:1,2,1.2", "--precision", "20%", "--quiet"});
    EXPECT_EQ(eye.code, 0) << eye.err;
    EXPECT_THAT(eye.out, HasSubstr("1 -1 1.2"));
    EXPECT_THAT(lux("75in", "0", "1", "d=0,0,0:1,0,0:0,1,0").err, HasSubstr("--height: \"75in\""));
}

TEST_F(RunPhotometry, Glare_WithoutARating_LeavesItsCellsEmpty) {
    write_house();
    // Under the sky alone there is no luminaire to rate; in a black room the background is 0.
    std::ofstream("black.pbrt")
        << "Option \"string unit\" \"photometric\"\nLookAt 0 0 0 0 0 1 0 1 0 Camera \"perspective\" Film "
           "\"rgb\" WorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource \"diffuse\" "
           "\"rgb L\" [9000 9000 9000] Translate 0 0.5 2 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" "
           "0.1\n";
    const auto glare = [](const std::string& scene) {
        return lucerna_run({"glare", scene, "--precision", "20%", "-o", "glare.csv", "--json", "glare.json"});
    };
    const Outcome sky = glare("house.pbrt");
    EXPECT_EQ(sky.code, 0) << sky.err;
    EXPECT_THAT(text_of("glare.csv"), Not(HasSubstr("inf")));
    EXPECT_THAT(text_of("glare.csv"), HasSubstr(",,,"));
    const Outcome black = glare("black.pbrt");
    EXPECT_EQ(black.code, 0) << black.err;
    EXPECT_THAT(black.out, HasSubstr("undefined"));
    EXPECT_THAT(black.err, HasSubstr("background luminance"));
    EXPECT_THAT(text_of("glare.csv"), Not(HasSubstr("nan")));
    EXPECT_THAT(text_of("glare.json"), HasSubstr("\"value\": null"));
}

TEST_F(RunPhotometry, WhatCannotBe_IsRefusedInALine) {
    write_house();
    std::ofstream("slope.pbrt")
        << "Option \"string unit\" \"photometric\"\nCamera \"perspective\" Film \"rgb\" "
           "WorldBegin\nLightSource \"infinite\" Rotate 30 1 0 0\n"
        << level(0);
    const auto refused = [](std::vector<std::string> line, const std::string& why) {
        const Outcome outcome = lucerna_run(line);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_THAT(outcome.err, HasSubstr(why));
    };
    refused({"lux", "slope.pbrt", "--floors", "0.75", "--up", "z"},
            "--floors: the scene has no level surface");
    refused({"lux", "house.pbrt", "--floors", "0.75", "--margin", "3"},
            "--floors: there is nothing left of a plane");
    refused({"lux", "house.pbrt", "--floors", "-1"}, "--floors: \"-1\"");
    refused({"glare", "house.pbrt", "--threshold", "bright"}, "--threshold: \"bright\"");
    refused({"glare", "house.pbrt", "--plan", "ugr.svg"}, "--plan: needs a grid of observers");
    refused({"glare", "house.pbrt", "--image", "view.png"}, "view.png: the output's name must end in .exr");
}

}  // namespace photometry_commands_test
}  // namespace lucerna
