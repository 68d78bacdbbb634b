// Light layers and light groups: they sum to the image, do not change it, agree between all methods, and each
// equals a render of it alone.
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "engine/base/stats.h"
#include "engine/render/features.h"
#include "engine/render/render.h"
#include "tests/support/materials.h"
#include "tests/support/media.h"
#include "tests/support/region_means.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace layers_test {

using testing::SceneMaker;

constexpr int kSize = 12;

// Returns a room with everything that distinguishes layers: glass, a mirror, gloss, varnish over paint, a
// visible wide lamp and a small one, each in its own group. `fog` fills the room.
Scene room(bool fog, Rgb albedo = Rgb(0.7F, 0.6F, 0.5F), Rgb lamp = Rgb(9, 8, 6), float bulb = 25) {
    SceneMaker make;
    const auto wall = make.diffuse(albedo);
    make.room({1, 1, 1}, wall);
    make.sphere({0.32F, 0.2F, 0.4F}, 0.18F, make.material(DielectricMaterial{}));
    make.sphere({0.75F, 0.15F, 0.35F}, 0.14F, make.material(MirrorMaterial{}));
    ConductorMaterial gloss;
    gloss.roughness = Roughness::of_alpha(0.15F);
    make.sphere({0.75F, 0.15F, 0.75F}, 0.14F, make.material(gloss));
    make.sphere({0.3F, 0.12F, 0.8F}, 0.11F,
                make.material(testing::coated(RgbTexture::constant(0.7F * albedo), 0)));
    make.quad_light({0.3F, 0.95F, 0.4F}, {0.4F, 0, 0}, {0, 0, 0.4F}, make.diffuse(Rgb(0)), lamp);
    make.quad_light({0.42F, 0.6F, 0.05F}, {0.16F, 0, 0}, {0, 0, 0.16F}, make.diffuse(Rgb(0)), Rgb(bulb));
    make.light_groups({"wide", "bulb"}, {0, 1});
    if (fog) {
        make.region(
            testing::in_box(testing::homogeneous(Rgb(0.1F), Rgb(0.4F, 0.3F, 0.2F)), V3d(0.01), V3d(0.99)));
    }
    return make.build();
}

Job job_of(Scene scene, IntegratorSettings method, int spp, bool parts = true) {
    Job job = testing::make_job(std::move(scene),
                                testing::camera({0.5F, 0.55F, 0.03F}, {0.5F, 0.45F, 1}, kSize, kSize, 90),
                                std::move(method), spp);
    job.film.parts = parts;
    return job;
}

// This number of light paths suffices to test that layers sum to the image.
constexpr std::int64_t kFew = 2000;

PhotonMapSettings maps(bool groups = true) {
    PhotonMapSettings settings;
    settings.photons = kFew;
    if (groups) settings.precompute = 0;
    return settings;
}
IgiSettings lights() {
    IgiSettings settings = testing::few_lights(-1, 64);
    settings.caustic_paths = kFew;
    return settings;
}
ProgressiveSettings passes() {
    ProgressiveSettings settings;
    settings.photons = kFew;
    return settings;
}

struct Method {
    std::string name;
    IntegratorSettings settings;
    bool groups = true;
};
std::vector<Method> methods() {
    PhotonMapSettings direct_map = maps();
    direct_map.direct = DirectMethod::map;
    direct_map.indirect = IndirectMethod::map;
    PhotonMapSettings guided = maps();
    guided.direct = DirectMethod::guided;
    guided.specular_below = 0.3F;
    IgiSettings without = lights();
    without.gather_samples = 0;
    PathSettings guided_path;
    guided_path.guide_lights = guided_path.guide_paths = 2000;
    return {{"path", PathSettings{}},
            {"guided path", guided_path},
            {"direct", DirectSettings{}},
            {"photonmap", maps(false), false},
            {"photonmap without precomputed irradiance", maps()},
            {"photonmap by maps alone", direct_map},
            {"photonmap, guided", guided},
            {"igi", lights()},
            {"igi without compensation", without},
            {"progressive", passes()}};
}

// Returns the room without groups if the method does not support them.
Scene room_for(const Method& method, bool fog) {
    if (method.groups) return room(fog);
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.6F)));
    make.sphere({0.32F, 0.2F, 0.4F}, 0.18F, make.material(DielectricMaterial{}));
    make.light(make_point_light({0.5F, 0.6F, 0.1F}, Rgb(1)));
    if (fog) make.region(testing::in_box(testing::homogeneous(Rgb(0.1F), Rgb(0.3F)), V3d(0.01), V3d(0.99)));
    return make.build();
}

