#include "lights/measurement/opacity.h"

#include "engine/base/error.h"
#include "lights/bell.h"

namespace lucerna {
namespace {

// Φ̃ is largest at 0 and least at ±1, where every other bell is 0 [Goesele 2003, 4.2]. A product is largest
// where both are, and most negative where one is largest and the other least.
constexpr double kDualMost = 1009.0 / 736.0;
constexpr double kDualLeast = -161.0 / 736.0;

constexpr double largest_product(FilterSign sign) {
    return sign == FilterSign::positive ? kDualMost * kDualMost : -kDualMost * kDualLeast;
}

}  // namespace

double filter_scale(const Rig& rig, FilterSign sign) {
    return largest_product(sign) / (rig.spacing.x * rig.spacing.y);  // spacings of a rig are > 0
}

double filter_opacity(const Rig& rig, FilterSign sign, const V2d& from_centre) {
    const double product =
        bell_dual(from_centre.x / rig.spacing.x) * bell_dual(from_centre.y / rig.spacing.y);
    const double part = sign == FilterSign::positive ? product : -product;
    return std::clamp(part / largest_product(sign), 0.0, 1.0);
}

LightField field_of(const FilterImages& images) {
    const Rig& rig = images.rig;
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    if (images.positive.size() != rig.coefficients() || images.negative.size() != rig.coefficients()) {
        throw InputError(fmt::format("filter images: {} and {} pixels where the rig has {}",
                                     images.positive.size(), images.negative.size(), rig.coefficients()));
    }
    const double plus = filter_scale(rig, FilterSign::positive);
    const double minus = filter_scale(rig, FilterSign::negative);
    std::vector<float> coefficients(rig.coefficients());
    double sum = 0;
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
        coefficients[i] =
            static_cast<float>(plus * double{images.positive[i]} - minus * double{images.negative[i]});
        sum += double{coefficients[i]};
    }
    LightFieldInfo info = images.info;
    info.captured = sum * rig.cell_volume();
    info.missed = images.flux > 0 ? images.flux - info.captured : 0;
    return {rig, std::move(coefficients), std::move(info)};
}

}  // namespace lucerna
