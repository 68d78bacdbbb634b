#include "engine/vpl/igi_caustics.h"

#include <algorithm>

#include "engine/base/monitor.h"

namespace lucerna {
namespace {

// All light paths together have at most this many bounces per path asked for. Usually paths have one or two,
// and some ten where lamps stand in frosted glass; in a room of lossless mirrors they have a thousand.
constexpr int kMostBounces = 16;

// Tells whether a material may have a lobe without a peak, on which photons lie.
struct MayBeDiffuse {
    static bool of(const Material& material) { return std::visit(MayBeDiffuse{}, material.model); }

    bool operator()(const DiffuseMaterial& m) const {
        const auto reflectance = m.reflectance.constant_value();
        return !reflectance || !is_black(*reflectance);
    }
    bool operator()(const MirrorMaterial&) const { return false; }
    bool operator()(const ConductorMaterial&) const { return false; }
    bool operator()(const DielectricMaterial&) const { return false; }
    bool operator()(const ThinDielectricMaterial&) const { return false; }
    bool operator()(const CoatedConductorMaterial&) const { return false; }
    bool operator()(const ShinyMetalMaterial&) const { return false; }
    bool operator()(const InterfaceMaterial&) const { return false; }
    bool operator()(const MixMaterial& m) const { return of(*m.first) || of(*m.second); }
    template <typename WithABase>
    bool operator()(const WithABase&) const {
        return true;
    }
};

// Tells whether the scene may have a surface on which photons lie.
bool shows_caustics(const Scene& scene) {
    const auto materials = scene.materials();
    return std::any_of(materials.begin(), materials.end(), MayBeDiffuse::of);
}

}  // namespace

VplGloss vpl_gloss(const IgiSettings& settings) {
    if (settings.compensates()) return VplGloss::none;
    return settings.caustic_paths > 0 ? VplGloss::of_indirect : VplGloss::all;
}

bool throws_caustics(const Scene& scene) {
    const auto materials = scene.materials();
    return std::any_of(materials.begin(), materials.end(), has_peak);
}

IgiCaustics::IgiCaustics(const IgiSettings& settings)
    : specular_below_(settings.caustic_paths > 0 || settings.compensates() ? INFINITY : 0),
      max_depth_(settings.max_depth),
      rays_find_rest_(settings.compensates()) {}

IgiCaustics::IgiCaustics(const IgiSettings& settings, const RenderContext& context, std::uint32_t pass,
                         const LearnedEmission* learned)
    : IgiCaustics(settings) {
    const Scene& scene = context.scene;
    if (settings.caustic_paths == 0 || !throws_caustics(scene) || !shows_caustics(scene)) return;
    if (most_bounces(settings.max_depth) < 2) return;
    const Stopwatch watch;
    MapParameters maps;
    const int halves = context.two_halves ? 2 : 1;
    maps.paths = (settings.caustic_paths + halves - 1) / halves;
    maps.wanted[static_cast<std::size_t>(MapKind::caustic)] = true;
    maps.seed = context.seed;
    maps.specular_below = specular_below_;
    maps.longest = most_bounces(settings.max_depth) - 1;
    maps.caustic_chains = rays_find_rest_;
    maps.most_mean_bounces = kMostBounces;
    maps.emission = learned;
    maps.index = settings.index;
    density_.radius = largest_radius(diagonal(scene));
    density_.k = (density_.k + halves - 1) / halves;  // so that discs are as wide
    made_.emplace();
    for (int half = 0; half < halves; ++half) {
        maps.sets = halves - half;
        maps.pass = static_cast<std::uint32_t>(halves) * pass + static_cast<std::uint32_t>(half);
        maps.deadline = context.prepared.shared_by(maps.sets);
        PhotonMaps built = build_photon_maps(scene, maps, context.workers, context.monitor);
        if (context.monitor.stopped()) return;
        // The other half gets as many paths, even if there were time for more or fewer.
        maps.paths = static_cast<std::int64_t>(built.ledger.paths);
        maps.most_mean_bounces = 0;
        constexpr auto kCaustic = static_cast<std::size_t>(MapKind::caustic);
        maps_.push_back(std::move(*built.maps[kCaustic]));
        made_->paths += built.ledger.paths;
        made_->photons.add(built.counts[kCaustic]);
    }
    made_->seconds = watch.seconds();
}

void IgiCaustics::add_radiance(const Vertex& vertex, std::size_t half, int left,
                               const PathAccount& path) const {
    if (maps_.empty() || !vertex.bsdf.has_diffuse()) return;
    const Bsdf part = rays_find_rest_ ? vertex.bsdf.diffuse_part() : vertex.bsdf.blurred_part(0);
    DensityEstimateSettings how = density_;
    how.sharper = path.wants_blur();
    if (max_depth_ > 0) how.most_bounces = left - 1;
    const DensityEstimate estimate(maps_.size() > 1 ? maps_[half] : maps_.front(), how);
    const DensityEstimateResult found =
        estimate.radiance(vertex.hit, part, vertex.wo, MapKind::caustic, path);
    if (how.sharper) path.add_blur(found.value - found.sharper);
}

Rgb IgiCaustics::left_to_rays(const Vertex& vertex, const V3f& w) const {
    if (maps_.empty() || !vertex.bsdf.has_diffuse()) return Rgb(1);
    if (vertex.bsdf.is_diffuse()) return Rgb(0);
    const Rgb all = vertex.bsdf.f(vertex.wo, w, Transport::radiance);
    const Rgb rest = vertex.bsdf.rest().f(vertex.wo, w, Transport::radiance);
    Rgb share(0);
    for (int c = 0; c < 3; ++c) share[c] = all[c] > 0 ? std::min(rest[c] / all[c], 1.0F) : 0.0F;
    return share;
}

}  // namespace lucerna
