// "from", "to" and "up" of lamps beside the same lamps placed by transformations.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <optional>

#include "engine/pbrt/transforms.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace lamp_placement_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

// The placement of the only lamp of a world, a point and three unit axes.
struct Placement {
    V3d at, x, y, z;
};

V3d moved(const M44d& m, const V3d& axis) {
    return transform_vector(m, axis).normalized();
}

class LampPlacement : public ::testing::Test {
  protected:
    void SetUp() override {
        std::ofstream(folder / "lamp.ies")
            << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 180\n0\n"
               "100 100\n";
    }

    // The text of a lamp of a kind with these parameters.
    std::string lamp(const std::string& kind, const std::string& parameters = "") const {
        const std::string file = kind == "ies"       ? (folder / "lamp.ies").string()
                                 : kind == "rayfile" ? "lamp.dat"
                                                     : "lamp.exr";
        return fmt::format("LightSource \"{}\" \"string filename\" \"{}\" {}\n", kind, file, parameters);
    }
    static Placement placement(const std::string& world) {
        const Read read = read_world(world);
        const auto& spec = read.draft.lights.at(0).spec;
        if (const auto* photometric = std::get_if<PhotometricSpec>(&spec)) {
            const LightAxes& axes = photometric->axes;
            return {photometric->position, V3d(axes.x), V3d(axes.y), V3d(axes.z)};
        }
        const auto* rays = std::get_if<RayFileSpec>(&spec);
        const M44d& m =
            rays ? rays->settings.world_from_light : std::get<MeasuredSpec>(spec).settings.world_from_light;
        return {m.translation(), moved(m, {1, 0, 0}), moved(m, {0, 1, 0}), moved(m, {0, 0, 1})};
    }
    static void expect_same(const Placement& a, const Placement& b) {
        constexpr double kClose = 1e-6;
        EXPECT_LT((a.at - b.at).length(), kClose);
        EXPECT_LT((a.x - b.x).length(), kClose);
        EXPECT_LT((a.y - b.y).length(), kClose);
        EXPECT_LT((a.z - b.z).length(), kClose);
    }

    static constexpr const char* kKinds[] = {"ies", "lightfield", "rayfile"};
    TemporaryFolder folder;
};

TEST_F(LampPlacement, FromAndTo_AreTheSameAsTranslateAndRotate) {
    struct Case {
        const char* parameters;
        const char* transformations;
    };
    const Case cases[] = {
        {"\"point3 from\" [1 2 3]", "Translate 1 2 3"},
        {"\"point3 to\" [0 0 5]", ""},
        {"\"point3 to\" [-7 0 0]", "Rotate -90 0 1 0"},
        {"\"point3 from\" [1 2 3] \"point3 to\" [9 2 3]", "Translate 1 2 3 Rotate 90 0 1 0"},
        {"\"point3 from\" [1 2 3] \"point3 to\" [1 2 -3]", "Translate 1 2 3 Rotate 180 0 1 0"},
        {"\"point3 from\" [0 1 0] \"point3 to\" [0 0 1]", "Translate 0 1 0 Rotate 45 1 0 0"},
        {"\"point3 from\" [0 1 0] \"point3 to\" [1 0 0]", "Translate 0 1 0 Rotate 90 0 1 0 Rotate 45 1 0 0"},
        // A lamp that hangs from a ceiling keeps C0 along x, where y is up and where z is.
        {"\"point3 from\" [1 3 0] \"point3 to\" [1 0 0]", "Translate 1 3 0 Rotate 90 1 0 0"},
        {"\"point3 to\" [0 2 0]", "Rotate -90 1 0 0"},
        {"\"point3 from\" [1 0 3] \"point3 to\" [1 0 0] \"vector3 up\" [0 0 2]",
         "Translate 1 0 3 Rotate 180 1 0 0"},
        {"\"point3 to\" [0 1 0] \"vector3 up\" [0 0 1]", "Rotate -90 1 0 0 Rotate 180 0 0 1"},
        {"\"point3 to\" [-1 0 0] \"vector3 up\" [1 0 0]", "Transform [0 1 0 0  0 0 -1 0  -1 0 0 0  0 0 0 1]"},
    };
    for (const char* kind : kKinds) {
        for (const Case& c : cases) {
            SCOPED_TRACE(std::string(kind) + " " + c.parameters);
            expect_same(placement(lamp(kind, c.parameters)),
                        placement(c.transformations + (" " + lamp(kind))));
        }
    }
}

