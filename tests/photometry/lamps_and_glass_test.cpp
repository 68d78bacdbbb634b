// Tests every kind of small lamp behind every kind of glass by every method, at one point of known
// illuminance: each method either finds it or reports that it does not. All methods find light that passes
// panes in a straight line. Only photons find light that mirrors and curved or thick glass deflect; paths
// from the receiver meet a small lamp behind them at best by chance.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/glare.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/observer.h"
#include "engine/render/chance_light.h"
#include "engine/render/render.h"
#include "engine/scene/path_limits.h"
#include "photon/light_path.h"
#include "photon/trace_light_paths.h"
#include "tests/lights/field_fixtures.h"
#include "tests/photometry/stated_intervals.h"
#include "tests/support/panes.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace lamps_and_glass_test {

using namespace lucerna::testing;

// Lamps stand at the origin and shine along z; a sun comes from the side. The receiver faces them.
const V3d kPlace(0.1, 0, 1.4);
constexpr double kI = 100, kDisc = 0.002, kField = 0.008, kOpening = 0.01, kMirrorX = -0.5, kMirror = 0.9;
constexpr double kNear = 0.1;                   // radius about the point for density estimates
const V3d kSun = V3d(-0.3, 0, 1).normalized();  // direction of its light

struct Lamp {
    std::string name, text;
    bool sun = false;
    // The intensity towards a unit direction; none if there is no closed form.
    std::optional<double> intensity = kI;
    bool by_cosine = false;
    double area = 0;  // luminous area of a flat lamp; 0: it has no luminance
};
std::vector<Lamp> every_lamp(const std::filesystem::path& folder) {
    std::ofstream(folder / "lamp.ies")
        << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0.01 0.01 0\n1 1 10\n0 90\n0\n100 100\n";
    write_light_field(folder / "field.exr", lambertian_disc(rig_b(), kField));
    const auto grey = [](double value) { return fmt::format("[{0} {0} {0}]", value); };
    return {{"point", "LightSource \"point\" \"rgb I\" " + grey(kI)},
            {"spot",
             "LightSource \"spot\" \"point3 to\" [0 0 1] \"float coneangle\" 50 \"float conedeltaangle\" 2 "
             "\"rgb I\" " +
                 grey(kI)},
            {"sun",
             fmt::format("LightSource \"distant\" \"point3 to\" [{} {} {}] \"rgb L\" {}", kSun.x, kSun.y,
                         kSun.z, grey(kI)),
             true},
            {"disc of 2 mm",
             fmt::format("AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nAreaLightSource "
                         "\"diffuse\" \"rgb L\" {} Shape \"disk\" \"float radius\" {} AttributeEnd",
                         grey(kI / (kPiD * kDisc * kDisc)), kDisc),
             false, kI, true, kPiD * kDisc * kDisc},
            {"measured lamp",
             "LightSource \"lightfield\" \"string filename\" \"field.exr\"",
             false,
             {},
             true,
             kPiD * kField * kField},
            {"IES lamp", "LightSource \"ies\" \"string filename\" \"lamp.ies\"", false, kI, false,
             kOpening * kOpening}};
}

enum class Bends : std::uint8_t {
    nothing,
    some
};  // whether light arrives on other ways than the straight one
struct Glass {
    std::string name;
    int panes = 0;
    Bends bends = Bends::nothing;
    bool hides = false;  // whether it blocks the straight way
};
const std::vector<Glass> kStraight{{"no glass"}, {"pane", 1}, {"two panes", 2}};
const std::vector<Glass> kBent{
    {"slab", 0, Bends::some, true}, {"glass ball", 0, Bends::some, true}, {"mirror", 0, Bends::some}};
constexpr double kTurned = 40;  // degrees by which panes and slabs are turned about y

// Returns the point at height z on the straight line to the measured point.
V3d on_way(const Lamp& lamp, double z) {
    return lamp.sun ? kPlace - (kPlace.z - z) / kSun.z * kSun : kPlace * (z / kPlace.z);
}

