// Bulk emission of particles of a measured light field.
//
// A particle consists of a cell drawn from the table, a point of its interval of S, a point of its pixel of
// M, and the line through both. Particles are made in blocks that fit the first-level cache, and every stage
// is a loop over a block, so that reads of the table and the field overlap and arithmetic uses vector
// instructions. A particle does not depend on the block in which it is made.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "engine/base/error.h"
#include "engine/base/vec.h"
#include "lights/cell_table.h"
#include "lights/field_colour.h"
#include "lights/light.h"
#include "lights/light_field.h"

namespace lucerna {

// Places a lamp in the scene: an isometry times a uniform scale, from the lamp's frame in metres to the
// scene's.
class Placement {
  public:
    // `centre`, a point of the file's frame, becomes the lamp's origin. Throws InputError at `at` for a
    // transformation that is not finite, or is projective, singular or not uniform in scale.
    Placement(const M44d& world_from_file, const V3d& centre, const Location& at);

    double scale2() const { return scale2_; }
    V3d point(const Imath::V2d& on_s) const { return origin_ + on_s.x * axis_[0] + on_s.y * axis_[1]; }
    V3d point(const V3d& p) const { return origin_ + vector(p); }
    V3d vector(const V3d& v) const { return v.x * axis_[0] + v.y * axis_[1] + v.z * axis_[2]; }
    V3d to_local_vector(const V3d& v) const {
        return V3d(v.dot(axis_[0]), v.dot(axis_[1]), v.dot(axis_[2])) / scale2_;  // > 0: constructor
    }
    V3d to_local_point(const V3d& p) const { return to_local_vector(p - origin_); }
    V3d normal() const { return axis_[2] / std::sqrt(scale2_); }

  private:
    V3d axis_[3];
    V3d origin_;  // the lamp's origin, the image of `centre`
    double scale2_ = 1;
};

inline V3f to_float(const V3d& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

// Selects how a particle is placed within its cell [Goesele 2003, 5.1, appendix B].
enum class EmissionMode : std::uint8_t { constant, exact };

class CellEmission {
  public:
    struct Settings {
        EmissionMode mode;
        double flux;   // total emitted flux [the field's unit], > 0 if anything is emitted
        float extent;  // size of S [scene units]
    };
    // Keeps references to field, colour, table and placement.
    CellEmission(const LightField& field, const FieldColour& colour, const CellTable& table,
                 const Placement& placement, const Settings& settings);

    // The spans have the same size. Requires flux > 0.
    void sample_Le_many(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const;

  private:
    struct Lanes;
    void fetch_members(Lanes& lanes, std::size_t size) const;
    void place_exactly(Lanes& lanes, std::span<const LeSampleU> u) const;
    template <typename Basis>
    void find_colours_by(Lanes& lanes, std::size_t size) const;
    template <typename Basis>
    static void draw_positive_by(Lanes& lanes, std::size_t size);
    void find_colours(Lanes& lanes, std::size_t size) const;
    void place(Lanes& lanes, std::size_t size) const;
    void emit_block(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const;

    const LightField& field_;
    const FieldColour& colour_;
    const CellTable& table_;
    const Placement& placement_;
    Settings settings_;
    V3f normal_;
};

}  // namespace lucerna
