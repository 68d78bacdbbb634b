#include "lights/picker.h"

#include <cmath>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {

LightPicker::LightPicker(std::span<const std::unique_ptr<Light>> lights) {
    std::vector<double> powers;
    powers.reserve(lights.size());
    for (const auto& light : lights) {
        const double power = light->power();
        if (!std::isfinite(power) || power < 0) {
            throw InputError(
                fmt::format("light {} ({}): its power is {} W; accepted: a finite number, not negative",
                            powers.size(), light->kind(), power));
        }
        powers.push_back(power);
    }
    cdf_ = Cdf(powers);
}

std::optional<LightPicker::Pick> LightPicker::pick(float u) const {
    if (!(cdf_.total() > 0)) return std::nullopt;
    const Cdf::Draw draw = cdf_.draw(u);
    // A light too weak for float32 beside the others would be picked with probability 0: then it is not
    // picked.
    const auto probability = static_cast<float>(draw.probability);
    if (!(probability > 0)) return std::nullopt;
    return Pick{static_cast<std::uint32_t>(draw.item), probability, draw.remainder};
}

float LightPicker::probability(std::uint32_t light) const {
    return cdf_.total() > 0 ? static_cast<float>(cdf_.probability(light)) : 0.0F;
}

}  // namespace lucerna
