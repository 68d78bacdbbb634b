// Bootstrap replicates from the ray file to the uncertainty of illuminance: `lucerna light import
// --replicates` and `lucerna lux --replicates`.
#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/cli/photometry/lux_replicates.h"
#include "engine/system/files.h"
#include "lights/light_field.h"
#include "lights/measurement/ray_bootstrap.h"
#include "lights/measurement/ray_projection.h"
#include "lights/ray_set.h"
#include "tests/cli/run_support.h"
#include "tests/support/lamp_rays.h"

namespace lucerna {
namespace replicates_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::lucerna_run;
using ::testing::Not;
using testing::Outcome;
using Json = nlohmann::json;

// Returns a scene of a lamp of 1000 lm above a black floor, and twelve points below it.
std::string scene_of(const std::vector<std::string>& lamps) {
    std::string text =
        "Option \"string unit\" \"photometric\"\nCamera \"perspective\" Film \"rgb\"\nWorldBegin\n"
        "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n"
        "Shape \"bilinearmesh\" \"point3 P\" [ -2 0 -2  -2 0 2  2 0 -2  2 0 2 ]\n"
        "CalculationSurface \"desk\" \"point3 P\" [ -2 1 -2  -2 1 2  2 1 -2 ] \"integer points\" [ 4 3 ]\n";
    for (const std::string& lamp : lamps) {
        text +=
            "AttributeBegin Translate 0 2 0 Rotate 90 1 0 0 LightSource \"lightfield\" "
            "\"string filename\" \"" +
            lamp + "\" AttributeEnd\n";
    }
    return text;
}

// Returns independent rays of a Lambertian disc of 10 mm.
RaySet disc_rays(int count, std::uint32_t number) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    set.flux = set.header_lumens = 1000;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(7, Purpose::test, number, static_cast<std::uint64_t>(i));
        const V2d p = 0.01 * V2d(square_to_disc(sampler.next2()));
        const V3d d = testing::lambertian({0, 0, 1}, sampler.next2());
        set.rays.push_back({V3f(V3d(p.x, p.y, 0)), V3f(d), static_cast<float>(1000.0 / count)});
    }
    return set;
}

class Replicates : public testing::RunTest {
  protected:
    void SetUp() override {
        RunTest::SetUp();
        write_rays("rays.tm25ray", disc_rays(2000, 0));
        write("room.pbrt", scene_of({"lamp.exr"}));
    }
    static Outcome import(const std::string& rays, const std::string& lamp, const std::string& replicates,
                          const std::vector<std::string>& more = {}) {
        std::vector<std::string> words{"light",        "import",     rays,      "-o",  lamp,
                                       "--replicates", replicates,   "--views", "5x5", "--pixels",
                                       "8x8",          "--distance", "50mm"};
        words.insert(words.end(), more.begin(), more.end());
        Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome;
    }
    static Json lux(const std::vector<std::string>& more) {
        std::vector<std::string> words{"lux", "room.pbrt", "--replicates", "--json", "-"};
        words.insert(words.end(), more.begin(), more.end());
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return Json::parse(outcome.out);
    }
};

