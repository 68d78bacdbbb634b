// What sends photons out.
//
// A light answers three questions, one for each way in which a path can reach it [Pharr et al. 2023, 12]:
//   sample_Le         a particle leaves the light                       (photon maps, VPLs)
//   sample_Li         a direction from a point towards the light        (Monte Carlo direct light)
//   Le, Le_on_surface what a ray finds that was drawn otherwise         (the other half of MIS; the camera)
//
// Lights are few and long-lived, so they are virtual; they are constant after construction and safe to share
// between threads. Units: radiance in W/(m² sr), or cd/m² where the light counts in lumens (unit()); where a
// comment says W, lm is meant then. Lengths in scene units, which stand for metres.
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

// The cell of a measured light field from which a particle left; other lights have only one.
using CellId = std::uint32_t;
inline constexpr CellId kNoCell = 0xffffffffU;

// Uniform numbers in [0,1) for one emission, in an order that keeps stratified ones stratified.
struct LeSampleU {
    V2f position;
    V2f direction;
    std::uint32_t salt = 0;  // starts the numbers of whoever needs more than four (rejection)
};

// A particle that leaves a light.
struct LeSample {
    SurfacePoint from;
    V3f d;       // unit
    Rgb weight;  // L cosθ / pdf [W]: its mean over sample_Le() is the light's flux
    CellId cell = kNoCell;
};

// A light whose choice of directions can be restricted has parts, each named by one of its cells. A direction
// at x leads to one part; here is how probable each of the two choices makes the direction, whichever was
// made.
struct PartPdf {
    CellId part;
    float whole_pdf_w;  // density per solid angle of sample_Li() without a cell
    float part_pdf_w;   // of sample_Li() restricted to `part`
};

// Light that arrives at a point x from direction `w` if nothing stands in between.
struct LightSample {
    V3f w;           // unit, from x towards the light
    float distance;  // how far the way must be free: ends just short of the emitter; INFINITY for the sky
    Rgb weight;      // radiance / pdf_w; for a delta light the irradiance on a plane that faces it [W/m²]
    float pdf_w;     // density per solid angle with which sample_Li() chose w; 0 for a delta light
    CellId cell = kNoCell;
    std::optional<PartPdf> part = {};  // none: the light has no parts
};

// Emitted radiance along a ray that was drawn without the light in mind, with pdf_Li for the weights of MIS.
struct EmittedRadiance {
    Rgb radiance;
    float pdf_w;     // pdf_Li: density per solid angle with which sample_Li() draws this ray
    float distance;  // along the ray; INFINITY for the sky
    std::optional<PartPdf> part = {};  // none: the light has no parts
};

// The sphere that holds the scene, for lights that have no place of their own.
struct SceneSphere {
    V3f centre{0, 0, 0};
    float radius = 1;  // > 0
};

class Light {
  public:
    virtual ~Light() = default;
    Light(const Light&) = delete;
    Light& operator=(const Light&) = delete;

    // "point", "spot", "distant", "area", "infinite", "lightfield", "rayfile", "ies", "ldt" …
    virtual std::string_view kind() const = 0;
    // Whether it has no place: its light comes from directions alone.
    virtual bool is_at_infinity() const { return false; }

    // The file that its light comes from: a light field, rays, a web of candela; empty: none. For reports.
    const std::filesystem::path& file() const { return file_; }
    void set_file(const std::filesystem::path& file) { file_ = file; }

    // What its numbers count: with lm, intensity is in cd, radiance in cd/m² (luminance), irradiance in lx.
    FluxUnit unit() const { return unit_; }

    // Total flux, colour by colour, in its unit. Its luminance is what lights are chosen by.
    virtual Rgb flux() const = 0;
    double power() const { return static_cast<double>(luminance(flux())); }

    // A particle that leaves the light. No sample: nothing leaves there (a clamped cell, a dark texel).
    virtual std::optional<LeSample> sample_Le(const LeSampleU& u) const = 0;