TEST_F(LampPlacement, AnyDirection_IsThatOfLookAt) {
    const V3d from(0.3, 1.7, -2), points[] = {{4, 1, 2}, {-3, 0.2, 1}, {0.4, 9, -2.2}, {0.2, -5, -7}};
    for (const V3d& to : points) {
        for (const V3d& up : {V3d(0, 1, 0), V3d(0, 0, 1), V3d(1, 0, 0), V3d(1, -2, 0.5)}) {
            const M44d m = inverse(look_at(from, to, up).value()).value();
            const Placement expected{from, moved(m, {1, 0, 0}), moved(m, {0, 1, 0}), moved(m, {0, 0, 1})};
            const std::string parameters =
                fmt::format("\"point3 from\" [{} {} {}] \"point3 to\" [{} {} {}] \"vector3 up\" [{} {} {}]",
                            from.x, from.y, from.z, to.x, to.y, to.z, up.x, up.y, up.z);
            for (const char* kind : kKinds) expect_same(placement(lamp(kind, parameters)), expected);
        }
    }
}

TEST_F(LampPlacement, CurrentTransformation_AppliesAfterwards) {
    const std::string from_to = "\"point3 from\" [1 2 3] \"point3 to\" [4 0 3]";
    const std::string turned = "Translate 1 2 3 Rotate 90 0 1 0 Rotate 33.690067525979785 1 0 0 ";
    for (const std::string outer :
         {"Translate 5 6 7 ", "Rotate 20 1 2 3 Translate 0 1 0 ", "Scale 0.5 0.5 0.5 "}) {
        for (const char* kind : kKinds)
            expect_same(placement(outer + lamp(kind, from_to)), placement(outer + turned + lamp(kind)));
    }
    for (const std::string outer : {"Scale -1 1 1 ", "Rotate 20 1 2 3 Scale 1 1 -1 "}) {
        expect_same(placement(outer + lamp("ies", from_to)), placement(outer + turned + lamp("ies")));
        for (const char* kind : {"lightfield", "rayfile"})
            EXPECT_THAT(refusal_of_world(outer + lamp(kind, from_to)), HasSubstr("is mirrored"));
    }
    // A lamp turns about its axis by a rotation about the direction that it shines in.
    expect_same(placement("Translate 1 3 0 Rotate 30 0 -1 0 " + lamp("ies", "\"point3 to\" [0 -1 0]")),
                placement("Translate 1 3 0 Rotate 90 1 0 0 Rotate 30 0 0 1 " + lamp("ies")));
}

TEST_F(LampPlacement, LampOnAShape_HasThemToo) {
    const auto on_sphere = [&](const std::string& before, const std::string& parameters) {
        const Read read =
            read_world(before + "AreaLightSource \"lightfield\" \"string filename\" \"lamp.exr\" " +
                       parameters + " Shape \"sphere\"");
        return std::get<AreaSpec>(read.draft.lights.at(0).spec).lamp->world_from_light;
    };
    EXPECT_TRUE(on_sphere("", "\"point3 from\" [1 3 0] \"point3 to\" [1 0 0]")
                    .equalWithAbsError(on_sphere("Translate 1 3 0 Rotate 90 1 0 0 ", ""), 1e-12));
}

TEST_F(LampPlacement, PlacesWithoutADirection_AreRefused) {
    for (const char* kind : kKinds) {
        const std::string same =
            refusal_of_world(lamp(kind, "\"point3 from\" [1 2 3]\n\"point3 to\" [1 2 3]"));
        EXPECT_THAT(same, HasSubstr("scene.pbrt:3:"));
        EXPECT_THAT(same, HasSubstr("\"from\" (1 2 3) and \"to\" (1 2 3) of LightSource"));
        EXPECT_THAT(same, HasSubstr("expected two different points"));
        EXPECT_THAT(refusal_of_world(lamp(kind, "\"point3 to\" [0 0 0]")),
                    HasSubstr("expected two different points"));
        EXPECT_THAT(refusal_of_world(lamp(kind, "\"point3 from\" [-1e308 0 0] \"point3 to\" [1e308 0 0]")),
                    HasSubstr("expected two different points"));
        EXPECT_THAT(refusal_of_world(lamp(kind, "\"point3 to\" [0 0 1] \"vector3 up\" [0 0 0]")),
                    HasSubstr("is (0 0 0), which is not a direction"));
        EXPECT_THAT(refusal_of_world(lamp(kind, "\"point3 to\" [0 0]")), HasSubstr("\"point3 to\""));
        EXPECT_THAT(refusal_of_world(lamp(kind, "\"point3 from\" [0 0 1] \"vector3 up\" [0 0 1]")),
                    HasSubstr("\"vector3 up\" of LightSource"))
            << "there is nothing to turn without \"to\"";
    }
}

}  // namespace lamp_placement_test
}  // namespace lucerna
