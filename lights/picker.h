// Which light to ask: one of many, in proportion to power.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "engine/base/cdf.h"
#include "lights/light.h"

namespace lucerna {

class LightPicker {
  public:
    LightPicker() = default;
    explicit LightPicker(std::span<const std::unique_ptr<Light>> lights);

    struct Pick {
        std::uint32_t light;
        float probability;  // > 0
        float remainder;    // of u, uniform in [0,1) again
    };
    // None if no light has power. u in [0,1).
    std::optional<Pick> pick(float u) const;
    float probability(std::uint32_t light) const;
    double total_power() const { return cdf_.total(); }  // W

  private:
    Cdf cdf_;
};

}  // namespace lucerna
