// False colour: measured values as colours of a map, on a scale whose limits and ticks are round numbers.
//
// Round steps are 1, 2 or 5 times a power of ten, and round numbers are multiples of such a step, each the
// double nearest to its decimal from 1e-22 to 1e22.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/figures/colour_maps.h"

namespace lucerna {

// mantissa · 10^exponent, the mantissa 1, 2 or 5.
struct RoundStep {
    int mantissa = 1, exponent = 0;

    double multiple(double count) const;  // count · step; `count` is whole
    double value() const { return multiple(1); }
};

// The least round step >= value; value > 0 and finite.
RoundStep round_step_from(double value);

enum class Scaling : std::uint8_t { linear, logarithmic };

struct ScaleRange {
    double low = 0, high = 1;  // low < high; on a logarithmic scale 0 < low
};

// Round numbers in the range, ends included, in rising order: multiples of the least round step of which no
// more than `most` + 1 are there; on a logarithmic scale 1, 2 and 5 times powers of ten, or powers of ten
// alone, or every second of them and so on, if these are more than `most` + 1. Where a logarithmic range is
// too narrow to hold three of them, as on a linear scale.
std::vector<double> round_numbers(const ScaleRange& range, Scaling scaling, int most);

struct ScaleSettings {
    ColourMap map = ColourMap::viridis;
    Scaling scaling = Scaling::linear;
    std::optional<ScaleRange> range;  // none: from the values
    // What share of the values a range from the values takes in, in (0, 1]: below 1 a lamp that is seen does
    // not decide the scale of a picture. On a linear scale the share counts from below.
    double inside = 1;
};

// Requires linear scaling for the diverging map, and a range as ScaleRange says.
//
// The range from the values: linear, from 0, or from a round number below the least value if that is negative
// or above half of the largest; logarithmic, 1, 2 or 5 times a power of ten at either end, over four decades
// at most; diverging, the same on both sides of 0. What is not finite, and on a logarithmic scale what is not
// positive, has no say.
class FalseColour {
  public:
    FalseColour(const ScaleSettings& settings, std::span<const double> values);

    // Display-referred sRGB. NaN is grey; what is below and above the range has colours of its own.
    Rgb operator()(double value) const;
    // From 0 at the lower end of the range to 1 at the upper one.
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
