// Tests whether the interval of an illuminance covers the truth as often as stated, in realistic rooms. The
// measured quantity is the mean illuminance of the points of a square metre of floor; the truth comes from
// light paths of the lamps that are counted where they arrive, on small discs around the points.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "lights/light_field.h"
#include "lights/measurement/acquire.h"
#include "photon/light_path.h"
#include "photon/trace_light_paths.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace coverage_test {

using namespace lucerna::testing;

// Rooms are 4 m x 4 m x 2.6 m from the origin, z up. The measured square of the floor begins at (kFrom,
// kFrom).
constexpr double kFrom = 1.5;
constexpr int kPoints = 5;
constexpr double kDisc = 0.04;  // radius of the discs on which light paths are counted

std::string quad(const std::string& corners) {
    return "Shape \"bilinearmesh\" \"point3 P\" [" + corners + "]\n";
}
std::string white(double reflectance) {
    return fmt::format("Material \"diffuse\" \"rgb reflectance\" [{0} {0} {0}]\n", reflectance);
}
// Returns all walls but x = 4.
std::string walls() {
    return white(0.3) + quad("0 0 0  4 0 0  0 4 0  4 4 0") + white(0.7) +
           quad("0 0 2.6  0 4 2.6  4 0 2.6  4 4 2.6") + white(0.5) + quad("0 0 0  0 4 0  0 0 2.6  0 4 2.6") +
           quad("0 0 0  0 0 2.6  4 0 0  4 0 2.6") + quad("0 4 0  4 4 0  0 4 2.6  4 4 2.6");
}
std::string closed() {
    return walls() + quad("4 0 0  4 0 2.6  4 4 0  4 4 2.6");
}
std::string disc_lamp(double x, double y, double z, double radius, double flux) {
    return fmt::format(
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nAreaLightSource \"diffuse\" "
        "\"rgb L\" [{0} {0} {0}] Translate {1} {2} {3} Rotate 180 1 0 0\nShape \"disk\" \"float "
        "radius\" {4} AttributeEnd\n",
        flux / (kPiD * kPiD * radius * radius), x, y, z, radius);
}
std::string of(const std::string& material, const std::string& shape) {
    return "AttributeBegin Material " + material + "\n" + shape + "AttributeEnd\n";
}

struct Room {
    std::string name, world, camera_medium = {};
};

// Acquires a lamp of 2 cm whose beam is 30 degrees wide into a light field, and returns its file.
std::filesystem::path measured_lamp(const TemporaryFolder& folder) {
    Rig rig;
    rig.views = {9, 9};
    rig.spacing = {0.004, 0.004};
    rig.pixels = {32, 32};
    rig.pixel = {0.01, 0.01};
    rig.distance = 0.1;
    const EmitterModel beam = cosine_emitter(EmitterModel::Outline::disc, V2d(0.01), 100, 20);
    Monitor silent;
    const std::filesystem::path file = folder / "beam.exr";
    write_light_field(file, acquire(beam, rig, Workers{2}, silent));
    return file;
}

