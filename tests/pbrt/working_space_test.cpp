// Renders in wider spaces than sRGB: light keeps its luminance, and colours outside sRGB stay unchanged.
#include "engine/colour/working_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/colour/chromaticity.h"
#include "engine/image/image.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "engine/scene/texture_image.h"
#include "lights/ray_set.h"
#include "photon/luminaire.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace working_space_test {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::RecordingMonitor;
using testing::TemporaryFolder;

WorkingSpace space(std::string_view name) {
    return WorkingSpace::named(name).value();
}

// Ratios in three intervals are means over each of them, light is white with its luminance.
TEST(Intervals, OfWavelengths_HaveMeansOfRatiosAndWhiteLight) {
    const WorkingSpace intervals = WorkingSpace::of_intervals({400, 500, 600, 700});
    const Spectrum slope{{400, 0}, {700, 1}};
    const Rgb ratio = intervals.ratio_of_spectrum(slope);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(ratio[i], (static_cast<float>(i) + 0.5F) / 3, 1e-6F);
    EXPECT_EQ(intervals.ratio_of_spectrum(Spectrum{{555, 0.25}}), Rgb(0.25F));
    EXPECT_EQ(intervals.ratio(Rgb(0.3F)), Rgb(0.3F));
    // Red, green and blue are linear between 450, 540 and 610 nm: the mean of blue from 400 to 500 nm is that
    // of 1 up to 450 nm and of a line from 1 to 4/9 beyond.
    const Rgb blue = intervals.ratio(Rgb(0, 0, 1));
    EXPECT_NEAR(blue.x, 0.5F + 0.5F * (1 + 4.0F / 9) / 2, 1e-4F);
    EXPECT_EQ(blue.z, 0);
    const Rgb sum = intervals.ratio(Rgb(1, 0, 0)) + intervals.ratio(Rgb(0, 1, 0)) + blue;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(sum[i], 1, 1e-6F);
    EXPECT_NEAR(intervals.light(Rgb(1, 2, 3)).x, luminance(Rgb(1, 2, 3)), 1e-6F);
    EXPECT_EQ(intervals.light_of_xyz({0.3, 0.5, 2}), Rgb(0.5F));
    const Spectrum line{{450, 1}, {451, 2}};
    EXPECT_NEAR(intervals.light_of_spectrum(line).y, emission_xyz(line).y, 1e-6);
    EXPECT_EQ(intervals.white(), Rgb(1));
    EXPECT_FALSE(intervals == WorkingSpace());
}

// Each light gets a group with its spectrum. A light whose spectrum is not known is named.
TEST(Intervals, OfAScene_GroupLightsBySpectrum) {
    const auto groups_of = [](const std::string& lights) {
        SceneOverrides overrides;
        overrides.colours = WorkingSpace::of_intervals({400, 500, 600, 700});
        Monitor silent;
        return read_scene_text("Camera \"perspective\" Film \"rgb\" WorldBegin\n" + lights, "scene.pbrt",
                               overrides, Workers{1}, silent)
            .scene.light_groups();
    };
    const LightGroups groups = groups_of(
        "LightSource \"point\" \"spectrum I\" \"stdillum-A\" \"string lightgroup\" \"x\"\n"
        "LightSource \"point\" \"blackbody I\" 4000\nLightSource \"distant\" \"spectrum L\" \"stdillum-A\"\n"
        "AreaLightSource \"diffuse\" \"spectrum L\" [450 1 455 1]\nShape \"sphere\"\n");
    ASSERT_EQ(groups.names.size(), 3U);
    EXPECT_EQ(groups.of_light, (std::vector<std::uint32_t>{0, 1, 0, 2}));
    for (const BandSpectrum& spectrum : groups.spectra) EXPECT_NEAR(band_lumens(spectrum), 1, 1e-9);
    EXPECT_NEAR(colour_rendition(groups.spectra[1])->temperature.kelvin, 4000, 1);
    for (const std::string light : {"\"rgb I\" [1 1 1]", "\"spectrum I\" \"stdillum-F2\"", ""}) {
        try {
            groups_of("LightSource \"point\" " + light + "\n");
            ADD_FAILURE() << light;
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr("scene.pbrt:2:"));
            EXPECT_THAT(error.what(), HasSubstr("spectrum of this light is not known"));
        }
    }
}

