// Illuminance behind panes, which light passes in a straight line: the light that arrives without them times
// their transmittance by direction. The lamps are far smaller than paths would meet by chance.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "tests/lights/field_fixtures.h"
#include "tests/photometry/stated_intervals.h"
#include "tests/support/panes.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace panes_test {

using namespace lucerna::testing;

const V3d kLamp(0.2, -0.1, 1.5);
constexpr double kI = 300;  // in every downward direction

// A lamp of intensity kI at kLamp, or a sun, that shines down on the plane z = 0.
struct Lamp {
    std::string name, text;
    bool sun = false, disc = false;
};
const V3d kSunwards = V3d(0.4, 0.1, 1).normalized();
constexpr double kDiscRadius = 0.001;

std::vector<Lamp> lamps(const std::filesystem::path& folder) {
    std::ofstream(folder / "lamp.ies")
        << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n300 300\n";
    const std::string at = fmt::format("{} {} {}", kLamp.x, kLamp.y, kLamp.z);
    return {
        {"point", fmt::format("LightSource \"point\" \"rgb I\" [{0} {0} {0}] \"point3 from\" [{1}]", kI, at)},
        {"spot", fmt::format("LightSource \"spot\" \"rgb I\" [{0} {0} {0}] \"point3 from\" [{1}] \"point3 "
                             "to\" [{2} {3} 0] \"float coneangle\" 85 \"float conedeltaangle\" 5",
                             kI, at, kLamp.x, kLamp.y)},
        {"sun",
         fmt::format("LightSource \"distant\" \"rgb L\" [{0} {0} {0}] \"point3 from\" [{1} {2} {3}] \"point3 "
                     "to\" [0 0 0]",
                     kI, kSunwards.x, kSunwards.y, kSunwards.z),
         true},
        {"disc of 2 mm",
         fmt::format("AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource "
                     "\"diffuse\" \"rgb L\" [{0} {0} {0}] Translate {1} Rotate 180 1 0 0 Shape \"disk\" "
                     "\"float radius\" {2} AttributeEnd",
                     kI / (kPiD * kDiscRadius * kDiscRadius), at, kDiscRadius),
         false, true},
        {"IES", fmt::format("AttributeBegin Translate {} Rotate 180 1 0 0 LightSource \"ies\" \"string "
                            "filename\" \"lamp.ies\" "
                            "AttributeEnd",
                            at)}};
}

std::string pane_at(double z, double degrees = 0) {
    return fmt::format(
        "AttributeBegin Material \"thindielectric\" \"float eta\" 1.5 Translate 0 0 {} Rotate {} 0 1 0\n"
        "Shape \"bilinearmesh\" \"point3 P\" [-9 -9 0  9 -9 0  -9 9 0  9 9 0] AttributeEnd\n",
        z, degrees);
}

// Returns the illuminance at p without glass.
double without_glass(const Lamp& lamp, const V3d& p, const V3d& from = kLamp) {
    if (lamp.sun) return kI * kSunwards.z;
    const V3d way = from - p;
    if (lamp.disc)
        return under_disc(kI / (kPiD * kDiscRadius * kDiscRadius), std::hypot(way.x, way.y), way.z,
                          kDiscRadius);
    return kI * way.z / std::pow(way.length(), 3);
}
V3d towards(const Lamp& lamp, const V3d& p, const V3d& from = kLamp) {
    return lamp.sun ? kSunwards : (from - p).normalized();
}
// Returns the light that passes two horizontal panes `distance` apart. Light reflected n times between them
// arrives as if from a lamp that is 2n times their distance higher.
double behind_two_panes(const Lamp& lamp, const V3d& p, double distance) {
    double sum = 0;
    for (int n = 0; n < 8; ++n) {
        const V3d from = kLamp + V3d(0, 0, 2 * n * distance);
        const double passed = pane_transmittance(towards(lamp, p, from).z);
        sum += without_glass(lamp, p, from) * sqr(passed) * std::pow(1 - passed, 2 * n);
    }
    return sum;
}

