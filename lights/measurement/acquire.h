// A way into a light field: a lamp described by a formula, measured by a virtual rig.
//
// It does what the optical bench does: weighs the light with the dual bell Φ̃ over each filter position of S
// and with the box of each pixel on M [Goesele 2003, 3.1], by numerical integrals. A lamp known by its rays
// is projected by sums instead: ray_projection.h.
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

// A lamp described by a formula: a flat emitter whose radiance is known for every ray.

// A flat emitter on a plane parallel to S, centred on the axis. Nothing leaves outside its outline.
struct EmitterModel {
    enum class Outline : std::uint8_t { disc, rectangle } outline = Outline::disc;
    V2d half_size{0, 0};  // metres; of a disc, x is the radius
    double setback = 0;   // metres by which the emitter lies behind S, >= 0
    // Radiance in flux unit / (m² sr) at a point of the emitter (metres from its centre) along a unit
    // direction with d.z > 0. Should be smooth within the outline: edges are integrated over only where the
    // outline has them. Safe to call from many threads.
    std::function<double(const V2d& position, const V3d& direction)> radiance;
    // Of an emitter of several colours: CIE XYZ of the radiance, whose Y is what `radiance` says. Empty: all
    // light has the colour of `info`.
    std::function<V3d(const V2d& position, const V3d& direction)> xyz;
    double flux = 0;      // in total, flux unit
    LightFieldInfo info;  // colour, unit and provenance to pass on
};

// Intensity ∝ cos^exponent θ, that is radiance ∝ cos^(exponent - 1) θ: 1 is Lambertian, larger is narrower;
// >= 1. `pattern`, if given, multiplies the radiance over the emitter: a function >= 0 on [-1, 1]²,
// normalised so that the emitter's flux is `flux`. Throws InputError for sizes, flux or exponents out of
// range.
EmitterModel cosine_emitter(EmitterModel::Outline outline, const V2d& half_size, double flux,
                            double exponent = 1, std::function<double(const V2d&)> pattern = {});

// Colours over place and direction, linear sRGB of luminance 1: that of the emitter's middle goes over to
// `rim`'s with ρ², the mean of (x / half width)² and (y / half height)² (of a disc their sum), and that to
// `grazing`'s with 1 - cos θ. What is absent is as the rest.
struct ColourCourse {
    Rgb middle{1.0F};
    std::optional<Rgb> rim, grazing;

    bool varies() const { return (rim && *rim != middle) || (grazing && *grazing != middle); }
};
// The emitter in these colours: luminances stay.
void set_colours(EmitterModel& emitter, const ColourCourse& colours);

class AcquirePart;

struct AcquireOptions {
    int s_nodes = 3;  // Gauss nodes per half filter spacing on S, 1 to 5
    int m_nodes = 3;  // Gauss nodes per pixel and axis on M, 1 to 5; they smooth the emitter's pattern, too
    // Where finished work is kept and taken up again; may be null, and is but at rank 0. Of the same emitter,
    // rig and nodes.
    AcquirePart* part = nullptr;
};

// What the rig's sensor sees behind the positive and the negative film. Ranks share out the columns of M:
// rank 0 has all of them then, the others those that they made. Throws InputError for a rig that is none, and
// when the user stops it.
FilterImages acquire_filters(const EmitterModel& emitter, const Rig& rig, const Workers& workers,
                             Monitor& monitor, const AcquireOptions& options = {});

// field_of(acquire_filters()): the light field that the rig would measure: E to about 1e-4 of its largest
// value for smooth radiance. captured + missed = the emitter's flux. Throws InputError for a rig that is
// none, and when the user stops it.
LightField acquire(const EmitterModel& emitter, const Rig& rig, const Workers& workers, Monitor& monitor,
                   const AcquireOptions& options = {});

// The same lamp as a canned light source [Heidrich 1998]: without an optical filter, through a pinhole at
// each filter position, to be interpolated linearly: E is the mean over a pixel of L g at the filter's
// centre, the basis the hat, on M too where the sensor stands still. What is finer than the spacing is
// aliased. The field's rig is the one given but for its basis. Throws as acquire().
LightField acquire_without_filter(const EmitterModel& emitter, const Rig& rig, const Workers& workers,
                                  Monitor& monitor, const AcquireOptions& options = {});

// A slide projector: a slide, lit evenly from behind, and a thin lens that throws its picture.
//
// The lens stands at distance a behind which the slide lies, and makes it sharp on a plane at distance b,
// 1/a + 1/b = 1/f. A ray that leaves the lens at p along d pierces the sharp plane at q = p + d b/d_z; it
// comes from the slide's point -q a/b and has the radiance that the slide lets through there. So the picture
// stands upright, with q_x to the right and q_y up, for someone who looks at the lens from the screen's far
// side: as every image of this project shows a screen.

struct Projector {
    double aperture = 0;      // radius of the lens, metres
    double focal_length = 0;  // metres
    double focus = 0;         // b, from the lens to the sharp plane, metres; > focal_length
    double setback = 0;       // of the lens behind S, metres
    V2d slide_size{0, 0};     // metres
    bool inverted = false;    // the slide lets through 1 - its picture's value, of each colour
    Rgb colour{1.0F};         // of the light behind the slide, linear sRGB, luminance 1
    double flux = 0;          // that leaves the lens, in the unit of the emitter's info

    double slide_distance() const { return 1 / (1 / focal_length - 1 / focus); }  // a
    double magnification() const { return focus / slide_distance(); }             // b / a
};

// `picture` holds what the slide lets through of red, green and blue, in [0, 1], top row first; what lies
// beside the slide is dark. A grey picture makes an emitter of one colour. Throws InputError for lengths that
// are none, a picture out of range, or one without light.
EmitterModel projector_emitter(const Projector& projector, const Image& picture);

// What an acquisition that was stopped has done, kept in a file from which the next one goes on.
//
// The file is a list of finished columns of M, each with a checksum, added one by one: whatever ends the
// program, at most the last of them is lost. It names the work it belongs to by a key, and is of no use for
// any other. For this machine's byte order; thrown away when the work is done.

// Throws InputError if there is something that is no regular file, or a link: unfinished work is never kept
// in what somebody else put there.
void require_own_part(const std::filesystem::path& file);

class AcquirePart {
  public:
    // Takes up the file if there is one, without what is damaged at its end; begins it if not, or if it holds
    // no column. Throws InputError if it is of other work, none of ours, or cannot be written.
    AcquirePart(const std::filesystem::path& file, std::uint64_t key);

    std::size_t columns() const { return places_.size(); }  // found in the file at the start

    // May be called from any thread. take() fills `values` if the file has as many of that column, and says
    // whether it did; keep() adds a column. Both throw InputError if the file cannot be read or written.
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
