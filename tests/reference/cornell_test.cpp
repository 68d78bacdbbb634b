// Tests renders of the Cornell box by every method, against the path tracer and images of another renderer.
#include <gtest/gtest.h>

#include "engine/evaluation/compare.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "tests/support/scenes.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace cornell_test {

using Parameters = std::vector<std::pair<std::string, std::string>>;

Image render_scene(const std::string& name, const std::string& integrator, const Parameters& parameters,
                   int spp, int size, std::uint64_t seed = 7) {
    Monitor silent;
    SceneOverrides overrides;
    overrides.integrator = integrator;
    overrides.set = parameters;
    overrides.spp = spp;
    overrides.resolution = V2i(size, size);
    const std::filesystem::path root(LUCERNA_SOURCE_DIR);
    const Job job = read_scene(root / "scenes" / name / (name + ".pbrt"), overrides, Workers{}, silent);
    return render(job, {seed, Workers{}}, silent).image;
}

// Excludes the visible lamp, whose few bright pixels would dominate every mean.
Comparison compare_masked(const Image& image, const Image& reference) {
    return compare(image, reference, "image", "reference", 4);
}

// Returns the means of 2 × 2 blocks.
Image halve(const Image& image) {
    Image small = Image::rgb(image.width / 2, image.height / 2);
    for (int y = 0; y < small.height; ++y) {
        for (int x = 0; x < small.width; ++x) {
            small.set_rgb(x, y,
                          (image.rgb_at(2 * x, 2 * y) + image.rgb_at(2 * x + 1, 2 * y) +
                           image.rgb_at(2 * x, 2 * y + 1) + image.rgb_at(2 * x + 1, 2 * y + 1)) *
                              0.25F);
        }
    }
    return small;
}

// Means must be within 1 % of the path tracer's; the error, which includes the reference's own noise, below
// the stated number. It is the relative MSE, except for VPLs without a least distance: their variance is
// unbounded (1/r²), so that one pixel in a corner may dominate an MSE, but hardly the mean of |t - r| / |r|.
TEST(Cornell, PhotonMapAndIgi_AgreeWithPath) {
    Image reference = render_scene("cornell", "path", {}, 512, 96);
    struct Case {
        const char* integrator;
        Parameters parameters;
        double Comparison::*error;
        double most;
    };
    const Case cases[] = {
        {"photonmap", {{"gatherrays", "16"}}, &Comparison::relative_mse, 5e-3},
        {"photonmap", {{"indirect", "map"}}, &Comparison::relative_mse, 2e-2},
        {"photonmap", {{"indirect", "map"}, {"direct", "map"}, {"k", "50"}}, &Comparison::relative_mse, 4e-2},
        {"igi", {{"nlights", "128"}, {"nsets", "128"}, {"mindist", "1e-6"}}, &Comparison::mape, 6e-2},
    };
    for (const Case& c : cases) {
        const Image image = render_scene("cornell", c.integrator, c.parameters, 16, 96);
        const Comparison result = compare_masked(image, reference);
        std::string what = c.integrator;
        for (const auto& [name, value] : c.parameters) what += " " + name + "=" + value;
        for (const ChannelComparison& channel : result.channels) {
            if (channel.name.starts_with("variance")) continue;
            EXPECT_NEAR(channel.ratio.value_or(0), 1, 0.01) << what << " " << channel.name;
        }
        EXPECT_LT(result.*c.error, c.most) << what;
        std::cout << what << ": relative MSE " << result.relative_mse << ", mean error " << result.mape
                  << "\n";
    }
}

