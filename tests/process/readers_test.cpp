// Replaces every file that a command reads by a pipe, a device, a folder, a dangling link, an empty file or
// the first half of the right file: the command names it in one line, soon, and never waits silently.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "engine/colour/tone.h"
#include "engine/image/image.h"
#include "tests/process/command.h"
#include "tests/process/good_files.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace readers_test {

using namespace testing;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

// Both limits are in seconds.
constexpr double kPatience = kSanitized ? 120 : 30;
constexpr double kMostWork = kSanitized ? 40 : 2;

// Returns the scene around a directive inside its world.
std::string scene(const std::string& world) {
    return "Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n"
           "Sampler \"independent\" \"integer pixelsamples\" 1\nIntegrator \"direct\"\nWorldBegin\n"
           "LightSource \"point\" \"rgb I\" [ 1 1 1 ]\nShape \"sphere\" \"float radius\" 3\n" +
           world + "\n";
}

struct Reader {
    std::string name, file;
    std::vector<std::string> words;
    std::string world = {};     // of the scene NAME.pbrt, if a scene reads the file
    bool needed = true;         // false: the command works without it, with a warning
    bool half_is_fine = false;  // text of which a half is valid too
    bool nothing_is_fine =
        false;  // included scene text that is empty adds nothing, as in pbrt, and that is said
};

Reader in_scene(const std::string& name, const std::string& file, const std::string& world) {
    return {name, file, {"render", name + ".pbrt", "-o", "image.exr", "--quiet"}, world};
}

std::vector<Reader> readers() {
    const auto text = [](Reader reader) {
        reader.half_is_fine = true;
        return reader;
    };
    const auto included = [](const std::string& name, const std::string& file, const std::string& world) {
        Reader reader = in_scene(name, file, world);
        reader.nothing_is_fine = true;
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
        text(included("include", "part.pbrt", "Include \"part.pbrt\"")),
        text(included("imported", "part.pbrt", "Import \"part.pbrt\"")),
        included("packed", "part.pbrt.gz", "Include \"part.pbrt.gz\""),
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
        text({"obj", "room.obj", {"import", "room.obj", "-o", "made.pbrt"}}),
        text({"obj_materials", "room.mtl", {"import", "room.obj", "-o", "made.pbrt"}}),
        text({"study", "study.toml", {"study", "study.toml", "-o", "out"}}),
        text({"study_scene", "whole.pbrt", {"study", "study.toml", "-o", "out"}}),
    };
    Reader cells =
        in_scene("cells", "lamp.cells", "LightSource \"lightfield\" \"string filename\" \"lamp.exr\"");
    cells.needed = false;
    cells.half_is_fine = true;  // the command's own, and rebuilt
    all.push_back(cells);
    return all;
}

