// Several ray files that are joined into one lamp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "lights/measured.h"
#include "lights/ray_set.h"
#include "tests/support/error_of.h"

namespace lucerna {
namespace ray_join_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Returns two rays of one wavelength at x = `place` that carry `flux` together.
RaySet of_wavelength(double nm, FluxUnit unit, float flux, float place) {
    RaySet set;
    set.unit = unit;
    for (const float share : {0.25F, 0.75F}) set.rays.push_back({{place, 0, 0}, {0, 0, 1}, share * flux});
    set.flux = double{flux};
    const V3d xyz = cie_xyz(nm);
    set.xyz = xyz / xyz.y;
    if (unit == FluxUnit::watt) set.lumens_per_watt = 683 * xyz.y;
    set.provenance = fmt::format("light of {:g} nm", nm);
    return set;
}

std::vector<DrivenRays> three(FluxUnit unit) {
    return {{of_wavelength(620, unit, 2, 1), "red.ray", 1},
            {of_wavelength(530, unit, 3, 2), "green.ray", 0.5},
            {of_wavelength(455, unit, 4, 3), "blue.ray", 2}};
}

// Compares the sum of flux · XYZ over the joined rays with the expected sum of the parts.
void expect_sum(const RaySet& joined, const V3d& expected, double flux) {
    V3d sum(0, 0, 0);
    double of_rays = 0;
    for (std::size_t i = 0; i < joined.rays.size(); ++i) {
        sum += double{joined.rays[i].flux} * joined.xyz_of(i);
        of_rays += double{joined.rays[i].flux};
    }
    EXPECT_NEAR(of_rays, flux, 1e-6);
    EXPECT_NEAR(joined.flux, flux, 1e-6);
    EXPECT_NEAR(sum.y, flux, 1e-5) << "flux · Y adds up to the flux";
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(sum[c] / sum.y, expected[c] / expected.y, 1e-6 * std::max(1.0, expected[c] / expected.y));
        EXPECT_NEAR(joined.xyz[c], expected[c] / expected.y, 1e-9);
    }
}

TEST(JoinRays, OfThreeLeds_IsTheSumOfDrivenFluxesAndColours) {
    const V3d red = cie_xyz(620), green = cie_xyz(530), blue = cie_xyz(455);
    const RaySet lumens = join_rays(three(FluxUnit::lumen));
    ASSERT_EQ(lumens.rays.size(), 6U);
    ASSERT_EQ(lumens.tristimulus.size(), 6U);
    EXPECT_EQ(lumens.rays[3].flux, 0.5F * 2.25F);
    EXPECT_EQ(lumens.rays[4].o.x, 3);
    EXPECT_NEAR((V3d(lumens.tristimulus[2]) - green / green.y).length(), 0, 1e-6);
    for (const V3f& xyz : lumens.tristimulus) EXPECT_NEAR(xyz.y, 1, 1e-6F);
    expect_sum(lumens, 2.0 * red / red.y + 1.5 * green / green.y + 8.0 * blue / blue.y, 11.5);
    EXPECT_THAT(lumens.provenance, HasSubstr("1 x light of 620 nm + 0.5 x light of 530 nm + 2 x"));

    // A watt of green light is brighter than a watt of blue light.
    const RaySet watts = join_rays(three(FluxUnit::watt));
    expect_sum(watts, 2.0 * red + 1.5 * green + 8.0 * blue, 11.5);
    EXPECT_NEAR(watts.tristimulus[2].y / watts.tristimulus[4].y, green.y / blue.y, 1e-4);
    EXPECT_NEAR(watts.lumens_per_watt, 683 * (2 * red.y + 1.5 * green.y + 8 * blue.y) / 11.5, 1e-4);
    EXPECT_NEAR(make_ray_light(watts, RayLightSettings{"led", M44d(), 1, 0})->power(), 11.5, 1e-4);
}

TEST(JoinRays, ColoursOfRays_AreKept) {
    std::vector<DrivenRays> once = three(FluxUnit::watt);
    once.resize(2);
    const RaySet pair = join_rays(once);
    const V3d red = cie_xyz(620), green = cie_xyz(530), blue = cie_xyz(455);
    const RaySet all =
        join_rays({{pair, "pair.ray", 3}, {of_wavelength(455, FluxUnit::watt, 4, 3), "blue.ray", 1}});
    expect_sum(all, 6.0 * red + 4.5 * green + 4.0 * blue, 3 * 3.5 + 4);
    EXPECT_NEAR(all.tristimulus[0].y / all.tristimulus[2].y, red.y / green.y, 1e-5);
    EXPECT_NEAR(all.tristimulus[0].y / all.tristimulus[4].y, red.y / blue.y, 1e-4);
}

TEST(JoinRays, OfOneColour_HaveOneColour) {
    const RaySet two = join_rays({{of_wavelength(530, FluxUnit::lumen, 1, 0), "a", 1},
                                  {of_wavelength(530, FluxUnit::lumen, 2, 0), "b", 1}});
    EXPECT_FALSE(two.coloured());
    EXPECT_EQ(two.rays.size(), 4U);
    std::vector<DrivenRays> parts = three(FluxUnit::lumen);
    parts[0].drive = parts[2].drive = 0;
    const RaySet green = join_rays(parts);
    EXPECT_FALSE(green.coloured());
    EXPECT_EQ(green.rays.size(), 2U);
    EXPECT_NEAR(green.flux, 1.5, 1e-9);
    EXPECT_NEAR((green.xyz - cie_xyz(530) / cie_xyz(530).y).length(), 0, 1e-9);
}