TEST_F(Replicates, AreWrittenBesideTheLampAndReadForItsUncertainty) {
    const Outcome imported = import("rays.tm25ray", "lamp.exr", "5");
    EXPECT_THAT(imported.out, AllOf(HasSubstr("making replicates"), HasSubstr("lamp-replicate-05.exr")));
    std::vector<std::string> expected{"lamp.cells", "lamp.exr"};
    for (int b = 1; b <= 5; ++b) {
        expected.push_back(fmt::format("lamp-replicate-0{}.cells", b));
        expected.push_back(fmt::format("lamp-replicate-0{}.exr", b));
    }
    for (const char* name : {"rays.tm25ray", "room.pbrt", "scene.pbrt"}) expected.emplace_back(name);
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(files(), expected);
    const LightField lamp = read_light_field("lamp.exr"), first = read_light_field("lamp-replicate-01.exr");
    // Each import chooses anew what the options leave open.
    EXPECT_EQ(first.rig().views, lamp.rig().views);
    int others = 0;
    for (int b = 1; b <= 5; ++b) {
        const Rig rig = read_light_field(fmt::format("lamp-replicate-0{}.exr", b)).rig();
        others += rig.pixel != lamp.rig().pixel || rig.spacing != lamp.rig().spacing ||
                  rig.centre != lamp.rig().centre || rig.basis != lamp.rig().basis;
    }
    EXPECT_GT(others, 0);
    ASSERT_EQ(lamp.info().errors.size(), 7U);
    EXPECT_EQ(lamp.info().errors.front().distance, 0);
    EXPECT_TRUE(std::isinf(lamp.info().errors.back().distance));
    EXPECT_THAT(lucerna_run({"light", "info", "lamp.exr"}).out, HasSubstr("by direction"));
    EXPECT_NEAR(first.info().captured + first.info().missed, 1000, 0.1);
    EXPECT_NE(content_hash(first), content_hash(lamp));
    EXPECT_NE(content_hash(first), content_hash(read_light_field("lamp-replicate-02.exr")));

    const Outcome seen = lucerna_run({"lux", "room.pbrt", "--replicates", "--samples", "1", "-o", "lux.csv",
                                      "--plan", "lux.svg", "--html", "lux.html", "--json", "lux.json"});
    ASSERT_EQ(seen.code, 0) << seen.err;
    EXPECT_THAT(seen.out, AllOf(HasSubstr("from 5 bootstrap replicates"), HasSubstr("Monte Carlo"),
                                HasSubstr("error of the light field by held-out rays")));
    EXPECT_THAT(read_text("lux.csv"), HasSubstr("U of lamps [lx]"));
    EXPECT_THAT(read_text("lux-uncertainty.svg"), HasSubstr("uncertainty"));
    EXPECT_THAT(read_text("lux.html"), HasSubstr("from 5 bootstrap replicates"));
    const Json json = Json::parse(read_text("lux.json"));
    EXPECT_EQ(json["replicates"], 5);
    EXPECT_EQ(json["light_fields"][0]["file"], "lamp.exr");
    EXPECT_FLOAT_EQ(json["light_fields"][0]["error_by_direction"].get<float>(),
                    static_cast<float>(lamp.info().errors.back().relative()));
    const Json& desk = json["surfaces"][0];
    EXPECT_GT(desk["lamps"]["mean"]["half_width_of_both"], desk["mean"]["half_width"]);
}

TEST_F(Replicates, AreTheSameByOneSeedAndOnAnyNumberOfThreads) {
    const auto bytes = [&](const std::string& seed, const std::string& threads) {
        import("rays.tm25ray", "lamp.exr", "5", {"--seed", seed, "--threads", threads});
        return read_bytes("lamp-replicate-03.exr");
    };
    const auto one = bytes("1", "1");
    EXPECT_EQ(one, bytes("1", "3"));
    EXPECT_NE(one, bytes("2", "1"));
}

// Imports on fixed planes, because import chooses finer ones for more rays.
void write_on_fixed_planes(const RaySet& rays, int replicates) {
    Rig rig;
    rig.views = {5, 5};
    rig.spacing = {0.01, 0.01};
    rig.pixels = {30, 30};  // so small that the points below lie in different ones
    rig.pixel = {0.012, 0.012};
    rig.distance = 0.05;
    rig.basis = PixelBasis::hat;
    Monitor silent;
    const auto write = [&](const RaySet& set, const std::string& file, std::uint64_t replicate_of) {
        LightField field = project_rays(set, rig, {}, silent, {0, 0}).field;
        LightFieldInfo info = field.info();
        info.replicate_of = replicate_of;
        write_light_field(file, std::move(field).with(info));
    };
    write(rays, "lamp.exr", 0);
    const std::uint64_t hash = content_hash(read_light_field("lamp.exr"));
    for (int b = 1; b <= replicates; ++b)
        write(resampled(rays, {0, b, 0}, {}), replicate_file("lamp.exr", b).string(), hash);
}

TEST_F(Replicates, UncertaintyByFourTimesTheRays_IsHalf) {
    // The scatter of 12 replicates is known to 21 % at one point and to 6 % over twelve nearly independent
    // ones, so their ratio is known to 0.17.
    const auto rms = [&](int rays, std::uint32_t number) {
        write_on_fixed_planes(disc_rays(rays, number), 12);
        return lux({"--samples", "1"})["surfaces"][0]["lamps"]["rms_over_points"].get<double>();
    };
    const double few = rms(4000, 1), many = rms(16000, 2);
    EXPECT_NEAR(few / many, 2, 0.5);  // and neither 1 nor 4
    EXPECT_GT(few, 0.02);
}

TEST_F(Replicates, LampUsedTwice_IsTheSameReplicateInBothPlaces) {
    import("rays.tm25ray", "lamp.exr", "5");
    const Json once = lux({"--samples", "2"});
    write("room.pbrt", scene_of({"lamp.exr", "lamp.exr"}));
    const Json twice = lux({"--samples", "2"});
    // Twice the light has twice the uncertainty, not √2 times. Both use the same replicates, so only Monte
    // Carlo noise differs.
    const auto u = [](const Json& json) {
        return json["surfaces"][0]["values"][0]["lamps"]["U"].get<double>();
    };
    EXPECT_NEAR(u(twice) / u(once), 2, 0.3);
}

