#include "engine/guiding/importons.h"

#include <algorithm>
#include <optional>

#include "engine/base/sampler.h"
#include "photon/deposit.h"

namespace lucerna {
namespace {

// Beyond that what is seen is dim, or a maze of mirrors.
constexpr int kMostImportonBounces = 16;

// One camera ray and its gather rays.
class Follower {
  public:
    Follower(const Scene& scene, const ImportonParameters& parameters, std::uint32_t ray, Sampler& sampler,
             std::vector<Importon>& found)
        : scene_(scene), parameters_(parameters), ray_(ray), sampler_(sampler), found_(found) {}

    void follow(Ray ray, Rgb throughput, bool landed) {
        float squeeze = 1;
        for (int bounce = 0; bounce < kMostImportonBounces; ++bounce) {
            const auto hit = scene_.intersect(ray);
            if (!hit) return;
            const bool metered = parameters_.meter && !landed;
            const Bsdf bsdf = metered ? white(*hit) : scene_.bsdf(*hit);
            const V3f wo = -ray.d;
            if (stores_photons(bsdf)) look(*hit, bsdf.diffuse_part(), wo, throughput, landed);
            if (metered || bsdf.is_diffuse()) return;
            const auto sample = bsdf.rest().sample(wo, numbers(), Transport::radiance);
            if (!sample) return;
            throughput *= sample->weight;
            squeeze *= sample->eta_scale;  // what glass takes from radiance it gives back: no reason to end
            const float survival = std::min(1.0F, luminance(throughput) / squeeze);
            if (!(sampler_.next() < survival)) return;
            throughput /= survival;
            ray = Ray{hit->at.towards(sample->wi), sample->wi};
        }
    }

  private:
    static Bsdf white(const Hit& hit) { return Bsdf(DiffuseLobe{Rgb(1.0F)}, hit.ns, hit.at.n, hit.dpdu); }
    BsdfU numbers() { return {sampler_.next(), sampler_.next2()}; }

    void look(const Hit& hit, const Bsdf& diffuse, const V3f& wo, const Rgb& throughput, bool landed) {
        const float weight = luminance(throughput * diffuse.albedo(wo)) * kInvPi;
        if (weight > 0) {
            found_.push_back({hit.at.p, hit.at.n.dot(wo) < 0 ? -hit.at.n : hit.at.n, weight, ray_, landed});
        }
        if (landed || !parameters_.gather) return;
        const auto sample = diffuse.sample(wo, numbers(), Transport::radiance);
        if (!sample || is_black(sample->weight)) return;
        follow(Ray{hit.at.towards(sample->wi), sample->wi}, throughput * sample->weight, true);
    }

    const Scene& scene_;
    const ImportonParameters& parameters_;
    std::uint32_t ray_;
    Sampler& sampler_;
    std::vector<Importon>& found_;
};

}  // namespace

std::vector<Importon> trace_importons(const Scene& scene, const View& view,
                                      const ImportonParameters& parameters, const Workers& workers) {
    constexpr std::int64_t kGrain = 512;  // fixed, so that results do not depend on threads
    std::vector<std::vector<Importon>> chunks(
        static_cast<std::size_t>((parameters.rays + kGrain - 1) / kGrain));
    parallel_ranges(
        workers, parameters.rays, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
            for (auto i = static_cast<std::uint32_t>(begin); i < static_cast<std::uint32_t>(end); ++i) {
                Sampler sampler = Sampler::stratified(parameters.seed, Purpose::importance, 0, i);
                const V2f at = sampler.next2(), lens = sampler.next2();
                const V2f film = view.begin + at * (view.end - view.begin);
                Follower(scene, parameters, i, sampler, chunks[static_cast<std::size_t>(chunk)])
                    .follow(view.camera->ray(film, lens), Rgb(1.0F), false);
            }
        });
    std::vector<Importon> all;
    for (const auto& chunk : chunks) all.insert(all.end(), chunk.begin(), chunk.end());
    return all;
}

}  // namespace lucerna
