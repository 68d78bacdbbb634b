// The round trip: a field, its images behind the films, photographs of them, and the field assembled again.
#include "lights/measurement/photographs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>

#include "engine/image/photograph.h"
#include "lights/measurement/camera_simulation.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace photographs_test {

using testing::error_of;
using testing::ListeningMonitor;
using testing::TemporaryFolder;

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Returns images of a smooth lamp that lies to the upper right and is brighter to the left, so that no mirror
// image equals it.
FilterImages smooth_images(const Rig& rig) {
    FilterImages images;
    images.rig = rig;
    images.info.unit = FluxUnit::lumen;
    images.info.provenance = "a \"smooth\" lamp";
    images.positive.resize(rig.coefficients());
    images.negative.resize(rig.coefficients());
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    const double x = (k + 0.5) / rig.pixels.x - 0.6, y = (l + 0.5) / rig.pixels.y - 0.55;
                    const double light =
                        900 * std::exp(-8 * (x * x + y * y)) * (1 + 0.2 * m + 0.1 * n - 0.5 * x);
                    const std::size_t i = rig.index(m, n, k, l);
                    images.positive[i] = static_cast<float>(light);
                    images.negative[i] = static_cast<float>(0.3 * light * (1 + 0.5 * y));
                }
            }
        }
    }
    return images;
}

Rig small_rig(bool travels) {
    Rig rig = travels ? testing::rig_a() : testing::rig_b();
    rig.centre = {0, 0, 0};
    rig.pixels = {12, 10};
    return rig;
}

// Returns a camera that stores floats without noise.
CameraModel plain_camera() {
    CameraModel camera;
    camera.bits = 32;
    camera.format = "exr";
    camera.darks = 1;
    return camera;
}

// Returns a realistic camera: 12 bits, read and shot noise, dark current, hot pixels, three exposures.
CameraModel noisy_camera() {
    CameraModel camera;
    camera.exposures = {0.01, 0.08, 0.64};
    camera.bits = 12;
    camera.full_well = 30000;
    camera.read_noise = 20;
    camera.shot_noise = true;
    camera.dark_current = 4000;
    camera.hot_pixels = 0.01;
    camera.darks = 32;
    camera.oversampling = {3, 2};
    camera.margin = {2, 3};
    return camera;
}

float peak(const LightField& field) {
    float most = 0;
    for (const float e : field.coefficients()) most = std::max(most, std::fabs(e));
    return most;
}

double largest_difference(const LightField& a, const LightField& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.coefficients().size(); ++i)
        most = std::max(most, std::fabs(double{a.coefficients()[i]} - double{b.coefficients()[i]}));
    return most;
}

Assembly assembled(const std::filesystem::path& folder, Monitor& monitor, bool deviations = false) {
    return assemble(read_manifest(folder / "manifest.toml"), {2}, monitor, {deviations});
}

TEST(Photographs, FloatsWithoutNoise_OfBothSetups_GiveTheSameField) {
    for (const bool travels : {false, true}) {
        for (const V2i& oversampling : {V2i(1, 1), V2i(3, 2)}) {
            const TemporaryFolder folder;
            ListeningMonitor monitor;
            const FilterImages images = smooth_images(small_rig(travels));
            CameraModel camera = plain_camera();
            camera.oversampling = oversampling;
            camera.margin = {2, 1};
            camera.dark_current = 1000;
            write_photographs(images, camera, folder / "shots", {2}, monitor);
            const LightField there = field_of(images),
                             back = field_of(assembled(folder / "shots", monitor).images);
            EXPECT_LT(largest_difference(there, back), 2e-6 * peak(there)) << travels;
            EXPECT_EQ(back.rig().shift, there.rig().shift);
            EXPECT_EQ(back.info().unit, FluxUnit::lumen);
            EXPECT_THAT(back.info().provenance, HasSubstr("a \"smooth\" lamp; assembled from"));
            EXPECT_THAT(monitor.warnings, IsEmpty());
        }
    }
}

