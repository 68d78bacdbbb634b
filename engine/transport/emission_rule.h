// Weights the emission of a light that a ray meets by multiple importance sampling [Veach 1997, 9].
#pragma once

#include "engine/scene/scene.h"
#include "engine/transport/lamp_set.h"
#include "engine/transport/light_choice.h"

namespace lucerna {

inline float power_heuristic(float pdf, float other) {
    // The ratio keeps squares of extreme densities from overflowing or vanishing. pdf > 0.
    const float ratio = other / pdf;
    return 1 / (1 + ratio * ratio);
}

// Determines the weight of the emission that a ray meets.
struct EmissionRule {
    enum class Kind : std::uint8_t {
        all,   // the eye's own ray, or one turned only by mirrors and glass: no other strategy finds it
        mis,   // a ray from a surface that also sampled the lights: the MIS weight of the BSDF strategy
        none,  // accounted for elsewhere
    } kind = Kind::all;
    float pdf_w = 0;     // density of the ray's direction, per solid angle; for `mis`
    LightChoice choice;  // the choice by which the surface sampled lights; for `mis`
    // Contains the lamps that have no weight on this ray, because its maker samples them separately; null:
    // none.
    const LampSet* except = nullptr;
    // These two matter after the ray has gone straight through panes: the vertex at which its direction was
    // drawn, and the distance from there to the ray's present origin in scene units.
    V3f vertex{0, 0, 0};
    float passed = 0;
    // Multiplies all emission. It is below 1 where another technique has found the rest.
    Rgb weight{1.0F};

    static EmissionRule all() { return {}; }
    static EmissionRule all_except(const LampSet* lamps) { return {Kind::all, 0, {}, lamps}; }
    static EmissionRule none() { return {Kind::none, 0, {}}; }
    static EmissionRule mis(float pdf_w, const LightChoice& choice) { return {Kind::mis, pdf_w, choice}; }
    // Returns the weight of the emission that was seen of a light.
    float share(const Scene& scene, std::uint32_t light, const EmittedRadiance& seen) const {
        if (except && except->holds(light, seen)) return 0;
        return share(kind == Kind::mis ? choice.pdf_w(scene, light, seen) : 0.0F);
    }
    // Returns the weight of emission, given the density of next_event() drawing this direction.
    float share(float light_pdf_w) const {
        switch (kind) {
            case Kind::all:
                return 1;
            case Kind::mis:
                return power_heuristic(pdf_w, light_pdf_w);
            case Kind::none:
                return 0;
        }
        return 0;
    }
    // Returns the rule after a mirror or smooth glass, beyond which next_event() cannot reach.
    EmissionRule through_specular() const { return kind == Kind::none ? none() : all(); }
    // Returns the rule of a ray that goes straight on where `ray`, which had this rule, met a pane at
    // distance t. next_event() sees through panes, so that only the ray's origin changes.
    EmissionRule behind(const Ray& ray, float t) const {
        EmissionRule rule = *this;
        if (!(passed > 0)) rule.vertex = ray.o;
        rule.passed += t;
        return rule;
    }
    EmissionRule after(const BsdfSample& sample, const Ray& ray, float t) const {
        return sample.straight ? behind(ray, t) : through_specular();
    }
    // Returns the ray from the vertex on, by which the lights' densities are computed.
    Ray whole(const Ray& ray) const { return passed > 0 ? Ray{vertex, ray.d, passed + ray.t_max} : ray; }
};

}  // namespace lucerna
