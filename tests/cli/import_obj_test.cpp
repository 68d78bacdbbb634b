// `lucerna import` of OBJ files: the scene that it writes and what it refuses.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "engine/system/files.h"
#include "tests/cli/run_support.h"

namespace lucerna::import_obj_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::lucerna_run;
using ::testing::Not;
using testing::Outcome;

class RunImportObj : public testing::RunTest {
  protected:
    // Returns the scene.
    std::string import(const std::vector<std::string>& options = {}) {
        std::vector<std::string> words{"import", "m.obj", "-o", "m.pbrt", "--overwrite"};
        words.insert(words.end(), options.begin(), options.end());
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        said_ = outcome.out + outcome.err;
        return read_text("m.pbrt");
    }
    std::string said_;
};

// A room of 4 x 3 x 2.5 m in millimetres, z up, with a floor and a ceiling of their own.
constexpr const char* kRoom =
    "mtllib m.mtl\nv 0 0 0\nv 4000 0 0\nv 4000 3000 0\nv 0 3000 0\nv 0 0 2500\nv 4000 0 2500\n"
    "v 4000 3000 2500\nv 0 3000 2500\ng floor\nusemtl floor\nf 1 2 3 4\ng ceiling\nusemtl white\nf 8 7 6 5\n"
    "g walls\nusemtl grey\nf 2 1 5 6\nf 3 2 6 7\nf 4 3 7 8\nf 1 4 8 5\n";
constexpr const char* kPaints =
    "newmtl floor\nKd 0.2 0.2 0.2\nnewmtl white\nKd 0.8 0.8 0.8\nnewmtl grey\nKd 0.5\n";

// Returns the mean illuminance on the work plane of a scene to which a lamp is added.
double mean_of(const std::string& scene) {
    std::ofstream("lit.pbrt")
        << scene
        << "LightSource \"point\" \"rgb I\" [ 200 200 200 ] \"point3 from\" [ 1.5 2.2 -1 ]\n"
           "CalculationSurface \"plane\" \"point3 P\" [ 0.1 0.75 -2.9  0.1 0.75 -0.1  3.9 0.75 -2.9 ] "
           "\"integer points\" [ 2 2 ]\n";
    const Outcome lux =
        lucerna_run({"lux", "lit.pbrt", "--samples", "16", "-o", "lux.csv", "--json", "lux.json", "--quiet"});
    EXPECT_EQ(lux.code, 0) << lux.err;
    return nlohmann::json::parse(read_text("lux.json"))["surfaces"][0]["mean"]["value"];
}

TEST_F(RunImportObj, RoomInMillimetres_HasTheIlluminanceOfTheRoom) {
    write("m.obj", kRoom);
    write("m.mtl", kPaints);
    std::string scene = import({"--unit", "mm", "--up", "z"});
    EXPECT_THAT(said_, AllOf(HasSubstr("no camera"), HasSubstr("no light"),
                             HasSubstr("3 shapes, 12 triangles, 3 materials")));
    ASSERT_EQ(lucerna_run({"render", "m.pbrt", "--spp", "1", "--resolution", "8x6", "--quiet"}).code, 0);
    // The sky and the sun that are added shine on the outside alone.
    for (std::size_t at = 0; (at = scene.find("LightSource")) != scene.npos;)
        scene.erase(at, scene.find('\n', at) - at);
    const double imported = mean_of(scene);

    std::string room =
        "Option \"string unit\" \"photometric\"\nLookAt 1 1 -1  2 1 -1  0 1 0\nCamera \"perspective\"\n"
        "Film \"rgb\"\nWorldBegin\n";
    const auto face = [&room](double reflectance, const char* corners) {
        room += fmt::format(
            "Material \"diffuse\" \"rgb reflectance\" [ {0} {0} {0} ]\n"
            "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ {1} ]\n",
            reflectance, corners);
    };
    face(0.2, "0 0 0  4 0 0  4 0 -3  0 0 -3");
    face(0.8, "0 2.5 -3  4 2.5 -3  4 2.5 0  0 2.5 0");
    face(0.5, "4 0 0  0 0 0  0 2.5 0  4 2.5 0");
    face(0.5, "4 0 -3  4 0 0  4 2.5 0  4 2.5 -3");
    face(0.5, "0 0 -3  4 0 -3  4 2.5 -3  0 2.5 -3");
    face(0.5, "0 0 0  0 0 -3  0 2.5 -3  0 2.5 0");
    const double written = mean_of(room);
    EXPECT_GT(written, 50);
    EXPECT_NEAR(imported, written, 1e-3 * written);
}