RenderResult rendered(const Job& job, std::uint64_t seed = 1) {
    Monitor silent;
    return render(job, {seed, Workers{2}}, silent);
}

Rgb layer_at(const Image& layers, const std::string& name, int x, int y) {
    const auto first = static_cast<int>(find_channel(layers, name + ".R").value());
    return {layers.value(x, y, first), layers.value(x, y, first + 1), layers.value(x, y, first + 2)};
}

const std::vector<std::string> kParts{"emission", "direct", "indirect", "caustic", "media"};
const std::vector<std::string> kGroups{"lightgroup.wide", "lightgroup.bulb"};

// Returns the largest difference between the image and the sum of these layers, relative to the layers'
// magnitude.
double most_apart(const RenderResult& result, const std::vector<std::string>& names) {
    double most = 0;
    for (int y = 0; y < result.image.height; ++y) {
        for (int x = 0; x < result.image.width; ++x) {
            V3d sum(0.0), size(0.0);
            for (const std::string& name : names) {
                const V3d layer(layer_at(*result.parts, name, x, y));
                sum += layer;
                for (int c = 0; c < 3; ++c) size[c] += std::fabs(layer[c]);
            }
            const V3d image(result.image.rgb_at(x, y));
            for (int c = 0; c < 3; ++c) {
                if (size[c] > 0 || image[c] != 0)
                    most =
                        std::max(most, std::fabs(sum[c] - image[c]) / std::max(size[c], std::fabs(image[c])));
            }
        }
    }
    return most;
}

// A pixel sums up to 8 x 16 samples in single precision (a Mitchell filter of radius 2), in each film
// separately. The rounding errors of 128 additions have a standard deviation of at most sqrt(128) 2^-24 =
// 6.7e-7 of the sum of the magnitudes; this is four of them.
constexpr double kRounding = 2.7e-6;

TEST(LightLayers, OfEveryMethod_AddUpToTheImage) {
    for (const Method& method : methods()) {
        for (const bool fog : {false, true}) {
            for (const auto filter : {FilterSettings::Kind::box, FilterSettings::Kind::mitchell}) {
                Job job = job_of(room_for(method, fog), method.settings, 8);
                job.film.filter.kind = filter;
                job.film.two_halves = fog;
                const RenderResult result = rendered(job);
                ASSERT_TRUE(result.parts);
                const std::string what = method.name + (fog ? ", fog" : "");
                EXPECT_LT(most_apart(result, kParts), kRounding) << what;
                if (method.groups) {
                    EXPECT_LT(most_apart(result, kGroups), kRounding) << what;
                }
                // The test must detect a missing layer.
                EXPECT_GT(most_apart(result, {"emission", "indirect", "caustic", "media"}), 1e-3) << what;
            }
        }
    }
}

TEST(LightLayers, BesideThem_TheImageIsTheSameBitForBit) {
    for (const Method& method : methods()) {
        for (const bool fog : {false, true}) {
            const auto image = [&](bool parts, std::uint64_t seed) {
                return rendered(job_of(room_for(method, fog), method.settings, 4, parts), seed).image.data;
            };
            const auto with = image(true, 1);
            EXPECT_EQ(with, image(false, 1)) << method.name;
            EXPECT_NE(with, image(true, 2)) << method.name;
        }
    }
}

TEST(LightLayers, AnyNumberOfThreads_SamePartsBitForBit) {
    for (const Method& method : {methods()[0], methods()[7], methods()[9]}) {
        const Job job = job_of(room(true), method.settings, 4);
        Monitor silent;
        EXPECT_EQ(render(job, {1, Workers{1}}, silent).parts->data,
                  render(job, {1, Workers{3}}, silent).parts->data)
            << method.name;
    }
}

// Returns the mean luminance of a layer, over seeds.
RunningStats mean_over_seeds(const std::vector<RenderResult>& results, const std::string& name) {
    RunningStats stats;
    for (const RenderResult& result : results) {
        RunningStats pixels;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                pixels.add(double{luminance(name.empty() ? result.image.rgb_at(x, y)
                                                         : layer_at(*result.parts, name, x, y))});
            }
        }
        stats.add(pixels.mean());
    }
    return stats;
}

