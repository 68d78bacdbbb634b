// What a lamp sends into every direction when nobody looks at it from near: luminous intensity on the sphere.
//
// A photometric file gives intensities in candela on a grid of two angles. Between its points we interpolate
// linearly in both angles, and this interpolant is the lamp: its flux is integrated exactly, and directions
// are drawn from it exactly.
//
// Directions are in the lamp's own frame, which is that of our light fields: light leaves along +z. So nadir
// (γ = 0, "down" for a lamp that hangs) is +z, the plane C = 0 holds +x, and the plane C = 90 holds -y,
// because C angles grow counterclockwise for one who looks down on the lamp:
//
//     type C   d = (sin γ cos C, -sin γ sin C, cos γ)
//     type B   d = (cos H sin V, sin H, cos H cos V)         planes about a horizontal axis
//     type A   d = (cos V cos H, cos V sin H, -sin V)        elevation V over the horizon, azimuth H
//
// Each is a grid in polar coordinates about some axis, with a polar angle of γ, 90° + H or 90° + V and an
// azimuth of C, V or H; and so one class holds them all.
//
// Source: ANSI/IESNA LM-63-2002 (photometric zero and horizontal; H is clockwise seen from above, C is
// counterclockwise), EN 13032-1 (the systems of planes A, B and C).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/vec.h"
#include "lights/image_lights.h"
#include "lights/light.h"
#include "lights/luminous_opening.h"
#include "lights/texel_cdf.h"

namespace lucerna {

enum class PhotometricPlanes : std::uint8_t { c, b, a };

struct PhotometricGrid {
    PhotometricPlanes planes = PhotometricPlanes::c;
    std::vector<double> polar;    // degrees, ascending, within [0, 180]: γ, 90 + H or 90 + V
    std::vector<double> azimuth;  // degrees, ascending, over at most 360: C, V or H
    std::vector<float> candela;   // [azimuth][polar], finite, >= 0

    float at(std::size_t azimuth_index, std::size_t polar_index) const {
        return candela[azimuth_index * polar.size() + polar_index];
    }
    // Why this is no grid, in words; empty if it is one.
    std::string fault() const;
};

struct PhotometricInfo {
    std::vector<std::pair<std::string, std::string>> keywords;  // in the file's order
    std::string provenance;                                     // one line
    double lamp_lumens = 0;   // of all lamps, as stated; 0: absolute photometry
    double output_ratio = 0;  // of the luminaire, as stated, share of 1; 0: not stated
    double watts = 0;         // input; 0: not stated
    // Of a web that was made of a light field: by how much the two differ over all directions, relative to
    // the flux. It is what the grid smooths.
    double grid_error = 0;
    LuminousOpening opening;  // without a size: none is stated
};

class PhotometricWeb {
  public:
    // Throws InputError if the grid is none, naming what is wrong.
    explicit PhotometricWeb(PhotometricGrid grid, PhotometricInfo info = {});

    const PhotometricGrid& grid() const { return grid_; }
    const PhotometricInfo& info() const { return info_; }
    void set_opening(const LuminousOpening& opening) { info_.opening = opening; }

    // Towards w (unit, lamp's frame) [cd]. 0 in directions that the grid does not hold.
    double intensity(const V3d& w) const;
    // ∫ intensity dω, exact for the interpolant [lm].
    double flux() const { return cells_.total(); }
    double peak() const { return peak_; }  // [cd]

    // The area of the luminous opening as it is seen along w (unit, lamp's frame) [m²]. A flat opening has no
    // area in its own plane, where files state a little light all the same: at least 1 % of its face. None:
    // no opening is stated.
    std::optional<double> projected_opening(const V3d& w) const;

    // How a shape of a point light is asked (shaped_point.h); values in cd, grey.
    Rgb at(const V3f& w) const { return Rgb(static_cast<float>(intensity(V3d(w)))); }
    Rgb integral() const { return Rgb(static_cast<float>(flux())); }
    struct Drawn {
        V3f w;
        Rgb value;    // at w
        float pdf_w;  // intensity / flux > 0
    };
    // In proportion to intensity. No sample: the lamp is dark.
    std::optional<Drawn> draw(const V2f& u) const;

    // The lamp's direction at a place of the grid's coordinates, degrees.
    V3d direction(double polar, double azimuth) const;

  private:
    struct Place {
        double polar, azimuth;  // radians; the azimuth from the grid's first on, in [0, 2π)
    };
    Place place_of(const V3d& w) const;

    PhotometricGrid grid_;
    PhotometricInfo info_;
    std::vector<double> polar_, azimuth_;  // radians; azimuths from the first one on
    V3d zero_, quarter_, pole_;            // of the azimuth 0, of 90°, of the polar angle 0
    TexelCdf cells_;                       // by flux: columns are steps of azimuth, rows of the polar angle
    double peak_ = 0;
};

// Multiplied by `factor` >= 0, finite.
PhotometricWeb scaled(const PhotometricWeb& web, double factor);

// The same light on another grid of C planes, point by point: every `polar_step` degrees of γ and
// `azimuth_step` of C, both dividing 180 and 360. Throws InputError for steps that do not.
PhotometricWeb resampled(const PhotometricWeb& web, double polar_step, double azimuth_step);

// The lamp as a point at `position` (relative to the scene's origin), `axes` the lamp's own in the world; all
// of its light times `scale`, a colour, which also brings its candela to W/sr where the light is to count in
// W. `kind` is "ies" or "ldt".
std::unique_ptr<Light> make_photometric_light(std::string_view kind,
                                              std::shared_ptr<const PhotometricWeb> web, const V3f& position,
                                              const LightAxes& axes, const Rgb& scale,
                                              FluxUnit unit = FluxUnit::lumen);

// The web of a measured lamp's file: its far field.
using FarFieldOf = std::function<PhotometricWeb(const std::filesystem::path& lamp)>;

}  // namespace lucerna