TEST(JoinRays, WattsOfUnknownBrightness_CountAlike) {
    std::vector<DrivenRays> parts = three(FluxUnit::watt);
    for (DrivenRays& part : parts) part.set.lumens_per_watt = 0;
    const RaySet joined = join_rays(parts);
    EXPECT_EQ(joined.lumens_per_watt, 0);
    for (const V3f& xyz : joined.tristimulus) EXPECT_NEAR(xyz.y, 1, 1e-6F);
    const auto xyz_of = [&](std::size_t i) { return parts[i].drive * parts[i].set.flux * parts[i].set.xyz; };
    expect_sum(joined, xyz_of(0) + xyz_of(1) + xyz_of(2), 11.5);
}

TEST(JoinRays, WattsBesideLumens_BecomeLumens) {
    std::vector<DrivenRays> parts = three(FluxUnit::watt);
    parts[1].set = of_wavelength(530, FluxUnit::lumen, 3, 2);
    const RaySet joined = join_rays(parts);
    EXPECT_EQ(joined.unit, FluxUnit::lumen);
    const V3d red = 683.0 * cie_xyz(620), green = cie_xyz(530) / cie_xyz(530).y, blue = 683.0 * cie_xyz(455);
    const V3d sum = 2.0 * red + 1.5 * green + 8.0 * blue;
    EXPECT_NEAR(joined.flux / sum.y, 1, 1e-6);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(joined.xyz[c], sum[c] / sum.y, 1e-5 * sum[c] / sum.y);
    // Each ray's lumens are those of its own watts: in a set of several colours, by its own Y.
    RaySet pair = join_rays({{of_wavelength(530, FluxUnit::watt, 3, 2), "green", 1},
                             {of_wavelength(455, FluxUnit::watt, 4, 3), "blue", 1}});
    turn_into_lumens(pair);
    for (std::size_t i = 0; i < pair.rays.size(); ++i) {
        const double watts = (i % 2 == 0 ? 0.25 : 0.75) * (i < 2 ? 3 : 4);
        const double lumens = 683 * watts * cie_xyz(i < 2 ? 530 : 455).y;
        EXPECT_NEAR(double{pair.rays[i].flux} / lumens, 1, 1e-5);
        EXPECT_NEAR(double{pair.tristimulus[i].y}, 1, 1e-5);
    }
    EXPECT_NEAR(pair.flux, 683 * (3 * cie_xyz(530).y + 4 * cie_xyz(455).y), 1e-2);
}

TEST(JoinRays, LightThatIsStated_IsThatOfTheFile) {
    RaySet set = of_wavelength(620, FluxUnit::watt, 2, 1);
    const RaySet truth = of_wavelength(455, FluxUnit::watt, 2, 1);
    state_spectrum(set, {{455, 1}});
    EXPECT_NEAR((set.xyz - truth.xyz).length(), 0, 1e-9);
    EXPECT_NEAR(set.lumens_per_watt, truth.lumens_per_watt, 1e-6);
    EXPECT_EQ(set.spectra, (std::vector<Spectrum>{{{455, 1}}}));
    state_efficacy(set, 30);
    EXPECT_EQ(set.lumens_per_watt, 30);
}

TEST(JoinRays, Spectra_AreThoseOfAllFiles) {
    std::vector<DrivenRays> parts = three(FluxUnit::lumen);
    state_spectrum(parts[0].set, {{620, 1}});
    state_spectrum(parts[1].set, {{455, 1}});
    EXPECT_TRUE(join_rays(parts).spectra.empty()) << "that of the third file is not known";
    parts[2].set.spectra = {{{455, 1}}, {{480, 1}}};
    parts[2].set.spectrum = {1, RaySet::kNoSpectrum};
    const RaySet joined = join_rays(parts);
    EXPECT_EQ(joined.spectra, (std::vector<Spectrum>{{{620, 1}}, {{455, 1}}, {{480, 1}}}));
    EXPECT_EQ(joined.spectrum, (std::vector<std::uint16_t>{0, 0, 1, 1, 2, RaySet::kNoSpectrum}));
    // Files of one spectrum are a lamp of one spectrum.
    parts.pop_back();
    state_spectrum(parts[0].set, {{455, 1}});
    const RaySet alike = join_rays(parts);
    EXPECT_EQ(alike.spectra, (std::vector<Spectrum>{{{455, 1}}}));
    EXPECT_TRUE(alike.spectrum.empty());
}

TEST(JoinRays, WhatDoesNotJoin_IsRefusedByName) {
    const auto refusal = [](const auto& spoil) {
        std::vector<DrivenRays> parts = three(FluxUnit::watt);
        spoil(parts);
        return testing::error_of([&] { join_rays(parts); });
    };
    using Parts = std::vector<DrivenRays>;
    EXPECT_THAT(refusal([](Parts& p) { p[1].set.unit = FluxUnit::lumen, p[0].set.lumens_per_watt = 0; }),
                AllOf(HasSubstr("red.ray: its flux is in W"), HasSubstr("--efficacy")));
    EXPECT_THAT(refusal([](Parts& p) { p[2].set.lumens_per_watt = 0; }),
                HasSubstr("blue.ray: the file has no data"));
    EXPECT_THAT(refusal([](Parts& p) { p[0].set.lumens_per_watt = 0; }),
                HasSubstr("red.ray: the file has no data"));
    EXPECT_THAT(refusal([](Parts& p) { p[1].drive = -1; }), HasSubstr("green.ray: drive -1"));
    EXPECT_THAT(refusal([](Parts& p) { p[1].drive = NAN; }), HasSubstr("green.ray: drive nan"));
    EXPECT_THAT(refusal([](Parts& p) {
                    for (DrivenRays& part : p) part.drive = 0;
                }),
                HasSubstr("drives are 0"));
    EXPECT_THAT(refusal([](Parts& p) { p.clear(); }), HasSubstr("no ray files"));
}

}  // namespace ray_join_test
}  // namespace lucerna