std::vector<RenderResult> over_seeds(const std::function<Scene()>& scene, const IntegratorSettings& method,
                                     int spp, int seeds) {
    std::vector<RenderResult> results;
    const Job job = job_of(scene(), method, spp);
    for (int seed = 1; seed <= seeds; ++seed)
        results.push_back(rendered(job, static_cast<std::uint64_t>(seed)));
    return results;
}

// Expects agreement within four standard errors plus the bias of photon estimates. A correct method fails
// once in 1600 comparisons of twelve seeds (Student's t).
void expect_same_mean(const RunningStats& ours, const RunningStats& reference, double bias,
                      const std::string& what) {
    const auto compared = testing::compare_means(ours, reference);
    std::printf("%-40s %8.5f %8.5f  %.4f ± %.4f\n", what.c_str(), ours.mean(), reference.mean(),
                compared.ratio, compared.noise);
    EXPECT_NEAR(compared.ratio, 1, bias + 4 * compared.noise) << what;
    EXPECT_LT(compared.noise, 0.05) << what << ": the test says nothing";
}

constexpr int kSeeds = 12;
// The relative bias of photon estimates in the mean of so coarse an image: caustics spread from hidden to
// visible regions.
constexpr double kBias = 0.03, kCausticBias = 0.06;

// With this number of photons the discs of caustics are no wider than those of the other maps.
IntegratorSettings with_many_photons(IntegratorSettings method) {
    constexpr std::int64_t kMany = 400'000;
    if (auto* maps = std::get_if<PhotonMapSettings>(&method)) {
        maps->photons = kMany;
        maps->estimate.k = 30;
    } else if (auto* igi = std::get_if<IgiSettings>(&method)) {
        igi->caustic_paths = 3 * kMany;  // its discs hold 100 photons
    } else if (auto* progressive = std::get_if<ProgressiveSettings>(&method)) {
        progressive->photons = kMany / 10;
    }
    return method;
}

void expect_parts_of_path(bool fog) {
    const auto scene = [fog] { return room(fog); };
    const auto reference = over_seeds(scene, PathSettings{}, 1024, kSeeds);
    for (const Method& method : methods()) {
        // Without compensation igi lacks light, and methods that read photons directly blur all of it.
        if (!method.groups || method.name == "path" || method.name == "igi without compensation") continue;
        const bool by_path = method.name == "guided path", all = method.name != "direct";
        const auto ours = over_seeds(scene, with_many_photons(method.settings), by_path ? 256 : 32, kSeeds);
        std::vector<std::string> names{"emission", "direct"};
        if (all) {
            names = kParts;
            names.insert(names.end(), kGroups.begin(), kGroups.end());
        }
        for (const std::string& name : names) {
            const std::string what = method.name + ", " + name + (fog ? ", fog" : "");
            if (name == "media" && !fog) {
                EXPECT_EQ(mean_over_seeds(ours, name).mean(), 0) << what;
                continue;
            }
            const bool sampled =
                name == "emission" || (name == "direct" && method.name != "photonmap by maps alone");
            const double bias = by_path || sampled ? 0 : name == "caustic" ? kCausticBias : kBias;
            expect_same_mean(mean_over_seeds(ours, name), mean_over_seeds(reference, name), bias, what);
        }
        // The test must detect exchanged layers.
        const auto compared =
            testing::compare_means(mean_over_seeds(ours, "direct"), mean_over_seeds(reference, "indirect"));
        EXPECT_GT(compared.sigmas, 10) << method.name;
        EXPECT_GT(std::fabs(compared.ratio - 1), 2 * kBias) << method.name;
    }
}

TEST(LayersBesidePath, Nightly_OfEveryMethod_AreThoseOfPath) {
    expect_parts_of_path(false);
}
TEST(LayersBesidePath, Nightly_OfEveryMethodInFog_AreThoseOfPath) {
    expect_parts_of_path(true);
}

// --- each against a render of it alone ---

