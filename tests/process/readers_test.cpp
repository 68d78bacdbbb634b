// Every file that a command reads, in the place of which stands a pipe, a device, a folder, a link to
// nothing, an empty file or the first half of the right one: one line that names it, soon, and never a silent
// wait.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "engine/base/files.h"
#include "engine/base/image.h"
#include "tests/process/command.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace readers_test {

using namespace testing;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr double kDeadline = 2;  // seconds

// What is needed around a scene's directive, or inside its world.
std::string scene(const std::string& world) {
    return "Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n"
           "Sampler \"independent\" \"integer pixelsamples\" 1\nIntegrator \"direct\"\nWorldBegin\n"
           "LightSource \"point\" \"rgb I\" [ 1 1 1 ]\nShape \"sphere\" \"float radius\" 3\n" +
           world + "\n";
}

struct Reader {
    std::string name, file;
    std::vector<std::string> words;
    std::string world = {};     // of scene NAME.pbrt, if it is read by one
    bool needed = true;         // false: the command does without, and says so
    bool half_is_fine = false;  // text of which a half has a meaning, too
};

Reader in_scene(const std::string& name, const std::string& file, const std::string& world) {
    return {name, file, {"render", name + ".pbrt", "-o", "image.exr", "--quiet"}, world};
}

std::vector<Reader> readers() {
    const auto text = [](Reader reader) {
        reader.half_is_fine = true;
        return reader;
    };
    const std::string on = "Material \"diffuse\" \"texture reflectance\" \"t\"";
    const auto texture = [&](const std::string& name, const std::string& file) {
        return in_scene(
            name, file,
            "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"" + file + "\"\n" + on);
    };
    std::vector<Reader> all{
        text({"scene", "whole.pbrt", {"render", "whole.pbrt", "-o", "image.exr"}}),
        text({"info_scene", "whole.pbrt", {"info", "whole.pbrt"}}),
        text(in_scene("include", "part.pbrt", "Include \"part.pbrt\"")),
        text(in_scene("imported", "part.pbrt", "Import \"part.pbrt\"")),
        in_scene("packed", "part.pbrt.gz", "Include \"part.pbrt.gz\""),
        in_scene("mesh", "mesh.ply", "Shape \"plymesh\" \"string filename\" \"mesh.ply\""),
        texture("texture_exr", "picture.exr"),
        texture("texture_png", "picture.png"),
        in_scene("normal_map", "picture.png", "Material \"diffuse\" \"string normalmap\" \"picture.png\""),
        in_scene("sky", "picture.exr", "LightSource \"infinite\" \"string filename\" \"picture.exr\""),
        in_scene("goniometric", "picture.exr",
                 "LightSource \"goniometric\" \"string filename\" \"picture.exr\" \"rgb I\" [ 1 1 1 ]"),
        in_scene("slide", "picture.exr", "LightSource \"projection\" \"string filename\" \"picture.exr\""),
        text(
            in_scene("spectrum", "paint.spd", "Material \"diffuse\" \"spectrum reflectance\" \"paint.spd\"")),
        text(in_scene("ies", "lamp.ies", "LightSource \"ies\" \"string filename\" \"lamp.ies\"")),
        in_scene("lamp", "lamp.exr", "LightSource \"lightfield\" \"string filename\" \"lamp.exr\""),
        in_scene("rays", "lamp.tm25ray", "LightSource \"rayfile\" \"string filename\" \"lamp.tm25ray\""),
        {"checkpoint",
         "kept.checkpoint",
         {"render", "whole.pbrt", "-o", "image.exr", "--resume", "kept.checkpoint"}},
        {"maps",
         "kept.photons",
         {"render", "whole.pbrt", "-o", "image.exr", "--integrator", "photonmap", "--set", "photons=100",
          "--load-maps", "kept.photons"}},
        {"compare", "picture.exr", {"compare", "picture.exr", "reference.exr"}},
        {"reference", "reference.exr", {"compare", "picture.exr", "reference.exr"}},
        {"info_image", "picture.exr", {"info", "picture.exr"}},
        {"info_lamp", "lamp.exr", {"light", "info", "lamp.exr"}},
        {"import_tm25",
         "lamp.tm25ray",
         {"light", "import", "lamp.tm25ray", "-o", "made.exr", "--views", "5x5", "--pixels", "4x4"}},
        {"import_zemax",
         "lamp.dat",
         {"light", "import", "lamp.dat", "-o", "made.exr", "--views", "5x5", "--pixels", "4x4"}},
        {"import_lighttools",
         "lamp.ray",
         {"light", "import", "lamp.ray", "-o", "made.exr", "--views", "5x5", "--pixels", "4x4"}},
        {"emit", "lamp.exr", {"light", "emit", "lamp.exr", "--rays", "10", "-o", "made.dat"}},
        {"project",
         "lamp.exr",
         {"light", "project", "lamp.exr", "--distance", "1m", "--pixels", "4x4", "-o", "made.exr"}},
        {"view", "lamp.exr", {"light", "view", "lamp.exr", "-o", "made.png"}},
        {"farfield", "lamp.exr", {"light", "farfield", "lamp.exr", "-o", "made.svg"}},
        text({"farfield_ies", "lamp.ies", {"light", "farfield", "lamp.ies", "-o", "made.svg"}}),
        text({"rig", "rig.toml", {"light", "acquire", "rig.toml", "-o", "made.exr"}}),
        {"unfinished", "made.exr.part", {"light", "acquire", "rig.toml", "-o", "made.exr"}},
        {"manifest", "shots/manifest.toml", {"light", "assemble", "shots/manifest.toml", "-o", "made.exr"}},
        {"photograph",
         "shots/view_000_000_positive_0.png",
         {"light", "assemble", "shots/manifest.toml", "-o", "made.exr"}},
        {"gltf", "model.gltf", {"import", "model.gltf", "-o", "made.pbrt"}},
        {"gltf_buffer", "model.bin", {"import", "model.gltf", "-o", "made.pbrt"}},
        text({"study", "study.toml", {"study", "study.toml", "-o", "out"}}),
        text({"study_scene", "whole.pbrt", {"study", "study.toml", "-o", "out"}}),
    };
    Reader cells =
        in_scene("cells", "lamp.cells", "LightSource \"lightfield\" \"string filename\" \"lamp.exr\"");
    cells.needed = false;
    cells.half_is_fine = true;  // ours, and made anew
    all.push_back(cells);
    return all;
}

