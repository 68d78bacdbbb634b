// The lamp with six LEDs in one reflector: the lamp that its traced rays make, against the scene itself.
// Particles on planes, illuminance at points of a room, and glare must be the same.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <string>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/pbrt/read_scene.h"
#include "engine/photometry/glare.h"
#include "engine/photometry/illuminance.h"
#include "engine/render/render.h"
#include "lights/lamp_edit.h"
#include "lights/measurement/emit_rays.h"
#include "lights/measurement/lumigraph_fit.h"
#include "photon/luminaire.h"
#include "photon/trace_light_paths.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace six_led_test {

using testing::chi_square_tail;
using testing::kFalseAlarm;

const std::string kFolder = std::string(LUCERNA_SOURCE_DIR) + "/scenes/lamps/six-led/";

TracedLuminaire traced(std::uint64_t seed, std::int64_t paths) {
    Monitor silent;
    const Job job = read_scene(kFolder + "six-led.pbrt", {}, Workers{}, silent);
    LuminaireParameters parameters;
    parameters.paths = paths;
    parameters.seed = seed;
    parameters.colours = job.film.colours;
    parameters.all_sides = true;
    return trace_whole_luminaire(job.scene, parameters, FluxUnit::lumen, Workers{}, silent);
}

// Returns the lamp of half a million light paths.
const LumigraphFit& acquired() {
    static const LumigraphFit made = [] {
        Monitor silent;
        return fit_lumigraph(traced(1, 1 << 19).rays, {}, Workers{}, silent);
    }();
    return made;
}

// The light on a square of a plane z = const, in pixels; the last bin is the rest of the plane.
constexpr int kAcross = 16;
struct Hits {
    std::array<double, kAcross * kAcross + 1> flux{}, squares{};
    double all = 0;
};
struct Plane {
    double z, half_size;
};

Hits hits_on(const Plane& plane, const std::vector<LampRay>& rays) {
    Hits hits;
    for (const LampRay& ray : rays) {
        if (!(ray.d.z > 0)) continue;
        const V3d p = V3d(ray.o) + (plane.z - double{ray.o.z}) / double{ray.d.z} * V3d(ray.d);
        const auto index = [&](double x) { return std::floor((x / plane.half_size + 1) / 2 * kAcross); };
        const double i = index(p.x), k = index(p.y);
        const bool inside = i >= 0 && i < kAcross && k >= 0 && k < kAcross;
        const std::size_t bin = inside ? static_cast<std::size_t>(k * kAcross + i) : kAcross * kAcross;
        const double flux{ray.flux};
        hits.flux[bin] += flux;
        hits.squares[bin] += sqr(flux);
        hits.all += flux;
    }
    return hits;
}

// Returns the p-value of both having one distribution.
double p_value(const Hits& a, const Hits& b) {
    double sum = 0;
    int degrees = -1;  // the totals are made equal
    for (std::size_t i = 0; i < a.flux.size(); ++i) {
        const double variance = a.squares[i] / sqr(a.all) + b.squares[i] / sqr(b.all);
        // Sums of fewer than ten rays are not nearly normal.
        if (!(sqr(a.flux[i] + b.flux[i]) > 10 * (a.squares[i] + b.squares[i]))) continue;
        sum += sqr(a.flux[i] / a.all - b.flux[i] / b.all) / variance;
        ++degrees;
    }
    return chi_square_tail(sum, degrees);
}

constexpr Plane kContact{0.0005, 0.04}, kFar{1, 1.5};
constexpr std::int64_t kDraws = 1 << 19;

// Stratified rays have less noise than independent ones, but a few of them that are chosen at random do not.
std::vector<LampRay> few_of(const std::vector<LampRay>& rays, std::uint64_t seed) {
    constexpr float kShare = 0.125F;
    std::vector<LampRay> few;
    for (std::size_t i = 0; i < rays.size(); ++i)
        if (Sampler(seed, Purpose::test, 0, i).next() < kShare) few.push_back(rays[i]);
    return few;
}

Hits lamp_hits(const Lumigraph& lamp, const Plane& plane) {
    Monitor silent;
    const LampEmission emission(lamp, "six-led.exr", EmissionMode::exact, 5, Workers{}, silent);
    return hits_on(plane, few_of(emission.draw(0, kDraws).rays, 6));
}

