#include "lights/measurement/round_to_rays.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "engine/base/stats.h"
#include "lights/measurement/ray_projection.h"

namespace lucerna {
namespace {

// Returns the power of 2 that is nearest to x > 0 in proportion.
double nearest_power_of_2(double x) {
    int exponent = 0;
    const double mantissa = std::frexp(x, &exponent);  // in [0.5, 1)
    return std::ldexp(mantissa < std::sqrt(0.5) ? 0.5 : 1.0, exponent);
}

// Calls visit(index) for each coefficient. Neighbours in this order are neighbours in the field: every other
// row, and every other column of views, is visited backwards.
template <typename Visit>
void for_each_in_turn(const Rig& rig, Visit&& visit) {
    const auto turned = [](int i, int count, int row) { return row % 2 == 0 ? i : count - 1 - i; };
    int columns = 0, rows = 0;
    for (int m = 0; m < rig.views.x; ++m) {
        for (int i = 0; i < rig.views.y; ++i, ++columns) {
            const int n = turned(i, rig.views.y, m);
            for (int j = 0; j < rig.pixels.x; ++j, ++rows) {
                const int k = turned(j, rig.pixels.x, columns);
                for (int l = 0; l < rig.pixels.y; ++l)
                    visit(rig.index(m, n, k, turned(l, rig.pixels.y, rows)));
            }
        }
    }
}

// Rounds the coefficients to multiples of the quantum, and those to 0 that are 0 in `lit`.
std::vector<float> rounded(const LightField& field, double quantum, std::span<const float> lit) {
    constexpr int kBits = 11;  // of a half, with the implied one
    std::vector<float> whole(field.coefficients().begin(), field.coefficients().end());
    double owed = 0;  // by the coefficients visited so far
    for_each_in_turn(field.rig(), [&](std::size_t i) {
        const double wanted = double{whole[i]} + owed;
        double found = 0;
        if (lit[i] != 0) {
            double step = quantum;
            if (wanted > quantum) step = std::max(quantum, std::ldexp(1.0, std::ilogb(wanted) + 1 - kBits));
            found = std::max(0.0, std::floor(wanted / step + 0.5) * step);  // step > 0
        }
        whole[i] = static_cast<float>(found);
        owed = wanted - found;
    });
    // If the last coefficients are negative together, the first positive ones make up for them.
    for_each_in_turn(field.rig(), [&](std::size_t i) {
        if (!(owed <= -quantum) || whole[i] == 0) return;
        const double taken = std::min(double{whole[i]}, std::floor(-owed / quantum) * quantum);
        whole[i] = static_cast<float>(double{whole[i]} - taken);
        owed += taken;
    });
    return whole;
}

// Returns the flux of a ray, as the field counts it, or, if rays differ, the flux below which they carry a
// hundredth of all light.
double flux_of_a_ray(const RaySet& all, const LightField& field) {
    constexpr double kDim = 0.01;
    constexpr std::size_t kMost = 1'000'000;
    RaySet few;
    const RaySet& set = few_of(all, kMost, few);
    std::vector<Weighed> fluxes;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        const double light =
            field.coloured() ? double{set.rays[i].flux} * field.colour_channels().weight.dot(set.xyz_of(i))
                             : set.light_of(i);
        if (light > 0) fluxes.push_back({light, light});
    }
    return fluxes.empty() ? 0 : weighted_quantile(fluxes, kDim);
}

}  // namespace

LightField rounded_to_rays(const LightField& field, const RaySet& rays) {
    constexpr double kShareOfRay = 0.125;
    // Coarser steps of X, Y and Z are seen as coloured spots on the lamp.
    constexpr double kStepsOfColour = 4;
    const double quantum = kShareOfRay * flux_of_a_ray(rays, field) /
                           field.rig().cell_volume();  // the volume is > 0: Rig::fault
    if (!(quantum > 0) || !(field.flux() > 0)) return field;
    // These are of W if the field is coloured.
    const std::vector<float> whole = rounded(field, nearest_power_of_2(quantum), field.coefficients());
    if (!field.coloured()) return LightField(field.rig(), whole, field.info());
    std::vector<float> channels[3];
    for (int c = 0; c < 3; ++c) {
        const LightField channel = field.channel(c);
        const double part = quantum / kStepsOfColour * channel.flux() / field.flux();
        channels[c] =
            part > 0 ? rounded(channel, nearest_power_of_2(part), whole) : std::vector<float>(whole.size());
    }
    return LightField(field.rig(), channels[0], channels[1], channels[2], field.info());
}

}  // namespace lucerna
