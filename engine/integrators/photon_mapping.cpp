// Photon mapping in two passes with separate Direct, Global and Caustic maps [Jensen 2001, 7 to 9;
// Goesele 2003, 5.2, 5.3].
//
//   Pass 1   light paths are emitted and traced, their photons stored and indexed; irradiance is precomputed
//            where gather rays will look it up
//   Pass 2   camera rays are traced; radiance is estimated from the maps where they end
//
// Every path of light is counted once. At a diffuse surface, what arrives is split by where it comes from:
//   straight from a light        lights sampled (by MIS, guided by photons if asked for), or the Direct map
//   over mirrors and glass only  the Caustic map
//   over a diffuse surface       final gather, or the Global map
// Scattering in a medium counts as a diffuse surface. What media scatter into a ray, be it the camera's or a
// gather ray, is split in the same way:
//   straight from a light        lights sampled, or the Volume map
//   all else                     the Volume map
// Gloss, rough metal and glass carry no photons: a ray that meets them samples the lights and goes on, as a
// path would. A surface that is both (paint under varnish) is shaded as both. What counts as a mirror is a
// setting: perfect ones alone, or gloss up to some alpha, whose caustics then come from the Caustic map.
#include "engine/integrators/photon_mapping.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/files.h"
#include "engine/base/monitor.h"
#include "engine/guiding/directional_guide.h"
#include "engine/guiding/guide.h"
#include "engine/integrators/splitting.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/follow.h"
#include "engine/transport/light_choice.h"
#include "photon/density_estimate.h"
#include "photon/irradiance.h"
#include "photon/map_points.h"
#include "photon/volume_estimate.h"

namespace lucerna {
namespace {

struct DensityEstimatePair {
    DensityEstimateSettings eye, gather;  // of estimates at what the camera sees, and where gather rays land
    float volume_radius = 1;              // the largest of an estimate in space
};

// What pass 1 makes and pass 2 reads; maps that are absent are not read.
struct PhotonMappingState {
    PhotonMaps maps;
    std::optional<IrradiancePoints> irradiance;   // looked up by gather rays where they land
    std::optional<DirectionGuideMap> directions;  // of gather rays
    std::vector<float> caustic_radii;             // progressive: the radius of each photon of the Caustic map
};

// -----------------------------------------------------------------------------------------------------
// Pass 1: photon maps
// Emission, light paths and deposits are photon/build_maps.h; which maps a scene needs is photon_mapping.h.
// -----------------------------------------------------------------------------------------------------

DensityEstimatePair density_settings(const PhotonMapSettings& settings, const Scene& scene) {
    DensityEstimatePair pair{settings.estimate, settings.estimate};
    const float radius = settings.estimate.radius;
    pair.eye.radius = pair.gather.radius = largest_radius(diagonal(scene), radius);
    pair.volume_radius = largest_radius(diagonal_with_media(scene), radius);
    pair.gather.k = settings.gather_k;
    return pair;
}

std::array<bool, kMapKinds> wanted_maps(const PhotonMapSettings& settings, const PassContext& context) {
    std::array<bool, kMapKinds> maps{};
    for (std::size_t i = 0; i < kMapKinds; ++i) {
        const auto kind = static_cast<MapKind>(i);
        const MapNeed need = map_need(kind, settings, context.scene);
        maps[i] = need.build;
        context.statistics.map_needs[i] = need.text();
    }
    return maps;
}

// Of the time of preparations, where irradiance is precomputed, too.
constexpr double kPhotonsShare = 0.4;

MapParameters map_parameters(const PhotonMapSettings& settings, const PassContext& context) {
    MapParameters parameters;
    parameters.paths = settings.photons;
    parameters.wanted = wanted_maps(settings, context);
    parameters.targets[static_cast<std::size_t>(MapKind::caustic)] = settings.caustic_photons;
    parameters.targets[static_cast<std::size_t>(MapKind::global)] = settings.indirect_photons;
    parameters.volume_direct = settings.direct == DirectMethod::map;
    parameters.specular_below = settings.specular_below;
    parameters.longest = most_bounces(settings.max_depth) - 1;  // one more where it is seen
    parameters.seed = context.seed;
    parameters.pass = context.pass;
    parameters.deadline = context.prepared;
    // Points take more time than the photons that they are made of.
    if (context.prepared.exists() && settings.indirect == IndirectMethod::gather && settings.precompute > 0)
        parameters.deadline = Deadline::after(kPhotonsShare * context.prepared.left());
    parameters.index = settings.index;
    return parameters;
}

PhotonMaps make_maps(const MapParameters& parameters, const PassContext& context, const MapFiles& files) {
    const Scene& scene = context.scene;
    MapOrigin origin{files.scene, flux_unit_text(scene_unit(scene)), scene.origin(), files.scene_facts};
    const Facts by_parameters = map_facts(parameters);
    origin.facts.insert(origin.facts.end(), by_parameters.begin(), by_parameters.end());
    if (!files.load.empty()) {
        context.statistics.map_source = "read from a file";
        return load_maps(files.load, origin.facts, scene.lights().size(), parameters.index, context.workers);
    }
    PhotonMaps maps = build_photon_maps(scene, parameters, context.workers, context.monitor);
    const bool writes = !context.workers.ranks || context.workers.ranks->leads();
    if (!files.save.empty() && writes && !context.monitor.stopped()) {
        if (suffix_of(files.save) == kMapPointsSuffix) {
            write_map_points(files.save, maps, scene.origin());
        } else {
            save_maps(files.save, maps, origin);
        }
    }
    return maps;
}

void report(const PhotonMaps& maps, PassStatistics& statistics) {
    statistics.ledger = LedgerStatistics(maps.ledger);
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) statistics.maps[kind] = maps.counts[kind];
    statistics.seconds.add("photons", maps.seconds_trace);
    statistics.seconds.add("index", maps.seconds_index);
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
            const SurfacePoint at = surface_point_of(context.scene, caustics.positions()[i], n);
            result[i] = std::max(radii.radius(MapKind::caustic, at.p, n).radius, at.error);
        }
    });
    return result;
}