TEST(SixLeds, Long_LampOnPlanesAtContactAndFar_HasTheLightOfTheScene) {
    const Lumigraph& lamp = acquired().lamp;
    const std::vector<LampRay> scene = few_of(traced(2, kDraws).rays.rays, 7);
    for (const Plane& plane : {kContact, kFar}) {
        const Hits of_scene = hits_on(plane, scene);
        const double p = p_value(lamp_hits(lamp, plane), of_scene);
        RecordProperty(fmt::format("p_at_{}_mm", 1000 * plane.z), fmt::format("{:.3g}", p));
        EXPECT_GT(p, kFalseAlarm) << "plane at " << plane.z;
        // The mirrored lamp has its dimmed LED on the wrong side, which shows near by; far away a lamp that
        // leans by three degrees must be told from an upright one.
        const LampPlacement wrong = plane.z < 0.1 ? LampPlacement::mirror(0) : LampPlacement::turn(1, 3);
        const double p_wrong = p_value(lamp_hits(placed(lamp, wrong), plane), of_scene);
        RecordProperty(fmt::format("p_of_wrong_lamp_at_{}_mm", 1000 * plane.z),
                       fmt::format("{:.3g}", p_wrong));
        EXPECT_LT(p_wrong, kFalseAlarm) << "plane at " << plane.z;
    }
}

TEST(SixLeds, FluxAccount_ClosesByMaterials) {
    const TracedLuminaire made = traced(3, 1 << 16);
    EXPECT_LT(made.flux.ledger.imbalance(), 1e-5);
    const double emitted = double{luminance(Rgb(V3f(made.flux.ledger.emitted)))};
    EXPECT_NEAR(emitted, 540, 1e-2);
    V3d absorbed(0, 0, 0);
    for (const V3d& one : made.absorbed) absorbed += one;
    EXPECT_LT((absorbed - made.flux.ledger.absorbed).length(), 1e-6 * emitted);
    EXPECT_GT(made.rays.flux, 0.8 * emitted);
    EXPECT_LT(made.rays.flux, 0.97 * emitted);
}

// --- in a room, of which the lamp's plane is the ceiling ---

constexpr double kFloor = 2.5, kEyeHeight = 1.3;  // below the ceiling, along +z [m]

std::string room(const std::string& lamp) {
    return R"(Option "string unit" "photometric"
Camera "perspective" "float fov" 90
Film "rgb" "integer xresolution" 16 "integer yresolution" 16
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 2.5  2 -2 2.5  -2 2 2.5  2 2 2.5 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 -0.1  2 -2 -0.1  -2 2 -0.1  2 2 -0.1 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 -0.1  -2 2 -0.1  -2 -2 2.5  -2 2 2.5 ]
Shape "bilinearmesh" "point3 P" [ 2 -2 -0.1  2 2 -0.1  2 -2 2.5  2 2 2.5 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 -0.1  2 -2 -0.1  -2 -2 2.5  2 -2 2.5 ]
Shape "bilinearmesh" "point3 P" [ -2 2 -0.1  2 2 -0.1  -2 2 2.5  2 2 2.5 ]
)" + lamp;
}

std::string world_of_scene() {
    std::ifstream in(kFolder + "six-led.pbrt");
    const std::string text(std::istreambuf_iterator<char>(in), {});
    return text.substr(text.find("WorldBegin") + 10);
}

// Writes the lamp, and returns the text that makes it a light.
std::string lamp_in(const testing::TemporaryFolder& folder) {
    write_lumigraph(folder / "six-led.exr", acquired().lamp);
    return fmt::format("LightSource \"lightfield\" \"string filename\" \"{}\"\n",
                       (folder / "six-led.exr").string());
}

Job job_of(const std::string& text) {
    Monitor silent;
    return read_scene_text(text, kFolder + "room.pbrt", {}, Workers{}, silent);
}

// --- illuminance at nine places of the floor ---

constexpr int kPlaces = 9;
constexpr double kPatch = 0.12;  // side of the square over which light paths are counted [m]
V2d place(int i) {
    return {(i % 3 - 1) * 2.0 / 3, (i / 3 - 1) * 2.0 / 3};
}

// Counts the light that arrives around the places, over any number of bounces.
struct FloorMeter : LightPathVisitor {
    V3d origin{0, 0, 0};
    std::array<double, kPlaces> flux{}, squares{};  // times the number of paths

    void hit(const LightPathHit& at) {
        const V3d p = V3d(at.hit.at.p) + origin;
        if (std::fabs(p.z - kFloor) > 1e-3) return;
        for (int i = 0; i < kPlaces; ++i) {
            const V2d off = V2d(p.x, p.y) - place(i);
            if (std::max(std::fabs(off.x), std::fabs(off.y)) > kPatch / 2) continue;
            const auto power = double{luminance(at.power)};
            flux[static_cast<std::size_t>(i)] += power;
            squares[static_cast<std::size_t>(i)] += sqr(power);
        }
    }
};