// Behind an IES lamp 1 lx is 1 lm/m², and the other lamps' numbers are in W; each lamp is alone in its scene,
// so the readings compare directly.
TEST(IlluminanceBehindPanes, Nightly_OfSmallLampsAndSuns_IsTheirTransmittanceTimesWhatArrivesWithoutThem) {
    const TemporaryFolder folder;
    const CalculationSurface surface = plane(0, 3, {12, 12});
    const V3d turned(std::sin(20 * kPiD / 180), 0,
                     std::cos(20 * kPiD / 180));  // normal of a pane tilted by 20 degrees
    for (const Lamp& lamp : lamps(folder.path())) {
        SCOPED_TRACE(lamp.name);
        const auto at = [&](const std::string& panes) {
            return measure(job_of(lamp.text + "\n" + panes, folder.path()), surface, 4).surfaces[0];
        };
        const auto passed = [&](const V3d& p, int n) {
            return without_glass(lamp, p) * std::pow(pane_transmittance(towards(lamp, p).z), n);
        };
        expect_as_stated(at(""), [&](const V3d& p) { return passed(p, 0); });
        const SurfaceIlluminance one = at(pane_at(0.7));
        expect_as_stated(one, [&](const V3d& p) { return passed(p, 1); });
        EXPECT_NEAR(one.direct, one.mean.value, 1e-5 * one.mean.value) << "it is booked as direct light";
        const SurfaceIlluminance two = at(pane_at(0.7) + pane_at(1.1));
        // Neighbouring points share the light paths that find the inter-reflected light, so their errors are
        // correlated.
        const auto mean = [&](const Truth& truth) {
            double sum = 0;
            for (int y = 0; y < 12; ++y) {
                for (int x = 0; x < 12; ++x) sum += truth(surface.position(x, y)) / 144;
            }
            return sum;
        };
        EXPECT_NEAR(two.mean.value, mean([&](const V3d& p) { return behind_two_panes(lamp, p, 0.4); }),
                    2 * two.mean.half_width);
        if (!lamp.sun) {  // a sun's interval is wider than the inter-reflected light
            EXPECT_GT(two.mean.value,
                      mean([&](const V3d& p) { return passed(p, 2); }) + 2 * two.mean.half_width);
        }
        expect_as_stated(at(pane_at(0.7, 20)), [&](const V3d& p) {
            return without_glass(lamp, p) * pane_transmittance(std::fabs(towards(lamp, p).dot(turned)));
        });
        // The test must reject the transmittance at normal incidence in all directions.
        EXPECT_FALSE(as_stated(
            misses(one, [&](const V3d& p) { return without_glass(lamp, p) * pane_transmittance(1); })));
    }
}

// A measured lamp's light has no closed form, so the lamp without a pane is the reference.
TEST(IlluminanceBehindPanes, Long_OfAMeasuredLamp_IsTheirTransmittanceTimesWhatArrivesWithoutThem) {
    const TemporaryFolder folder;
    write_light_field(folder / "field.exr", lambertian_disc(rig_b(), 0.008));
    const std::string lamp = fmt::format(
        "AttributeBegin Translate {} {} {} Rotate 180 1 0 0 LightSource \"lightfield\" \"string filename\" "
        "\"field.exr\" AttributeEnd\n",
        kLamp.x, kLamp.y, kLamp.z);
    const CalculationSurface surface = plane(0, 1, {6, 6});
    const auto at = [&](const std::string& panes) {
        return measure(job_of(lamp + panes, folder.path()), surface, 64).surfaces[0];
    };
    const SurfaceIlluminance without = at("");
    ASSERT_GT(without.least.value, 0);
    const auto ratio_holds = [&](const SurfaceIlluminance& behind, int n) {
        int missed = 0;
        for (int y = 0; y < 6; ++y) {
            for (int x = 0; x < 6; ++x) {
                // Returns the share that arrives of a Lambertian disc and, for two panes, of its images.
                const auto share = [&](int images) {
                    const V3d way = kLamp + V3d(0, 0, 0.8 * images) - surface.position(x, y);
                    const double passed = pane_transmittance(way.z / way.length());
                    return sqr(way.z) / sqr(way.length2()) * std::pow(passed, n) *
                           std::pow(1 - passed, 2 * images);
                };
                double t = 0;
                for (int images = 0; images < (n == 2 ? 8 : 1); ++images) t += share(images);
                const V3d way = kLamp - surface.position(x, y);
                t /= sqr(way.z) / sqr(way.length2());
                const Reading95 &a = without.at(x, y).all, &b = behind.at(x, y).all;
                missed += std::fabs(b.value - t * a.value) > std::hypot(b.half_width, t * a.half_width);
            }
        }
        return as_stated({missed, 36});
    };
    const SurfaceIlluminance one = at(pane_at(0.7)), two = at(pane_at(0.7) + pane_at(1.1));
    EXPECT_TRUE(ratio_holds(one, 1));
    EXPECT_TRUE(ratio_holds(two, 2));
    EXPECT_FALSE(ratio_holds(one, 0));
    EXPECT_FALSE(ratio_holds(two, 1));
}