// -----------------------------------------------------------------------------------------------------
// Pass 1: precomputed irradiance
// Gather rays look it up where they land, in place of an estimate of each [Christensen 1999].
// -----------------------------------------------------------------------------------------------------

// Whether the points hold direct light, too, so that nothing is left to find where a gather ray lands. In
// scenes with media direct light is not sampled in advance: the points do not store their medium.
bool holds_direct(const PhotonMapSettings& settings, const Scene& scene) {
    return settings.direct == DirectMethod::map || (settings.precompute_lights > 0 && scene.media().empty());
}

// Bounces of the photons that such points count: a gather ray has one behind it and one before it.
int kept_where_rays_land(const PhotonMapSettings& settings) {
    return settings.max_depth > 0 ? settings.max_depth - 2 : kMaxBounces;  // the map is there: at least 1
}

// Of an irradiance point's sampler; its probes have a sampler of their own.
constexpr std::uint32_t kLightSamplesBranch = 1, kSunsBranch = 2;

// Direct light at a point, sampled in both ways as direct_light() does it for a white surface there, whose
// radiance times π is the irradiance.
NearLight add_direct_light(const Scene& scene, const LightChooser& lights, const SurfacePoint& at,
                           const Sampler& point, int samples, IncidentLightSum& light) {
    Hit hit;
    hit.at = at;
    hit.ns = at.n;
    hit.wo = at.n;
    hit.dpdu = Frame(at.n).s;
    hit.dpdv = Frame(at.n).t;
    const Bsdf white = white_receiver(hit);
    const LightChoice choice = lights.at(at, white, hit.wo);
    const Vertex vertex{hit, white, hit.wo};
    const float scale = kPi / static_cast<float>(samples);
    float sum = 0, over_distance = 0;
    const auto add = [&](const Rgb& irradiance, const V3f& wi, float distance) {
        light.add(irradiance, wi);
        sum += luminance(irradiance);
        over_distance += luminance(irradiance) / std::max(distance, at.error);  // error > 0
    };
    Sampler to_suns = point.split(kSunsBranch);
    for (const std::uint32_t sun : choice.suns()) {
        if (const auto from_sun = sunlight(scene, vertex, sun, to_suns))
            add(kPi * from_sun->radiance, from_sun->w, INFINITY);
    }
    for (int i = 0; i < samples; ++i) {
        Sampler sampler = point.split_stratified(kLightSamplesBranch, static_cast<std::uint32_t>(i));
        const float u_light = sampler.next();
        const V2f u_place = sampler.next2();
        if (const auto drawn = choice.draw(scene, at.p, u_light, u_place)) {
            const Rgb asked = unshadowed(vertex, *drawn);
            if (!is_black(asked)) {
                add(scale * asked * transmitted_share(scene, vertex, drawn->light_sample, sampler),
                    drawn->light_sample.w, drawn->light_sample.distance);
            }
        }
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = white.sample(hit.wo, u, Transport::radiance);
        if (!sample) continue;
        const Ray ray{at.towards(sample->wi), sample->wi};
        const auto met = scene.intersect(ray);
        SampleAccount found;
        add_emission_ahead(scene,
                           EyePath(PathAccount(found, scale * sample->weight), ray, kNoMedium,
                                   EmissionRule::mis(sample->pdf_w, choice)),
                           met, sampler);
        add(found.radiance(), sample->wi, met ? met->t : INFINITY);
    }
    return {sum, over_distance > 0 ? sum / over_distance : INFINITY};
}

// A point for one photon in so many, as the time allows: by that of a few, and then of more, for the first
// pay for what is cold.
std::size_t stride_in_time(const PassContext& context, const PhotonMap& global,
                           const IrradianceSources& sources, BounceParameters bounce) {
    constexpr std::size_t kMostStride = 1 << 16;
    const std::size_t wanted = bounce.stride;
    for (const std::size_t few : {std::size_t{128}, std::size_t{2048}}) {
        const std::size_t trial = global.size() / few;
        if (trial <= bounce.stride && few == 128) return wanted;
        bounce.stride = std::max(wanted, trial);
        const Stopwatch clock;
        const IrradiancePoints points(bounce_on(context.scene, global, bounce, context.workers), sources,
                                      context.workers, context.monitor);
        // Of a point for each photon; and the first of those few take the longest.
        const double seconds = clock.seconds() * static_cast<double>(bounce.stride);
        const double left = std::max(context.prepared.left(), 1e-3);
        const auto stride =
            static_cast<std::size_t>(std::min(std::ceil(seconds / left), double{kMostStride}));
        bounce.stride = agreed(context.workers, std::max(wanted, stride));
        if (bounce.stride == wanted) break;
    }
    return bounce.stride;
}

}  // namespace

IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how,
                                       const PhotonMapSettings& settings) {
    const PhotonMap& global = *maps.find(MapKind::global);
    std::vector<const PhotonMap*> read = {&global};
    if (const PhotonMap* caustic = maps.find(MapKind::caustic)) read.push_back(caustic);
    if (settings.direct == DirectMethod::map) read.push_back(maps.find(MapKind::direct));
    constexpr std::uint64_t kNoPoint =
        ~std::uint64_t{0};  // the path number of no point: split by point below
    const Sampler probes(context.seed, Purpose::gather, context.pass, kNoPoint);
    IrradianceSources sources{read, how, Probing{context.scene, probes}, {}};
    if (settings.direct != DirectMethod::map && holds_direct(settings, context.scene)) {
        sources.more = [&, lights = LightChooser(context.scene, settings.lights)](
                           std::uint32_t number, const SurfacePoint& at, IncidentLightSum& light) {
            const Sampler point(context.seed, Purpose::gather, context.pass, number);
            return add_direct_light(context.scene, lights, at, point, settings.precompute_lights, light);
        };
    }
    BounceParameters bounce{static_cast<std::size_t>(settings.precompute), context.seed, context.pass};
    if (context.prepared.exists()) bounce.stride = stride_in_time(context, global, sources, bounce);
    return {bounce_on(context.scene, global, bounce, context.workers), sources, context.workers,
            context.monitor};
}