TEST(Photographs, ObliqueCamera_OfSetupB_ComesBackTheBetterTheFinerItsPixels) {
    const Rig rig = small_rig(false);
    const FilterImages images = smooth_images(rig);
    const LightField there = field_of(images);
    std::vector<double> errors;
    for (const int fine : {2, 4, 8}) {
        const TemporaryFolder folder;
        Monitor monitor;
        CameraModel camera = plain_camera();
        camera.place = {0.08, -0.1, 0.4};  // behind the screen at 0.08, far off the axis
        camera.oversampling = {fine, fine};
        camera.margin = {3, 2};
        write_photographs(images, camera, folder / "shots", {2}, monitor);
        const LightField back = field_of(assembled(folder / "shots", monitor).images);
        errors.push_back(largest_difference(there, back) / double{peak(there)});
        // Resampling conserves means: an error in one pixel is compensated in its neighbour.
        EXPECT_NEAR(back.flux(), there.flux(), 1e-3 * there.flux());
    }
    RecordProperty("error_of_2_4_8", ::testing::PrintToString(errors));
    std::cout << "oblique errors " << ::testing::PrintToString(errors) << "\n";
    EXPECT_LT(errors[2], 0.01);
    EXPECT_LT(errors[1], 0.7 * errors[0]);
    EXPECT_LT(errors[2], 0.7 * errors[1]);
}

TEST(Photographs, CameraBeforeTheScreen_SeesItMirrored_AndGivesTheSameField) {
    const TemporaryFolder folder;
    Monitor monitor;
    const FilterImages images = smooth_images(small_rig(false));
    CameraModel camera = plain_camera();
    camera.place = {0, 0, -0.5};
    camera.oversampling = {2, 2};
    const CameraView view = camera_view(images.rig, camera);
    EXPECT_GT(view.corners[0].x, view.corners[1].x);  // s runs to the left
    write_photographs(images, camera, folder / "shots", {2}, monitor);
    const LightField there = field_of(images), back = field_of(assembled(folder / "shots", monitor).images);
    EXPECT_LT(largest_difference(there, back), 1e-5 * peak(there));
}

// Returns the two-sided p-value of Σ ((E - truth) / σ)², which is chi-square with as many degrees of freedom
// as coefficients if σ is right.
double p_value(const LightField& truth, const Assembly& assembly) {
    const LightField field = field_of(assembly.images);
    double sum = 0;
    for (std::size_t i = 0; i < assembly.deviations.size(); ++i) {
        const double z = (double{field.coefficients()[i]} - double{truth.coefficients()[i]}) /
                         double{assembly.deviations[i]};
        sum += z * z;
    }
    const double above = testing::chi_square_tail(sum, static_cast<int>(assembly.deviations.size()));
    std::cout << "chi-square " << sum << " of " << assembly.deviations.size() << "\n";
    return 2 * std::min(1 - above, above);
}

TEST(Photographs, NoiseAndExposures_GiveTheFieldWithinThePredictedNoise_AndNoOther) {
    for (const bool travels : {false, true}) {
        for (const char* format : {"png", "tiff"}) {
            const TemporaryFolder folder;
            ListeningMonitor monitor;
            const FilterImages images = smooth_images(small_rig(travels));
            CameraModel camera = noisy_camera();
            camera.format = format;
            camera.seed = travels ? 5 : 6;
            write_photographs(images, camera, folder / "shots", {2}, monitor);
            const LightField truth = field_of(images);
            const Manifest manifest = read_manifest(folder / "shots" / "manifest.toml");
            const auto p_of = [&](const Manifest& told) {
                Monitor silent;
                return p_value(truth, assemble(told, {2}, silent, {true}));
            };
            EXPECT_GT(p_of(manifest), testing::kFalseAlarm) << format;
            EXPECT_THAT(monitor.warnings, IsEmpty());

            Manifest wrong = manifest;
            wrong.camera.scale *= 1.01;
            EXPECT_LT(p_of(wrong), 1e-9) << "a scale of 1 % too much";
            wrong = manifest;
            std::swap(wrong.sign_words[0], wrong.sign_words[1]);
            EXPECT_LT(p_of(wrong), 1e-9) << "films swapped";
            wrong = manifest;
            wrong.darks.clear();
            EXPECT_LT(p_of(wrong), 1e-9) << "no dark frames";
            wrong = manifest;
            wrong.camera.gain *= 1.5;
            EXPECT_LT(p_of(wrong), 1e-9) << "another noise";
            wrong = manifest;
            std::swap((*wrong.corners)[0], (*wrong.corners)[3]);
            std::swap((*wrong.corners)[1], (*wrong.corners)[2]);
            EXPECT_LT(p_of(wrong), 1e-9) << "upside down";
        }
    }
}

