// A whole lamp as light fields around it, each of which holds the light that leaves towards one side.
//
// One pair of planes holds the light that leaves towards one side, and flat rays only far out. A lumigraph
// consists of several such slabs, each with its own planes and orientation [Levoy and Hanrahan 1996; Gortler
// et al. 1996]. A lamp that shines to all sides has six, along ±x, ±y and ±z. The radiance along a line is
// the sum over the slabs.
//
// Where slabs overlap, a line's light is shared among them by its direction d alone,
//
//     w_i(d) = max(0, d·n_i - c)² / Σ_j max(0, d·n_j - c)²                                  (SlabShares)
//
// with the slabs' normals n_i. The shares add up to 1, so no light counts twice. They are continuous, so no
// field has a visible edge where one slab ends and the next begins. They end before a slab's grazing angles,
// which planes represent badly. S and M may therefore lie where they resolve the lamp best, even with S
// inside the lamp. Light begins where its line leaves the lamp's box.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/base/vec.h"
#include "lights/light_field.h"

namespace lucerna {

// The orthonormal, right-handed axes of a slab in the lamp's frame; light leaves along n. A slab's
// Rig::centre is in the slab's own frame, which has the lamp's origin and these axes.
struct SlabAxes {
    V3d u{1, 0, 0}, v{0, 1, 0}, n{0, 0, 1};

    V3d to_lamp(const V3d& p) const { return p.x * u + p.y * v + p.z * n; }
    V3d to_slab(const V3d& p) const { return {p.dot(u), p.dot(v), p.dot(n)}; }
    bool straight() const { return u == V3d(1, 0, 0) && v == V3d(0, 1, 0); }  // the lamp's own axes
    // Says why these are not valid axes; empty if they are.
    std::string fault() const;

    // The six sides of a box, in the order +z, -z, +x, -x, +y, -y.
    static constexpr int kSides = 6;
    static SlabAxes facing(int side);
    // Returns "+z" and so on for these sides, otherwise the normal as numbers.
    std::string name() const;
};

// Shares the light of a direction among slabs.
class SlabShares {
  public:
    // The c above, if there are slabs along at least three axes: light more than 72.5° from a slab's normal
    // then belongs to the others. With fewer axes c is 0.
    static constexpr double kCut = 0.3;

    explicit SlabShares(std::vector<V3d> normals);

    std::size_t size() const { return normals_.size(); }
    // Computes the share of each slab of light towards d (unit). All are 0 where no slab holds it.
    void of(const V3d& d, std::span<double> shares) const;

  private:
    std::vector<V3d> normals_;
    double cut_ = 0;
};

struct Slab {
    SlabAxes axes;
    LightField field;
};

class Lumigraph {
  public:
    static constexpr std::size_t kMostSlabs = 64;  // ten lamps that shine to all sides

    // Makes a lamp of one slab along the lamp's own axes, without a box.
    Lumigraph(LightField field);  // NOLINT(google-explicit-constructor): a light field is a lamp of one slab
    // Throws InputError for no slabs or too many, for invalid axes or box, and for slabs of different units.
    Lumigraph(std::vector<Slab> slabs, const Box3d& box);

    std::span<const Slab> slabs() const { return slabs_; }
    std::vector<Slab>& slabs() { return slabs_; }
    // Returns true for a plain light field: one slab along the lamp's own axes.
    bool simple() const { return slabs_.size() == 1 && slabs_[0].axes.straight(); }
    // Returns the box in the lamp's frame, where lines begin; a simple lamp has none, its lines begin on S.
    const Box3d& box() const { return box_; }

    FluxUnit unit() const { return slabs_[0].field.info().unit; }
    const std::string& provenance() const { return slabs_[0].field.info().provenance; }
    double flux() const;    // Σ LightField::flux()
    bool coloured() const;  // its light has more than one colour
    // The colour of all its light: CIE XYZ with Y = 1, and linear sRGB of luminance 1.
    V3d xyz() const;
    Rgb colour() const;
    // Returns X (0), Y (1) or Z (2) alone, as LightField::channel() does.
    Lumigraph channel(int c) const;
    // Returns the luminous efficacy of the radiation of a lamp in watts; 0 if it is not known for all slabs.
    double lumens_per_watt() const;
    // Return the flux that the slabs hold, and the flux of the lamp that they do not. The first slab accounts
    // for light towards which there is no slab.
    double captured() const;
    double missed() const;

  private:
    std::vector<Slab> slabs_;
    Box3d box_;
};

std::vector<const LightField*> fields_of(const Lumigraph& lamp);

// For one light field, returns its content_hash(); for several, hashes their numbers, axes and positions.
std::uint64_t content_hash(const Lumigraph& lamp);

// A simple lumigraph is stored as a light field (light_field.h). Others have one part of the file for each
// slab, with the slab's axes and the lamp's box (version 3). Reading accepts both. Throws InputError naming
// file and cause.
void write_lumigraph(const std::filesystem::path& file, const Lumigraph& lamp);
Lumigraph read_lumigraph(const std::filesystem::path& file);

}  // namespace lucerna
