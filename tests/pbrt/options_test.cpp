// Camera, film, filter, sampler, integrator, and command-line overrides.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/scene_text.h"

namespace lucerna {
namespace options_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

Draft options(const std::string& text, const SceneOverrides& overrides = {}) {
    return read_file_text(text + " WorldBegin", overrides).draft;
}
std::string refused(const std::string& text, const SceneOverrides& overrides = {}) {
    return refusal_of_file(text + " WorldBegin", overrides);
}
Camera::Settings built(const std::string& text) {
    Monitor monitor;
    return assemble(options(text), {1}, monitor).camera;
}

TEST(Options, Camera_TakesPbrtsParameters) {
    const Draft draft =
        options("Camera \"perspective\" \"float fov\" 35 \"float lensradius\" .1 \"float focaldistance\" 4");
    EXPECT_EQ(draft.camera.kind, Camera::Settings::Kind::perspective);
    EXPECT_EQ(draft.camera.fov_degrees, 35);
    EXPECT_EQ(draft.camera.lens_radius, 0.1F);
    EXPECT_EQ(draft.camera.focal_distance, 4);
    EXPECT_EQ(options("Camera \"perspective\"").camera.fov_degrees, 90);
    EXPECT_EQ(options("Camera \"perspective\" \"float halffov\" 20").camera.fov_degrees, 40);
    EXPECT_EQ(options("Camera \"orthographic\"").camera.kind, Camera::Settings::Kind::orthographic);
    EXPECT_THAT(refused("Camera \"realistic\""), HasSubstr("lacks \"string lensfile\""));
    EXPECT_THAT(refused("Camera \"perspectiv\""), HasSubstr("did you mean \"perspective\"?"));
    EXPECT_THAT(refused("Camera \"perspective\" \"float fov\" 180"),
                HasSubstr("fov of Camera \"perspective\": 180"));
    EXPECT_THAT(refused("Camera \"perspective\" \"float lensradius\" -1"), HasSubstr("-1 is not accepted"));
}

TEST(Options, ScreenWindow_IsGivenOrFollowsFromTheFrame) {
    const Camera::Settings given =
        built("Camera \"perspective\" \"float screenwindow\" [-2 1 -1 .5] Film \"rgb\"");
    EXPECT_THAT(given.screen, ::testing::ElementsAre(-2, 1, -1, 0.5F));
    const Camera::Settings wide = built("Camera \"perspective\" \"float frameaspectratio\" 2 Film \"rgb\"");
    EXPECT_THAT(wide.screen, ::testing::ElementsAre(-2, 2, -1, 1));
    const Camera::Settings tall = built("Camera \"perspective\" \"float frameaspectratio\" .5 Film \"rgb\"");
    EXPECT_THAT(tall.screen, ::testing::ElementsAre(-1, 1, -2, 2));
    EXPECT_THAT(built("Camera \"perspective\" Film \"rgb\"").screen, ::testing::ElementsAre(0, 0, 0, 0));
    EXPECT_THAT(refused("Camera \"perspective\" \"float screenwindow\" [1 2 3]"),
                HasSubstr("has 3 numbers; expected 4"));
    EXPECT_THAT(refused("Camera \"perspective\" \"float screenwindow\" [1 1 0 2]"), HasSubstr("x0 < x1"));
}

TEST(Options, Film_TakesSizeNameAndExposure) {
    const Draft v3 =
        options("Film \"image\" \"integer xresolution\" 300 \"string filename\" \"a.exr\" \"float scale\" 2");
    EXPECT_EQ(v3.film.width, 300);
    EXPECT_EQ(v3.film.height, 480) << "version 3's default";
    EXPECT_EQ(v3.film.filename, "a.exr");
    EXPECT_EQ(v3.film.scale, 2);
    const Draft v4 = options("Film \"rgb\" \"float iso\" 200 \"float exposuretime\" 2");
    EXPECT_EQ(v4.film.width, 1280);
    EXPECT_EQ(v4.film.height, 720);
    EXPECT_EQ(v4.film.scale, 4);
    EXPECT_THAT(read_file_text("Film \"gbuffer\" WorldBegin").warnings,
                ::testing::Contains(HasSubstr("red, green and blue are written")));
    EXPECT_THAT(refused("Film \"rgb\" \"string sensor\" \"canon_eos_100d\""),
                HasSubstr("sensor \"canon_eos_100d\""));
    const FilmSettings crop = options("Film \"image\" \"float cropwindow\" [.25 .5 0 1]").film;
    EXPECT_EQ(crop.crop_begin, V2i(160, 0));
    EXPECT_EQ(crop.crop_end, V2i(320, 480));
    EXPECT_EQ(crop.rendered_size(), V2i(160, 480));
    EXPECT_EQ(options("Film \"rgb\" \"integer pixelbounds\" [10 30 5 6]").film.rendered_size(), V2i(20, 1));
    EXPECT_THAT(refused("Film \"rgb\" \"float cropwindow\" [.5 .5 0 1]"),
                HasSubstr("leaves no pixel of 1280 x 720"));
    EXPECT_EQ(refused("Film \"rgb\" \"float cropwindow\" [0 1 0 1]"), "");
    EXPECT_THAT(refused("Film \"rgb\" \"integer xresolution\" 0"),
                HasSubstr("xresolution: 0 is not accepted; expected 1 to 65536"));
    EXPECT_THAT(refused("Film \"rgb\" \"string filename\" \"\""), HasSubstr("is empty"));
}

TEST(Options, Filter_IsBoxUnlessTheSceneSays) {
    EXPECT_EQ(options("").film.filter.kind, FilterSettings::Kind::box);
    const FilterSettings box =
        options("PixelFilter \"box\" \"float xwidth\" 1 \"float ywidth\" 2").film.filter;
    EXPECT_EQ(box.radius, V2f(1, 2));
    EXPECT_EQ(options("PixelFilter \"triangle\"").film.filter.radius, V2f(2, 2));
    const FilterSettings v4 = options("PixelFilter \"gaussian\" \"float xradius\" 3").film.filter;
    EXPECT_EQ(v4.radius, V2f(3, 1.5F));
    EXPECT_EQ(v4.sigma, 0.5F);
    const FilterSettings v3 = options("PixelFilter \"gaussian\" \"float alpha\" 0.5").film.filter;
    EXPECT_EQ(v3.radius, V2f(2, 2));
    EXPECT_FLOAT_EQ(v3.sigma, 1);
    const FilterSettings mitchell = options("PixelFilter \"mitchell\" \"float B\" .5").film.filter;
    EXPECT_EQ(mitchell.kind, FilterSettings::Kind::mitchell);
    EXPECT_EQ(mitchell.radius, V2f(2, 2));
    EXPECT_EQ(mitchell.b, 0.5F);
    EXPECT_EQ(options("PixelFilter \"sinc\"").film.filter.radius, V2f(4, 4));
    EXPECT_THAT(refused("PixelFilter \"mitchel\""), HasSubstr("did you mean \"mitchell\"?"));
    EXPECT_THAT(refused("PixelFilter \"box\" \"float xwidth\" 0"), HasSubstr("0 is not accepted"));
    EXPECT_THAT(refused("PixelFilter \"box\" \"float xwidth\" 1 \"float xradius\" 1"),
                HasSubstr("two names of the same parameter"));
}

TEST(Options, Sampler_GivesTheSamplesOfAPixel) {
    EXPECT_EQ(options("").spp, 16);
    EXPECT_EQ(options("Sampler \"halton\" \"integer pixelsamples\" 64").spp, 64);
    EXPECT_EQ(options("Sampler \"stratified\" \"integer xsamples\" 3 \"integer ysamples\" 5").spp, 15);
    EXPECT_TRUE(read_file_text("Sampler \"sobol\" WorldBegin").infos.empty());
    EXPECT_EQ(read_file_text("Sampler \"mine\" WorldBegin").infos.size(), 1U);
    EXPECT_THAT(refused("Sampler \"halton\" \"integer pixelsamples\" 0"),
                HasSubstr("pixelsamples: 0 is not accepted"));
}

TEST(Options, Integrator_TakesItsParametersByTable) {
    EXPECT_TRUE(std::holds_alternative<PathSettings>(options("").integrator));
    EXPECT_EQ(
        std::get<PathSettings>(options("Integrator \"path\" \"integer maxdepth\" 7").integrator).max_depth,
        7);
    const auto photon =
        std::get<PhotonMapSettings>(options("Integrator \"photonmap\" \"integer photons\" 5000 \"string "
                                            "kernel\" \"cone\" \"float radius\" .5")
                                        .integrator);
    EXPECT_EQ(photon.photons, 5000);
    EXPECT_EQ(photon.estimate.kernel, KernelShape::cone);
    EXPECT_EQ(photon.estimate.radius, 0.5F);
    EXPECT_EQ(std::get<IgiSettings>(options("Integrator \"igi\" \"integer nlights\" 128").integrator).nlights,
              128);
    EXPECT_TRUE(std::holds_alternative<DirectSettings>(options("Integrator \"directlighting\"").integrator));
    EXPECT_THAT(
        refused("Integrator \"photonmap\" \"integer photnos\" 1"),
        HasSubstr("scene.pbrt:1:24: \"integer photnos\" of Integrator \"photonmap\" has no effect; did you "
                  "mean \"photons\"?"));
    EXPECT_THAT(refused("Integrator \"photonmap\" \"integer photons\" -1"), HasSubstr("-1 is not accepted"));
    EXPECT_THAT(refused("Integrator \"photonmap\" \"integer photons\" [1 2]"), HasSubstr("has 2 values"));
    EXPECT_THAT(refused("Integrator \"photomap\""), HasSubstr("did you mean \"photonmap\"?"));
}

TEST(Options, IntegratorOfOlderPbrt_IsTranslated) {
    const Read read = read_file_text(
        "SurfaceIntegrator \"photonmap\" \"integer nused\" 75 \"integer finalgathersamples\" 64 \"float "
        "maxdist\" 1.5 "
        "\"bool finalgather\" \"false\" \"integer causticphotons\" 0 WorldBegin");
    const auto photon = std::get<PhotonMapSettings>(read.draft.integrator);
    EXPECT_EQ(photon.estimate.k, 75);
    EXPECT_EQ(photon.gather_rays, 64);
    EXPECT_EQ(photon.estimate.radius, 1.5F);
    EXPECT_EQ(photon.indirect, IndirectMethod::map);
    EXPECT_EQ(photon.caustic_photons, 0) << "no target";
    EXPECT_TRUE(read.draft.film.filename == FilmSettings{}.filename);

    const auto igi = std::get<IgiSettings>(
        options("SurfaceIntegrator \"igi\" \"integer nlights\" 16 \"integer nsets\" 32 \"float glimit\" .25")
            .integrator);
    EXPECT_EQ(igi.nlights, 16);
    EXPECT_EQ(igi.nsets, 32);
    EXPECT_EQ(igi.glimit, 0.25F);
    EXPECT_EQ(igi.mindist, 0) << "the clamp is the only bound, as there";
    EXPECT_EQ(igi.gather_samples, 1);
    EXPECT_THAT(refused("SurfaceIntegrator \"igi\" \"float glimit\" -1"), HasSubstr("a number from 0"));

    const auto rays = [](const std::string& parameters) {
        return std::get<IgiSettings>(options("SurfaceIntegrator \"igi\" " + parameters).integrator);
    };
    EXPECT_EQ(rays("\"integer gathersamples\" 0 \"float glimit\" 1").gather_samples, 0);
    EXPECT_EQ(rays("\"integer gathersamples\" 4").gather_samples, 4);
    EXPECT_EQ(rays("\"float mindist\" .5 \"float glimit\" 3").mindist, 0.5F) << "both, if both are asked for";
    EXPECT_THAT(refused("SurfaceIntegrator \"igi\" \"integer gathersamples\" -2"), HasSubstr("-2"));
}

TEST(Options, RemovedParameter_IsOneWarningThatSaysWhatTakesItsPlace) {
    const Read read = read_file_text(
        "Camera \"perspective\" Film \"rgb\" Integrator \"igi\" \"string choice\" \"tree\" \"bool "
        "compensate\" "
        "\"true\" WorldBegin");
    ASSERT_EQ(read.warnings.size(), 2U);
    EXPECT_THAT(read.warnings[0], AllOf(HasSubstr("\"choice\" has been removed"), HasSubstr("one set")));
    EXPECT_THAT(read.warnings[1],
                AllOf(HasSubstr("\"compensate\" has been removed"), HasSubstr("gathersamples=1")));
}

TEST(Options, EveryRemovedParameter_IsNoneOfTheKnown) {
    IntegratorSettings photonmap{PhotonMapSettings{}};
    EXPECT_TRUE(instead_of_removed(photonmap, "guidek"));
    for (const std::string_view name : integrator_names()) {
        IntegratorSettings settings = make_settings(name, {});
        for (const Field& field : fields(settings))
            EXPECT_FALSE(instead_of_removed(settings, field.name)) << name << " " << field.name;
    }
}

// Fixes the number of parameters that a user has to look through.
TEST(Options, NumberOfParameters) {
    const auto count = [](std::string_view name) {
        IntegratorSettings settings = make_settings(name, {});
        return fields(settings).size();
    };
    EXPECT_LE(count("path"), 5U);
    EXPECT_LE(count("direct"), 2U);
    EXPECT_LE(count("photonmap"), 18U);
    EXPECT_LE(count("igi"), 14U);
    EXPECT_LE(count("progressive"), 9U);
}

TEST(Options, IntegratorsThatAreNotHere_AreReplacedAndItIsSaid) {
    const auto replaced = [](const std::string& name, std::string_view ours) {
        const Read read = read_file_text("Integrator \"" + name + "\" WorldBegin");
        EXPECT_EQ(integrator_name(read.draft.integrator), ours) << name;
        return !read.warnings.empty() && read.warnings.front().find(name) != std::string::npos;
    };
    for (const char* name : {"bdpt", "mlt", "lightpath", "dipolesubsurface"})
        EXPECT_TRUE(replaced(name, "path"));
    EXPECT_FALSE(replaced("sppm", "progressive")) << "the same thing under another name";
    EXPECT_TRUE(replaced("ambientocclusion", "direct"));
    replaced("volpath", "path");
    const Draft sppm =
        options("Integrator \"sppm\" \"integer numiterations\" 10 \"integer photonsperiteration\" 5000");
    EXPECT_EQ(std::get<ProgressiveSettings>(sppm.integrator).photons, 5000);
    EXPECT_EQ(sppm.spp, 40) << "four camera samples per pixel in every pass";
    EXPECT_EQ(options("Integrator \"sppm\" \"integer numiterations\" 9 Sampler \"sobol\" "
                      "\"integer pixelsamples\" 5")
                  .spp,
              36)
        << "wherever the sampler stands";
    EXPECT_EQ(options("Sampler \"sobol\" \"integer pixelsamples\" 5 Integrator \"sppm\"").spp, 5);
    EXPECT_EQ(std::get<ProgressiveSettings>(options("Integrator \"sppm\" \"float radius\" 2").integrator)
                  .estimate.radius,
              2);
    EXPECT_THAT(refused("Integrator \"sppm\" \"integer numiterations\" 0"), HasSubstr("1 to"));
    // In version 2 Metropolis takes precedence over the surface integrator.
    const Draft mlt = options(
        "Renderer \"metropolis\" \"integer samplesperpixel\" 33 SurfaceIntegrator \"directlighting\"");
    EXPECT_EQ(integrator_name(mlt.integrator), "path");
    EXPECT_EQ(mlt.spp, 33);
}

TEST(Options, AmbientOcclusion_IsAWhiteWorldUnderAnEvenSky) {
    const Read read = read_file_text(
        "SurfaceIntegrator \"ambientocclusion\" \"integer nsamples\" 8 WorldBegin\n"
        "LightSource \"point\" AreaLightSource \"diffuse\" Material \"mirror\" Shape \"sphere\"");
    ASSERT_EQ(read.draft.lights.size(), 1U);
    EXPECT_TRUE(std::holds_alternative<InfiniteSpec>(read.draft.lights.front().spec));
    EXPECT_EQ(read.draft.quadrics.front().traits.light, kNoLight);
    ASSERT_FALSE(read.draft.materials.empty());
    for (const Material& material : read.draft.materials) {
        EXPECT_TRUE(std::holds_alternative<DiffuseMaterial>(material.model));
    }
}

TEST(Options, CommandLine_OverridesTheScene) {
    SceneOverrides over;
    over.spp = 3;
    over.output = "b.exr";
    over.resolution = {7, 9};
    over.set = {{"k", "33"}, {"metric", "euclidean"}};
    const Draft draft = options(
        "Film \"rgb\" \"string filename\" \"a.exr\" Sampler \"halton\" "
        "Integrator \"photonmap\" \"integer k\" 50 \"integer gatherrays\" 4",
        over);
    EXPECT_EQ(draft.spp, 3);
    EXPECT_EQ(draft.film.filename, "b.exr");
    EXPECT_EQ(draft.film.width, 7);
    EXPECT_EQ(draft.film.height, 9);
    const auto photon = std::get<PhotonMapSettings>(draft.integrator);
    EXPECT_EQ(photon.estimate.k, 33);
    EXPECT_EQ(photon.gather_rays, 4);
    EXPECT_EQ(photon.estimate.metric, MetricKind::euclidean);
}

TEST(Options, OtherIntegratorOfTheCommandLine_LeavesTheScenesParametersBehind) {
    SceneOverrides over;
    over.integrator = "igi";
    over.set = {{"nsets", "2"}};
    const Read read = read_file_text("Integrator \"photonmap\" \"integer k\" 50 WorldBegin", over);
    EXPECT_EQ(std::get<IgiSettings>(read.draft.integrator).nsets, 2);
    EXPECT_THAT(read.warnings, ::testing::Not(::testing::Contains(HasSubstr("\"integer k\""))));
    over.set = {{"nsets", "two"}};
    EXPECT_THAT(refused("", over), HasSubstr("--set nsets=two: nsets: \"two\" is not accepted"));
    over.integrator = "sppm";
    EXPECT_THAT(refused("", over), HasSubstr("--integrator: unknown integrator \"sppm\""));
}

TEST(Options, WhatIsMissing_IsWarnedOf) {
    const Read read = read_file_text("WorldBegin");
    EXPECT_THAT(read.warnings,
                ::testing::ElementsAre(HasSubstr("no Camera"), HasSubstr("no Film: 640 x 480")));
    EXPECT_THAT(read_file_text("Film \"rgb\" Film \"rgb\" WorldBegin").warnings,
                ::testing::Contains(HasSubstr("a second Film: it replaces the first")));
}

TEST(Options, OtherOptions_AreKnownOrRefused) {
    EXPECT_THAT(read_file_text("Option \"bool disablepixeljitter\" true WorldBegin").warnings,
                ::testing::Contains(HasSubstr("Option \"disablepixeljitter\" has no effect")));
    EXPECT_THAT(refused("Option \"integer nonsense\" 1"), HasSubstr("unknown Option \"nonsense\""));
    EXPECT_THAT(refused("Option \"string unti\" \"photometric\""), HasSubstr("did you mean \"unit\"?"));
    EXPECT_THAT(refused("Option \"string unit\" \"photometrc\""), HasSubstr("did you mean \"photometric\"?"));
    EXPECT_THAT(
        refused("ColorSpace \"rec1\""),
        HasSubstr("ColorSpace \"rec1\" is unknown; expected srgb, rec2020, dci-p3, acescg, aces2065-1"));
    EXPECT_EQ(refused("ColorSpace \"rec2020\""), "");
    EXPECT_EQ(refused("ColorSpace \"acescg\" Film \"rgb\""), "");
    EXPECT_THAT(refused("ColorSpace \"dci-p3\" Film \"rgb\""),
                HasSubstr("an image in ColorSpace \"dci-p3\" is not supported"));
    EXPECT_EQ(refused("Accelerator \"bvh\" \"string splitmethod\" \"sah\""), "");
}

}  // namespace options_test
}  // namespace lucerna
