#include "engine/transport/passed_lamp.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/transport/direct_light.h"

namespace lucerna {

PassedLamp::PassedLamp(const Ray& ray, double end, const LightBounds& lamp) {
    const V3d way = V3d(lamp.box.center()) - V3d(ray.o), d(ray.d);
    nearest_ = way.dot(d);
    // Within its radius the lamp's light does not grow any more, so that the radius bounds the distance.
    constexpr double kLeast = 1e-6;  // times the distance to the lamp's centre, for a point lamp on the ray
    const double radius = 0.5 * double{lamp.box.size().length()};
    aside_ = std::max({(way - nearest_ * d).length(), radius, kLeast * way.length(), 1e-30});
    from_ = atan2(-nearest_, aside_);
    angle_ = atan2(end - nearest_, aside_) - from_;
}

double PassedLamp::draw(float u) const {
    return std::max(0.0, nearest_ + aside_ * tan(from_ + double{u} * angle_));
}

double PassedLamp::pdf(double t) const {
    return aside_ / (angle_ * (aside_ * aside_ + (t - nearest_) * (t - nearest_)));
}

float PassedLamp::share(double t, const Rgb& sigma_s) const {
    return power_heuristic(static_cast<float>(pdf(t)), max_component(sigma_s));
}

std::optional<PassedLamp> passed_lamp(const Scene& scene, const LightChooser& lights, const Ray& ray,
                                      double end, Sampler& sampler) {
    const float along = sampler.next(), u_light = sampler.next();
    const V2f u_place = sampler.next2();
    const V3f place = ray.at(along * static_cast<float>(std::min(end, double{diagonal(scene)})));
    const auto drawn = lights.at(place).draw(scene, place, u_light, u_place);
    if (!drawn) return std::nullopt;
    const auto bounds = scene.lights()[drawn->light]->bounds();
    if (!bounds) return std::nullopt;
    return PassedLamp(ray, end, *bounds);
}

std::optional<PassedLamp> add_light_beside_lamp(const Scene& scene, const LightChooser& lights,
                                                const PathAccount& path, const MediumPiece& piece,
                                                const std::optional<Hit>& hit, Sampler& sampler) {
    if (!piece.along.scatters()) return std::nullopt;
    const auto lamp = passed_lamp(scene, lights, piece.ray, double{piece.ray.t_max}, sampler);
    if (!lamp) return std::nullopt;
    const double t = lamp->draw(sampler.next());
    const MediaAlong before(scene.media(), piece.medium, piece.ray, t);
    const auto place = scattered_at(piece.along, before, t, path.throughput, sampler);
    if (!place) return lamp;
    const MediumVertex vertex{scattering_point(piece, t, hit), HenyeyGreenstein(place->g), -piece.ray.d,
                              piece.medium};
    const float share = lamp->share(t, scattering_at(scene.media(), piece.medium, vertex.p)) /
                        static_cast<float>(lamp->pdf(t));  // > 0
    const PathAccount there = path.times(place->flow).times(place->sigma_s).times(share);
    if (!is_black(there.throughput)) direct_light(scene, vertex, sampler, lights.at(vertex.p), there);
    return lamp;
}

}  // namespace lucerna
