// Models read from OBJ and MTL, against areas, volumes and materials computed by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "engine/image/image.h"
#include "engine/model/model.h"
#include "tests/support/temporary_folder.h"

namespace lucerna::read_obj_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Listener : public Monitor {
  public:
    void warn(std::string_view line) override { lines.emplace_back(line); }
    std::vector<std::string> lines;
};

// A room of 4 x 3 x 2.5 m in millimetres, z up, as seen from inside: its corners, and its faces.
constexpr const char* kCorners =
    "v 0 0 0\nv 4000 0 0\nv 4000 3000 0\nv 0 3000 0\n"
    "v 0 0 2500\nv 4000 0 2500\nv 4000 3000 2500\nv 0 3000 2500\n";
constexpr const char* kFaces = "f 1 2 3 4\nf 8 7 6 5\nf 2 1 5 6\nf 3 2 6 7\nf 4 3 7 8\nf 1 4 8 5\n";

class ReadObj : public ::testing::Test {
  protected:
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }
    Model read(const std::string& text, const ObjFrame& frame = {}) {
        write("m.obj", text);
        warned_ = {};
        return read_obj(folder_ / "m.obj", frame, warned_);
    }
    // Reads one triangle of a material of these lines.
    ModelMaterial material(const std::string& lines) {
        write("m.mtl", "newmtl a\n" + lines);
        return read("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n").materials.at(0);
    }
    // Expects an InputError of these words after the folder's name.
    void expect_refused(const std::string& text, const std::string& message) {
        SCOPED_TRACE(text);
        try {
            read(text);
            FAIL() << "it is accepted";
        } catch (const InputError& error) {
            std::string what = error.what();
            const std::string folder = folder_.path().string() + "/";
            for (std::size_t at = 0; (at = what.find(folder)) != what.npos;) what.erase(at, folder.size());
            EXPECT_EQ(what, message);
        }
    }

    testing::TemporaryFolder folder_;
    Listener warned_;
};

struct Sums {
    double area = 0, volume = 0;  // m², and m³ inside of faces that are seen from outside
};
Sums sums_of(const Model& model, int material = -1) {
    Sums sums;
    for (const ModelPlacement& placement : model.placements) {
        const ModelMesh& mesh = model.meshes[placement.mesh];
        if (material >= 0 && mesh.material != material) continue;
        for (const V3i& t : mesh.triangles) {
            V3d p[3];
            for (int i = 0; i < 3; ++i)
                placement.world_from_mesh.multVecMatrix(V3d(mesh.p[static_cast<std::size_t>(t[i])]), p[i]);
            sums.area += (p[1] - p[0]).cross(p[2] - p[0]).length() / 2;
            sums.volume += p[0].dot(p[1].cross(p[2])) / 6;
        }
    }
    return sums;
}

TEST_F(ReadObj, RoomInMillimetres_IsTurnedAndScaled) {
    const Model model = read(std::string(kCorners) + kFaces, {0.001, true});
    const Sums sums = sums_of(model);
    EXPECT_NEAR(sums.area, 2 * (4 * 3 + 4 * 2.5 + 3 * 2.5), 1e-5);
    EXPECT_NEAR(sums.volume, -4 * 3 * 2.5, 1e-5) << "the faces are seen from inside";
    ASSERT_EQ(model.meshes.size(), 1U);
    EXPECT_EQ(model.meshes[0].p.size(), 8U);
    EXPECT_THAT(model.meshes[0].n, IsEmpty());
    EXPECT_THAT(model.meshes[0].uv, IsEmpty());
    // (4000, 3000, 2500) with z up is (4, 2.5, -3) with y up.
    V3d high(-1e9), low(1e9);
    for (const V3f& each : model.meshes[0].p) {
        V3d p;
        model.placements.at(0).world_from_mesh.multVecMatrix(V3d(each), p);
        for (int i = 0; i < 3; ++i) high[i] = std::max(high[i], p[i]), low[i] = std::min(low[i], p[i]);
    }
    EXPECT_LT((high - V3d(4, 2.5, 0)).length(), 1e-6);
    EXPECT_LT((low - V3d(0, 0, -3)).length(), 1e-6);
    // Faces without a material are diffuse, and a warning says so.
    EXPECT_EQ(model.materials.at(0).base, Rgb(0.5F));
    EXPECT_EQ(model.materials.at(0).metallic, 0);
    EXPECT_EQ(model.materials.at(0).roughness, 1);
    EXPECT_THAT(warned_.lines, ElementsAre(HasSubstr("m.obj: faces without a material are diffuse")));
}

