// Shapes: how they are read, which side is outside, and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "engine/pbrt/transforms.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace shapes_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

constexpr std::string_view kTriangle = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]";

// Returns the geometric normal by mesh.h's convention.
V3d normal_of(const DraftMesh& mesh) {
    const V3i& t = mesh.triangles.at(0);
    const V3d cross = (mesh.p[t.y] - mesh.p[t.x]).cross(mesh.p[t.z] - mesh.p[t.x]).normalized();
    return mesh.traits.reverse_orientation ? -cross : cross;
}

// Returns the normal of mesh.h's quadrics at the object-space point whose outward normal is n.
V3d normal_of(const Quadric& quadric, const V3d& n) {
    const V3d moved = transform_normal(inverse(quadric.world_from_object).value(), n).normalized();
    return quadric.traits.reverse_orientation ? -moved : moved;
}

struct Turn {
    const char* directives;
    bool reverse, mirror;
};
constexpr Turn kTurns[] = {{"", false, false},
                           {"ReverseOrientation ", true, false},
                           {"Scale 1 1 -1 ", false, true},
                           {"ReverseOrientation Scale 1 1 -1 ", true, true},
                           {"Scale -1 -1 1 ", false, false},
                           {"ReverseOrientation ReverseOrientation ", false, false},
                           {"Scale -1 -1 -1 ", false, true}};

TEST(Shapes, TriangleNormal_IsPbrtsInEveryTurn) {
    for (const Turn& turn : kTurns) {
        const Read read = read_world(turn.directives + std::string(kTriangle));
        const DraftMesh& mesh = read.draft.meshes.at(0);
        // pbrt takes the cross product of the world-space edges and flips it if exactly one of the two flags
        // is true.
        const V3d cross = (mesh.p[1] - mesh.p[0]).cross(mesh.p[2] - mesh.p[0]).normalized();
        const V3d expected = turn.reverse != turn.mirror ? -cross : cross;
        EXPECT_EQ(normal_of(mesh), expected) << turn.directives;
    }
}

TEST(Shapes, TriangleUnderMirror_KeepsItsOwnSide) {
    // (0,0,1) in object space is (0,0,-1) after Scale 1 1 -1: the surface is mirrored together with its
    // outside.
    EXPECT_EQ(normal_of(read_world("Scale 1 1 -1 " + std::string(kTriangle)).draft.meshes.at(0)),
              V3d(0, 0, -1));
    EXPECT_EQ(normal_of(read_world("Scale -1 1 1 " + std::string(kTriangle)).draft.meshes.at(0)),
              V3d(0, 0, 1));
}

// As pbrt samples quadrics as lights, the transformation carries the outside along, and ReverseOrientation
// flips it.
TEST(Shapes, QuadricNormal_IsCarriedAlongInEveryTurn) {
    for (const Turn& turn : kTurns) {
        const std::string text(turn.directives);
        for (const auto& [shape, outward] :
             {std::pair("Shape \"sphere\"", V3d(1, 0, 0)), std::pair("Shape \"disk\"", V3d(0, 0, 1))}) {
            const Read read = read_world(text + shape);
            const Quadric& quadric = read.draft.quadrics.at(0);
            const V3d moved =
                transform_normal(inverse(quadric.world_from_object).value(), outward).normalized();
            EXPECT_EQ(normal_of(quadric, outward), turn.reverse ? -moved : moved) << text << shape;
        }
    }
}