namespace {

// Whether the numbers of samples, and where gather rays are guided, are left to a pilot.
bool is_split_by_pilot(const PhotonMapSettings& settings) {
    return settings.gather_rays == 0 && settings.indirect == IndirectMethod::gather;
}
bool may_guide(const PhotonMapSettings& settings) {
    if (settings.indirect != IndirectMethod::gather) return false;
    return settings.guide_gather == GatherGuiding::on ||
           (settings.guide_gather == GatherGuiding::where_it_pays && is_split_by_pilot(settings));
}

// All of pass 1. None if the monitor stopped it.
std::optional<PhotonMappingState> first_pass(const PhotonMapSettings& settings, const PassContext& context,
                                             const PhotonMapPass& parts) {
    PhotonMappingState state;
    MapParameters parameters = map_parameters(settings, context);
    parameters.emission = parts.emission;
    parameters.sets = parts.sets;
    if (parameters.wanted != std::array<bool, kMapKinds>{}) {
        state.maps = make_maps(parameters, context, parts.files);
        if (context.monitor.stopped()) return std::nullopt;
        report(state.maps, context.statistics);
        if (context.pass == 0) warn_of_endless_light(state.maps.ledger, context.monitor);
    }
    const PhotonMap* caustics = state.maps.find(MapKind::caustic);
    if (parts.radii && caustics) state.caustic_radii = radii_of(*caustics, *parts.radii, context);
    if (settings.indirect == IndirectMethod::gather && settings.precompute > 0 &&
        state.maps.find(MapKind::global)) {
        const Stopwatch computing;
        DensityEstimateSettings how = density_settings(settings, context.scene).gather;
        how.most_bounces = kept_where_rays_land(settings);
        state.irradiance.emplace(precompute_irradiance(context, state.maps, how, settings));
        context.statistics.seconds.add("irradiance", computing.seconds());
        context.statistics.irradiance_points = state.irradiance->size();
        if (context.monitor.stopped()) return std::nullopt;
    }
    const PhotonMap* global = state.maps.find(MapKind::global);
    if (may_guide(settings) && global) {
        const Stopwatch building;
        DirectionGuiding guiding;
        guiding.radius = density_settings(settings, context.scene).eye.radius;
        guiding.defensive_weight = settings.cosine_share;
        state.directions.emplace(*global, guiding, context.workers);
        context.statistics.seconds.add("guide", building.seconds());
    }
    return state;
}

// -----------------------------------------------------------------------------------------------------
// Pass 2: radiance of camera rays
// -----------------------------------------------------------------------------------------------------

// Most bounces of a ray in pass 2, over surfaces that are not diffuse and from where a gather ray ended too
// near. Far fewer than kMaxBounces: each reads the maps or samples the lights anew, and few rays get so far.
constexpr int kMostEyeBounces = 64;

// Bounces over glossy surfaces from the eye that are followed without roulette.
constexpr int kSureBounces = 4;

// With which gloss is looked at where a gather ray landed, at the least: what it brings then counts ten
// times.
constexpr float kLeastGlossChance = 0.1F;

// How much larger than the radius r(x) at a point the radii of caustic photons that are looked for may be. A
// photon at y reaches x if it is nearer than r(y); where radii change by less than half of the distance
// between two points, r(y) < 2 r(x). Where they change faster, photons of larger radii are missed at the rims
// of their discs.
constexpr float kCausticReach = 2;

// Branches of a sample's sampler: for gather rays; one for each map's probes; for light samples and caustics
// where the camera looks; and for the chances by which some of these three are taken.
constexpr std::uint32_t kGatherBranch = 0, kProbesBranch = 1;
constexpr std::uint32_t kLightBranch = kProbesBranch + kMapKinds, kCausticBranch = kLightBranch + 1;
constexpr std::uint32_t kChanceBranch = kCausticBranch + 1;
constexpr std::uint32_t kEstimateBranch = 2 * kChanceBranch;
constexpr std::uint32_t kBranches = kEstimateBranch + 1;  // more than there are

// Which quality a surface is shaded with.
enum class Stage : std::uint8_t {
    eye,     // the camera sees it, straight or over shiny surfaces
    gather,  // a gather ray landed there: blurred over a hemisphere before anyone sees it
};

// A surface's diffuse part, for which radiance is estimated from photons, and the rest, which is traced.
struct SplitBsdf {
    std::optional<Bsdf> diffuse, rest;

    explicit SplitBsdf(const Bsdf& bsdf) {
        if (stores_photons(bsdf)) diffuse = bsdf.diffuse_part();
        if (!diffuse || !bsdf.is_diffuse()) rest = bsdf.rest();
    }
};

// What is not diffuse at a surface. After a gather ray (the rule is none) direct light and caustics are
// counted already where it began: gloss that counts as specular must not sample lights again, or caustics
// would count twice.
struct GlossySplit {
    std::optional<Bsdf> light_sampled, as_specular;

    GlossySplit(const std::optional<Bsdf>& rest, const EmissionRule& rule, float specular_below) {
        if (!rest) return;
        light_sampled = rest;
        if (rule.kind != EmissionRule::Kind::none || !(specular_below > 0)) return;
        const Bsdf sharp = rest->sharp_part(specular_below), blurred = rest->blurred_part(specular_below);
        if (sharp.is_black()) return;
        as_specular = sharp;
        light_sampled = blurred.is_black() ? std::nullopt : std::optional(blurred);
    }
};

class PhotonMapEstimator final : public Estimator {
  public:
    PhotonMapEstimator(const Scene& scene, const PhotonMapSettings& settings, PhotonMapPass parts,
                       PhotonMappingState state)
        : scene_(scene),
          settings_(settings),
          estimates_(density_settings(settings, scene)),
          maps_(std::move(state.maps)),
          guides_(parts.guides),
          irradiance_(std::move(state.irradiance)),
          directions_(std::move(state.directions)),
          radii_(std::move(parts.radii)),
          caustic_radii_(std::move(state.caustic_radii)),
          samples_(parts.samples),
          edges_(parts.edges),
          guided_{settings.guide.defensive_weight,
                  settings.guide.candidates > 0 ? settings.guide.candidates : candidates_that_pay(scene)},
          lights_(scene, settings.lights) {}

