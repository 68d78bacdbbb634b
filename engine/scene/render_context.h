// Provides what every step of a render needs.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/base/deadline.h"
#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/scene/camera.h"
#include "engine/scene/scene.h"

namespace lucerna {

// Holds the camera and the part of the film that an image shows.
struct View {
    const Camera* camera;  // not null
    V2f begin, end;        // the part of the film that is rendered, pixels; begin < end
};

// Everything that it refers to outlives the step; so does the camera.
struct RenderContext {
    const Scene& scene;
    std::uint64_t seed;
    const Workers& workers;
    Monitor& monitor;
    std::optional<View> view = {};  // the image's view; steps may work for it alone
    // Limits the time of preparations, which use fewer photons or points than the settings ask for if need
    // be. Their results then depend on the clock.
    Deadline prepared = {};
    // Says whether the image's samples form two independent halves, which share nothing that causes errors.
    bool two_halves = false;

    // Returns this context with another monitor, to which its phases are reported.
    RenderContext with_monitor(Monitor& other) const {
        return {scene, seed, workers, other, view, prepared, two_halves};
    }
    // Returns this context with another deadline of preparations.
    RenderContext with_deadline(const Deadline& deadline) const {
        return {scene, seed, workers, monitor, view, deadline, two_halves};
    }
};

}  // namespace lucerna
