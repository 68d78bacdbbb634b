// Requirements of EN 12464-1 in rooms whose values are known in closed form.
#include "engine/photometry/en12464.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/maintenance.h"
#include "tests/support/error_of.h"

namespace lucerna {
namespace en12464_test {

using ::lucerna::testing::error_of;
using ::testing::HasSubstr;

constexpr double kLuminance = 100;                  // cd/m²
constexpr double kIlluminance = kPiD * kLuminance;  // lx, everywhere and in every direction
constexpr int kUp = 2;

std::string side(const V3d& a, const V3d& b, const V3d& c) {
    const V3d d = b + c - a;
    return fmt::format("Shape \"bilinearmesh\" \"point3 P\" [{} {} {} {} {} {} {} {} {} {} {} {}]\n", a.x,
                       a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, d.x, d.y, d.z);
}
// A closed box of 5 m x 4 m x 2.7 m, each side facing inwards and outwards.
std::string box() {
    return side({0, 0, 0}, {5, 0, 0}, {0, 4, 0}) + side({0, 0, 2.7}, {5, 0, 2.7}, {0, 4, 2.7}) +
           side({0, 0, 0}, {5, 0, 0}, {0, 0, 2.7}) + side({0, 4, 0}, {5, 4, 0}, {0, 4, 2.7}) +
           side({0, 0, 0}, {0, 4, 0}, {0, 0, 2.7}) + side({5, 0, 0}, {5, 4, 0}, {5, 0, 2.7});
}

Job scene_of(const std::string& world) {
    Monitor silent;
    return read_scene_text(
        "Option \"string unit\" \"photometric\"\nLookAt 1 1 1  4 3 1  0 0 1\nCamera "
        "\"perspective\" Film \"rgb\" WorldBegin\n" +
            world,
        "scene.pbrt", {}, Workers{2}, silent);
}
// All sides shine with the same luminance and reflect nothing, so that all light is isotropic.
std::string furnace() {
    return fmt::format(
               "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" "
               "[{0} {0} {0}] \"bool twosided\" true\n",
               kLuminance) +
           box();
}

CalculationSurface task(const V3d& corner = {1.5, 1, 0.75}, double u = 2, double v = 1.5) {
    CalculationSurface surface;
    surface.name = "desk";
    surface.corner = corner;
    surface.u = V3d(u, 0, 0);
    surface.v = V3d(0, v, 0);
    surface.normal = surface.up = V3f(0, 0, 1);
    surface.points = V2i(4, 3);
    return surface;
}

// Values that are computed once and judged by several limits.
class Computed {
  public:
    // Computes what the requirements need.
    Computed(const std::string& world, const Requirements& requirements, int samples = 64)
        : room_(room_surfaces(scene_of(world).scene, std::vector{task()}, requirements, 1.2, kUp, false)) {
        Monitor silent;
        IlluminanceOptions options;
        options.most_samples = samples;
        options.workers = Workers{2};
        report_ = illuminance_on(room_.surfaces, scene_of(world), options, silent);
        if (room_.observers.empty()) return;
        GlareOptions of_glare;
        of_glare.workers = Workers{2};
        of_glare.samples = 1 << 12;
        glare_ = glare_at(room_.observers, scene_of(world), of_glare, silent);
    }
    std::vector<Judgement> judged(const Requirements& requirements) const {
        return judge(room_, report_.surfaces, glare_, {}, requirements);
    }

