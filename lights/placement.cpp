#include "lights/placement.h"

namespace lucerna {

Placement::Placement(const M44d& m, const V3d& centre, const Location& at) {
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
            if (!std::isfinite(m[row][column])) throw InputError(at, "the lamp's placement is not finite");
        }
    }
    if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1) {
        throw InputError(
            at, "the lamp's placement is projective; rotation, translation and uniform scale are accepted");
    }
    for (int axis = 0; axis < 3; ++axis) axis_[axis] = V3d(m[axis][0], m[axis][1], m[axis][2]);
    scale2_ = (axis_[0].length2() + axis_[1].length2() + axis_[2].length2()) / 3;
    if (!(scale2_ > 0) || !std::isfinite(scale2_) || !std::isfinite(1 / scale2_)) {
        throw InputError(
            at, "the lamp's placement is singular; rotation, translation and uniform scale are accepted");
    }
    // Each entry of A Aᵀ against that of scale² times the identity. Mirror images are isometries too.
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            if (std::fabs(axis_[i].dot(axis_[j]) / scale2_ - (i == j ? 1 : 0)) > 1e-4) {
                input_error(
                    at,
                    "the lamp's placement shears or scales unevenly (axes of length {:g}, {:g}, {:g}); "
                    "rotation, translation and uniform scale are accepted",
                    axis_[0].length(), axis_[1].length(), axis_[2].length());
            }
        }
    }
    m.multVecMatrix(centre, origin_);
}

}  // namespace lucerna