    void follow(const EyePath& path, Sampler& sampler) const override {
        Splits splits{splitting_.at(path.film)};
        // Across an edge estimates differ as samples do.
        if (samples_ > 1 && !(edges_ && edges_->at(path.film))) {
            // Of 2^k samples in a row, beginning at a multiple of that, exactly one: numbers are stratified.
            const auto samples = static_cast<float>(samples_);
            splits.estimates = sampler.split_alike(kEstimateBranch).next() < 1 / samples ? samples : 0.0F;
        }
        lucerna::follow(scene_, path, sampler, Visitor(*this, Stage::eye, splits, path));
    }

    // Learns how many samples of each kind pay where, if the settings leave that open.
    void split(const PassContext& context) {
        if (!is_split_by_pilot(settings_) || !context.view)
            return split_by(Splitting(fixed_numbers(settings_)));
        const auto look = [this](const Ray& ray, Sampler& sampler, SplitPilot& pilot) {
            SampleAccount account;
            const EyePath path =
                EyePath::begin(scene_, ray, settings_.quantity, settings_.max_depth, account);
            const Splits splits{{}, &pilot};
            lucerna::follow(scene_, path, sampler, Visitor(*this, Stage::eye, splits, path));
            return account.radiance();
        };
        split_by(Splitting(*context.view, context.seed, context.pass, context.workers, look));
    }
    // What another one learned, whose maps are of as many photons.
    void split_by(const Splitting& learned) {
        splitting_ = learned;
        if (settings_.guide_gather != GatherGuiding::on && !splitting_.any_guided()) directions_.reset();
    }
    const Splitting& splitting() const { return splitting_; }

  private:
    // How many samples of each kind are taken at what a camera sample sees; in the pilot, two of each.
    struct Splits {
        SplitPlan plan;
        SplitPilot* pilot = nullptr;
        // What density estimates count where the camera looks: 0: they are left to others of the pixel's
        // samples.
        float estimates = 1;
    };
    static SplitNumbers fixed_numbers(const PhotonMapSettings& settings) {
        SplitNumbers numbers;
        if (settings.gather_rays > 0) numbers.gather_rays = static_cast<float>(settings.gather_rays);
        return numbers;
    }

    // ---- A path from the eye, or a gather ray, up to the first surface that is diffuse and nothing else ---

    class Visitor : public EyeVisitor {
      public:
        Visitor(const PhotonMapEstimator& of, Stage stage, const Splits& splits, const EyePath& path)
            : of_(of), stage_(stage), splits_(splits), carried_(max_component(path.throughput)) {}

        bool arrives(const EyePath& path, const Hit& hit) {
            if (path.bounces == began_) length_ = path.rule.passed + hit.t;
            return true;
        }
        bool at_surface(EyePath& path, const Vertex& at, Sampler& sampler);
        bool at_medium(EyePath& path, const MediumVertex& at, const Rgb& sigma_s, Sampler& sampler) const {
            of_.in_scattered(path, at, sigma_s, stage_, splits_, sampler);
            return false;
        }
        // The bounces at which the ray that a visitor follows begins.
        void begin_at(int bounces) { began_ = bounces; }

      private:
        // The lobes of a surface by which a path may go on.
        struct Lobes {
            const Bsdf* diffuse = nullptr;
            const Bsdf* rest = nullptr;
            const Bsdf* as_specular = nullptr;  // GlossySplit's
            LightChoice rest_lights = {};       // by which `rest` asked the lights
            float rest_scale = 1;  // one over the chance of looking at the last two; 0: they are not
        };
        float rest_scale(const EyePath& path, const SplitBsdf& split, const V3f& wo, Sampler& sampler) const;
        bool turn(EyePath& path, const Vertex& at, const Lobes& lobes, Sampler& sampler) const;
        // Of the throughput, what the path still carries of what it began with.
        float carries(const EyePath& path) const { return max_component(path.throughput) / carried_; }

        const PhotonMapEstimator& of_;
        Stage stage_;
        const Splits& splits_;
        float carried_;     // the throughput with which the path began; 0: it brings nothing
        int surfaces_ = 0;  // that the visitor has shaded
        int began_ = 0;
        // Of the ray that left the last of them, to the first surface that it does not pass straight, scene
        // units.
        float length_ = INFINITY;
    };

    // ---- Shade what the eye sees -----------------------------------------------------------------------

    // A diffuse surface that the camera sees. Here and below `path.left` > 0 is how many bounces paths may
    // still have, the one at the vertex included.
    void shade_eye(const EyePath& path, const Vertex& vertex, const Splits& splits, Sampler& sampler) const {
        const DensityEstimateSettings how = within(path.left, estimates_.eye);
        const std::size_t share = share_class(max_component(path.throughput));
        const SplitNumbers& numbers = splits.plan[share];
        SplitKinds* const pilot = splits.pilot ? &(*splits.pilot)[share] : nullptr;
        const PathAccount estimated = path.times(splits.estimates);
        if (settings_.direct != DirectMethod::map) {
            some_of(numbers.light_samples, kLightBranch, pilot ? &pilot->light : nullptr, path, sampler,
                    [&](const EyePath& one, Sampler& own) {
                        sample_direct(one, vertex, own);
                        return 1.0F;
                    });
        } else if (splits.estimates > 0) {
            estimate(MapKind::direct, estimated, vertex, how, sampler);
        }
        if (settings_.indirect == IndirectMethod::none) return;
        if (settings_.indirect == IndirectMethod::map) {
            if (!(splits.estimates > 0)) return;
            estimate(MapKind::caustic, estimated, vertex, how, sampler);
            estimate(MapKind::global, estimated, vertex, how, sampler);
            return;
        }
        if (maps_.find(MapKind::caustic)) {
            some_of(numbers.caustic_estimates, kCausticBranch, pilot ? &pilot->caustic : nullptr, path,
                    sampler, [&](const EyePath& one, Sampler& own) {
                        estimate(MapKind::caustic, one, vertex, how, own);
                        return 1.0F;
                    });
        }
        if (path.left == 1) return;  // a gather ray would meet what emits, and that is direct light
        const bool guided = pilot || numbers.guided || settings_.guide_gather == GatherGuiding::on;
        some_of(numbers.gather_rays, kGatherBranch, pilot ? &pilot->gather : nullptr, path, sampler,
                [&](const EyePath& one, Sampler& own) { return gather_ray(one, vertex, guided, own); });
    }