  private:
    RoomSurfaces room_;
    IlluminanceReport report_;
    std::vector<GlareReport> glare_;
};

Requirements required(const std::string& word) {
    return parse_requirements({"--require"}, word);
}

// Counts the verdicts on one requirement.
std::map<Verdict, int> verdicts(const std::vector<Judgement>& all, const std::string& requirement) {
    std::map<Verdict, int> counts;
    for (const Judgement& one : all) counts[one.verdict] += one.requirement == requirement;
    std::erase_if(counts, [](const auto& count) { return count.second == 0; });
    return counts;
}

class OnBothSides : public ::testing::TestWithParam<std::tuple<const char*, double, int>> {};

TEST_P(OnBothSides, OfTheLimit_AreMetAndMissed) {
    const auto& [name, value, count] = GetParam();
    using Counts = std::map<Verdict, int>;
    const Computed values(furnace(), required(fmt::format("{}=1", name)));
    EXPECT_EQ(verdicts(values.judged(required(fmt::format("{}={}", name, 0.98 * value))), name),
              (Counts{{Verdict::met, count}}));
    EXPECT_EQ(verdicts(values.judged(required(fmt::format("{}={}", name, 1.02 * value))), name),
              (Counts{{Verdict::missed, count}}));
}

// In isotropic light every illuminance is π L, on planes and on cylinders.
INSTANTIATE_TEST_SUITE_P(
    Furnace, OnBothSides,
    ::testing::Values(std::tuple("Em", kIlluminance, 1), std::tuple("surround", kIlluminance, 1),
                      std::tuple("background", kIlluminance, 1), std::tuple("walls", kIlluminance, 4),
                      std::tuple("ceiling", kIlluminance, 1), std::tuple("Ez", kIlluminance, 1)),
    [](const auto& each) { return std::string(std::get<0>(each.param)); });

TEST(En12464, ModellingInIsotropicLight_IsOne) {
    const Computed values(furnace(), required("modelling=0.9-1.1"));
    EXPECT_EQ(verdicts(values.judged(required("modelling=0.9-1.1")), "modelling").count(Verdict::met), 1U);
    EXPECT_EQ(verdicts(values.judged(required("modelling=0.3-0.6")), "modelling").count(Verdict::missed), 1U);
    EXPECT_EQ(verdicts(values.judged(required("modelling=1.1-2")), "modelling").count(Verdict::missed), 1U);
}

// A point light 1.5 m above the middle of one cell of the desk: E = I h / r³.
TEST(En12464, UniformityUnderAPointLight_IsThatOfTheInverseSquareLaw) {
    const std::string world =
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n" + box() +
        "LightSource \"point\" \"rgb I\" [500 500 500] \"point3 from\" [1.75 1.25 2.25]\n";
    double least = 1e9, mean = 0;
    const CalculationSurface desk = task();
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 4; ++x) {
            const V3d p = desk.position(x, y);
            const double r2 = (V3d(1.75, 1.25, 2.25) - p).length2(), e = 500 * 1.5 / (r2 * std::sqrt(r2));
            least = std::min(least, e);
            mean += e / 12;
        }
    }
    const double u0 = least / mean;
    const Computed values(world, required("Em=1"));
    EXPECT_EQ(verdicts(values.judged(required(fmt::format("U0={}", 0.99 * u0))), "U0").count(Verdict::met),
              1U);
    EXPECT_EQ(verdicts(values.judged(required(fmt::format("U0={}", 1.01 * u0))), "U0").count(Verdict::missed),
              1U);
    const std::vector<Judgement> all =
        values.judged(required(fmt::format("Em={},U0={}", 0.99 * mean, 1.01 * u0)));
    ASSERT_EQ(all.size(), 2U);
    EXPECT_EQ(all[0].verdict, Verdict::met);
    EXPECT_EQ(all[1].verdict, Verdict::missed);
    EXPECT_NEAR(all[0].value.value, mean, 1e-3 * mean);
}

// A point where no light was found may still have some.
TEST(En12464, UniformityWithADarkPoint_IsUndecided) {
    const std::string world = "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n" + box() +
                              "LightSource \"spot\" \"rgb I\" [500 500 500] \"point3 from\" [1.75 1.25 2.25] "
                              "\"point3 to\" [1.75 1.25 0] \"float coneangle\" 20\n";
    const std::vector<Judgement> all = Computed(world, required("Em=1"), 4).judged(required("U0=0.1"));
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].value.value, 0);
    EXPECT_EQ(all[0].verdict, Verdict::undecided);
}

