// Selects the VPLs of a set that get a shadow ray from a shading point, and their weights.
//
// The unoccluded contribution of every VPL of the set is estimated (vpl_choice.h). Shadow rays are then
// distributed in proportion to these estimates, and a selected VPL is divided by its probability. The
// probabilities are relative to the sum of the estimates, so that they depend neither on the lamps' unit nor
// on the scene's.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "engine/scene/media_traversal.h"
#include "engine/vpl/igi_settings.h"
#include "engine/vpl/vpl_choice.h"
#include "engine/vpl/vpl_store.h"

namespace lucerna {

// Describes a place as VPLs see it. `unit` is the store's; `settings` are as with_distance() returns them.
LightReceiver light_receiver(const Vertex& vertex, const IgiSettings& settings, float unit);
LightReceiver light_receiver(const MediumVertex& vertex, const IgiSettings& settings, float unit);

// Returns the index of the set, of `sets` (a power of two), that u in [0,1) chooses: among all, or, for a
// half of the samples (0 or 1), among its half of the sets, if there are two. Products of u with powers of
// two are exact, while sums such as (u + half)/2 may be rounded up to 1.
inline std::size_t chosen_set(float u, std::optional<int> half, std::size_t sets) {
    const std::size_t among = half && sets > 1 ? sets / 2 : sets;
    const std::size_t first = among < sets ? static_cast<std::size_t>(*half) * among : 0;
    return first + static_cast<std::size_t>(u * static_cast<float>(among));
}

class IgiVpls {
  public:
    // `settings` are as with_distance() returns them. Every set was made of `paths` light paths.
    IgiVpls(const VplSets& sets, std::uint32_t paths, const IgiSettings& settings, const Workers& workers);

    // Return the number of sets, each as good as any other, and of the light paths that one set stands for.
    std::size_t sets() const { return store_.sets(); }
    std::uint32_t paths() const { return paths_; }
    std::size_t bytes() const { return store_.bytes(); }

    // Calls visit(light, scale) for some lights of the set, so that the mean of the sum of scale · value is
    // the sum over all of its lights. `place` is a Vertex or a MediumVertex; u in [0,1) chooses among lights.
    template <typename Place, typename Visit>
    void choose(const Place& place, std::size_t set, float u, Sampler& sampler, Visit&& visit) const;

  private:
    // Represents a light that may get a shadow ray.
    struct Candidate {
        std::uint32_t place;
        float weight;           // multiplies its value
        float contribution_of;  // estimated luminance at the place if the light is visible, `weight`
                                // included, in the store's unit
    };
    // Collects what the choice at a place depends on.
    template <typename Place>
    struct Query {
        const Place& place;
        const VplRange& range;
        LightReceiver at;
    };
    static constexpr std::size_t kMostCandidates = 264;
    // For each shadow ray this many lights are weighed with the BSDF, where contribution estimates lack it.
    static constexpr int kPerRay = 4;

    // Returns the estimated luminance that a light brings, given its contribution estimate.
    template <typename Place>
    float contribution_of(const Query<Place>& query, std::uint32_t place, float estimate) const;
    template <typename Place, typename Visit>
    void choose_by_threshold(const Query<Place>& query, double u, Visit&& visit) const;
    // Selects some of the candidates for shadow rays.
    template <typename Visit>
    void thin(std::span<const Candidate> candidates, const VplRange& range, float u, Visit&& visit) const;
    float chance_by_threshold(float contribution_of) const {
        return contribution_of * to_radiance_ < settings_.rr_threshold ? settings_.rr_continue : 1.0F;
    }

    IgiSettings settings_;
    VplStore store_;
    std::uint32_t paths_;
    float to_radiance_;  // converts from the store's unit
};

template <typename Place>
float IgiVpls::contribution_of(const Query<Place>& query, std::uint32_t place, float estimate) const {
    if (query.at.exact) return estimate;
    const Vpl light = store_.light(query.range, place);
    const V3f way = light.at.p - query.at.x;
    const float d2 = way.length2();  // > 0, or the estimate were 0
    const V3f w = way / std::sqrt(d2);
    return luminance(query.place.value(w) * light.contribution) * (light.towards(-w) * store_.unit() / d2);
}

template <typename Place, typename Visit>
void IgiVpls::choose_by_threshold(const Query<Place>& query, double u, Visit&& visit) const {
    SystematicSampling selection(u);
    for_each_contribution(store_, query.range, query.range.surfaces, query.range.end, query.at,
                          [&](std::uint32_t place, float estimate) {
                              const float chance =
                                  settings_.rr_threshold > 0
                                      ? chance_by_threshold(contribution_of(query, place, estimate))
                                      : 1.0F;
                              if (selection.selects(static_cast<double>(chance))) {
                                  visit(store_.light(query.range, place), 1 / chance);
                              }
                          });
}

template <typename Visit>
void IgiVpls::thin(std::span<const Candidate> candidates, const VplRange& range, float u,
                   Visit&& visit) const {
    double total = 0;
    for (const Candidate& c : candidates) total += static_cast<double>(c.contribution_of);
    const auto rays = static_cast<std::size_t>(settings_.shadow_rays);
    const bool by_share = candidates.size() > rays && total > 0;  // rays > 0
    const double sure = by_share ? total / static_cast<double>(rays) : 0;
    SystematicSampling selection(static_cast<double>(u));
    for (const Candidate& c : candidates) {
        if (!(c.contribution_of > 0)) continue;
        const float chance =
            by_share ? std::min(1.0F, static_cast<float>(static_cast<double>(c.contribution_of) / sure))
                     : 1.0F;
        if (selection.selects(static_cast<double>(chance)))
            visit(store_.light(range, c.place), c.weight / chance);
    }
}

template <typename Place, typename Visit>
void IgiVpls::choose(const Place& place, std::size_t set, float u, Sampler& sampler, Visit&& visit) const {
    const Query<Place> query{place, store_.range(set), light_receiver(place, settings_, store_.unit())};
    // Choosing among a million lights takes more random bits than a float has.
    constexpr std::size_t kCoarse = 4096;
    const double fine = static_cast<double>(u) +
                        (store_.lights() > kCoarse ? static_cast<double>(sampler.bits()) * 0x1p-56 : 0.0);
    std::array<Candidate, kMostCandidates> candidates;
    std::size_t size = 0;
    const auto add = [&](std::uint32_t at, float weight, float estimate) {
        // Rounding may select one light more than the sum of the chances, but there is always room for that.
        if (size < candidates.size())
            candidates[size++] = {at, weight, contribution_of(query, at, estimate) * weight};
    };
    if (settings_.rr_threshold > 0 || settings_.shadow_rays == 0)
        return choose_by_threshold(query, fine, visit);
    if (query.at.exact) {
        return sample_by_contribution(
            store_, query.range, query.at, settings_.shadow_rays, fine,
            [&](std::uint32_t at, float chance, float) { visit(store_.light(query.range, at), 1 / chance); });
    }
    sample_by_contribution(
        store_, query.range, query.at, kPerRay * settings_.shadow_rays, fine,
        [&](std::uint32_t at, float chance, float estimate) { add(at, 1 / chance, estimate); });
    thin(std::span(candidates).first(size), query.range, sampler.next(), visit);
}

// Returns the settings with a distance in place of the default mindist.
IgiSettings with_distance(const Scene& scene, IgiSettings settings);

}  // namespace lucerna