TEST(LightLayers, Emission_IsWhatIsSeenWhereNothingScatters) {
    // Black walls leave lamps, mirrors and glass; reflections in gloss and varnish are not emission.
    const auto parts = over_seeds([] { return room(false); }, PathSettings{}, 64, kSeeds);
    const auto alone = [] {
        SceneMaker make;
        const auto black = make.diffuse(Rgb(0));
        make.room({1, 1, 1}, black);
        make.sphere({0.32F, 0.2F, 0.4F}, 0.18F, make.material(DielectricMaterial{}));
        make.sphere({0.75F, 0.15F, 0.35F}, 0.14F, make.material(MirrorMaterial{}));
        make.sphere({0.75F, 0.15F, 0.75F}, 0.14F, black);
        make.sphere({0.3F, 0.12F, 0.8F}, 0.11F,
                    make.material(testing::coated(RgbTexture::constant(Rgb(0)), 0)));
        make.quad_light({0.3F, 0.95F, 0.4F}, {0.4F, 0, 0}, {0, 0, 0.4F}, black, Rgb(9, 8, 6));
        make.quad_light({0.42F, 0.6F, 0.05F}, {0.16F, 0, 0}, {0, 0, 0.16F}, black, Rgb(25));
        return make.build();
    };
    expect_same_mean(mean_over_seeds(parts, "emission"),
                     mean_over_seeds(over_seeds(alone, PathSettings{}, 64, kSeeds), ""), 0, "emission");
}

// Over a flat mirror a lamp lights as its image behind the mirror does, directly, attenuated by the mirror's
// reflectance.
TEST(LightLayers, CausticOfAFlatMirror_IsTheDirectLightOfTheLampsImage) {
    constexpr float kReflectance = 0.8F;
    const auto floor_and_lamp = [](bool mirror) {
        SceneMaker make;
        make.quad({-1, 0, -1}, {0, 0, 4}, {4, 0, 0}, make.diffuse(Rgb(0.6F)));
        const auto black = make.diffuse(Rgb(0));
        const Rgb radiance(20, 15, 10);
        if (mirror) {
            // The plane x = -1 is wide enough for all light that matters.
            make.quad({-1, -20, -20}, {0, 40, 0}, {0, 0, 40},
                      make.material(MirrorMaterial{RgbTexture::constant(Rgb(kReflectance))}));
            make.quad_light({-0.6F, 1, 0.4F}, {0.8F, 0, 0}, {0, 0, 0.8F}, black, radiance);
        } else {
            make.quad_light({-2.2F, 1, 0.4F}, {0.8F, 0, 0}, {0, 0, 0.8F}, black, kReflectance * radiance);
        }
        return make.build();
    };
    // The mirror itself is outside the view.
    const auto results = [&](bool mirror, const IntegratorSettings& method, int spp) {
        Job job = testing::make_job(floor_and_lamp(mirror),
                                    testing::camera({1.2F, 0.9F, -0.9F}, {0.6F, 0, 0.9F}, kSize, kSize, 30),
                                    method, spp);
        job.film.parts = true;
        std::vector<RenderResult> all;
        for (int seed = 1; seed <= kSeeds; ++seed)
            all.push_back(rendered(job, static_cast<std::uint64_t>(seed)));
        return all;
    };
    const auto with = results(true, PathSettings{}, 1024), image = results(false, DirectSettings{}, 64);
    expect_same_mean(mean_over_seeds(with, "caustic"), mean_over_seeds(image, "direct"), 0, "caustic");
}

TEST(LightLayers, Media_AreWhatIsSeenInARoomOfBlackWalls) {
    // The only light is that of the fog, scattered once and more often, because the walls are black.
    const auto dark = [] {
        SceneMaker make;
        make.room({1, 1, 1}, make.diffuse(Rgb(0)));
        make.light(make_point_light({0.5F, 0.6F, 0.1F}, Rgb(1)));
        make.region(testing::in_box(testing::homogeneous(Rgb(0.1F), Rgb(0.4F)), V3d(0.01), V3d(0.99)));
        return make.build();
    };
    for (const Method& method : methods()) {
        const RenderResult result = rendered(job_of(dark(), method.settings, 4));
        EXPECT_LT(most_apart(result, {"media"}), 1e-6) << method.name;
        EXPECT_GT(luminance(testing::mean_rgb(result.image)), 0) << method.name;
    }
}

TEST(LightGroups, Long_EachIsTheImageOfItsLampsAlone) {
    const auto all = over_seeds([] { return room(true); }, PathSettings{}, 128, kSeeds);
    for (const bool wide : {true, false}) {
        const auto alone = [wide] {
            return wide ? room(true, Rgb(0.7F, 0.6F, 0.5F), Rgb(9, 8, 6), 0)
                        : room(true, Rgb(0.7F, 0.6F, 0.5F), Rgb(0), 25);
        };
        const auto truth = mean_over_seeds(over_seeds(alone, PathSettings{}, 128, kSeeds), "");
        expect_same_mean(mean_over_seeds(all, wide ? kGroups[0] : kGroups[1]), truth, 0,
                         wide ? "wide" : "bulb");
        EXPECT_GT(testing::compare_means(mean_over_seeds(all, wide ? kGroups[1] : kGroups[0]), truth).sigmas,
                  10);
    }
}

