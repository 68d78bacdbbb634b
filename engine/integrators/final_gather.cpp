#include "engine/integrators/final_gather.h"

#include <array>
#include <cmath>

#include "engine/base/monitor.h"
#include "engine/guiding/directional_guide.h"
#include "engine/integrators/precomputed_irradiance.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/follow.h"
#include "photon/irradiance.h"
#include "photon/volume_estimate.h"

namespace lucerna {
namespace {

// Limits how many surfaces one path of pass 2 shades: glossy ones, and those too near to a gather ray's
// origin. The limit is far below kMaxBounces, because each surface reads the maps or samples lights anew.
constexpr int kMostEyeBounces = 64;

// Paths from the eye survive without Russian roulette over this many shaded surfaces.
constexpr int kSureBounces = 4;

// Gloss where a gather ray lands is followed with at least this probability; its weight is then at most 10.
constexpr float kLeastGlossChance = 0.1F;

// Caustic photons are searched within this multiple of the radius r(x) of the estimate. A photon at y
// contributes at x if it is nearer than r(y). Where radii change by less than half of the distance between
// two points, r(y) < 2 r(x). Where they change faster, the search misses photons of larger radii at the rims
// of their discs.
constexpr float kCausticReach = 2;

// These are branches of a camera sample's sampler, for gather rays, for each map's probes, for light samples,
// for caustics, and for the choice of the sample of a pass that estimates density. follow.h and eye_path.cpp
// have further branches. Adding kChanceBranch to a branch gives the one that decides on a fractional sample.
constexpr std::uint32_t kGatherBranch = 0, kProbesBranch = 1;
constexpr std::uint32_t kLightBranch = kProbesBranch + kMapKinds, kCausticBranch = kLightBranch + 1;
constexpr std::uint32_t kChanceBranch = kCausticBranch + 1;
constexpr std::uint32_t kEstimateBranch = 2 * kChanceBranch;
constexpr std::uint32_t kBranches = kEstimateBranch + 1;  // stride between the two samples of a pilot

// Splits a surface's BSDF into the diffuse part, for estimates from photons, and the rest, which is traced.
struct SplitBsdf {
    std::optional<Bsdf> diffuse, rest;

    explicit SplitBsdf(const Bsdf& bsdf) {
        if (stores_photons(bsdf)) diffuse = bsdf.diffuse_part();
        if (!diffuse || !bsdf.is_diffuse()) rest = bsdf.rest();
    }
};

// Splits the non-diffuse part of a BSDF. After a gather ray (EmissionRule::none) direct light and caustics
// are already counted where the ray began. Lobes that count as specular must not sample lights again there,
// or caustics would count twice.
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

SplitNumbers fixed_numbers(const PhotonMapSettings& settings) {
    SplitNumbers numbers;
    if (settings.gather_rays > 0) numbers.gather_rays = static_cast<float>(settings.gather_rays);
    return numbers;
}

}  // namespace

// -----------------------------------------------------------------------------------------------------
// Follows a path from the eye, or a gather ray, up to the first purely diffuse surface
// -----------------------------------------------------------------------------------------------------

class SecondPass::Visitor : public EyeVisitor {
  public:
    Visitor(const SecondPass& of, Stage stage, const Splits& splits, const EyePath& path)
        : of_(of),
          stage_(stage),
          splits_(splits),
          carried_(max_component(path.throughput)),
          began_(path.bounces) {}

    bool arrives(const EyePath& path, const Hit& hit) {
        if (path.bounces == began_) length_ = path.rule.passed + hit.t;
        return true;
    }
    bool at_surface(EyePath& path, const Vertex& at, Sampler& sampler);
    bool at_medium(EyePath& path, const MediumVertex& at, const Rgb& sigma_s, Sampler& sampler) const {
        of_.in_scattered(path, at, sigma_s, stage_, splits_, sampler);
        return false;
    }

