#include "engine/integrators/igi_places.h"

#include <cmath>

#include "engine/integrators/light_choice.h"
#include "engine/integrators/specular_chain.h"

namespace lucerna {
namespace {

// Samples of direct light at each place.
constexpr int kAsks = 4;

constexpr std::uint32_t kDirectBranch = 1;  // of a camera ray's sampler

// Camera rays, followed to the places they are shaded at.
class Looker {
  public:
    Looker(const Scene& scene, const IgiSettings& settings)
        : scene_(scene), settings_(settings), lights_(scene, settings.lights) {}

    void look(const Ray& ray, std::uint32_t number, Sampler& sampler, SeenPlaces& seen) const {
        seen.shown.push_back(0);
        if (settings_.quantity == Quantity::illuminance) {
            meter_and_shade(scene_, ray, [&](const Vertex& vertex) {
                return shade(vertex, Rgb(1), number, sampler, seen);
            });
            return;
        }
        follow(ray, number, sampler, seen);
    }

  private:
    // As follow_and_shade(), which keeps the throughput to itself.
    void follow(Ray ray, std::uint32_t number, Sampler& sampler, SeenPlaces& seen) const {
        const auto nothing = [](const MediumVertex&, const Rgb&) { return Rgb(0); };  // no medium scatters
        std::int32_t medium = scene_.media().camera;
        Rgb throughput(1);
        for (int depth = 0;; ++depth) {
            const SpecularChain chain = follow_specular(scene_, ray, medium, EmissionRule::all(),
                                                        settings_.max_specular_depth, sampler, nothing);
            seen.shown.back() += luminance(throughput * chain.emitted);
            if (!chain.hit) return;
            throughput *= chain.throughput;
            const Bsdf bsdf = scene_.bsdf(*chain.hit);
            const DirectLight shaded = shade(chain.vertex(bsdf), throughput, number, sampler, seen);
            if (!shaded.specular || depth >= settings_.max_specular_depth) return;
            throughput *= shaded.specular->weight;
            medium = medium_towards(chain.hit->media, chain.hit->at.n, shaded.specular->wi, chain.medium);
            ray = Ray{chain.hit->at.towards(shaded.specular->wi), shaded.specular->wi};
        }
    }

    DirectLight shade(const Vertex& vertex, const Rgb& throughput, std::uint32_t number, Sampler& sampler,
                      SeenPlaces& seen) const {
        const LightChoice choice = lights_.at(vertex.hit.at, vertex.bsdf, vertex.wo);
        DirectLight shaded = direct_light(scene_, vertex, sampler, choice);
        if (vertex.bsdf.is_black() || is_black(throughput)) return shaded;
        seen.places.push_back({vertex.hit, vertex.bsdf, vertex.wo, vertex.medium, throughput, number});
        Rgb direct = shaded.radiance;
        for (int i = 1; i < kAsks; ++i) {
            Sampler more = sampler.split_stratified(kDirectBranch, static_cast<std::uint32_t>(i));
            direct += direct_light(scene_, vertex, more, choice).radiance;
        }
        seen.shown.back() += luminance(throughput * direct) / static_cast<float>(kAsks);
        return shaded;
    }

    const Scene& scene_;
    const IgiSettings& settings_;
    LightChooser lights_;
};

}  // namespace

SeenPlaces see_places(const IgiSettings& settings, const PassContext& context, std::int64_t rays) {
    constexpr std::int64_t kGrain = 256;  // fixed, so that results do not depend on threads
    const Looker looker(context.scene, settings);
    std::vector<SeenPlaces> chunks(static_cast<std::size_t>((rays + kGrain - 1) / kGrain));
    const View& view = *context.view;
    parallel_ranges(
        context.workers, rays, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
            for (auto i = static_cast<std::uint32_t>(begin); i < static_cast<std::uint32_t>(end); ++i) {
                Sampler sampler = Sampler::stratified(context.seed, Purpose::importance, 0, i);
                const V2f at = sampler.next2(), lens = sampler.next2();
                const V2f film = view.begin + at * (view.end - view.begin);
                looker.look(view.camera->ray(film, lens), i, sampler,
                            chunks[static_cast<std::size_t>(chunk)]);
            }
        });
    SeenPlaces all;
    for (SeenPlaces& chunk : chunks) {
        all.places.insert(all.places.end(), chunk.places.begin(), chunk.places.end());
        all.shown.insert(all.shown.end(), chunk.shown.begin(), chunk.shown.end());
    }
    return all;
}

PlaceShading::PlaceShading(const Scene& scene, const IgiSettings& settings)
    : shading_(scene, settings, 1), scale_(settings.indirect_scale) {}

}  // namespace lucerna