TEST(Shapes, VertexNormals_TurnTheTriangleToTheirSide) {
    const std::string down = std::string(kTriangle) + " \"normal3 N\" [0 0 -1 0 0 -1 0 0 -1]";
    const std::string up = std::string(kTriangle) + " \"normal N\" [0 0 2 0 0 2 0 0 2]";
    EXPECT_EQ(normal_of(read_world(down).draft.meshes.at(0)), V3d(0, 0, -1));
    EXPECT_EQ(normal_of(read_world(up).draft.meshes.at(0)), V3d(0, 0, 1));
    EXPECT_EQ(normal_of(read_world("ReverseOrientation " + up).draft.meshes.at(0)), V3d(0, 0, -1));
    EXPECT_EQ(normal_of(read_world("Scale 1 1 -1 " + up).draft.meshes.at(0)), V3d(0, 0, -1));
    EXPECT_EQ(read_world(up).draft.meshes.at(0).n.at(0), V3f(0, 0, 1)) << "unit length";
}

TEST(Shapes, VertexNormalsOfNoDirection_AreReplacedWithAWarning) {
    const Read read = read_world(std::string(kTriangle) + " \"normal3 N\" [0 0 0 0 0 1 0 0 1e-200]");
    ASSERT_EQ(read.warnings.size(), 1U);
    EXPECT_THAT(read.warnings[0], HasSubstr("scene.pbrt:2:1: Shape \"trianglemesh\": 1 of 3 vertex normals"));
    EXPECT_EQ(read.draft.meshes[0].n, (std::vector<V3f>{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}));
}

