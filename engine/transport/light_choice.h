// How a point chooses which light to ask, and which part of it.
//
// The plain choice is by power, or by a tree that knows where the lights are; and within a light as the light
// sees fit. A guide (engine/guiding/guide.h) adds a
// second strategy that goes by the photons near the point. The two are one mixture, p = f p_plain + (1 - f)
// p_guide, and every density is the whole mixture's, whichever strategy drew: so the estimate is unbiased
// wherever the plain choice is, with weights of at most 1/f times the plain ones [Hesterberg
// 1995].
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/scene/bsdf.h"
#include "engine/scene/scene.h"
#include "lights/light.h"
#include "lights/light_tree.h"

namespace lucerna {

// The distribution over lights and their parts at one point. Refers to choices that are kept elsewhere.
class Guide {
  public:
    struct Choice {
        std::uint32_t light;
        CellId part;  // kNoCell: the light has no parts
        float probability;
        float upto;  // its own and that of all before it
    };
    // By which choices are ordered.
    static std::uint64_t key(std::uint32_t light, CellId part) { return std::uint64_t{light} << 32 | part; }
    Guide() = default;
    // Choices in the order of lights and parts, each once; their probabilities add up to 1.
    Guide(std::span<const Choice> choices, float defensive_weight)
        : choices_(choices), defensive_weight_(defensive_weight) {}

    // Nothing to go by: no photon near, or none of any weight. draw() must not be asked then.
    bool empty() const { return choices_.empty(); }
    // In the order of lights and parts, each once; the probabilities add up to 1.
    std::span<const Choice> choices() const { return choices_; }
    // u in [0,1); a choice of probability 0 is never drawn.
    const Choice& draw(float u) const;
    // 0 for what the photons do not name.
    float probability(std::uint32_t light, CellId part) const;

    // How much of a mixture the plain choice should be, in [0, 1]: what makes the photons here most likely,
    // each judged by the others (leave-one-out). Near 1 where they are scattered as the plain choice would
    // scatter them, or too few to tell; near 0 where they agree. 1 if there are none.
    float defensive_weight() const { return defensive_weight_; }

  private:
    std::span<const Choice> choices_;
    float defensive_weight_ = 1;
};

// The choice at one point. A value; refers to the tree and to the guide's choices, which must outlive it.
class LightChoice {
  public:
    // By power.
    LightChoice() = default;
    // By the tree, at x; `n` as LightTree has it.
    LightChoice(const LightTree& tree, const V3f& x, const V3f& n) : tree_(&tree), x_(x), n_(n) {}
    // The same, mixed with a guide. `defensive_weight` in (0, 1]: the share of the plain choice; 1 if the
    // guide knows nothing.
    LightChoice guided(const Guide& guide, float defensive_weight) const {
        LightChoice choice = *this;
        choice.guide_ = guide;
        choice.defensive_weight_ = guide.empty() ? 1 : defensive_weight;
        return choice;
    }

    struct Draw {
        std::uint32_t light;
        LightSample light_sample;
        float gain;   // incident.weight times this is radiance over the density of light and direction
        float pdf_w;  // that density, per solid angle; 0 for a delta light
    };
    // None: nothing arrives from there. u in [0,1).
    std::optional<Draw> draw(const Scene& scene, const V3f& x, float u_light, const V2f& u_place) const;

    // Lights that draw() does not choose among: all are to be asked, beside what it gives
    // (lights/light_tree.h).
    std::span<const std::uint32_t> suns() const {
        return tree_ ? tree_->suns() : std::span<const std::uint32_t>();
    }

    // Density per solid angle with which draw() would have chosen this light and this direction.
    float pdf_w(const Scene& scene, std::uint32_t light, const EmittedRadiance& seen) const;

  private:
    struct Plain {
        std::uint32_t light;
        CellId part;  // kNoCell: the light chooses
        float probability;
    };
    std::optional<Plain> pick_plainly(const Scene& scene, float u) const;
    // Densities of a light and a direction towards it: by the plain choice, whose probability `plain` holds
    // if that drew; and by both strategies.
    float plain_density(const Scene& scene, std::uint32_t light, const PartPdf& pdf,
                        const std::optional<Plain>& plain) const;
    float mixture(float plain, std::uint32_t light, const PartPdf& pdf) const;

    const LightTree* tree_ = nullptr;
    V3f x_{0, 0, 0}, n_{0, 0, 0};
    Guide guide_;
    float defensive_weight_ = 1;
};

// Whether there is only one light to ask, and one without parts: then no choice is better than another.
bool nothing_to_choose(const Scene& scene);
// Whether any light has parts to choose among.
bool has_parts(const Scene& scene);

// Makes the plain choices of a scene, which it refers to, at surfaces and in media. Constant, safe to share
// between threads.
class LightChooser {
  public:
    // With one light there is nothing that the tree could know better.
    explicit LightChooser(const Scene& scene)
        : tree_(nothing_to_choose(scene) ? nullptr : &scene.light_tree()) {}
    // At a surface seen from the side of wo.
    LightChoice at(const SurfacePoint& x, const Bsdf& bsdf, const V3f& wo) const {
        if (!tree_) return {};
        // What transmits is lit from both sides.
        const V3f n = bsdf.is_diffuse() ? face_forward(x.n, wo) : V3f(0.0F);
        return {*tree_, x.p, n};
    }
    // Where a medium scatters: lit from all around.
    LightChoice at(const V3f& x) const { return tree_ ? LightChoice(*tree_, x, V3f(0.0F)) : LightChoice(); }

  private:
    const LightTree* tree_;  // null: by power
};

}  // namespace lucerna