    // Takes `number` samples of one kind at a place that the camera sees, each by numbers of its own, and
    // books their mean. A number is split stochastically: floor(number) samples, plus one with probability
    // frac(number); below 1 one sample with that probability, divided by it. `take(path, sampler)` books one
    // sample on the path that it is given and returns how many times more densely guiding drew it. In a pilot
    // the mean of two samples is booked, which are noted as they reach the pixel.
    template <typename Take>
    void some_of(float number, std::uint32_t branch, SplitMoments* pilot, const EyePath& path,
                 const Sampler& sampler, Take&& take) const {
        if (pilot) return look_at_two(branch, *pilot, path, sampler, take);
        const float whole = std::floor(number);
        int count = static_cast<int>(whole);
        if (whole < number && sampler.split_alike(branch + kChanceBranch).next() < number - whole) ++count;
        if (count == 0) return;
        EyePath one = path;
        one.throughput /= number < 1 ? number : static_cast<float>(count);  // > 0
        const auto most = static_cast<std::uint32_t>(std::ceil(number));
        for (int i = 0; i < count; ++i) {
            Sampler own = sampler.split_alike(branch, static_cast<std::uint32_t>(i), most);
            take(one, own);
        }
    }
    template <typename Take>
    static void look_at_two(std::uint32_t branch, SplitMoments& pilot, const EyePath& path,
                            const Sampler& sampler, Take&& take) {
        std::array<double, 2> value{}, ratio{};
        for (std::uint32_t i = 0; i < 2; ++i) {
            SampleAccount found = path.scratch();
            EyePath one = path;
            static_cast<PathAccount&>(one) = path.into(found);
            Sampler own = sampler.split_alike(branch + kBranches * i);
            ratio[i] = double{take(one, own)};
            value[i] = double{luminance(found.radiance())};
            path.take(found, 0.5F);
        }
        pilot.add(value[0], value[1], ratio[0], ratio[1]);
    }

    // Books indirect radiance by way of one direction, and returns how many times more densely guiding drew
    // it. Emission at its end is direct light or a caustic, counted elsewhere.
    float gather_ray(EyePath path, const Vertex& vertex, bool guided, Sampler& sampler) const {
        const BsdfU u{sampler.next(), sampler.next2()};
        DirectionGuide guide;
        if (directions_ && guided) guide = directions_->at(vertex.hit.at.p, vertex.bsdf, vertex.wo);
        const auto drawn = GuidedBsdf(vertex.bsdf, vertex.wo, guide).sample(u);
        if (!drawn) return 1;
        path.splits = 0;
        path.turn(vertex, drawn->sample, EmissionRule::none());
        const Splits one_of_each;
        Visitor visit(*this, Stage::gather, one_of_each, path);
        visit.begin_at(path.bounces);
        lucerna::follow(scene_, path, sampler, visit);
        return drawn->ratio;
    }

    // ---- Shade where a gather ray lands ----------------------------------------------------------------

    // A diffuse surface where a gather ray ended. `length` is that of its first segment: if the estimate's
    // radius is larger, its disc may reach around the corner that is being shaded. Then direct light and
    // caustics are evaluated here, and the result says that the ray continues for what arrives over more than
    // one bounce.
    bool shade_gather(const EyePath& path, const Vertex& vertex, float length, Sampler& sampler) const {
        const DensityEstimateSettings how = within(path.left, estimates_.gather);
        // It is booked once it is known that it counts.
        SampleAccount found = path.scratch();
        const auto indirect = indirect_at_gather_hit(path.into(found), vertex, how, sampler);
        if (!indirect || indirect->radius > length) {
            sample_direct(path, vertex, sampler);
            estimate(MapKind::caustic, path, vertex, how, sampler);
            return true;
        }
        path.take(found);
        if (!indirect->has_direct) direct(path, vertex, how, sampler);
        return false;
    }

    struct IndirectAtGatherHit {
        float radius;     // of the Global map's estimate
        bool has_direct;  // or what the Direct map would say is still missing
    };
    // Indirect light and caustics where a gather ray ended: what was precomputed there; estimates where
    // nothing is precomputed. None where no point is near: on what is too small for points, or seldom lit, an
    // estimate would take its photons from elsewhere, and its probes as many rays as a dozen paths.
    std::optional<IndirectAtGatherHit> indirect_at_gather_hit(const PathAccount& path, const Vertex& vertex,
                                                              const DensityEstimateSettings& how,
                                                              const Sampler& sampler) const {
        if (irradiance_) {
            const V3f& p = vertex.hit.at.p;
            if (const auto found = irradiance_->nearest(p, vertex.normal(), how.radius, how.most_bounces)) {
                const Rgb radiance = irradiance_suffices(vertex.bsdf)
                                         ? found->irradiance * vertex.bsdf.albedo(vertex.wo) * kInvPi
                                         : found->light->radiance(vertex.bsdf, vertex.wo, vertex.normal());
                path.indirect(found->share * radiance, 0);  // of all lights: there are no groups
                return IndirectAtGatherHit{found->radius, holds_direct(settings_, scene_)};
            }
            // Light that only particles carry is found by estimates alone.
            if (settings_.direct != DirectMethod::map) return std::nullopt;
        }
        const float radius = estimate(MapKind::global, path, vertex, how, sampler);
        estimate(MapKind::caustic, path, vertex, how, sampler);
        return IndirectAtGatherHit{radius, false};
    }

    // ---- Direct light, density estimates, media --------------------------------------------------------