TEST_F(ReadObj, YUp_IsTheDefault) {
    const Model model = read("v 0 0 0\nv 0 0 2\nv 2 0 0\nf 1 2 3\n", {0.5, false});
    V3d up;
    model.placements.at(0).world_from_mesh.multDirMatrix(V3d(0, 1, 0), up);
    EXPECT_EQ(up, V3d(0, 0.5, 0));
    EXPECT_NEAR(sums_of(model).area, 0.5, 1e-12);
}

// Coordinates of a national grid in millimetres have no place in float32.
TEST_F(ReadObj, FarFromTheOrigin_KeepsItsPrecision) {
    std::string corners;
    for (const V3d& p : {V3d(0, 0, 0), V3d(1, 0, 0), V3d(1, 1, 0), V3d(0, 1, 0)})
        corners += fmt::format("v {} {} {}\n", 3500000001.0 + p.x, 5400000007.0 + p.y, p.z);
    const Model model = read(corners + "f 1 2 3 4\n", {0.001, true});
    EXPECT_NEAR(sums_of(model).area, 1e-6, 1e-12);
    V3d first;
    model.placements.at(0).world_from_mesh.multVecMatrix(V3d(model.meshes[0].p[0]), first);
    EXPECT_NEAR(first.x, 3500000.001, 1e-6);
    EXPECT_NEAR(first.z, -5400000.007, 1e-6);
}

TEST_F(ReadObj, ConcaveFloor_HasItsArea) {
    const std::string corners = "v 10 0 10\nv 10 0 13\nv 11 0 13\nv 11 0 11\nv 14 0 11\nv 14 0 10\n";
    for (const char* face :
         {"f 1 2 3 4 5 6\n", "f 4 5 6 1 2 3\n", "f 3 2 1 6 5 4\n", "f -1 -6 -5 -4 -3 -2\n"})
        EXPECT_NEAR(sums_of(read(corners + face)).area, 3 + 3, 1e-5) << face;
}

