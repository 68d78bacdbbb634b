// Files with upper-case suffixes (.PNG, .EXR, .PBRT, …) are read and written by their type: every command
// works alike in a folder in which all suffixes are upper-case.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <set>

#include "engine/colour/tone.h"
#include "engine/image/image.h"
#include "engine/image/photograph.h"
#include "engine/system/files.h"
#include "tests/process/command.h"
#include "tests/process/good_files.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace suffixes_test {

using namespace testing;
namespace fs = std::filesystem;

constexpr const char* kScene = R"(
Camera "perspective" Film "rgb" "integer xresolution" 16 "integer yresolution" 16
Sampler "independent" "integer pixelsamples" 4
WorldBegin
Include "part.pbrt"
Include "packed.pbrt.gz"
LightSource "lightfield" "string filename" "lamp.exr"
LightSource "rayfile" "string filename" "lamp.tm25ray"
LightSource "ies" "string filename" "lamp.ies"
LightSource "ldt" "string filename" "lamp.ldt"
LightSource "infinite" "string filename" "picture.exr"
Shape "plymesh" "string filename" "mesh.ply"
Material "diffuse" "spectrum reflectance" "paint.spd"
Shape "sphere" "float radius" 0.3
Texture "t" "spectrum" "imagemap" "string filename" "picture.png"
Material "diffuse" "texture reflectance" "t"
Shape "sphere" "float radius" 3
)";

std::string changed(std::string text, int (*change)(int)) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [change](unsigned char c) { return static_cast<char>(change(c)); });
    return text;
}
std::string lowered(const std::string& text) {
    return changed(text, [](int c) { return std::tolower(c); });
}

// Returns names such as "lamp.EXR" and "packed.PBRT.GZ"; words that are not file names stay unchanged.
std::string in_capitals(const std::string& name) {
    static const std::set<std::string> kEnds{".pbrt", ".gz",  ".exr",  ".png",  ".ply",     ".spd",
                                             ".ies",  ".ldt", ".gltf", ".toml", ".tm25ray", ".dat",
                                             ".ray",  ".svg", ".tif",  ".json", ".html",    ".obj"};
    fs::path path = name;
    if (!kEnds.contains(path.extension().string())) return name;
    const std::string end = changed(path.extension().string(), [](int c) { return std::toupper(c); });
    path.replace_extension();
    return in_capitals(path.string()) + end;
}

// Returns the text of a file with the quoted file names in upper case.
std::string naming_in_capitals(const std::string& text) {
    std::string all;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find_first_of("\"'", at), text.size());
        all += in_capitals(text.substr(at, end - at));
        if (end < text.size()) all += text[end];
        at = end + 1;
    }
    return all;
}

class Suffixes : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        folders_ = new Folders;
        const TemporaryFolder &small = folders_->small, &large = folders_->large;
        const GoodFiles good(small.path());
        good.write_parts();
        good.write("scene.pbrt", kScene);
        good.write("triangle.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        good.write("part.pbrt", "LightSource \"point\"\n");
        good.write("packed.pbrt", "LightSource \"point\" \"point3 from\" [ 0 1 0 ]\n");
        ASSERT_EQ(std::system(("gzip " + (small / "packed.pbrt").string()).c_str()), 0);
        fs::copy(fs::path(LUCERNA_SOURCE_DIR) / "tests/fuzz/corpus/ldt/symmetry-0.ldt", small / "lamp.ldt");
        write_png(small / "picture.png", GoodFiles::picture(), {});
        good.make_lamp("lamp.ies");
        for (const char* rays : {"lamp.tm25ray", "lamp.dat", "lamp.ray"}) good.make_rays(rays);
        good.write("study.toml",
                   "seeds = 1\n[[scene]]\nfile = \"scene.pbrt\"\n[reference]\nintegrator = \"path\"\n"
                   "spp = [2]\n[[method]]\nname = \"a\"\nintegrator = \"direct\"\nspp = [1]\n");
        for (const char* folder : {"", "shots"}) {
            fs::create_directories(large / folder);
            for (const auto& entry : fs::directory_iterator(small / folder)) {
                if (!entry.is_regular_file()) continue;
                const std::string name = in_capitals(entry.path().filename().string());
                fs::copy(entry.path(), large / folder / name);
                if (!entry.path().string().ends_with(".pbrt") && entry.path().extension() != ".toml")
                    continue;
                std::ofstream(large / folder / name) << naming_in_capitals(read_text(entry.path()));
            }
        }
    }

    static void TearDownTestSuite() {
        delete folders_;
        folders_ = nullptr;
    }

    // Returns the files that the command made, by their lower-case names.
    static std::map<std::string, fs::path> made_by(const std::vector<std::string>& words,
                                                   const fs::path& folder, std::string& out) {
        std::set<fs::path> before;
        for (const auto& entry : fs::recursive_directory_iterator(folder)) before.insert(entry.path());
        const Finished finished = run_command(words, {folder});
        EXPECT_EQ(finished.code, 0) << ::testing::PrintToString(words) << finished.err;
        out = finished.out;
        std::map<std::string, fs::path> made;
        for (const auto& entry : fs::recursive_directory_iterator(folder)) {
            if (entry.is_regular_file() && !before.contains(entry.path()))
                made[lowered(fs::relative(entry.path(), folder).string())] = entry.path();
        }
        return made;
    }

    // Compares images by their pixels, because their headers name the scene and the time.
    static void expect_same(const fs::path& a, const fs::path& b) {
        if (suffix_of(a) == ".exr") {
            const Image one = read_exr(a), other = read_exr(b);
            EXPECT_TRUE(one.width == other.width && one.data == other.data) << a;
            return;
        }
        const std::string one = read_text(a), other = read_text(b);
        EXPECT_TRUE(one == other || lowered(one) == lowered(other)) << a;
    }

    void expect_alike(const std::vector<std::string>& words, std::size_t files, bool says_same = false) {
        SCOPED_TRACE(::testing::PrintToString(words));
        std::vector<std::string> capitals = words;
        for (std::string& word : capitals) word = in_capitals(word);
        ASSERT_NE(words, capitals);
        std::string out, out_of_capitals;
        const auto made = made_by(words, folders_->small.path(), out);
        const auto made_of_capitals = made_by(capitals, folders_->large.path(), out_of_capitals);
        EXPECT_EQ(made.size(), files);
        ASSERT_EQ(made.size(), made_of_capitals.size());
        for (const auto& [name, file] : made) {
            ASSERT_TRUE(made_of_capitals.contains(name)) << name;
            if (name.ends_with(".cells")) continue;  // begins with the hash of its light field
            expect_same(file, made_of_capitals.at(name));
        }
        if (says_same) {
            EXPECT_EQ(lowered(out), lowered(out_of_capitals));
            EXPECT_NE(out, "");
        }
    }

    // One folder has lower-case suffixes, the other upper-case ones.
    struct Folders {
        TemporaryFolder small, large;
    };
    static Folders* folders_;
};
Suffixes::Folders* Suffixes::folders_ = nullptr;

