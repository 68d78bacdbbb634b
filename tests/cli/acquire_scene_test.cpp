// Luminaires on the measuring bench give the same field as the formula's, in the right orientation, and the
// same bytes whether or not the work is interrupted.
#include "engine/cli/light/acquire_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <fstream>

#include "engine/cli/light/sums_file.h"
#include "engine/colour/spectrum.h"
#include "engine/system/files.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/plane_irradiance.h"
#include "tests/support/error_of.h"
#include "tests/support/impatient_monitor.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace acquire_scene_test {

using ::testing::HasSubstr;

constexpr const char* kHead =
    "Camera \"perspective\" Film \"rgb\" WorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n";

// A luminaire in a folder of the test's own.
class Lamp {
  public:
    explicit Lamp(const std::string& world) { write(world); }
    void write(const std::string& world) const { std::ofstream(folder_ / "lamp.pbrt") << kHead << world; }
    SceneEmitter emitter(std::int64_t rays) const {
        SceneEmitter made;
        made.file = folder_ / "lamp.pbrt";
        made.rays = rays;
        made.unit = FluxUnit::lumen;
        return made;
    }
    std::filesystem::path part() const { return folder_ / "lamp.exr.part"; }

  private:
    testing::TemporaryFolder folder_;
};

constexpr const char* kDisc =
    "AreaLightSource \"diffuse\" \"rgb L\" [2 1 1] \"float power\" 5\nShape \"disk\" \"float radius\" 0.01\n";

Rig bench(bool travels) {
    Rig rig;
    rig.views = {6, 6};
    rig.spacing = {0.008, 0.008};
    rig.pixels = travels ? V2i(15, 12) : V2i(10, 8);
    rig.pixel = travels ? V2d(0.004, 0.004) : V2d(0.012, 0.012);
    rig.distance = 0.05;
    rig.shift = travels ? V2i(2, 2) : V2i(0, 0);
    return rig;
}

// Returns Σ (measured - true)² over Σ variance: 1 for a correct measurement by independent rays, less by
// stratified ones.
double misfit(const LightField& measured, const LightField& expected, const SamplingNoise& noise,
              double scale) {
    double sum = 0;
    for (std::size_t i = 0; i < measured.coefficients().size(); ++i) {
        sum += sqr(scale * double{measured.coefficients()[i]} - double{expected.coefficients()[i]});
    }
    return sum / (sqr(noise.rms) * static_cast<double>(measured.coefficients().size()));
}

class AcquireSceneOf : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(BothSetups, AcquireSceneOf, ::testing::Values(false, true),
                         [](const auto& setup) { return setup.param ? "SetupA" : "SetupB"; });

