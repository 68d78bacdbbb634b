// A whole lamp: light fields around it, each of the light that leaves towards one side.
//
// One pair of planes sees what leaves towards one side, and flat rays only far out. A lumigraph is several
// such slabs, each with its own planes and its own orientation [Levoy and Hanrahan 1996; Gortler et al.
// 1996]: a lamp that shines to all sides has six, along ±x, ±y and ±z. The radiance along a line is the sum
// of what the slabs say of it.
//
// Where slabs overlap, a line's light is shared out among them by its direction d alone,
//
//     w_i(d) = max(0, d·n_i - c)² / Σ_j max(0, d·n_j - c)²                                  (SlabShares)
//
// with the slabs' normals n_i. The shares add up to 1, so that no light counts twice; they have no steps, so
// that no field has an edge where one slab ends and the next begins, and nothing is seen there; and they end
// before a slab's grazing angles, where planes hold light badly. So S and M may lie where they resolve the
// lamp best, S even within it. The lamp's box says where its light begins: where a line leaves the box.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/base/vec.h"
#include "lights/light_field.h"

namespace lucerna {

// Which way a slab looks: its axes in the lamp's frame, orthonormal, right-handed; light leaves along n. A
// slab's Rig::centre is told in the slab's own frame: the lamp's, as seen along these axes.
struct SlabAxes {
    V3d u{1, 0, 0}, v{0, 1, 0}, n{0, 0, 1};

    V3d to_lamp(const V3d& p) const { return p.x * u + p.y * v + p.z * n; }
    V3d to_slab(const V3d& p) const { return {p.dot(u), p.dot(v), p.dot(n)}; }
    bool straight() const { return u == V3d(1, 0, 0) && v == V3d(0, 1, 0); }  // the lamp's own axes
    // Why these are no axes, in words; empty if they are.
    std::string fault() const;

    // The six sides of a box, in the order +z, -z, +x, -x, +y, -y.
    static constexpr int kSides = 6;
    static SlabAxes facing(int side);
    // "+z" and so on; of others the normal in numbers.
    std::string name() const;
};

// How the light of a direction is shared out among slabs.
class SlabShares {
  public:
    // c, where there are slabs towards at least three axes: light more than 72.5° from a slab's normal is the
    // others'. With fewer of them c is 0.
    static constexpr double kCut = 0.3;

    explicit SlabShares(std::vector<V3d> normals);

    std::size_t size() const { return normals_.size(); }
    // The shares of light towards d (unit), of as many slabs; all 0 where no slab holds it.
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
    static constexpr std::size_t kMostSlabs = 32;

    // One slab along the lamp's own axes, without a box.
    Lumigraph(LightField field);  // NOLINT(google-explicit-constructor): it is a lamp of one slab
    // Throws InputError for no slabs or too many, axes or a box that are none, and slabs of different units.
    Lumigraph(std::vector<Slab> slabs, const Box3d& box);

    std::span<const Slab> slabs() const { return slabs_; }
    std::vector<Slab>& slabs() { return slabs_; }
    // A single light field as every program knows it: one slab, straight.
    bool simple() const { return slabs_.size() == 1 && slabs_[0].axes.straight(); }
    // The lamp's frame; lines begin where they leave it. Not of a simple one, whose lines begin on S.
    const Box3d& box() const { return box_; }

    FluxUnit unit() const { return slabs_[0].field.info().unit; }
    const std::string& provenance() const { return slabs_[0].field.info().provenance; }
    double flux() const;    // Σ LightField::flux()
    bool coloured() const;  // not all its light is of one colour
    // Of all its light: CIE XYZ with Y = 1, and linear sRGB of luminance 1.
    V3d xyz() const;
    Rgb colour() const;
    // X (0), Y (1) or Z (2) alone, as LightField::channel().
    Lumigraph channel(int c) const;
    // Luminous efficacy of the radiation of a lamp in watts; 0: not known of all slabs.
    double lumens_per_watt() const;
    // What the slabs hold of the lamp's flux, and what they do not; light for which there is no slab is
    // missed by the first.
    double captured() const;
    double missed() const;

  private:
    std::vector<Slab> slabs_;
    Box3d box_;
};

std::vector<const LightField*> fields_of(const Lumigraph& lamp);

// Of one light field that of content_hash(); of several the numbers, the axes and the places of all.
std::uint64_t content_hash(const Lumigraph& lamp);

// A simple lumigraph is a light field's file (light_field.h). Others have one part for each slab, with the
// slab's axes and the lamp's box; version 3. Reading accepts both. Throws InputError naming file and cause.
void write_lumigraph(const std::filesystem::path& file, const Lumigraph& lamp);
Lumigraph read_lumigraph(const std::filesystem::path& file);

}  // namespace lucerna