TEST_F(Replicates, WhatIsMissing_IsSaid) {
    expect_refused({"light", "import", "rays.tm25ray", "-o", "lamp.exr", "--replicates", "4"},
                   {"--replicates", "4", "5"});
    expect_refused({"lux", "scene.pbrt", "--height", "0.5", "--replicates"},
                   {"scene.pbrt", "no measured lamp", "--replicates"});
    ASSERT_EQ(lucerna_run({"light", "import", "rays.tm25ray", "-o", "lamp.exr", "--quiet"}).code, 0);
    expect_refused({"lux", "room.pbrt", "--replicates"},
                   {"lamp.exr", "0 bootstrap replicates", "lucerna light import"});
    import("rays.tm25ray", "lamp.exr", "5");
    expect_refused({"lux", "room.pbrt", "--replicates", "--image", "lamp-replicate-02.exr"},
                   {"lamp-replicate-02.exr", "--image"});
    // The command replaces the lamp by another one.
    ASSERT_EQ(
        lucerna_run({"light", "import", "rays.tm25ray", "-o", "lamp.exr", "--quiet", "--views", "6x6"}).code,
        0);
    expect_refused({"lux", "room.pbrt", "--replicates"},
                   {"lamp-replicate-01.exr", "not a replicate of", "lamp.exr"});
}

TEST_F(Replicates, LampsWithDifferentNumbers_UseTheSmallest) {
    import("rays.tm25ray", "lamp.exr", "6");
    import("rays.tm25ray", "other.exr", "5");
    write("room.pbrt", scene_of({"lamp.exr", "other.exr"}));
    const Outcome outcome = lucerna_run({"lux", "room.pbrt", "--replicates", "--samples", "1"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_THAT(outcome.err, HasSubstr("other.exr has, 5"));
    EXPECT_THAT(outcome.out, HasSubstr("from 5 bootstrap replicates"));
}

TEST(RunTimes, ShareOutWhatIsLeft) {
    const Stopwatch clock;
    RunTimes alone(clock, 1e6, 1, 0);
    EXPECT_NEAR(alone.by_lamps(), 1e6, 100);
    RunTimes times(clock, 1e6, 1, 30);
    EXPECT_NEAR(times.by_lamps(), 0.25e6, 100);
    // The remaining time is shared among the remaining replicates.
    EXPECT_NEAR(times.by_replicate(0), 1e6 / 30, 100);
    EXPECT_NEAR(times.by_replicate(0.5e6), 0.5e6, 100);
    EXPECT_NEAR(times.by_replicate(2e6), 1e6, 100);
    RunTimes with_far_field(clock, 1e6, 3, 30);
    EXPECT_NEAR(with_far_field.by_lamps(), 1e6 / 6, 100);
    EXPECT_NEAR(with_far_field.by_lamps(), 0.2e6, 100);
}

class StopsAtTheThird : public Monitor {
  public:
    void begin(std::string_view phase, std::uint64_t /*total*/) override {
        stopped_ = stopped_ || phase.starts_with("replicate 3 of 5: ");
    }
    bool stopped() const override { return stopped_; }

  private:
    bool stopped_ = false;
};

TEST_F(Replicates, RunsEndWithTheTimeAndTheUser) {
    import("rays.tm25ray", "lamp.exr", "5");
    PhotometryOptions common;
    common.scene = "room.pbrt";
    Monitor silent;
    CommandFiles files;
    Job job = common.read({}, files, silent);
    const std::vector<CalculationSurface> surfaces = job.surfaces;
    IlluminanceOptions options;
    options.most_samples = 1;
    const IlluminanceReport whole = illuminance_on(surfaces, std::move(job), options, silent);
    const Stopwatch clock;
    RunTimes none(clock, 0, 1, 5), endless(clock, INFINITY, 1, 10);
    EXPECT_EQ(by_replicates(common, surfaces, whole, options, 5, none, silent).size(), 0U);
    EXPECT_EQ(by_replicates(common, surfaces, whole, options, 5, endless, silent).size(), 5U);
    StopsAtTheThird impatient;
    const auto some = by_replicates(common, surfaces, whole, options, 5, endless, impatient);
    EXPECT_EQ(some.size(), 2U);
    for (const IlluminanceReport& report : some) EXPECT_EQ(report.samples, 1);
    // Before the first replicate is done there is no uncertainty.
    const std::atomic<int> stop{SIGINT};
    const Outcome outcome = lucerna_run({"lux", "room.pbrt", "--replicates"}, {false, &stop});
    EXPECT_EQ(outcome.code, 128 + SIGINT);
    EXPECT_THAT(outcome.out, Not(HasSubstr("replicates")));
}

}  // namespace replicates_test
}  // namespace lucerna
