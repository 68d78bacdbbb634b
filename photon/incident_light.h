// Stores the light that arrives at one side of a surface by sectors of the hemisphere, as finely as a surface
// without a sharp specular peak needs.
//
// Irradiance suffices for a Lambertian surface that is shaded by its geometric normal, and for no other:
// light enters a varnish according to its angle, a bent normal weights light from either side differently,
// and glossy reflection depends on the direction. Here the hemisphere is divided into sectors of equal
// projected solid angle, a cap around the normal and three rings of four quadrants. The light of a sector
// counts as if all of it came from its mean direction: the error is of second order in the spread of light
// within a sector.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/base/warp.h"
#include "engine/scene/bsdf.h"
#include "photon/bounce.h"
#include "photon/photon.h"

namespace lucerna {

class IncidentLight {
  public:
    static constexpr std::size_t kRings = 3, kSectors = 1 + 4 * kRings;
    struct Sector {
        Rgb irradiance{0.0F};  // W/m²
        PackedDirection from;  // unit, towards the source
    };

    IncidentLight() = default;
    explicit IncidentLight(const std::array<Sector, kSectors>& sectors) {
        for (const Sector& sector : sectors) irradiance_ += sector.irradiance;
        for (std::size_t i = 0; i < kSectors; ++i) {
            from_[i] = sectors[i].from;
            for (std::size_t c = 0; c < 3; ++c) {
                const auto channel = static_cast<int>(c);
                const float all = irradiance_[channel];
                // Shares of 16 bits: whatever the unit, a sector's share is accurate to 1e-5 of the sum.
                shares_[i][c] = static_cast<std::uint16_t>(
                    all > 0 ? sectors[i].irradiance[channel] / all * kWhole + 0.5F : 0.0F);
            }
        }
    }

    const Rgb& irradiance() const { return irradiance_; }  // W/m²

    // Returns the radiance reflected towards wo, except by delta lobes. `n` is the geometric normal there,
    // unit, on the lit side. Light from below its horizon, gathered at a nearby place of almost the same
    // normal, counts as if it arrived along the surface.
    Rgb radiance(const Bsdf& bsdf, const V3f& wo, const V3f& n) const {
        constexpr float kLowest = 0.02F;  // sine of the angle above the surface
        Rgb sum(0.0F);
        for (std::size_t i = 0; i < kSectors; ++i) {
            const Rgb share(shares_[i][0], shares_[i][1], shares_[i][2]);
            if (is_black(share)) continue;
            V3f wi = from_[i].unpack();
            const float above = wi.dot(n);
            // The vector is never null: wi keeps its component along the surface, or it is -n and n remains.
            if (above < kLowest) wi = (wi + (kLowest - above) * n).normalized();
            sum += bsdf.f(wo, wi, Transport::radiance) * share * shading_cosine_ratio(bsdf, wi);
        }
        return sum * irradiance_ / kWhole;
    }

  private:
    static constexpr float kWhole = 65535;
    Rgb irradiance_{0.0F};
    std::array<PackedDirection, kSectors> from_;
    std::array<std::array<std::uint16_t, 3>, kSectors> shares_{};  // of each channel, times kWhole
};

// Accumulates incident light by sector.
class IncidentLightSum {
  public:
    explicit IncidentLightSum(const V3f& n) : frame_(n) {}

    // Adds light from wi, unit, on the side of n.
    void add(const Rgb& irradiance, const V3f& wi) {
        Part& part = parts_[sector_of(wi)];
        part.irradiance += irradiance;
        // Weights directions by radiance, not by irradiance, so that the effect of a bent normal on a
        // sector's light is right to first order.
        part.from += luminance(irradiance) / std::max(wi.dot(frame_.n), kFlattest) * wi;
    }
    // Adds `more`, which has the same normal, times `scale`.
    void add(const IncidentLightSum& more, float scale) {
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            parts_[i].irradiance += scale * more.parts_[i].irradiance;
            parts_[i].from += scale * more.parts_[i].from;
        }
    }

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
    static constexpr float kFlattest = 0.05F;  // cosine; flatter light is weighted as if it came at this one
    struct Part {
        Rgb irradiance{0.0F};
        V3f from{0, 0, 0};  // mean direction, by luminance; not of unit length
    };
    std::size_t sector_of(const V3f& wi) const {
        constexpr float kEach = 1.0F / IncidentLight::kSectors;  // of the square of the sine
        const float z = wi.dot(frame_.n), sine2 = 1 - z * z;
        if (sine2 < kEach) return 0;
        const auto ring =
            std::min(static_cast<std::size_t>((sine2 - kEach) / (4 * kEach)), IncidentLight::kRings - 1);
        return 1 + 4 * ring + (wi.dot(frame_.s) < 0 ? 1 : 0) + (wi.dot(frame_.t) < 0 ? 2 : 0);
    }

    Frame frame_;
    std::array<Part, IncidentLight::kSectors> parts_;
};

}  // namespace lucerna
