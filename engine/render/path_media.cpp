// The path tracer in participating media: as path.cpp, and between two surfaces a path may be scattered.
//
// A path carries the medium that borders put it in; regions are found from the ray alone. Lights are asked
// at surfaces and in media alike, and the share of each strategy goes by the densities of directions alone:
// both are weighed by the same transmittance, so it need not be in them.
#include "engine/render/direct_light.h"
#include "engine/render/flight.h"
#include "engine/render/path_estimators.h"
#include "engine/world/phase.h"
#include "photon/walk.h"

namespace lucerna {
namespace {

// Borders between two vertices of a path. Only rounding at a grazing border can exhaust them.
constexpr int kMaxBorders = 10'000;
constexpr std::uint32_t kShadowBranch = 0x5d;
constexpr std::uint32_t kLampBranch = 0x1a;

// What a light is asked for, at a surface and in a medium: f·cosθ or the phase function towards w, the
// density with which a path would have gone there, and the medium that it would have gone into.
struct AtSurface {
    const Hit& hit;
    const Bsdf& bsdf;
    V3f wo;
    std::int32_t medium;

    SurfacePoint from() const { return hit.at; }
    Rgb value(const V3f& w) const {
        return bsdf.f(wo, w, Transport::radiance) * std::fabs(w.dot(bsdf.shading_normal()));
    }
    float pdf_w(const V3f& w) const { return bsdf.pdf_w(wo, w); }
    std::int32_t medium_towards(const V3f& w) const {
        return lucerna::medium_towards(hit.media, hit.at.n, w, medium);
    }
};

struct InMedium {
    V3f p;
    HenyeyGreenstein phase;
    V3f wo;
    std::int32_t medium;

    SurfacePoint from() const { return {p}; }
    Rgb value(const V3f& w) const { return Rgb(phase.value(wo, w)); }
    float pdf_w(const V3f& w) const { return phase.value(wo, w); }
    std::int32_t medium_towards(const V3f&) const { return medium; }
};

class MediaPathEstimator final : public Estimator {
  public:
    MediaPathEstimator(const Scene& scene, const PathSettings& settings)
        : scene_(scene), media_(scene.media()), settings_(settings) {}

    Rgb radiance(const Ray& camera_ray, Stream& stream) const override;

  private:
    struct Path {
        Ray ray;
        EmissionRule rule = EmissionRule::all();
        std::int32_t medium = kNoMedium;
        Rgb throughput{1.0F};
        Rgb result{0.0F};
        float eta_scale = 1;
    };
    // The end of a leg: scattered in a medium, or a surface, or neither (the path is over).
    struct Leg {
        std::optional<Hit> hit;
        std::optional<InMedium> scattered;
    };

    Leg travel(Path& path, Stream& stream) const;
    Leg look(Path& path) const;
    void meet_lamps(Path& path, const Ray& rest, float travelled, const std::optional<Hit>& hit,
                    Stream& stream) const;
    bool leave(Path& path, const Leg& leg, bool metered, Stream& stream) const;
    template <typename Place>
    Rgb ask_light(const Place& place, Stream& stream) const;
    Rgb passed(const SurfacePoint& x, const V3f& w, float distance, std::int32_t medium,
               Stream& stream) const;