struct Method {
    std::string integrator;
    std::vector<std::pair<std::string, std::string>> set = {};
    int samples = 4;  // per pixel
};

const std::vector<Method> kMethods{
    {"path"},
    {"direct"},
    {"photonmap", {{"photons", "5000"}}},
    {"photonmap", {{"photons", "5000"}, {"direct", "map"}, {"indirect", "map"}}},
    {"photonmap", {{"photons", "5000"}, {"direct", "guided"}}},
    {"igi", {{"nlights", "16"}, {"nsets", "4"}, {"causticpaths", "2000"}}},
    {"igi", {{"nlights", "16"}, {"nsets", "4"}, {"gathersamples", "1"}}},
    {"progressive", {{"photons", "5000"}}}};

Job job_of(const std::string& text, const Method& method, const WorkingSpace& colours,
           const TemporaryFolder& folder) {
    SceneOverrides overrides;
    overrides.integrator = method.integrator;
    overrides.set = method.set;
    overrides.colours = colours;
    overrides.resolution = {12, 9};
    overrides.spp = method.samples;
    RecordingMonitor monitor;
    return read_scene_text(text, folder / "scene.pbrt", overrides, Workers{2}, monitor);
}

Image rendered(const std::string& text, const Method& method, const WorkingSpace& colours,
               const TemporaryFolder& folder) {
    RecordingMonitor monitor;
    RenderOptions options;
    options.workers = Workers{2};
    return render(job_of(text, method, colours, folder), options, monitor).image;
}

// Returns the CIE XYZ of an image's mean.
V3d mean_xyz(const Image& image) {
    V3d sum(0);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) sum += V3d(image.rgb_at(x, y));
    }
    const ColourSpace& of = image.space ? *image.space : colour_spaces().front();
    return of.to_xyz(sum / (image.width * image.height));
}

// Returns the distance in the diagram of u' and v'.
double off_in_colour(const V3d& a, const V3d& b) {
    const Chromaticity p = chromaticity(a), q = chromaticity(b);
    return std::hypot(p.u - q.u, p.v - q.v);
}

// A grey box open to the viewer, with a mirror ball, lit by a white area and a white point.
const std::string kGreyRoom = R"(
LookAt 0 0 -3  0 0 0  0 1 0
Camera "perspective" "float fov" 50
Film "rgb"
WorldBegin
AttributeBegin
AreaLightSource "diffuse" "rgb L" [4 4 4]
Translate 0 0.99 0  Rotate 90 1 0 0
Shape "disk" "float radius" 0.3
AttributeEnd
LightSource "point" "rgb I" [0.3 0.3 0.3] "point3 from" [0.5 -0.5 -0.5]
Material "diffuse" "rgb reflectance" [0.6 0.6 0.6]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-1 -1 -1  1 -1 -1  1 -1 1  -1 -1 1]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-1 -1 1  1 -1 1  1 1 1  -1 1 1]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-1 1 -1  1 1 -1  1 1 1  -1 1 1]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-1 -1 -1  -1 -1 1  -1 1 1  -1 1 -1]
Material "conductor" "rgb reflectance" [0.8 0.8 0.8] "float roughness" 0
Translate 0.3 -0.6 0.2
Shape "sphere" "float radius" 0.35
)";