TEST(En12464, LowPrecisionNearALimit_DecidesNothing) {
    // Between the noise of a few samples in a half-lit room and the limit at its own mean.
    const std::string world = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n" + box() +
                              "AreaLightSource \"diffuse\" \"rgb L\" [500 500 500]\n" +
                              side({0.2, 0.2, 2.6}, {0.2, 0.4, 2.6}, {0.4, 0.2, 2.6});
    const Computed values(world, required("Em=1"), 1);
    const std::vector<Judgement> rough = values.judged(required("Em=1"));
    ASSERT_EQ(rough.size(), 1U);
    const std::string at = fmt::format("Em={}", rough[0].value.value);
    EXPECT_EQ(values.judged(required(at))[0].verdict, Verdict::undecided);
    EXPECT_EQ(values.judged(required(fmt::format("Em={}", 0.2 * rough[0].value.value)))[0].verdict,
              Verdict::met);
    EXPECT_EQ(values.judged(required(fmt::format("Em={}", 5 * rough[0].value.value)))[0].verdict,
              Verdict::missed);
}

// The observer stands before the middle of a wall and sees the luminaire at the same place as one that is
// placed by hand.
TEST(En12464, UgrIsRatedBeforeTheMiddleOfEachWall) {
    const std::string world =
        "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n" + box() +
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" "
        "[3000 3000 3000] \"bool twosided\" true\n" +
        side({2.2, 1.7, 2.6}, {2.8, 1.7, 2.6}, {2.2, 2.3, 2.6});
    Monitor silent;
    GlareOptions options;
    options.workers = Workers{2};
    options.precision = 0.005;
    const Observer by_hand{"", {0.25, 2, 1.2}, {1, 0, 0}, {0, 0, 1}, false};
    const Reading95 ugr = glare_at(std::vector{by_hand}, scene_of(world), options, silent)[0].ugr;
    const Computed values(world, required("UGR=19"), 1);
    const auto counts = [&](double limit) {
        return verdicts(values.judged(required(fmt::format("UGR={}", limit))), "UGR");
    };
    const std::vector<Judgement> all = values.judged(required("UGR=19"));
    ASSERT_EQ(all.size(), 4U);
    // Two walls are 4 m wide and look along x, the others along y.
    EXPECT_EQ(std::ranges::count_if(all,
                                    [&](const Judgement& one) {
                                        return std::fabs(one.value.value - ugr.value) <
                                               one.value.half_width + ugr.half_width;
                                    }),
              2);
    EXPECT_EQ(counts(ugr.value + 3)[Verdict::met], 4);
    EXPECT_EQ(counts(ugr.value - 3)[Verdict::missed], 4);
}

std::string cupboard(const V3d& a, const V3d& b) {
    const V3d u(b.x - a.x, 0, 0), v(0, b.y - a.y, 0), w(0, 0, b.z - a.z);
    return side(a, a + u, a + v) + side(a + w, a + w + u, a + w + v) + side(a, a + u, a + w) +
           side(a + v, a + v + u, a + v + w) + side(a, a + v, a + w) + side(a + u, a + u + v, a + u + w);
}

// A cupboard of 0.5 m stands 2 cm before the middle of the wall x = 0.
TEST(En12464, FurnitureBeforeAWall_HidesItsPart_AndTheObserverStandsBeforeIt) {
    const Job job = scene_of(furnace() + cupboard({0.02, 1, 0}, {0.52, 3, 1.9}));
    const RoomSurfaces room =
        room_surfaces(job.scene, std::vector{task()}, required("walls=1,UGR=19"), 1.2, kUp, false);
    int hidden = 0;
    for (std::size_t i = 0; i < room.surfaces.size(); ++i) {
        const CalculationSurface& wall = room.surfaces[i];
        if (room.areas[i] != Area::wall) continue;
        for (int y = 0; y < wall.points.y; ++y) {
            for (int x = 0; x < wall.points.x; ++x) {
                const V3d p = wall.position(x, y);
                const bool is_behind = p.x < 0.02 && p.y > 1 && p.y < 3 && p.z < 1.9;
                EXPECT_EQ(wall.counts(x, y), !is_behind) << p;
                hidden += is_behind;
            }
        }
    }
    EXPECT_GT(hidden, 5);
    ASSERT_EQ(room.observers.size(), 4U);
    EXPECT_EQ(std::ranges::count_if(room.observers,
                                    [](const Observer& by) {
                                        return by.eye.x > 0.52 + 0.249 && by.eye.x < 0.52 + 0.301 &&
                                               std::fabs(by.eye.y - 2) < 0.01;
                                    }),
              1);
}

