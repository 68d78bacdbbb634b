// What every step of a render may use.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/base/deadline.h"
#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/scene/camera.h"
#include "engine/scene/scene.h"

namespace lucerna {

// What the film shows of the scene.
struct View {
    const Camera* camera;  // not null
    V2f begin, end;        // the part of the film that is rendered, pixels, begin < end
};

// All of it outlives the step; so does the camera.
struct RenderContext {
    const Scene& scene;
    std::uint64_t seed;
    const Workers& workers;
    Monitor& monitor;
    std::optional<View> view = {};  // what the image shows; steps may work for it alone
    // By when preparations are to be done, with fewer photons or points than the settings ask for if need be.
    // What they make depends on the clock then.
    Deadline prepared = {};
    // Whether the image's samples are of two halves that are to be independent of each other: what their
    // errors come from, each has for itself.
    bool two_halves = false;

    // The same, its phases told to another monitor.
    RenderContext told_to(Monitor& other) const {
        return {scene, seed, workers, other, view, prepared, two_halves};
    }
    // The same, but for when preparations end.
    RenderContext prepared_by(const Deadline& deadline) const {
        return {scene, seed, workers, monitor, view, deadline, two_halves};
    }
};

}  // namespace lucerna
