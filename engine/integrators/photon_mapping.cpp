// Photon mapping in two passes with separate Direct, Global and Caustic maps [Jensen 2001, 7 to 9;
// Goesele 2003, 5.2, 5.3].
//
//   Pass 1   light paths are emitted and traced, their photons stored and indexed; irradiance is precomputed
//            where gather rays will look it up
//   Pass 2   camera rays are traced; radiance is estimated from the maps where they end
//
// Every path of light is counted once. At a diffuse surface, what arrives is split by where it comes from:
//   straight from a light        lights sampled (plainly or by the Direct map), or the Direct map itself
//   over mirrors and glass only  the Caustic map
//   over a diffuse surface       final gather, or the Global map
// Scattering in a medium counts as a diffuse surface. What media scatter into a ray, be it the camera's or a
// gather ray, is split in the same way:
//   straight from a light        lights sampled, or the Volume map
//   all else                     the Volume map
// Gloss, rough metal and glass carry no photons: a ray that meets them asks the lights and goes on, as a path
// would. A surface that is both (paint under varnish) is shaded as both. What counts as a mirror is a
// setting: perfect ones alone, or gloss up to some alpha, whose caustics then come from the Caustic map.
#include "engine/integrators/photon_mapping.h"

#include "engine/base/stopwatch.h"
#include "engine/guiding/guide.h"
#include "engine/integrators/direct_light.h"
#include "engine/integrators/energy_report.h"
#include "engine/integrators/guided_light.h"
#include "engine/integrators/light_choice.h"
#include "engine/integrators/needed_maps.h"
#include "engine/integrators/specular_chain.h"
#include "engine/integrators/steering.h"
#include "photon/density_estimate.h"
#include "photon/irradiance.h"
#include "photon/resting_point.h"
#include "photon/volume_estimate.h"

