// Whatever pbrt renders must be rendered: reads the scenes of lenient/, each with its expected warnings and
// image centre. Their heads state the expectations: each "# warns:" is a substring of one warning, in order;
// "# centre:" gives bounds of the luminance of the four central pixels; "# frames:" is the number of frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "engine/pbrt/material_parts.h"
#include "engine/render/render.h"
#include "engine/system/files.h"
#include "tests/support/error_of.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace leniency_test {

using namespace lucerna::testing;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::filesystem::path kScenes = std::filesystem::path(LUCERNA_SOURCE_DIR) / "tests/pbrt/lenient";

struct Expected {
    std::vector<std::string> warnings;
    double least = 0, most = 0;
    int frames = 1;
};

Expected expectation_in(const std::filesystem::path& file) {
    Expected expected;
    std::istringstream text(read_text(file));
    for (std::string line; std::getline(text, line) && line.starts_with("#");) {
        std::istringstream words(line);
        std::string hash, word;
        words >> hash >> word;
        if (word == "warns:") expected.warnings.push_back(line.substr(9));
        if (word == "centre:") words >> expected.least >> expected.most;
        if (word == "frames:") words >> expected.frames;
    }
    return expected;
}

double centre_of(const Image& image) {
    double sum = 0;
    for (const int y : {image.height / 2 - 1, image.height / 2}) {
        for (const int x : {image.width / 2 - 1, image.width / 2})
            sum += static_cast<double>(luminance(image.rgb_at(x, y))) / 4;
    }
    return sum;
}