    const Scene& scene_;
    const SceneMedia& media_;
    PathSettings settings_;
};

Rgb MediaPathEstimator::radiance(const Ray& camera_ray, Stream& stream) const {
    Path path;
    path.ray = camera_ray;
    path.medium = media_.camera;
    const bool meter = settings_.quantity == Quantity::illuminance;
    for (int bounce = 0; bounce < static_cast<int>(kMaxBounces); ++bounce) {
        const bool metered = meter && bounce == 0;
        const Leg leg = metered ? look(path) : travel(path, stream);
        if (!leg.hit && !leg.scattered) break;
        if (settings_.max_depth > 0 && bounce >= settings_.max_depth) break;
        if (!leave(path, leg, metered, stream)) break;

        // Russian roulette by what the path is still worth.
        const float u_survive = stream.next();
        if (is_black(path.throughput)) break;
        if (bounce + 1 < kRouletteFrom) continue;
        const float survival = std::min(kMaxSurvival, max_component(path.throughput) / path.eta_scale);
        if (!(u_survive < survival)) break;
        path.throughput /= survival;
    }
    return meter ? meter_reading(path.result) : path.result;
}

// The first surface, for a meter that lies on it: what is between it and the camera does not matter.
MediaPathEstimator::Leg MediaPathEstimator::look(Path& path) const {
    for (int borders = 0; borders < kMaxBorders; ++borders) {
        const auto hit = scene_.hit_or_border(path.ray);
        if (!hit) return {};
        if (!scene_.is_border(*hit)) return {hit, {}};
        path.medium = medium_towards(hit->media, hit->at.n, path.ray.d, path.medium);
        path.ray = Ray{hit->at.towards(path.ray.d), path.ray.d};
    }
    return {};
}

// Where a path is scattered that would have met `hit`: never on the far side of it, whatever was rounded.
V3f scattering_point(const Ray& ray, double t, const std::optional<Hit>& hit) {
    if (hit) {
        const float height = (hit->t - static_cast<float>(t)) * std::fabs(ray.d.dot(hit->at.n));
        if (!(height > hit->at.error)) return hit->at.towards(-ray.d);
    }
    return ray.at(static_cast<float>(t));
}

// From one vertex to the next, through borders, with what is emitted on the way.
MediaPathEstimator::Leg MediaPathEstimator::travel(Path& path, Stream& stream) const {
    Ray rest = path.ray;  // from the last border on
    float travelled = 0;
    for (int borders = 0; borders < kMaxBorders; ++borders) {
        const auto hit = scene_.hit_or_border(rest);
        meet_lamps(path, rest, travelled, hit, stream);
        const double end = static_cast<double>(hit ? hit->t : rest.t_max);
        const MediaAlong along(media_, path.medium, rest, end);
        if (!along.empty()) {
            const Flight flight = fly(along, path.throughput, stream);
            path.result += flight.emitted;
            path.throughput = flight.throughput;
            if (is_black(path.throughput)) return {};
            if (flight.scattered) {
                const V3f p = scattering_point(rest, flight.t, hit);
                return {{}, InMedium{p, HenyeyGreenstein(flight.g), -rest.d, path.medium}};
            }
        }
        // The vertex sees all that lies before it as one ray: the densities of lights go by it.
        std::optional<Hit> seen = hit;
        if (seen) seen->t += travelled;
        const bool border = hit && scene_.is_border(*hit);
        if (!border) {
            path.result += path.throughput * surface_emission(scene_, path.ray, seen, path.rule);
            if (!hit) return {};
            return {hit, {}};
        }
        path.medium = medium_towards(hit->media, hit->at.n, rest.d, path.medium);
        travelled = seen->t;
        rest = Ray{hit->at.towards(rest.d), rest.d};
    }
    return {};
}

// Light from what is no surface: a lamp's impostor within reach, or the sky if nothing is met.
void MediaPathEstimator::meet_lamps(Path& path, const Ray& rest, float travelled,
                                    const std::optional<Hit>& hit, Stream& stream) const {
    if (path.rule.kind == EmissionRule::Kind::none || scene_.impostors().empty()) return;
    const float end = hit ? travelled + hit->t : INFINITY;
    Stream more = stream.split(kLampBranch);
    for (const std::uint32_t light : scene_.impostors()) {
        const auto seen = scene_.lights()[light]->seen(path.ray);
        if (!seen || seen->distance < travelled) continue;
        if (!(seen->distance < end) && !(!hit && std::isinf(seen->distance))) continue;
        const float share = path.rule.share(seen->pdf_w * scene_.picker().probability(light));
        const double distance = static_cast<double>(seen->distance - travelled);
        const Rgb passing = transmittance(MediaAlong(media_, path.medium, rest, distance), more);
        path.result += path.throughput * passing * seen->radiance * share;
    }
}

// Asks the lights, and chooses where the path goes on. False: it ends.
bool MediaPathEstimator::leave(Path& path, const Leg& leg, bool metered, Stream& stream) const {
    if (leg.scattered) {
        path.result += path.throughput * ask_light(*leg.scattered, stream);
        const V3f wi = leg.scattered->phase.sample(leg.scattered->wo, stream.next2());
        path.rule = EmissionRule::mis(leg.scattered->pdf_w(wi));
        path.ray = Ray{leg.scattered->p, wi};
        return true;
    }
    const Hit& hit = *leg.hit;
    const Bsdf bsdf = metered ? white_receiver(hit) : scene_.bsdf(hit);
    const V3f wo = -path.ray.d;
    if (!bsdf.is_delta()) {
        path.result += path.throughput * ask_light(AtSurface{hit, bsdf, wo, path.medium}, stream);
    }
    const BsdfU u{stream.next(), stream.next2()};
    const auto sample = bsdf.sample(wo, u, Transport::radiance);
    if (!sample) return false;
    path.throughput *= sample->weight;
    path.eta_scale *= sample->eta_scale;
    path.rule = sample->delta ? EmissionRule::all() : EmissionRule::mis(sample->pdf_w);
    path.medium = medium_towards(hit.media, hit.at.n, sample->wi, path.medium);
    path.ray = Ray{hit.at.towards(sample->wi), sample->wi};
    return true;
}

// Radiance from one light, chosen by power and asked for a direction; without the path's throughput.
template <typename Place>
Rgb MediaPathEstimator::ask_light(const Place& place, Stream& stream) const {
    const float u_light = stream.next();
    const V2f u_place = stream.next2();
    const auto pick = scene_.picker().pick(u_light);
    if (!pick) return Rgb(0);
    const SurfacePoint x = place.from();
    const Light& light = *scene_.lights()[pick->light];
    const auto incident = light.illuminate(x.p, u_place);
    if (!incident) return Rgb(0);
    Rgb result = place.value(incident->w) * incident->weight * (1 / pick->probability);  // picked: > 0
    if (!light.is_delta()) {
        result *= power_heuristic(incident->pdf_w * pick->probability, place.pdf_w(incident->w));
    }
    if (is_black(result) || !scene_.visible(x, incident->w, incident->distance)) return Rgb(0);
    Stream more = stream.split(kShadowBranch);
    return result * passed(x, incident->w, incident->distance, place.medium_towards(incident->w), more);
}

// The share that passes the media over a free way, border after border.
Rgb MediaPathEstimator::passed(const SurfacePoint& x, const V3f& w, float distance, std::int32_t medium,
                               Stream& stream) const {
    Rgb result(1);
    Ray rest{x.towards(w), w, distance};
    for (int borders = 0; borders < kMaxBorders; ++borders) {
        const auto hit = scene_.has_borders() ? scene_.hit_border(rest) : std::nullopt;
        const double end = static_cast<double>(hit ? hit->t : rest.t_max);
        const MediaAlong along(media_, medium, rest, end);
        if (!along.empty()) result *= transmittance(along, stream);
        if (!hit || is_black(result)) return result;
        medium = medium_towards(hit->media, hit->at.n, w, medium);
        rest = Ray{hit->at.towards(w), w, rest.t_max - hit->t};
        if (!(rest.t_max > 0)) return result;
    }
    return Rgb(0);
}

}  // namespace

std::unique_ptr<const Estimator> make_media_path(const Scene& scene, const PathSettings& settings) {
    return std::make_unique<MediaPathEstimator>(scene, settings);
}

}  // namespace lucerna