std::string text_of(const Lamp& lamp, const Glass& glass, const std::string& around = {}) {
    const std::string sheet =
        "Shape \"bilinearmesh\" \"point3 P\" [-0.5 -0.5 0  0.5 -0.5 0  -0.5 0.5 0  0.5 0.5 0]\n";
    const auto at = [&](double z, const std::string& turned) {
        const V3d p = on_way(lamp, z);
        return fmt::format("Translate {} {} {} {}\n", p.x, p.y, p.z, turned);
    };
    const std::string oblique = fmt::format("Rotate {} 0 1 0", kTurned);
    std::string text = fmt::format(
        "LookAt {0} {1} {2}  {0} {1} 9  0 1 0 Camera \"perspective\" \"float fov\" 0.5\n"
        "Film \"rgb\" \"integer xresolution\" 2 \"integer yresolution\" 2 WorldBegin\n{3}\n{5}\n"
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0.001 0.001 0.001] Translate {0} {1} {4}\n"
        "Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 0.5 AttributeEnd\n",
        kPlace.x, kPlace.y, kPlace.z - 0.2, lamp.text, kPlace.z, around);
    for (int i = 0; i < glass.panes; ++i)
        text += "AttributeBegin Material \"thindielectric\"\n" + at(0.6 + 0.15 * i, oblique) + sheet +
                "AttributeEnd\n";
    if (glass.name == "slab")
        text += "AttributeBegin Material \"dielectric\"\n" + at(0.6, oblique) + sheet +
                "Translate 0 0 -0.06 ReverseOrientation " + sheet + "AttributeEnd\n";
    if (glass.name == "glass ball")
        text += "AttributeBegin Material \"dielectric\"\n" + at(0.6, "") +
                "Shape \"sphere\" \"float radius\" 0.15\nAttributeEnd\n";
    if (glass.name == "mirror")
        text += fmt::format(
            "AttributeBegin Material \"mirror\" \"rgb reflectance\" [{0} {0} {0}]\nShape \"bilinearmesh\" "
            "\"point3 P\" [{1} -0.6 -1  {1} 0.6 -1  {1} -0.6 1.5  {1} 0.6 1.5] AttributeEnd\n",
            kMirror, kMirrorX);
    return text;
}

Job job_for(const Lamp& lamp, const Glass& glass, const std::filesystem::path& folder,
            const SceneOverrides& overrides = {}) {
    Monitor silent;
    return read_scene_text(text_of(lamp, glass), folder / "scene.pbrt", overrides, Workers{2}, silent);
}

// Counts the flux that light paths bring to a disc about the measured point.
struct Count : LightPathVisitor {
    V3d origin{0, 0, 0};  // of the scene's coordinates
    double flux = 0;
    void hit(const LightPathHit& at) {
        const V3d p = V3d(at.hit.at.p) + origin;
        if (std::fabs(p.z - kPlace.z) < 1e-4 && at.d.z > 0 && (p - kPlace).length() < kNear)
            flux += double{luminance(at.power)};
    }
};
RunningStats count_light_paths(const Job& job) {
    constexpr int kRuns = 16;
    constexpr std::uint32_t kPaths = 20'000;
    std::vector<double> found(kRuns);
    parallel_each(Workers{2}, kRuns, 1, [&](std::size_t run) {
        Count count;
        count.origin = job.scene.origin();
        LightPathRequest paths;
        paths.seed = 1000 + run;
        paths.count = kPaths;
        trace_chunk(job.scene, paths, samplers_of(paths), 0, kPaths, count);
        found[run] = count.flux / (kPaths * kPiD * kNear * kNear);
    });
    RunningStats stats;
    for (const double value : found) stats.add(value);
    return stats;
}

bool has(const ListeningMonitor& monitor, const std::string& part) {
    return std::any_of(monitor.warnings.begin(), monitor.warnings.end(),
                       [&](const auto& line) { return line.find(part) != std::string::npos; });
}

// The value that `lucerna lux` prints, and whether a warning reports that some of it is blurred.
struct Reading {
    Reading95 reading;
    bool warned = false;
};
Reading by_lux(const Lamp& lamp, const Glass& glass, const std::filesystem::path& folder, int samples = 4) {
    CalculationSurface p;
    p.name = "p";
    p.corner = kPlace - V3d(5e-7, 5e-7, 1e-4);
    p.u = {0, 1e-6, 0};
    p.v = {1e-6, 0, 0};
    p.normal = {0, 0, -1};
    p.up = {0, 1, 0};
    p.points = {1, 1};
    ListeningMonitor monitor;
    IlluminanceOptions options;
    options.workers = {2};
    options.most_samples = samples;
    const IlluminanceReport report =
        illuminance_on(std::vector{p}, job_for(lamp, glass, folder), options, monitor);
    return {report.surfaces[0].points[0].all, has(monitor, "too small for path tracing")};
}