TEST_P(AcquireSceneOf, MattDisc_IsTheFieldOfItsFormulaWithinItsNoise) {
    const Lamp lamp(kDisc);
    const Rig rig = bench(GetParam());
    Monitor silent;
    const SceneAcquisition made = acquire_scene(lamp.emitter(400'000), rig, {}, Workers{2}, silent);
    const LightField field = field_of(made.images);
    const LightField expected =
        acquire(cosine_emitter(EmitterModel::Outline::disc, {0.01, 0.01}, 5), rig, Workers{2}, silent);
    EXPECT_LT(misfit(field, expected, made.noise, 1), 1.15);
    // The test must detect an excess brightness of twice the noise.
    EXPECT_LT(made.noise.relative, 0.2);
    EXPECT_GT(misfit(field, expected, made.noise, 1 + 2 * made.noise.relative), 2.5);
    EXPECT_NEAR(made.account.total, 5, 1e-3);
    EXPECT_NEAR(field.flux() / expected.flux(), 1, 5e-3);
    EXPECT_NEAR(made.account.explained(), made.account.missed(), 1e-4);
    EXPECT_EQ(field.info().unit, FluxUnit::lumen);
    EXPECT_NEAR(field.info().colour.x / field.info().colour.y, 2, 1e-3);
}

TEST(AcquireScene, UnitOfTheScene_IsThatOfTheLamp_UnlessItsFluxIsStated) {
    const Lamp lamp(kDisc);
    SceneEmitter emitter = lamp.emitter(10'000);
    const auto unit_is = [&](const char* unit) {
        std::ofstream(emitter.file) << "Option \"string unit\" \"" << unit << "\"\n" << kHead << kDisc;
    };
    const auto flux = [&] {
        Monitor silent;
        return acquire_scene(emitter, bench(false), {}, Workers{2}, silent).account.total;
    };
    unit_is("photometric");
    EXPECT_NEAR(flux(), 5, 1e-3);
    unit_is("radiometric");
    EXPECT_THAT(testing::error_of(flux), ::testing::AllOf(::testing::HasSubstr("lamp.pbrt"),
                                                          ::testing::HasSubstr("states its light in W"),
                                                          ::testing::HasSubstr("is lm; use the same unit")));
    emitter.flux = 3;
    EXPECT_NEAR(flux(), 3, 1e-3);
}

TEST(AcquireScene, EmitterBesideTheAxis_AppearsOnItsSideOfSAndShinesToItsSideOfM) {
    // A narrow cone from (+8, -4) mm leans towards +y.
    const Lamp lamp(
        "LightSource \"spot\" \"point3 from\" [0.008 -0.004 0] \"point3 to\" [0.008 0.006 0.05]\n"
        "    \"float coneangle\" 8 \"float power\" 1\n");
    Rig rig = bench(false);
    rig.pixels = {20, 20};
    rig.pixel = {0.006, 0.006};
    Monitor silent;
    const LightField field =
        field_of(acquire_scene(lamp.emitter(50'000), rig, {}, Workers{2}, silent).images);
    const auto centre = [&](double distance) {
        const PlaneIrradiance wall =
            project(field, {distance, {0, 0}, {0.1, 0.1}, {50, 50}}, Workers{2}, silent);
        V2d sum(0, 0);
        for (int y = 0; y < 50; ++y) {
            for (int x = 0; x < 50; ++x) sum += wall.at(x, y) * V2d((x - 24.5) * 2e-3, (y - 24.5) * 2e-3);
        }
        return sum * (wall.patch.pixel_area() / wall.flux());
    };
    EXPECT_NEAR(centre(0).x, 0.008, 0.0015);
    EXPECT_NEAR(centre(0).y, -0.004, 0.0015);
    EXPECT_NEAR(centre(0.05).x, 0.008, 0.001);
    EXPECT_NEAR(centre(0.05).y, 0.006, 0.001);
}

TEST(AcquireScene, WithAFluxGiven_IsScaledToItAndNothingElseChanges) {
    const Lamp lamp(kDisc);
    Monitor silent;
    SceneEmitter emitter = lamp.emitter(20'000);
    const LightField as_is = field_of(acquire_scene(emitter, bench(false), {}, Workers{2}, silent).images);
    emitter.flux = 15;
    const SceneAcquisition scaled = acquire_scene(emitter, bench(false), {}, Workers{2}, silent);
    EXPECT_NEAR(scaled.account.total, 15, 1e-6);
    EXPECT_NEAR(field_of(scaled.images).flux() / as_is.flux(), 3, 1e-4);
    EXPECT_NEAR(scaled.emitted, 15, 1e-3);
}

SceneEmitter in_small_blocks(const Lamp& lamp) {
    SceneEmitter emitter = lamp.emitter(100'000);
    emitter.block = 1 << 14;
    return emitter;
}

TEST(AcquireScene, StoppedAndTakenUpAgain_GivesTheSameNumbersToTheLastBit) {
    const Lamp lamp(kDisc);
    Monitor silent;
    const SceneEmitter emitter = in_small_blocks(lamp);
    const SceneAcquisition whole = acquire_scene(emitter, bench(true), {}, Workers{1}, silent);
    for (const std::uint64_t patience :
         {30'000U, 40'000U}) {  // stops after 2 blocks, then after 3 of the remaining 5
        testing::ImpatientMonitor user(patience);
        const std::string message =
            testing::error_of([&] { acquire_scene(emitter, bench(true), lamp.part(), Workers{2}, user); });
        EXPECT_THAT(message, HasSubstr("continues from"));
        EXPECT_TRUE(std::filesystem::exists(lamp.part()));
    }
    const SceneAcquisition resumed = acquire_scene(emitter, bench(true), lamp.part(), Workers{3}, silent);
    EXPECT_EQ(whole.images.positive, resumed.images.positive);
    EXPECT_EQ(whole.images.negative, resumed.images.negative);
    EXPECT_EQ(whole.account.captured, resumed.account.captured);
    EXPECT_EQ(whole.account.beside_m, resumed.account.beside_m);
    EXPECT_EQ(whole.noise.rms, resumed.noise.rms);
    EXPECT_EQ(whole.images.info.colour, resumed.images.info.colour);
}

// A red disc below S's centre and a blue one beside it, each diffuse and with its own flux.
constexpr const char* kRedDisc =
    "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [3 0.5 0.2] \"float power\" 5\n"
    "Shape \"disk\" \"float radius\" 0.006 AttributeEnd\n";
constexpr const char* kBlueDisc =
    "AttributeBegin Translate 0.013 0.004 0 AreaLightSource \"diffuse\" \"rgb L\" [0.2 0.4 3] \"float "
    "power\" "
    "3\nShape \"disk\" \"float radius\" 0.005 AttributeEnd\n";

TEST_P(AcquireSceneOf, TwoColours_AreEachWhatTheirLampAloneIs) {
    const Rig rig = bench(GetParam());
    Monitor silent;
    const auto acquired = [&](const std::string& world) {
        const Lamp lamp(world);
        return acquire_scene(lamp.emitter(300'000), rig, {}, Workers{2}, silent);
    };
    const SceneAcquisition both = acquired(std::string(kRedDisc) + kBlueDisc);
    const SceneAcquisition red = acquired(kRedDisc), blue = acquired(kBlueDisc);
    ASSERT_TRUE(both.images.coloured());
    EXPECT_FALSE(red.images.coloured());
    EXPECT_FALSE(blue.images.coloured());
    const V3d red_xyz = rgb_to_xyz(red.images.info.colour), blue_xyz = rgb_to_xyz(blue.images.info.colour);
    const std::vector<float> of_red = coefficients_of(red.images, 1),
                             of_blue = coefficients_of(blue.images, 1);
    for (int c = 0; c < 3; ++c) {
        const std::vector<float> e = coefficients_of(both.images, c);
        double right = 0, swapped = 0, power = 0, flux = 0, expected_flux = 0;
        for (std::size_t i = 0; i < e.size(); ++i) {
            const double r = double{of_red[i]}, b = double{of_blue[i]};
            const double expected = r * red_xyz[c] + b * blue_xyz[c];
            right += sqr(double{e[i]} - expected);
            swapped += sqr(double{e[i]} - r * red_xyz[2 - c] - b * blue_xyz[2 - c]);
            power += sqr(expected);
            flux += double{e[i]}, expected_flux += expected;
        }
        EXPECT_LT(std::sqrt(right / power), 0.3) << c << ": noise of both, a fourth of the light each";
        if (c != 1) {
            EXPECT_GT(swapped, 4 * right) << c;
        }
        EXPECT_NEAR(flux / expected_flux, 1, 0.01) << "flux of channel " << c;
    }
    EXPECT_NEAR(both.account.explained(), both.account.missed(), 1e-4);
}

TEST(AcquireScene, InColourStoppedAndTakenUpAgain_GivesTheSameNumbersToTheLastBit) {
    const Lamp lamp(std::string(kRedDisc) + kBlueDisc);
    Monitor silent;
    const SceneEmitter emitter = in_small_blocks(lamp);
    const SceneAcquisition whole = acquire_scene(emitter, bench(true), {}, Workers{1}, silent);
    ASSERT_TRUE(whole.images.coloured());
    testing::ImpatientMonitor user(40'000);
    EXPECT_THAT(
        testing::error_of([&] { acquire_scene(emitter, bench(true), lamp.part(), Workers{2}, user); }),
        HasSubstr("continues from"));
    const SceneAcquisition resumed = acquire_scene(emitter, bench(true), lamp.part(), Workers{2}, silent);
    for (int c = 0; c < 3; ++c) {
        for (const FilterSign sign : kFilterSigns)
            EXPECT_EQ(whole.images.of(sign, c), resumed.images.of(sign, c)) << c;
    }
    // A lamp that differs only in its colours is another lamp.
    testing::ImpatientMonitor again(20'000);
    std::filesystem::remove(lamp.part());
    testing::error_of([&] { acquire_scene(emitter, bench(true), lamp.part(), Workers{2}, again); });
    std::string other = std::string(kRedDisc) + kBlueDisc;
    other.replace(other.find("3 0.5 0.2"), 9, "2 0.5 0.9");
    lamp.write(other);
    EXPECT_THAT(
        testing::error_of([&] { acquire_scene(emitter, bench(true), lamp.part(), Workers{2}, silent); }),
        HasSubstr("belongs to another"));
}

TEST(AcquireScene, SumsOfOtherWorkOrDamaged_AreRefused) {
    const Lamp lamp(kDisc);
    Monitor silent;
    SceneEmitter emitter = in_small_blocks(lamp);
    testing::ImpatientMonitor user(20'000);
    testing::error_of([&] { acquire_scene(emitter, bench(true), lamp.part(), Workers{2}, user); });
    const auto refusal = [&](const SceneEmitter& of, const Rig& rig) {
        return testing::error_of([&] { acquire_scene(of, rig, lamp.part(), Workers{2}, silent); });
    };
    SceneEmitter other = emitter;
    other.seed = 1;
    EXPECT_THAT(refusal(other, bench(true)), HasSubstr("belongs to another"));
    EXPECT_THAT(refusal(emitter, bench(false)), HasSubstr("belongs to another"));
    lamp.write(std::string(kDisc) + "# a word\n");
    EXPECT_THAT(refusal(emitter, bench(true)), HasSubstr("belongs to another"));
    lamp.write(kDisc);
    std::vector<std::byte> bytes = read_bytes(lamp.part());
    const auto put = [&](std::size_t count) {
        std::ofstream(lamp.part(), std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(count));
    };
    put(bytes.size() - 8);
    EXPECT_THAT(refusal(emitter, bench(true)), HasSubstr("damaged"));
    put(20);
    EXPECT_THAT(refusal(emitter, bench(true)), HasSubstr("damaged"));
    bytes[bytes.size() / 2] ^= std::byte{1};
    put(bytes.size());
    EXPECT_THAT(refusal(emitter, bench(true)), HasSubstr("damaged"));
    bytes[bytes.size() / 2] ^= std::byte{1};
    put(bytes.size());
    EXPECT_EQ(refusal(emitter, bench(true)), "no error");
}

TEST(AcquireScene, OfASceneWithoutLight_NamesItsFile) {
    const Lamp lamp("Shape \"sphere\"\n");
    Monitor silent;
    EXPECT_THAT(
        testing::error_of([&] { acquire_scene(lamp.emitter(1000), bench(false), {}, Workers{1}, silent); }),
        HasSubstr("lamp.pbrt: the luminaire has no light"));
    const Lamp downwards(
        "AreaLightSource \"diffuse\" ReverseOrientation Shape \"disk\" \"float radius\" 0.01\n");
    const SceneAcquisition made =
        acquire_scene(downwards.emitter(1000), bench(false), {}, Workers{1}, silent);
    EXPECT_EQ(made.account.captured, 0);
    EXPECT_NEAR(made.account.backward / made.account.total, 1, 1e-9);
}

}  // namespace acquire_scene_test
}  // namespace lucerna