TEST_F(Suffixes, InCapitals_ARenderIsTheSame) {
    expect_alike({"render", "scene.pbrt", "-o", "made.exr", "--png", "--spp", "4"}, 2);
    // A study names its renders by a hash that includes file names.
    const Finished study =
        run_command({"study", "study.TOML", "-o", "out", "--quiet"}, {folders_->large.path()});
    EXPECT_EQ(study.code, 0) << study.err;
    expect_alike({"compare", "made.exr", "picture.exr", "--signed", "signed.exr", "--flip", "flip.png"}, 2,
                 true);
}

TEST_F(Suffixes, InCapitals_InfoIsTheSame) {
    for (const char* file :
         {"scene.pbrt", "picture.exr", "lamp.ies", "lamp.ldt", "lamp.tm25ray", "lamp.dat", "lamp.ray"})
        expect_alike({"info", file}, 0, true);
    for (const char* file : {"lamp.exr", "lamp.tm25ray"}) expect_alike({"light", "info", file}, 0, true);
}

TEST_F(Suffixes, InCapitals_LampsAndModelsAreTheSame) {
    expect_alike({"light", "acquire", "rig.toml", "-o", "again.exr", "--quiet"}, 2);
    expect_alike({"light", "assemble", "shots/manifest.toml", "-o", "back.exr", "--quiet"}, 2);
    for (const char* rays : {"lamp.tm25ray", "lamp.dat", "lamp.ray"}) {
        const std::string name = fs::path(rays).extension().string().substr(1);
        expect_alike(
            {"light", "import", rays, "-o", name + ".exr", "--views", "5x5", "--pixels", "4x4", "--quiet"},
            2);
        expect_alike({"light", "emit", "lamp.exr", "--rays", "10", "-o", "few." + name, "--quiet"}, 1);
    }
    expect_alike({"light", "project", "lamp.exr", "--distance", "1m", "--pixels", "4x4", "-o", "wall.exr",
                  "--png", "--quiet"},
                 2);
    expect_alike({"light", "view", "lamp.exr", "-o", "view.png"}, 1);
    expect_alike({"light", "farfield", "lamp.exr", "-o", "far.svg", "--quiet"}, 1);
    expect_alike({"light", "farfield", "lamp.exr", "--efficacy", "100", "-o", "far.ies", "--quiet"}, 1);
    expect_alike({"light", "farfield", "lamp.ldt", "-o", "ldt.svg", "--quiet"}, 1);
    expect_alike({"import", "model.gltf", "-o", "model.pbrt", "--quiet"}, 2);
    expect_alike({"import", "triangle.obj", "-o", "triangle.pbrt", "--quiet"}, 2);
}

}  // namespace suffixes_test
}  // namespace lucerna