constexpr const char* kRig =
    "[rig]\nsetup = 'A'\nviews = 6\nspacing = '4mm'\npixels = [12, 10]\npixel = '2mm'\ndistance = '40mm'\n"
    "[emitter]\nkind = 'disc'\nradius = '6mm'\nexponent = 20\nflux = 7\nunit = 'W'\nsetback = '2mm'\n";

// Two triangles.
constexpr const char* kMesh =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 1\n1 0 1\n1 1 1\n0 1 1\n3 0 1 2\n3 0 2 3\n";

constexpr const char* kModel = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
"bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "model.bin", "byteLength": 36}]})";

// All good files, made once by the command itself.
class EveryReader : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        good_ = new TemporaryFolder;
        const auto write = [](const std::string& name, const std::string& text) {
            std::ofstream(*good_ / name, std::ios::binary) << text;
        };
        write("whole.pbrt", scene(""));
        write("part.pbrt", "Material \"diffuse\"\nShape \"sphere\"\nShape \"disk\"\n");
        write("mesh.ply", kMesh);
        write("paint.spd", "400 0.2\n500 0.4\n700 0.5\n");
        write("rig.toml", kRig);
        write("model.gltf", kModel);
        const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        write("model.bin", std::string(reinterpret_cast<const char*>(corners), sizeof corners));
        write("study.toml",
              "seeds = 1\n[[scene]]\nfile = \"whole.pbrt\"\n[reference]\nintegrator = \"path\"\nspp = [1]\n"
              "[[method]]\nname = \"a\"\nintegrator = \"direct\"\nspp = [1]\n");
        for (const Reader& reader : readers()) {
            if (!reader.world.empty()) write(reader.name + ".pbrt", scene(reader.world));
        }
        Image image = Image::rgb(16, 16);
        for (std::size_t i = 0; i < image.data.size(); ++i)
            image.data[i] = static_cast<float>(i * 7919 % 101) / 101;  // that no packing makes small
        write_exr(*good_ / "picture.exr", image);
        write_exr(*good_ / "reference.exr", image);
        write_png(*good_ / "picture.png", image, 1);
        const auto make = [](const std::vector<std::string>& words) {
            const Finished made = run_command(words, {good_->path()});
            if (made.code != 0) throw std::runtime_error(words[1] + ": " + made.err);
        };
        make({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--photographs", "shots"});
        for (const char* rays : {"lamp.tm25ray", "lamp.dat", "lamp.ray"})
            make({"light", "emit", "lamp.exr", "--rays", "2000", "-o", rays});
        make({"light", "farfield", "lamp.exr", "--step", "15", "--plane-step", "90", "--efficacy", "100",
              "-o", "lamp.ies"});
        make({"render", "whole.pbrt", "-o", "image.exr", "--checkpoint", "kept.checkpoint"});
        make({"render", "whole.pbrt", "-o", "image.exr", "--integrator", "photonmap", "--set", "photons=100",
              "--save-maps", "kept.photons"});
        // Of another description: magic, key, and a column.
        write("made.exr.part", std::string("UCLPART1") + std::string(200, '\1'));
        ASSERT_EQ(std::system(("gzip -k " + (*good_ / "part.pbrt").string()).c_str()), 0);
    }
    static void TearDownTestSuite() {
        delete good_;
        good_ = nullptr;
    }
    // One reader, in a folder of its own.
    class Trial {
      public:
        explicit Trial(const Reader& reader) : reader_(reader) {
            fs::copy(good_->path(), folder_.path(), fs::copy_options::recursive);
            if (reader.name != "unfinished") fs::remove(folder_ / "made.exr.part");
        }
        fs::path file() const { return folder_ / reader_.file; }
        bool made_something(const std::string& name) const { return fs::exists(folder_ / name); }
        Finished run() const {
            return run_command(reader_.words, {folder_.path(), kSanitized ? 120.0 : 30.0});
        }
        void expect_refused_soon(bool may_succeed = false) const {
            const Finished finished = run();
            SCOPED_TRACE(reader_.name + ": " + finished.out + finished.err);
            ASSERT_FALSE(finished.waited) << "it waits";
            // Of this process alone: others that work at the same time may keep it waiting for its turn.
            EXPECT_LT(finished.cpu_seconds, kSanitized ? 20 * kDeadline : kDeadline);
            EXPECT_EQ(finished.signal, 0);
            if (finished.code != 0 || (reader_.needed && !may_succeed)) {
                EXPECT_EQ(finished.code, 1);
                EXPECT_EQ(lines_of_ours(finished.err), 1);
            }
            const std::string name = fs::path(reader_.file).filename().string();
            if (!may_succeed) {
                EXPECT_THAT(finished.err, HasSubstr(name));
            }
            for (const char c : finished.err)
                EXPECT_TRUE(std::iscntrl(static_cast<unsigned char>(c)) == 0 || c == '\n');
        }

      private:
        const Reader& reader_;
        TemporaryFolder folder_;
    };

    // Without what libpng says on its own account.
    static int lines_of_ours(const std::string& err) {
        std::istringstream lines(err);
        int count = 0;
        for (std::string line; std::getline(lines, line);) count += line.starts_with("libpng ") ? 0 : 1;
        return count;
    }

    static TemporaryFolder* good_;
};
TemporaryFolder* EveryReader::good_ = nullptr;