// A reading that is wrong by the factor kWrong must be rejected wherever the illuminance is known to the
// relative precision kKnown.
constexpr double kWrong = 0.5, kKnown = 0.01;

struct Truth {
    double value = 0, error = 0;  // standard error
};
Truth truth_of(const Lamp& lamp, const Glass& glass, const std::filesystem::path& folder) {
    if (glass.bends == Bends::some && (!lamp.intensity || glass.hides)) {
        const RunningStats counted = count_light_paths(job_for(lamp, glass, folder));
        return {counted.mean(), counted.standard_error()};
    }
    const auto from = [&](const V3d& place, const V3d& sun) {
        if (lamp.sun) return kI * sun.z;
        const V3d way = kPlace - place;
        const double cosine = way.z / way.length();
        return kI * (lamp.by_cosine ? cosine : 1) * cosine / way.length2();
    };
    const V3d way = lamp.sun ? kSun : kPlace.normalized();
    const double a = kTurned * kPiD / 180;
    const double pane = pane_transmittance(way.dot(V3d(std::sin(a), 0, std::cos(a))));
    if (!lamp.intensity) {
        const Reading95 reading = by_lux(lamp, {"no glass"}, folder, 16).reading;
        const double passed = std::pow(pane, glass.panes);
        return {passed * reading.value, passed * reading.half_width / 2};
    }
    double e = from({0, 0, 0}, kSun) * std::pow(pane, glass.panes);
    if (glass.name == "mirror") e += kMirror * from({2 * kMirrorX, 0, 0}, kSun);
    return {e, 0};
}

// Returns whether readings by several seeds agree with the truth: it lies within `bias` of their mean, or
// Student's t finds them this far apart with a probability above kFalseAlarm.
bool hold(const RunningStats& readings, const Truth& truth, double bias) {
    const double low = truth.value * (1 - bias) - 4 * truth.error,
                 high = truth.value * (1 + bias) + 4 * truth.error;
    const double nearest = std::clamp(readings.mean(), low, high);
    return nearest == readings.mean() || t_test(readings, nearest) > kFalseAlarm;
}

struct Method {
    std::string name;
    std::vector<std::pair<std::string, std::string>> set;
    int spp;
    double bias;   // tolerated where light is deflected
    double wrong;  // a multiple of the truth that must be rejected there
};
// Photons are counted within the same radius as the truth. The radius of igi's caustic estimate cannot be
// set; at the centre of the ball's caustic, which is brighter than its surroundings, it finds one and a half
// times the truth.
std::vector<Method> photon_methods() {
    const std::string near = fmt::format("{}", kNear);
    return {
        {"photonmap",
         {{"photons", "60000"}, {"radius", near}, {"k", "0"}, {"kernel", "constant"}, {"boundary", "none"}},
         4,
         0.02,
         1.5},
        {"progressive", {{"photons", "30000"}, {"radius", near}, {"alpha", "1"}}, 8, 0.02, 1.5},
        {"igi", {{"nlights", "16"}, {"nsets", "4"}, {"causticpaths", "40000"}}, 4, 0.5, 4}};
}

struct Found {
    RunningStats readings;  // one per seed
    bool warned = false;  // whether it warns that a path tracer's image lacks light, as `lucerna render` does
};
Found by_rendering(const Lamp& lamp, const Glass& glass, const Method& method, int seeds,
                   const std::filesystem::path& folder) {
    SceneOverrides overrides;
    overrides.integrator = method.name;
    overrides.set = method.set;
    overrides.set.emplace_back("quantity", "illuminance");
    overrides.spp = method.spp;
    Job job = job_for(lamp, glass, folder, overrides);
    if (auto* progressive = std::get_if<ProgressiveSettings>(&job.integrator)) {
        progressive->estimate.kernel = KernelShape::constant;
        progressive->estimate.boundary = Boundary::none;
    }
    job.film.chance = method.name == "path" && has_chance_light(job.scene);
    const Workers workers{2};
    Monitor silent;
    Found found;
    for (int seed = 1; seed <= seeds; ++seed) {
        const RenderResult result = render(job, {static_cast<std::uint64_t>(seed), workers}, silent);
        double mean = 0;
        for (int i = 0; i < 4; ++i) mean += double{luminance(result.image.rgb_at(i % 2, i / 2))} / 4;
        found.readings.add(mean);
        if (!job.film.chance || seed > 1) continue;
        const ChanceLight there = chance_light_in_view(job, {job.scene, 0, kMaxBounces, workers, silent});
        found.warned = missing_in(job, result, there).missing > 0;
    }
    return found;
}

