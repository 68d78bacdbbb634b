// Every method that is said to show all light does, caustics too: the Cornell box with a ball of glass beside
// another renderer's image, as a whole and block by block.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/pbrt/read_scene.h"
#include "engine/render/method_choice.h"
#include "engine/render/render.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace whole_picture_test {

constexpr int kBlock = 8;

// Means of blocks of 8 × 8 pixels, luminance.
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
    double mean;     // of the picture, as a ratio
    double darkest;  // of the blocks' ratios
};

// The lamp, and the edge of the picture beyond the box, are left out: a few bright pixels that decide every
// mean, and nothing at all.
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

// The methods that a time or an error is offered, with the work of their defaults.
std::vector<IntegratorSettings> whole_methods() {
    std::vector<IntegratorSettings> all;
    for (const Method& method : methods_like(PathSettings{})) {
        IntegratorSettings settings = method.settings;
        if (auto* maps = std::get_if<PhotonMapSettings>(&settings)) {
            if (maps->direct == DirectMethod::guided) continue;  // the same maps
            *maps = PhotonMapSettings{};
            maps->gather_rays = 4;
        }
        if (auto* igi = std::get_if<IgiSettings>(&settings)) {
            if (igi->pre_pass > 0) continue;  // one lamp: a pre-pass has nothing to choose
            igi->nsets = 64;
            igi->caustic_paths = IgiSettings{}.caustic_paths;
        }
        all.push_back(settings);
    }
    return all;
}

TEST(WholePicture, CornellWithGlass_EveryMethodThatClaimsIt_LacksNothing) {
    LUCERNA_NEED_DATA(scene, "references/cornellglass.pbrt");
    LUCERNA_NEED_DATA(file, "references/cornellglass-4096.exr");
    const Image reference = read_exr(file);
    const auto methods = whole_methods();
    ASSERT_EQ(methods.size(), 5U);
    for (const IntegratorSettings& settings : methods) {
        const Compared whole = compare_blocks(rendered(scene, settings), reference);
        std::cout << integrator_name(settings) << ": " << whole.mean << ", darkest block " << whole.darkest
                  << "\n";
        EXPECT_NEAR(whole.mean, 1, 0.01) << integrator_name(settings);
        EXPECT_GT(whole.darkest, 0.7) << integrator_name(settings);
    }
    // The same comparison sees that caustics are missing.
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
