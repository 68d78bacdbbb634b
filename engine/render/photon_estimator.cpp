#include "engine/render/photon_estimator.h"

#include "engine/render/direct_light.h"
#include "engine/render/guided_light.h"
#include "engine/render/precompute_irradiance.h"
#include "engine/render/specular_chain.h"
#include "photon/density_estimate.h"
#include "photon/volume_estimate.h"

namespace lucerna {
namespace {

// Bounces at which a gather ray that lands too near is followed further, and rough surfaces are.
constexpr int kMostEyeBounces = 64;

// Bounces over shiny surfaces from the eye that are followed without roulette.
constexpr int kSureBounces = 4;

// How much larger than the radius at a place those of the caustic photons that reach it may be: radii change
// slowly, by less than half of the way from one place to the other.
constexpr float kCausticReach = 2;

// Branches of a sample's sampler: 0 for gather rays; one for each map's probes.
constexpr std::uint32_t kProbesBranch = 1;

// Which quality a surface is shaded with.
enum class Stage : std::uint8_t {
    eye,     // the camera sees it, straight or over shiny surfaces
    gather,  // a gather ray landed there: blurred over a hemisphere before anyone sees it
};

class PhotonMapEstimator final : public Estimator {
  public:
    PhotonMapEstimator(const Scene& scene, const PhotonMapSettings& settings,
                       const DensityEstimatePair& estimates, PhotonEstimatorParts parts)
        : scene_(scene),
          settings_(settings),
          estimates_(estimates),
          maps_(std::move(parts.maps)),
          guides_(std::move(parts.guides)),
          irradiance_(std::move(parts.irradiance)),
          radii_(std::move(parts.radii)),
          caustic_radii_(std::move(parts.caustic_radii)),
          guided_{settings.guide_defensive_weight,
                  settings.candidates > 0 ? settings.candidates : candidates_that_pay(scene)},
          lights_(scene, settings.lights) {}

    Rgb radiance(const Ray& ray, Sampler& sampler) const override {
        if (settings_.quantity == Quantity::illuminance) {
            return meter_and_shade(scene_, ray, [&](const Vertex& vertex) {
                return DirectLight{shade_eye(vertex, sampler), {}};
            });
        }
        return trace(ray, scene_.media().camera, EmissionRule::all(), Stage::eye, sampler);
    }

  private:
    // A surface's diffuse part, for which radiance is estimated from photons, and the rest, which is traced.
    struct Split {
        std::optional<Bsdf> diffuse, rest;

        explicit Split(const Bsdf& bsdf) {
            if (stores_photons(bsdf)) diffuse = bsdf.diffuse_part();
            if (!diffuse || !bsdf.is_diffuse()) rest = bsdf.rest();
        }
    };

    // What is not diffuse at a surface. Where the light of all chains of specular bounces is counted already
    // (the rule is none: the ray began at a surface that has its direct light and its caustics), gloss that
    // counts as specular samples no lights and passes that rule on.
    struct GlossySplit {
        std::optional<Bsdf> sampled, counted;

        GlossySplit(const std::optional<Bsdf>& rest, const EmissionRule& rule, float specular_below) {
            if (!rest) return;
            sampled = rest;
            if (rule.kind != EmissionRule::Kind::none || !(specular_below > 0)) return;
            const Bsdf sharp = rest->sharp_part(specular_below), blurred = rest->blurred_part(specular_below);
            if (sharp.is_black()) return;
            counted = sharp;
            sampled = blurred.is_black() ? std::nullopt : std::optional(blurred);
        }
    };

