// Where a lamp stands in the scene: an isometry times one scale, from the lamp's frame in metres to the
// scene's.
#pragma once

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/vec.h"

namespace lucerna {

class Placement {
  public:
    // `centre`, a point of the file's frame, becomes the lamp's origin. Throws InputError at `at` for a
    // transformation that is not finite, projective, singular, or stretches unevenly.
    Placement(const M44d& world_from_file, const V3d& centre, const Location& at);

    double scale2() const { return scale2_; }
    V3d point(const Imath::V2d& on_s) const { return origin_ + on_s.x * axis_[0] + on_s.y * axis_[1]; }
    V3d point(const V3d& p) const { return origin_ + vector(p); }
    V3d vector(const V3d& v) const { return v.x * axis_[0] + v.y * axis_[1] + v.z * axis_[2]; }
    V3d to_local_vector(const V3d& v) const {
        return V3d(v.dot(axis_[0]), v.dot(axis_[1]), v.dot(axis_[2])) / scale2_;  // > 0: checked above
    }
    V3d to_local_point(const V3d& p) const { return to_local_vector(p - origin_); }
    V3d normal() const { return axis_[2] / std::sqrt(scale2_); }

  private:
    V3d axis_[3];
    V3d origin_;  // of the lamp: where `centre` went
    double scale2_ = 1;
};

inline V3f to_float(const V3d& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

}  // namespace lucerna