TEST(Photographs, AnyThreads_MakeTheSameFilesAndTheSameField) {
    const TemporaryFolder folder;
    Monitor monitor;
    const FilterImages images = smooth_images(small_rig(true));
    std::vector<std::vector<float>> fields;
    fields.push_back(photographed(images, noisy_camera(), {3}, monitor).images.positive);  // without files
    for (const int threads : {1, 4}) {
        const std::filesystem::path shots = folder / std::to_string(threads);
        write_photographs(images, noisy_camera(), shots, {threads}, monitor);
        fields.push_back(
            assemble(read_manifest(shots / "manifest.toml"), {threads}, monitor).images.positive);
    }
    EXPECT_EQ(fields[0], fields[1]);
    EXPECT_EQ(fields[0], fields[2]);
}

TEST(Photographs, HotPixels_AreNoneOfTheLight) {
    const TemporaryFolder folder;
    Monitor monitor;
    const FilterImages images = smooth_images(small_rig(false));
    CameraModel camera = plain_camera();
    camera.oversampling = {4, 4};
    camera.dark_current = 100;
    camera.hot_pixels = 0.01;
    camera.hot_factor = 1e5;
    write_photographs(images, camera, folder / "shots", {2}, monitor);
    const Assembly assembly = assembled(folder / "shots", monitor);
    EXPECT_GT(assembly.hot, 5U);
    const LightField there = field_of(images), back = field_of(assembly.images);
    EXPECT_LT(largest_difference(there, back), 0.01 * peak(there));
    Manifest told = read_manifest(folder / "shots" / "manifest.toml");
    told.darks.clear();
    EXPECT_GT(largest_difference(there, field_of(assemble(told, {2}, monitor).images)), 0.1 * peak(there));
}

TEST(Photographs, PixelsFullInEveryExposure_AreCountedAndNamed) {
    const TemporaryFolder folder;
    ListeningMonitor monitor;
    const FilterImages images = smooth_images(small_rig(false));
    CameraModel camera;
    camera.fill = 1.6;
    camera.exposures = {1, 2};
    write_photographs(images, camera, folder / "shots", {2}, monitor);
    const Assembly assembly = assembled(folder / "shots", monitor);
    std::uint64_t full = 0;
    float most = 0;
    for (const float x : images.positive) most = std::max(most, x);
    for (const FilterSign sign : kFilterSigns) {
        for (const float x : images.of(sign)) full += x * 1.6F >= most ? 1 : 0;
    }
    EXPECT_NEAR(static_cast<double>(assembly.saturated), static_cast<double>(full), 2);
    ASSERT_EQ(monitor.warnings.size(), 1U);
    EXPECT_THAT(monitor.warnings[0], HasSubstr("the first in view ["));
}

TEST(Photographs, MuchNoise_IsSaid) {
    const TemporaryFolder folder;
    ListeningMonitor monitor;
    CameraModel camera = noisy_camera();
    camera.exposures = {0.01};
    camera.full_well = 60;
    camera.read_noise = 10;
    camera.dark_current = 0;
    write_photographs(smooth_images(small_rig(false)), camera, folder / "shots", {2}, monitor);
    assembled(folder / "shots", monitor);
    EXPECT_THAT(monitor.warnings, ::testing::Contains(HasSubstr("noise of the coefficients is")));
}

class PhotographFolder : public ::testing::Test {
  protected:
    void SetUp() override {
        images_ = smooth_images(small_rig(false));
        CameraModel camera = plain_camera();
        camera.exposures = {0.5, 1};
        write_photographs(images_, camera, shots_, {1}, monitor_);
        manifest_ = read_manifest(shots_ / "manifest.toml");
    }
    std::string error() {
        return error_of([&] { assemble(manifest_, {2}, monitor_); });
    }

