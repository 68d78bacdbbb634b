// What surfaces are made of: the scene's description, turned into a Bsdf for each hit.
//
// Textures of colours are taken channel by channel into [0,1] where they stand for a reflectance; whatever
// they hold, no material reflects more than arrives.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>

#include "engine/base/vec.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/fresnel.h"
#include "engine/scene/texture.h"

namespace lucerna {

// How a number called roughness, in [0,1], becomes GGX's alpha.
enum class RoughnessMap : std::uint8_t {
    alpha,  // it is alpha
    v2,     // exponent 1/roughness of a Blinn lobe: the GGX whose facets spread as wide about the normal
    v3,     // pbrt-v3's polynomial in its logarithm
    v4      // its square root
};
float alpha_of(RoughnessMap map, float roughness);

// Of a surface's facets, along u and along v. What is not a number, or below 0, counts as 0.
struct Roughness {
    FloatTexture x = FloatTexture::constant(0), y = FloatTexture::constant(0);
    RoughnessMap map = RoughnessMap::alpha;

    static Roughness of_alpha(float x, float y) {
        return {FloatTexture::constant(x), FloatTexture::constant(y)};
    }
    static Roughness of_alpha(float both) { return of_alpha(both, both); }

    V2f alpha(const TexturePoint& point) const;
    // Both if neither varies: what a CoatTable needs to know of.
    std::optional<V2f> constant_alpha() const;
    bool may_be_smooth() const;
};

// Lambertian, or Oren and Nayar's where sigma (degrees) is not 0.
struct DiffuseMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.5F));
    FloatTexture sigma = FloatTexture::constant(0);
};
struct MirrorMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.9F));
};
// Defaults: copper.
struct ConductorMaterial {
    RgbTexture eta = RgbTexture::constant(Rgb(0.200F, 0.924F, 1.102F));
    RgbTexture k = RgbTexture::constant(Rgb(3.912F, 2.452F, 2.142F));
    // In place of both: at normal incidence, of a metal of eta = 1.
    std::optional<RgbTexture> reflectance = {};
    Roughness roughness = {};
};
struct DielectricMaterial {
    FloatTexture eta = FloatTexture::constant(1.5F);
    RgbTexture reflect = RgbTexture::constant(Rgb(1.0F));
    RgbTexture transmit = RgbTexture::constant(Rgb(1.0F));
    Roughness roughness = {};
};
struct ThinDielectricMaterial {
    FloatTexture eta = FloatTexture::constant(1.5F);
};
// Lambertian on both sides; what exceeds 1 in sum is scaled down.
struct DiffuseTransmissionMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.25F));
    RgbTexture transmittance = RgbTexture::constant(Rgb(0.25F));
    float scale = 1;  // of both, >= 0
};

// Varnish: its index and roughness, and what these reflect in all. Where the roughness varies the varnish
// counts as isotropic, of its smaller alpha: no table knows all brushed surfaces.
struct Coat {
    float eta = 1.5F;
    Roughness roughness = {};
    std::shared_ptr<const CoatTable> table;  // of both; not null
};
// A diffuse base seen through varnish: the varnish's reflection, and light that passes it, is scattered by
// the base as often as the varnish throws it back from within, and leaves. In closed form, where pbrt-v4
// walks at random between the two; that the light within is diffuse is the one approximation. White bases
// under varnish of one roughness reflect all that arrives.
struct CoatedDiffuseMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.5F));
    Coat coat;
};
// A metal seen through varnish; see CoatedConductorLobe. Its facets seem wider than they are, as the varnish
// bends what they reflect.
struct CoatedConductorMaterial {
    Coat coat;
    ConductorMaterial metal;
};