struct Lux {
    double value = 0, error = 0;  // standard error
};

std::array<Lux, kPlaces> lux_of_light_paths(const Scene& scene) {
    LightPathRequest paths;
    paths.count = 8'000'000;
    paths.seed = 12;
    const Workers workers;
    Monitor silent;
    std::vector<FloorMeter> chunks;
    trace_light_paths({scene, workers, silent}, paths, chunks, [&](std::int64_t) {
        FloorMeter meter;
        meter.origin = scene.origin();
        return meter;
    });
    std::array<Lux, kPlaces> lux;
    const double share = 1 / (static_cast<double>(paths.count) * kPatch * kPatch);
    for (std::size_t i = 0; i < kPlaces; ++i) {
        double squares = 0;
        for (const FloorMeter& chunk : chunks)
            lux[i].value += share * chunk.flux[i], squares += chunk.squares[i];
        lux[i].error = share * std::sqrt(squares);
    }
    return lux;
}

// Returns the readings that lucerna lux would print.
std::array<Lux, kPlaces> lux_of(Job job) {
    CalculationSurface floor;
    floor.name = "floor";
    floor.corner = {-1, -1, kFloor - 0.001};
    floor.u = {2, 0, 0}, floor.v = {0, 2, 0};
    floor.normal = {0, 0, -1};
    floor.points = {3, 3};
    Monitor silent;
    IlluminanceOptions options;
    options.precision = 0.01;
    options.seconds = 60;
    const auto surfaces = illuminance_on(std::vector{floor}, std::move(job), options, silent).surfaces;
    std::array<Lux, kPlaces> lux;
    for (std::size_t i = 0; i < kPlaces; ++i) {
        const Reading95& reading = surfaces[0].points[i].all;
        lux[i] = {reading.value, reading.half_width / kStandardErrors95};
    }
    return lux;
}

// Returns the largest relative error of irradiance that the lamp states.
double stated_error() {
    double most = 0;
    for (const Slab& slab : acquired().lamp.slabs()) {
        if (slab.field.flux() < 0.5 * acquired().lamp.flux()) continue;
        for (const PlaneError& error : slab.field.info().errors) most = std::max(most, error.relative());
    }
    return most;
}

// Returns the p-value of the lamp's illuminance, times `scale`, being that of the scene at all places. The
// lamp's readings also have the error that the lamp states.
double p_value(const std::array<Lux, kPlaces>& lamp, const std::array<Lux, kPlaces>& scene, double scale) {
    double sum = 0;
    for (std::size_t i = 0; i < kPlaces; ++i) {
        const double variance =
            sqr(lamp[i].error) + sqr(scene[i].error) + sqr(stated_error() * scene[i].value);
        sum += sqr(scale * lamp[i].value - scene[i].value) / variance;
    }
    return chi_square_tail(sum, kPlaces);
}

TEST(SixLeds, Long_LampInARoom_HasTheIlluminanceOfTheScene) {
    const testing::TemporaryFolder folder;
    const auto lamp = lux_of(job_of(room(lamp_in(folder)))),
               scene = lux_of_light_paths(job_of(room(world_of_scene())).scene);
    for (std::size_t i = 0; i < kPlaces; ++i) {
        RecordProperty(fmt::format("lux_{}", i),
                       fmt::format("lamp {:.4g} +- {:.2g}, scene {:.4g} +- {:.2g}", lamp[i].value,
                                   kStandardErrors95 * lamp[i].error, scene[i].value,
                                   kStandardErrors95 * scene[i].error));
        EXPECT_LT(scene[i].error, 0.02 * scene[i].value);
    }
    RecordProperty("stated_error", fmt::format("{:.3g}", stated_error()));
    RecordProperty("p", fmt::format("{:.3g}", p_value(lamp, scene, 1)));
    EXPECT_GT(p_value(lamp, scene, 1), kFalseAlarm);
    EXPECT_LT(p_value(lamp, scene, 1.1), kFalseAlarm) << "a lamp of a tenth more flux";
}

// --- glare, at an eye that looks past the lamp ---

const V3d kEye(1.4, 0.2, kEyeHeight);

// Returns Σ L² ω / p² of the scene's luminaire, filtered as the glare rating filters it, from pairs of images
// with independent noise.
class SeenByTheEye {
  public:
    SeenByTheEye() : job_(job_of(text())) {}