TEST(Shapes, Mesh_KeepsIndicesAndTextureCoordinates) {
    for (const std::string uv : {"\"float uv\"", "\"point2 uv\"", "\"float st\"", "\"point2 st\""}) {
        const Read read = read_world(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [0 0 0 1 0 0 1 1 0 0 1 "
            "0] " +
            uv + " [0 0 5 0 5 5 0 5]");
        const DraftMesh& mesh = read.draft.meshes.at(0);
        EXPECT_EQ(mesh.triangles, (std::vector<V3i>{{0, 1, 2}, {0, 2, 3}}));
        EXPECT_EQ(mesh.uv, (std::vector<V2f>{{0, 0}, {5, 0}, {5, 5}, {0, 5}}));
        EXPECT_TRUE(read.warnings.empty());
    }
}

TEST(Shapes, BadMeshes_AreRefusedWithThePlaceOfTheValue) {
    const std::string p = "\"point3 P\" [0 0 0 1 0 0 0 1 0]";
    const auto mesh = [&](const std::string& rest) {
        return refusal_of_world("Shape \"trianglemesh\" " + rest);
    };
    EXPECT_EQ(mesh(p + " \"integer indices\" [0 1\n 3]"),
              "scene.pbrt:3:2: \"indices\": 3 is not accepted; the mesh has vertices 0 to 2");
    EXPECT_THAT(mesh(p + " \"integer indices\" [0 -1 2]"), HasSubstr("\"indices\": -1 is not accepted"));
    EXPECT_THAT(mesh(p + " \"integer indices\" [0 1.5 2]"), HasSubstr("\"indices\": 1.5 is not accepted"));
    EXPECT_THAT(mesh(p + " \"integer indices\" [0 1 2 0]"),
                HasSubstr("has 4 entries; expected a multiple of 3"));
    EXPECT_THAT(mesh(p + " \"integer indices\" []"), HasSubstr("has 0 entries"));
    EXPECT_THAT(mesh("\"point3 P\" [0 0 0 1]"), HasSubstr("has 4 numbers; expected a multiple of 3"));
    EXPECT_THAT(mesh("\"point3 P\" [0 0 0 1 0 0 0 1 nan]"), HasSubstr("nan is not a finite number"));
    EXPECT_THAT(mesh("\"point3 P\" [0 0 0 1 0 0 0 1 1e999]"), HasSubstr("1e999 is not a finite number"));
    EXPECT_THAT(mesh("\"point3 P\" []"), HasSubstr("lacks \"point3 P\""));
    EXPECT_THAT(mesh(""), HasSubstr("lacks \"point3 P\""));
    EXPECT_THAT(mesh("\"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 1]"), HasSubstr("lacks \"integer indices\""));
    EXPECT_THAT(mesh(p + " \"normal3 N\" [0 0 1]"), HasSubstr("\"N\" has 1 entries for 3 vertices"));
    EXPECT_THAT(mesh(p + " \"float uv\" [0 0 1]"), HasSubstr("\"uv\" has 3 numbers"));
    EXPECT_THAT(
        refusal_of_world("Scale 1e10 1 1 Shape \"trianglemesh\" \"point3 P\" [1e305 0 0 1 0 0 0 1 0]"),
        HasSubstr("vertex 0 is transformed to (inf 0 0)"));
}

TEST(Shapes, Ply_IsReadFromTheScenesFolder) {
    const TemporaryFolder folder;
    std::ofstream(folder / "a.ply")
        << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
           "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
           "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    RecordingMonitor monitor;
    const std::string text =
        std::string(kHead) + "Translate 0 0 5 Shape \"plymesh\" \"string filename\" \"a.ply\"";
    const Draft draft = read_draft(text, folder / "scene.pbrt", {}, monitor);
    EXPECT_EQ(draft.meshes.at(0).p, (std::vector<V3d>{{0, 0, 5}, {1, 0, 5}, {0, 1, 5}}));
    EXPECT_THAT(refusal_of_world("Shape \"plymesh\" \"string filename\" \"missing.ply\""),
                HasSubstr("scene.pbrt:2:17: missing.ply: no such file"));
    EXPECT_THAT(refusal_of_world("Shape \"plymesh\""), HasSubstr("lacks \"string filename\""));
    SceneOverrides skip;
    skip.skip_missing = true;
    const Read skipped = read_file_text(
        std::string(kHead) + "Shape \"plymesh\" \"string filename\" \"missing.ply\" Shape \"sphere\"", skip);
    EXPECT_TRUE(skipped.draft.meshes.empty());
    EXPECT_EQ(skipped.draft.quadrics.size(), 1U);
    EXPECT_THAT(skipped.warnings.at(0), HasSubstr("no such file \"missing.ply\""));
}

TEST(Shapes, EveryShape_IsReadWithPbrtsParameters) {
    const Read read = read_world(
        "Shape \"cylinder\" \"float zmin\" 3 \"float zmax\" 1 Shape \"cone\" \"float height\" 2\n"
        "Shape \"paraboloid\" \"float zmin\" -1 Shape \"hyperboloid\" \"point3 p1\" [1 0 0] \"point3 p2\" [1 "
        "1 1]\n"
        "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 1]\n"
        "Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0 4 0 0 5 0 0 6 0 0] \"float width0\" 2\n"
        "Shape \"curve\" \"string basis\" \"bspline\" \"integer degree\" 2 \"string type\" \"cylinder\"\n"
        "    \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]\n"
        "Shape \"loopsubdiv\" \"integer levels\" 1 \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 0 0 1 0 "
        "0 1 1 0 0 1 0]\n"
        "Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 3 \"float Pz\" [0 1 2 3 4 5]");
    const auto& quadrics = read.draft.quadrics;
    ASSERT_EQ(quadrics.size(), 4U);
    EXPECT_EQ(quadrics[0].z_min, 1);
    EXPECT_EQ(quadrics[0].z_max, 3);
    EXPECT_EQ(quadrics[1].height, 2);
    EXPECT_EQ(quadrics[2].z_min, 0);
    EXPECT_EQ(quadrics[3].p2, V3f(1, 1, 1));
    EXPECT_EQ(read.draft.patches.at(0).patches.size(), 1U);
    const DraftCurves& flat = read.draft.curves.at(0);
    ASSERT_EQ(flat.segments.size(), 2U);
    EXPECT_EQ(flat.segments[1].u_from, 0.5F);
    EXPECT_EQ(flat.radius.front(), 1);
    EXPECT_EQ(flat.radius.back(), 0.5F);
    const DraftCurves& spline = read.draft.curves.at(1);
    EXPECT_EQ(spline.kind, Curves::Kind::round);
    ASSERT_EQ(spline.segments.size(), 2U);
    EXPECT_EQ(spline.p.front(), V3d(0.5, 0, 0)) << "a quadratic B-spline begins between its first two points";
    EXPECT_EQ(spline.p.back(), V3d(2.5, 0, 0));
    EXPECT_EQ(read.draft.meshes.at(0).triangles.size(), 8U);
    EXPECT_EQ(read.draft.meshes.at(1).p.at(5), V3d(1, 1, 5));
    EXPECT_TRUE(read.warnings.empty());
}

TEST(Shapes, CutOuts_ReachTheShapeAndConstantsAreTakenForWhatTheyAre) {
    const Read read = read_world(
        "Shape \"sphere\" \"float alpha\" 0.5 Shape \"sphere\" \"float alpha\" 1\n"
        "Shape \"sphere\" \"float alpha\" 0 Shape \"sphere\" \"float shadowalpha\" 0");
    ASSERT_EQ(read.draft.quadrics.size(), 3U) << "alpha 0 is not there";
    EXPECT_TRUE(read.draft.quadrics[0].traits.alpha);
    EXPECT_FALSE(read.draft.quadrics[1].traits.alpha);
    EXPECT_TRUE(read.draft.quadrics[2].traits.shadow_alpha);
}

TEST(Shapes, SmallMeshesOfEqualTraits_BecomeOne) {
    const std::string triangle = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] ";
    const SceneParts parts = parts_of_world(
        triangle + "Translate 1 2 3 " + triangle + "ReverseOrientation " + triangle + "Material \"matte\" " +
        triangle + triangle + "AreaLightSource \"diffuse\" " + triangle + "Translate 0 0 1 " + triangle);
    ASSERT_EQ(parts.meshes.size(), 5U);
    EXPECT_EQ(parts.meshes[0].triangles, (std::vector<V3i>{{0, 1, 2}, {3, 4, 5}}));
    EXPECT_EQ(V3d(parts.meshes[0].p[4]) + parts.origin, V3d(2, 2, 3));
    EXPECT_EQ(parts.meshes[3].traits.light, 0);
    EXPECT_EQ(parts.meshes[4].traits.light, 1);
}