// All valid files, made once by the command itself.
class EveryReader : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        good_ = new TemporaryFolder;
        const GoodFiles good(good_->path());
        good.write_parts();
        good.write("whole.pbrt", scene(""));
        good.write("part.pbrt", "Material \"diffuse\"\nShape \"sphere\"\nShape \"disk\"\n");
        good.write(
            "study.toml",
            "seeds = 1\n[[scene]]\nfile = \"whole.pbrt\"\n[reference]\nintegrator = \"path\"\nspp = [1]\n"
            "[[method]]\nname = \"a\"\nintegrator = \"direct\"\nspp = [1]\n");
        for (const Reader& reader : readers()) {
            if (!reader.world.empty()) good.write(reader.name + ".pbrt", scene(reader.world));
        }
        write_png(*good_ / "picture.png", GoodFiles::picture(), {});
        good.make_lamp("lamp.ies");
        for (const char* rays : {"lamp.tm25ray", "lamp.dat", "lamp.ray"}) good.make_rays(rays);
        good.make({"render", "whole.pbrt", "-o", "image.exr", "--checkpoint", "kept.checkpoint"});
        good.make({"render", "whole.pbrt", "-o", "image.exr", "--integrator", "photonmap", "--set",
                   "photons=100", "--save-maps", "kept.photons"});
        // The file belongs to another description: magic, key, and a column.
        good.write("made.exr.part", std::string("UCLPART1") + std::string(200, '\1'));
        ASSERT_EQ(std::system(("gzip -k " + (*good_ / "part.pbrt").string()).c_str()), 0);
    }
    static void TearDownTestSuite() {
        delete good_;
        good_ = nullptr;
    }
    // Whether the command may succeed nevertheless.
    enum class Success : std::uint8_t { never, with_warning, silent };

    // Tests one reader in its own folder.
    class Trial {
      public:
        explicit Trial(const Reader& reader) : reader_(reader) {
            fs::copy(good_->path(), folder_.path(), fs::copy_options::recursive);
            if (reader.name != "unfinished") fs::remove(folder_ / "made.exr.part");
        }
        fs::path file() const { return folder_ / reader_.file; }
        bool made_something(const std::string& name) const { return fs::exists(folder_ / name); }
        Finished run() const { return run_command(reader_.words, {folder_.path(), kPatience}); }
        void expect_refused_soon(Success accepted = Success::never) const {
            const Finished finished = run();
            SCOPED_TRACE(
                fmt::format("reader {} of {}: exit code {}, signal {}, {:.2f} s of the clock (at most {} s), "
                            "{:.2f} s of the "
                            "processor (at most {} s); it said: {}{}",
                            reader_.name, reader_.file, finished.code, finished.signal, finished.seconds,
                            kPatience, finished.cpu_seconds, kMostWork, finished.out, finished.err));
            ASSERT_FALSE(finished.waited) << "it waits";
            // Counts this process's time only: concurrent processes may delay it.
            EXPECT_LT(finished.cpu_seconds, kMostWork);
            EXPECT_EQ(finished.signal, 0);
            if (!reader_.needed) accepted = std::max(accepted, Success::with_warning);
            if (finished.code != 0 || accepted == Success::never) {
                EXPECT_EQ(finished.code, 1);
                EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1);
            }
            if (accepted != Success::silent) {
                EXPECT_THAT(finished.err, HasSubstr(fs::path(reader_.file).filename().string()));
            }
            for (const char c : finished.err)
                EXPECT_TRUE(std::iscntrl(static_cast<unsigned char>(c)) == 0 || c == '\n');
        }

      private:
        const Reader& reader_;
        TemporaryFolder folder_;
    };

    static TemporaryFolder* good_;
};
TemporaryFolder* EveryReader::good_ = nullptr;

TEST_F(EveryReader, TheRightFile_IsRead) {
    for (const Reader& reader : readers()) {
        if (reader.name == "unfinished") continue;  // belongs to other work
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
        // A checkpoint that is updated may be new, and is then created at the link's target.
        if (reader.name == "checkpoint") continue;
        trial.expect_refused_soon();
        EXPECT_TRUE(fs::is_symlink(trial.file())) << reader.name;
        EXPECT_FALSE(trial.made_something("nothing")) << reader.name;
    }
}

TEST_F(EveryReader, AnEmptyFile_IsRefusedOrSaidToBeEmpty) {
    for (const Reader& reader : readers()) {
        if (reader.name == "unfinished") continue;  // begun without results
        const Trial trial(reader);
        fs::resize_file(trial.file(), 0);
        trial.expect_refused_soon(reader.nothing_is_fine ? Success::with_warning : Success::never);
    }
}

TEST_F(EveryReader, HalfAFile_IsRefusedOrReadAsWhatItIs) {
    for (const Reader& reader : readers()) {
        const Trial trial(reader);
        fs::resize_file(trial.file(), fs::file_size(trial.file()) / 2);
        trial.expect_refused_soon(reader.half_is_fine ? Success::silent : Success::never);
    }
}

}  // namespace readers_test
}  // namespace lucerna