// Panels 5 cm below the ceiling hide each point of its grid; a finer one has points between them.
TEST(En12464, PanelsAboveEachPoint_HideTheCeilingNotAltogether) {
    std::string world = furnace();
    const V2i points = default_points(5, 4);
    for (int i = 0; i < points.x; ++i) {
        for (int j = 0; j < points.y; ++j) {
            const V3d at((i + 0.5) / points.x * 5, (j + 0.5) / points.y * 4, 2.65);
            world += side(at - V3d(0.1, 0.1, 0), at + V3d(0.1, -0.1, 0), at + V3d(-0.1, 0.1, 0));
        }
    }
    const Job job = scene_of(world);
    const RoomSurfaces room =
        room_surfaces(job.scene, std::vector{task()}, required("ceiling=1"), 1.2, kUp, false);
    ASSERT_EQ(room.surfaces.size(), 2U);
    const CalculationSurface& ceiling = room.surfaces[1];
    const auto hidden = static_cast<std::size_t>(std::ranges::count(ceiling.excluded, true));
    EXPECT_LT(2 * hidden, ceiling.size());
    EXPECT_GT(ceiling.size(), static_cast<std::size_t>(points.x * points.y));
}

TEST(En12464, TheBackgroundLeavesOutTheSurroundAndEndsAtTheWalls) {
    const Job job = scene_of(furnace());
    const RoomSurfaces room =
        room_surfaces(job.scene, std::vector{task()}, required("surround=1,background=1"), 1.2, kUp, false);
    ASSERT_EQ(room.surfaces.size(), 3U);
    const auto counted = [](const CalculationSurface& surface, auto&& is_inside) {
        int count = 0;
        for (int y = 0; y < surface.points.y; ++y) {
            for (int x = 0; x < surface.points.x; ++x) {
                if (!surface.counts(x, y)) continue;
                ++count;
                EXPECT_TRUE(is_inside(surface.position(x, y)));
            }
        }
        return count;
    };
    const auto within = [](const V3d& p, double x0, double x1, double y0, double y1) {
        return p.x > x0 && p.x < x1 && p.y > y0 && p.y < y1;
    };
    // The desk reaches from 1.5 to 3.5 m and from 1 to 2.5 m.
    EXPECT_GT(counted(room.surfaces[1],
                      [&](const V3d& p) {
                          return p.z == 0.75 && within(p, 1, 4, 0.5, 3) && !within(p, 1.5, 3.5, 1, 2.5);
                      }),
              10);
    EXPECT_GT(counted(room.surfaces[2],
                      [&](const V3d& p) {
                          return std::fabs(p.z) < 1e-5 && within(p, 0, 5, 0, 4) && !within(p, 1, 4, 0.5, 3);
                      }),
              10);
}

// The mean light of the task has R_a 82 ± 0.5, and ± 1 by intervals of wavelengths.
TEST(En12464, ColourRendering_IsJudgedByItsWholeInterval) {
    RoomSurfaces room;
    room.areas = {Area::task};
    const std::vector<SurfaceIlluminance> surfaces(1);
    ColourReport colour;
    colour.surfaces.resize(1);
    colour.surfaces[0].mean.values[2] = {82, 0.5};
    colour.surfaces[0].mean.by_intervals[2] = 1;
    const auto verdict = [&](const char* word, const ColourReport& of) {
        const std::vector<Judgement> all = judge(room, surfaces, {}, of, required(word));
        EXPECT_EQ(all.size(), 1U);
        return all.at(0).verdict;
    };
    EXPECT_EQ(verdict("Ra=80", colour), Verdict::met);
    EXPECT_EQ(verdict("Ra=81", colour), Verdict::undecided);
    EXPECT_EQ(verdict("Ra=84", colour), Verdict::missed);
    EXPECT_EQ(verdict("Ra=80", {}), Verdict::undecided);
}

