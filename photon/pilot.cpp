#include "photon/pilot.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/base/stopwatch.h"
#include "photon/near_photons.h"
#include "photon/photon_map.h"
#include "photon/pilot_blocks.h"

namespace lucerna {
namespace {

// The pilot's place among the passes: none of them ever has that number, nor has the pilot of radii.
constexpr std::uint32_t kPilotPass = 0xfffffffeU;

// Of the mean radiance, added to a pixel's own: what is darker than that may be as wrong as that.
constexpr double kDarkest = 0.05;

// Pilot paths for one camera ray: estimates cost as much as the paths that they judge.
constexpr std::int64_t kPathsPerRay = 4;

constexpr std::array kSurfaceMaps{MapKind::direct, MapKind::global, MapKind::caustic};

// Photons of the pilot, by map; a photon's `cell` is the number of its path. Powers are those of the pilot's
// mean.
using PilotPhotons = std::array<Photons, kMapKinds>;

PilotPhotons walk_pilot(const Scene& scene, const PilotSettings& settings, std::int64_t begin,
                        std::int64_t end) {
    PilotPhotons photons;
    Ledger ledger;
    const float share = 1.0F / static_cast<float>(settings.paths);
    Emission emission(scene, settings.seed, Purpose::emission, kPilotPass);
    emission.for_each(static_cast<std::uint64_t>(begin), static_cast<std::uint64_t>(end),
                      [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
                          if (!start) return;
                          Stream stream =
                              Stream::stratified(settings.seed, Purpose::emission, kPilotPass, path);
                          const auto visit = [&](const WalkHit& at) {
                              if (!stores_photons(at.bsdf)) return;
                              const V3f& n = at.hit.at.n;
                              photons[static_cast<std::size_t>(map_of(at.path))].add(
                                  at.hit.at.p, PackedDirection(n.dot(at.d) > 0 ? -n : n),
                                  {PackedDirection(at.d), at.power * share, start->light, path});
                          };
                          walk(
                              scene, *start, stream, ledger, visit, [](const WalkScatter&) {},
                              [](const WalkExit&) {}, settings.specular_below);
                      });
    return photons;
}

// The maps of the pilot.
std::array<std::optional<PhotonMap>, kMapKinds> pilot_maps(const Scene& scene, const PilotSettings& settings,
                                                           const Workers& workers, Monitor& monitor) {
    constexpr std::int64_t kGrain = 2048;  // fixed, so that results do not depend on threads
    std::vector<PilotPhotons> chunks(static_cast<std::size_t>((settings.paths + kGrain - 1) / kGrain));
    Phase phase(monitor, "pilot", static_cast<std::uint64_t>(settings.paths));
    parallel_ranges(workers, settings.paths, kGrain,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
                        if (monitor.stopped()) return;
                        chunks[static_cast<std::size_t>(chunk)] = walk_pilot(scene, settings, begin, end);
                        phase.advance(static_cast<std::uint64_t>(end - begin));
                    });
    std::array<std::optional<PhotonMap>, kMapKinds> maps;
    for (const MapKind kind : kSurfaceMaps) {
        const auto k = static_cast<std::size_t>(kind);
        Photons all;
        for (const PilotPhotons& chunk : chunks) {
            for (std::size_t i = 0; i < chunk[k].size(); ++i) {
                all.add(chunk[k].positions[i], chunk[k].normals[i], chunk[k].photons[i]);
            }
        }
        if (all.size() > 0) maps[k].emplace(all, IndexKind::tree, workers);
    }
    return maps;
}

// Looks at the pilot's maps as the image will at its own.
class Scorer {
  public:
    Scorer(const std::array<std::optional<PhotonMap>, kMapKinds>& maps, const PilotSettings& settings,
           std::span<const Importon> importons, const Workers& workers)
        : maps_(maps), settings_(settings), importons_(importons), workers_(workers) {}

    // By path.
    std::vector<float> scores() const {
        const std::vector<float> shown = radiances();
        using Entry = std::pair<std::uint32_t, float>;
        std::vector<std::vector<Entry>> chunks(chunk_count());
        for_each_importon([&](const Importon& importon, std::size_t /*place*/, std::size_t chunk) {
            const auto& reads = importon.landed ? settings_.landed : settings_.seen;
            for (const MapKind kind : kSurfaceMaps) {
                if (!reads[static_cast<std::size_t>(kind)]) continue;
                for_each_near(importon, kind, [&](const Photon& photon, float per_power) {
                    const float part = luminance(photon.power) * per_power / shown[importon.ray];
                    chunks[chunk].emplace_back(photon.cell, part * part);
                });
            }
        });
        std::vector<float> scores(static_cast<std::size_t>(settings_.paths));
        for (const auto& chunk : chunks) {
            for (const auto& [path, score] : chunk) scores[path] += score;
        }
        return scores;
    }

  private:
    static constexpr std::int64_t kGrain = 256;
    std::size_t chunk_count() const { return (importons_.size() + kGrain - 1) / kGrain; }