TEST(Shapes, EmittersOfAnyShape_ShineInProportionToTheirArea) {
    const auto power = [](const std::string& shape) {
        const SceneParts parts = parts_of_world("AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] " + shape);
        return parts.lights.at(0)->power() / M_PI;  // π L A
    };
    EXPECT_NEAR(power("Shape \"cylinder\" \"float radius\" 0.5"), 2 * M_PI, 0.01);
    EXPECT_NEAR(power("Shape \"cone\""), M_PI * std::sqrt(2.0), 0.01);
    EXPECT_NEAR(power("Shape \"sphere\" \"float phimax\" 90"), M_PI, 0.01);
    EXPECT_NEAR(power("Scale 1 1 2 Shape \"sphere\""), 21.4784, 0.05);
    EXPECT_NEAR(power("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 2 0 0 0 1 0 2 1 0]"), 2, 1e-6);
    EXPECT_NEAR(power("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"float width\" 0.2"),
                0.2 * M_PI * 3, 0.05);
}

TEST(Shapes, Quadrics_TakePbrtsParametersAndDefaults) {
    const Read read = read_world(
        "Shape \"sphere\" Shape \"sphere\" \"float radius\" 2 \"float zmin\" -1 \"float zmax\" 5 \"float "
        "phimax\" 180\n"
        "Shape \"disk\" \"float height\" -3 \"float radius\" [4] \"float innerradius\" 1");
    const Quadric& whole = read.draft.quadrics.at(0);
    EXPECT_EQ(whole.kind, Quadric::Kind::sphere);
    EXPECT_EQ(whole.radius, 1);
    EXPECT_EQ(whole.z_min, -INFINITY);
    EXPECT_EQ(whole.z_max, INFINITY);
    EXPECT_FLOAT_EQ(whole.phi_max, 2 * kPi);
    const Quadric& part = read.draft.quadrics.at(1);
    EXPECT_EQ(part.z_min, -1);
    EXPECT_EQ(part.z_max, INFINITY) << "beyond the radius it does not cut";
    EXPECT_FLOAT_EQ(part.phi_max, kPi);
    const Quadric& disk = read.draft.quadrics.at(2);
    EXPECT_EQ(disk.kind, Quadric::Kind::disk);
    EXPECT_EQ(disk.height, -3);
    EXPECT_EQ(disk.radius, 4);
    EXPECT_EQ(disk.inner_radius, 1);
}