// `lamp` is the file of a measured lamp.
std::vector<Room> rooms(const std::filesystem::path& lamp) {
    const std::string pane = "\"thindielectric\" \"float eta\" 1.5";
    const std::string beam =
        fmt::format("LightSource \"lightfield\" \"string filename\" \"{}\" \"float power\" ", lamp.string());
    return {
        {"measured lamp above a ball",
         closed() + disc_lamp(1, 1, 2.59, 0.1, 50) + "AttributeBegin Translate 2 2 2.3 Rotate 180 1 0 0\n" +
             beam + "50\nAttributeEnd\n" +
             of("\"dielectric\"", "Translate 2 2 2.2 Shape \"sphere\" \"float radius\" 0.04\n")},
        {"measured lamp through a lens",
         closed() + disc_lamp(3, 3, 2.59, 0.1, 50) +
             "AttributeBegin Translate 0.5 2 1.2 Rotate 90 0 1 0 Rotate 35 0 1 0\n" + beam +
             "50\nAttributeEnd\n" +
             of("\"dielectric\"",
                "Translate 0.5655 2 1.154 Rotate 35 0 1 0 Scale 0.3 1 1 Shape \"sphere\" "
                "\"float radius\" 0.05\n")},
        {"window with sun",
         "LightSource \"infinite\" \"rgb L\" [1 1 1]\nLightSource \"distant\" \"rgb L\" [8 8 8] \"point3 "
         "from\" "
         "[1 0.2 0.7] \"point3 to\" [0 0 0]\n" +
             walls() + quad("4 0 0  4 0 0.8  4 4 0  4 4 0.8") + quad("4 0 2.2  4 0 2.6  4 4 2.2  4 4 2.6") +
             quad("4 0 0.8  4 0 2.2  4 0.8 0.8  4 0.8 2.2") + quad("4 3.2 0.8  4 3.2 2.2  4 4 0.8  4 4 2.2") +
             of(pane, quad("4 0.8 0.8  4 0.8 2.2  4 3.2 0.8  4 3.2 2.2"))},
        {"glass partition", closed() + disc_lamp(1, 1, 2.59, 0.1, 100) + disc_lamp(3, 3, 2.59, 0.1, 100) +
                                of(pane, quad("0 1.4 0  0 1.4 2.6  4 1.4 0  4 1.4 2.6"))},
        {"glass table",
         closed() + disc_lamp(2, 2, 2, 0.1, 100) + of(pane, quad("1 1 0.75  3 1 0.75  1 3 0.75  3 3 0.75"))},
        {"mirror", closed() + disc_lamp(1, 2, 2.59, 0.2, 100) +
                       of("\"mirror\" \"rgb reflectance\" [0.9 0.9 0.9]",
                          quad("3.99 0.5 0.1  3.99 0.5 2.5  3.99 3.5 0.1  3.99 3.5 2.5"))},
        {"spot behind a lens",
         closed() + disc_lamp(1, 1, 2.59, 0.1, 50) + disc_lamp(2, 2, 2.3, 0.005, 50) +
             of("\"dielectric\"", "Translate 2 2 2.2 Shape \"sphere\" \"float radius\" 0.04\n")},
        {"fog", closed() + disc_lamp(2, 2, 2.59, 0.1, 100),
         "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.02 0.02 0.02] \"rgb "
         "sigma_s\" "
         "[0.2 0.2 0.2]\nMediumInterface \"\" \"fog\"\n"},
    };
}

Job job_of(const Room& room) {
    Monitor silent;
    return read_scene_text(
        room.camera_medium + "LookAt 2 0.5 1  2 2 1  0 0 1 Camera \"perspective\" Film \"rgb\" WorldBegin\n" +
            room.world,
        "scene.pbrt", {}, Workers{2}, silent);
}

// Counts the flux that light paths bring to the discs around the points.
struct Count : LightPathVisitor {
    V3d origin{0, 0, 0};
    double flux = 0;
    void hit(const LightPathHit& at) {
        const V3d p = V3d(at.hit.at.p) + origin;
        if (at.d.z < 0 && std::fabs(p.z) < 1e-3 && is_near_a_point(p.x - kFrom, p.y - kFrom))
            flux += double{luminance(at.power)};
    }

  private:
    // Takes coordinates from the square's corner. The points are the centres of kPoints x kPoints cells.
    static bool is_near_a_point(double x, double y) {
        if (!(x > 0 && x < 1 && y > 0 && y < 1)) return false;
        const auto off = [](double along) { return along - (std::floor(along * kPoints) + 0.5) / kPoints; };
        return std::hypot(off(x), off(y)) < kDisc;
    }
};
RunningStats counted(const Room& room, std::int64_t paths_of_run) {
    constexpr int kRuns = 32;
    const Job job = job_of(room);
    std::vector<double> found(kRuns);
    parallel_each(Workers{2}, kRuns, 1, [&](std::size_t run) {
        Count count;
        count.origin = job.scene.origin();
        LightPathRequest paths;
        paths.seed = 100 + run;
        paths.count = paths_of_run;
        trace_chunk(job.scene, paths, samplers_of(paths), 0, paths_of_run, count);
        found[run] =
            count.flux / (static_cast<double>(paths_of_run) * kPoints * kPoints * kPiD * kDisc * kDisc);
    });
    RunningStats stats;
    for (const double value : found) stats.add(value);
    return stats;
}

// Readings of many seeds. The counted light paths know the truth less precisely than one reading does, so two
// questions are asked: whether each interval covers the mean of all readings, and whether that mean agrees
// with the truth as well as it is known. Both hold only if the intervals cover the truth.
struct Coverage {
    std::vector<Reading95> readings;
    RunningStats means;
    int warned = 0;