    RunningStats sums(int seeds) {
        RunningStats stats;
        Monitor silent;
        std::vector<std::vector<double>> seen;
        for (int seed = 0; seed < 2 * seeds; ++seed) {
            RenderOptions options;
            options.seed = static_cast<std::uint64_t>(seed);
            seen.push_back(filtered(render(job_, options, silent).image));
        }
        for (int i = 0; i < seeds; ++i) {
            const auto &a = seen[static_cast<std::size_t>(2 * i)],
                       &b = seen[static_cast<std::size_t>(2 * i + 1)];
            double sum = 0;
            for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
            const V3d way = -kEye;
            const double p = position_index(observer(), V3f(way.normalized()));
            stats.add(sum * sqr(kFov / kPixels) / sqr(p));
        }
        return stats;
    }
    static Observer observer() { return {"eye", kEye, {-1, 0, 0}, {0, 0, -1}}; }

  private:
    static constexpr int kPixels = 96;
    static constexpr double kFov = 4 * kPiD / 180;  // radians across the image, which is flat to 1e-3

    static std::string text() {
        std::string all = room(world_of_scene());
        const std::string camera = fmt::format(
            "LookAt {} {} {}  0 0 0  0 0 -1\nCamera \"perspective\" \"float fov\" 4\nFilm \"rgb\" "
            "\"integer xresolution\" {} \"integer yresolution\" {}\nSampler \"independent\" "
            "\"integer pixelsamples\" 16\nIntegrator \"path\" \"integer maxdepth\" 12\n",
            kEye.x, kEye.y, kEye.z, kPixels, kPixels);
        const std::size_t begin = all.find("Camera"), end = all.find("WorldBegin");
        return all.replace(begin, end - begin, camera);
    }

    // Filters luminance by the Gaussian of CIE 232 along both axes.
    static std::vector<double> filtered(const Image& image) {
        const double sigma = GlareOptions{}.blur / (2 * std::sqrt(2 * std::log(2.0))) / kEye.length() /
                             (kFov / kPixels);  // pixels
        std::vector<double> kernel(2 * kPixels - 1), seen(kPixels * kPixels);
        double sum = 0;
        for (int i = 0; i < 2 * kPixels - 1; ++i)
            sum += kernel[static_cast<std::size_t>(i)] = std::exp(-0.5 * sqr((i - kPixels + 1) / sigma));
        for (double& k : kernel) k /= sum;
        const auto at = [](int x, int y) { return static_cast<std::size_t>(y * kPixels + x); };
        for (int y = 0; y < kPixels; ++y) {
            for (int x = 0; x < kPixels; ++x) seen[at(x, y)] = double{luminance(image.rgb_at(x, y))};
        }
        for (const bool across : {true, false}) {
            std::vector<double> made(seen.size());
            for (int y = 0; y < kPixels; ++y) {
                for (int x = 0; x < kPixels; ++x) {
                    for (int i = 0; i < kPixels; ++i) {
                        const double k = kernel[static_cast<std::size_t>(i - (across ? x : y) + kPixels - 1)];
                        made[at(x, y)] += k * seen[across ? at(i, y) : at(x, i)];
                    }
                }
            }
            seen = std::move(made);
        }
        return seen;
    }

    Job job_;
};

TEST(SixLeds, Long_LampInARoom_HasTheGlareOfTheScene) {
    const testing::TemporaryFolder folder;
    const std::string lamp = room(lamp_in(folder));
    Monitor silent;
    const GlareReport report = glare_at(std::vector{SeenByTheEye::observer()}, job_of(lamp), {}, silent)[0];
    const RunningStats sum = SeenByTheEye().sums(6);
    const double ugr = 8 * std::log10(0.25 / report.background.value * sum.mean());
    // Errors of a luminance count twice, as UGR follows its square.
    const double of_sum = 8 / std::log(10.0) * kStandardErrors95 * sum.standard_error() / sum.mean();
    const double of_lamp_itself = 8 / std::log(10.0) * kStandardErrors95 * 2 * stated_error();
    RecordProperty("ugr", fmt::format("lamp {:.4g} +- {:.2g}, scene {:.4g} +- {:.2g}", report.ugr.value,
                                      std::hypot(report.ugr.half_width, of_lamp_itself), ugr, of_sum));
    EXPECT_NEAR(report.ugr.value, ugr, std::hypot(report.ugr.half_width, of_sum, of_lamp_itself));
    EXPECT_LT(std::hypot(report.ugr.half_width, of_sum, of_lamp_itself), 1);
}

}  // namespace six_led_test
}  // namespace lucerna