    // Of photons, where paths may have `left` bounces from there: the last of them is the one at the
    // estimate.
    DensityEstimateSettings within(int left, DensityEstimateSettings how) const {
        if (settings_.max_depth > 0) how.most_bounces = left - 1;
        return how;
    }

    // Books direct light by the chosen method.
    void direct(const PathAccount& path, const Vertex& vertex, const DensityEstimateSettings& how,
                Sampler& sampler) const {
        if (settings_.direct == DirectMethod::map) {
            estimate(MapKind::direct, path, vertex, how, sampler);
        } else {
            sample_direct(path, vertex, sampler);
        }
    }
    // The same, by shadow rays, whatever the Direct map is used for elsewhere.
    void sample_direct(const PathAccount& path, const Vertex& vertex, Sampler& sampler) const {
        const LightChoice plain = lights_.at(vertex.hit.at, vertex.bsdf, vertex.wo);
        if (!guides_) {
            direct_light(scene_, vertex, sampler, plain, path);
        } else if (settings_.direct == DirectMethod::gated) {
            gated_light(scene_, *guides_, vertex, sampler, plain, path);
        } else {
            GuidedLight(scene_, *guides_, guided_)(vertex, sampler, plain, path);
        }
    }

    // Books what a map's photons bring to a surface, and returns the radius of the estimate. Draws nothing of
    // the sampler itself.
    float estimate(MapKind kind, const PathAccount& path, const Vertex& vertex,
                   const DensityEstimateSettings& how, const Sampler& sampler) const {
        const PhotonMap* map = maps_.find(kind);
        if (!map) return 0;
        DensityEstimateSettings own = how;
        own.sharper = path.wants_blur();
        const auto book = [&](const DensityEstimate& density) {
            const DensityEstimateResult found =
                density.radiance(vertex.hit, vertex.bsdf, vertex.wo, kind, path);
            if (own.sharper) path.blurred(found.value - found.sharper);
            return found.radius;
        };
        // A correction takes light to be even over the disc; a caustic is not.
        if (kind == MapKind::caustic) own.boundary = Boundary::none;
        if (radii_) {
            const SurfacePoint& at = vertex.hit.at;
            own.k = 0;  // all
            // Below the surface's own error float32 cannot tell points apart.
            const LocalRadius::At found = radii_->radius(kind, at.p, vertex.normal());
            own.radius = std::max(found.radius, at.error);
            if (found.whole) own.boundary = Boundary::none;
            if (kind == MapKind::caustic) {
                own.radius *= kCausticReach;
                return book(DensityEstimate(*map, own, caustic_radii_));
            }
        }
        const Probing probing{scene_, sampler.split(kProbesBranch + static_cast<std::uint32_t>(kind))};
        return book(DensityEstimate(*map, own, probing));
    }

    // Books what media scatter into a ray at a place: radiance per unit of length.
    void in_scattered(const EyePath& path, const MediumVertex& vertex, const Rgb& sigma_s, Stage stage,
                      const Splits& splits, Sampler& sampler) const {
        if (settings_.direct != DirectMethod::map)
            direct_light(scene_, vertex, sampler, lights_.at(vertex.p), path.times(sigma_s));
        const PhotonMap* map = splits.estimates > 0 ? maps_.find(MapKind::volume) : nullptr;
        if (!map) return;
        const DensityEstimateSettings how =
            within(path.left, stage == Stage::eye ? estimates_.eye : estimates_.gather);
        VolumeDensityEstimateSettings volume{how.k, estimates_.volume_radius, how.most_bounces};
        if (radii_) volume = {0, radii_->volume_radius(), how.most_bounces};
        const VolumeDensityEstimate density(scene_, *map, volume);
        const ScatteringPoint at{vertex.p, vertex.phase, vertex.wo, vertex.medium, sigma_s};
        density.in_scattered(at, sampler, path.times(splits.estimates));
    }

