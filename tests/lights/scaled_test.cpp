#include "lights/scaled.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <vector>

#include "engine/base/sampler.h"
#include "lights/analytic.h"

namespace lucerna {
namespace scaled_test {

const Rgb kFactor(2, 0.5F, 0);

// Returns an area light of two triangles, a point light (a delta light), and a sky (with an impostor).
std::vector<std::unique_ptr<Light>> some_lights() {
    std::vector<std::unique_ptr<Light>> lights;
    lights.push_back(make_area_light(
        TriangleEmitter{{{-1, 2, -1}, {1, 2, -1}, {0, 2, 1}, {3, 2, 0}}, {{0, 1, 2}, {1, 3, 2}}},
        Rgb(3, 2, 1), false));
    lights.push_back(make_point_light({0, 1, 0}, Rgb(1, 2, 3)));
    lights.push_back(make_infinite_light(Rgb(0.5F, 0.25F, 1), SceneSphere{}));
    return lights;
}

TEST(ScaledLight, EveryAnswer_IsThatOfTheLightTimesTheFactor) {
    const auto plain = some_lights();
    auto scaled = some_lights();
    Sampler sampler(2003, Purpose::test, 0, 0);
    for (std::size_t i = 0; i < plain.size(); ++i) {
        const Light& light = *plain[i];
        const std::unique_ptr<Light> bright = make_scaled_light(std::move(scaled[i]), kFactor);
        SCOPED_TRACE(light.kind());
        EXPECT_EQ(bright->kind(), light.kind());
        EXPECT_EQ(bright->flux(), light.flux() * kFactor);
        EXPECT_EQ(bright->is_delta(), light.is_delta());
        EXPECT_EQ(bright->has_impostor(), light.has_impostor());
        EXPECT_EQ(bright->part_bounds().size(), light.part_bounds().size());
        int particles = 0, seen = 0;
        for (int n = 0; n < 64; ++n) {
            const std::array<LeSampleU, 1> u{LeSampleU{sampler.next2(), sampler.next2(), sampler.bits()}};
            const auto particle = light.sample_Le(u[0]), brighter = bright->sample_Le(u[0]);
            ASSERT_EQ(particle.has_value(), brighter.has_value());
            if (particle) {
                ++particles;
                EXPECT_EQ(brighter->weight, particle->weight * kFactor);
            }
            std::array<std::optional<LeSample>, 1> many;
            bright->sample_Le_many(u, many);
            ASSERT_EQ(many[0].has_value(), particle.has_value());
            if (particle) {
                EXPECT_EQ(many[0]->weight, particle->weight * kFactor);
            }

            const V3f x(sampler.next2().x, 0, sampler.next2().y);
            const V2f v = sampler.next2();
            const auto arriving = light.sample_Li(x, v), more = bright->sample_Li(x, v);
            ASSERT_EQ(arriving.has_value(), more.has_value());
            if (!arriving) continue;
            ++seen;
            EXPECT_EQ(more->weight, arriving->weight * kFactor);
            EXPECT_EQ(more->pdf_w, arriving->pdf_w);
            const Ray ray{x, arriving->w};
            const auto emitted = light.Le(ray), more_emitted = bright->Le(ray);
            ASSERT_EQ(emitted.has_value(), more_emitted.has_value());
            if (emitted) {
                EXPECT_EQ(more_emitted->radiance, emitted->radiance * kFactor);
            }
            EXPECT_EQ(bright->Le_on_surface(ray, arriving->distance, V3f(0, -1, 0), 0).radiance,
                      light.Le_on_surface(ray, arriving->distance, V3f(0, -1, 0), 0).radiance * kFactor);
        }
        EXPECT_GT(particles, 0);
        EXPECT_GT(seen, 32);
    }
}

}  // namespace scaled_test
}  // namespace lucerna
