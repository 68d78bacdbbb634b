// The far field of a lamp: luminous intensity on the sphere of directions.
//
// A photometric file gives intensities in candela on a grid of two angles. The lamp is defined as the
// interpolant that is linear in both angles; its flux is integrated exactly and directions are drawn from it
// exactly.
//
// Directions are in the lamp's own frame, which is that of our light fields: light leaves along +z. Nadir (γ
// = 0, "down" for a hanging lamp) is therefore +z. The plane C = 0 holds +x and the plane C = 90 holds -y,
// because C angles grow counterclockwise as seen from above the lamp:
//
//     type C   d = (sin γ cos C, -sin γ sin C, cos γ)
//     type B   d = (cos H sin V, sin H, cos H cos V)         planes about a horizontal axis
//     type A   d = (cos V cos H, cos V sin H, -sin V)        elevation V over the horizon, azimuth H
//
// Each type is a grid of polar coordinates about some axis, with polar angle γ, 90° + H or 90° + V and
// azimuth C, V or H, so one class holds them all.
//
// Source: ANSI/IESNA LM-63-2002 (photometric zero and horizontal; H is clockwise seen from above, C is
// counterclockwise), EN 13032-1 (the systems of planes A, B and C).
#pragma once

#include <array>
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
    // Says why this is not a valid grid; empty if it is one.
    std::string fault() const;
};

struct PhotometricInfo {
    std::vector<std::pair<std::string, std::string>> keywords;  // in the file's order
    std::string provenance;                                     // one line
    double lamp_lumens = 0;   // of all lamps, as stated; 0: absolute photometry
    double output_ratio = 0;  // light output ratio of the luminaire, as stated, a share of 1; 0: not stated
    double watts = 0;         // electrical input; 0: not stated
    // For a web made from a light field, the difference of the two over all directions, relative to the flux.
    // It is caused by the smoothing of the grid.
    double grid_error = 0;
    double smoothed = 0;          // degrees; radius of the caps over which rays were counted; 0: none were
    LuminousOpening opening;      // without a size if none is stated
    bool axis_along_c90 = false;  // The format's length lies along C90-C270, not along C0-C180.
};

class PhotometricWeb {
  public:
    // Throws InputError naming the fault if the grid is not valid.
    explicit PhotometricWeb(PhotometricGrid grid, PhotometricInfo info = {});

    const PhotometricGrid& grid() const { return grid_; }
    const PhotometricInfo& info() const { return info_; }
    void set_opening(const LuminousOpening& opening) { info_.opening = opening; }

    // Returns the intensity towards w (unit, lamp's frame) [cd], which is 0 in directions outside the grid.
    double intensity(const V3d& w) const;
    // Returns ∫ intensity dω, exact for the interpolant [lm].
    double flux() const { return cells_.total(); }
    double peak() const { return peak_; }  // [cd]

    // The interface of a shape of a point light (shaped_point.h); values are grey, in cd.
    Rgb at(const V3f& w) const { return Rgb(static_cast<float>(intensity(V3d(w)))); }
    Rgb integral() const { return Rgb(static_cast<float>(flux())); }
    struct Drawn {
        V3f w;
        Rgb value;    // at w
        float pdf_w;  // intensity / flux > 0
    };
    // Draws in proportion to intensity. Returns none if the lamp is dark.
    std::optional<Drawn> draw(const V2f& u) const;

    // Returns the lamp's direction at the grid's coordinates [degrees].
    V3d direction(double polar, double azimuth) const;

  private:
    struct Place {
        double polar, azimuth;  // radians; azimuth relative to the grid's first, in [0, 2π)
    };
    Place place_of(const V3d& w) const;

    PhotometricGrid grid_;
    PhotometricInfo info_;
    std::vector<double> polar_, azimuth_;  // radians; azimuths relative to the first one
    V3d zero_, quarter_, pole_;            // directions of azimuth 0, of azimuth 90° and of polar angle 0
    TexelCdf cells_;  // by flux; columns are steps of azimuth, rows steps of the polar angle
    double peak_ = 0;
};

// The beam of a lamp: its brightest direction, and the full angles between the outermost directions in which
// the intensity is half of that (beam angle) and a tenth (field angle), in the planes C0-C180 and C90-C270
// through the lamp's axis, +z or -z, whichever is closer to the brightest direction [IEC TR 61341]. A beam
// reaches beyond 90 degrees from the axis only where there is no gap: light on the other side of the lamp is
// another beam.
struct Beam {
    V3d brightest{0, 0, 1};
    double peak = 0;  // [cd]
    // Degrees. 360 where the intensity is above the threshold to all sides; 0 where it is nowhere above.
    std::array<double, 2> beam_angle{}, field_angle{};
};
Beam beam_of(const PhotometricWeb& web);

// Returns the web multiplied by `factor`, which is >= 0 and finite.
PhotometricWeb scaled(const PhotometricWeb& web, double factor);

// A part of a luminaire that emits light: its web in its own frame, and the place of that frame in the
// luminaire's, whose axes are those of a lamp (light leaves downwards along +z).
struct LuminaireEmitter {
    PhotometricWeb web;
    V3d position{0, 0, 0};  // metres, of the middle of the opening
    std::array<V3d, 3> axes{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};  // orthonormal, right-handed

    V3d to_luminaire(const V3d& w) const { return w.x * axes[0] + w.y * axes[1] + w.z * axes[2]; }
    V3d to_emitter(const V3d& w) const { return {w.dot(axes[0]), w.dot(axes[1]), w.dot(axes[2])}; }
};

// Samples the emitter's light on a grid of C planes in the luminaire's frame, every `polar_step` degrees of γ
// and `azimuth_step` of C. The steps must divide 180 and 360; throws InputError if they do not.
PhotometricWeb resampled(const LuminaireEmitter& emitter, double polar_step, double azimuth_step);

// Returns the far field of the whole luminaire. That of one emitter, also if it is turned about the vertical
// axis, and the sum of several are exact, except for grids of types A and B and for emitters that are tilted,
// which are sampled every degree. The opening is the smallest body around all openings: that of the only
// emitter, or a box.
PhotometricWeb luminaire_web(const std::vector<LuminaireEmitter>& emitters);

// Places a lamp in the scene.
struct LampPlace {
    V3f position{0, 0, 0};  // of the middle of the opening, relative to the scene's origin
    LightAxes axes;         // of the lamp, in the world
    float metre = 1;        // length of a metre of the file in scene units, > 0
};

// Makes a light that shines from the luminous opening of the web's file or, if the web states none with an
// area, from a point. Its light is multiplied by the colour `scale`, which also converts candela to W/sr
// where the light counts in W. `kind` is "photometric", "ies" or "ldt".
std::unique_ptr<Light> make_photometric_light(std::string_view kind,
                                              std::shared_ptr<const PhotometricWeb> web,
                                              const LampPlace& place, const Rgb& scale,
                                              FluxUnit unit = FluxUnit::lumen);

// Returns the far field of a measured lamp's file.
using FarFieldOf = std::function<PhotometricWeb(const std::filesystem::path& lamp)>;

}  // namespace lucerna