TEST(LightGroups, OfAMethodThatCannotTell_AreRefusedWithThoseThatCan) {
    const Job job = job_of(room(false), maps(false), 1);
    Monitor silent;
    try {
        render(job, {1, Workers{2}}, silent);
        FAIL() << "not refused";
    } catch (const InputError& error) {
        for (const char* word : {"light groups", "precompute", "path", "igi", "progressive"})
            EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << word;
    }
    // Without layers the method is accepted.
    EXPECT_NO_THROW(rendered(job_of(room(false), maps(false), 1, false)));
}

// The stated variances, averaged over many renders, must match the images' scatter.
TEST(LightLayers, TheirVariances_AreHowTheyScatter) {
    const auto results = over_seeds([] { return room(false); }, PathSettings{}, 16, 64);
    for (const std::string& name : {kParts[1], kParts[2], kGroups[0]}) {
        RunningStats told, seen;
        const auto channel = static_cast<int>(find_channel(*results[0].parts, name + ".G").value());
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                RunningStats pixel;
                for (const RenderResult& result : results) {
                    pixel.add(double{result.parts->value(x, y, channel)});
                    told.add(double{result.parts->value(x, y, channel + 3)});
                }
                seen.add(pixel.variance());
            }
        }
        // Samples are stratified, so their mean is at most as noisy as stated.
        EXPECT_LT(seen.mean(), 1.2 * told.mean()) << name;
        EXPECT_GT(seen.mean(), 0.3 * told.mean()) << name;
    }
}

// --- layers in checkpoints, and features ---

TEST(LightLayers, OfARenderThatGoesOn_AreThoseOfOneThatNeverStopped) {
    for (const IntegratorSettings& method :
         {IntegratorSettings(PathSettings{}), IntegratorSettings(passes())}) {
        const Job whole = job_of(room(false), method, 8), half = job_of(room(false), method, 4);
        Monitor silent;
        RenderOptions options{1, Workers{2}};
        Checkpoint kept;
        options.keep = [&kept](Checkpoint now) { kept = std::move(now); };
        render(half, options, silent);
        options.resume = &kept;
        const RenderResult resumed = render(whole, options, silent);
        EXPECT_EQ(resumed.parts->data, rendered(whole).parts->data);
        // A checkpoint without layers does not match.
        const Job without = job_of(room(false), method, 8, false);
        EXPECT_THROW(render(without, options, silent), InputError);
    }
}

TEST(Features, OfAWallAhead_AreItsPlaceAndNormal) {
    SceneMaker make;
    const auto grey = make.diffuse(Rgb(0.4F, 0.5F, 0.6F)), other = make.diffuse(Rgb(0.1F));
    // A wall at z = 2 fills the lower half of the view and faces the camera; another one stands above it.
    make.quad({-10, -10, 2}, {0, 10, 0}, {20, 0, 0}, grey);
    make.quad({-10, 0, 3}, {0, 10, 0}, {20, 0, 0}, other);
    make.light(make_point_light({0, 0, 0}, Rgb(1)));
    Job job =
        testing::make_job(make.build(), testing::camera({0, 0, 0}, {0, 0, 1}, 8, 8, 60), PathSettings{}, 4);
    job.film.parts = job.film.two_halves = true;
    const RenderResult result = rendered(job);
    const Image &features = result.denoiser_input->features, &more = *result.parts;
    const auto of = [&more](int x, int y, const char* name) {
        return more.value(x, y, static_cast<int>(find_channel(more, name).value()));
    };
    EXPECT_NEAR(features.value(4, 7, kNormal + 2), -1, 1e-6);
    // The normal points towards the viewer, independent of the scene's axes.
    EXPECT_NEAR(of(4, 7, "Nc.Z"), 1, 1e-6);
    EXPECT_NEAR(of(4, 7, "Nc.X"), 0, 1e-6);
    EXPECT_NEAR(of(4, 7, "N.variance.Z"), 0, 1e-6);
    // The distance and the position vary over a pixel.
    EXPECT_GT(of(4, 7, "variance.Z"), 0);
    EXPECT_GT(of(4, 7, "P.variance.X"), 0);
    EXPECT_NEAR(of(4, 7, "P.variance.Z"), 0, 1e-12);
    EXPECT_EQ(of(4, 7, "id.object"), 1);
    EXPECT_EQ(of(4, 0, "id.object"), 2);
    EXPECT_EQ(of(4, 7, "id.material"), 1);
    EXPECT_EQ(of(4, 0, "id.material"), 2);
}

