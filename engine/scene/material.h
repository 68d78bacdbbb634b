// Describes what surfaces are made of; make_bsdf() turns the description into a Bsdf for each hit.
//
// Colour textures that stand for a reflectance are clamped to [0,1] channel by channel. Whatever they hold,
// no material reflects more than arrives.
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

// Determines how a roughness in [0,1] becomes GGX's alpha.
enum class RoughnessMap : std::uint8_t {
    alpha,  // roughness is alpha
    v2,     // exponent 1/roughness of a Blinn lobe: the GGX whose facets spread as wide about the normal
    v3,     // pbrt-v3's polynomial in the logarithm of roughness
    v4      // square root of roughness
};
float alpha_of(RoughnessMap map, float roughness);

// Holds the roughness of a surface's facets along u and v. NaN and negative values count as 0.
struct Roughness {
    FloatTexture x = FloatTexture::constant(0), y = FloatTexture::constant(0);
    RoughnessMap map = RoughnessMap::alpha;

    static Roughness of_alpha(float x, float y) {
        return {FloatTexture::constant(x), FloatTexture::constant(y)};
    }
    static Roughness of_alpha(float both) { return of_alpha(both, both); }

    V2f alpha(const TexturePoint& point) const;
    // Returns both alphas if neither varies, as a CoatTable needs.
    std::optional<V2f> constant_alpha() const;
    bool may_be_smooth() const;
};

// Scatters by Lambert's law, or by Oren and Nayar's where sigma (degrees) is not 0.
struct DiffuseMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.5F));
    FloatTexture sigma = FloatTexture::constant(0);
};
struct MirrorMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.9F));
};
// The default is copper.
struct ConductorMaterial {
    RgbTexture eta = RgbTexture::constant(Rgb(0.200F, 0.924F, 1.102F));
    RgbTexture k = RgbTexture::constant(Rgb(3.912F, 2.452F, 2.142F));
    // Replaces both: the reflectance at normal incidence of a metal with eta = 1.
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
    // The transmittance of the whole pane at normal incidence, in (0,1], if its glass absorbs. No pane of an
    // index exceeds clear_pane_transmittance().
    std::optional<float> transmittance = {};
};
// Returns the transmittance at normal incidence of a pane that absorbs nothing.
inline float clear_pane_transmittance(float eta) {
    return 2 * eta / (1 + eta * eta);
}
// Scatters by Lambert's law to both sides. The colours are scaled down where their sum exceeds 1.
struct DiffuseTransmissionMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.25F));
    RgbTexture transmittance = RgbTexture::constant(Rgb(0.25F));
    float scale = 1;  // multiplies both, >= 0
};

// Describes varnish by index, roughness and total reflectance. Where the roughness varies, the varnish counts
// as isotropic with its smaller alpha, because no table covers all brushed surfaces.
struct Coat {
    float eta = 1.5F;
    Roughness roughness = {};
    std::shared_ptr<const CoatTable> table;  // made for eta and roughness; not null
};
// Models a diffuse base seen through varnish. The varnish reflects; light that passes it is scattered by the
// base each time the varnish reflects it back inside, until it leaves. This is a closed form where pbrt-v4
// walks at random between the two; the one approximation is that the light inside is diffuse. White bases
// under varnish of one roughness reflect all that arrives.
struct CoatedDiffuseMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.5F));
    Coat coat;
};
// Models a metal seen through varnish; see CoatedConductorLobe. Its facets appear wider than they are,
// because the varnish refracts the light that they reflect.
struct CoatedConductorMaterial {
    Coat coat;
    ConductorMaterial metal;
};

