// From the shapes of a draft, in world space and double precision, to those of a scene or a prototype.
#pragma once

#include <vector>

#include "engine/base/vec.h"
#include "engine/pbrt/draft.h"
#include "engine/scene/scene.h"

namespace lucerna {

Box3d bounds_of(const DraftShapes& shapes);

// Moved to `origin`. Small meshes (and curves, and patches) of equal traits become one, so that a scene of
// many tiny shapes has few geometries; one that emits stays alone. `mesh_of` tells where each mesh went.
Shapes build_shapes(DraftShapes draft, const V3d& origin, std::vector<std::size_t>& mesh_of);

// Every object that is shown, and where, instances within objects resolved.
struct Placements {
    struct Object {
        std::size_t index;  // in the draft
        V3d centre;         // of its shapes, where the draft has them
    };
    std::vector<Object> objects;
    std::vector<Instance> instances;  // of `objects`; from where the draft has the shapes to the world
    Box3d bounds;                     // in the world
};
// Throws InputError if instances, with those within them, are more than memory holds.
Placements place_objects(const Draft& draft);

// Each object becomes a prototype around its own centre, so that float32 keeps its bits.
void build_prototypes(Draft& draft, const Placements& placements, SceneParts& parts);

}  // namespace lucerna
