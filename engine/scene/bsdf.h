// Describes how a surface scatters. A Bsdf is made for one hit from a closed set of lobes, without heap
// allocation.
//
// All directions are unit vectors in world space and point away from the surface. `wo` is the known direction
// (towards the eye for radiance, towards the light for particles), `wi` the other one.
//
// The geometric normal ng decides on which side of the surface a direction lies, and so whether light is
// reflected or transmitted: no light leaks through a wall, however its shading normal is bent. The shading
// normal ns, turned to wo's side, shapes the lobes and gives the cosine. A direction that the two normals put
// on different sides carries nothing, except that a Lambertian surface is still seen from below its shading
// horizon.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "engine/base/vec.h"
#include "engine/scene/lobes.h"

namespace lucerna {

// Names the transported quantity. Radiance is compressed by η² where it enters glass; particles' power is not
// [Veach 1997, 5.2]. Let η_o and η_i be the absolute indices on wo's and on wi's side. Transmitted radiance
// arrives from wi and leaves towards wo with (1 - F) (η_o/η_i)²; particles arrive from wo and go on towards
// wi with (1 - F). Therefore f(wo, wi, particles) = f(wi, wo, radiance).
enum class Transport : std::uint8_t { radiance, particles };

struct BsdfU {
    float lobe;  // chooses between lobes, and between reflection and transmission
    V2f direction;
};

struct BsdfSample {
    V3f wi;
    Rgb weight;         // f |cosθ_i| / pdf; for a delta lobe its share over the probability of choosing it
    float pdf_w;        // per solid angle, the sum over all lobes but deltas; 0 for a delta sample
    bool delta;         // a perfect mirror or smooth glass, whose direction no other strategy can find
    bool transmission;  // wi lies on the other side of the surface
    // Holds the factor of `weight` due to the change of radiance, (η_o/η_i)² with the indices on wo's and
    // wi's side, so that Russian roulette can ignore it. 1 for particles and for reflection.
    float eta_scale = 1;
    // Says that wi is exactly -wo, as if the surface were not there. Light passes such a surface in a
    // straight line, so that a shadow ray finds what lies behind it; the event is no bounce.
    bool straight = false;
};

// A Bsdf is a sum of lobes. A sample comes from one of them, chosen by a cheap estimate of its albedo for wo.
// Delta lobes and others may be combined: f and pdf_w ignore the delta ones, and each sample tells whether it
// is a delta, so that MIS weights apply only to what other strategies can find.
class Bsdf {
  public:
    static constexpr std::size_t kMaxLobes = 8;

    // `ns` is the shading normal and `ng` the geometric normal, both unit, in the same hemisphere. `dpdu`
    // orients anisotropy: alpha_x belongs to its component perpendicular to ns. Asserts that colours lie in
    // [0,1], other parameters in their lobes' ranges, and that there are at most kMaxLobes. The caller
    // ensures that the sum reflects no more than arrives. Lambertian lobes are added up into one; black ones
    // are left out.
    Bsdf(std::span<const Lobe> lobes, const V3f& ns, const V3f& ng, const V3f& dpdu);
    Bsdf(const Lobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu);
    Bsdf(const DiffuseLobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu);

    // Returns the BSDF's value without cosine and delta lobes. ng decides on which side wi and wo lie.
    Rgb f(const V3f& wo, const V3f& wi, Transport transport) const;
    // Returns the density per solid angle with which sample() chooses wi, without delta lobes; it integrates
    // to the probability of choosing none of them. The density is that of radiance: particles from below a
    // Lambertian surface's shading horizon are absorbed, which it ignores.
    float pdf_w(const V3f& wo, const V3f& wi) const;
    // Draws wi; no sample means that the light is absorbed. Every lobe but the diffuse one absorbs light at a
    // cosine of exactly 0. A single lobe's weight is at most 1 (times eta_scale); among several lobes a
    // weight may exceed 1, but the mean does not.
    std::optional<BsdfSample> sample(const V3f& wo, const BsdfU& u, Transport transport) const;
    // Returns the share of the power from wo that is scattered (hence without any (η_o/η_i)²), delta lobes
    // included, in [0,1]; it is the mean weight of particle samples. It is exact for diffuse and smooth lobes
    // (if ns = ng). For rough ones it is a mean over 256 fixed facets, within 0.01 of the exact value (alphas
    // 0.001 to 1, any angle), and takes some 10 microseconds.
    Rgb albedo(const V3f& wo) const;

    // For a single smooth boundary or pane, returns the probability with which sample() reflects, as it does
    // for u.lobe below it; otherwise it transmits. Returns none for all other surfaces.
    std::optional<float> reflect_chance(const V3f& wo) const;

    // Returns the share of the radiance arriving from -wo, straight behind the surface, that continues
    // towards wo without being bent: through panes, boundaries between equal indices and partial opacity. It
    // is the mean weight of the samples that are `straight`.
    Rgb straight_share(const V3f& wo) const;

    // Returns the cheap estimate of albedo() by which sample() chooses a lobe. It is 0 only where nothing is
    // scattered.
    float guessed_albedo(const V3f& wo) const;

    // Returns albedo() without delta lobes, separately for each side of the surface.
    struct SidedAlbedo {
        Rgb reflected{0.0F}, transmitted{0.0F};
    };
    SidedAlbedo blurred_albedo(const V3f& wo) const;

    // Tells whether all lobes are deltas, so that neither direct light nor stored photons apply.
    bool is_delta() const;
    // Tells whether there is a single lobe, a delta: a mirror, a smooth boundary or a pane.
    bool is_single_delta() const { return count_ == 1 && is_delta(); }
    // Tells whether the BSDF is exactly Lambertian: then f = albedo/π for any two directions on one side.
    bool is_lambertian() const { return count_ == 1 && std::holds_alternative<DiffuseLobe>(lobes_[0]); }
    // Tells whether some light goes on to the other side.
    bool transmits() const;
    bool is_black() const { return std::holds_alternative<BlackLobe>(lobes_[0]); }

    // The BSDF is the sum of diffuse_part(), which reflects without any peak (Lambertian, Oren-Nayar, a base
    // under varnish) so that photons can estimate its radiance, and rest(). Both have the same normals; an
    // empty one is a black Bsdf.
    bool has_diffuse() const { return diffuse_ > 0; }
    bool is_diffuse() const { return diffuse_ == count_; }
    Bsdf diffuse_part() const;
    Bsdf rest() const;

    // The BSDF is also the sum of sharp_part(), the lobes that are deltas or whose larger GGX alpha is less
    // than `below`, and blurred_part(). With below = 0 the sharp part consists of the deltas.
    Bsdf sharp_part(float below) const;
    Bsdf blurred_part(float below) const;

    const V3f& shading_normal() const { return frame_.n; }
    const V3f& geometric_normal() const { return ng_; }

  private:
    Bsdf(const Frame& frame, const V3f& ng) : frame_(frame), ng_(ng) {}
    Bsdf part(std::size_t begin, std::size_t end) const;
    Bsdf part_by_sharpness(float below, bool sharp) const;
    std::span<const Lobe> lobes() const { return {lobes_.data(), count_}; }

    // There is at least one lobe. Those of diffuse_part() come first, the Lambertian one before all; a black
    // lobe is the only one.
    std::array<Lobe, kMaxLobes> lobes_;
    std::size_t count_ = 1, diffuse_ = 0;
    Frame frame_;
    V3f ng_;
};

}  // namespace lucerna