    // Radiance along a ray up to and including the first surface that is diffuse and nothing else.
    // The ray begins in `medium`.
    Rgb trace(Ray ray, std::int32_t medium, EmissionRule rule, Stage stage, Sampler& sampler) const {
        Rgb result(0);
        Rgb throughput(1);
        const auto source = [&](const MediumVertex& vertex, const Rgb& sigma_s) {
            return in_scattered(vertex, sigma_s, stage, sampler);
        };
        for (int depth = 0; depth < kMostEyeBounces; ++depth) {
            const SpecularChain chain =
                follow_specular(scene_, ray, medium, rule, settings_.max_specular_depth, sampler, source);
            result += throughput * chain.emitted;
            if (!chain.hit) break;
            throughput *= chain.throughput;
            const Bsdf bsdf = scene_.bsdf(*chain.hit);
            const Split split(bsdf);
            ContinuationLobes lobes;
            LightChoice rest_lights;
            if (split.diffuse) {
                const Vertex vertex = chain.vertex(*split.diffuse);
                if (stage == Stage::eye) {
                    result += throughput * shade_eye(vertex, sampler);
                } else {
                    const GatherShading shading = shade_gather(vertex, chain.length, depth, sampler);
                    result += throughput * shading.radiance;
                    if (shading.continues) lobes.diffuse = &*split.diffuse;
                }
            }
            const GlossySplit glossy(split.rest, rule, settings_.specular_below);
            if (glossy.sampled) {  // no photons there: ask the lights, then follow the BSDF
                rest_lights = lights_.at(chain.hit->at, *glossy.sampled, chain.wo);
                result +=
                    throughput * next_event(scene_, chain.vertex(*glossy.sampled), sampler, rest_lights);
                lobes.rest = &*glossy.sampled;
            }
            if (glossy.counted) lobes.counted = &*glossy.counted;
            const auto next = sample_continuation(lobes, chain.wo, rule, rest_lights, sampler);
            if (!next) break;
            throughput *= next->sample.weight;
            // Faint gloss that the camera sees is followed all the same: one ray beside all those that
            // gather, where roulette would make bright specks of what lamps it mirrors.
            const bool sure = stage == Stage::eye && depth < kSureBounces;
            const float survival = sure ? 1.0F : std::min(1.0F, max_component(throughput));
            if (!(sampler.next() < survival)) break;
            throughput /= survival;
            rule = next->rule;
            medium = chain.vertex(bsdf).medium_towards(next->sample.wi);
            ray = Ray{chain.hit->at.towards(next->sample.wi), next->sample.wi};
        }
        return result;
    }

    // What media scatter into a ray at a place: radiance per unit of length.
    Rgb in_scattered(const MediumVertex& vertex, const Rgb& sigma_s, Stage stage, Sampler& sampler) const {
        Rgb result(0);
        if (settings_.direct != DirectMethod::map) {
            result += sigma_s * direct_light(scene_, vertex, sampler, lights_.at(vertex.p));
        }
        if (const PhotonMap* map = maps_.find(MapKind::volume)) {
            const DensityEstimateSettings& how = stage == Stage::eye ? estimates_.eye : estimates_.gather;
            VolumeDensityEstimateSettings volume{how.k, estimates_.volume_radius};
            if (radii_) volume = {0, radii_->volume_radius()};
            const VolumeDensityEstimate density(scene_, *map, volume);
            const ScatteringPoint at{vertex.p, vertex.phase, vertex.wo, vertex.medium, sigma_s};
            result += density.in_scattered(at, sampler).value;
        }
        return result;
    }

    // A diffuse surface that the camera sees.
    Rgb shade_eye(const Vertex& vertex, Sampler& sampler) const {
        Rgb result = direct(vertex, estimates_.eye, sampler);
        if (settings_.indirect == IndirectMethod::none) return result;
        result += estimate(MapKind::caustic, vertex, estimates_.eye, sampler).value;
        if (settings_.indirect == IndirectMethod::map) {
            return result + estimate(MapKind::global, vertex, estimates_.eye, sampler).value;
        }
        Rgb gathered(0);
        for (int i = 0; i < settings_.gather_rays; ++i) {
            Sampler branch = sampler.split_stratified(0, static_cast<std::uint32_t>(i));
            gathered += gather_ray(vertex, branch);
        }
        return result + gathered / static_cast<float>(settings_.gather_rays);
    }

    struct GatherShading {
        Rgb radiance;
        bool continues;  // what arrives over more than one bounce is still to be found
    };
    // A diffuse surface where a gather ray landed, `length` away from where it began. An estimate whose
    // disc is wider than that would take in light from around the corner of the place it is for; then the ray
    // goes on.
    GatherShading shade_gather(const Vertex& vertex, float length, int depth, Sampler& sampler) const {
        const IrradianceLookup lookup = lookup_irradiance(vertex, sampler);
        if (lookup.radius > length && depth + 1 < kMostEyeBounces) {
            const Rgb sampled = sample_direct(vertex, sampler);
            return {sampled + estimate(MapKind::caustic, vertex, estimates_.gather, sampler).value, true};
        }
        if (lookup.has_direct) return {lookup.radiance, false};
        return {direct(vertex, estimates_.gather, sampler) + lookup.radiance, false};
    }

    // Direct light by the chosen method.
    Rgb direct(const Vertex& vertex, const DensityEstimateSettings& how, Sampler& sampler) const {
        if (settings_.direct == DirectMethod::map)
            return estimate(MapKind::direct, vertex, how, sampler).value;
        return sample_direct(vertex, sampler);
    }
    // The same, by shadow rays, whatever the Direct map is used for elsewhere.
    Rgb sample_direct(const Vertex& vertex, Sampler& sampler) const {
        const LightChoice plain = lights_.at(vertex.hit.at, vertex.bsdf, vertex.wo);
        if (!guides_) return direct_light(scene_, vertex, sampler, plain).radiance;
        if (settings_.direct == DirectMethod::gated) {
            return gated_light(scene_, *guides_, vertex, sampler, plain).radiance;
        }
        return GuidedLight(scene_, *guides_, guided_)(vertex, sampler, plain).radiance;
    }