    const Scene& scene_;
    PhotonMapSettings settings_;
    DensityEstimatePair estimates_;
    PhotonMaps maps_;
    const GuideMap* guides_;  // null: none
    std::optional<IrradiancePoints> irradiance_;
    std::optional<DirectionGuideMap> directions_;
    std::unique_ptr<const RadiusRule> radii_;
    std::vector<float> caustic_radii_;
    int samples_;              // PhotonMapPass's
    const PixelEdges* edges_;  // PhotonMapPass's
    GuidedLightSettings guided_;
    LightChooser lights_;
    Splitting splitting_;
};

bool PhotonMapEstimator::Visitor::at_surface(EyePath& path, const Vertex& at, Sampler& sampler) {
    const SplitBsdf split(at.bsdf);
    Lobes lobes;
    if (split.diffuse) {
        const Vertex diffuse{at.hit, *split.diffuse, at.wo, at.medium};
        if (stage_ == Stage::eye) {
            of_.shade_eye(path, diffuse, splits_, sampler);
        } else if (of_.shade_gather(path, diffuse, length_, sampler)) {
            lobes.diffuse = &*split.diffuse;
        }
    }
    const GlossySplit glossy(split.rest, path.rule, of_.settings_.specular_below);
    lobes.rest_scale = rest_scale(path, split, at.wo, sampler);
    if (glossy.light_sampled && lobes.rest_scale > 0) {
        // No photons there: sample the lights, then follow the BSDF.
        if (!glossy.light_sampled->is_delta()) {
            const Vertex rest{at.hit, *glossy.light_sampled, at.wo, at.medium};
            lobes.rest_lights = of_.lights_.at(at.hit.at, rest.bsdf, at.wo);
            next_event(of_.scene_, rest, sampler, lobes.rest_lights, path.times(lobes.rest_scale));
        }
        lobes.rest = &*glossy.light_sampled;
    }
    if (glossy.as_specular && lobes.rest_scale > 0) lobes.as_specular = &*glossy.as_specular;
    if (++surfaces_ == kMostEyeBounces || !turn(path, at, lobes, sampler)) return false;
    began_ = path.bounces;
    return true;
}

// Where a gather ray landed, gloss beside a diffuse part is looked at by as much chance as it is likely to
// bring: it is blurred by the gather ray.
float PhotonMapEstimator::Visitor::rest_scale(const EyePath& path, const SplitBsdf& split, const V3f& wo,
                                              Sampler& sampler) const {
    if (stage_ != Stage::gather || !split.diffuse || !split.rest) return 1;
    const float chance = std::clamp(split.rest->guessed_albedo(wo) * carries(path), kLeastGlossChance, 1.0F);
    return sampler.next() < chance ? 1 / chance : 0.0F;
}

// Samples one of the lobes, at random where there are several: with a ray for each the number of rays would
// grow with every surface.
bool PhotonMapEstimator::Visitor::turn(EyePath& path, const Vertex& at, const Lobes& lobes,
                                       Sampler& sampler) const {
    const float u_lobe = sampler.next();
    const BsdfU u{sampler.next(), sampler.next2()};
    std::array<const Bsdf*, 3> open{};
    std::size_t count = 0;
    for (const Bsdf* lobe : {lobes.diffuse, lobes.rest, lobes.as_specular}) {
        if (lobe) open[count++] = lobe;
    }
    if (count == 0) return false;
    const auto share = static_cast<float>(count);
    const Bsdf* lobe = open[std::min(static_cast<std::size_t>(u_lobe * share), count - 1)];
    const auto sample = lobe->sample(at.wo, u, Transport::radiance);
    if (!sample) return false;
    // After diffuse scattering direct light and caustics are counted already.
    const bool asked = lobe == lobes.rest;
    if (!asked) path.rule = EmissionRule::none();
    path.turn(at, *sample,
              asked ? EmissionRule::mis(sample->pdf_w, lobes.rest_lights) : EmissionRule::none());
    path.throughput *= lobe == lobes.diffuse ? share : share * lobes.rest_scale;
    // Faint gloss that the camera sees is followed all the same: one ray beside all those that gather, where
    // roulette would make bright specks of what lamps it mirrors.
    const bool sure = stage_ == Stage::eye && surfaces_ <= kSureBounces;
    return path.survives(sure ? 1.0F : carries(path), sampler);
}

// Without numbers of samples: split(). Null if the monitor stopped it.
std::unique_ptr<PhotonMapEstimator> make_estimator(const PhotonMapSettings& settings,
                                                   const PassContext& context, PhotonMapPass parts) {
    auto state = first_pass(settings, context, parts);
    if (!state) return nullptr;
    return std::make_unique<PhotonMapEstimator>(context.scene, settings, std::move(parts), std::move(*state));
}

// -----------------------------------------------------------------------------------------------------
// Two halves of the samples, each with maps of its own
// Half of the photons, and of those in an estimate, so that discs are as wide: the mean of both is as good as
// by one set of maps of all photons, and what the halves differ by tells how good.
// -----------------------------------------------------------------------------------------------------

PhotonMapSettings settings_of_half(PhotonMapSettings settings) {
    const auto halve = [](auto& number) { number = (number + 1) / 2; };  // 0 stays 0
    halve(settings.photons);
    halve(settings.caustic_photons);
    halve(settings.indirect_photons);
    halve(settings.estimate.k);
    halve(settings.gather_k);
    return settings;
}

class HalvesEstimator final : public Estimator {
  public:
    using Halves = std::array<std::unique_ptr<PhotonMapEstimator>, 2>;
    explicit HalvesEstimator(Halves halves) : halves_(std::move(halves)) {}

    // A path of no half sees what is as good as either.
    void follow(const EyePath& path, Sampler& sampler) const override {
        halves_[static_cast<std::size_t>(path.half.value_or(0))]->follow(path, sampler);
    }

  private:
    Halves halves_;
};

// Null if the monitor stopped it. `parts_of_half()` gives the pass's parts, but for `sets`.
template <typename Parts>
std::unique_ptr<const Estimator> halves_of_pass(const PhotonMapSettings& whole, const PassContext& context,
                                                Parts&& parts_of_half) {
    PhotonMapSettings settings = settings_of_half(whole);
    HalvesEstimator::Halves halves;
    for (std::uint32_t half = 0; half < 2; ++half) {
        PhotonMapPass parts = parts_of_half();
        parts.sets = half == 0 ? 2 : 1;
        PassStatistics statistics;
        const PassContext own{context.prepared_by(context.prepared.shared_by(parts.sets)),
                              2 * context.pass + half, statistics};
        halves[half] = make_estimator(settings, own, std::move(parts));
        if (!halves[half]) return nullptr;
        if (half == 0) {
            halves[0]->split(own);
            // As many for the other half, whatever there would be time for.
            if (statistics.ledger && context.prepared.exists())
                settings.photons = static_cast<std::int64_t>(statistics.ledger->paths());
        } else {
            halves[1]->split_by(halves[0]->splitting());
        }
        context.statistics.add(statistics);
    }
    return std::make_unique<HalvesEstimator>(std::move(halves));
}

}  // namespace

std::unique_ptr<const Estimator> photon_map_pass(const PhotonMapSettings& settings,
                                                 const PassContext& context, PhotonMapPass parts) {
    auto estimator = make_estimator(settings, context, std::move(parts));
    if (estimator) estimator->split(context);
    return estimator;
}

namespace {

// -----------------------------------------------------------------------------------------------------
// Once for all passes: an importance pre-pass, by which light paths are emitted towards what the camera sees;
// guides, by which direct light is sampled
// -----------------------------------------------------------------------------------------------------

// Photons of the pre-pass in an estimate: its disc is then about as wide as one of the image's. Fewer than
// the least say little; more than the most take long.
int pre_pass_photons(const PhotonMapSettings& settings, int k) {
    constexpr double kLeast = 8, kMost = 32;
    if (k == 0) return static_cast<int>(kMost);
    const double share = static_cast<double>(settings.pre_pass.paths) / static_cast<double>(settings.photons);
    return static_cast<int>(std::clamp(std::ceil(k * share), kLeast, kMost));
}

}  // namespace

