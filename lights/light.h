// The interface of light sources.
//
// A light implements one query for each way in which a path can reach it [Pharr et al. 2023, 12]:
//   sample_Le         draws a particle that leaves the light          (photon maps, VPLs)
//   sample_Li         draws a direction from a point to the light     (Monte Carlo direct light)
//   Le, Le_on_surface evaluate emission along a ray drawn otherwise   (the other half of MIS; the camera)
//
// Lights are few and long-lived, so their functions are virtual. They are constant after construction and
// safe to share between threads. Radiance is in W/(m² sr), or in cd/m² where the light counts in lumens
// (unit()); comments that state W mean lm there. Lengths are in scene units, which stand for metres.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

#include "engine/base/vec.h"
#include "lights/flux_unit.h"
#include "lights/light_bounds.h"

namespace lucerna {

// Identifies a cell of a measured light field or a part of a mesh light. Other lights use kNoCell.
using CellId = std::uint32_t;
inline constexpr CellId kNoCell = 0xffffffffU;

// Holds the uniform numbers in [0,1) of one emission. Their fixed use keeps stratified numbers stratified.
struct LeSampleU {
    V2f position;
    V2f direction;
    std::uint32_t salt = 0;  // seeds further numbers for lights that need more than four (rejection sampling)
};

// Describes a particle that leaves a light.
struct LeSample {
    SurfacePoint from;
    V3f d;       // unit
    Rgb weight;  // L cosθ / pdf [W]; its mean over sample_Le() is the light's flux
    CellId cell = kNoCell;
};

// Some lights have parts, to which the choice of directions can be restricted; each part is named by one of
// its cells. A direction at x leads to exactly one part. PartPdf holds the density of that direction under
// both the unrestricted and the restricted choice, whichever of the two was made.
struct PartPdf {
    CellId part;
    float whole_pdf_w;  // density per solid angle of sample_Li() without a cell
    float part_pdf_w;   // density of sample_Li() restricted to `part`
};

// Describes the light that arrives at a point x from direction `w` if nothing occludes it.
struct LightSample {
    V3f w;           // unit, from x towards the light
    float distance;  // the length of the shadow ray, just short of the emitter; INFINITY for the sky
    Rgb weight;      // radiance / pdf_w; for a delta light the irradiance on a plane facing it [W/m²]
    float pdf_w;     // density per solid angle with which sample_Li() chose w; 0 for a delta light
    CellId cell = kNoCell;
    std::optional<PartPdf> part = {};  // empty: the light has no parts
};

// Holds the radiance emitted along a ray drawn without regard to the light, and pdf_Li for the MIS weights.
struct EmittedRadiance {
    Rgb radiance;
    float pdf_w;     // pdf_Li: density per solid angle with which sample_Li() draws this ray
    float distance;  // along the ray; INFINITY for the sky
    std::optional<PartPdf> part = {};  // empty: the light has no parts
};

// Bounds the scene, for lights at infinity.
struct SceneSphere {
    V3f centre{0, 0, 0};
    float radius = 1;  // > 0
};

class Light {
  public:
    virtual ~Light() = default;
    Light(const Light&) = delete;
    Light& operator=(const Light&) = delete;

    // "point", "spot", "distant", "area", "infinite", "lightfield", "rayfile", "photometric" …
    virtual std::string_view kind() const = 0;
    // Whether it has no place: its light comes from directions alone.
    virtual bool is_at_infinity() const { return false; }

    // Returns the file of the emission (a light field, rays, a photometric web), or an empty path; for
    // reports.
    const std::filesystem::path& file() const { return file_; }
    void set_file(const std::filesystem::path& file) { file_ = file; }

    // Returns the unit of the light's numbers. Lumens imply cd for intensity, cd/m² for radiance, lx for
    // irradiance.
    FluxUnit unit() const { return unit_; }

    // Returns the total flux per colour channel, in the light's unit. Lights are chosen by its luminance.
    virtual Rgb flux() const = 0;
    double power() const { return static_cast<double>(luminance(flux())); }

