// Chooses which light a point samples, and which part of it.
//
// The plain strategy chooses by power, or by a tree that knows where the lights are; within a light, the
// light itself chooses. A guide (engine/guiding/guide.h) adds a second strategy that follows the photons near
// the point. Both form one defensive mixture, p = f p_plain + (1 - f) p_guide, and every density is that of
// the whole mixture, whichever strategy drew. The estimate is therefore unbiased wherever the plain strategy
// is, and its weights are at most 1/f times the plain ones [Hesterberg 1995].
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/scene/bsdf.h"
#include "engine/scene/scene.h"
#include "lights/light.h"
#include "lights/light_tree.h"

namespace lucerna {

// Describes a distribution over lights and their parts at one point. It refers to choices kept elsewhere.
class Guide {
  public:
    struct Choice {
        std::uint32_t light;
        CellId part;  // kNoCell: the light has no parts
        float probability;
        float upto;  // cumulative probability, including this choice
    };
    // Returns the key by which choices are ordered.
    static std::uint64_t key(std::uint32_t light, CellId part) { return std::uint64_t{light} << 32 | part; }
    Guide() = default;
    // Takes choices in the order of lights and parts, each once. Their probabilities add up to 1.
    Guide(std::span<const Choice> choices, float defensive_weight)
        : choices_(choices), defensive_weight_(defensive_weight) {}

    // Tells whether the guide knows nothing: no photon is near, or none has weight. draw() requires !empty().
    bool empty() const { return choices_.empty(); }
    // Returns the choices in the order of lights and parts, each once. Their probabilities add up to 1.
    std::span<const Choice> choices() const { return choices_; }
    // Draws a choice for u in [0,1). A choice of probability 0 is never drawn.
    const Choice& draw(float u) const;
    // Returns 0 for a light or part that no photon came from.
    float probability(std::uint32_t light, CellId part) const;

    // Returns the recommended share of the plain strategy in the mixture, in [0, 1]: the share that maximises
    // the likelihood of the photons here, each judged by the others (leave-one-out). It is near 1 where the
    // photons are distributed as the plain strategy would draw, or too few to tell; near 0 where they agree;
    // and 1 without photons.
    float defensive_weight() const { return defensive_weight_; }

  private:
    std::span<const Choice> choices_;
    float defensive_weight_ = 1;
};

// Chooses lights at one point. It is cheap to copy, and the tree and the guide's choices must outlive it.
class LightChoice {
  public:
    // Chooses by power.
    LightChoice() = default;
    // Chooses by the tree at x. `n` is the normal as defined by LightTree.
    LightChoice(const LightTree& tree, const V3f& x, const V3f& n) : tree_(&tree), x_(x), n_(n) {}
    // Returns this choice mixed with a guide. `defensive_weight` in (0, 1] is the share of the plain
    // strategy; an empty guide makes it 1.
    LightChoice guided(const Guide& guide, float defensive_weight) const {
        LightChoice choice = *this;
        choice.guide_ = guide;
        choice.defensive_weight_ = guide.empty() ? 1 : defensive_weight;
        return choice;
    }

    struct Draw {
        std::uint32_t light;
        LightSample light_sample;
        float gain;   // light_sample.weight times this is radiance over the density of light and direction
        float pdf_w;  // density of light and direction, per solid angle; 0 for a delta light
    };
    // Draws a light and a direction towards it, or none if nothing arrives from there. u_light in [0,1).
    std::optional<Draw> draw(const Scene& scene, const V3f& x, float u_light, const V2f& u_place) const;

    // Returns the lights that draw() never chooses: all of them are to be sampled in addition
    // (lights/light_tree.h).
    std::span<const std::uint32_t> suns() const {
        return tree_ ? tree_->suns() : std::span<const std::uint32_t>();
    }

    // Returns the density per solid angle with which draw() would have chosen this light and this direction.
    float pdf_w(const Scene& scene, std::uint32_t light, const EmittedRadiance& seen) const;

  private:
    struct Plain {
        std::uint32_t light;
        CellId part;  // kNoCell: the light itself chooses
        float probability;
    };
    std::optional<Plain> pick_plainly(const Scene& scene, float u) const;
    // These return the density of a light and a direction towards it: that of the plain strategy, whose
    // probability `plain` holds if it drew the light, and that of the mixture.
    float plain_density(const Scene& scene, std::uint32_t light, const PartPdf& pdf,
                        const std::optional<Plain>& plain) const;
    float mixture(float plain, std::uint32_t light, const PartPdf& pdf) const;

    const LightTree* tree_ = nullptr;
    V3f x_{0, 0, 0}, n_{0, 0, 0};
    Guide guide_;
    float defensive_weight_ = 1;
};

// Tells whether there is at most one light to sample, without parts, so that all strategies choose alike.
bool nothing_to_choose(const Scene& scene);
// Tells whether any light has parts to choose among.
bool has_parts(const Scene& scene);

// Makes the plain choices of a scene, to which it refers, at surfaces and in media. It is constant and
// thread-safe.
class LightChooser {
  public:
    // With one light there is nothing that the tree could know better.
    explicit LightChooser(const Scene& scene)
        : tree_(nothing_to_choose(scene) ? nullptr : &scene.light_tree()) {}
    // At a surface seen from the side of wo.
    LightChoice at(const SurfacePoint& x, const Bsdf& bsdf, const V3f& wo) const {
        if (!tree_) return {};
        // A surface that transmits is lit from both sides.
        const V3f n = bsdf.is_diffuse() ? face_forward(x.n, wo) : V3f(0.0F);
        return {*tree_, x.p, n};
    }
    // Returns the choice where a medium scatters, which is lit from all directions.
    LightChoice at(const V3f& x) const { return tree_ ? LightChoice(*tree_, x, V3f(0.0F)) : LightChoice(); }

  private:
    const LightTree* tree_;  // null: choose by power
};

}  // namespace lucerna
