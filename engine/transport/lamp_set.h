// Represents a subset of a scene's lights, or of their parts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lights/light.h"

namespace lucerna {

class LampSet {
  public:
    // Makes an empty set for a scene with `lights` lights.
    explicit LampSet(std::size_t lights) : lights_(lights) {}

    void add(std::uint32_t light) { lights_[light].whole = true; }
    // Adds one of the light's part_bounds(), by its index.
    void add(std::uint32_t light, CellId part) {
        std::vector<bool>& parts = lights_[light].parts;
        if (parts.size() <= part) parts.resize(part + 1);
        parts[part] = true;
    }

    // Tells whether the set contains the part of the light that was seen.
    bool holds(std::uint32_t light, const EmittedRadiance& seen) const {
        const Of& of = lights_[light];
        return of.whole || (seen.part && seen.part->part < of.parts.size() && of.parts[seen.part->part]);
    }

  private:
    struct Of {
        bool whole = false;
        std::vector<bool> parts;
    };
    std::vector<Of> lights_;
};

}  // namespace lucerna
