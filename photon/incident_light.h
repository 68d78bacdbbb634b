// Light that arrives at a surface from one side, by the part of the hemisphere that it comes from: as much of
// its directions as a surface without a sharp peak needs.
//
// Irradiance says all there is to know to a Lambertian surface that is shaded by its own normal, and to no
// other: what enters a varnish goes by the angle, a bent normal weighs light from either side differently,
// and gloss shows where it comes from. Here the hemisphere is cut into sectors of equal projected solid
// angle, a cap around the normal and a quarter of what is left to each quadrant. What arrives in one counts
// as if all of it came from its mean direction: the error is of second order in the spread of light within a
// sector.
#pragma once

#include <array>
#include <cstddef>

#include "engine/base/warp.h"
#include "engine/scene/bsdf.h"
#include "photon/bounce.h"
#include "photon/photon.h"

namespace lucerna {

class IncidentLight {
  public:
    static constexpr std::size_t kSectors = 5;
    struct Sector {
        Rgb irradiance{0.0F};  // W/m²
        PackedDirection from;  // unit, towards where it comes from
    };

    IncidentLight() = default;
    explicit IncidentLight(const std::array<Sector, kSectors>& sectors) : sectors_(sectors) {}

    // Radiance towards wo because of it, without what delta lobes do. `n`: the geometric normal there, unit,
    // on the side that is lit; light that comes from below its horizon (it was gathered at a place beside it,
    // of almost the same normal) counts as if it came along the surface.
    Rgb radiance(const Bsdf& bsdf, const V3f& wo, const V3f& n) const {
        constexpr float kLowest = 0.02F;  // sine of the angle above the surface
        Rgb sum(0.0F);
        for (const Sector& sector : sectors_) {
            if (is_black(sector.irradiance)) continue;
            V3f wi = sector.from.unpack();
            const float above = wi.dot(n);
            // No null vector: wi keeps its part along the surface, or lies along -n, and then n is what is
            // left.
            if (above < kLowest) wi = (wi + (kLowest - above) * n).normalized();
            sum += bsdf.f(wo, wi, Transport::radiance) * sector.irradiance * shading_cosine_ratio(bsdf, wi);
        }
        return sum;
    }

  private:
    std::array<Sector, kSectors> sectors_;
};

// Adds it up.
class IncidentLightSum {
  public:
    explicit IncidentLightSum(const V3f& n) : frame_(n) {}

    // From wi, unit, on n's side.
    void add(const Rgb& irradiance, const V3f& wi) {
        Part& part = parts_[sector_of(wi)];
        part.irradiance += irradiance;
        part.from += luminance(irradiance) * wi;
        total_ += irradiance;
    }
    // All of `more`, which was made for the same normal, times `scale`.
    void add(const IncidentLightSum& more, float scale) {
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            parts_[i].irradiance += scale * more.parts_[i].irradiance;
            parts_[i].from += scale * more.parts_[i].from;
        }
        total_ += scale * more.total_;
    }
    const Rgb& total() const { return total_; }  // irradiance

    IncidentLight light() const {
        std::array<IncidentLight::Sector, IncidentLight::kSectors> sectors;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            const float length2 = parts_[i].from.length2();
            const bool known = length2 > 0 && std::isfinite(length2);
            sectors[i] = {parts_[i].irradiance,
                          PackedDirection(known ? parts_[i].from.normalized() : frame_.n)};
        }
        return IncidentLight(sectors);
    }

  private:
    struct Part {
        Rgb irradiance{0.0F};
        V3f from{0, 0, 0};  // mean direction, by luminance; not of unit length
    };
    std::size_t sector_of(const V3f& wi) const {
        constexpr float kCap = 1.0F / IncidentLight::kSectors;  // square of the sine at its rim
        const float z = wi.dot(frame_.n);
        if (1 - z * z < kCap) return 0;
        return 1 + (wi.dot(frame_.s) < 0 ? 1 : 0) + (wi.dot(frame_.t) < 0 ? 2 : 0);
    }

    Frame frame_;
    std::array<Part, IncidentLight::kSectors> parts_;
    Rgb total_{0.0F};
};

}  // namespace lucerna