// Models the sum of a diffuse base, gloss, and a smooth surface's reflection and transmission (pbrt's plastic
// and uber), all times `opacity`; the rest goes straight through. Where the sum could exceed 1, gloss and
// surface are scaled down to 1, and the base gets only the remainder (CoveredDiffuseLobe).
struct UberMaterial {
    RgbTexture diffuse = RgbTexture::constant(Rgb(0.25F));
    RgbTexture gloss = RgbTexture::constant(Rgb(0.25F));
    std::optional<RgbTexture> reflect = {}, transmit = {};  // without one: black
    std::optional<RgbTexture> opacity = {};                 // without one: 1
    FloatTexture eta = FloatTexture::constant(1.5F);
    Roughness roughness = Roughness::of_alpha(0.1F);
    std::shared_ptr<const CoatTable> table = {};  // of eta and roughness, as in Coat; null if eta varies
};
// Models gloss over a diffuse base; see SubstrateBaseLobe.
struct SubstrateMaterial {
    RgbTexture diffuse = RgbTexture::constant(Rgb(0.5F));
    RgbTexture specular = RgbTexture::constant(Rgb(0.5F));
    Roughness roughness = Roughness::of_alpha(0.1F);
};
// Models pbrt-v3's translucent: Lambertian on both sides plus rough glass, weighted by `reflect` and
// `transmit`.
struct TranslucentMaterial {
    RgbTexture diffuse = RgbTexture::constant(Rgb(0.25F));
    RgbTexture gloss = RgbTexture::constant(Rgb(0.25F));
    RgbTexture reflect = RgbTexture::constant(Rgb(0.5F));
    RgbTexture transmit = RgbTexture::constant(Rgb(0.5F));
    Roughness roughness = Roughness::of_alpha(0.1F);
};
// Models pbrt-v2's shinymetal: a metal partly rough, partly smooth, given by reflectances at normal
// incidence.
struct ShinyMetalMaterial {
    RgbTexture gloss = RgbTexture::constant(Rgb(1.0F));
    RgbTexture mirror = RgbTexture::constant(Rgb(1.0F));
    Roughness roughness = Roughness::of_alpha(0.1F);
};
// Represents no surface: rays pass through (pbrt's "interface" or "").
struct InterfaceMaterial {};

struct Material;
// Weights the second by `share`, the first by 1 - share. An interface passes its share of the light.
struct MixMaterial {
    std::shared_ptr<const Material> first, second;  // not null
    std::variant<FloatTexture, RgbTexture> share = FloatTexture::constant(0.5F);
};

using MaterialModel = std::variant<DiffuseMaterial, MirrorMaterial, ConductorMaterial, DielectricMaterial,
                                   ThinDielectricMaterial, DiffuseTransmissionMaterial, CoatedDiffuseMaterial,
                                   CoatedConductorMaterial, UberMaterial, SubstrateMaterial,
                                   TranslucentMaterial, ShinyMetalMaterial, MixMaterial, InterfaceMaterial>;

// Bends the shading normal without moving the surface. At most one of the two is set.
struct Relief {
    std::optional<FloatTexture> displacement = {};  // along the shading normal, scene units
    // Holds normals n in the frame of dpdu, its cross product with ns, and ns, stored as (n + 1)/2.
    std::optional<RgbTexture> normals = {};
};

struct Material {
    std::string name;
    MaterialModel model;
    Relief relief = {};
};

struct Hit;
// `origin` is the world position of the scene's (0,0,0), for solid textures. A hit on an interface has no
// Bsdf; Scene::intersect() never returns one. The Bsdf refers to the material, which must outlive it.
Bsdf make_bsdf(const Material& material, const Hit& hit, const V3d& origin = V3d(0));

// Returns the hit's shading normal bent by the relief. It lies in ng's hemisphere and never faces away from
// hit.wo. Returns hit.ns where the relief is flat or undefined (not finite, or a degenerate tangent plane).
V3f bent_normal(const Relief& relief, const Hit& hit, const TexturePoint& point);

// Tells whether the material may have a delta lobe somewhere, so that there are caustics to trace. True also
// where only the texture's values could tell.
bool is_specular(const Material& material);
// Tells whether a lobe may have a peak, delta or gloss; false if the material scatters only diffusely.
bool has_peak(const Material& material);
bool is_interface(const Material& material);
// Tells whether some light may pass the material unbent (Bsdf::straight_share()). True also where only the
// texture's values could tell.
bool may_pass_straight(const Material& material);
// Tells whether a Bsdf of the material has a diffuse part, if that is the same everywhere, whatever its
// textures hold. Returns none if only the Bsdf can tell.
std::optional<bool> has_diffuse(const Material& material);
// Returns the largest number of lobes of a Bsdf of it, which must not exceed Bsdf::kMaxLobes.
std::size_t most_lobes(const Material& material);

// Collects the lobes of one hit from a material, for make_bsdf().
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

// Clamps to a range; NaN becomes `least`.
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