TEST_F(EveryReader, TheRightFile_IsRead) {
    for (const Reader& reader : readers()) {
        if (reader.name == "unfinished") continue;  // is of other work
        const Finished finished = Trial(reader).run();
        EXPECT_EQ(finished.code, 0) << reader.name << ": " << finished.err;
        EXPECT_FALSE(finished.waited) << reader.name;
    }
}

TEST_F(EveryReader, APipe_IsRefusedWithoutWaiting) {
    for (const Reader& reader : readers()) {
        const Trial trial(reader);
        fs::remove(trial.file());
        ASSERT_EQ(mkfifo(trial.file().c_str(), 0600), 0);
        trial.expect_refused_soon();
        EXPECT_TRUE(fs::is_fifo(trial.file())) << reader.name;
    }
}

TEST_F(EveryReader, ADevice_IsRefused) {
    for (const Reader& reader : readers()) {
        const Trial trial(reader);
        fs::remove(trial.file());
        fs::create_symlink("/dev/zero", trial.file());
        trial.expect_refused_soon();
        EXPECT_TRUE(fs::is_symlink(trial.file())) << reader.name;
    }
}

TEST_F(EveryReader, AFolder_IsRefused) {
    for (const Reader& reader : readers()) {
        const Trial trial(reader);
        fs::remove(trial.file());
        fs::create_directory(trial.file());
        trial.expect_refused_soon();
    }
}

TEST_F(EveryReader, ALinkToNothing_IsRefusedAndMakesNothing) {
    for (const Reader& reader : readers()) {
        const Trial trial(reader);
        fs::remove(trial.file());
        fs::create_symlink("nothing", trial.file());
        // What is gone on from and kept up to date may be new, and is then made where the link leads.
        if (reader.name == "checkpoint") continue;
        trial.expect_refused_soon();
        EXPECT_TRUE(fs::is_symlink(trial.file())) << reader.name;
        EXPECT_FALSE(trial.made_something("nothing")) << reader.name;
    }
}

TEST_F(EveryReader, AnEmptyFile_IsRefused) {
    for (const Reader& reader : readers()) {
        if (reader.name == "unfinished") continue;  // begun, and nothing done
        const Trial trial(reader);
        fs::resize_file(trial.file(), 0);
        trial.expect_refused_soon();
    }
}

TEST_F(EveryReader, HalfAFile_IsRefusedOrReadAsWhatItIs) {
    for (const Reader& reader : readers()) {
        const Trial trial(reader);
        fs::resize_file(trial.file(), fs::file_size(trial.file()) / 2);
        trial.expect_refused_soon(reader.half_is_fine);
    }
}

}  // namespace readers_test
}  // namespace lucerna
