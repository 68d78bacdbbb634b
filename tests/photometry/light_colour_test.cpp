// The colour of the light in rooms, against direct integration of known mixtures of spectra, and against
// renders of narrow bands of wavelengths.
#include "engine/photometry/light_colour.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/photometry/measurement_uncertainty.h"
#include "lights/lumigraph.h"
#include "lights/measurement/lumigraph_fit.h"
#include "tests/photometry/stated_intervals.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace light_colour_test {

using ::testing::HasSubstr;
using namespace lucerna::testing;

BandSpectrum bell(double nanometres, double width) {
    BandSpectrum spectrum;
    for (std::size_t i = 0; i < kBands; ++i)
        spectrum.at[i] = std::exp(-0.5 * std::pow((BandSpectrum::nanometres(i) - nanometres) / width, 2));
    return 1 / band_lumens(spectrum) * spectrum;
}
// A warm phosphor, and a chip with a cool one, per lumen.
BandSpectrum warm() {
    BandSpectrum spectrum = 0.9 * bell(600, 55);
    return spectrum += 0.1 * bell(500, 60);
}
BandSpectrum cool() {
    BandSpectrum spectrum = 0.96 * bell(552, 55);
    return spectrum += 0.04 * bell(455, 11);
}
std::string text_of(const BandSpectrum& spectrum) {
    std::string text = "[";
    for (std::size_t i = 0; i < kBands; ++i)
        text += fmt::format(" {:g} {:.9g}", BandSpectrum::nanometres(i), spectrum.at[i]);
    return text + " ]";
}

// Two lamps at a place, of the illuminances `shares` at 1 m.
std::string lamps_at(const std::string& place, double warm_share, double cool_share) {
    std::string text;
    for (const auto& [spectrum, share] : {std::pair(warm(), warm_share), std::pair(cool(), cool_share)}) {
        text += fmt::format("LightSource \"point\" \"point3 from\" [{}] \"spectrum I\" {}\n", place,
                            text_of(share * spectrum));
    }
    return text;
}

// A room of 4 m x 4 m x 3 m around the z axis, whose floor, walls and ceiling have these materials.
std::string room(const std::string& floor, const std::string& walls, const std::string& ceiling) {
    const auto quad = [](const std::string& reflectance, const std::string& p) {
        return fmt::format(
            "Material \"diffuse\" {}\nShape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" "
            "[{}]\n",
            reflectance, p);
    };
    return quad(floor, "-2 -2 0 2 -2 0 2 2 0 -2 2 0") + quad(ceiling, "-2 -2 3 2 -2 3 2 2 3 -2 2 3") +
           quad(walls, "-2 -2 0 2 -2 0 2 -2 3 -2 -2 3") + quad(walls, "-2 2 0 2 2 0 2 2 3 -2 2 3") +
           quad(walls, "-2 -2 0 -2 2 0 -2 2 3 -2 -2 3") + quad(walls, "2 -2 0 2 2 0 2 2 3 2 -2 3");
}
std::string grey(double reflectance) {
    return fmt::format("\"rgb reflectance\" [{0} {0} {0}]", reflectance);
}
const std::string kHead =
    "Option \"string unit\" \"photometric\"\nCamera \"perspective\" Film \"rgb\" WorldBegin\n";

Job read(const std::string& world, const std::optional<WorkingSpace>& colours = {}) {
    SceneOverrides overrides;
    overrides.colours = colours;
    Monitor silent;
    return read_scene_text(kHead + world, "scene.pbrt", overrides, Workers{2}, silent);
}

struct Measured {
    IlluminanceReport report;
    ColourReport colour;
};
Measured measure_colour(const std::string& world, const CalculationSurface& surface, int samples,
                        std::uint64_t seed = 0, int threads = 2) {
    Monitor silent;
    IlluminanceOptions options;
    options.workers = {threads};
    options.most_samples = samples;
    options.seed = seed;
    Measured made{illuminance_on(std::vector{surface}, read(world), options, silent), {}};
    options.seed = seed ^ 0x5bd1e995U;
    made.colour = colour_on(
        made.report, [&](const WorkingSpace& intervals) { return read(world, intervals); }, options,
        [] { return INFINITY; }, silent);
    return made;
}