namespace lucerna {
namespace {

// The largest radius of an estimate unless it is set, as a share of the scene's diagonal.
constexpr float kDefaultRadius = 0.05F;

struct DensityEstimatePair {
    DensityEstimateSettings eye, gather;  // of estimates at what the camera sees, and where gather rays land
    float volume_radius = 1;              // the largest of an estimate in space
};

// What pass 1 makes and pass 2 reads; maps that are absent are not read.
struct PhotonMappingState {
    PhotonMaps maps;
    std::optional<GuideMap> guides;              // for the direct methods that go by one
    std::optional<IrradiancePoints> irradiance;  // looked up by gather rays where they land
    std::unique_ptr<const RadiusRule> radii;     // null: radii by the photons that are estimated from
    std::vector<float> caustic_radii;            // with radii: by them, of each photon of the Caustic map
};

// -----------------------------------------------------------------------------------------------------
// Pass 1: photon maps
// Emission, light paths and deposits are photon/build_maps.h; which maps a scene needs is needed_maps.h.
// -----------------------------------------------------------------------------------------------------

DensityEstimatePair density_settings(const PhotonMapSettings& settings, const Scene& scene) {
    DensityEstimateSettings how;
    how.radius = settings.radius > 0 ? settings.radius : kDefaultRadius * diagonal(scene);
    how.ratio = settings.ratio;
    how.kernel = settings.kernel;
    how.metric = settings.metric;
    how.boundary = settings.boundary;
    DensityEstimatePair pair{how, how};
    pair.volume_radius = settings.radius > 0 ? settings.radius : kDefaultRadius * diagonal_with_media(scene);
    pair.eye.k = settings.k;
    pair.gather.k = settings.gather_k;
    return pair;
}

std::array<bool, kMapKinds> wanted_maps(const PhotonMapSettings& settings, const PassContext& context) {
    std::array<bool, kMapKinds> maps{};
    for (std::size_t i = 0; i < kMapKinds; ++i) {
        const auto kind = static_cast<MapKind>(i);
        const MapNeed need = map_need(kind, settings, context.scene);
        maps[i] = need.build;
        context.report.notes[fmt::format("map.{}", map_name(kind))] = need.text();
    }
    return maps;
}

MapParameters map_parameters(const PhotonMapSettings& settings, const PassContext& context) {
    MapParameters parameters;
    parameters.paths = settings.photons;
    parameters.wanted = wanted_maps(settings, context);
    parameters.targets[static_cast<std::size_t>(MapKind::caustic)] = settings.caustic_photons;
    parameters.targets[static_cast<std::size_t>(MapKind::global)] = settings.indirect_photons;
    parameters.volume_direct = settings.direct == DirectMethod::map;
    parameters.specular_below = settings.specular_below;
    parameters.seed = context.seed;
    parameters.pass = context.pass;
    parameters.index = settings.index;
    return parameters;
}

PhotonMaps make_maps(const MapParameters& parameters, const PassContext& context) {
    const Scene& scene = context.scene;
    const MapFiles files = context.map_files ? *context.map_files : MapFiles{};
    if (!files.load.empty()) {
        context.report.notes["maps"] = "read from a file";
        return load_maps(files.load, map_key(scene, parameters), scene.lights().size(), parameters.index,
                         context.workers);
    }
    PhotonMaps maps = build_photon_maps(scene, parameters, context.workers, context.monitor);
    if (!files.save.empty() && !context.monitor.stopped()) {
        save_maps(files.save, maps, map_key(scene, parameters));
    }
    return maps;
}

void report(const PhotonMaps& maps, RenderReport& report) {
    report_energy(maps.ledger, report);
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        const std::string name = fmt::format("photons.{}.", map_name(static_cast<MapKind>(kind)));
        report.numbers[name + "stored"] = static_cast<double>(maps.counts[kind].stored);
        report.numbers[name + "dropped.map_not_wanted"] = static_cast<double>(maps.counts[kind].not_wanted);
        report.numbers[name + "dropped.surface_not_diffuse"] =
            static_cast<double>(maps.counts[kind].not_storable);
    }
    report.seconds.emplace_back("photons", maps.seconds_trace);
    report.seconds.emplace_back("index", maps.seconds_index);
}

// The radius at each of the Caustic map's photons.
std::vector<float> radii_of(const PhotonMap& caustics, const RadiusRule& radii, const PassContext& context) {
    constexpr std::int64_t kGrain = 1024;
    std::vector<float> result(caustics.size());
    const auto count = static_cast<std::int64_t>(caustics.size());
    parallel_ranges(context.workers, count, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
            const V3f n = caustics.normals()[i].unpack();
            // Never less than the surface's error: as for an estimate.
            const SurfacePoint at = resting_point(context.scene, caustics.positions()[i], n);
            result[i] = std::max(radii.radius(MapKind::caustic, at.p, n), at.error);
        }
    });
    return result;
}

// The photons by which direct light is sampled, if it is.
std::optional<GuideMap> emit_guides(const PhotonMapSettings& settings, const PassContext& context,
                                    float radius) {
    if (!goes_by_guides(settings, context.scene)) return std::nullopt;
    const bool gate = settings.direct == DirectMethod::gated;
    const Stopwatch building;
    const GuideParameters parameters{
        settings.guide_photons, context.seed, context.pass, {gate ? 0 : settings.guide_k, radius}};
    GuideMap map = build_guides(context.scene, parameters, context.workers, context.monitor);
    context.report.seconds.emplace_back("guide", building.seconds());
    context.report.numbers["guide.photons"] = static_cast<double>(map.map().size());
    context.report.numbers["guide.stations"] = static_cast<double>(map.distributions());
    return map;
}

// -----------------------------------------------------------------------------------------------------
// Pass 1: precomputed irradiance
// Gather rays look it up where they land, in place of an estimate of each [Christensen 1999].
// -----------------------------------------------------------------------------------------------------

// Whether the points hold direct light, too, so that a gather ray asks nothing more where it lands. Sampled
// beforehand it is not where there are media: the points do not know in which they lie.
bool holds_direct(const PhotonMapSettings& settings, const Scene& scene) {
    return settings.direct == DirectMethod::map || (settings.precompute_lights > 0 && scene.media().empty());
}