// Returns a view of two panels, whose common edge crosses the middle one of nine rows, `off` of a row away
// from its centre.
Job two_panels(float off = 0) {
    const float y = off * 4 / (9 * std::sqrt(3.0F));  // a row sees 4/(9 sqrt 3) of the panels
    SceneMaker make;
    make.quad({-10, y - 10, 2}, {0, 10, 0}, {20, 0, 0}, make.diffuse(Rgb(0.5F)));
    make.quad({-10, y, 2}, {0, 10, 0}, {20, 0, 0}, make.diffuse(Rgb(0.1F)));
    make.light(make_point_light({0, 0, 0}, Rgb(1)));
    return testing::make_job(make.build(), testing::camera({0, 0, 0}, {0, 0, 1}, 9, 9, 60), PathSettings{},
                             32);
}

// A pixel that sees one surface receives four feature samples, one that an edge crosses sixteen.
TEST(Features, OfAnEdge_AreOfMoreSamples) {
    Job job = two_panels();
    job.film.parts = job.film.two_halves = true;
    const RenderResult result = rendered(job);
    const Image &features = result.denoiser_input->features, &more = *result.parts;
    const auto variance = static_cast<int>(find_channel(more, "albedo.variance.G").value());
    for (int x = 0; x < 9; ++x) {
        EXPECT_EQ(more.value(x, 0, variance), 0);
        // The mean of n samples of two values, a share p of them the first, has the variance p (1 - p)/(n -
        // 1) times the squared difference.
        const double p = (double{features.value(x, 4, kAlbedo + 1)} - 0.1) / 0.4;
        EXPECT_NEAR(p * (1 - p) * 0.16 / double{more.value(x, 4, variance)}, 15, 1e-3) << x;
    }
}

// Four samples would see nothing of an edge that crosses a tenth of their pixel in two pixels of three.
TEST(Features, OfAnEdgeBesideARow_AreOfMoreSamples) {
    for (const float off : {-0.4F, 0.4F}) {
        Monitor silent;
        const Features features = render_features(two_panels(off), 3, 16, Workers{2}, silent);
        for (int x = 0; x < 9; ++x) {
            const float of_albedos = features.image.value(x, 4, kAlbedo + 1) - (off < 0 ? 0.1F : 0.5F);
            EXPECT_NEAR(std::fabs(of_albedos), 0.04F, 0.035F) << x << " " << off;
        }
    }
}

// In little time there is one sample of each pixel. Edges between pixels then get more, and nothing else
// does.
TEST(Features, OfOneSample_AreRefinedAtEdges) {
    Job job = two_panels();
    job.film.parts = true;
    Monitor silent;
    const Features first = render_features(job, 3, 1, Workers{1}, silent);
    Features features = first;
    refine_features(job, 3, 1000, features, Workers{2}, silent);
    const int albedo = kAlbedo + 1;
    const auto variance = static_cast<int>(find_channel(features.more, "albedo.variance.G").value());
    int refined = 0;
    for (int y = 0; y < 9; ++y) {
        for (int x = 0; x < 9; ++x) {
            const double p = (double{features.image.value(x, y, albedo)} - 0.1) / 0.4;
            if (y == 4) {
                EXPECT_NEAR(p * (1 - p) * 0.16, 15 * double{features.more.value(x, y, variance)}, 1e-6) << x;
                refined += features.image.value(x, y, albedo) != first.image.value(x, y, albedo) ? 1 : 0;
            } else {
                EXPECT_EQ(features.image.value(x, y, albedo), first.image.value(x, y, albedo));
            }
            if (y < 3 || y > 5) {
                EXPECT_EQ(features.image.value(x, y, kPosition), first.image.value(x, y, kPosition));
            }
        }
    }
    EXPECT_GE(refined, 8);
    // There is no time for two samples of every pixel at an edge.
    Features same = first;
    refine_features(job, 3, 20, same, Workers{2}, silent);
    EXPECT_EQ(same.image.data, first.image.data);
}

}  // namespace layers_test
}  // namespace lucerna