    // The same particles, many at once: a lamp of large tables reads them so that its waits overlap. The
    // spans have the same size.
    virtual void sample_Le_many(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const {
        for (std::size_t i = 0; i < u.size(); ++i) out[i] = sample_Le(u[i]);
    }

    // A direction from x towards the light. `cell` restricts the choice to the part of the light that holds
    // this cell (the density is then that of the restricted choice). No sample: nothing arrives at x.
    virtual std::optional<LightSample> sample_Li(const V3f& x, const V2f& u,
                                                 std::optional<CellId> cell = {}) const = 0;
    // The part that holds a cell, named by one cell of its own: the same for all cells of a part. kNoCell
    // from a light that has no parts.
    virtual CellId part_of(CellId /*cell*/) const { return kNoCell; }

    // Emission along a ray from something that is not geometry of the scene: the sky, a lamp's impostor. Does
    // not look at what stands in between.
    virtual std::optional<EmittedRadiance> Le(const Ray& /*ray*/) const { return std::nullopt; }

    // Emission where a ray met the scene geometry that carries this light, at distance t, with geometric
    // normal n on the shape's own (emitting) side. `primitive`: of a mesh, its triangle there.
    virtual EmittedRadiance Le_on_surface(const Ray& /*ray*/, float t, const V3f& /*n*/,
                                          std::uint32_t /*primitive*/) const {
        return {Rgb(0), 0, t};
    }

    // Where it is and which way it shines; its power is left to whoever asks. None: it has no place (a sky),
    // or none is known.
    virtual std::optional<LightBounds> bounds() const { return std::nullopt; }
    // Bounds of its parts, with each one's share of its power; part i is named by cell i. A choice among
    // lights is then one among these parts. Empty: the light is chosen as a whole, and chooses among parts
    // itself.
    virtual std::span<const LightBounds> part_bounds() const { return {}; }
    // How much of its flux arrives at x, estimated: irradiance of a surface there that faces the light, over
    // flux() [1 / scene unit²]; what stands in between is left aside. None: nothing better is known than
    // bounds(). An estimate of 0 does not say that nothing arrives.
    virtual std::optional<float> arriving(const V3f& /*x*/) const { return std::nullopt; }

    // Of a light that is a point here, though its file states a luminous opening: that opening's area as it
    // is seen along w (unit, away from the light), m², > 0. None: no opening is stated.
    virtual std::optional<double> projected_opening(const V3f& /*w*/) const { return std::nullopt; }

    // True if only sample_Li() can find this light (point, spot, distant).
    virtual bool is_delta() const { return false; }
    // True if neither sample_Li() nor Le() nor Le_on_surface() ever answers: only particles carry this light.
    virtual bool only_particles() const { return false; }
    // True if Le() can answer; renderers ask only these.
    virtual bool has_impostor() const { return false; }

  protected:
    explicit Light(FluxUnit unit = FluxUnit::watt) : unit_(unit) {}

  private:
    FluxUnit unit_;
    std::filesystem::path file_;
};

// The shape on which a lamp is seen to shine: its glass, its bulb, its front.
//
// A light field says what travels along every line, not where on the line the light begins. Without a shape
// that is the sampling plane S. With one, the light of a line begins where the line last crosses the shape;
// lines that miss it begin on S as before, so that the lamp's flux is the same whatever shape it is given.

// Implemented where geometry is traced; constant and safe to share between threads. Positions are relative to
// the scene's origin.
class LampShape {
  public:
    virtual ~LampShape() = default;

    // Where the line through p along d (unit) crosses the shape for the last time. None: it misses the shape.
    virtual std::optional<SurfacePoint> last_crossing(const V3d& p, const V3d& d) const = 0;

    // Of its bounding box's diagonal, scene units, > 0.
    virtual float extent() const = 0;
};

}  // namespace lucerna
