#include "engine/base/defensive.h"
#include "engine/guiding/guide.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace lucerna {
namespace {

// The BSDF's ray is traced with at least kLeastChance, and with kBlindChance where no candidate contributes.
constexpr float kLeastChance = 1.0F / 32;
constexpr float kBlindChance = 0.25F;

// Returns u moved on by i steps of the sequence that fills the square most evenly of its kind [Roberts 2018].
// Each result is uniform if u is, and all of them are well separated.
V2f step(const V2f& u, int i) {
    constexpr double kAlpha[2] = {0.75487766624669276, 0.56984029099805327};
    V2f result;
    for (int a = 0; a < 2; ++a) {
        const double x = double{u[a]} + i * kAlpha[a];
        result[a] = std::min(static_cast<float>(x - std::floor(x)), kBelowOne);
    }
    return result;
}

// Holds the sum over several candidates of the lights' strategy, and the one that is kept.
struct Candidates {
    float sum = 0;               // luminances of their unoccluded light, MIS weights included
    float missing = 0;           // what MIS leaves to the BSDF's strategy in the same directions
    Rgb kept{0.0F};              // unoccluded light of the kept one
    LightSample light_sample{};  // of the kept one
    std::uint32_t light = 0;     // of the kept one

    // Returns the unoccluded radiance. On average over the kept candidate, it is the mean of all `count`.
    Rgb radiance(int count) const { return kept * (sum / (luminance(kept) * static_cast<float>(count))); }
    // Returns the share of the light that the BSDF's strategy is expected to find. NaN if that is not finite.
    float left_to_bsdf() const { return missing / (sum + missing); }
};

// Draws the candidates at one vertex, by number. The same number always draws the same candidate.
class Draws {
  public:
    Draws(const Scene& scene, const Vertex& vertex, const LightChoice& choice, int count, Sampler& sampler)
        : scene_(scene),
          vertex_(vertex),
          choice_(choice),
          count_(static_cast<float>(count)),
          u_light_(sampler.next()),
          u_place_(sampler.next2()) {}

    struct One {
        Rgb value;
        LightChoice::Draw drawn;
    };
    std::optional<One> operator[](int i) const {
        // There is one candidate in each of `count` equal strata of the choice.
        const float u = std::min((static_cast<float>(i) + u_light_) / count_, kBelowOne);
        const auto drawn = choice_.draw(scene_, vertex_.hit.at.p, u, step(u_place_, i));
        if (!drawn) return std::nullopt;
        return One{unshadowed(vertex_, *drawn), *drawn};
    }

  private:
    const Scene& scene_;
    const Vertex& vertex_;
    const LightChoice& choice_;
    float count_, u_light_;
    V2f u_place_;
};

Candidates draw_candidates(const Scene& scene, const Vertex& vertex, const LightChoice& choice, int count,
                           Sampler& sampler) {
    assert(count >= 1 && count <= GuidedLightSettings::kMostCandidates);
    const Draws draws(scene, vertex, choice, count, sampler);
    const float u_keep = sampler.next();
    Candidates all;
    std::array<float, GuidedLightSettings::kMostCandidates> upto;
    for (int i = 0; i < count; ++i) {
        if (const auto one = draws[i]) {
            if (one->drawn.pdf_w > 0) {
                const float ratio =
                    vertex.bsdf.pdf_w(vertex.wo, one->drawn.light_sample.w) / one->drawn.pdf_w;
                all.missing += luminance(one->value) * ratio * ratio;  // power heuristic: shares 1 : ratio²
            }
            const float y = luminance(one->value);
            if (y > 0 && std::isfinite(y)) all.sum += y;
        }
        upto[static_cast<std::size_t>(i)] = all.sum;
    }
    if (!(all.sum > 0)) return all;

    // One candidate is kept in proportion to its luminance. Candidates are in the order of lights and their
    // parts, so that u_keep, well distributed over a pixel's samples, distributes the kept ones over the
    // lights.
    const auto end = upto.begin() + count;
    const auto found = std::upper_bound(upto.begin(), end, u_keep * all.sum);
    // Rounding may lead past the last candidate that counts, which is then kept.
    const auto kept = found != end ? found : std::lower_bound(upto.begin(), end, all.sum);
    const auto one = draws[static_cast<int>(kept - upto.begin())];
    all.kept = one->value;  // drawn above with a value; the second draw is identical
    all.light_sample = one->drawn.light_sample;
    all.light = one->drawn.light;
    return all;
}

// Returns the probability of tracing the BSDF's ray. Where lights look small (the ratio t of the densities is
// small), that strategy brings a share t² with a variance of t³, so that a probability of t adds no more than
// t². Only diffuse surfaces use it: elsewhere the ray may find what no candidate can.
float bsdf_chance(const Vertex& vertex, const Candidates& all) {
    if (!vertex.bsdf.is_diffuse()) return 1;
    if (!(all.sum > 0)) return kBlindChance;
    const float left = all.left_to_bsdf();
    return left < 1 ? std::max(std::sqrt(left), kLeastChance) : 1.0F;  // 1 for NaN, too
}

}  // namespace

int candidates_that_pay(const Scene& scene) {
    // These lights have parts among which the tree does not choose.
    const bool fields = std::any_of(scene.lights().begin(), scene.lights().end(), [](const auto& light) {
        return light->part_of(0) != kNoCell && light->part_bounds().empty();
    });
    return fields ? 16 : 4;
}

std::optional<BsdfSample> gated_light(const Scene& scene, const GuideMap& guides, const Vertex& vertex,
                                      Sampler& sampler, const LightChoice& plain, const PathAccount& path) {
    if (guides.any_near(vertex.hit.at.p, vertex.normal()))
        return direct_light(scene, vertex, sampler, plain, path);
    if (vertex.bsdf.is_diffuse()) return std::nullopt;
    const BsdfU u{sampler.next(), sampler.next2()};
    const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
    return sample && sample->delta ? sample : std::nullopt;
}

std::optional<BsdfSample> GuidedLight::operator()(const Vertex& vertex, Sampler& sampler,
                                                  const LightChoice& plain, const PathAccount& path) const {
    const SurfacePoint& x = vertex.hit.at;
    const Guide guide = guides_.at(x.p, vertex.normal());
    const LightChoice choice = plain.guided(guide, std::max(kDefensiveWeight, guide.defensive_weight()));

    // Sample the lights.
    const Candidates all = draw_candidates(scene_, vertex, choice, settings_.candidates, sampler);
    if (all.sum > 0) {
        // On average over the kept candidate, each light gets its own contribution.
        path.add_direct(
            all.radiance(settings_.candidates) * transmitted_share(scene_, vertex, all.light_sample, sampler),
            all.light);
    }
    for (const std::uint32_t sun : choice.suns()) {
        if (const auto from_sun = sunlight(scene_, vertex, sun, sampler))
            path.add_direct(from_sun->radiance, sun);
    }

    // Sample the BSDF.
    const BsdfU u{sampler.next(), sampler.next2()};
    const float u_trace = sampler.next();
    const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
    if (!sample || sample->delta) return sample;
    const float chance = bsdf_chance(vertex, all);
    if (u_trace < chance)
        add_emission_towards(scene_, vertex, *sample, choice, sampler, path.times(1 / chance));
    return std::nullopt;
}

}  // namespace lucerna