// A lamp of 1000 lm 5 cm behind a pane, seen from 2 m, gives 79.58 lx without the pane, which passes 0.9231
// of it. Light reflected between the floor and the pane adds some hundredths of a lux.
constexpr const char* kLedBehindAPane = R"(Option "string unit" "photometric"
LookAt 0 0 -3  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 16 "integer yresolution" 16
WorldBegin
AttributeBegin
Material "diffuse" "rgb reflectance" [0 0 0]
AreaLightSource "diffuse" "rgb L" [25330296 25330296 25330296]
Shape "disk" "float radius" 0.002
AttributeEnd
AttributeBegin
Material "thindielectric" "float eta" 1.5
Translate 0 0 0.05
Shape "disk" "float radius" 0.2
AttributeEnd
Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
Translate 0 0 2.001
Shape "disk" "float radius" 2
)";

TEST(IlluminanceBehindPanes, Long_OfALedCloseToAPane_EndsByPrecisionWithTheRightValue_WithAndWithoutAGrid) {
    CalculationSurface p;
    p.name = "p";
    p.corner = {0, 0, 2};
    p.u = {0, 1e-6, 0};
    p.v = {1e-6, 0, 0};
    p.normal = {0, 0, -1};
    p.up = {0, 1, 0};
    p.points = {1, 1};
    CalculationSurface grid = p;
    grid.name = "g";
    grid.corner = {-1, -1, 2};
    grid.u = {0, 2, 0};
    grid.v = {2, 0, 0};
    grid.points = {6, 6};
    for (const bool with_grid : {false, true}) {
        Monitor silent;
        Job job = read_scene_text(kLedBehindAPane, "ledonly.pbrt", {}, Workers{2}, silent);
        IlluminanceOptions options;
        options.workers = {2};
        options.precision = 0.005;
        std::vector<CalculationSurface> surfaces{p};
        if (with_grid) surfaces.push_back(grid);
        const IlluminanceReport report = illuminance_on(surfaces, std::move(job), options, silent);
        EXPECT_EQ(report.ended_by, "precision");
        EXPECT_EQ(report.unit, "lx");
        const PointIlluminance& found = report.surfaces[0].points[0];
        const double direct = 1000 / kPiD / 4 * pane_transmittance(1);
        EXPECT_NEAR(found.direct, direct, 0.001 * direct);
        EXPECT_NEAR(found.all.value, 73.5, 0.05 + found.all.half_width);
        EXPECT_LT(found.all.half_width, 0.01 * 73.5);
    }
}

// The direct light of a sun through a window is, wherever it reaches a receiver, the light without the pane
// times the pane's transmittance.
TEST(IlluminanceBehindPanes, OfASunThroughAnOfficeWindow_IsTheWindowsTransmittanceTimesThatWithout) {
    LUCERNA_NEED_DATA(file, "faults/window/sun-through-window.pbrt");
    const auto direct_sun = [](const std::filesystem::path& name) {
        std::ifstream in(name);
        std::string text{std::istreambuf_iterator<char>(in), {}};
        const std::string sky = "LightSource \"infinite\" \"rgb L\" [ 5000 5000 5000 ]";
        const auto at = text.find(sky);
        EXPECT_NE(at, std::string::npos);
        text.erase(at, sky.size());
        Monitor silent;
        Job job = read_scene_text(text, name, {}, Workers{2}, silent);
        CalculationSurface desks;  // the middle of the room at desk height; y is up, x mirrored
        desks.name = "desks";
        const V3d origin = V3d(job.scene.bounds().min) + job.scene.origin();
        const V3d far_end = V3d(job.scene.bounds().max) + job.scene.origin();
        desks.corner = {origin.x + 0.3, 0.75, origin.z + 0.3};
        desks.u = {0, 0, far_end.z - origin.z - 0.6};
        desks.v = {far_end.x - origin.x - 0.6, 0, 0};
        desks.normal = desks.up = {0, 1, 0};
        desks.points = {24, 16};
        return measure(std::move(job), desks, 1).surfaces[0];
    };
    const SurfaceIlluminance with = direct_sun(file);
    const SurfaceIlluminance without = direct_sun(file.parent_path() / "sun-without-pane.pbrt");
    // The window is perpendicular to x.
    const double pane = pane_transmittance(V3d(0.6, 1, 0.8).normalized().x);
    int lit = 0;
    for (std::size_t i = 0; i < with.points.size(); ++i) {
        const double direct = without.points[i].direct;
        lit += direct > 1000;
        EXPECT_NEAR(with.points[i].direct, pane * direct, 1e-3 * direct + 1e-6);
    }
    EXPECT_GT(lit, 5);
}

}  // namespace panes_test
}  // namespace lucerna