// Grey surfaces and white light give the same image in every space, pixel by pixel and by every method, up to
// float32's rounding of the light's factors per channel, which accumulates over many sums.
TEST(WorkingSpaces, GreyRoom_IsTheSameImageByEveryMethod) {
    const TemporaryFolder folder;
    for (const Method& method : kMethods) {
        const Image srgb = rendered(kGreyRoom, method, {}, folder);
        EXPECT_EQ(srgb.space, nullptr);
        double mean = 0;
        for (const float v : srgb.data) mean += double{v} / static_cast<double>(srgb.data.size());
        ASSERT_GT(mean, 0.01);
        for (const std::string_view name : {"rec2020", "acescg"}) {
            const Image image = rendered(kGreyRoom, method, space(name), folder);
            ASSERT_EQ(image.space, find_colour_space(name));
            for (int y = 0; y < image.height; ++y) {
                for (int x = 0; x < image.width; ++x) {
                    const Rgb a = image.rgb_at(x, y), b = srgb.rgb_at(x, y);
                    for (int c = 0; c < 3; ++c)
                        ASSERT_NEAR(a[c], b[c], 2e-4 * (mean + double{b[c]}))
                            << method.integrator << ' ' << name << ' ' << x << ' ' << y << ' ' << c;
                }
            }
        }
    }
}

// Returns a white patch that fills the view, lit by `light`.
std::string patch_under(const std::string& light) {
    return R"(LookAt 0 0 -2  0 0 0  0 1 0
Camera "perspective" "float fov" 20
Film "rgb"
WorldBegin
Material "diffuse" "rgb reflectance" [0.8 0.8 0.8]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-4 -4 0  4 -4 0  4 4 0  -4 4 0]
)" + light;
}

// The photometric quantities that a scene asks for hold in every space: a patch of reflectance 0.8 under E
// lux has the luminance 0.8 E / π, one under a point of Φ lm has 0.8 Φ / (4 π² r²). Rec. 709's weights
// applied to the wide spaces' numbers would make the green light below wrong by 5 % or more.
TEST(WorkingSpaces, IlluminanceAndPower_AreThoseAskedFor) {
    const TemporaryFolder folder;
    const std::string colour = "ColorSpace \"acescg\" ";
    for (const std::string_view rgb : {"[1 1 1]", "[0.1 1 0.2]", "[1 0.05 0.05]", "[0.1 0.2 1]"}) {
        for (const std::string_view name : {"srgb", "rec2020", "acescg"}) {
            const auto luminance_of = [&](const std::string& light, int samples = 4) {
                const Method method{"direct", {}, samples};
                return mean_xyz(rendered(patch_under(colour + light), method, space(name), folder)).y;
            };
            const std::string distant = fmt::format(
                "LightSource \"distant\" \"rgb L\" {} \"float illuminance\" 100 \"point3 from\" [0 0 -1] "
                "\"point3 to\" [0 0 0]",
                rgb);
            EXPECT_NEAR(luminance_of(distant), 0.8 * 100 / M_PI, 1e-3) << name << rgb;
            const std::string sky =
                fmt::format("LightSource \"infinite\" \"rgb L\" {} \"float illuminance\" 100", rgb);
            // A sample under the sky has a deviation of 13 % (by the variance channels), the mean over 12 x 9
            // x 256 pixels and samples 0.08 %; the tolerance is four of these.
            EXPECT_NEAR(luminance_of(sky, 256), 0.8 * 100 / M_PI, 4 * 8e-4 * 0.8 * 100 / M_PI) << name << rgb;
            // The light is so distant that it lights the patch evenly.
            const std::string point = fmt::format(
                "LightSource \"point\" \"rgb I\" {} \"float power\" 1e8 \"point3 from\" [0 0 -1000]", rgb);
            EXPECT_NEAR(luminance_of(point), 0.8 * 1e8 / (4 * M_PI * M_PI * 1e6), 1e-3) << name << rgb;
        }
    }
}