// Counts values that are farther from the truth than `widths` half-widths.
int beyond(const LightColour& found, const std::array<double, kColourCount>& truth, double widths) {
    int count = 0;
    for (std::size_t i = 0; i < kColourCount; ++i) {
        const double rounding = 1e-5 * std::fabs(truth[i]);
        count += std::fabs(found.values[i].value - truth[i]) > widths * found.values[i].half_width + rounding;
    }
    return count;
}

// In a grey room two lamps at one place make the same mixture everywhere.
TEST(LightColour, InAGreyRoom_IsThatOfTheMixture) {
    const std::string world = room(grey(0.3), grey(0.5), grey(0.8)) + lamps_at("0.5 0 2.5", 100, 250);
    const Measured found = measure_colour(world, plane(0.75, 2, {2, 2}), 16);
    ASSERT_EQ(found.colour.surfaces.size(), 1U);
    EXPECT_EQ(found.colour.intervals, 1);
    const auto truth_at = [&](double illuminance, double warm_share) {
        BandSpectrum mixture = warm_share * warm();
        return colour_quantities(illuminance * (mixture += (1 - warm_share) * cool()));
    };
    const auto with_seed = found.colour.surfaces[0];
    const SurfaceIlluminance& surface = found.report.surfaces[0];
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
        std::array<double, kColourCount> truth = truth_at(surface.points[i].all.value, 100.0 / 350);
        // The melanopic illuminance is of other samples than the illuminance.
        const Reading95& melanopic = with_seed.points[i].values.back();
        const double width = std::hypot(melanopic.half_width / melanopic.value,
                                        surface.points[i].all.half_width / surface.points[i].all.value);
        EXPECT_NEAR(melanopic.value / truth.back(), 1, 2 * width);
        truth.back() = melanopic.value;
        EXPECT_EQ(beyond(with_seed.points[i], truth, 2), 0);
        // Another mixture is rejected.
        std::array<double, kColourCount> wrong = truth_at(surface.points[i].all.value, 120.0 / 350);
        wrong.back() = melanopic.value;
        EXPECT_GE(beyond(with_seed.points[i], wrong, 3), 4);
        for (const double error : with_seed.points[i].by_intervals) EXPECT_EQ(error, 0);
    }
}

// Rays of a disc, each of one of two spectra; the share of cool light goes from 0 at grazing angles to 1
// ahead.
RaySet two_spectra(std::size_t count) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    for (const BandSpectrum& spectrum : {warm(), cool()}) {
        Spectrum& samples = set.spectra.emplace_back();
        for (std::size_t i = 0; i < kBands; ++i)
            samples.push_back({BandSpectrum::nanometres(i), spectrum.at[i]});
    }
    V3d sum(0, 0, 0);
    for (std::size_t i = 0; i < count; ++i) {
        Sampler sampler(1, Purpose::test, 0, i);
        const V2f on_disc = 0.01F * square_to_disc(sampler.next2());
        const V3f d = square_to_cosine_hemisphere(sampler.next2());
        set.rays.push_back({V3f(on_disc.x, on_disc.y, 0), d, 1});
        set.spectrum.push_back(sampler.next() < d.z ? 1 : 0);
        const V3d xyz = xyz_per_watt(set.spectra[set.spectrum.back()]);
        set.tristimulus.push_back(V3f(xyz / xyz.y));
        sum += xyz / xyz.y;
    }
    set.xyz = sum / sum.y;
    set.flux = static_cast<double>(count);
    return set;
}