    int seeds() const { return static_cast<int>(readings.size()); }
    // Counts the intervals, scaled by `share`, that cover the mean of all readings.
    int held(double share = 1) const {
        return static_cast<int>(std::count_if(readings.begin(), readings.end(), [&](const Reading95& r) {
            return std::fabs(r.value - means.mean()) <= share * r.half_width;
        }));
    }
    double half_width() const {
        double sum = 0;
        for (const Reading95& r : readings) sum += r.half_width / seeds();
        return sum;
    }
    bool is(const RunningStats& truth) const {
        return std::fabs(means.mean() - truth.mean()) <=
               4.5 * std::hypot(means.standard_error(), truth.standard_error());
    }
};
Coverage coverage_of(const Room& room, int seeds) {
    CalculationSurface square;
    square.name = "square";
    square.corner = {kFrom, kFrom, 0};
    square.u = {1, 0, 0};
    square.v = {0, 1, 0};
    square.normal = {0, 0, 1};
    square.up = {0, 1, 0};
    square.points = {kPoints, kPoints};
    Coverage coverage;
    for (int seed = 0; seed < seeds; ++seed) {
        Monitor silent;
        IlluminanceOptions options;
        options.workers = {2};
        options.seed = static_cast<std::uint64_t>(seed);
        options.most_samples = 1;
        const SurfaceIlluminance found =
            illuminance_on(std::vector{square}, job_of(room), options, silent).surfaces[0];
        coverage.readings.push_back(found.mean);
        coverage.means.add(found.mean.value);
        coverage.warned += found.never_met > 0;
    }
    return coverage;
}

// Returns whether 95 % intervals would cover this few readings with a probability below kFalseAlarm.
bool too_few(int held, int of) {
    return cdf(boost::math::binomial(of, 0.95), held) < kFalseAlarm;
}

std::string told(const Room& room, const Coverage& coverage, const RunningStats& truth) {
    return fmt::format(
        "{}: {} of {} intervals hold, {:.4f} +- {:.4f}, scatter {:.4f}, counted {:.4f} +- {:.4f}, {} "
        "warnings\n",
        room.name, coverage.held(), coverage.seeds(), coverage.means.mean(), coverage.half_width(),
        kStandardErrors95 * std::sqrt(coverage.means.variance()), truth.mean(),
        kStandardErrors95 * truth.standard_error(), coverage.warned);
}

// Where a table, a partition or a lens hides small lamps from most of the floor, paths from the floor rarely
// meet them.
TEST(LuxCoverage, Nightly_WhereLampsAreMetSeldom_IsAsStated) {
    constexpr int kSeeds = 12;
    const TemporaryFolder folder;
    for (const Room& room : rooms(measured_lamp(folder))) {
        if (room.name != "glass partition" && room.name != "spot behind a lens") continue;
        const RunningStats truth = counted(room, 60'000);
        const Coverage coverage = coverage_of(room, kSeeds);
        EXPECT_FALSE(too_few(coverage.held(), kSeeds)) << told(room, coverage, truth);
        EXPECT_TRUE(coverage.is(truth)) << told(room, coverage, truth);
        EXPECT_LT(coverage.half_width(), 0.04 * coverage.means.mean()) << told(room, coverage, truth);
    }
}

TEST(LuxCoverage, Nightly_OfEightRooms_IsAsStated) {
    constexpr int kSeeds = 40;
    const TemporaryFolder folder;
    int held = 0, by_half = 0, of = 0;
    for (const Room& room : rooms(measured_lamp(folder))) {
        const RunningStats truth = counted(room, 400'000);
        const Coverage coverage = coverage_of(room, kSeeds);
        std::cout << told(room, coverage, truth) << std::flush;
        EXPECT_FALSE(too_few(coverage.held(), kSeeds)) << room.name;
        EXPECT_TRUE(coverage.is(truth)) << room.name;
        held += coverage.held();
        by_half += coverage.held(0.5);
        of += kSeeds;
    }
    EXPECT_GE(held, 0.90 * of);
    EXPECT_LE(held, 0.99 * of);
    EXPECT_LT(by_half, 0.90 * of) << "half as wide intervals are refused";
}

}  // namespace coverage_test
}  // namespace lucerna