TEST(En12464, TheSurroundOfATask_IsThatOfTheStandardsTable) {
    EXPECT_EQ(surround_of(1000), 500);
    EXPECT_EQ(surround_of(750), 500);
    EXPECT_EQ(surround_of(500), 300);
    EXPECT_EQ(surround_of(300), 200);
    EXPECT_EQ(surround_of(200), 150);
    EXPECT_EQ(surround_of(100), 100);
}

TEST(En12464, RequirementsThatAreNone_AreRefused) {
    for (const char* word : {"Emm=500", "Em", "Em=", "Em=x", "Em=-1", "Em=500,Em=300", "modelling=0.3",
                             "modelling=0.6-0.3", ",", "UGR=500"})
        EXPECT_THAT(error_of([&] { required(word); }), HasSubstr("--require")) << word;
    EXPECT_THAT(error_of([] { required("Emm=500"); }), HasSubstr("Em, U0, Ra, surround"));
}

TEST(En12464, WithoutARoom_WallsCannotBeRequired) {
    const std::string floor = side({0, 0, 0}, {5, 0, 0}, {0, 4, 0});
    const Job job = scene_of(floor + "LightSource \"point\"\n");
    const std::vector tasks{task()};
    EXPECT_THAT(error_of([&] { room_surfaces(job.scene, tasks, required("walls=50"), 1.2, kUp, false); }),
                HasSubstr("no room around \"desk\""));
    EXPECT_EQ(room_surfaces(job.scene, tasks, required("Em=50"), 1.2, kUp, false).surfaces.size(), 1U);
}

// Two point lights in groups of their own; each group keeps its own share.
TEST(Maintenance, FactorsOfGroups_MultiplyTheirLightAlone) {
    const std::string world =
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n" + box() +
        "LightSource \"point\" \"rgb I\" [500 500 500] \"point3 from\" [2 2 2.25] \"string "
        "lightgroup\" \"a\"\n"
        "LightSource \"point\" \"rgb I\" [200 200 200] \"point3 from\" [3 2 2.25] \"string "
        "lightgroup\" \"b\"\n";
    Monitor silent;
    IlluminanceOptions options;
    options.most_samples = 4;
    const IlluminanceReport initial = illuminance_on(std::vector{task()}, scene_of(world), options, silent);
    IlluminanceReport maintained = initial;
    MaintenanceFactors factors;
    parse_maintenance({}, "0.8", factors);
    parse_maintenance({}, "b=0.5", factors);
    maintain(maintained, factors);
    const SurfaceIlluminance &before = initial.surfaces[0], &after = maintained.surfaces[0];
    const auto group = [&](const char* name) {
        return static_cast<std::size_t>(std::ranges::find(initial.groups, name) - initial.groups.begin());
    };
    double mean = 0;
    for (std::size_t i = 0; i < before.points.size(); ++i) {
        const double expected =
            0.8 * before.points[i].groups[group("a")] + 0.5 * before.points[i].groups[group("b")];
        EXPECT_NEAR(after.points[i].all.value, expected, 1e-5 * expected);
        mean += expected / 12;
    }
    EXPECT_NEAR(after.mean.value, mean, 1e-5 * mean);
    EXPECT_LT(after.mean.value, 0.79 * before.mean.value);
    parse_maintenance({}, "c=0.5", factors);
    EXPECT_THAT(error_of([&] { maintain(maintained, factors); }), HasSubstr("no light group \"c\""));
    EXPECT_THAT(error_of([&] { parse_maintenance({"--maintenance-factor"}, "1.2", factors); }),
                HasSubstr("--maintenance-factor"));
}

}  // namespace en12464_test
}  // namespace lucerna
