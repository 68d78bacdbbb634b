#include "engine/render/photon_estimator.h"

#include "engine/render/direct_light.h"
#include "engine/render/guided_light.h"
#include "engine/render/irradiance_ahead.h"
#include "engine/render/specular_chain.h"
#include "photon/gather.h"
#include "photon/volume_gather.h"

namespace lucerna {
namespace {

// Bounces at which a gather ray that lands too near is followed further, and rough surfaces are.
constexpr int kMostEyeBounces = 64;

// Bounces over shiny surfaces from the eye that are followed without roulette.
constexpr int kSureBounces = 4;

// How much larger than the radius at a place those of the caustic photons that reach it may be: radii change
// slowly, by less than half of the way from one place to the other.
constexpr float kCausticReach = 2;

// Branches of a sample's stream: 0 gathers; one for each map's probes.
constexpr std::uint32_t kProbesBranch = 1;

// Which quality a surface is shaded with.
enum class Stage : std::uint8_t {
    eye,     // the camera sees it, straight or over shiny surfaces
    gather,  // a gather ray landed there: blurred over a hemisphere before anyone sees it
};

class PhotonMapEstimator final : public Estimator {
  public:
    PhotonMapEstimator(const Scene& scene, const PhotonMapSettings& settings, const GatherPair& gather,
                       PhotonEstimatorParts parts)
        : scene_(scene),
          settings_(settings),
          gather_(gather),
          maps_(std::move(parts.maps)),
          guides_(std::move(parts.guides)),
          irradiance_(std::move(parts.irradiance)),
          radii_(std::move(parts.radii)),
          caustic_radii_(std::move(parts.caustic_radii)),
          guided_{settings.guide_floor,
                  settings.candidates > 0 ? settings.candidates : candidates_that_pay(scene)},
          lights_(scene, settings.lights) {}

    Rgb radiance(const Ray& ray, Stream& stream) const override {
        if (settings_.quantity == Quantity::illuminance) {
            return meter_and_shade(scene_, ray, [&](const Vertex& vertex) {
                return DirectLight{seen(vertex, stream), {}};
            });
        }
        return trace(ray, scene_.media().camera, EmissionRule::all(), Stage::eye, stream);
    }

  private:
    // A surface's diffuse part, which photons are gathered for, and the rest, which is traced.
    struct Split {
        std::optional<Bsdf> diffuse, rest;

        explicit Split(const Bsdf& bsdf) {
            if (stores_photons(bsdf)) diffuse = bsdf.diffuse_part();
            if (!diffuse || !bsdf.is_diffuse()) rest = bsdf.rest();
        }
    };

    // What is not diffuse at a surface. Where the light of all chains of specular bounces is counted already
    // (the rule is none: the ray began at a surface that has its direct light and its caustics), gloss that
    // counts as specular asks no lights and passes that rule on.
    struct Sheen {
        std::optional<Bsdf> asks, counted;

        Sheen(const std::optional<Bsdf>& rest, const EmissionRule& rule, float specular_below) {
            if (!rest) return;
            asks = rest;
            if (rule.kind != EmissionRule::Kind::none || !(specular_below > 0)) return;
            const Bsdf sharp = rest->sharp_part(specular_below), blurred = rest->blurred_part(specular_below);
            if (sharp.is_black()) return;
            counted = sharp;
            asks = blurred.is_black() ? std::nullopt : std::optional(blurred);
        }
    };

    // Radiance along a ray up to and including the first surface that is diffuse and nothing else.
    // The ray begins in `medium`.
    Rgb trace(Ray ray, std::int32_t medium, EmissionRule rule, Stage stage, Stream& stream) const {
        Rgb result(0);
        Rgb throughput(1);
        const auto source = [&](const MediumVertex& vertex, const Rgb& sigma_s) {
            return in_scattered(vertex, sigma_s, stage, stream);
        };
        for (int depth = 0; depth < kMostEyeBounces; ++depth) {
            const SpecularChain chain =
                follow_specular(scene_, ray, medium, rule, settings_.max_specular_depth, stream, source);
            result += throughput * chain.emitted;
            if (!chain.hit) break;
            throughput *= chain.throughput;
            const Bsdf bsdf = scene_.bsdf(*chain.hit);
            const Split split(bsdf);
            Ways ways;
            LightChoice rest_lights;
            if (split.diffuse) {
                const Vertex vertex = chain.vertex(*split.diffuse);
                if (stage == Stage::eye) {
                    result += throughput * seen(vertex, stream);
                } else {
                    const Landing landing = landed(vertex, chain.length, depth, stream);
                    result += throughput * landing.radiance;
                    if (landing.goes_on) ways.diffuse = &*split.diffuse;
                }
            }
            const Sheen sheen(split.rest, rule, settings_.specular_below);
            if (sheen.asks) {  // no photons there: ask the lights, then follow the BSDF
                rest_lights = lights_.at(chain.hit->at, *sheen.asks, chain.wo);
                result += throughput * next_event(scene_, chain.vertex(*sheen.asks), stream, rest_lights);
                ways.rest = &*sheen.asks;
            }
            if (sheen.counted) ways.counted = &*sheen.counted;
            const auto next = go_on(ways, chain.wo, rule, rest_lights, stream);
            if (!next) break;
            throughput *= next->sample.weight;
            // Faint gloss that the camera sees is followed all the same: one ray beside all those that
            // gather, where roulette would make bright specks of what lamps it mirrors.
            const bool sure = stage == Stage::eye && depth < kSureBounces;
            const float survival = sure ? 1.0F : std::min(1.0F, max_component(throughput));
            if (!(stream.next() < survival)) break;
            throughput /= survival;
            rule = next->rule;
            medium = chain.vertex(bsdf).medium_towards(next->sample.wi);
            ray = Ray{chain.hit->at.towards(next->sample.wi), next->sample.wi};
        }
        return result;
    }

