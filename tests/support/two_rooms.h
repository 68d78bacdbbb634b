// Two rooms with a lamp each, of which a camera sees one, for tests of steering towards visible regions.
#pragma once

#include "engine/guiding/importance_pre_pass.h"
#include "tests/support/scenes.h"

namespace lucerna::testing {

// Returns two rooms of 1 m with a thick wall between them, optionally with a passage; each has a lamp at its
// ceiling, and the left one optionally a ball of glass.
inline Scene two_rooms(bool passage, bool glass = true) {
    SceneMaker make;
    const auto white = make.diffuse(Rgb(0.6F, 0.5F, 0.4F));
    const float deep = passage ? 0.7F : 1.0F;
    make.quad({0, 0, 0}, {0, 0, 1}, {2.3F, 0, 0}, white);
    make.quad({0, 1, 0}, {2.3F, 0, 0}, {0, 0, 1}, white);
    make.quad({0, 0, 0}, {2.3F, 0, 0}, {0, 1, 0}, white);
    make.quad({0, 0, 1}, {0, 1, 0}, {2.3F, 0, 0}, white);
    make.quad({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, white);
    make.quad({2.3F, 0, 0}, {0, 0, 1}, {0, 1, 0}, white);
    make.quad({1, 0, 0}, {0, 1, 0}, {0, 0, deep}, white);
    make.quad({1.3F, 0, 0}, {0, 1, 0}, {0, 0, deep}, white);
    make.quad({1, 0, deep}, {0.3F, 0, 0}, {0, 1, 0}, white);
    if (glass) make.sphere({0.4F, 0.3F, 0.6F}, 0.15F, make.material(DielectricMaterial{}));
    for (const float x : {0.35F, 1.65F}) {
        make.quad_light({x, 0.98F, 0.35F}, {0.3F, 0, 0}, {0, 0, 0.3F}, make.diffuse(Rgb(0.0F)), Rgb(1, 2, 3));
    }
    return make.build();
}

// Returns a camera that looks into the left room.
inline Camera left_camera(int size = 32) {
    return camera({0.1F, 0.5F, 0.05F}, {0.5F, 0.3F, 0.9F}, size, size, 60);
}

}  // namespace lucerna::testing
