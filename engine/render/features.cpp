#include "engine/render/features.h"

#include <optional>

#include "engine/denoise/denoise.h"
#include "engine/render/film.h"
#include "engine/render/tiles.h"

namespace lucerna {
namespace {

// So many mirrors and panes, one behind the other.
constexpr int kMostSpecular = 16;

struct Seen {
    Rgb albedo{1.0F};
    V3f normal{0, 0, 0}, geometric_normal{0, 0, 0}, position{0, 0, 0};
    float depth = 0, emitter = 1;
};

// Of what has no peak exactly, of gloss by its guess.
Rgb feature_albedo(const Bsdf& bsdf, const V3f& wo) {
    Rgb albedo(0.0F);
    if (bsdf.has_diffuse()) albedo = bsdf.diffuse_part().albedo(wo);
    if (!bsdf.is_diffuse()) albedo += Rgb(bsdf.rest().guessed_albedo(wo));
    return {std::min(albedo.x, 1.0F), std::min(albedo.y, 1.0F), std::min(albedo.z, 1.0F)};
}

// By the brighter way at smooth boundaries: what is seen, as far as one surface can tell.
Seen first_surface(const Scene& scene, Ray ray) {
    Seen seen;
    for (int specular = 0; specular < kMostSpecular; ++specular) {
        const auto hit = scene.intersect(ray);
        if (!hit) break;
        seen.depth += hit->t;
        const Bsdf bsdf = scene.bsdf(*hit);
        const V3f wo = -ray.d;
        const bool emits = hit->light != kNoLight;
        if (emits || !bsdf.is_delta() || bsdf.is_black()) {
            if (!emits) seen.albedo *= feature_albedo(bsdf, wo);
            seen.geometric_normal = face_forward(hit->at.n, wo);
            seen.normal = face_forward(bsdf.shading_normal(), seen.geometric_normal);
            seen.position = hit->at.p;
            seen.emitter = emits ? 1 : 0;
            return seen;
        }
        const float reflect = bsdf.reflect_chance(wo).value_or(1);
        const BsdfU u{reflect >= 0.5F ? 0.0F : 0.5F * (1 + reflect), V2f(0.5F)};
        const auto sample = bsdf.sample(wo, u, Transport::radiance);
        if (!sample) break;
        seen.albedo *= sample->weight;
        ray = Ray{hit->at.towards(sample->wi), sample->wi};
    }
    seen.depth = 0;
    return seen;
}

}  // namespace

Image render_features(const Job& job, std::uint64_t seed, int samples, const Workers& workers,
                      Monitor& monitor) {
    const V2i size = job.film.rendered_size();
    Image image(size.x, size.y, feature_channels());
    const CameraSampler sampler(job, seed, 0);
    parallel_each(workers, static_cast<std::size_t>(size.y), 1, [&](std::size_t row) {
        if (monitor.stopped()) return;
        const auto y = static_cast<int>(row);
        for (int x = 0; x < size.x; ++x) {
            float* to = &image.data[image.index(x, y)];
            for (int s = 0; s < samples; ++s) {
                const Seen seen = first_surface(job.scene, sampler.sample({x, y}, s).camera.ray);
                const float values[kFeatureChannels] = {
                    seen.albedo.x,           seen.albedo.y, seen.albedo.z,           seen.normal.x,
                    seen.normal.y,           seen.normal.z, seen.position.x,         seen.position.y,
                    seen.position.z,         seen.depth,    seen.geometric_normal.x, seen.geometric_normal.y,
                    seen.geometric_normal.z, seen.emitter};
                for (int c = 0; c < kFeatureChannels; ++c) to[c] += values[c] / static_cast<float>(samples);
            }
        }
    });
    return image;
}

}  // namespace lucerna