TEST_F(ReadObj, NegativeIndices_CountBackFromTheirLine) {
    const Model model = read(
        "v 9 9 9\nv 0 0 0\nv 2 0 0\nv 0 0 -2\nvn 1 0 0\nvn 0 3 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "f -3/-3/-1 -2/-2/-1 -1/-1/-1\nv 7 7 7\n");
    ASSERT_EQ(model.meshes.size(), 1U);
    EXPECT_NEAR(sums_of(model).area, 2, 1e-6);
    EXPECT_THAT(model.meshes[0].n, ElementsAre(V3f(0, 1, 0), V3f(0, 1, 0), V3f(0, 1, 0)));
    EXPECT_THAT(model.meshes[0].uv, ElementsAre(V2f(0, 0), V2f(1, 0), V2f(0, 1)));
}

// Flat and smooth faces of one group are separate meshes, as are groups and materials.
TEST_F(ReadObj, GroupsAndMaterials_AreSeparate) {
    write("two words.mtl",
          "newmtl White paint\nKd 0.8 0.8 0.8\n\nnewmtl b\nKd 0.1\nnewmtl unused\nmap_Kd no.png\n");
    const Model model = read(
        "mtllib two words.mtl\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nvn 0 0 1\r\nvn 0 0 0\r\no table\r\n"
        "usemtl White paint \r\nf 1 2 3\r\nf 1//1 2//1 3//1\r\nusemtl b\r\nf 1 2 3\r\ng leg one\r\n"
        "f 1// 2// 3//\r\ng table\r\nusemtl White paint\r\nf 3 2 1\r\nf 1//2 2//1 3//1\r\n");
    ASSERT_EQ(model.materials.size(), 2U);
    EXPECT_EQ(model.materials[0].name, "White paint");
    EXPECT_EQ(model.materials[0].base, Rgb(0.8F));
    EXPECT_EQ(model.materials[1].base, Rgb(0.1F));
    EXPECT_EQ(model.materials[1].roughness, 1);
    EXPECT_THAT(warned_.lines, IsEmpty());
    ASSERT_EQ(model.meshes.size(), 4U);
    const auto is = [&](std::size_t i, const char* name, int material, std::size_t triangles, bool smooth) {
        EXPECT_EQ(model.meshes[i].name, name);
        EXPECT_EQ(model.meshes[i].material, material);
        EXPECT_EQ(model.meshes[i].triangles.size(), triangles);
        EXPECT_EQ(!model.meshes[i].n.empty(), smooth);
    };
    is(0, "table", 0, 3, false);  // with that of a normal that is 0
    is(1, "table", 0, 1, true);
    is(2, "table", 1, 1, false);
    is(3, "leg one", 1, 1, false);
}

TEST_F(ReadObj, ContinuedLines_AreOne) {
    const Model model = read("\xEF\xBB\xBFv 0 0 0\nv 1 0 \\\n 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\r\n 3 \\\r\n 4");
    EXPECT_NEAR(sums_of(model).area, 1, 1e-6);
    expect_refused("v 0 0 0\n\\\n\nv 1 \\\n x 0\n",
                   "m.obj:4:7: \"x\" is not accepted; expected a number from -1e+12 to 1e+12");
}

TEST_F(ReadObj, Materials_AreTheNearest) {
    ModelMaterial made = material("Kd 0.2 0.4 0.6\nKs 0 0 0\nNs 30\nillum 2\n");
    EXPECT_EQ(made.base, Rgb(0.2F, 0.4F, 0.6F));
    EXPECT_EQ(made.roughness, 1) << "without Ks it is diffuse";
    EXPECT_EQ(made.metallic, 0);
    EXPECT_THAT(warned_.lines, IsEmpty());

    made = material("Kd 0.2 0.4 0.6\nKs 0.5 0.5 0.5\nNs 198\nNi 1.33\nillum 2\n");
    EXPECT_NEAR(made.roughness * made.roughness, 0.1, 1e-12) << "sqrt(2 / 200)";
    EXPECT_EQ(made.ior, 1.33);
    EXPECT_EQ(material("Kd 1 1 1\nKs 1 1 1\nillum 1\n").roughness, 1);
    EXPECT_EQ(material("Kd 1 1 1\nNi 1\n").ior, 1.5);
    EXPECT_EQ(material("Ns 10\n").base, Rgb(0.5F));

    made = material("Kd 0 0 0\nKs 0.9 0.9 0.9\nNs 1998\nillum 3\n");
    EXPECT_EQ(made.metallic, 1);
    EXPECT_EQ(made.base, Rgb(0.9F));
    EXPECT_EQ(material("Kd 0 0 0\nKs 0.9 0.9 0.9\nillum 2\n").metallic, 0) << "a black paint";

    made = material("Kd 0.5 0.5 0.5\nPr 0.3\nPm 1\nPc 0\naniso 0.0\n");
    EXPECT_EQ(made.metallic, 1);
    EXPECT_DOUBLE_EQ(made.roughness, 0.3);
    EXPECT_THAT(warned_.lines, IsEmpty());
    made = material("Kd 0 0 0\nKe 1000 900 800\n");
    EXPECT_EQ(made.emission, Rgb(1000, 900, 800));
    EXPECT_FALSE(made.two_sided);
}

TEST_F(ReadObj, Glass_IsAPane) {
    for (const char* lines :
         {"Kd 0.5 0.6 0.7\nd 0.3\n", "Tr 0.7\n", "illum 7\nNi 1.5\n", "d 1\nillum 4\nNi 1.5\n"}) {
        const ModelMaterial made = material(lines);
        EXPECT_TRUE(is_glass(made)) << lines;
        EXPECT_TRUE(made.thin);
        EXPECT_EQ(made.alpha, 1);
        EXPECT_THAT(warned_.lines, ElementsAre(HasSubstr("material \"a\" is a clear pane of glass")));
    }
    // Some exporters write this of every material.
    EXPECT_FALSE(is_glass(material("Kd 0.5 0.5 0.5\nillum 4\nTf 1 1 1\nNi 1\nd 1\nTr 0\n")));
    EXPECT_THAT(warned_.lines, IsEmpty());
    const ModelMaterial veil = material("Kd 0.5 0.5 0.5\nd 0.75\n");
    EXPECT_FALSE(is_glass(veil));
    EXPECT_DOUBLE_EQ(veil.alpha, 0.75);
}

TEST_F(ReadObj, Textures_AreNamedWithTheirMapping) {
    Image grey = Image::rgb(2, 1);
    grey.data = {0, 0, 0, 1, 1, 1};
    write_png_display(folder_ / "a b.png", grey);
    ModelMaterial made =
        material("Kd 1\nmap_Kd -s 2 3 1 -o 0.1 0.2 0 a b.png\nmap_d a b.png\nnorm a b.png\nd 0.5\n");
    EXPECT_EQ(made.base_texture.scale, V2d(2, 3));
    EXPECT_EQ(made.base_texture.offset, V2d(0.1, 0.2));
    EXPECT_EQ(made.base_texture.image, 0);
    EXPECT_EQ(made.normal.image, 0) << "a file is named once";
    ASSERT_TRUE(made.cutout);
    EXPECT_THAT(made.cutout->alpha, ElementsAre(0, 0.5F));
    EXPECT_EQ(made.alpha, 1);
    EXPECT_FALSE(is_glass(made));
    EXPECT_THAT(warned_.lines, IsEmpty());

    EXPECT_EQ(material("map_Kd a b.png\n").base, Rgb(1.0F));
    made = material("map_Kd  -o 0.5\t-s 2 3   a b.png\n");
    EXPECT_EQ(made.base_texture.scale, V2d(2, 3));
    EXPECT_EQ(made.base_texture.offset, V2d(0.5, 0));
    EXPECT_THAT(warned_.lines, IsEmpty());
    made = material("map_Kd -clamp on a b.png\nbump -bm 0.2 x.png\nmap_Ks x.png\nmap_Bump y.png\n");
    EXPECT_EQ(made.base_texture.image, 0);
    EXPECT_THAT(warned_.lines, ElementsAre(HasSubstr("m.mtl:3:1: \"bump\" is not read"),
                                           HasSubstr("m.mtl:5:1: \"map_Bump\" is not read"),
                                           HasSubstr("m.mtl:2:1: \"map_Kd -clamp\" is not read"),
                                           HasSubstr("m.mtl:4:1: \"map_Ks\" is not read")));
    // The renderer refuses a picture that does not exist, as that of a glTF file; here it gives a warning.
    EXPECT_EQ(material("map_Kd wood\\no.png\n").base_texture.image, 0);
    EXPECT_THAT(warned_.lines, ElementsAre(AllOf(HasSubstr("m.mtl:1:1: material \"a\": "),
                                                 HasSubstr("wood/no.png: no such file"))));
    EXPECT_THROW(material("map_d no.png\n"), InputError);
    write("not.png", "text");
    EXPECT_THROW(material("map_d not.png\n"), InputError);
}

TEST_F(ReadObj, WhatIsNotRead_IsSaidOnce) {
    read(
        "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0\ns 1\nf 1 2 3\nl 1 2\nl 2 3\nl 3 1\np 1\nf 1 1 2\ncurv 0 1 "
        "2\n");
    EXPECT_THAT(warned_.lines,
                ElementsAre(HasSubstr("without a material"), HasSubstr("m.obj:11:1: \"curv\" is not read"),
                            HasSubstr("m.obj:6:1: \"l\" is not read, nor 2 more"),
                            HasSubstr("m.obj:9:1: \"p\" is not read"),
                            HasSubstr("m.obj:10:1: a face without area is not read"),
                            HasSubstr("m.obj:1:1: the colour of vertices is not read, nor 1 more")));
}

TEST_F(ReadObj, WrongFiles_AreRefusedWithTheirLine) {
    const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const std::string none = "m.obj: has no faces; expected \"f\" with three or more corners";
    expect_refused("# nothing\n", none);
    expect_refused(three, none);
    expect_refused(three + "l 1 2\np 3\n", none);
    expect_refused(three + "f 1 2\n", none);
    expect_refused("\x01\xFF\xFE binary \n\n\x02", none);
    expect_refused("", "m.obj: the file is empty");
    expect_refused(three + "f 1 2 4\n", "m.obj:4:1: vertex 4 does not exist; there are 3 so far");
    expect_refused(three + "f 1 2 -4\n", "m.obj:4:1: vertex -4 does not exist; there are 3 so far");
    expect_refused(three + "f 1 2 0\n", "m.obj:4:1: vertex 0 does not exist; there are 3 so far");
    expect_refused(three + "f 1 2 -2147483648\n",
                   "m.obj:4:1: vertex -2147483648 does not exist; there are 3 so far");
    expect_refused(three + "f 1/1 2/1 3/1\n",
                   "m.obj:4:1: texture coordinate 1 does not exist; there are 0 so far");
    expect_refused(three + "vn 0 0 1\nf 1//1 2//1 3//2\n",
                   "m.obj:5:1: normal 2 does not exist; there are 1 so far");
    const std::string range = "is not accepted; expected a number from -1e+12 to 1e+12";
    expect_refused("v 0 nan 0\n", "m.obj:1:5: \"nan\" " + range);
    expect_refused("v 0 0 1e400\n", "m.obj:1:7: \"1e400\" " + range);
    expect_refused("v -1e13 0 0\n", "m.obj:1:3: \"-1e13\" " + range);
    expect_refused("\n v 1,5 0 0\n", "m.obj:2:4: \"1,5\" " + range);
    expect_refused("v 1 2\n", "m.obj:1:1: \"v\" with 2 numbers; expected 3");
    expect_refused("vn 1\n", "m.obj:1:1: \"vn\" with 1 numbers; expected 3");
    expect_refused("vt\n", "m.obj:1:1: \"vt\" with 0 numbers; expected 1");
    std::string many = three + "f";
    for (int i = 0; i < 4001; ++i) many += " 1";
    expect_refused(many, "m.obj:4:1: a face of 4001 corners; at most 4000 are accepted");
}

TEST_F(ReadObj, WrongMaterials_AreRefusedWithTheirLine) {
    expect_refused(
        "usemtl a\n",
        "m.obj:1:1: material \"a\" is not defined; expected \"newmtl a\" in a file that \"mtllib\" "
        "names before");
    expect_refused("mtllib no.mtl\n", "m.obj:1:1: no.mtl: no such file");
    expect_refused("\nmtllib a.mtl b.mtl\n", "m.obj:2:1: a.mtl: no such file");
    const auto expect_lines_refused = [this](const std::string& lines, const std::string& message) {
        write("m.mtl", "newmtl a\n" + lines);
        expect_refused("mtllib m.mtl\nv 0 0 0\n", message);
    };
    const std::string range = "is not accepted; expected a number from 0 to 1e+12";
    expect_lines_refused("Kd 0.5 0.5\n", "m.mtl:2:1: \"Kd\" with 2 numbers; expected 3, or 1 for grey");
    expect_lines_refused("Kd\n", "m.mtl:2:1: \"Kd\" with 0 numbers; expected 3, or 1 for grey");
    expect_lines_refused("Kd spectral a.rfl 1\n", "m.mtl:2:4: \"spectral\" " + range);
    expect_lines_refused("Ke -1 0 0\n", "m.mtl:2:4: \"-1\" " + range);
    expect_lines_refused("d -halo 0.5\n", "m.mtl:2:3: \"-halo\" " + range);
    expect_lines_refused("Ns\n", "m.mtl:2:1: \"Ns\" without a number");
    expect_lines_refused("map_Kd -s 2 2e13 1 a.png\n",
                         "m.mtl:2:13: \"2e13\" is not accepted; expected a number from -1e+12 to 1e+12");
    expect_lines_refused("map_Kd -clamp on\n", "m.mtl:2:1: \"map_Kd\" without a file's name");
    expect_lines_refused("map_Kd\n", "m.mtl:2:1: \"map_Kd\" without a file's name");
}

}  // namespace lucerna::read_obj_test
