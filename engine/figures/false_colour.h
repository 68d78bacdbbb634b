// False colour maps measured values to colours, on a scale whose limits and ticks are round numbers.
//
// Round steps are 1, 2 or 5 times a power of ten. Round numbers are multiples of such a step, each the double
// nearest to its decimal from 1e-22 to 1e22.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/figures/colour_maps.h"

namespace lucerna {

// mantissa · 10^exponent, where the mantissa is 1, 2 or 5.
struct RoundStep {
    int mantissa = 1, exponent = 0;

    double multiple(double count) const;  // count · step, for a whole `count`
    double value() const { return multiple(1); }
};

// Returns the smallest round step >= value, which is positive and finite.
RoundStep round_step_from(double value);

enum class Scaling : std::uint8_t { linear, logarithmic };

struct ScaleRange {
    double low = 0, high = 1;  // low < high; on a logarithmic scale 0 < low
};

// Returns round numbers in the range, including its ends, in ascending order: the multiples of the smallest
// round step that gives at most `most` + 1 of them. A logarithmic scale has 1, 2 and 5 times powers of ten,
// or powers of ten, every second power and so on to keep this limit. Logarithmic ranges too narrow for three
// such numbers are divided like linear ones.
std::vector<double> round_numbers(const ScaleRange& range, Scaling scaling, int most);

struct ScaleSettings {
    ColourMap map = ColourMap::viridis;
    Scaling scaling = Scaling::linear;
    std::optional<ScaleRange> range;  // none: derived from the values
    // Share of the values, in (0, 1], that a range derived from them covers. Below 1, a visible lamp does not
    // determine the scale of an image. On a linear scale the share counts from below.
    double inside = 1;
};

// Requires linear scaling for the diverging map, and a valid ScaleRange.
//
// A range derived from the values is: linear, from 0, or from a round number below the smallest value if that
// is negative or above half of the largest; logarithmic, from 1, 2 or 5 times a power of ten to another, over
// at most four decades; diverging, symmetric around 0. Values that are not finite, and on a logarithmic scale
// those that are not positive, are ignored.
class FalseColour {
  public:
    FalseColour(const ScaleSettings& settings, std::span<const double> values);

    // Returns display-referred sRGB. NaN is grey; values below and above the range have colours of their own.
    Rgb operator()(double value) const;
    // Returns 0 at the lower end of the range to 1 at the upper end.
    double share(double value) const;

    const ScaleRange& range() const { return range_; }
    Scaling scaling() const { return scaling_; }
    ColourMap map() const { return map_; }
    const OutsideColours& outside() const { return outside_; }

  private:
    ColourMap map_;
    Scaling scaling_;
    ScaleRange range_;
    OutsideColours outside_;
};

}  // namespace lucerna