// Finite lamps, the size of the image's patch and inter-reflection between two panes change closed forms by
// up to half a per cent.
constexpr double kClosed = 0.005;

std::string cell(const Lamp& lamp, const Glass& glass, const std::string& method) {
    return lamp.name + ", " + glass.name + ", " + method;
}

TEST(LampsAndGlass, Long_BehindPanes_EveryMethodFindsEveryLamp) {
    const TemporaryFolder folder;
    for (const Lamp& lamp : every_lamp(folder.path())) {
        for (const Glass& glass : kStraight) {
            const Truth truth = truth_of(lamp, glass, folder.path());
            ASSERT_GT(truth.value, 0);
            const Reading lux = by_lux(lamp, glass, folder.path());
            // The closed form excludes the light reflected between two panes, which for wide panes amounts to
            // this.
            const V3d normal(std::sin(kTurned * kPiD / 180), 0, std::cos(kTurned * kPiD / 180));
            const V3d way = lamp.sun ? kSun : kPlace;
            const double back = 1 - pane_transmittance(std::fabs(way.normalized().dot(normal)));
            const double most = glass.panes == 2 ? truth.value / (1 - sqr(back)) : truth.value;
            const double margin = kClosed * truth.value + 2 * lux.reading.half_width + 4 * truth.error;
            EXPECT_GT(lux.reading.value, truth.value - margin) << cell(lamp, glass, "lux");
            EXPECT_LT(lux.reading.value, most + margin) << cell(lamp, glass, "lux");
            // Two panes reflect light between them, which the warning reports as missing.
            EXPECT_FALSE(lux.warned && glass.panes < 2) << cell(lamp, glass, "lux");
            std::vector<Method> methods = photon_methods();
            methods.push_back({"path", {}, 16, 0, 0});
            for (const Method& method : methods) {
                const int seeds = glass.panes > 1 ? 8 : 4;
                const Found found = by_rendering(lamp, glass, method, seeds, folder.path());
                // Photons also find the light reflected between two panes.
                const double bias = glass.panes > 1 ? 0.02 : kClosed;
                EXPECT_TRUE(hold(found.readings, truth, bias))
                    << cell(lamp, glass, method.name) << ": " << found.readings.mean() << " +- "
                    << found.readings.standard_error() << " for " << truth.value;
                // With few samples of the measured lamp, some methods know less than a wrong value is off.
                const double known = kKnown * truth.value;
                if (std::max(truth.error, found.readings.standard_error()) > known) continue;
                EXPECT_FALSE(hold(found.readings, {kWrong * truth.value, truth.error}, bias))
                    << cell(lamp, glass, method.name) << " holds what is wrong";
            }
        }
    }
}

TEST(LampsAndGlass, Nightly_BehindMirrorsAndThickGlass_MethodsWithPhotonsFindEveryLamp) {
    const TemporaryFolder folder;
    for (const Lamp& lamp : every_lamp(folder.path())) {
        for (const Glass& glass : kBent) {
            const Truth truth = truth_of(lamp, glass, folder.path());
            ASSERT_GT(truth.value, 10 * truth.error) << lamp.name << ", " << glass.name;
            for (const Method& method : photon_methods()) {
                const Found found = by_rendering(lamp, glass, method, 10, folder.path());
                EXPECT_TRUE(hold(found.readings, truth, method.bias))
                    << cell(lamp, glass, method.name) << ": " << found.readings.mean() << " +- "
                    << found.readings.standard_error() << " for " << truth.value << " +- " << truth.error;
                const Truth wrong{method.wrong * truth.value, method.wrong * truth.error};
                EXPECT_FALSE(hold(found.readings, wrong, method.bias))
                    << cell(lamp, glass, method.name) << " holds what is wrong";
            }
        }
    }
}

