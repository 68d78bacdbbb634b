// Makes a light field of a lamp that is described by a formula, with a virtual rig.
//
// The virtual rig does what the optical bench does: it weights the light with the dual bell Φ̃ over each
// filter position of S and with the box of each pixel on M [Goesele 2003, 3.1], by numerical integration. A
// lamp known by its rays is projected by sums instead (ray_projection.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/image/image.h"
#include "lights/light_field.h"
#include "lights/measurement/opacity.h"

namespace lucerna {

// A flat emitter on a plane parallel to S, centred on the axis, whose radiance is known for every ray. It
// emits nothing outside its outline.
struct EmitterModel {
    enum class Outline : std::uint8_t { disc, rectangle } outline = Outline::disc;
    V2d half_size{0, 0};  // metres; for a disc, x is the radius
    double setback = 0;   // metres by which the emitter lies behind S, >= 0
    // Returns the radiance [flux unit / (m² sr)] at a point of the emitter (metres from its centre) along a
    // unit direction with d.z > 0. It should be smooth within the outline, because the quadrature resolves
    // edges only at the outline. Safe to call from many threads.
    std::function<double(const V2d& position, const V3d& direction)> radiance;
    // For an emitter of several colours, returns the CIE XYZ of the radiance, whose Y equals `radiance`. If
    // empty, all light has the colour of `info`.
    std::function<V3d(const V2d& position, const V3d& direction)> xyz;
    double flux = 0;      // total, flux unit
    LightFieldInfo info;  // colour, unit and provenance, passed on
};

// Makes an emitter of intensity ∝ cos^exponent θ, that is of radiance ∝ cos^(exponent - 1) θ, with exponent
// >= 1: 1 is Lambertian, larger is narrower. `pattern`, if given, is a function >= 0 on [-1, 1]² that
// multiplies the radiance over the emitter and is normalised so that the flux is `flux`. Throws InputError
// for sizes, flux or exponents out of range.
EmitterModel cosine_emitter(EmitterModel::Outline outline, const V2d& half_size, double flux,
                            double exponent = 1, std::function<double(const V2d&)> pattern = {});

// Colours over place and direction, in linear sRGB of luminance 1. The emitter's middle blends to `rim` with
// ρ², the mean of (x / half width)² and (y / half height)² (for a disc their sum), and the result blends to
// `grazing` with 1 - cos θ. An absent colour equals the rest.
struct ColourCourse {
    Rgb middle{1.0F};
    std::optional<Rgb> rim, grazing;

    bool varies() const { return (rim && *rim != middle) || (grazing && *grazing != middle); }
};
// Sets the emitter's colours; its luminances stay.
void set_colours(EmitterModel& emitter, const ColourCourse& colours);

class AcquirePart;

struct AcquireOptions {
    int s_nodes = 3;  // Gauss nodes per half filter spacing on S, 1 to 5
    int m_nodes = 3;  // per pixel and axis on M, Gauss nodes, 1 to 5; they smooth the emitter's pattern, too
    // Stores finished work and resumes it, for the same emitter, rig and nodes; null for none, and at ranks
    // other than 0.
    AcquirePart* part = nullptr;
};

// Returns what the rig's sensor sees behind the positive and the negative film. Ranks share the columns of M;
// rank 0 then has all of them, the others only their own. Throws InputError for an invalid rig, and when the
// user stops it.
FilterImages acquire_filters(const EmitterModel& emitter, const Rig& rig, const Workers& workers,
                             Monitor& monitor, const AcquireOptions& options = {});

// Returns field_of(acquire_filters()), the light field that the rig would measure, with an error of E of
// about 1e-4 of its largest value for smooth radiance. captured + missed is the emitter's flux. Throws as
// acquire_filters().
LightField acquire(const EmitterModel& emitter, const Rig& rig, const Workers& workers, Monitor& monitor,
                   const AcquireOptions& options = {});

// Acquires the same lamp as a canned light source [Heidrich 1998]: through a pinhole at each filter position
// instead of an optical filter, to be interpolated linearly. E is the mean over a pixel of L g at the
// filter's centre. The basis is the hat, also on M if the sensor stands still. Details finer than the spacing
// alias. The field's rig is `rig` except for its basis. Throws as acquire().
LightField acquire_without_filter(const EmitterModel& emitter, const Rig& rig, const Workers& workers,
                                  Monitor& monitor, const AcquireOptions& options = {});

// A slide projector: an evenly lit slide, and a thin lens that projects its picture.
//
// The slide lies at distance a behind the lens, which focuses it on a plane at distance b, 1/a + 1/b = 1/f. A
// ray that leaves the lens at p along d meets the plane in focus at q = p + d b/d_z. It comes from the
// slide's point -q a/b and has the radiance that the slide transmits there. The picture thus appears upright,
// with q_x to the right and q_y up, as seen towards the lens from the far side of the screen, like all images
// of screens in this project.

struct Projector {
    double aperture = 0;      // radius of the lens, metres
    double focal_length = 0;  // metres
    double focus = 0;         // b, from the lens to the plane in focus [m]; > focal_length
    double setback = 0;       // distance of the lens behind S [m]
    V2d slide_size{0, 0};     // metres
    bool inverted = false;    // the slide transmits 1 - its picture's value, per channel
    Rgb colour{1.0F};         // of the light behind the slide; linear sRGB, luminance 1
    double flux = 0;          // leaving the lens, in the unit of the emitter's info

    double slide_distance() const { return 1 / (1 / focal_length - 1 / focus); }  // a
    double magnification() const { return focus / slide_distance(); }             // b / a
};

// `picture` is the slide's transmittance of red, green and blue, in [0, 1], top row first; outside the slide
// it is dark. A grey picture makes an emitter of one colour. Throws InputError for invalid lengths, a picture
// out of range, or one that transmits no light.
EmitterModel projector_emitter(const Projector& projector, const Image& picture);

// Stores an interrupted acquisition in a file, from which the next run resumes.
//
// The file is a list of finished columns of M, each with a checksum, appended one by one, so that an abort
// loses at most the last one. A key identifies the work that it belongs to; it is useless for any other. It
// is in this machine's byte order and is deleted when the work is done.

// Throws InputError if the path is a link or anything else but a regular file, so that unfinished work is
// never written into a file that somebody else put there.
void require_own_part(const std::filesystem::path& file);

class AcquirePart {
  public:
    // Resumes the file if there is one, without damaged data at its end. Creates it if there is none or if it
    // holds no column. Throws InputError if it belongs to other work, is not ours, or cannot be written.
    AcquirePart(const std::filesystem::path& file, std::uint64_t key);

    std::size_t columns() const { return places_.size(); }  // number found in the file at the start

    // Both functions may be called from any thread. take() fills `values` and returns true if the file has
    // that column with that many values; keep() appends a column. They throw InputError if the file cannot be
    // read or written.
    bool take(int column, std::span<float> values);
    void keep(int column, std::span<const float> values);

  private:
    struct Place {
        std::uint64_t offset, count;
    };
    void begin(std::uint64_t key);
    void read_list(std::uint64_t key);

    std::filesystem::path file_;
    std::fstream stream_;
    std::map<int, Place> places_;
    std::mutex mutex_;
};

}  // namespace lucerna