// Light in every spelling has the requested luminance and colour, if the space contains it.
TEST(WorkingSpaces, Spellings_KeepTheirColour) {
    const TemporaryFolder folder;
    for (const std::string_view name : {"srgb", "rec2020", "acescg"}) {
        const auto xyz_of = [&](const std::string& light) {
            const Job job =
                job_of(patch_under("LightSource \"point\" " + light), {"direct"}, space(name), folder);
            return space(name).light_to_xyz(job.scene.lights().front()->flux()) / (4 * M_PI);
        };
        for (const std::string light :
             {"\"blackbody I\" 3000", "\"blackbody I\" [3000 2]", "\"spectrum I\" \"stdillum-A\"",
              "\"spectrum I\" \"stdillum-F11\"", "\"xyz I\" [0.8 1 0.6]", "\"rgb I\" [0.2 1 0.3]", ""}) {
            const Job plain = job_of(patch_under("LightSource \"point\" " + light), {"direct"}, {}, folder);
            const V3d expected = rgb_to_xyz(plain.scene.lights().front()->flux()) / (4 * M_PI);
            const V3d found = xyz_of(light);
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 2e-5) << name << light << c;
        }
    }
}

// Returns a lamp of rays of one colour, all of them towards the patch.
RaySet green_rays(const V3d& xyz) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    set.flux = 1;
    set.xyz = xyz / xyz.y;
    constexpr int kRays = 4000;
    for (int i = 0; i < kRays; ++i) {
        Sampler sampler(1, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f u = sampler.next2();
        set.rays.push_back({V3f(u.x - 0.5F, u.y - 0.5F, 0), V3f(0, 0, 1), 1.0F / kRays});
        set.tristimulus.push_back(V3f(set.xyz));
    }
    return set;
}

// Returns the XYZ of a light around 535 nm, 25 nm wide, like that of a green LED chip.
V3d chip_xyz() {
    Spectrum spectrum;
    for (double nm = 430; nm <= 640; nm += 1) spectrum.push_back({nm, std::exp(-sqr((nm - 535) / 15))});
    return spectrum_to_xyz(spectrum);
}

// The rays' colour is preserved: in the wide spaces a white patch shows the chromaticity of a chip that is
// outside sRGB. In sRGB it is mixed with grey.
TEST(WorkingSpaces, GreenChipOnAWhitePatch_HasTheColourOfItsRays) {
    const V3d chip = chip_xyz();
    ASSERT_FALSE(space("srgb").holds(chip));
    ASSERT_TRUE(space("rec2020").holds(chip));
    ASSERT_TRUE(space("acescg").holds(chip));
    const TemporaryFolder folder;
    write_rays(folder / "chip.tm25ray", green_rays(chip));
    const std::string lamp = "Translate 0 0 -1 LightSource \"rayfile\" \"string filename\" \"chip.tm25ray\"";
    const Method maps{"photonmap",
                      {{"photons", "20000"}, {"direct", "map"}, {"indirect", "map"}, {"caustic", "map"}}};
    V3d flux(0);
    for (const std::string_view name : {"srgb", "rec2020", "acescg"}) {
        Method method = maps;
        method.set.pop_back();
        const V3d seen = mean_xyz(rendered(patch_under(lamp), method, space(name), folder));
        ASSERT_GT(seen.y, 0);
        if (name == "srgb") {
            EXPECT_GT(off_in_colour(seen, chip), 0.03);
            flux = seen;
        } else {
            EXPECT_LT(off_in_colour(seen, chip), 2e-5) << name;
            EXPECT_NEAR(seen.y / flux.y, 1, 1e-4) << name;  // the same light in lm
        }
    }
}