  private:
    // Lists the lobes of a surface over which a path may continue.
    struct Lobes {
        const Bsdf* diffuse = nullptr;
        const Bsdf* rest = nullptr;
        const Bsdf* as_specular = nullptr;  // see GlossySplit
        LightChoice rest_lights = {};       // how `rest` chose its light
        float rest_scale = 1;  // 1 / probability of following `rest` and `as_specular`; 0: they are dropped
    };
    float rest_scale(const EyePath& path, const SplitBsdf& split, const V3f& wo, Sampler& sampler) const;
    bool turn(EyePath& path, const Vertex& at, const Lobes& lobes, Sampler& sampler) const;
    // Returns the share of the throughput with which the path began that it still carries.
    float carries(const EyePath& path) const { return max_component(path.throughput) / carried_; }

    const SecondPass& of_;
    Stage stage_;
    const Splits& splits_;
    float carried_;     // largest component of the throughput at the start; 0: the path brings nothing
    int began_;         // bounces of the path where its last segment began: at the camera or a shaded surface
    int surfaces_ = 0;  // shaded so far
    // This is the length of that segment up to the first surface that does not pass it straight, scene units.
    float length_ = INFINITY;
};

bool SecondPass::Visitor::at_surface(EyePath& path, const Vertex& at, Sampler& sampler) {
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
        // Gloss stores no photons: sample the lights, then follow the BSDF.
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

// Returns the weight of the non-diffuse lobes, or 0 if Russian roulette drops them. Where a gather ray lands,
// they survive in proportion to what they are likely to bring, because the gather ray blurs them.
float SecondPass::Visitor::rest_scale(const EyePath& path, const SplitBsdf& split, const V3f& wo,
                                      Sampler& sampler) const {
    if (stage_ != Stage::gather || !split.diffuse || !split.rest) return 1;
    const float chance = std::clamp(split.rest->guessed_albedo(wo) * carries(path), kLeastGlossChance, 1.0F);
    return sampler.next() < chance ? 1 / chance : 0.0F;
}

// Samples one of the lobes, chosen at random: following each would multiply the rays at every surface.
bool SecondPass::Visitor::turn(EyePath& path, const Vertex& at, const Lobes& lobes, Sampler& sampler) const {
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
    // Except for `rest`, direct light and caustics are already counted at this surface or before it.
    const bool samples_lights = lobe == lobes.rest;
    if (!samples_lights) path.rule = EmissionRule::none();
    path.turn(at, *sample,
              samples_lights ? EmissionRule::mis(sample->pdf_w, lobes.rest_lights) : EmissionRule::none());
    path.throughput *= lobe == lobes.diffuse ? share : share * lobes.rest_scale;
    // Faint gloss that the camera sees always survives: it costs one ray beside all the gather rays, and
    // Russian roulette would turn the lamps mirrored in it into bright specks.
    const bool sure = stage_ == Stage::eye && surfaces_ <= kSureBounces;
    return path.survives(sure ? 1.0F : carries(path), sampler);
}

// -----------------------------------------------------------------------------------------------------
// Shading of what the camera sees
// -----------------------------------------------------------------------------------------------------

SecondPass::SecondPass(const Scene& scene, const PhotonMapSettings& settings, FirstPassResult parts,
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
      guided_{candidates_that_pay(scene)},
      lights_(scene) {}

void SecondPass::follow(const EyePath& path, Sampler& sampler) const {
    Splits splits{splitting_.at(path.film)};
    // Across an edge, density estimates vary as much as camera samples do, so every sample takes one.
    if (samples_ > 1 && !(edges_ && edges_->at(path.film))) {
        // Exactly one of 2^k consecutive samples estimates density if the first one's index is a multiple of
        // 2^k, because the numbers are stratified.
        const auto samples = static_cast<float>(samples_);
        splits.estimates = sampler.split_alike(kEstimateBranch).next() < 1 / samples ? samples : 0.0F;
    }
    lucerna::follow(scene_, path, sampler, Visitor(*this, Stage::eye, splits, path));
}

void SecondPass::split(const PassContext& context) {
    if (!is_split_by_pilot(settings_) || !context.view) return split_by(Splitting(fixed_numbers(settings_)));
    const Stopwatch watch;
    const auto look = [this](const Ray& ray, Sampler& sampler, SplitPilot& pilot) {
        SampleAccount account;
        const EyePath path = EyePath::begin(scene_, ray, settings_.quantity, settings_.max_depth, account);
        const Splits splits{{}, &pilot};
        lucerna::follow(scene_, path, sampler, Visitor(*this, Stage::eye, splits, path));
        return account.radiance();
    };
    split_by(Splitting(*context.view, context.seed, context.pass, context.workers, look));
    context.statistics.seconds.add(std::string(kPilotPhase), watch.seconds());
}
void SecondPass::split_by(const Splitting& learned) {
    splitting_ = learned;
    if (!splitting_.any_guided()) directions_.reset();
}

namespace {

template <typename Take>
void look_at_two(std::uint32_t branch, SplitMoments& pilot, const EyePath& path, const Sampler& sampler,
                 Take&& take) {
    std::array<double, 2> value{}, ratio{};
    for (std::uint32_t i = 0; i < 2; ++i) {
        SampleAccount found = path.scratch();
        EyePath one = path;
        one.use_account(found);
        Sampler own = sampler.split_alike(branch + kBranches * i);
        ratio[i] = double{take(one, own)};
        value[i] = double{luminance(found.radiance())};
        path.add_account(found, 0.5F);
    }
    pilot.add(value[0], value[1], ratio[0], ratio[1]);
}

}  // namespace

// Takes `number` samples of one kind at a place that the camera sees, each with its own random numbers, and
// books their mean. Splits a fractional number stochastically: floor(number) samples, plus one with
// probability frac(number); below 1, one sample with that probability, divided by it. `take(path, sampler)`
// books one sample on the given path and returns the ratio of its density to that without guiding. A pilot
// books the mean of two samples and records both as they reach the pixel.
template <typename Take>
void SecondPass::some_of(float number, std::uint32_t branch, SplitMoments* pilot, const EyePath& path,
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
// Shades a diffuse surface that the camera sees.
void SecondPass::shade_eye(const EyePath& path, const Vertex& vertex, const Splits& splits,
                           Sampler& sampler) const {
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
        some_of(numbers.caustic_estimates, kCausticBranch, pilot ? &pilot->caustic : nullptr, path, sampler,
                [&](const EyePath& one, Sampler& own) {
                    estimate(MapKind::caustic, one, vertex, how, own);
                    return 1.0F;
                });
    }
    if (path.left == 1) return;  // a gather ray would find only emission, which is direct light
    const bool guided = pilot || numbers.guided;
    some_of(numbers.gather_rays, kGatherBranch, pilot ? &pilot->gather : nullptr, path, sampler,
            [&](const EyePath& one, Sampler& own) { return gather_ray(one, vertex, guided, own); });
}

// Books indirect radiance from one direction, and returns the ratio of its density to that without guiding.
// Emission at the ray's end is direct light or a caustic, which are counted elsewhere.
float SecondPass::gather_ray(EyePath path, const Vertex& vertex, bool guided, Sampler& sampler) const {
    const BsdfU u{sampler.next(), sampler.next2()};
    DirectionGuide guide;
    if (directions_ && guided) guide = directions_->at(vertex.hit.at.p, vertex.bsdf, vertex.wo);
    const auto drawn = GuidedBsdf(vertex.bsdf, vertex.wo, guide).sample(u);
    if (!drawn) return 1;
    path.splits = 0;
    path.turn(vertex, drawn->sample, EmissionRule::none());
    const Splits one_of_each;
    Visitor visit(*this, Stage::gather, one_of_each, path);
    lucerna::follow(scene_, path, sampler, visit);
    return drawn->ratio;
}

// -----------------------------------------------------------------------------------------------------
// Shading where a gather ray lands
// -----------------------------------------------------------------------------------------------------

// Shades a diffuse surface where a gather ray ended. `length` is that of the ray's first segment: an estimate
// with a larger radius may reach around the corner that is being shaded. In that case the function evaluates
// only direct light and caustics, and returns true: the ray continues, to find light of more bounces.
bool SecondPass::shade_gather(const EyePath& path, const Vertex& vertex, float length,
                              Sampler& sampler) const {
    const DensityEstimateSettings how = within(path.left, estimates_.gather);
    // The estimate is booked once it is known that it counts.
    SampleAccount found = path.scratch();
    PathAccount of_indirect = path;
    of_indirect.use_account(found);
    const auto indirect = indirect_at_gather_hit(of_indirect, vertex, how, sampler);
    if (!indirect || indirect->radius > length) {
        sample_direct(path, vertex, sampler);
        estimate(MapKind::caustic, path, vertex, how, sampler);
        return true;
    }
    path.add_account(found);
    if (!indirect->has_direct) direct(path, vertex, how, sampler);
    return false;
}

// Books indirect light and caustics where a gather ray ended, from the precomputed irradiance if there is
// any, and otherwise from density estimates. Returns none where no irradiance point is near, on surfaces that
// are small or seldom lit: there an estimate would use photons of other surfaces, and its probes would cost
// as many rays as a dozen paths.
std::optional<SecondPass::IndirectAtGatherHit> SecondPass::indirect_at_gather_hit(
    const PathAccount& path, const Vertex& vertex, const DensityEstimateSettings& how,
    const Sampler& sampler) const {
    if (irradiance_) {
        const V3f& p = vertex.hit.at.p;
        if (const auto found = irradiance_->nearest(p, vertex.normal(), how.radius, how.most_bounces)) {
            const Rgb radiance = irradiance_suffices(vertex.bsdf)
                                     ? found->irradiance * vertex.bsdf.albedo(vertex.wo) * kInvPi
                                     : found->light->radiance(vertex.bsdf, vertex.wo, vertex.normal());
            path.add_indirect(found->share * radiance,
                              0);  // there are no light groups: why_no_light_groups()
            return IndirectAtGatherHit{found->radius, holds_direct(settings_, scene_)};
        }
        // With direct = map, lights that only particles carry are found by density estimates alone.
        if (settings_.direct != DirectMethod::map) return std::nullopt;
    }
    const float radius = estimate(MapKind::global, path, vertex, how, sampler);
    estimate(MapKind::caustic, path, vertex, how, sampler);
    return IndirectAtGatherHit{radius, false};
}

// -----------------------------------------------------------------------------------------------------
// Direct light, density estimates, media
// -----------------------------------------------------------------------------------------------------

// Books direct light by the chosen method.
void SecondPass::direct(const PathAccount& path, const Vertex& vertex, const DensityEstimateSettings& how,
                        Sampler& sampler) const {
    if (settings_.direct == DirectMethod::map) {
        estimate(MapKind::direct, path, vertex, how, sampler);
    } else {
        sample_direct(path, vertex, sampler);
    }
}

// Books direct light by next-event estimation with MIS, even if the Direct map is used elsewhere.
void SecondPass::sample_direct(const PathAccount& path, const Vertex& vertex, Sampler& sampler) const {
    const LightChoice plain = lights_.at(vertex.hit.at, vertex.bsdf, vertex.wo);
    if (!guides_) {
        direct_light(scene_, vertex, sampler, plain, path);
    } else if (settings_.direct == DirectMethod::gated) {
        gated_light(scene_, *guides_, vertex, sampler, plain, path);
    } else {
        GuidedLight(scene_, *guides_, guided_)(vertex, sampler, plain, path);
    }
}

// Books the radiance due to a map's photons, and returns the estimate's radius. Leaves the sampler as it is.
float SecondPass::estimate(MapKind kind, const PathAccount& path, const Vertex& vertex,
                           const DensityEstimateSettings& how, const Sampler& sampler) const {
    const PhotonMap* map = maps_.find(kind);
    if (!map) return 0;
    DensityEstimateSettings own = how;
    own.sharper = path.wants_blur();
    const auto book = [&](const DensityEstimate& density) {
        const DensityEstimateResult found = density.radiance(vertex.hit, vertex.bsdf, vertex.wo, kind, path);
        if (own.sharper) path.add_blur(found.value - found.sharper);
        return found.radius;
    };
    // The boundary correction assumes that light is even over the disc; a caustic is not.
    if (kind == MapKind::caustic) own.boundary = Boundary::none;
    if (radii_) {
        const SurfacePoint& at = vertex.hit.at;
        own.k = 0;  // use all photons within the radius
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

// Books the light that a medium scatters into a ray at one place: radiance per scene unit of length.
void SecondPass::in_scattered(const EyePath& path, const MediumVertex& vertex, const Rgb& sigma_s,
                              Stage stage, const Splits& splits, Sampler& sampler) const {
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

}  // namespace lucerna