// The irradiance E of direct light at a point: π times what a white surface shows of it.
Rgb sampled_irradiance(const Scene& scene, const LightChooser& lights, const SurfacePoint& at,
                       const Sampler& point, int samples) {
    Hit hit;
    hit.at = at;
    hit.ns = at.n;
    hit.wo = at.n;
    hit.dpdu = Frame(at.n).s;
    hit.dpdv = Frame(at.n).t;
    const Bsdf white = white_receiver(hit);
    const LightChoice choice = lights.at(at, white, hit.wo);
    Rgb sum(0.0F);
    for (int i = 0; i < samples; ++i) {
        Sampler sampler = point.split_stratified(1, static_cast<std::uint32_t>(i));
        sum += direct_light(scene, Vertex{hit, white, hit.wo}, sampler, choice).radiance;
    }
    return sum * (kPi / static_cast<float>(samples));
}

}  // namespace

IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how,
                                       const PhotonMapSettings& settings) {
    const PhotonMap& global = *maps.find(MapKind::global);
    std::vector<const PhotonMap*> read = {&global};
    if (const PhotonMap* caustic = maps.find(MapKind::caustic)) read.push_back(caustic);
    // Other methods build a Direct map, too, but only to be led by it.
    if (settings.direct == DirectMethod::map) read.push_back(maps.find(MapKind::direct));
    constexpr std::uint64_t kNoPlace = ~std::uint64_t{0};  // the chance of the probes is that of no place
    const Sampler chance(context.seed, Purpose::gather, context.pass, kNoPlace);
    IrradianceSources sources{read, how, Probing{context.scene, chance}, {}};
    if (settings.direct != DirectMethod::map && holds_direct(settings, context.scene)) {
        sources.more = [&, lights = LightChooser(context.scene, settings.lights)](std::uint32_t number,
                                                                                  const SurfacePoint& at) {
            const Sampler point(context.seed, Purpose::gather, context.pass, number);
            return sampled_irradiance(context.scene, lights, at, point, settings.precompute_lights);
        };
    }
    const BounceParameters bounce{static_cast<std::size_t>(settings.precompute), context.seed, context.pass};
    return {bounce_on(context.scene, global, bounce, context.workers), sources, context.workers,
            context.monitor};
}