// A traced luminaire has the flux in lm and the colour of its rays.
TEST(WorkingSpaces, TracedLuminaire_HasTheFluxOfSrgb) {
    const TemporaryFolder folder;
    const std::string text = R"(Camera "perspective" Film "rgb" WorldBegin
ColorSpace "rec2020"
LightSource "spot" "rgb I" [0.2 0.9 0.3] "point3 from" [0 0 0] "point3 to" [0 0 1] "float coneangle" 60
Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
Shape "cylinder" "float radius" 1 "float zmin" -0.1 "float zmax" 1
)";
    const auto traced = [&](std::string_view name) {
        const Job job = job_of(text, {"path"}, space(name), folder);
        LuminaireParameters parameters;
        parameters.paths = 20000;
        parameters.colours = job.film.colours;
        Monitor silent;
        return trace_rays(job.scene, parameters, FluxUnit::lumen, Workers{2}, silent);
    };
    const RaySet srgb = traced("srgb"), wide = traced("acescg");
    ASSERT_EQ(srgb.rays.size(), wide.rays.size());
    EXPECT_NEAR(wide.flux / srgb.flux, 1, 1e-5);
    const V3d light = find_colour_space("rec2020")->to_xyz({0.2, 0.9, 0.3});
    EXPECT_LT(off_in_colour(wide.xyz, light), 2e-5);
}

TEST(WorkingSpaces, ColorSpaceBeforeFilm_ChoosesThatOfTheRender) {
    const auto chosen = [](const std::string& text, const SceneOverrides& overrides = {}) {
        return std::string(testing::read_file_text(text, overrides).draft.film.colours.name());
    };
    EXPECT_EQ(chosen("Film \"rgb\" WorldBegin"), "srgb");
    EXPECT_EQ(chosen("ColorSpace \"acescg\" Film \"rgb\" WorldBegin"), "acescg");
    EXPECT_EQ(chosen("ColorSpace \"rec2020\" WorldBegin"), "rec2020");
    EXPECT_EQ(chosen("Film \"rgb\" ColorSpace \"acescg\" WorldBegin"), "srgb");
    EXPECT_EQ(chosen("Film \"rgb\" WorldBegin ColorSpace \"acescg\""), "srgb");
    SceneOverrides overrides;
    overrides.colours = space("rec2020");
    EXPECT_EQ(chosen("ColorSpace \"acescg\" Film \"rgb\" WorldBegin", overrides), "rec2020");
    EXPECT_THAT(
        testing::refusal_of_file("MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_s\" "
                                 "[1 1 1] ColorSpace \"acescg\" Film \"rgb\" WorldBegin"),
        HasSubstr("put it before MakeNamedMedium"));
}

// A surface's numbers in the render's own space are used unchanged.
TEST(WorkingSpaces, NumbersOfTheRendersSpace_AreNotChanged) {
    const TemporaryFolder folder;
    const std::string text = patch_under(
        "ColorSpace \"acescg\" LightSource \"distant\" \"rgb L\" [0 3 0] \"point3 from\" [0 0 -1] "
        "\"point3 to\" [0 0 0]");
    const Image image = rendered(text, {"direct"}, space("acescg"), folder);
    const Rgb seen = image.rgb_at(6, 4);
    EXPECT_EQ(seen.x, 0);
    EXPECT_NEAR(seen.y, 3 * 0.8 / M_PI, 1e-5);
    EXPECT_EQ(seen.z, 0);
}

