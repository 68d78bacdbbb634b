// Tests that every method that claims to show all light does, caustics included: the Cornell box with a glass
// ball against another renderer's image, as a whole and by blocks.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/pbrt/read_scene.h"
#include "engine/render/method_choice.h"
#include "engine/render/render.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace whole_picture_test {

constexpr int kBlock = 8;

// Returns the mean luminance of blocks of 8 × 8 pixels.
std::vector<double> blocks_of(const Image& image) {
    std::vector<double> means;
    for (int y = 0; y + kBlock <= image.height; y += kBlock) {
        for (int x = 0; x + kBlock <= image.width; x += kBlock) {
            double sum = 0;
            for (int v = 0; v < kBlock; ++v) {
                for (int u = 0; u < kBlock; ++u) sum += double{luminance(image.rgb_at(x + u, y + v))};
            }
            means.push_back(sum / (kBlock * kBlock));
        }
    }
    return means;
}

struct Compared {
    double mean;     // ratio of the images' means
    double darkest;  // least ratio of a block
};

// Black blocks, at the edge of the image beyond the box, are left out, and from the mean the lamp, whose few
// bright pixels would dominate it.
Compared compare_blocks(const Image& image, const Image& reference) {
    const std::vector<double> ours = blocks_of(image), theirs = blocks_of(reference);
    double sum = 0, expected = 0, darkest = INFINITY;
    for (std::size_t i = 0; i < ours.size(); ++i) {
        if (theirs[i] <= 0) continue;
        darkest = std::min(darkest, ours[i] / theirs[i]);
        if (theirs[i] > 5) continue;
        sum += ours[i];
        expected += theirs[i];
    }
    return {sum / expected, darkest};
}

Image rendered(const std::filesystem::path& scene, const IntegratorSettings& settings) {
    Monitor silent;
    SceneOverrides overrides;
    overrides.spp = 24;
    Job job = read_scene(scene, overrides, Workers{}, silent);
    job.integrator = settings;
    return render(job, {7, Workers{}}, silent).image;
}

// Returns the methods that are candidates for a requested time or error, with the default amounts of work.
std::vector<IntegratorSettings> whole_methods() {
    std::vector<IntegratorSettings> all;
    for (const Method& method : methods_like(PathSettings{})) {
        IntegratorSettings settings = method.settings;
        if (auto* maps = std::get_if<PhotonMapSettings>(&settings)) {
            if (maps->direct == DirectMethod::guided) continue;  // uses the same maps
            const auto pre_pass = maps->pre_pass;
            *maps = PhotonMapSettings{};
            maps->gather_rays = 4;
            maps->pre_pass = pre_pass;
        }
        if (auto* igi = std::get_if<IgiSettings>(&settings)) {
            if (igi->pre_pass > 0) continue;  // with one lamp a pre-pass has nothing to choose
            igi->nsets = 64;
            igi->caustic_paths = IgiSettings{}.caustic_paths;
        }
        all.push_back(settings);
    }
    return all;
}

TEST(WholePicture, Nightly_CornellWithGlass_EveryMethodThatClaimsIt_LacksNothing) {
    LUCERNA_NEED_DATA(scene, "references/cornellglass.pbrt");
    LUCERNA_NEED_DATA(file, "references/cornellglass-4096.exr");
    const Image reference = read_exr(file);
    const auto methods = whole_methods();
    ASSERT_EQ(methods.size(), 6U);  // photonmap and progressive with and without a pre-pass
    for (const IntegratorSettings& settings : methods) {
        const Compared whole = compare_blocks(rendered(scene, settings), reference);
        std::cout << integrator_name(settings) << ": " << whole.mean << ", darkest block " << whole.darkest
                  << "\n";
        EXPECT_NEAR(whole.mean, 1, 0.01) << integrator_name(settings);
        EXPECT_GT(whole.darkest, 0.7) << integrator_name(settings);
    }
    // The same comparison detects missing caustics.
    const auto igi = std::find_if(methods.begin(), methods.end(), [](const IntegratorSettings& settings) {
        return std::holds_alternative<IgiSettings>(settings);
    });
    ASSERT_NE(igi, methods.end());
    IgiSettings without = std::get<IgiSettings>(*igi);
    without.caustic_paths = without.gather_samples = 0;
    const Compared lacking = compare_blocks(rendered(scene, without), reference);
    EXPECT_LT(lacking.mean, 0.97);
    EXPECT_LT(lacking.darkest, 0.2);
}

}  // namespace whole_picture_test
}  // namespace lucerna