    // What media scatter into a ray at a place: radiance per unit of length.
    Rgb in_scattered(const MediumVertex& vertex, const Rgb& sigma_s, Stage stage, Stream& stream) const {
        Rgb result(0);
        if (settings_.direct != DirectMethod::map) {
            result += sigma_s * direct_light(scene_, vertex, stream, lights_.at(vertex.p));
        }
        if (const PhotonMap* map = maps_.find(MapKind::volume)) {
            const GatherSettings& how = stage == Stage::eye ? gather_.seen : gather_.landed;
            VolumeGatherSettings volume{how.k, gather_.volume_radius};
            if (radii_) volume = {0, radii_->volume_radius()};
            const VolumeGather gather(scene_, *map, volume);
            const ScatteringPoint at{vertex.p, vertex.phase, vertex.wo, vertex.medium, sigma_s};
            result += gather.in_scattered(at, stream).value;
        }
        return result;
    }

    // A diffuse surface that the camera sees.
    Rgb seen(const Vertex& vertex, Stream& stream) const {
        Rgb result = direct(vertex, gather_.seen, stream);
        if (settings_.indirect == IndirectMethod::none) return result;
        result += estimate(MapKind::caustic, vertex, gather_.seen, stream).value;
        if (settings_.indirect == IndirectMethod::map) {
            return result + estimate(MapKind::global, vertex, gather_.seen, stream).value;
        }
        Rgb gathered(0);
        for (int i = 0; i < settings_.gather_rays; ++i) {
            Stream branch = stream.split_stratified(0, static_cast<std::uint32_t>(i));
            gathered += gather_ray(vertex, branch);
        }
        return result + gathered / static_cast<float>(settings_.gather_rays);
    }

    struct Landing {
        Rgb radiance;
        bool goes_on;  // what arrives over more than one bounce is still to be found
    };
    // A diffuse surface where a gather ray landed, `length` away from where it began. An estimate whose
    // disc is wider than that would take in light from around the corner it is gathered for; then the ray
    // goes on.
    Landing landed(const Vertex& vertex, float length, int depth, Stream& stream) const {
        const Looked looked = look(vertex, stream);
        if (looked.radius > length && depth + 1 < kMostEyeBounces) {
            const Rgb sampled = asked(vertex, stream);
            return {sampled + estimate(MapKind::caustic, vertex, gather_.landed, stream).value, true};
        }
        if (looked.has_direct) return {looked.radiance, false};
        return {direct(vertex, gather_.landed, stream) + looked.radiance, false};
    }

    // Direct light by the chosen method.
    Rgb direct(const Vertex& vertex, const GatherSettings& how, Stream& stream) const {
        if (settings_.direct == DirectMethod::map)
            return estimate(MapKind::direct, vertex, how, stream).value;
        return asked(vertex, stream);
    }
    // The same, by rays: where the Direct map is read elsewhere, plainly.
    Rgb asked(const Vertex& vertex, Stream& stream) const {
        const LightChoice plain = lights_.at(vertex.hit.at, vertex.bsdf, vertex.wo);
        if (!guides_) return direct_light(scene_, vertex, stream, plain).radiance;
        if (settings_.direct == DirectMethod::gated) {
            return gated_light(scene_, *guides_, vertex, stream, plain).radiance;
        }
        return GuidedLight(scene_, *guides_, guided_)(vertex, stream, plain).radiance;
    }