    TemporaryFolder folder_;
    std::filesystem::path shots_ = folder_ / "shots";
    Monitor monitor_;
    FilterImages images_;
    Manifest manifest_;
};

TEST_F(PhotographFolder, MissingPhotographs_AreAllNamedBeforeAnyWork) {
    for (const char* name : {"view_000_001_negative_1.exr", "view_002_000_positive_0.exr", "dark_1_000.exr",
                             "view_002_001_positive_0.exr"})
        std::filesystem::remove(shots_ / name);
    const std::string message = error();
    EXPECT_THAT(message, HasSubstr("manifest.toml: 4 of 26 photographs are missing"));
    EXPECT_THAT(message, HasSubstr("dark_1_000.exr (dark, 1 s); "));
    EXPECT_THAT(message, HasSubstr("view_000_001_negative_1.exr (view [0, 1] negative, 1 s); "));
    EXPECT_THAT(message, HasSubstr("view_002_000_positive_0.exr (view [2, 0] positive, 0.5 s); ..."));
}

TEST_F(PhotographFolder, GarbageAndMisfits_AreRefusedByName) {
    const std::filesystem::path file = shots_ / "view_001_001_negative_0.exr";
    const Photograph good = read_photograph(file);
    std::ofstream(file, std::ios::trunc) << "no photograph";
    EXPECT_THAT(error(), HasSubstr("view_001_001_negative_0.exr: not a readable photograph"));
    Photograph smaller = good;
    smaller.size = {smaller.size.x / 2, smaller.size.y};
    smaller.counts.resize(smaller.counts.size() / 2);
    write_photograph(file, smaller);
    EXPECT_THAT(
        error(),
        HasSubstr("view_001_001_negative_0.exr: 6 x 10 pixels of floats, but the others have 12 x 10"));
    Photograph nan = good;
    nan.counts[17] = NAN;
    write_photograph(file, nan);
    EXPECT_THAT(error(), HasSubstr("pixel (5, 1) holds nan"));
    write_photograph(file, good);
    manifest_.darks.pop_back();
    EXPECT_THAT(error(), HasSubstr("_1.exr: no dark frame of 1 s; there are those of 0.5 s"));
    manifest_.darks.clear();
    manifest_.channel = "X";
    EXPECT_THAT(error(), HasSubstr("no channel \"X\"; expected luminance, rgb or Y"));
}

TEST_F(PhotographFolder, CornersOutsideOrPixelsTooMany_AreRefused) {
    manifest_.corners = corners_of_crop({0, 0}, {13, 10});
    EXPECT_THAT(error(), HasSubstr("outside the photographs of 12 x 10 pixels"));
    manifest_.corners = corners_of_crop({0, 0}, {12, 10});
    manifest_.rig.pixels = {1000, 1000};
    EXPECT_THAT(error(), HasSubstr("expected at least 250000"));
}

TEST_F(PhotographFolder, ListedPhotographs_GiveTheSameAsAPattern) {
    const std::vector<float> there = assemble(manifest_, {2}, monitor_).images.negative;
    Manifest listed = manifest_;
    for (int m = 0; m < listed.rig.views.x; ++m) {
        for (int n = 0; n < listed.rig.views.y; ++n) {
            for (const FilterSign sign : kFilterSigns)
                listed.listed[{{m, n}, sign}] = manifest_.shots(m, n, sign);
        }
    }
    write_manifest(shots_ / "listed.toml", listed);
    EXPECT_EQ(assemble(read_manifest(shots_ / "listed.toml"), {2}, monitor_).images.negative, there);
}

TEST_F(PhotographFolder, StopWish_EndsIt) {
    struct Stopping : Monitor {
        bool stopped() const override { return true; }
    } stopping;
    EXPECT_THAT(error_of([&] { assemble(manifest_, {2}, stopping); }), HasSubstr("stopped"));
    EXPECT_THAT(error_of([&] { write_photographs(images_, plain_camera(), shots_, {2}, stopping); }),
                HasSubstr("stopped"));
    EXPECT_FALSE(std::filesystem::exists(shots_ / "manifest.toml"));  // it would describe a mixture
}

}  // namespace photographs_test
}  // namespace lucerna