// A lamp that was imported from rays of two spectra has their mixture in every direction. Beside its axis at
// 1 m, the illuminance of its cosine distribution is proportional to cos⁴θ, and the share of cool light is
// cos θ. Its light field states its error by direction, and the shares are wrong by up to three times as
// much.
TEST(LightColour, Long_OfAnImportedLamp_IsThatOfItsMixture) {
    Monitor silent;
    const TemporaryFolder folder;
    const Lumigraph lamp = fit_lumigraph(two_spectra(400000), {}, {2}, silent).lamp;
    const double error = field_error("lamp", fields_of(lamp)).by_direction;
    EXPECT_GT(error, 0);
    EXPECT_LT(error, 0.03);
    write_lumigraph(folder / "lamp.exr", lamp);
    const std::string world = fmt::format(
        "Rotate 180 1 0 0\nTranslate 0 0 -1\nLightSource \"lightfield\" \"string filename\" \"{}\" \"float "
        "power\" 1000\n",
        (folder / "lamp.exr").string());
    CalculationSurface surface = plane(0, 4, {8, 1});
    surface.v = {0, 0.05, 0};
    surface.corner = {-2, -0.025, 0};
    const Measured found = measure_colour(world, surface, 16);
    for (int x = 0; x < 8; ++x) {
        const double cosine = 1 / std::hypot(1, surface.position(x, 0).x);
        const auto of_share = [&](double share) {
            BandSpectrum mixture = share * cool();
            return colour_quantities(1000 / kPiD * std::pow(cosine, 4) * (mixture += (1 - share) * warm()));
        };
        const auto truth = of_share(cosine), less = of_share((1 - 3 * error) * cosine),
                   more = of_share((1 + 3 * error) * cosine), wrong = of_share(0.85 * cosine);
        const LightColour& point = found.colour.surfaces[0].points[static_cast<std::size_t>(x)];
        // An index has an extreme somewhere among the mixtures, where it hardly depends on the share.
        constexpr std::array<double, kColourCount> kAtExtremes{0, 1e-4, 0.1, 0.3, 0.1, 0.3, 0};
        for (std::size_t i = 0; i < kColourCount; ++i) {
            const double by_field = std::max(std::fabs(more[i] - truth[i]), std::fabs(less[i] - truth[i])) +
                                    (i + 1 == kColourCount ? 3 * error * truth[i] : kAtExtremes[i]);
            const double bound = by_field + 3 * point.values[i].half_width;
            EXPECT_NEAR(point.values[i].value, truth[i], bound) << x << ' ' << kColourQuantities[i].name;
            if (i > 0) continue;
            EXPECT_GT(std::fabs(wrong[i] - truth[i]), bound) << "another mixture has another temperature";
        }
    }
}

// Without walls the illuminances by lamps at two places are known at each point, and so is the mixture.
// Intervals of 95 % cover the truth as often as they say.
TEST(LightColour, Long_Intervals_CoverTheTruth) {
    const std::string world = lamps_at("-1.5 0 2", 300, 0.001) + lamps_at("1.5 0.5 2", 0.001, 200) +
                              room(grey(0), grey(0), grey(0));
    const CalculationSurface surface = plane(0.5, 2, {2, 2});
    std::array<std::pair<int, int>, kColourCount> missed{};
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        const Measured found = measure_colour(world, surface, 4, seed);
        for (int y = 0; y < 2; ++y) {
            for (int x = 0; x < 2; ++x) {
                const V3d p = surface.position(x, y);
                const auto from = [&p](const V3d& lamp, double intensity) {
                    const V3d way = lamp - p;
                    return intensity * way.z / std::pow(way.length(), 3);
                };
                const V3d a(-1.5, 0, 2), b(1.5, 0.5, 2);
                BandSpectrum e = (from(a, 300) + from(b, 0.001)) * warm();
                const auto truth = colour_quantities(e += (from(a, 0.001) + from(b, 200)) * cool());
                const LightColour& at = found.colour.surfaces[0].points[static_cast<std::size_t>(2 * y + x)];
                for (std::size_t i = 0; i < kColourCount; ++i) {
                    missed[i].first += std::fabs(at.values[i].value - truth[i]) > at.values[i].half_width;
                    ++missed[i].second;
                }
            }
        }
    }
    for (std::size_t i = 0; i < kColourCount; ++i) {
        EXPECT_TRUE(as_stated(missed[i]))
            << kColourQuantities[i].name << ": " << missed[i].first << " of " << missed[i].second;
        EXPECT_GT(missed[i].first, 0) << "the intervals of " << kColourQuantities[i].name << " are too wide";
    }
}