    // The lobes of a surface by which a ray may continue.
    struct ContinuationLobes {
        const Bsdf* diffuse = nullptr;
        const Bsdf* rest = nullptr;
        const Bsdf* counted = nullptr;  // GlossySplit's
    };
    struct Continuation {
        BsdfSample sample;
        EmissionRule rule;
    };
    // Samples one of them, by chance where there are several: a ray that split at every surface would never
    // end.
    std::optional<Continuation> sample_continuation(const ContinuationLobes& lobes, const V3f& wo,
                                                    const EmissionRule& rule, const LightChoice& rest_lights,
                                                    Sampler& sampler) const {
        const float u_lobe = sampler.next();
        const BsdfU u{sampler.next(), sampler.next2()};
        std::array<const Bsdf*, 3> open{};
        std::size_t count = 0;
        for (const Bsdf* lobe : {lobes.diffuse, lobes.rest, lobes.counted}) {
            if (lobe) open[count++] = lobe;
        }
        if (count == 0) return std::nullopt;
        const auto share = static_cast<float>(count);
        const Bsdf* lobe = open[std::min(static_cast<std::size_t>(u_lobe * share), count - 1)];
        const auto sample = lobe->sample(wo, u, Transport::radiance);
        if (!sample) return std::nullopt;
        Continuation continuation{
            *sample, EmissionRule::none()};  // after diffuse: direct light and caustics are counted
        continuation.sample.weight *= share;
        if (lobe == lobes.rest) {
            continuation.rule =
                sample->delta ? rule.through_specular() : EmissionRule::mis(sample->pdf_w, rest_lights);
        }
        return continuation;
    }

    struct IrradianceLookup {
        Rgb radiance;
        float radius;     // of the Global map's estimate
        bool has_direct;  // or what the Direct map would say is still missing
    };
    // What the maps say where a gather ray landed: looked up if it was precomputed and says all there is to
    // know, else estimated. A base under varnish that a lamp shines on from one side would be off by
    // percents, and a wall whose relief leans towards the light by as much as the cosine is.
    IrradianceLookup lookup_irradiance(const Vertex& vertex, const Sampler& sampler) const {
        if (irradiance_ && irradiance_suffices(vertex.bsdf)) {
            const V3f& n = vertex.hit.at.n;
            const V3f side = n.dot(vertex.wo) < 0 ? -n : n;
            if (const auto found = irradiance_->nearest(vertex.hit.at.p, side, estimates_.gather.radius)) {
                return {found->irradiance * vertex.bsdf.albedo(vertex.wo) * kInvPi, found->radius,
                        holds_direct(settings_, scene_)};
            }
        }
        const DensityEstimateResult global = estimate(MapKind::global, vertex, estimates_.gather, sampler);
        return {global.value + estimate(MapKind::caustic, vertex, estimates_.gather, sampler).value,
                global.radius, false};
    }

    // Indirect radiance by way of one direction. Emission at its end is direct light or a caustic, counted
    // elsewhere.
    Rgb gather_ray(const Vertex& vertex, Sampler& sampler) const {
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
        if (!sample) return Rgb(0);
        const Ray ray{vertex.hit.at.towards(sample->wi), sample->wi};
        return sample->weight *
               trace(ray, vertex.medium_towards(sample->wi), EmissionRule::none(), Stage::gather, sampler);
    }

    // Draws nothing of the sampler itself.
    DensityEstimateResult estimate(MapKind kind, const Vertex& vertex, const DensityEstimateSettings& how,
                                   const Sampler& sampler) const {
        const PhotonMap* map = maps_.find(kind);
        if (!map) return {};
        DensityEstimateSettings own = how;
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
                return DensityEstimate(*map, own, caustic_radii_).radiance(hit, vertex.bsdf, vertex.wo);
            }
        }
        const Probing probing{scene_, sampler.split(kProbesBranch + static_cast<std::uint32_t>(kind))};
        return DensityEstimate(*map, own, probing).radiance(hit, vertex.bsdf, vertex.wo);
    }

    const Scene& scene_;
    PhotonMapSettings settings_;
    DensityEstimatePair estimates_;
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
                                                       const DensityEstimatePair& estimates,
                                                       PhotonEstimatorParts parts) {
    return std::make_unique<PhotonMapEstimator>(scene, settings, estimates, std::move(parts));
}

}  // namespace lucerna
