#include "engine/scene/passage.h"

#include <cmath>

namespace lucerna {
namespace {

constexpr int kDirections = 32;    // in which medium_around() looks
constexpr int kMostPassages = 64;  // through which it looks in each

// Even over the sphere: the golden spiral.
V3f look_direction(int i) {
    const float z = 1 - (2 * static_cast<float>(i) + 1) / kDirections;
    const float r = std::sqrt(std::max(0.0F, 1 - z * z));
    const float phi = static_cast<float>(i) * 2.399963F;
    return V3f(r * std::cos(phi), r * std::sin(phi), z).normalized();
}

// The medium on the near side of the first border that a ray meets, through all surfaces that are none.
std::optional<std::int32_t> before_first_border(const Scene& scene, Ray ray) {
    for (int i = 0; i < kMostPassages; ++i) {
        const auto hit = scene.intersect_with_borders(ray);
        if (!hit) return std::nullopt;
        if (hit->media.border) return medium_towards(hit->media, hit->at.n, -ray.d, kNoMedium);
        ray = Ray{hit->at.towards(ray.d), ray.d};
    }
    return std::nullopt;
}

}  // namespace

Rgb passage(const Scene& scene, const Ray& ray, std::int32_t medium, Sampler& sampler) {
    Rgb result(1);
    if (scene.media().empty()) return result;
    for_each_piece(scene, ray, medium, [&](MediumPiece piece) {
        result *= transmittance(std::move(piece.along), sampler);
        return !is_black(result);
    });
    return result;
}

V3f scattering_point(const MediumPiece& piece, double t, const std::optional<Hit>& hit) {
    if (hit) {
        const float height = static_cast<float>(piece.to_go - t) * std::fabs(piece.ray.d.dot(hit->at.n));
        if (!(height > hit->at.error)) return hit->at.towards(-piece.ray.d);
    }
    return piece.ray.at(static_cast<float>(t));
}

Crossing cross_media(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit, std::int32_t medium,
                     const Rgb& power, Sampler& sampler) {
    Crossing crossing{power, medium, {}};
    const Ray way{ray.o, ray.d, hit ? hit->t : ray.t_max};
    crossing.medium = for_each_piece(scene, way, medium, [&](MediumPiece piece) {
        const Flight flight = fly(piece.along, crossing.power, sampler);
        crossing.power = flight.throughput;
        if (flight.scattered) {
            crossing.scattered = {scattering_point(piece, flight.t, hit), flight.g};
            return false;
        }
        return !is_black(crossing.power);
    });
    return crossing;
}

std::int32_t medium_around(const Scene& scene, const SurfacePoint& from, const V3f& d) {
    const SceneMedia& media = scene.media();
    if (media.all.size() == media.regions.size()) return kNoMedium;  // regions are no borders' media
    if (const auto found = before_first_border(scene, Ray{from.towards(d), d})) return *found;
    for (int i = 0; i < kDirections; ++i) {
        V3f w = look_direction(i);
        if (from.n.dot(w) * from.n.dot(d) < 0) w = -w;  // all on the side on which light leaves
        if (const auto found = before_first_border(scene, Ray{from.towards(w), w})) return *found;
    }
    return media.camera;
}

}  // namespace lucerna