// Reflectances of a red, a green and a blue paint, in steps of 20 nm from 400 to 700 nm.
constexpr double kRedPaint[] = {0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.06, 0.07,
                                0.09, 0.15, 0.32, 0.52, 0.62, 0.66, 0.68, 0.70};
constexpr double kGreenPaint[] = {0.06, 0.07, 0.09, 0.13, 0.20, 0.32, 0.42, 0.44,
                                  0.36, 0.25, 0.17, 0.13, 0.12, 0.12, 0.14, 0.18};
constexpr double kBluePaint[] = {0.30, 0.42, 0.48, 0.47, 0.40, 0.31, 0.22, 0.15,
                                 0.10, 0.08, 0.07, 0.07, 0.08, 0.12, 0.20, 0.28};
double at(const double (&paint)[16], double nanometres) {
    const double x = std::clamp((nanometres - 400) / 20, 0.0, 14.999);
    const auto i = static_cast<std::size_t>(x);
    return std::lerp(paint[i], paint[i + 1], x - std::floor(x));
}
std::string spectrum_of(const double (&paint)[16]) {
    std::string text = "\"spectrum reflectance\" [";
    for (int i = 0; i < 16; ++i) text += fmt::format(" {} {}", 400 + 20 * i, paint[i]);
    return text + " ]";
}

// Renders a coloured room once for each wavelength of the bands, with grey reflectances.
std::array<double, kColourCount> by_bands(const std::string& lamps, const CalculationSurface& surface,
                                          const std::function<std::string(double)>& room_at, int samples) {
    Monitor silent;
    IlluminanceOptions options;
    options.workers = {2};
    options.most_samples = samples;
    BandSpectrum e;
    constexpr std::size_t kFirst = 2, kStep = 2;  // from 390 nm, every 10 nm
    std::vector<double> illuminance;
    for (std::size_t i = kFirst; i < 70; i += kStep) {
        const double nm = BandSpectrum::nanometres(i);
        illuminance.push_back(illuminance_on(std::vector{surface}, read(room_at(nm) + lamps), options, silent)
                                  .surfaces[0]
                                  .mean.value);
    }
    for (std::size_t i = 0; i < kBands; ++i) {
        const double x = std::clamp((static_cast<double>(i) - kFirst) / kStep, 0.0,
                                    static_cast<double>(illuminance.size()) - 1.001);
        const auto lower = static_cast<std::size_t>(x);
        e.at[i] = warm().at[i] * std::lerp(illuminance[lower], illuminance[lower + 1], x - std::floor(x));
    }
    return colour_quantities(e);
}