std::optional<ImportancePrePass> learn_emission(const PhotonMapSettings& settings,
                                                const DensityEstimateSettings& estimate,
                                                const RenderContext& context, OnceStatistics& statistics) {
    ImportancePrePassSettings how;
    how.guiding = settings.pre_pass;
    how.seed = context.seed;
    how.gather = settings.indirect == IndirectMethod::gather;
    how.meter = settings.quantity == Quantity::illuminance;
    how.estimate = estimate;
    how.estimate.k = pre_pass_photons(settings, estimate.k);
    how.specular_below = settings.specular_below;
    bool reads = false;
    for (const MapKind kind : {MapKind::direct, MapKind::global, MapKind::caustic}) {
        const auto i = static_cast<std::size_t>(kind);
        const bool built = map_need(kind, settings, context.scene).build;
        how.at_gather[i] = built && how.gather;
        how.seen[i] = built && !(how.gather && kind == MapKind::global);
        reads = reads || built;
    }
    statistics.emission = why_emission_is_plain(settings.pre_pass, context);
    if (statistics.emission.empty() && !reads) statistics.emission = "plain: no map is read";
    if (!statistics.emission.empty()) return std::nullopt;
    auto pre_pass =
        run_importance_pre_pass(context.scene, *context.view, how, context.workers, context.monitor);
    report_pre_pass(pre_pass ? &*pre_pass : nullptr, settings.pre_pass, context.scene, statistics);
    return pre_pass;
}

namespace {

// The photons by which direct light is sampled, if it is.
std::optional<GuideMap> emit_guides(const PhotonMapSettings& settings, const RenderContext& context,
                                    OnceStatistics& statistics) {
    if (!goes_by_guides(settings, context.scene)) return std::nullopt;
    const bool gate = settings.direct == DirectMethod::gated;
    const Stopwatch building;
    const float radius = density_settings(settings, context.scene).eye.radius;
    const GuideParameters parameters{
        settings.guide.photons, context.seed, 0, {gate ? 0 : settings.guide.k, radius}, settings.lights};
    GuideMap map = build_guides(context.scene, parameters, context.workers, context.monitor);
    statistics.seconds.add("guide", building.seconds());
    statistics.guides = {map.map().size(), map.distributions()};
    return map;
}

// -----------------------------------------------------------------------------------------------------
// The integrator: an importance pre-pass and guides once, then both passes
// -----------------------------------------------------------------------------------------------------

class PhotonMapSession final : public Session {
  public:
    PhotonMapSession(const PhotonMapSettings& settings, const MapFiles& files, const RenderContext& context,
                     std::optional<ImportancePrePass> pre_pass, std::optional<GuideMap> guides)
        : settings_(settings),
          files_(files),
          context_(context),
          pre_pass_(std::move(pre_pass)),
          guides_(std::move(guides)) {}

    std::unique_ptr<const Estimator> pass(std::uint32_t index, Monitor& monitor,
                                          PassStatistics& statistics) const override {
        const auto parts = [this] {
            PhotonMapPass own;
            own.emission = pre_pass_ ? &pre_pass_->emission : nullptr;
            own.guides = guides_ ? &*guides_ : nullptr;
            own.files = files_;
            return own;
        };
        const PassContext context{context_.told_to(monitor), index, statistics};
        if (!context.two_halves) return photon_map_pass(settings_, context, parts());
        // A file is of one set of maps.
        if (!files_.any()) return halves_of_pass(settings_, context, parts);
        warn_of_shared("the maps in a file are", monitor);
        return photon_map_pass(settings_, context, parts());
    }

  private:
    PhotonMapSettings settings_;
    MapFiles files_;
    RenderContext context_;
    std::optional<ImportancePrePass> pre_pass_;
    std::optional<GuideMap> guides_;
};

class PhotonMapIntegrator final : public Integrator {
  public:
    PhotonMapIntegrator(const PhotonMapSettings& settings, const MapFiles& files)
        : settings_(settings), files_(files) {}

    std::unique_ptr<const Session> begin(const RenderContext& context,
                                         OnceStatistics& statistics) const override {
        const DensityEstimateSettings how = density_settings(settings_, context.scene).eye;
        std::optional<ImportancePrePass> pre_pass;
        if (files_.any() && settings_.pre_pass.paths > 0) {
            statistics.emission = "plain: maps in files serve every camera";
        } else {
            pre_pass = learn_emission(settings_, how, context, statistics);
        }
        if (context.monitor.stopped()) return nullptr;
        auto guides = emit_guides(settings_, context, statistics);
        if (context.monitor.stopped()) return nullptr;
        return std::make_unique<PhotonMapSession>(settings_, files_, context, std::move(pre_pass),
                                                  std::move(guides));
    }

    std::string why_no_light_groups() const override {
        if (settings_.indirect != IndirectMethod::gather || settings_.precompute == 0) return {};
        return "photonmap with precomputed irradiance cannot separate it by light; use path, direct, igi, "
               "progressive, or photonmap with \"integer precompute\" 0 or \"string indirect\" \"map\"";
    }

    std::vector<std::string> describe(const Scene& scene) const override {
        std::vector<std::string> lines;
        for (std::size_t i = 0; i < kMapKinds; ++i) {
            const auto kind = static_cast<MapKind>(i);
            lines.push_back(
                fmt::format("{} map {}", map_name(kind), map_need(kind, settings_, scene).text()));
        }
        if (settings_.pre_pass.paths > 0) lines.push_back(describe_pre_pass(settings_.pre_pass.paths));
        const bool targets = settings_.caustic_photons > 0 || settings_.indirect_photons > 0;
        lines.push_back(targets ? "light paths until the targets are met"
                                : fmt::format("{} light paths", settings_.photons));
        if (settings_.indirect == IndirectMethod::gather && settings_.precompute > 0) {
            lines.push_back(
                fmt::format("irradiance at the hit of a bounce from one photon in {}", settings_.precompute));
        }
        return lines;
    }

  private:
    PhotonMapSettings settings_;
    MapFiles files_;
};

}  // namespace

std::unique_ptr<Integrator> make_photon_mapping(const PhotonMapSettings& settings, const MapFiles& files) {
    return std::make_unique<PhotonMapIntegrator>(settings, files);
}

}  // namespace lucerna
