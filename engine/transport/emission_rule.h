// Multiple importance sampling of emission [Veach 1997, 9]: what a light counts for where a ray meets it.
#pragma once

#include "engine/scene/scene.h"
#include "engine/transport/lamp_set.h"
#include "engine/transport/light_choice.h"

namespace lucerna {

inline float power_heuristic(float pdf, float other) {
    // As a ratio, so that squares of extreme densities neither overflow nor vanish. pdf > 0.
    const float ratio = other / pdf;
    return 1 / (1 + ratio * ratio);
}

// What emission at the end of a ray counts for.
struct EmissionRule {
    enum class Kind : std::uint8_t {
        all,   // the eye's own ray, or one that only mirrors and glass have turned: nothing else finds it
        mis,   // a ray from a surface that also asked the lights: the share of the BSDF's strategy
        none,  // accounted for elsewhere
    } kind = Kind::all;
    float pdf_w = 0;     // with which the ray's direction was drawn; for `mis`
    LightChoice choice;  // by which the surface asked the lights; for `mis`
    // Lamps that count nothing on this ray, because whoever made it samples them separately; null: none.
    const LampSet* but = nullptr;
    // The vertex whose direction the density belongs to, where the ray has gone straight on through panes
    // since, and how far it has come from there to where it begins now, scene units.
    V3f vertex{0, 0, 0};
    float passed = 0;
    // Multiplies all emission. Below 1 where another technique has brought the rest of it.
    Rgb weight{1.0F};

    static EmissionRule all() { return {}; }
    static EmissionRule all_but(const LampSet* lamps) { return {Kind::all, 0, {}, lamps}; }
    static EmissionRule none() { return {Kind::none, 0, {}}; }
    static EmissionRule mis(float pdf_w, const LightChoice& choice) { return {Kind::mis, pdf_w, choice}; }
    // The share of what was seen of a light that counts.
    float share(const Scene& scene, std::uint32_t light, const EmittedRadiance& seen) const {
        if (but && but->holds(light, seen)) return 0;
        return share(kind == Kind::mis ? choice.pdf_w(scene, light, seen) : 0.0F);
    }
    // The share of emission that counts, given the density with which next_event() would have drawn this
    // direction.
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
    // After a mirror or smooth glass: next_event before it could not reach beyond.
    EmissionRule through_specular() const { return kind == Kind::none ? none() : all(); }
    // Of a ray that goes straight on where `ray`, which had this rule, met a pane at distance t: next_event
    // sees through panes, so nothing changes but where the ray begins.
    EmissionRule behind(const Ray& ray, float t) const {
        EmissionRule rule = *this;
        if (!(passed > 0)) rule.vertex = ray.o;
        rule.passed += t;
        return rule;
    }
    EmissionRule after(const BsdfSample& sample, const Ray& ray, float t) const {
        return sample.straight ? behind(ray, t) : through_specular();
    }
    // The ray from the vertex on. Lights' densities go by it.
    Ray whole(const Ray& ray) const { return passed > 0 ? Ray{vertex, ray.d, passed + ray.t_max} : ray; }
};

}  // namespace lucerna