TEST_F(RunImportObj, MaterialsAreWritten) {
    write("m.mtl",
          "newmtl paint\nKd 0.2 0.4 0.6\nKs 0.5 0.5 0.5\nNs 198\nnewmtl pane\nd 0.1\nnewmtl lamp\nKd 0 0 0\n"
          "Ke 1000 900 800\nnewmtl chalk\nKd 0.7 0.7 0.7\nmap_Kd -s 2 2 1 chalk.png\n");
    write("m.obj",
          "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl paint\nf 1 2 3\nusemtl pane\nf 1 2 3\n"
          "usemtl lamp\nf 1 2 3\nusemtl chalk\nf 1/1 2/1 3/1\n");
    EXPECT_THAT(
        import({"--unit", "ft"}),
        AllOf(HasSubstr("\"0 paint\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [ 0.2 0.4 0.6 ] "
                        "\"float roughness\" 0.1 \"bool remaproughness\" false \"float eta\" 1.5"),
              HasSubstr("\"1 pane\" \"string type\" \"thindielectric\" \"float eta\" 1.5"),
              HasSubstr("AreaLightSource \"diffuse\" \"rgb L\" [ 1000 900 800 ]"),
              HasSubstr("\"3 chalk\" \"string type\" \"diffuse\" \"texture reflectance\" \"3 chalk base\""),
              HasSubstr("\"chalk.png\" \"string encoding\" \"sRGB\" \"float uscale\" 2 \"float vscale\" 2 "
                        "\"float scale\" 0.7"),
              HasSubstr("Transform [ 0.30480"), Not(HasSubstr("\"infinite\""))));
    EXPECT_THAT(said_, AllOf(HasSubstr("m.mtl:10:1: material \"chalk\": chalk.png: no such file"),
                             HasSubstr("material \"pane\" is a clear pane of glass")));
}

TEST_F(RunImportObj, Units_AreNamesOrNumbers) {
    write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    EXPECT_THAT(import(), HasSubstr("Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 ]"));
    EXPECT_THAT(import({"--unit", "0.5", "--up", "y"}), HasSubstr("Transform [ 0.5 0 0 0 0 0.5 0"));
    EXPECT_THAT(import({"--unit", "2", "--up", "z"}), HasSubstr("Transform [ 2 0 0 0 0 0 -2 0 0 2 0 0 0"));
    EXPECT_THAT(import({"--unit", "cm"}), HasSubstr("Transform [ 0.01"));
    EXPECT_THAT(import({"--unit", "in"}), HasSubstr("Transform [ 0.02539999"));
}

TEST_F(RunImportObj, WrongWords_AreRefused) {
    write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (const char* unit : {"inch", "0", "-1", "nan", "1e9", "5mm", ""})
        expect_refused({"import", "m.obj", "-o", "m.pbrt", "--unit", unit},
                       {"--unit", "mm, cm, m, in, ft, or metres as a number"});
    expect_refused({"import", "m.obj", "-o", "m.pbrt", "--up", "x"},
                   {"--up: \"x\" is not accepted; expected y or z"});
    write("m.gltf", "{}");
    expect_refused({"import", "m.gltf", "-o", "m.pbrt", "--unit", "m"},
                   {"m.gltf: --unit is for OBJ files; in glTF lengths are metres and y is up"});
    expect_refused({"import", "m.gltf", "-o", "m.pbrt", "--up", "y"}, {"m.gltf: --up is for OBJ files"});
    write("m.obj", "mtllib m.pbrt\n");
    write("m.pbrt", "newmtl a\n");
    expect_refused({"import", "m.obj", "-o", "m.pbrt", "--overwrite"}, {"m.obj: has no faces"});
    write("m.obj", "mtllib m.pbrt\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
    expect_refused({"import", "m.obj", "-o", "m.pbrt", "--overwrite", "--quiet"},
                   {"m.pbrt", "is read by this command"});
}

// Every prefix of a good file, and every good file with a byte changed, is read or refused in one line.
TEST_F(RunImportObj, GarbageAndTruncation_AreRefusedOrRead) {
    const std::string good = kRoom;
    write("m.mtl", kPaints);
    std::uint32_t dice = 1;
    for (int i = 0; i < 300; ++i) {
        std::string bad =
            good.substr(0, i % 2 != 0 ? good.size() : good.size() * static_cast<std::size_t>(i) / 300);
        for (int k = 0; k < 3 && i % 2 != 0; ++k) {
            dice = dice * 1664525U + 1013904223U;
            bad[dice / 7 % bad.size()] = static_cast<char>(dice >> 24U);
        }
        write("m.obj", bad);
        const Outcome outcome = lucerna_run({"import", "m.obj", "-o", "m.pbrt", "--quiet", "--overwrite"});
        EXPECT_LE(outcome.code, 1) << outcome.err;
        if (outcome.code == 1) {
            EXPECT_THAT(outcome.err, HasSubstr("m.obj"));
        }
    }
}

}  // namespace lucerna::import_obj_test