// The reference is pbrt-v3's path tracer, 2 × 1024 samples: half the difference of the two seeds is its
// noise.
TEST(Cornell, Path_AgreesWithAnotherRendererWithinNoise) {
    LUCERNA_NEED_DATA(first, "references/cornell-seed1.exr");
    LUCERNA_NEED_DATA(second, "references/cornell-seed2.exr");
    const Image a = halve(read_exr(first));
    const Image b = halve(read_exr(second));
    Image mean = a;
    for (std::size_t i = 0; i < mean.data.size(); ++i) mean.data[i] = 0.5F * (a.data[i] + b.data[i]);
    const Image ours = render_scene("cornell", "path", {}, 512, 128);
    const Comparison result = compare_masked(ours, mean);
    for (const ChannelComparison& channel : result.channels) {
        if (!channel.name.starts_with("variance")) {
            EXPECT_NEAR(channel.ratio.value_or(0), 1, 0.002) << channel.name;
        }
    }

    // The variance of a pixel's difference is our variance plus theirs (from the two seeds, pooled over the
    // image relative to the square).
    double pooled = 0;
    std::size_t lit = 0;
    for (int y = 0; y < mean.height; ++y) {
        for (int x = 0; x < mean.width; ++x) {
            const double m = static_cast<double>(luminance(mean.rgb_at(x, y)));
            if (!(m > 0) || m > 4) continue;
            pooled +=
                sqr(static_cast<double>(luminance(a.rgb_at(x, y)) - luminance(b.rgb_at(x, y))) / (2 * m));
            ++lit;
        }
    }
    pooled /= static_cast<double>(lit);
    std::size_t far = 0;
    for (int y = 0; y < mean.height; ++y) {
        for (int x = 0; x < mean.width; ++x) {
            const double m = static_cast<double>(luminance(mean.rgb_at(x, y)));
            if (!(m > 0) || m > 4) continue;
            const double own = static_cast<double>(ours.value(x, y, 4));
            const double difference = static_cast<double>(ours.value(x, y, 1) - mean.value(x, y, 1));
            const double deviation = std::sqrt(own + pooled * m * m);
            if (std::fabs(difference) > 4.5 * deviation) ++far;
        }
    }
    // Beyond 4.5 sigma 0.1 of some 16,000 normal values are expected. A quarter of a percent is allowed for
    // pixels on edges, where the renderers' samples differ by rounding.
    EXPECT_LT(static_cast<double>(far), 0.0025 * static_cast<double>(lit)) << far << " of " << lit;
}

// Renders another renderer's scene file, unchanged, by `path`.
Image render_reference_scene(const std::filesystem::path& scene, int spp, std::uint64_t seed = 7) {
    Monitor silent;
    SceneOverrides overrides;
    overrides.integrator = "path";
    overrides.spp = spp;
    return render(read_scene(scene, overrides, Workers{}, silent), {seed, Workers{}}, silent).image;
}

// Replaces each pixel's variance by the mean of its neighbours. Where light arrives in rare bright samples (a
// caustic) the estimate of one pixel is poor: too small wherever no such sample came.
Image with_shared_variance(const Image& image) {
    constexpr int kReach = 3;
    Image result = image;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            for (int c = 3; c < 6; ++c) {
                double sum = 0;
                int count = 0;
                for (int v = std::max(0, y - kReach); v <= std::min(image.height - 1, y + kReach); ++v) {
                    for (int u = std::max(0, x - kReach); u <= std::min(image.width - 1, x + kReach);
                         ++u, ++count) {
                        sum += static_cast<double>(image.value(u, v, c));
                    }
                }
                const std::size_t pixel =
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                    static_cast<std::size_t>(x);
                result.data[6 * pixel + static_cast<std::size_t>(c)] = static_cast<float>(sum / count);
            }
        }
    }
    return result;
}

// Returns the reference with an expected variance: that of our pixel, scaled by the numbers of samples. Both
// are path tracers with one light sample per vertex.
Image with_variance(const Image& reference, const Image& ours, int our_spp, int its_spp) {
    Image image = ours;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) image.set_rgb(x, y, reference.rgb_at(x, y));
    }
    for (std::size_t i = 0; i < image.data.size(); ++i) {
        if (i % 6 >= 3) image.data[i] *= static_cast<float>(our_spp) / static_cast<float>(its_spp);
    }
    return image;
}

// Returns the share of pixels of which some channel differs by more than its noise, at the level of Šidák's
// correction for all channels of all pixels.
double share_beyond_noise(const Image& ours, const Image& reference) {
    const auto pixels = static_cast<std::uint64_t>(ours.width) * static_cast<std::uint64_t>(ours.height);
    const double level = sidak_level(kComparisonLevel, 3 * pixels);
    std::uint64_t beyond = 0;
    for (int y = 0; y < ours.height; ++y) {
        for (int x = 0; x < ours.width; ++x) {
            bool differs = false;
            for (int c = 0; c < 3; ++c) {
                const double variance =
                    static_cast<double>(ours.value(x, y, c + 3) + reference.value(x, y, c + 3));
                const double difference =
                    std::fabs(static_cast<double>(ours.value(x, y, c) - reference.value(x, y, c)));
                // Without variance only equal values agree.
                const double p =
                    variance > 0 ? std::erfc(difference / std::sqrt(2 * variance)) : difference == 0;
                differs = differs || p < level;
            }
            beyond += differs;
        }
    }
    return static_cast<double>(beyond) / static_cast<double>(pixels);
}