TEST(WorkingSpaces, ImageFile_StatesItsChromaticitiesAndIsBroughtToSrgb) {
    const TemporaryFolder folder;
    Image wide(2, 1, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    wide.set_rgb(0, 0, Rgb(0.5F));
    wide.set_rgb(1, 0, Rgb(0.1F, 0.9F, 0.2F));
    wide.space = find_colour_space("acescg");
    write_exr(folder / "wide.exr", wide);
    const Image read = read_exr(folder / "wide.exr");
    EXPECT_EQ(read.space, nullptr);
    EXPECT_EQ(read.attributes.at("lucerna.broughtfrom"), "acescg");
    EXPECT_EQ(read.channels, (std::vector<std::string>{"R", "G", "B"}));
    EXPECT_EQ(read.rgb_at(0, 0), Rgb(0.5F));  // grey, to the bit
    const V3d expected = find_colour_space("acescg")->to_xyz({0.1, 0.9, 0.2});
    EXPECT_NEAR((rgb_to_xyz(read.rgb_at(1, 0)) - expected).length(), 0, 1e-6);
    EXPECT_LT(read.rgb_at(1, 0).x, 0);  // outside sRGB's gamut, and kept

    wide.space = nullptr;
    write_exr(folder / "plain.exr", wide);
    EXPECT_EQ(read_exr(folder / "plain.exr").data, wide.data);
}

// A picture is in sRGB: colours outside are mixed with grey of their luminance, and none is clipped.
TEST(WorkingSpaces, BroughtToSrgbAndHeld_KeepTheirLuminance) {
    Image wide = Image::rgb(1, 1);
    wide.set_rgb(0, 0, Rgb(0, 0.5F, 0));
    wide.space = find_colour_space("rec2020");
    const Rgb shown = brought_to_srgb(wide, true).rgb_at(0, 0);
    EXPECT_GE(std::min({shown.x, shown.y, shown.z}), 0);
    EXPECT_NEAR(luminance(shown), 0.5 * 0.678, 1e-4);
    EXPECT_GT(shown.y, 2 * shown.x);
}

// OpenEXR textures are in the chromaticities that they state, in any space of the render; normals are not
// colours.
TEST(WorkingSpaces, Textures_AreBroughtFromTheirChromaticities) {
    const TemporaryFolder folder;
    const Rgb colour(0.3F, 0.6F, 0.4F);
    Image image = Image::rgb(2, 2);
    for (int i = 0; i < 4; ++i) image.set_rgb(i % 2, i / 2, colour);
    image.space = find_colour_space("acescg");
    write_exr(folder / "wide.exr", image);
    const V3d xyz = image.space->to_xyz(V3d(colour));
    TextureImages images;
    const TexelSquare at{{0, 1}, {0, 1}};
    EXPECT_EQ(images.open(folder / "wide.exr", {})->square(at)[0], colour);
    for (const std::string_view name : {"srgb", "rec2020", "acescg"}) {
        const Rgb texel = images.open(folder / "wide.exr", {}, space(name))->square(at)[0];
        EXPECT_NEAR((space(name).space().to_xyz(V3d(texel)) - xyz).length(), 0, 1e-6) << name;
        EXPECT_EQ(read_texture_image(folder / "wide.exr", space(name))->rgb_at(1, 1), texel) << name;
    }
    image.space = nullptr;
    write_exr(folder / "plain.exr", image);
    EXPECT_EQ(images.open(folder / "plain.exr", {}, WorkingSpace())->square(at)[0], colour);
    const Rgb wide = images.open(folder / "plain.exr", {}, space("acescg"))->square(at)[0];
    EXPECT_NEAR((find_colour_space("acescg")->to_xyz(V3d(wide)) - rgb_to_xyz(colour)).length(), 0, 1e-6);
}

TEST(WorkingSpaces, UnnamedChromaticities_AreConvertedAndSenselessOnesRefused) {
    Chromaticities own = find_colour_space("dci-p3")->chromaticities;
    own[6] = 0.314F, own[7] = 0.351F;  // the white point of digital cinema
    const auto space_of_its_own = colour_space_of(own);
    ASSERT_TRUE(space_of_its_own.has_value());
    EXPECT_TRUE(space_of_its_own->name.empty());
    EXPECT_NEAR((space_of_its_own->to_xyz(V3d(1)) - kWhiteXyz).length(), 0, 1e-6);
    EXPECT_EQ(colour_space_of(find_colour_space("srgb")->chromaticities)->name, "srgb");
    Chromaticities line = own;
    line[4] = line[0], line[5] = line[1];  // blue has the primary of red
    EXPECT_FALSE(colour_space_of(line).has_value());
    own[1] = 0;
    EXPECT_FALSE(colour_space_of(own).has_value());
}

}  // namespace working_space_test
}  // namespace lucerna