    // The parts of a surface by which a ray may go on.
    struct Ways {
        const Bsdf* diffuse = nullptr;
        const Bsdf* rest = nullptr;
        const Bsdf* counted = nullptr;  // Sheen's
    };
    struct Step {
        BsdfSample sample;
        EmissionRule rule;
    };
    // One of them, by chance where there are several: a ray that split at every surface would never end.
    std::optional<Step> go_on(const Ways& ways, const V3f& wo, const EmissionRule& rule,
                              const LightChoice& rest_lights, Stream& stream) const {
        const float u_way = stream.next();
        const BsdfU u{stream.next(), stream.next2()};
        std::array<const Bsdf*, 3> open{};
        std::size_t count = 0;
        for (const Bsdf* way : {ways.diffuse, ways.rest, ways.counted}) {
            if (way) open[count++] = way;
        }
        if (count == 0) return std::nullopt;
        const auto share = static_cast<float>(count);
        const Bsdf* way = open[std::min(static_cast<std::size_t>(u_way * share), count - 1)];
        const auto sample = way->sample(wo, u, Transport::radiance);
        if (!sample) return std::nullopt;
        Step step{*sample, EmissionRule::none()};  // after diffuse: direct light and caustics are counted
        step.sample.weight *= share;
        if (way == ways.rest) {
            step.rule =
                sample->delta ? rule.through_specular() : EmissionRule::mis(sample->pdf_w, rest_lights);
        }
        return step;
    }

    struct Looked {
        Rgb radiance;
        float radius;     // of the Global map's estimate
        bool has_direct;  // or what the Direct map would say is still missing
    };
    // What the maps say where a gather ray landed: looked up if it was computed ahead of time and says all
    // there is to know, else estimated. A base under varnish that a lamp shines on from one side would be off
    // by percents, and a wall whose relief leans towards the light by as much as the cosine is.
    Looked look(const Vertex& vertex, const Stream& stream) const {
        if (irradiance_ && irradiance_suffices(vertex.bsdf)) {
            const V3f& n = vertex.hit.at.n;
            const V3f side = n.dot(vertex.wo) < 0 ? -n : n;
            if (const auto found = irradiance_->nearest(vertex.hit.at.p, side, gather_.landed.radius)) {
                return {found->irradiance * vertex.bsdf.albedo(vertex.wo) * kInvPi, found->radius,
                        holds_direct(settings_, scene_)};
            }
        }
        const GatherResult global = estimate(MapKind::global, vertex, gather_.landed, stream);
        return {global.value + estimate(MapKind::caustic, vertex, gather_.landed, stream).value,
                global.radius, false};
    }

    // Indirect radiance by way of one direction. Emission at its end is direct light or a caustic, counted
    // elsewhere.
    Rgb gather_ray(const Vertex& vertex, Stream& stream) const {
        const BsdfU u{stream.next(), stream.next2()};
        const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
        if (!sample) return Rgb(0);
        const Ray ray{vertex.hit.at.towards(sample->wi), sample->wi};
        return sample->weight *
               trace(ray, vertex.medium_towards(sample->wi), EmissionRule::none(), Stage::gather, stream);
    }

    // Draws nothing of the stream itself.
    GatherResult estimate(MapKind kind, const Vertex& vertex, const GatherSettings& how,
                          const Stream& stream) const {
        const PhotonMap* map = maps_.find(kind);
        if (!map) return {};
        GatherSettings own = how;
        // A correction takes light to be even over the disc; a caustic is not.
        if (kind == MapKind::caustic) own.boundary = Boundary::none;
        const Hit& hit = vertex.hit;
        if (radii_) {
            const SurfacePoint& at = hit.at;
            own.k = 0;  // all
            // Below the surface's own error float32 cannot tell points apart.
            own.radius =
                std::max(radii_->radius(kind, at.p, at.n.dot(vertex.wo) < 0 ? -at.n : at.n), at.error);
            if (kind == MapKind::caustic) {
                own.radius *= kCausticReach;
                return Gather(*map, own, caustic_radii_).radiance(hit, vertex.bsdf, vertex.wo);
            }
        }
        const Probing probing{scene_, stream.split(kProbesBranch + static_cast<std::uint32_t>(kind))};
        return Gather(*map, own, probing).radiance(hit, vertex.bsdf, vertex.wo);
    }

    const Scene& scene_;
    PhotonMapSettings settings_;
    GatherPair gather_;
    PhotonMaps maps_;
    std::optional<GuideMap> guides_;
    std::optional<IrradiancePoints> irradiance_;
    std::unique_ptr<const RadiusRule> radii_;
    std::vector<float> caustic_radii_;
    GuidedLightSettings guided_;
    LightChooser lights_;
};

}  // namespace

std::unique_ptr<const Estimator> make_photon_estimator(const Scene& scene, const PhotonMapSettings& settings,
                                                       const GatherPair& gather, PhotonEstimatorParts parts) {
    return std::make_unique<PhotonMapEstimator>(scene, settings, gather, std::move(parts));
}

}  // namespace lucerna