// Expects that at most a quarter of a percent of the pixels differ by more than their noise.
void expect_within_noise(const Image& ours, const Image& expected) {
    const double share = share_beyond_noise(ours, expected);
    std::cout << 100 * (1 - share) << " % of the pixels agree\n";
    EXPECT_LE(share, 0.0025);
    // The test rejects the same image, a third brighter.
    Image wrong = ours;
    for (std::size_t i = 0; i < wrong.data.size(); ++i) wrong.data[i] *= i % 6 < 3 ? 1.33F : 1.0F;
    EXPECT_GT(share_beyond_noise(wrong, expected), 0.0025);
}

void scale_variance(Image& image, double factor) {
    for (std::size_t i = 0; i < image.data.size(); ++i)
        image.data[i] *= i % 6 >= 3 ? static_cast<float>(factor) : 1.0F;
}

// Returns the ratio of the measured variance of an image, from two seeds, to the variance stated by its
// samples (`variance`). Stratified samples of a pixel scatter more than their mean does.
double overstatement(const Image& a, const Image& b, const Image& variance) {
    double measured = 0, said = 0;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            const double m = static_cast<double>(a.rgb_at(x, y).y + b.rgb_at(x, y).y) / 2;
            if (!(m > 0.01 && m < 2)) continue;  // the lamp and its edges would dominate the sum
            measured += sqr(static_cast<double>(a.rgb_at(x, y).y - b.rgb_at(x, y).y) / (2 * m));
            said += static_cast<double>(variance.value(x, y, 4)) / (2 * m * m);
        }
    }
    return measured / said;
}

Image mean_of(const Image& a, const Image& b) {
    Image mean = a;
    for (std::size_t i = 0; i < mean.data.size(); ++i) mean.data[i] = 0.5F * (a.data[i] + b.data[i]);
    return mean;
}

TEST(References, Cornell_AgreesPixelByPixel) {
    LUCERNA_NEED_DATA(scene, "references/cornell.pbrt");
    LUCERNA_NEED_DATA(first, "references/cornell-seed1.exr");
    LUCERNA_NEED_DATA(second, "references/cornell-seed2.exr");
    constexpr int kSpp = 128;
    const Image one = render_reference_scene(scene, kSpp, 7), two = render_reference_scene(scene, kSpp, 8);
    const Image a = read_exr(first), b = read_exr(second);
    Image ours = mean_of(one, two);
    Image expected = with_variance(mean_of(a, b), ours, kSpp, 1024);

    // The variance of each image is scaled to the noise that its two seeds show.
    const double own = overstatement(one, two, ours);
    const double other = overstatement(a, b, expected);
    std::cout << "variance of what the samples say: ours " << own << ", the reference's " << other << "\n";
    for (const double factor : {own, other}) {
        EXPECT_GT(factor, 0.1);
        EXPECT_LT(factor, 1.1);
    }
    scale_variance(ours, own / 2);
    scale_variance(expected, other / 2);
    expect_within_noise(with_shared_variance(ours), with_shared_variance(expected));
}

TEST(References, Nightly_CornellWithGlass_AgreesPixelByPixel) {
    LUCERNA_NEED_DATA(scene, "references/cornellglass.pbrt");
    LUCERNA_NEED_DATA(file, "references/cornellglass-4096.exr");
    constexpr int kSpp = 512;
    const Image ours = with_shared_variance(render_reference_scene(scene, kSpp));
    expect_within_noise(ours, with_variance(read_exr(file), ours, kSpp, 4096));
}

// A part of an image of 128 × 128 pixels.
struct Part {
    const char* name;
    int x0, y0, x1, y1;
    double least;  // lower bound of the ratio to the reference

