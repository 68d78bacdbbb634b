// Tests direct light by photons and by the light tree on whole scenes, against plain light sampling.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>

#include "engine/base/stats.h"
#include "engine/guiding/guide.h"
#include "engine/integrators/integrator.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/job.h"
#include "engine/transport/direct_light.h"
#include "tests/support/eye_paths.h"
#include "tests/support/made_scenes.h"
#include "tests/support/one_pass.h"

namespace lucerna {
namespace direct_methods_test {

using Parameters = std::vector<std::pair<std::string, std::string>>;

struct Case {
    const char* name;
    const char* file;
};
constexpr Case kCases[] = {
    {"flashlight", "cloister/by-flashlight.pbrt"},
    {"projector", "cloister/by-projector.pbrt"},
    {"many lights", "many-lights/many-lights.pbrt"},
    {"one large light", "cornell/cornell.pbrt"},
};

Job read(const Case& c, const std::string& integrator, Parameters parameters) {
    Monitor silent;
    SceneOverrides overrides;
    overrides.integrator = integrator;
    // Illuminance excludes the visible lamps, which would cause most of an image's noise.
    parameters.emplace_back("quantity", "illuminance");
    overrides.set = parameters;
    return read_scene(testing::made_scenes() / c.file, overrides, Workers{}, silent);
}

// The luminances of six parts of an image, three columns in two rows.
constexpr int kAcross = 3, kParts = 6;
using Parts = std::array<RunningStats, kParts>;

// Samples `radiance(ray, sampler)` for rays spread evenly over an image, as many for each part.
template <typename Radiance>
Parts measured(const Job& job, int samples, std::uint64_t seed, Radiance&& radiance) {
    Parts parts;
    const V2f size(static_cast<float>(job.film.width), static_cast<float>(job.film.height));
    for (int part = 0; part < kParts; ++part) {
        const V2f corner(static_cast<float>(part % kAcross), static_cast<float>(part / kAcross));
        for (int i = 0; i < samples; ++i) {
            Sampler sampler = Sampler::stratified(seed, Purpose::test, static_cast<std::uint64_t>(part),
                                                  static_cast<std::uint32_t>(i));
            const V2f u = corner + sampler.next2();
            const V2f pixel(u.x / kAcross * size.x, u.y / (kParts / kAcross) * size.y);
            const Ray ray = job.camera.ray(pixel, sampler.next2());
            parts[static_cast<std::size_t>(part)].add(double{luminance(radiance(ray, sampler))});
        }
    }
    return parts;
}

Parts measured_by_integrator(const Case& c, const std::string& integrator, const Parameters& parameters,
                             int samples, std::uint64_t seed) {
    Monitor silent;
    const Workers workers{};
    const Job job = read(c, integrator, parameters);
    const testing::OnePass estimator(job.integrator, {job.scene, seed, workers, silent});
    return measured(job, samples, seed,
                    [&](const Ray& ray, Sampler& sampler) { return estimator.Li(ray, sampler); });
}

// Samples of one part are stratified: their mean is more accurate than the standard error states.
double sigmas_apart(const RunningStats& a, const RunningStats& b) {
    return std::fabs(a.mean() - b.mean()) / std::hypot(a.standard_error(), b.standard_error());
}
double most_sigmas_apart(const Parts& a, const Parts& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (b[i].mean() > 0) most = std::max(most, sigmas_apart(a[i], b[i]));
    }
    return most;
}

// Returns the illuminance on the first surface along a ray; `shade(vertex)` returns the radiance reflected
// there.
template <typename Shade>
Rgb metered(const Scene& scene, const Ray& ray, Shade&& shade) {
    const auto hit = scene.intersect(ray);
    if (!hit) return Rgb(0);
    const Bsdf white = white_receiver(*hit);
    return meter_reading(shade(Vertex{*hit, white, -ray.d}));
}

// Returns all direct light by the reference method, paths of one bounce.
Parts truth(const Case& c, int samples) {
    return measured_by_integrator(c, "path", {{"maxdepth", "1"}}, samples, 1);
}

// 4 sigma, 6e-5, for each of 6 parts of an image, 4 scenes, 2 numbers of photons: a correct program fails
// with another seed with probability 3e-3.
TEST(DirectMethods, Guided_IsUnbiasedAgainstPathOnWholeScenes) {
    for (const Case& c : kCases) {
        const Parts reference = truth(c, 200'000);
        for (const char* photons : {"1000000", "500"}) {
            Parts tried = measured_by_integrator(
                c, "photonmap", {{"direct", "guided"}, {"indirect", "none"}, {"photons", photons}}, 50'000,
                2);
            EXPECT_LT(most_sigmas_apart(tried, reference), 4) << c.name << ", " << photons;
            double lit = 0, all = 0;
            for (std::size_t i = 0; i < tried.size(); ++i) {
                lit += tried[i].mean(), all += reference[i].mean();
            }
            EXPECT_NEAR(lit / all, 1, 0.02) << c.name << ", " << photons;
        }
    }
}

// Samples one light at a time by the mixture of guide and plain choice, with weights by the density
// `weighed`.
template <typename Weighed>
Parts measured_by_choice(const Job& job, int samples, std::uint64_t seed, const Weighed& weighed) {
    Monitor silent;
    GuideSettings how;
    how.radius = 0.35F;
    const GuideMap guides = build_guides(job.scene, {200'000, 3, 0, how}, Workers{}, silent);
    return measured(job, samples, seed, [&](const Ray& ray, Sampler& sampler) {
        return metered(job.scene, ray, [&](const Vertex& vertex) {
            const V3f& n = vertex.hit.at.n;
            const Guide guide = guides.at(vertex.hit.at.p, n.dot(vertex.wo) < 0 ? -n : n);
            const LightChoice choice = LightChoice().guided(guide, 0.25F);
            const float u = sampler.next();
            const auto drawn = choice.draw(job.scene, vertex.hit.at.p, u, sampler.next2());
            if (!drawn) return Rgb(0);
            const LightSample& in = drawn->light_sample;
            const EmittedRadiance back{Rgb(0.0F), in.part ? in.part->whole_pdf_w : in.pdf_w, in.distance,
                                       in.part};
            const float density = weighed(guide).pdf_w(job.scene, drawn->light, back);
            if (!(density > 0)) return Rgb(0);
            return vertex.value(in.w) * in.weight * (drawn->gain * (drawn->pdf_w / density)) *
                   transmitted_share(job.scene, vertex, in, sampler);
        });
    });
}

// In the scenes with a choice, a density without the defensive part is detected.
TEST(DirectMethods, AWeightWithoutTheDefensivePart_IsRefused) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Case& c = kCases[i];
        const Parts reference = truth(c, 200'000);
        const Job job = read(c, "direct", {});
        const Parts right = measured_by_choice(
            job, 100'000, 4, [](const Guide& guide) { return LightChoice().guided(guide, 0.25F); });
        EXPECT_LT(most_sigmas_apart(right, reference), 4) << c.name;
        const Parts wrong = measured_by_choice(
            job, 100'000, 4, [](const Guide& guide) { return LightChoice().guided(guide, 0.0F); });
        EXPECT_GT(most_sigmas_apart(wrong, reference), 4) << c.name;
    }
}

// Samples the only light of a scene once for each place: `ask` draws a direction and its weight.
template <typename Ask>
Parts measured_by_light(const Job& job, int samples, std::uint64_t seed, Ask&& ask) {
    return measured(job, samples, seed, [&](const Ray& ray, Sampler& sampler) {
        return metered(job.scene, ray, [&](const Vertex& vertex) {
            const std::optional<LightSample> in =
                ask(*job.scene.lights()[0], vertex.hit.at.p, sampler.next2());
            if (!in) return Rgb(0);
            return vertex.value(in->w) * in->weight * transmitted_share(job.scene, vertex, *in, sampler);
        });
    });
}

// Samples directions uniformly in the cone that the bounding ball of S subtends, independently of the lamp's
// light.
std::optional<LightSample> even_in_cone(const Light& light, const V3f& x, const V2f& u) {
    const auto bounds = light.bounds();
    const V3f centre = bounds->box.center();
    const float radius = 0.5F * bounds->box.size().length(), way = (centre - x).length();
    if (!(way > radius)) return std::nullopt;
    // `height` is 1 - cos without cancellation.
    const double sin2 = sqr(double{radius} / double{way}), height = sin2 / (1 + std::sqrt(1 - sin2));
    const double z = 1 - double{u.x} * height, r = std::sqrt(std::max(0.0, 1 - z * z));
    const double phi = 2 * kPiD * double{u.y};
    const V3f w = Frame((centre - x) / way)
                      .to_world({static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
                                 static_cast<float>(z)});
    const auto seen = light.Le({x, w});
    if (!seen) return std::nullopt;
    const auto pdf = static_cast<float>(1 / (2 * kPiD * height));
    return LightSample{w, seen->distance, seen->radiance / pdf, pdf, kNoCell, seen->part};
}

// 4 sigma for each of 6 parts and 4 scenes: a correct program fails with another seed with probability
// 1.5e-3.
TEST(DirectMethods, PointsChosenForThePlace_AreUnbiasedByMeasuredLamps) {
    for (const char* lamp : {"flashlight", "projector", "three-led", "bike-light"}) {
        const std::string file = std::string("cloister/by-") + lamp + ".pbrt";
        const Job job = read({lamp, file.c_str()}, "direct", {});
        ASSERT_EQ(job.scene.lights().size(), 1U);
        const Parts reference = measured_by_light(job, 200'000, 11, even_in_cone);
        const Parts chosen = measured_by_light(
            job, 50'000, 12,
            [](const Light& light, const V3f& x, const V2f& u) { return light.sample_Li(x, u); });
        EXPECT_LT(most_sigmas_apart(chosen, reference), 4) << lamp;
        int lit = 0;
        double gain = 0;
        for (std::size_t i = 0; i < chosen.size(); ++i) {
            if (!(reference[i].mean() > 0)) continue;
            ++lit;
            gain = std::max(gain, sqr(reference[i].standard_error() / chosen[i].standard_error()));
        }
        EXPECT_GE(lit, 3) << lamp;
        EXPECT_GT(gain, 1) << lamp << ": over the variance of four times as many samples";
        // These weights use the density within a part, as if the part had not been drawn.
        const Parts wrong =
            measured_by_light(job, 50'000, 12, [](const Light& light, const V3f& x, const V2f& u) {
                auto in = light.sample_Li(x, u);
                if (in && in->part) in->weight *= in->pdf_w / in->part->part_pdf_w;
                return in;
            });
        EXPECT_GT(most_sigmas_apart(wrong, reference), 4) << lamp;
    }
}

// A point that the camera sees, and its illuminance.
struct LitPlace {
    V3f p, n;  // n on the visible side
    double e;
};
std::vector<LitPlace> lit_places(const Job& job, int count) {
    std::vector<LitPlace> places;
    const V2f size(static_cast<float>(job.film.width), static_cast<float>(job.film.height));
    for (int i = 0; i < count; ++i) {
        Sampler sampler = Sampler::stratified(5, Purpose::test, 0, static_cast<std::uint32_t>(i));
        const V2f u = sampler.next2();
        const Ray ray = job.camera.ray({u.x * size.x, u.y * size.y}, sampler.next2());
        const auto hit = job.scene.intersect(ray);
        if (!hit) continue;
        const Bsdf white = white_receiver(*hit);
        RunningStats e;
        for (std::uint32_t sample = 0; sample < 512; ++sample) {
            Sampler branch = sampler.split_stratified(0, sample);
            const Rgb found = testing::direct_radiance(job.scene, Vertex{*hit, white, -ray.d}, branch);
            e.add(double{luminance(meter_reading(found))});
        }
        const V3f& n = hit->at.n;
        if (e.mean() > 0) places.push_back({hit->at.p, n.dot(ray.d) > 0 ? -n : n, e.mean()});
    }
    return places;
}

// Where no photon lies near, direct light is missing: of the light seen, the share that is missing is the
// mean of E exp(-π r² E M/Φ) over that of E [guide.h]. The tolerance is a tenth, as light varies over a disc
// and discs extend beyond edges.
TEST(DirectMethods, Gated_LacksWhatIsPredictedOnWholeScenes) {
    for (const std::size_t which : {0U, 3U}) {
        const Case& c = kCases[which];
        const Job job = read(c, "direct", {});
        const std::vector<LitPlace> places = lit_places(job, 400);
        double all = 0;
        for (const LitPlace& place : places) all += place.e;
        ASSERT_GT(all, 0);
        const double flux = job.scene.picker().total_power();
        GuideSettings gate;
        gate.k = 0;
        gate.radius = 0.005F * job.scene.bounds().size().length();
        const double disc = kPiD * sqr(double{gate.radius});
        for (const double photons : {1.0, 4.0}) {  // in the disc of a place of mean illuminance
            const double paths = photons * flux / (disc * all / static_cast<double>(places.size()));
            const auto predicted = [&](double area) {
                double sum = 0;
                for (const LitPlace& at : places) sum += at.e * std::exp(-area * at.e * paths / flux);
                return sum / all;
            };
            RunningStats lacking;
            for (std::uint32_t map = 0; map < 40; ++map) {
                Monitor silent;
                const GuideMap guides = build_guides(
                    job.scene, {static_cast<std::int64_t>(paths), 6, map, gate}, Workers{}, silent);
                double sum = 0;
                for (const LitPlace& at : places) sum += guides.any_near(at.p, at.n) ? 0.0 : at.e;
                lacking.add(sum / all);
            }
            std::cout << c.name << ", " << photons << " photons: " << lacking.mean() << " +- "
                      << lacking.standard_error() << " missing, " << predicted(disc) << " predicted\n";
            const double slack = 4 * lacking.standard_error() + 0.1 * predicted(disc);
            EXPECT_NEAR(lacking.mean(), predicted(disc), slack) << c.name;
            // The test detects a disc of four times the area (a radius mistaken for half of itself).
            EXPECT_GT(lacking.mean() - predicted(4 * disc), slack) << c.name;
        }
    }
}

// The other scenes have one or two lights and leave nothing to choose.
TEST(DirectMethods, LightTree_IsUnbiasedWhereThereAreManyLights) {
    const Job job = read(kCases[2], "direct", {});
    const Parts by_power = measured(job, 400'000, 1, [&](const Ray& ray, Sampler& sampler) {
        return metered(job.scene, ray, [&](const Vertex& vertex) {
            SampleAccount account;
            direct_light(job.scene, vertex, sampler, LightChoice(), PathAccount(account));
            return account.radiance();
        });
    });
    const Parts by_tree =
        measured_by_integrator(kCases[2], "photonmap", {{"direct", "mc"}, {"indirect", "none"}}, 100'000, 2);
    EXPECT_LT(most_sigmas_apart(by_tree, by_power), 4);
}

TEST(ManyLights, Flux_IsTheSumOverTheBalls) {
    Monitor silent;
    const Job job =
        read_scene(testing::made_scenes() / "many-lights/many-lights.pbrt", {}, Workers{}, silent);
    ASSERT_EQ(job.scene.lights().size(), 384U);
    double flux = 0;
    for (const auto& light : job.scene.lights()) flux += light->power();
    EXPECT_NEAR(flux, 2453.93, 0.05);
}

}  // namespace direct_methods_test
}  // namespace lucerna
