// Measures the bias that the metric of photon distances causes, for metric_bias.py.
//
// figure_metric_bias writes mean estimates with radius 1 on shapes of known irradiance
// figure_metric_bias corner writes estimates of 50 photons on the floor of a concave corner, means of 32 sets
#include <fmt/core.h>

#include <string_view>

#include "photon/density_estimate.h"
#include "tests/support/lit_shapes.h"

namespace {

using namespace lucerna;  // a program of its own, not a header
using namespace lucerna::testing;

void means() {
    std::vector<LitShape> shapes;
    for (const float t : {0.0F, 0.1F, 0.25F, 0.5F, 0.75F, 1.0F}) {
        shapes.push_back(concave_corner(t));
        shapes.push_back(corner_in_sunlight(t, 20));
        shapes.push_back(corner_in_sunlight(t, 60));
        shapes.push_back(convex_edge(t));
    }
    for (const float r : {1.0F, 1.5F, 2.0F, 3.0F, 5.0F, 10.0F}) {
        shapes.push_back(sphere(r, true));
        shapes.push_back(sphere(r, false));
    }
    for (const float r : {0.125F, 0.25F, 0.5F, 1.0F, 2.0F, 4.0F}) shapes.push_back(cylinder(r));
    for (const float h : {0.25F, 0.5F, 1.0F, 1.5F, 2.0F, 3.0F, 5.0F}) shapes.push_back(under_shelf(h));
    shapes.push_back(lit_from_behind());
    fmt::print("shape,size,t,measure,exact,estimate\n");
    for (const LitShape& shape : shapes) {
        const auto estimates = mean_estimates(shape, KernelShape::epanechnikov, 1U << 22);
        for (std::size_t m = 0; m < estimates.size(); ++m) {
            fmt::print("\"{}\",{:g},{:g},\"{}\",{:g},{:.5f}\n", shape.name, shape.size, shape.t,
                       kMeasures[m].name, shape.exact, estimates[m]);
        }
    }
}

PhotonMap corner_photons(const LitShape& corner, std::uint64_t seed) {
    constexpr int kPhotons = 200'000;
    Photons deposited;
    const auto power = static_cast<float>(corner.area / kPhotons);
    for (std::uint32_t i = 0; i < kPhotons; ++i) {
        Sampler sampler(seed, Purpose::bench, 0, i);
        const DepositedPhoton photon = corner.photon(sampler);
        deposited.add(photon.p, PackedDirection(photon.n),
                      {PackedDirection(photon.d), Rgb(power), 0, kNoCell});
    }
    return PhotonMap(deposited);
}

void corner_picture() {
    constexpr int kSide = 80, kSets = 32;
    const LitShape corner = corner_in_sunlight(0, 20);
    std::vector<PhotonMap> maps;
    for (int set = 0; set < kSets; ++set)
        maps.push_back(corner_photons(corner, static_cast<std::uint64_t>(set)));
    // A disc of 50 photons is about 0.09 wide; the picture is six of them wide.
    fmt::print("measure,x,y,estimate\n");
    for (const Measure& m : kMeasures) {
        const DensityEstimateSettings settings{
            50, 1, m.ratio, KernelShape::epanechnikov, m.kind, Boundary::none};
        for (int j = 0; j < kSide; ++j) {
            for (int i = 0; i < kSide; ++i) {
                const V3f p((static_cast<float>(i) + 0.5F) * 0.5F / kSide,
                            (static_cast<float>(j) + 0.5F) * 0.5F / kSide, 0);
                float sum = 0;
                for (const PhotonMap& map : maps) {
                    sum += DensityEstimate(map, settings)
                               .irradiance({p, {0, 0, 1}, surface_error(p, 1)})
                               .value.x;
                }
                fmt::print("\"{}\",{:.5f},{:.5f},{:.4f}\n", m.name, p.x, p.y, sum / kSets);
            }
        }
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc > 1 && std::string_view(argv[1]) == "corner") {
        corner_picture();
    } else {
        means();
    }
    return 0;
}