    double mean(const Image& image) const {
        double sum = 0;
        for (int y = y0; y < y1; ++y) {
            for (int x = x0; x < x1; ++x) sum += double{luminance(image.rgb_at(x, y))};
        }
        return sum / ((x1 - x0) * (y1 - y0));
    }
};

// Expects the flux of the caustic that the ball casts on the floor. 85 % of the light in this part of the
// image is the caustic (`indirect=none` shows the rest), so 1 % of its flux is 0.85 % of the part's mean.
void expect_caustic_flux(double ratio, double tolerance) {
    std::cout << "caustic: " << 1 + (ratio - 1) / 0.85 << "\n";
    EXPECT_NEAR(ratio, 1, tolerance);
}
double spot_ratio(const Image& image, const Image& reference) {
    const Part spot{"spot", 70, 109, 98, 121, 0};
    return spot.mean(image) / spot.mean(reference);
}

TEST(CornellGlass, PhotonMap_AgreesWithAnotherRendererInTheMean) {
    LUCERNA_NEED_DATA(file, "references/cornellglass-4096.exr");
    const Image reference = halve(read_exr(file));
    const Image image =
        render_scene("cornell-caustic", "photonmap", {{"photons", "2000000"}, {"gatherrays", "8"}}, 16, 128);
    const Comparison result = compare_masked(image, reference);
    for (const ChannelComparison& channel : result.channels) {
        if (!channel.name.starts_with("variance")) {
            EXPECT_NEAR(channel.ratio.value_or(0), 1, 0.01) << channel.name;
        }
    }
    std::cout << "relative MSE " << result.relative_mse << "\n";
    // The spot varies by 0.8 % between seeds (its photons are those of few paths), and the mean of four by
    // 0.4 %; three times that is allowed in addition to 1 %.
    double ratio = spot_ratio(image, reference) / 4;
    for (const std::uint64_t seed : {1, 2, 3}) {
        const Image more = render_scene("cornell-caustic", "photonmap",
                                        {{"photons", "2000000"}, {"gatherrays", "8"}}, 16, 128, seed);
        ratio += spot_ratio(more, reference) / 4;
    }
    expect_caustic_flux(ratio, 0.022);
}

// --- progressive passes ---

// Where walls meet, a disc on one of them receives the other's photons (photon/tangent_metric.h), and probes
// correct the remainder (photon/probes.h): there is no dark line.
TEST(Cornell, Progressive_ConcaveCornersAreNotDark) {
    LUCERNA_NEED_DATA(first, "references/cornell-seed1.exr");
    LUCERNA_NEED_DATA(second, "references/cornell-seed2.exr");
    const Image reference = halve(mean_of(read_exr(first), read_exr(second)));
    // There are 64 passes of 4 samples; radii shrink with the number of passes.
    const Image image = render_scene("cornell", "progressive", {{"photons", "100000"}}, 256, 128);
    const Part parts[] = {{"back wall and ceiling", 40, 28, 88, 31, 0.99},
                          {"back wall and right wall", 99, 35, 103, 75, 0.99},
                          {"back wall and left wall", 25, 35, 28, 65, 0.99},
                          // It is lit by the floor in front of it, at such grazing angles that much of the
                          // disc is lost.
                          {"foot of the tall block", 41, 107, 61, 109, 0.96}};
    for (const Part& part : parts) {
        const double ratio = part.mean(image) / part.mean(reference);
        std::cout << part.name << ": " << ratio << "\n";
        EXPECT_GT(ratio, part.least) << part.name;
        EXPECT_LT(ratio, 1.02) << part.name;
    }
}

TEST(CornellGlass, Progressive_AgreesWithAnotherRendererInTheMean) {
    LUCERNA_NEED_DATA(file, "references/cornellglass-4096.exr");
    const Image reference = halve(read_exr(file));
    const Image image = render_scene("cornell-caustic", "progressive", {{"photons", "100000"}}, 64, 128);
    const Comparison result = compare_masked(image, reference);
    for (const ChannelComparison& channel : result.channels) {
        if (!channel.name.starts_with("variance")) {
            EXPECT_NEAR(channel.ratio.value_or(0), 1, 0.01) << channel.name;
        }
    }
    std::cout << "relative MSE " << result.relative_mse << "\n";
    expect_caustic_flux(spot_ratio(image, reference), 0.0085);
}

}  // namespace cornell_test
}  // namespace lucerna