TEST(Shapes, BadQuadrics_AreRefused) {
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" 0"),
                HasSubstr("scene.pbrt:2:16: radius of Shape \"sphere\": 0 is not accepted"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" -1"), HasSubstr("-1 is not accepted"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float zmin\" 2 \"float zmax\" 3"),
                HasSubstr("leave nothing"));
    EXPECT_THAT(refusal_of_world("Shape \"disk\" \"float innerradius\" 1"),
                HasSubstr("is not less than radius 1"));
    EXPECT_THAT(refusal_of_world("Shape \"disk\" \"float phimax\" 0"), HasSubstr("phimax"));
}

TEST(Shapes, OtherNames_AreToldFromUnknownOnes) {
    EXPECT_THAT(refusal_of_world("Shape \"nurbs\""), HasSubstr("expected an order of 2 to 16"));
    EXPECT_THAT(refusal_of_world("Shape \"spere\""),
                HasSubstr("unknown Shape \"spere\"; did you mean \"sphere\"? known are"));
}

TEST(Shapes, FarScene_KeepsItsShapeToFloatAccuracy) {
    // The offset is 0.1 at a distance of 1e7, where floats have a spacing of 1.
    const auto scene = [](const std::string& move) {
        return parts_of_world(
            move + "LightSource \"point\" \"point3 from\" [0.3 0.4 0.5]" +
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] "
            "\"point3 P\" [0 0 0 0.1 0 0 0.1 0.1 0 0 0.1 0.3] Shape \"sphere\" \"float radius\" 0.1 ");
    };
    const SceneParts near = scene(""), far = scene("Translate 1e7 -2e7 3e7 ");
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR((near.meshes.at(0).p[i] - far.meshes.at(0).p[i]).length(), 0, 2e-8F) << i;
    }
    EXPECT_NEAR((far.origin - near.origin - V3d(1e7, -2e7, 3e7)).length(), 0, 1e-7);
    const V3d a = near.quadrics.at(0).world_from_object.translation();
    const V3d b = far.quadrics.at(0).world_from_object.translation();
    EXPECT_NEAR((a - b).length(), 0, 2e-8);
    const auto x = near.lights.at(0)->sample_Li(V3f(0), {0.5F, 0.5F});
    const auto y = far.lights.at(0)->sample_Li(V3f(0), {0.5F, 0.5F});
    EXPECT_NEAR(x->distance, y->distance, 1e-7F);
}

TEST(Shapes, Origin_IsTheMiddleOfTheWorld) {
    const SceneParts parts = parts_of_world(
        "LightSource \"point\" \"point3 from\" [100 0 0] "
        "Translate 10 20 30 Scale 2 2 2 Rotate 45 1 1 0 Shape \"sphere\"");
    EXPECT_NEAR((parts.origin - V3d(10, 20, 30)).length(), 0, 1e-12) << "lights do not count beside shapes";
    const SceneParts lamps =
        parts_of_world("LightSource \"point\" \"point3 from\" [100 0 0] LightSource \"point\"");
    EXPECT_EQ(lamps.origin, V3d(50, 0, 0));
    EXPECT_EQ(parts_of_world("").origin, V3d(0, 0, 0));
}

}  // namespace shapes_test
}  // namespace lucerna