    template <typename Visit>
    void for_each_importon(Visit&& visit) const {
        parallel_ranges(workers_, static_cast<std::int64_t>(importons_.size()), kGrain,
                        [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
                            for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end);
                                 ++i) {
                                visit(importons_[i], i, static_cast<std::size_t>(chunk));
                            }
                        });
    }

    // Calls visit(photon, radiance per unit of its power) for the photons of an estimate.
    template <typename Visit>
    void for_each_near(const Importon& importon, MapKind kind, Visit&& visit) const {
        const auto& map = maps_[static_cast<std::size_t>(kind)];
        if (!map) return;
        const GatherSettings& how = settings_.estimate;
        const TangentMetric metric(importon.p, importon.n, how.metric, how.ratio);
        const NearPhotons near(*map, importon.p, metric, static_cast<std::size_t>(how.k), sqr(how.radius));
        // Photons at one point would weigh without bound; they are as far apart as float32 tells.
        const float r2 = std::max(near.radius2(), sqr(kSmallest * how.radius));
        if (!(r2 > 0)) return;
        const float per_power = importon.weight / (kPi * r2);
        if (!std::isfinite(per_power)) return;
        for (const Neighbour& neighbour : near.found()) visit(map->photons()[neighbour.index], per_power);
    }

    // What each camera ray shows, and a little more: > 0 wherever a photon is found at all.
    std::vector<float> radiances() const {
        std::vector<float> of_importon(importons_.size());
        for_each_importon([&](const Importon& importon, std::size_t place, std::size_t /*chunk*/) {
            if (importon.landed) return;
            for (const MapKind kind : kSurfaceMaps) {
                for_each_near(importon, kind, [&](const Photon& photon, float per_power) {
                    of_importon[place] += luminance(photon.power) * per_power;
                });
            }
        });
        std::size_t rays = 0;
        for (const Importon& importon : importons_) rays = std::max<std::size_t>(rays, importon.ray + 1);
        std::vector<float> shown(rays);
        double sum = 0;
        for (std::size_t i = 0; i < importons_.size(); ++i) {
            shown[importons_[i].ray] += of_importon[i];
            sum += double{of_importon[i]};
        }
        const auto dark =
            static_cast<float>(kDarkest * sum / static_cast<double>(std::max<std::size_t>(rays, 1)));
        for (float& radiance : shown) radiance += dark > 0 ? dark : 1.0F;
        return shown;
    }

    static constexpr float kSmallest = 1e-4F;  // of the largest radius

    const std::array<std::optional<PhotonMap>, kMapKinds>& maps_;
    const PilotSettings& settings_;
    std::span<const Importon> importons_;
    const Workers& workers_;
};

// The pilot's paths by light, with the numbers they began with.
std::vector<std::vector<EmitTrial>> trials(const Scene& scene, const PilotSettings& settings,
                                           std::span<const float> scores) {
    std::vector<std::vector<EmitTrial>> by_light(scene.lights().size());
    const EmitNet net(settings.seed, Purpose::emission, kPilotPass);
    for (std::size_t path = 0; path < scores.size(); ++path) {
        const EmitNet::Point point = net.at(static_cast<std::uint32_t>(path));
        const auto pick = scene.picker().pick(point.light);
        if (pick) by_light[pick->light].push_back({point.u, scores[path]});
    }
    return by_light;
}

}  // namespace

std::optional<Pilot> fly_pilot(const Scene& scene, const View& view, const PilotSettings& settings,
                               const Workers& workers, Monitor& monitor) {
    const Stopwatch watch;
    if (!(scene.picker().total_power() > 0) || scatters(scene.media())) return std::nullopt;

    // Where the picture looks.
    ImportonPlan looks;
    looks.rays = std::clamp<std::int64_t>(settings.paths / kPathsPerRay, 64, looks.rays);
    looks.gather = settings.gather;
    looks.meter = settings.meter;
    looks.seed = settings.seed;
    const std::vector<Importon> importons = trace_importons(scene, view, looks, workers);
    if (importons.empty()) return std::nullopt;

    // What light paths bring there.
    const auto maps = pilot_maps(scene, settings, workers, monitor);
    if (monitor.stopped()) return std::nullopt;
    const std::vector<float> scores = Scorer(maps, settings, importons, workers).scores();

    // Which ones to emit.
    auto by_light = trials(scene, settings, scores);
    std::vector<double> powers;
    for (const auto& light : scene.lights()) powers.push_back(light->power());
    const auto blocks = learn_blocks(by_light, powers, {});
    Pilot pilot{EmissionPlan(scene, blocks, settings.floor)};
    pilot.importons = importons.size();
    for (const float score : scores) pilot.useful += score > 0 ? 1 : 0;
    pilot.useful /= static_cast<double>(settings.paths);
    pilot.seconds = watch.seconds();
    return pilot;
}

}  // namespace lucerna
