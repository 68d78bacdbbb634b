// How a surface scatters: a value made for one hit, a few lobes of a closed set, no heap.
//
// All directions are unit vectors in world space and point away from the surface. `wo` is the side that is
// known (towards the eye for radiance, towards the light for particles), `wi` the other.
//
// Two normals. The geometric normal ng decides which side of the surface a direction is on, and so whether
// light is reflected or transmitted: no light leaks through a wall, however its shading normal is bent. The
// shading normal ns, turned to wo's side, shapes the lobes and gives the cosine. A direction that the two
// normals put on different sides carries nothing, except that a Lambertian surface is still seen from below
// its shading horizon.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "engine/base/vec.h"
#include "engine/scene/lobes.h"

namespace lucerna {

// What travels along the path. Radiance is compressed by η² where it enters glass; particles' power is not
// [Veach 1997, 5.2]. In numbers: let η_o and η_i be the absolute indices on wo's and on wi's side.
// Transmitted radiance arrives from wi and leaves towards wo with (1 - F) (η_o/η_i)²; particles arrive from
// wo and go on towards wi with (1 - F). So f(wo, wi, particles) = f(wi, wo, radiance).
enum class Transport : std::uint8_t { radiance, particles };

struct BsdfU {
    float lobe;  // chooses between lobes, and between reflection and transmission
    V2f direction;
};

struct BsdfSample {
    V3f wi;
    Rgb weight;         // f |cosθ_i| / pdf; of a delta lobe its share over the chance of choosing it
    float pdf_w;        // per solid angle, of all lobes that are no delta; 0 for a delta sample
    bool delta;         // a perfect mirror or smooth glass: nothing else can find this direction
    bool transmission;  // wi lies on the other side of the surface
    // What `weight` holds of the change of radiance, (η_o/η_i)² with the indices on wo's and wi's side; lets
    // roulette ignore it. 1 for particles and for reflection.
    float eta_scale = 1;
    // wi is exactly -wo, as if the surface were not there. Light passes such a surface in a straight line, so
    // a shadow ray finds what lies behind it: such an event is no bounce.
    bool straight = false;
};

// A sum of lobes. A sample comes from one of them, chosen by a cheap estimate of its albedo for wo. Delta
// lobes and others may stand side by side: f and pdf_w leave the delta ones out, and each sample says which
// of the two it is, so that multiple importance sampling weighs only what other techniques can find.
class Bsdf {
  public:
    static constexpr std::size_t kMaxLobes = 8;

    // `ns` shading normal and `ng` geometric normal, unit, in the same hemisphere. `dpdu` orients anisotropy:
    // alpha_x belongs to its part across ns. Asserts that colours lie in [0,1] and the other parameters where
    // the lobes say, and that there are at most kMaxLobes. That the sum reflects no more than arrives is the
    // caller's care. Lambertian lobes are added up into one, black ones left out.
    Bsdf(std::span<const Lobe> lobes, const V3f& ns, const V3f& ng, const V3f& dpdu);
    Bsdf(const Lobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu);
    Bsdf(const DiffuseLobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu);

    // The BSDF's value, without the cosine, without delta parts. Which side wi and wo are on is decided by
    // ng.
    Rgb f(const V3f& wo, const V3f& wi, Transport transport) const;
    // Density per solid angle of sample() choosing wi, delta parts left out (so it integrates to the chance
    // of choosing none of them). (Particles that arrive from below a Lambertian surface's shading horizon are
    // absorbed; this is the density as radiance has it.)
    float pdf_w(const V3f& wo, const V3f& wi) const;
    // No sample: the light is absorbed. A cosine of exactly 0 is absorbed by every lobe but the diffuse one.
    // A single lobe's weight is at most 1 (times eta_scale); among several one may exceed it, the mean does
    // not.
    std::optional<BsdfSample> sample(const V3f& wo, const BsdfU& u, Transport transport) const;
    // Share of the power arriving from wo that is scattered (so without any (η_o/η_i)²), delta parts
    // included, in [0,1]; the mean weight of particle samples. Exact for diffuse and smooth lobes (as long as
    // ns = ng); for rough ones a mean over 256 fixed facets, within 0.01 of the exact value (alphas 0.001 to
    // 1, any angle); some 10 microseconds.
    Rgb albedo(const V3f& wo) const;

    // Of a smooth boundary or a pane, and nothing else: the chance by which sample() reflects, as it does for
    // u.lobe below it; else it transmits. None for all other surfaces.
    std::optional<float> reflect_chance(const V3f& wo) const;

    // The share of the radiance from -wo, straight behind the surface, that goes on towards wo without being
    // bent: through panes, boundaries between equal indices and what opacity leaves. It is the mean weight of
    // the samples that are `straight`.
    Rgb straight_share(const V3f& wo) const;

    // The same as albedo(), as sample() guesses it to choose a lobe: in no time, and 0 only where nothing is
    // scattered.
    float guessed_albedo(const V3f& wo) const;

    // The same without delta parts, by the side of the surface on which it leaves.
    struct SidedAlbedo {
        Rgb reflected{0.0F}, transmitted{0.0F};
    };
    SidedAlbedo blurred_albedo(const V3f& wo) const;

    // True if all it does is delta: no direct light, no photon stored.
    bool is_delta() const;
    // True if it is exactly Lambertian: then f = albedo/π, whatever the directions on one side.
    bool is_lambertian() const { return count_ == 1 && std::holds_alternative<DiffuseLobe>(lobes_[0]); }
    // True if some light goes on to the other side.
    bool transmits() const;
    bool is_black() const { return std::holds_alternative<BlackLobe>(lobes_[0]); }

    // A split in two that add up to the whole: reflection without any peak (Lambertian, Oren-Nayar, a base
    // under varnish), for which radiance can be estimated from photons, and everything else. Same normals; a
    // black Bsdf where there is nothing.
    bool has_diffuse() const { return diffuse_ > 0; }
    bool is_diffuse() const { return diffuse_ == count_; }
    Bsdf diffuse_part() const;
    Bsdf rest() const;

    // Another split: lobes that are deltas or whose larger GGX alpha lies under `below`, and all others. With
    // below = 0 the sharp part is the deltas.
    Bsdf sharp_part(float below) const;
    Bsdf blurred_part(float below) const;

    const V3f& shading_normal() const { return frame_.n; }
    const V3f& geometric_normal() const { return ng_; }

  private:
    Bsdf(const Frame& frame, const V3f& ng) : frame_(frame), ng_(ng) {}
    Bsdf part(std::size_t begin, std::size_t end) const;
    Bsdf part_by_sharpness(float below, bool sharp) const;
    std::span<const Lobe> lobes() const { return {lobes_.data(), count_}; }

    // At least one; those of diffuse_part() come first, the Lambertian one before all, and a black one is
    // alone.
    std::array<Lobe, kMaxLobes> lobes_;
    std::size_t count_ = 1, diffuse_ = 0;
    Frame frame_;
    V3f ng_;
};

}  // namespace lucerna