TEST(LightColour, Long_InColouredRooms_IsThatByBandsWithinTheStatedError) {
    const std::string lamp = fmt::format(
        "LightSource \"point\" \"point3 from\" [0 0 2.5] \"spectrum I\" {}\n", text_of(300 * warm()));
    const CalculationSurface surface = plane(0.75, 2, {1, 1});
    struct Paints {
        const double (&floor)[16], (&walls)[16], (&ceiling)[16];
    };
    for (const Paints& of :
         {Paints{kGreenPaint, kRedPaint, kBluePaint}, Paints{kRedPaint, kBluePaint, kRedPaint},
          Paints{kBluePaint, kGreenPaint, kGreenPaint}}) {
        const std::string world =
            room(spectrum_of(of.floor), spectrum_of(of.walls), spectrum_of(of.ceiling)) + lamp;
        const Measured found = measure_colour(world, surface, 4);
        EXPECT_EQ(found.colour.intervals, 9);
        const auto truth = by_bands(
            lamp, surface,
            [&](double nm) {
                return room(grey(at(of.floor, nm)), grey(at(of.walls, nm)), grey(at(of.ceiling, nm)));
            },
            4);
        const LightColour& mean = found.colour.surfaces[0].mean;
        for (std::size_t i = 0; i < kColourCount; ++i) {
            const double bound = mean.by_intervals[i] + mean.values[i].half_width;
            EXPECT_NEAR(mean.values[i].value, truth[i], bound) << kColourQuantities[i].name;
        }
        // A room of the mean colour is rejected.
        EXPECT_LT(mean.by_intervals[0] + mean.values[0].half_width,
                  std::fabs(truth[0] - colour_quantities(warm())[0]));
    }
}

TEST(LightColour, IsInTextTablesAndJson) {
    const std::string world = room(grey(0.3), grey(0.5), grey(0.8)) + lamps_at("0 0 2.5", 100, 100);
    CalculationSurface surface = plane(0.75, 2, {2, 1});
    surface.corner.x = 0;  // the second point lies outside the room, where no light comes
    surface.u.x = 6;
    const Measured found = measure_colour(world, surface, 2);
    EXPECT_THAT(colour_text(found.report, found.colour), HasSubstr("m-EDI [lx]"));
    EXPECT_TRUE(colour_text(found.report, {}).empty());
    const std::string csv = illuminance_csv(found.report, {}, found.colour);
    const Measured by_one_thread = measure_colour(world, surface, 2, 0, 1);
    EXPECT_EQ(illuminance_csv(by_one_thread.report, {}, by_one_thread.colour), csv);
    EXPECT_THAT(csv, HasSubstr(",CCT [K],half-width of 95 % of CCT [K],error of CCT by intervals [K],Duv,"));
    std::size_t columns = 0;
    for (std::size_t at = 0, end = csv.find('\n'); end != csv.npos; at = end + 1, end = csv.find('\n', at)) {
        const auto commas =
            static_cast<std::size_t>(std::count(csv.begin() + static_cast<std::ptrdiff_t>(at),
                                                csv.begin() + static_cast<std::ptrdiff_t>(end), ','));
        if (columns == 0) columns = commas;
        EXPECT_EQ(commas, columns);
    }
    const auto json = nlohmann::json::parse(illuminance_json(found.report, {}, {}, found.colour));
    EXPECT_EQ(json["wavelength_intervals"], 1);
    const auto& of = json["surfaces"][0];
    EXPECT_NEAR(of["values"][0]["colour"]["CCT"]["value"].get<double>(),
                of["colour"]["CCT"]["value"].get<double>(), 100);
    EXPECT_TRUE(of["values"][1]["colour"]["CCT"]["value"].is_null());
    EXPECT_FALSE(nlohmann::json::parse(illuminance_json(found.report)).contains("wavelength_intervals"));
}

TEST(LightColour, OfLightInWatts_IsRefused) {
    const std::string world = "LightSource \"point\" \"spectrum I\" \"stdillum-A\"\n";
    Monitor silent;
    IlluminanceOptions options;
    options.most_samples = 1;
    const auto read_in_watts = [&](const WorkingSpace& intervals) {
        SceneOverrides overrides;
        overrides.colours = intervals;
        return read_scene_text("Camera \"perspective\" Film \"rgb\" WorldBegin\n" + world, "scene.pbrt",
                               overrides, Workers{1}, silent);
    };
    IlluminanceReport report;
    report.samples = 1;
    EXPECT_THAT(error_of([&] {
                    colour_on(
                        report, read_in_watts, options, [] { return INFINITY; }, silent);
                }),
                HasSubstr("--unit photometric"));
}

}  // namespace light_colour_test
}  // namespace lucerna