// The sum of a diffuse base, gloss, a smooth surface's reflection and transmission (pbrt's plastic and uber),
// all times `opacity`; the rest goes straight through. Where the parts could exceed 1 together, gloss and
// surface are scaled down to 1, and the base gets only what these leave (CoveredDiffuseLobe).
struct UberMaterial {
    RgbTexture diffuse = RgbTexture::constant(Rgb(0.25F));
    RgbTexture gloss = RgbTexture::constant(Rgb(0.25F));
    std::optional<RgbTexture> reflect = {}, transmit = {};  // none: black
    std::optional<RgbTexture> opacity = {};                 // none: 1
    FloatTexture eta = FloatTexture::constant(1.5F);
    Roughness roughness = Roughness::of_alpha(0.1F);
    std::shared_ptr<const CoatTable> table = {};  // of eta and roughness, as Coat's; null if eta varies
};
// Gloss over a diffuse base; see SubstrateBaseLobe.
struct SubstrateMaterial {
    RgbTexture diffuse = RgbTexture::constant(Rgb(0.5F));
    RgbTexture specular = RgbTexture::constant(Rgb(0.5F));
    Roughness roughness = Roughness::of_alpha(0.1F);
};
// pbrt-v3's: Lambertian on both sides and rough glass, shared out by `reflect` and `transmit`.
struct TranslucentMaterial {
    RgbTexture diffuse = RgbTexture::constant(Rgb(0.25F));
    RgbTexture gloss = RgbTexture::constant(Rgb(0.25F));
    RgbTexture reflect = RgbTexture::constant(Rgb(0.5F));
    RgbTexture transmit = RgbTexture::constant(Rgb(0.5F));
    Roughness roughness = Roughness::of_alpha(0.1F);
};
// A metal partly rough, partly smooth, by its reflectances at normal incidence (pbrt-v2's).
struct ShinyMetalMaterial {
    RgbTexture gloss = RgbTexture::constant(Rgb(1.0F));
    RgbTexture mirror = RgbTexture::constant(Rgb(1.0F));
    Roughness roughness = Roughness::of_alpha(0.1F);
};
// Not there: rays pass through (pbrt's "interface" or "").
struct InterfaceMaterial {};

struct Material;
// `share` of the second, the rest of the first; an interface as a part lets its share of the light through.
struct MixMaterial {
    std::shared_ptr<const Material> first, second;  // not null
    std::variant<FloatTexture, RgbTexture> share = FloatTexture::constant(0.5F);
};

using MaterialModel = std::variant<DiffuseMaterial, MirrorMaterial, ConductorMaterial, DielectricMaterial,
                                   ThinDielectricMaterial, DiffuseTransmissionMaterial, CoatedDiffuseMaterial,
                                   CoatedConductorMaterial, UberMaterial, SubstrateMaterial,
                                   TranslucentMaterial, ShinyMetalMaterial, MixMaterial, InterfaceMaterial>;

// What bends the shading normal without moving the surface; at most one of the two.
struct Relief {
    std::optional<FloatTexture> displacement = {};  // along the shading normal, scene units
    // Normals n in the frame of dpdu, its cross product with ns, and ns, stored as (n + 1)/2.
    std::optional<RgbTexture> normals = {};
};

struct Material {
    std::string name;
    MaterialModel model;
    Relief relief = {};
};

struct Hit;
// `origin`: world position of the scene's (0,0,0), for textures that fill space. Hits on an interface have no
// Bsdf; Scene::hit never returns them. The Bsdf refers to the material, which must outlive it.
Bsdf make_bsdf(const Material& material, const Hit& hit, const V3d& origin = V3d(0));

// The hit's shading normal bent by the relief: in ng's hemisphere, and, seen from hit.wo's side, never turned
// away from it. hit.ns where the relief is flat or says nothing (not finite, or a tangent plane that has
// collapsed).
V3f bent_normal(const Relief& relief, const Hit& hit, const TexturePoint& point);

// True if the material has a delta lobe anywhere (whether there are caustics to trace); also where only a
// look at every point of a texture could tell.
bool is_specular(const Material& material);
// True if a lobe of it may have a peak, delta or gloss; false if it scatters diffusely alone.
bool has_peak(const Material& material);
bool is_interface(const Material& material);
// True if some light may pass it in a straight line, unbent (Bsdf::straight_share()); also where only a look
// at every point of a texture could tell.
bool may_pass_straight(const Material& material);
// Whether a Bsdf of it has a diffuse part, where that is the same at all its points, whatever its textures
// hold; none: only the Bsdf tells.
std::optional<bool> has_diffuse(const Material& material);
// How many lobes a Bsdf of it has at most; more than Bsdf::kMaxLobes must not be made.
std::size_t most_lobes(const Material& material);

// From a material to the lobes of one hit; behind make_bsdf.
class LobeList {
  public:
    void add(const Lobe& lobe) { lobes_[count_++] = lobe; }
    std::span<const Lobe> all() const { return {lobes_.data(), count_}; }
    std::span<Lobe> from(std::size_t first) { return {lobes_.data() + first, count_ - first}; }
    std::size_t size() const { return count_; }

  private:
    std::array<Lobe, Bsdf::kMaxLobes> lobes_;  // most_lobes() bounds what is added
    std::size_t count_ = 0;
};

// Brought into a range; what is not a number counts as the least.
inline float in_range(float x, float least, float most) {
    return x > least ? std::min(x, most) : least;
}
inline Rgb in_range(const Rgb& c, float least, float most) {
    return {in_range(c.x, least, most), in_range(c.y, least, most), in_range(c.z, least, most)};
}
inline Rgb as_share(const Rgb& c) {
    return in_range(c, 0, 1);
}

void add_lobes(const MaterialModel& model, const TexturePoint& point, LobeList& list);

}  // namespace lucerna