// Returns the illuminance at the point itself. A ball's caustic is peaked there: paraxially, a ball of radius
// R and index n is a thin lens of focal length n R / (2 (n - 1)) at its centre, and two faces pass 0.96 each.
Truth truth_at_point(const Lamp& lamp, const Glass& glass, const std::filesystem::path& folder) {
    if (glass.name != "glass ball") return truth_of(lamp, glass, folder);
    constexpr double kFocal = 1.5 * 0.15 / (2 * 0.5), kPassed = 0.96 * 0.96;
    const V3d ball = on_way(lamp, 0.6);
    const double behind = (kPlace - ball).length(), before = ball.length(), whole = kPlace.length();
    const double spread = 1 - behind * (1 / kFocal - (lamp.sun ? 0.0 : 1 / before));
    const double without = lamp.intensity ? truth_of(lamp, {"no glass"}, folder).value
                                          : by_lux(lamp, {"no glass"}, folder, 16).reading.value;
    return {kPassed * without * (lamp.sun ? 1.0 : sqr(whole / before)) / sqr(spread), 0};
}

TEST(LampsAndGlass, Nightly_BehindMirrorsAndThickGlass_LuxFindsTheLampAndPathsSayWhatIsMissing) {
    const TemporaryFolder folder;
    for (const Lamp& lamp : every_lamp(folder.path())) {
        for (const Glass& glass : kBent) {
            const Truth truth = truth_of(lamp, glass, folder.path()),
                        at_point = truth_at_point(lamp, glass, folder.path());
            const Reading lux = by_lux(lamp, glass, folder.path());
            // The light of a ball varies so much near the point that a limited number of light paths may
            // leave it blurred.
            const bool is_ball = glass.name == "glass ball";
            const bool found = std::fabs(lux.reading.value - at_point.value) <
                               kClosed * at_point.value + 2 * lux.reading.half_width + 4 * at_point.error;
            EXPECT_TRUE(found && (is_ball || !lux.warned))
                << cell(lamp, glass, "lux") << ": " << lux.reading.value << " +- " << lux.reading.half_width
                << " for " << at_point.value;
            const Found path = by_rendering(lamp, glass, {"path", {}, 16, 0, 0}, 4, folder.path());
            EXPECT_TRUE(hold(path.readings, truth, kClosed) || path.warned)
                << cell(lamp, glass, "path") << ": " << path.readings.mean() << " +- "
                << path.readings.standard_error() << " for " << truth.value;
        }
    }
}

// Glare at the receiver. A surrounding room has walls that give the eye a background.
const std::string kRoom =
    "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] ReverseOrientation Shape "
    "\"sphere\" "
    "\"float radius\" 3 AttributeEnd";
Job room_of(const Lamp& lamp, const Glass& glass, const std::filesystem::path& folder,
            const SceneOverrides& overrides = {}) {
    Monitor silent;
    Lamp in_lm = lamp;
    if (!lamp.intensity) in_lm.text += " \"float efficacy\" 1";
    return read_scene_text("Option \"string unit\" \"photometric\"\n" + text_of(in_lm, glass, kRoom),
                           folder / "scene.pbrt", overrides, Workers{2}, silent);
}

// The illuminance at the eye in lx, and the luminance of a uniform background that accounts for all light but
// the lamps' direct light, both by photon mapping. Photons blur the peak behind a ball, so there the light
// that comes from the lamp over the glass alone is that of the closed form.
struct EyeTruth {
    RunningStats vertical, background;
};
EyeTruth eye_truth(const Lamp& lamp, const Glass& glass, const std::filesystem::path& folder) {
    SceneOverrides overrides;
    overrides.integrator = "photonmap";
    overrides.set = {{"photons", "40000"}, {"quantity", "illuminance"}};
    overrides.spp = 16;
    Monitor silent;
    Job job = room_of(lamp, glass, folder, overrides);
    job.film.parts = true;
    const bool is_ball = glass.name == "glass ball";
    const double over_glass = is_ball ? truth_at_point(lamp, glass, folder).value : 0;
    EyeTruth truth;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        const RenderResult result = render(job, {seed, Workers{2}}, silent);
        const Image& parts = result.parts.value();
        const auto part = [&parts](const std::string& name, std::size_t pixel) {
            const float* rgb =
                &parts.data[pixel * parts.channels.size() + find_channel(parts, name + ".R").value()];
            return Rgb(rgb[0], rgb[1], rgb[2]);
        };
        double all = over_glass, not_direct = over_glass;
        for (std::size_t i = 0; i < 4; ++i) {
            Rgb found = result.image.rgb_at(static_cast<int>(i % 2), static_cast<int>(i / 2));
            if (is_ball) found = found - part("caustic", i);
            all += double{luminance(found)} / 4;
            not_direct += double{luminance(found - part("direct", i))} / 4;
        }
        truth.vertical.add(all);
        truth.background.add(not_direct / kPiD);
    }
    return truth;
}

