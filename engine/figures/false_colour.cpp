#include "engine/figures/false_colour.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

constexpr int kLinearSteps = 10;    // maximum for a linear scale
constexpr double kMostDecades = 4;  // for a logarithmic scale derived from the values
constexpr double kRounding = 1e-9;  // tolerance for a quotient that is a whole number

RoundStep next(const RoundStep& step) {
    if (step.mantissa == 1) return {2, step.exponent};
    if (step.mantissa == 2) return {5, step.exponent};
    return {1, step.exponent + 1};
}

RoundStep previous(const RoundStep& step) {
    if (step.mantissa == 5) return {2, step.exponent};
    if (step.mantissa == 2) return {1, step.exponent};
    return {5, step.exponent - 1};
}

// Return the largest multiple of the step <= value, and the smallest one >= value.
double floor_to(const RoundStep& step, double value) {
    const double count = std::floor(value / step.value() + kRounding);
    return step.multiple(step.multiple(count) > value ? count - 1 : count);
}
double ceil_to(const RoundStep& step, double value) {
    return -floor_to(step, -value);
}

std::vector<double> multiples(const ScaleRange& range, int most) {
    const RoundStep step = round_step_from((range.high - range.low) / most);
    const double first = std::ceil(range.low / step.value() - kRounding);
    const double last = std::floor(range.high / step.value() + kRounding);
    std::vector<double> numbers;
    for (double count = first; count <= last; ++count)
        numbers.push_back(step.multiple(count) + 0.0);  // turns -0 into 0
    return numbers;
}

// Returns the quantile of `values`, which are not empty.
double quantile(std::vector<double> values, double share) {
    const auto at = static_cast<std::ptrdiff_t>(std::llround(share * static_cast<double>(values.size() - 1)));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return values[static_cast<std::size_t>(at)];
}

ScaleRange linear_range(const std::vector<double>& values, double inside) {
    const auto [least_at, most_at] = std::minmax_element(values.begin(), values.end());
    const double least = *least_at;
    double most = quantile(values, inside);
    if (!(most > 0)) most = *most_at;  // the positive values are fewer than the share left out
    if (least == 0 && most == 0) return {0, 1};
    // All values below the quantile may be equal.
    const double from = least < 0 || (least > most / 2 && least < most) ? least : 0;
    const double extent = std::max(most, 0.0) - from;
    const RoundStep step = round_step_from(extent / kLinearSteps);
    return {floor_to(step, from), ceil_to(step, std::max(most, 0.0))};
}

ScaleRange diverging_range(std::vector<double> values, double inside) {
    for (double& v : values) v = std::fabs(v);
    const double most = quantile(std::move(values), inside);
    const double end = most > 0 ? round_step_from(most).value() : 1;
    return {-end, end};
}

ScaleRange logarithmic_range(const std::vector<double>& all, double inside) {
    std::vector<double> values;
    std::copy_if(all.begin(), all.end(), std::back_inserter(values), [](double v) { return v > 0; });
    if (values.empty()) return {0.1, 1};
    const double most = quantile(values, inside), least = quantile(values, 1 - inside);
    RoundStep high = round_step_from(most);
    const double held = std::max(least, high.value() * pow(10, -kMostDecades));
    RoundStep low = round_step_from(held);
    if (low.value() > held) low = previous(low);
    if (!(low.value() < high.value())) high = next(high);
    return {low.value(), high.value()};
}

ScaleRange range_of(const ScaleSettings& settings, std::span<const double> values) {
    if (settings.range) return *settings.range;
    std::vector<double> finite;
    std::copy_if(values.begin(), values.end(), std::back_inserter(finite),
                 [](double v) { return std::isfinite(v); });
    if (finite.empty()) finite.push_back(settings.map == ColourMap::diverging ? 0 : 1);
    if (settings.map == ColourMap::diverging) return diverging_range(std::move(finite), settings.inside);
    return settings.scaling == Scaling::logarithmic ? logarithmic_range(finite, settings.inside)
                                                    : linear_range(finite, settings.inside);
}

}  // namespace

double RoundStep::multiple(double count) const {
    // A quotient of whole numbers is the double nearest to the decimal; a product with 0.1 is not.
    return exponent < 0 ? count * mantissa / pow(10.0, -exponent) : count * mantissa * pow(10.0, exponent);
}

RoundStep round_step_from(double value) {
    assert(value > 0 && std::isfinite(value));
    RoundStep step{1, static_cast<int>(std::floor(log10(value)))};
    while (step.value() > value) step = previous(step);
    while (step.value() < value) step = next(step);
    return step;
}

std::vector<double> round_numbers(const ScaleRange& range, Scaling scaling, int most) {
    if (scaling == Scaling::linear) return multiples(range, most);
    RoundStep step = round_step_from(range.low);
    std::vector<double> all, powers;
    for (; step.value() <= range.high; step = next(step)) {
        all.push_back(step.value());
        if (step.mantissa == 1) powers.push_back(step.value());
    }
    if (all.size() < 3) return multiples(range, most);
    if (all.size() <= static_cast<std::size_t>(most) + 1) return all;
    const std::size_t every = powers.size() / (static_cast<std::size_t>(most) + 1) + 1;
    std::vector<double> some;
    for (std::size_t i = 0; i < powers.size(); i += every) some.push_back(powers[i]);
    return some;
}

FalseColour::FalseColour(const ScaleSettings& settings, std::span<const double> values)
    : map_(settings.map),
      scaling_(settings.scaling),
      range_(range_of(settings, values)),
      outside_(outside_colours(settings.map)) {
    assert(range_.low < range_.high && (scaling_ == Scaling::linear || range_.low > 0));
    assert(map_ != ColourMap::diverging || scaling_ == Scaling::linear);
}

double FalseColour::share(double value) const {
    if (scaling_ == Scaling::linear) return (value - range_.low) / (range_.high - range_.low);
    return log(value / range_.low) / log(range_.high / range_.low);
}

Rgb FalseColour::operator()(double value) const {
    if (std::isnan(value)) return outside_.missing;
    if (value < range_.low) return outside_.below;
    if (value > range_.high) return outside_.above;
    return colour_at(map_, share(value));
}

}  // namespace lucerna