std::vector<std::filesystem::path> scene_files() {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(kScenes)) {
        if (entry.path().extension() == ".pbrt") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::string name_of(const ::testing::TestParamInfo<std::filesystem::path>& info) {
    std::string name = info.param.stem().string();
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
}

class LenientScene : public ::testing::TestWithParam<std::filesystem::path> {};

TEST_P(LenientScene, IsRenderedWithOneWarningForEachDeparture) {
    const Expected expected = expectation_in(GetParam());
    ASSERT_GT(expected.least, 0) << "every one of them says what it shows";
    RecordingMonitor monitor;
    SceneOverrides overrides;
    overrides.spp = 64;
    const Workers workers{1};
    SceneFrames frames(GetParam(), overrides, workers, monitor);
    int count = 0;
    for (; const auto job = frames.next(); ++count) {
        const Image image = render(*job, {1, workers}, monitor).image;
        if (count > 0) continue;
        EXPECT_GE(centre_of(image), expected.least);
        EXPECT_LE(centre_of(image), expected.most);
    }
    EXPECT_EQ(count, expected.frames);
    ASSERT_EQ(monitor.warnings.size(), expected.warnings.size())
        << ::testing::PrintToString(monitor.warnings);
    for (std::size_t i = 0; i < expected.warnings.size(); ++i) {
        EXPECT_THAT(monitor.warnings[i], HasSubstr(expected.warnings[i]));
        // Each warning states its place.
        EXPECT_THAT(monitor.warnings[i], ::testing::ContainsRegex("\\.pbrt:[0-9]+:[0-9]+: "));
    }
}

TEST_P(LenientScene, IsRefusedByAStrictReaderForTheSameReason) {
    const Expected expected = expectation_in(GetParam());
    RecordingMonitor monitor;
    SceneOverrides overrides;
    overrides.strict = true;
    const Workers workers{1};
    const std::string error = error_of([&] {
        SceneFrames frames(GetParam(), overrides, workers, monitor);
        while (frames.next()) {
        }
    });
    if (expected.warnings.empty()) {
        EXPECT_EQ(error, "no error") << "nothing departs from the text";
        return;
    }
    // The warning also names what is done instead.
    const std::string& warning = expected.warnings.front();
    EXPECT_THAT(error, HasSubstr(warning.substr(0, warning.find(';')).substr(0, 40)));
}

INSTANTIATE_TEST_SUITE_P(All, LenientScene, ::testing::ValuesIn(scene_files()), name_of);

// ---- frames

TEST(Frames, BeginWithTheOptionsOfTheOneBeforeAndAnEmptyWorld) {
    const std::string text =
        "Camera \"perspective\" \"float fov\" 33 Film \"image\" \"integer xresolution\" 20 \"integer "
        "yresolution\" 10 \"string filename\" \"a.exr\"\n"
        "WorldBegin Material \"matte\" \"rgb Kd\" [.1 .1 .1] MakeNamedMaterial \"m\" \"string type\" "
        "\"mirror\"\n"
        "Translate 5 5 5 Shape \"sphere\" Shape \"disk\" LightSource \"point\" WorldEnd\n"
        "Film \"image\" \"integer xresolution\" 30 \"integer yresolution\" 10 \"string filename\" \"b.exr\"\n"
        "WorldBegin NamedMaterial \"m\" Shape \"sphere\" LightSource \"point\" WorldEnd\n";
    RecordingMonitor monitor;
    const SceneOverrides overrides;
    const Workers workers{1};
    SceneFrames frames(text, "scene.pbrt", overrides, workers, monitor);
    const auto first = frames.next();
    ASSERT_TRUE(first && frames.more());
    const auto second = frames.next();
    ASSERT_TRUE(second && !frames.more());
    EXPECT_FALSE(frames.next());
    EXPECT_EQ(first->scene.counts().quadrics, 2U);
    EXPECT_EQ(second->scene.counts().quadrics, 1U);
    EXPECT_EQ(second->scene.origin(), V3d(0)) << "no transformation is left over";
    EXPECT_EQ(second->camera.settings().fov_degrees, 33);
    EXPECT_EQ(second->film.width, 30);
    EXPECT_EQ(second->film.filename, "b.exr");
    EXPECT_THAT(monitor.warnings, ::testing::ElementsAre(HasSubstr("there is no material \"m\"")));
}

TEST(Frames, WhereOneIsWanted_TheOthersAreLeftOutWithAWarning) {
    const Read read = read_world("Shape \"sphere\" LightSource \"point\" WorldEnd\nWorldBegin WorldEnd");
    EXPECT_EQ(read.draft.quadrics.size(), 1U);
    EXPECT_THAT(read.warnings, ::testing::Contains(AllOf(HasSubstr("scene.pbrt:3:1: "),
                                                         HasSubstr("only the first one is used"))));
}

TEST(Frames, TextAfterTheLastWithoutAWorld_MakesNone) {
    RecordingMonitor monitor;
    const SceneOverrides overrides;
    const Workers workers{1};
    SceneFrames frames(
        std::string(kHead) + "Shape \"sphere\" LightSource \"point\" WorldEnd\nTranslate 1 2 3\n",
        "scene.pbrt", overrides, workers, monitor);
    EXPECT_TRUE(frames.next());
    EXPECT_FALSE(frames.next());
    EXPECT_THAT(monitor.warnings, ::testing::ElementsAre(HasSubstr("has no WorldBegin and is ignored")));
}

// ---- errors that leniency does not cover

TEST(Leniency, ErrorsThatLeaveNoPicture_StayErrors) {
    const auto error = [](const std::string& text) { return error_of([&] { read_file_text(text); }); };
    const std::string head(kHead);
    EXPECT_THAT(error(head + "Shap \"sphere\""), HasSubstr("unknown directive"));
    EXPECT_THAT(error(head + "Shape \"sphere\" \"float radius\" [1 2"), HasSubstr("never closed"));
    EXPECT_THAT(error("Camera \"perspectiv\" WorldBegin"), HasSubstr("unknown Camera"));
    EXPECT_THAT(error("Integrator \"pth\" WorldBegin"), HasSubstr("unknown Integrator"));
    EXPECT_THAT(error(head + "Shape \"plymesh\" \"string filename\" \"no.ply\""), HasSubstr("no such file"));
    EXPECT_THAT(error(head + "Include \"no.pbrt\""), HasSubstr("no such file"));
}

TEST(Leniency, WhatNamesNoFile_IsNoFileOfTheScene) {
    const Read read =
        read_world("Material \"fourier\" Material \"diffuse\" \"string normalmap\" \"\" Shape \"sphere\"");
    EXPECT_TRUE(read.draft.files.empty());
}

TEST(Leniency, EmptyIncludedFile_IsNoError) {
    TemporaryFolder folder;
    std::ofstream(folder / "empty.pbrt").flush();
    RecordingMonitor monitor;
    const Draft draft = read_draft(std::string(kHead) + "Include \"empty.pbrt\" Shape \"sphere\"",
                                   folder / "scene.pbrt", {}, monitor);
    EXPECT_EQ(draft.quadrics.size(), 1U);
    EXPECT_THAT(monitor.warnings, ::testing::Contains(HasSubstr("the file is empty")));
}

TEST(Leniency, MeasuredLamps_AreTakenStrictly) {
    const auto error = [](const std::string& text) { return error_of([&] { read_world(text); }); };
    EXPECT_THAT(error("LightSource \"lightfield\" \"string filename\" \"a\" \"float scale\" -1"),
                HasSubstr("scale"));
    EXPECT_THAT(error("LightSource \"lightfield\" \"string filename\" \"a\" \"float scal\" 1"),
                HasSubstr("has no effect"));
    EXPECT_THAT(error("LightSource \"lightfield\" \"string filename\" \"a\" \"string filename\" \"b\""),
                HasSubstr("given twice"));
    EXPECT_THAT(error("Scale 1 2 1 LightSource \"rayfile\" \"string filename\" \"a\""),
                HasSubstr("stretched"));
}

TEST(Leniency, CommandLinesSettings_AreTakenStrictly) {
    SceneOverrides overrides;
    overrides.set = {{"maxdpth", "3"}};
    EXPECT_THAT(error_of([&] { read_file_text(std::string(kHead), overrides); }),
                HasSubstr("no parameter \"maxdpth\""));
}

TEST(Leniency, FloodOfDifferentWarnings_IsCounted) {
    std::string world = "LightSource \"point\"\n";
    for (int i = 0; i < 1500; ++i) world += "NamedMaterial \"m" + std::to_string(i) + "\"\n";
    const Read read = read_world(world);
    ASSERT_EQ(read.warnings.size(), 1001U) << read.warnings.front();
    EXPECT_EQ(read.warnings.back(), "500 more warnings about the scene's text are not shown");
}

// ---- nurbs

TEST(Nurbs, RationalQuadratic_LiesOnItsCircleWithItsNormals) {
    const Read read = read_world(
        "Shape \"nurbs\" \"integer nu\" 3 \"integer nv\" 2 \"integer uorder\" 3 \"integer vorder\" 2 \"float "
        "uknots\" [0 0 0 1 1 1] \"float vknots\" [0 0 1 1] \"float Pw\" [1 0 0 1 .7071067811865476 "
        ".7071067811865476 0 .7071067811865476 0 1 0 1  1 0 2 1 .7071067811865476 .7071067811865476 "
        "1.414213562373095 .7071067811865476 0 1 2 1]");
    ASSERT_EQ(read.draft.meshes.size(), 1U);
    const DraftMesh& mesh = read.draft.meshes[0];
    EXPECT_EQ(mesh.p.size(), 17U * 17U);
    EXPECT_EQ(mesh.triangles.size(), 2U * 16U * 16U);
    for (std::size_t i = 0; i < mesh.p.size(); ++i) {
        const V3d& p = mesh.p[i];
        ASSERT_NEAR(std::hypot(p.x, p.y), 1, 1e-12);
        ASSERT_NEAR((V3d(mesh.n[i]) - V3d(p.x, p.y, 0)).length(), 0, 1e-6) << "d/du × d/dv points outward";
        ASSERT_NEAR(static_cast<double>(mesh.uv[i].y), p.z / 2, 1e-6);
    }
    EXPECT_EQ(mesh.uv.front(), V2f(0, 0));
    EXPECT_EQ(mesh.uv.back(), V2f(1, 1));
}

TEST(Nurbs, OfLinearOrderAndEvenKnots_InterpolatesItsPoints) {
    const Read read = read_world(
        "Shape \"nurbs\" \"integer nu\" 3 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2 \"float "
        "uknots\" [0 0 1 2 2] \"float vknots\" [0 0 1 1] \"point P\" [0 0 0 1 0 5 2 0 0 0 1 0 1 1 5 2 1 0]");
    const DraftMesh& mesh = read.draft.meshes.at(0);
    EXPECT_EQ(mesh.p.size(), 33U * 17U) << "the knot at 1 is a line of the grid";
    EXPECT_EQ(mesh.p[16], V3d(1, 0, 5));
}

// ---- cameras

TEST(RealisticCamera, IsAThinLensByItsTable) {
    TemporaryFolder folder;
    // A stop of 8 mm behind the front lens appears larger through it, by the ratio in which the ray's height
    // shrinks.
    std::ofstream(folder / "lens.dat") << "# comment\n50 0 1.5 30\n-50 10 1 30\n0 5 0 8\n";
    const auto draft_of = [&](const std::string& rest) {
        RecordingMonitor monitor;
        return read_draft(
            "Camera \"realistic\" \"string lensfile\" \"lens.dat\" " + rest +
                " Film \"image\" \"integer xresolution\" 300 \"integer yresolution\" 200 WorldBegin",
            folder / "scene.pbrt", {}, monitor);
    };
    const Draft far = draft_of("\"float focusdistance\" 1e8 \"float aperturediameter\" 100");
    const double side = 0.035 * 200 / std::hypot(200, 300);
    EXPECT_NEAR(static_cast<double>(far.camera.fov_degrees), 2 * std::atan(side / 2 / 0.05) * 180 / M_PI,
                1e-4);
    EXPECT_NEAR(static_cast<double>(far.camera.lens_radius), 0.004 / 0.8, 1e-7);
    const Draft near = draft_of("\"float focusdistance\" 0.1 \"float aperturediameter\" 2");
    EXPECT_NEAR(static_cast<double>(near.camera.fov_degrees), 2 * std::atan(side / 2 / 0.1) * 180 / M_PI,
                1e-4)
        << "at twice the focal length";
    EXPECT_NEAR(static_cast<double>(near.camera.lens_radius), 0.001 / 0.8, 1e-7);
    EXPECT_NEAR(static_cast<double>(near.camera.focal_distance), 0.1, 1e-7);
    const Draft old = draft_of("\"float filmdistance\" 100");
    EXPECT_NEAR(static_cast<double>(old.camera.focal_distance), 0.1, 1e-7);
}

// ---- tables

template <typename Value>
void append(std::string& to, const std::vector<Value>& values) {
    to.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
}

// Returns a Lambertian surface of the given reflectance and transmittance as a Fourier table.
std::string lambertian_table(double reflectance, double transmittance) {
    constexpr int kCosines = 64;
    std::vector<float> mu, coefficients, cumulative(kCosines * kCosines, 0.0F);
    for (int i = 0; i < kCosines; ++i) mu.push_back(static_cast<float>(-1 + 2.0 * i / (kCosines - 1)));
    std::vector<std::int32_t> offsets;
    for (int o = 0; o < kCosines; ++o) {
        for (int i = 0; i < kCosines; ++i) {
            const float product = mu[static_cast<std::size_t>(i)] * mu[static_cast<std::size_t>(o)];
            const double share = product < 0 ? reflectance : transmittance;
            offsets.push_back(static_cast<std::int32_t>(coefficients.size()));
            offsets.push_back(1);
            coefficients.push_back(static_cast<float>(share / M_PI) *
                                   std::fabs(mu[static_cast<std::size_t>(i)]));
        }
    }
    std::string bytes("SCATFUN\x01", 8);
    append<std::int32_t>(bytes,
                         {1, kCosines, static_cast<std::int32_t>(coefficients.size()), 1, 1, 1, 0, 0, 0});
    append<float>(bytes, {1.5F});
    append<std::int32_t>(bytes, {0, 0, 0, 0});
    append(bytes, mu);
    append(bytes, cumulative);
    append(bytes, offsets);
    append(bytes, coefficients);
    return bytes;
}

TEST(BsdfTable, FourierOfLambert_IsDiffuseOfItsReflectance) {
    TemporaryFolder folder;
    std::ofstream(folder / "a.bsdf", std::ios::binary) << lambertian_table(0.6, 0.3);
    const auto fit = fit_bsdf_table(folder / "a.bsdf");
    ASSERT_TRUE(fit);
    EXPECT_NEAR(static_cast<double>(fit->diffuse.y), 0.6, 0.005);
    EXPECT_NEAR(static_cast<double>(fit->gloss.y), 0, 0.005);
    EXPECT_NEAR(static_cast<double>(fit->transmitted.y), 0.3, 0.005);
}

TEST(BsdfTable, WhatIsCutOffOrNone_IsNothing) {
    TemporaryFolder folder;
    const std::string whole = lambertian_table(0.6, 0);
    for (const std::size_t length :
         {std::size_t{0}, std::size_t{7}, std::size_t{40}, whole.size() / 2, whole.size() - 1}) {
        std::ofstream(folder / "a.bsdf", std::ios::binary)
            << (length == 0 ? "none" : whole.substr(0, length));
        EXPECT_FALSE(fit_bsdf_table(folder / "a.bsdf")) << length;
    }
    // The offsets point beyond the coefficients.
    std::string wild = whole;
    const std::size_t offsets = 8 + 9 * 4 + 4 + 16 + 64 * 4 + 64 * 64 * 4;
    const std::int32_t far = 1 << 30;
    std::memcpy(wild.data() + offsets, &far, sizeof far);
    std::ofstream(folder / "a.bsdf", std::ios::binary) << wild;
    EXPECT_FALSE(fit_bsdf_table(folder / "a.bsdf"));
}

TEST(BsdfTable, MerlOfLambertAndALobe_IsFoundApart) {
    TemporaryFolder folder;
    constexpr std::size_t kCells = 90 * 90 * 180;
    constexpr double kAlpha = 0.1;
    std::vector<double> cells(3 * kCells);
    for (std::size_t h = 0; h < 90; ++h) {
        const double step = static_cast<double>(h) + 0.5;
        const double theta = step * step / 8100 * M_PI / 2, t2 = std::pow(std::tan(theta), 2);
        const double c2 = std::pow(std::cos(theta), 2), a2 = kAlpha * kAlpha;
        const double lobe = 0.2 * a2 / (M_PI * std::pow(c2 * (a2 + t2), 2)) / 4;
        for (std::size_t cell = h * 90 * 180; cell < (h + 1) * 90 * 180; ++cell) {
            cells[cell] = (0.5 / M_PI + lobe) * 1500;
            cells[kCells + cell] = (0.25 / M_PI + lobe) * 1500 / 1.15;
            cells[2 * kCells + cell] = (0.1 / M_PI + lobe) * 1500 / 1.66;
        }
    }
    std::string bytes;
    append<std::int32_t>(bytes, {90, 90, 180});
    append(bytes, cells);
    std::ofstream(folder / "a.binary", std::ios::binary) << bytes;
    const auto fit = fit_bsdf_table(folder / "a.binary");
    ASSERT_TRUE(fit);
    EXPECT_NEAR(static_cast<double>(fit->diffuse.x), 0.5, 0.02);
    EXPECT_NEAR(static_cast<double>(fit->diffuse.z), 0.1, 0.02);
    EXPECT_NEAR(static_cast<double>(fit->gloss.y), 0.2, 0.03);
    EXPECT_NEAR(static_cast<double>(fit->alpha), kAlpha, 0.03);
}

}  // namespace leniency_test
}  // namespace lucerna
