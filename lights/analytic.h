// Analytic lights: point, spot, distant, diffuse area, constant sky. Positions are relative to the scene's
// origin and lengths in scene units. Strengths are in the unit that the light counts in: comments that state
// W mean lm with FluxUnit::lumen (W/sr is then cd, W/m² lx, W/(m² sr) cd/m²).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "lights/light.h"

namespace lucerna {

// Makes a point light; `intensity` is in W/sr.
std::unique_ptr<Light> make_point_light(const V3f& position, const Rgb& intensity,
                                        FluxUnit unit = FluxUnit::watt);

// Returns what a point source of `intensity` towards x [W/sr] sends to x; it is shared by all lights that are
// points. Returns none if the intensity is 0 or x is the light's own position.
std::optional<LightSample> sample_Li_from_point(const V3f& position, const V3f& x, const Rgb& intensity);

// Selects how a spot's intensity falls from 1 to 0, as a function of t, which is 1 where the falloff starts
// and 0 where it ends, and is linear in the cosine of the angle from the axis.
enum class SpotFalloff : std::uint8_t {
    smoothstep,  // t² (3 - 2 t), as in pbrt
    quadratic,   // t², as in glTF's KHR_lights_punctual
};
struct SpotCone {
    float degrees;        // the half-angle at which the intensity is 0
    float delta_degrees;  // the intensity is full within `degrees - delta_degrees`
    SpotFalloff falloff = SpotFalloff::smoothstep;
};
std::unique_ptr<Light> make_spot_light(const V3f& position, const V3f& axis, const Rgb& intensity,
                                       const SpotCone& cone, FluxUnit unit = FluxUnit::watt);

// Makes parallel light that travels along `direction`. `irradiance` is that of a plane facing it [W/m²].
// Photons start on a disc that covers the scene.
std::unique_ptr<Light> make_distant_light(const V3f& direction, const Rgb& irradiance,
                                          const SceneSphere& scene, FluxUnit unit = FluxUnit::watt);

// Makes the sun: a disc at infinity whose radius subtends `radius` [rad, below π/2], in the direction
// `towards`. `irradiance` is that of a plane facing it [W/m²].
std::unique_ptr<Light> make_sun_light(const V3f& towards, double radius, const Rgb& irradiance,
                                      const SceneSphere& scene, FluxUnit unit = FluxUnit::watt);

// Makes a sky of constant radiance [W/(m² sr)].
std::unique_ptr<Light> make_infinite_light(const Rgb& radiance, const SceneSphere& scene,
                                           FluxUnit unit = FluxUnit::watt);

// Shapes that can emit. They must be the very shapes that the scene holds as geometry.
struct TriangleEmitter {
    std::vector<V3f> p;
    std::vector<V3i> triangles;  // emit on the side of (p1-p0) × (p2-p0), or the other one if reversed
    bool reverse = false;
};
struct SphereEmitter {
    V3f centre;
    float radius;
    bool reverse = false;  // true: emits inwards
};
struct DiskEmitter {
    V3f centre;
    V3f n;  // unit, the emitting side (reversal already applied)
    float radius, inner_radius = 0;
};
using EmitterShape = std::variant<TriangleEmitter, SphereEmitter, DiskEmitter>;

// Makes a Lambertian emitter with constant radiances on its emitting side and on its back [W/(m² sr)].
std::unique_ptr<Light> make_area_light(EmitterShape shape, const Rgb& front, const Rgb& back,
                                       FluxUnit unit = FluxUnit::watt);
inline std::unique_ptr<Light> make_area_light(EmitterShape shape, const Rgb& radiance, bool two_sided,
                                              FluxUnit unit = FluxUnit::watt) {
    return make_area_light(std::move(shape), radiance, two_sided ? radiance : Rgb(0.0F), unit);
}
// Puts a light on geometry that lets all rays pass, so that only sample_Li() and particles find it.
std::unique_ptr<Light> make_unseen_light(std::unique_ptr<Light> light);

// Returns a particle of parallel light along `way`.n. It starts on the disc in front of the scene that covers
// it.
inline LeSample particle_from_afar(const SceneSphere& scene, const Frame& way, const V2f& u,
                                   const Rgb& weight) {
    const V2f disc = scene.radius * square_to_disc(u);
    const V3f p = scene.centre + way.to_world({disc.x, disc.y, -scene.radius});
    return LeSample{{p}, way.n, weight};
}

}  // namespace lucerna