TEST(LampsAndGlass, Nightly_Glare_IsRatedOrSaysWhatItHasNoTermFor) {
    const TemporaryFolder folder;
    constexpr double kOfPhotons = 0.03;  // bias of density estimation
    Observer observer;
    observer.name = "eye";
    observer.eye = kPlace - V3d(0, 0, 1e-4);
    observer.view = {0, 0, -1};
    observer.up = {0, 1, 0};
    GlareOptions options;
    options.workers = {2};
    options.blur = 0;
    options.samples = 1 << 12;
    std::vector<Glass> glasses = kStraight;
    glasses.insert(glasses.end(), kBent.begin(), kBent.end());
    for (const Lamp& lamp : every_lamp(folder.path())) {
        if (lamp.sun) continue;  // a sun is not a luminaire
        for (const Glass& glass : glasses) {
            const EyeTruth truth = eye_truth(lamp, glass, folder.path());
            ListeningMonitor monitor;
            const GlareReport found =
                glare_at(std::vector{observer}, room_of(lamp, glass, folder.path()), options, monitor)
                    .front();
            const std::string here =
                cell(lamp, glass, "glare") + ": " + fmt::format("{}", fmt::join(monitor.warnings, "; "));
            const bool blurred = has(monitor, "too small for path tracing");
            const auto holds = [&](const Reading95& reading, const RunningStats& right) {
                return std::fabs(reading.value - right.mean()) <
                       2 * reading.half_width + 4 * right.standard_error() + kOfPhotons * right.mean();
            };
            const auto told = [](const Reading95& reading, const RunningStats& right) {
                return fmt::format("{:.4g} +- {:.2g} for {:.4g} +- {:.2g}", reading.value, reading.half_width,
                                   right.mean(), right.standard_error());
            };
            EXPECT_TRUE(holds(found.vertical, truth.vertical) || blurred)
                << here << ": E_v " << told(found.vertical, truth.vertical);
            EXPECT_TRUE(holds(found.background, truth.background) || blurred)
                << here << ": L_b " << told(found.background, truth.background);
            RunningStats twice;
            twice.add(2 * truth.background.mean());
            EXPECT_FALSE(holds(found.background, twice)) << here << " holds a background twice as bright";
            const bool bends = glass.bends == Bends::some;
            EXPECT_EQ(has(monitor, "seen over mirrors"), bends) << here;
            EXPECT_EQ(has(monitor, "no extent"), lamp.area == 0) << here;
            const bool rated = lamp.area > 0 && !glass.hides;
            EXPECT_EQ(found.sources.size(), rated ? 1U : 0U) << here;
            // A light field's size is given by its own resolution (see OfAMeasuredDisc.*).
            if (!rated || found.sources.empty() || !lamp.intensity) continue;
            // A uniform flat lamp of area A at a distance d has E perpendicular to the direction of L A cos /
            // d².
            const V3d way = kPlace.normalized();
            const double cosine = way.z, direct = truth.vertical.mean() - kPiD * truth.background.mean();
            const double sum = sqr(direct / cosine) * kPlace.length2() / (lamp.area * cosine) /
                               sqr(position_index(observer, V3f(-way)));
            const double of_truth =
                4 * 8 / std::numbers::ln10 * truth.background.standard_error() / truth.background.mean();
            EXPECT_NEAR(found.ugr.value, 8 * std::log10(0.25 / truth.background.mean() * sum),
                        2 * found.ugr.half_width + of_truth + 0.2)
                << here;
        }
    }
}

}  // namespace lamps_and_glass_test
}  // namespace lucerna