    // Draws a particle that leaves the light; none if nothing leaves there (a clamped cell, a dark texel).
    virtual std::optional<LeSample> sample_Le(const LeSampleU& u) const = 0;

    // Draws the same particles in bulk, so that a lamp with large tables can overlap its memory reads. The
    // spans have the same size.
    virtual void sample_Le_many(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const {
        for (std::size_t i = 0; i < u.size(); ++i) out[i] = sample_Le(u[i]);
    }

    // Draws a direction from x towards the light. A given `cell` restricts the choice to the part that holds
    // this cell, and the density is that of the restricted choice. Returns none if nothing arrives at x.
    virtual std::optional<LightSample> sample_Li(const V3f& x, const V2f& u,
                                                 std::optional<CellId> cell = {}) const = 0;
    // Returns the cell that names the part holding `cell`; it is the same for all cells of a part. Lights
    // without parts return kNoCell.
    virtual CellId part_of(CellId /*cell*/) const { return kNoCell; }

    // Evaluates emission along a ray from something that is not scene geometry: the sky, a lamp's impostor.
    // Occlusion is ignored.
    virtual std::optional<EmittedRadiance> Le(const Ray& /*ray*/) const { return std::nullopt; }

    // Evaluates emission where a ray meets, at distance t, the scene geometry that carries this light. n is
    // the geometric normal on the shape's own (emitting) side. `primitive` is the triangle of a mesh.
    virtual EmittedRadiance Le_on_surface(const Ray& /*ray*/, float t, const V3f& /*n*/,
                                          std::uint32_t /*primitive*/) const {
        return {Rgb(0), 0, t};
    }

    // Bounds the light's place and directions; the caller sets the power. Returns none for lights without a
    // place (a sky) or without known bounds.
    virtual std::optional<LightBounds> bounds() const { return std::nullopt; }
    // Returns the bounds of the light's parts, each with its share of the power; part i is named by cell i. A
    // choice among lights then chooses among these parts. If empty, the light is chosen as a whole and
    // chooses among its parts itself.
    virtual std::span<const LightBounds> part_bounds() const { return {}; }
    // Estimates the share of the flux that arrives at x: the irradiance of a surface at x that faces the
    // light, over flux() [1 / scene unit²], without occlusion. Returns none if nothing better than bounds()
    // is known. An estimate of 0 does not prove that nothing arrives.
    virtual std::optional<float> arriving(const V3f& /*x*/) const { return std::nullopt; }

    // Returns what a sky alone gives to an unobstructed horizontal plane [W/m²]; none for other lights.
    virtual std::optional<double> sky_irradiance() const { return std::nullopt; }

    // Returns true if only sample_Li() can find this light (point, spot, distant).
    virtual bool is_delta() const { return false; }
    // Returns true if sample_Li(), Le() and Le_on_surface() find nothing: only particles carry this light.
    virtual bool only_particles() const { return false; }
    // Returns true if Le() can find light; renderers call Le() only for these lights.
    virtual bool has_impostor() const { return false; }

  protected:
    explicit Light(FluxUnit unit = FluxUnit::watt) : unit_(unit) {}

  private:
    FluxUnit unit_;
    std::filesystem::path file_;
};

// LampShape is the shape on which a lamp is seen to shine: its glass, its bulb, its front.
//
// A light field gives the radiance along every line, but not where on the line the light begins. Without a
// shape, it begins on the sampling plane S. With one, it begins where the line last crosses the shape; lines
// that miss it still begin on S, so that the flux does not depend on the shape.

// Implementations live where geometry is traced; they are constant and safe to share between threads.
// Positions are relative to the scene's origin.
class LampShape {
  public:
    virtual ~LampShape() = default;

    // Returns where the line through p along d (unit) crosses the shape for the last time, or none.
    virtual std::optional<SurfacePoint> last_crossing(const V3d& p, const V3d& d) const = 0;

    // Returns the diagonal of the shape's bounding box [scene units], > 0.
    virtual float extent() const = 0;
};

}  // namespace lucerna