namespace {

// All of pass 1. With `radii` all photons within them count in place of the k nearest. Null if the monitor
// stopped it.
std::optional<PhotonMappingState> first_pass(const PhotonMapSettings& settings, const PassContext& context,
                                             std::unique_ptr<const RadiusRule> radii,
                                             const LearnedEmission* emission) {
    PhotonMappingState state;
    state.radii = std::move(radii);
    MapParameters parameters = map_parameters(settings, context);
    parameters.emission = emission;
    if (parameters.wanted != std::array<bool, kMapKinds>{}) {
        state.maps = make_maps(parameters, context);
        if (context.monitor.stopped()) return std::nullopt;
        report(state.maps, context.report);
        if (context.pass == 0) warn_of_endless_light(state.maps.ledger, context.monitor);
    }
    const PhotonMap* caustics = state.maps.find(MapKind::caustic);
    if (state.radii && caustics) state.caustic_radii = radii_of(*caustics, *state.radii, context);
    const DensityEstimatePair how = density_settings(settings, context.scene);
    state.guides = emit_guides(settings, context, how.eye.radius);
    if (context.monitor.stopped()) return std::nullopt;
    if (settings.indirect == IndirectMethod::gather && settings.precompute > 0) {
        const Stopwatch computing;
        state.irradiance.emplace(precompute_irradiance(context, state.maps, how.gather, settings));
        context.report.seconds.emplace_back("irradiance", computing.seconds());
        context.report.numbers["irradiance.points"] = static_cast<double>(state.irradiance->size());
        if (context.monitor.stopped()) return std::nullopt;
    }
    return state;
}

// -----------------------------------------------------------------------------------------------------
// Pass 2: radiance of camera rays
// -----------------------------------------------------------------------------------------------------

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
                       const DensityEstimatePair& estimates, PhotonMappingState state)
        : scene_(scene),
          settings_(settings),
          estimates_(estimates),
          maps_(std::move(state.maps)),
          guides_(std::move(state.guides)),
          irradiance_(std::move(state.irradiance)),
          radii_(std::move(state.radii)),
          caustic_radii_(std::move(state.caustic_radii)),
          guided_{settings.guide_defensive_weight,
                  settings.candidates > 0 ? settings.candidates : candidates_that_pay(scene)},
          lights_(scene, settings.lights) {}

    Rgb Li(const Ray& ray, Sampler& sampler) const override {
        if (settings_.quantity == Quantity::illuminance) {
            return meter_and_shade(scene_, ray, [&](const Vertex& vertex) {
                return DirectLight{shade_eye(vertex, sampler), {}};
            });
        }
        return Li(ray, scene_.media().camera, EmissionRule::all(), Stage::eye, sampler);
    }

  private:
    // ---- Li --------------------------------------------------------------------------------------------

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
    Rgb Li(Ray ray, std::int32_t medium, EmissionRule rule, Stage stage, Sampler& sampler) const {
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

    // ---- Shade what the eye sees -----------------------------------------------------------------------

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

    // Indirect radiance by way of one direction. Emission at its end is direct light or a caustic, counted
    // elsewhere.
    Rgb gather_ray(const Vertex& vertex, Sampler& sampler) const {
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
        if (!sample) return Rgb(0);
        const Ray ray{vertex.hit.at.towards(sample->wi), sample->wi};
        return sample->weight *
               Li(ray, vertex.medium_towards(sample->wi), EmissionRule::none(), Stage::gather, sampler);
    }

    // ---- Shade where a gather ray lands ----------------------------------------------------------------

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

    // ---- Direct light, density estimates, media --------------------------------------------------------

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

std::unique_ptr<const Estimator> prepare_pass(const PhotonMapSettings& settings, const PassContext& context,
                                              std::unique_ptr<const RadiusRule> radii,
                                              const LearnedEmission* emission) {
    auto state = first_pass(settings, context, std::move(radii), emission);
    if (!state) return nullptr;
    return std::make_unique<PhotonMapEstimator>(context.scene, settings,
                                                density_settings(settings, context.scene), std::move(*state));
}

class PhotonMapIntegrator final : public Integrator {
  public:
    explicit PhotonMapIntegrator(const PhotonMapSettings& settings) : settings_(settings) {}

    std::unique_ptr<const Estimator> prepare(const PassContext& context) const override {
        const std::optional<ImportancePrePass> pre_pass =
            learn_emission(settings_, density_settings(settings_, context.scene).eye, context);
        if (context.monitor.stopped()) return nullptr;
        return prepare_pass(settings_, context, nullptr, pre_pass ? &pre_pass->emission : nullptr);
    }

    std::vector<std::string> describe(const Scene& scene) const override {
        std::vector<std::string> lines;
        for (std::size_t i = 0; i < kMapKinds; ++i) {
            const auto kind = static_cast<MapKind>(i);
            lines.push_back(
                fmt::format("{} map {}", map_name(kind), map_need(kind, settings_, scene).text()));
        }
        if (settings_.pre_pass > 0) lines.push_back(describe_pre_pass(settings_.pre_pass));
        const bool targets = settings_.caustic_photons > 0 || settings_.indirect_photons > 0;
        lines.push_back(targets ? "light paths until the targets are met"
                                : fmt::format("{} light paths", settings_.photons));
        if (settings_.indirect == IndirectMethod::gather && settings_.precompute > 0) {
            lines.push_back(
                fmt::format("irradiance where a bounce from one photon in {} leads", settings_.precompute));
        }
        return lines;
    }

  private:
    PhotonMapSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_photon_mapping(const PhotonMapSettings& settings) {
    return std::make_unique<PhotonMapIntegrator>(settings);
}

std::unique_ptr<const Estimator> prepare_photon_maps(const PhotonMapSettings& settings,
                                                     const PassContext& context,
                                                     std::unique_ptr<const RadiusRule> radii,
                                                     const LearnedEmission* emission) {
    return prepare_pass(settings, context, std::move(radii), emission);
}

}  // namespace lucerna
