// Directs every output of every command at every file that the command reads and at every other output, by
// its own name, by another spelling and through a link: each is refused in one line before any work, and no
// file is lost. The files that a command reads are observed, not listed here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "engine/image/image.h"
#include "engine/system/files.h"
#include "tests/cli/run_support.h"
#include "tests/process/command.h"
#include "tests/process/good_files.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace outputs_test {

using namespace testing;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::StartsWith;
namespace fs = std::filesystem;

// An option that names a file to be written, or a file whose name follows from it.
struct Output {
    std::string option, file;
    std::string derived_from = {};  // the option whose file determines the name; empty: it is named itself
    // Returns the option's file name for which `wanted` is written beside it.
    std::string (*named_for)(const std::string& wanted) = nullptr;
};

struct Command {
    std::string name;
    std::vector<std::string> words;
    std::vector<Output> outputs;
    std::vector<std::string> inputs;  // files that it must at least be seen to read
};

std::string with_suffix(const std::string& file, const std::string& suffix) {
    return fs::path(file).replace_extension(suffix);
}
std::string exr_of(const std::string& file) {
    return with_suffix(file, ".exr");
}

std::vector<Command> commands() {
    const Output image{"-o", "made.exr"}, png{"--png", "made.png", "-o", exr_of};
    const Output cells{"", "made.cells", "-o", exr_of};
    return {
        {"render",
         {"render", "scene.pbrt", "--png", "--integrator", "photonmap", "--set", "photons=100"},
         {image,
          png,
          {"--stats", "made.json"},
          {"--checkpoint", "made.checkpoint"},
          {"--save-maps", "made.photons"}},
         {"scene.pbrt", "part.pbrt", "mesh.ply", "picture.exr", "paint.spd", "lamp.exr", "lamp.cells",
          "far.ies"}},
        {"render_on",
         {"render", "scene.pbrt", "--integrator", "photonmap", "--set", "photons=100", "--load-maps",
          "kept.photons", "--resume", "kept.checkpoint"},
         {image, {"--stats", "made.json"}, {"--checkpoint", "made.checkpoint"}},
         {"scene.pbrt", "kept.photons", "kept.checkpoint"}},
        {"compare",
         {"compare", "picture.exr", "reference.exr"},
         {{"--json", "made.json"},
          {"--html", "made.html"},
          {"--signed", "made.exr"},
          {"--flip", "other.exr"}},
         {"picture.exr", "reference.exr"}},
        {"import_rays",
         {"light", "import", "lamp.tm25ray", "--views", "5x5", "--pixels", "4x4"},
         {image, cells},
         {"lamp.tm25ray"}},
        {"acquire", {"light", "acquire", "rig.toml"}, {image, cells}, {"rig.toml"}},
        {"acquire_scene",
         {"light", "acquire", "luminaire.toml"},
         {image, cells},
         {"luminaire.toml", "bulb.pbrt", "part.pbrt"}},
        {"assemble",
         {"light", "assemble", "manifest.toml"},
         {image, cells},
         {"manifest.toml", "view_000_000_positive_0.png"}},
        {"emit",
         {"light", "emit", "lamp.exr", "--rays", "10"},
         {{"-o", "made.dat"}},
         {"lamp.exr", "lamp.cells"}},
        {"project",
         {"light", "project", "lamp.exr", "--distance", "1m", "--pixels", "4x4", "--png"},
         {image, png},
         {"lamp.exr"}},
        {"view", {"light", "view", "lamp.exr"}, {{"-o", "made.png"}}, {"lamp.exr"}},
        {"farfield", {"light", "farfield", "far.ies"}, {{"-o", "made.svg"}, {"-o", "made.ies"}}, {"far.ies"}},
        {"import_model",
         {"import", "model.gltf", "--overwrite"},
         {{"-o", "made.pbrt"}},
         {"model.gltf", "model.bin"}},
        {"import_obj",
         {"import", "room.obj", "--overwrite"},
         {{"-o", "made.pbrt"}},
         {"room.obj", "room.mtl"}},
    };
}

constexpr const char* kScene = R"(
Camera "perspective" Film "rgb" "integer xresolution" 4 "integer yresolution" 4
Sampler "independent" "integer pixelsamples" 1
WorldBegin
Include "part.pbrt"
LightSource "lightfield" "string filename" "lamp.exr"
LightSource "ies" "string filename" "far.ies"
Shape "plymesh" "string filename" "mesh.ply"
Material "diffuse" "spectrum reflectance" "paint.spd"
Shape "sphere" "float radius" 3
Texture "t" "spectrum" "imagemap" "string filename" "picture.exr"
Material "diffuse" "texture reflectance" "t"
Shape "sphere" "float radius" 2
)";

// Removes the warnings that reading prints before the refusal.
std::string without_warnings(const std::string& err) {
    std::istringstream lines(err);
    std::string rest;
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("lucerna: warning: ")) rest += line + "\n";
    }
    return rest;
}

using Contents = std::map<std::string, std::string>;

// Returns the contents of all files in a folder, and the targets of its links.
Contents contents(const fs::path& folder) {
    Contents all;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename();
        if (entry.is_symlink()) {
            all[name] = "-> " + fs::read_symlink(entry.path()).string();
        } else if (entry.is_regular_file()) {
            std::ifstream in(entry.path(), std::ios::binary);
            all[name] = {std::istreambuf_iterator<char>(in), {}};
        }
    }
    return all;
}

class EveryOutput : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        good_ = new TemporaryFolder;
        const GoodFiles good(good_->path());
        good.write_parts();
        good.write("scene.pbrt", kScene);
        good.write("part.pbrt", "LightSource \"point\"\n");
        good.write("bulb.pbrt", "WorldBegin\nTranslate 0 0 -0.02\nInclude \"part.pbrt\"\n");
        good.write("luminaire.toml",
                   std::string(kPlanes) + "kind = 'scene'\nfile = 'bulb.pbrt'\nunit = 'W'\nrays = 1000\n");
        good.make_lamp("far.ies");
        for (const auto& entry : fs::directory_iterator(*good_ / "shots"))
            fs::rename(entry.path(), *good_ / entry.path().filename().string());
        good.make_rays("lamp.tm25ray");
        good.make({"render", "scene.pbrt", "-o", "first.exr", "--integrator", "photonmap", "--set",
                   "photons=100", "--save-maps", "kept.photons", "--checkpoint", "kept.checkpoint"});
    }
    static void TearDownTestSuite() {
        delete good_;
        good_ = nullptr;
    }
    void begin_anew() {
        folder_ = std::make_unique<TemporaryFolder>();
        fs::copy(good_->path(), folder_->path());  // without folders
    }

    static std::vector<std::string> words_of(const Command& command,
                                             const std::map<std::string, std::string>& names) {
        std::vector<std::string> words = command.words;
        for (const Output& output : command.outputs) {
            if (!output.derived_from.empty()) continue;
            const auto given = names.find(output.file);
            words.push_back(output.option);
            words.push_back(given == names.end() ? output.file : given->second);
        }
        return words;
    }

    // Returns the names of the files in the folder that the command opened and that existed before.
    std::vector<std::string> read_by(const Command& command) {
        begin_anew();
        const Contents before = contents(folder_->path());
        const int events = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
        if (inotify_add_watch(events, folder_->path().c_str(), IN_OPEN) < 0)
            throw std::runtime_error("no watch");
        const Finished finished = run_command(words_of(command, {}), {folder_->path()});
        EXPECT_EQ(finished.code, 0) << command.name << ": " << finished.err;
        std::set<std::string> names;
        alignas(inotify_event) std::array<char, 65536> buffer{};
        for (ssize_t got = 0; (got = read(events, buffer.data(), buffer.size())) > 0;) {
            for (ssize_t at = 0; at < got;) {
                const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
                if (event->len > 0 && before.contains(event->name)) names.insert(event->name);
                at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
            }
        }
        close(events);
        return {names.begin(), names.end()};
    }

    void expect_refused(const Command& command, const std::map<std::string, std::string>& names) {
        const Contents before = contents(folder_->path());
        const std::vector<std::string> words = words_of(command, names);
        const fs::path here = fs::current_path();
        fs::current_path(folder_->path());
        // Calls the command as a function, because a thousand processes would spend minutes in the dynamic
        // linker.
        const Outcome outcome = lucerna_run(words);
        fs::current_path(here);
        SCOPED_TRACE(command.name + ::testing::PrintToString(words) + outcome.out + outcome.err);
        EXPECT_EQ(outcome.code, 1);
        const std::string error = without_warnings(outcome.err);
        EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1);
        EXPECT_THAT(error, AllOf(StartsWith("lucerna: "), HasSubstr("choose another file for")));
        EXPECT_TRUE(before == contents(folder_->path())) << "something was lost or made";
    }

    static TemporaryFolder* good_;
    std::unique_ptr<TemporaryFolder> folder_;
};
TemporaryFolder* EveryOutput::good_ = nullptr;

// The option that is given, the file name that it is given, and the file that is written.
struct Aim {
    std::string given_for, name, written;
};

// Returns the ways in which an output is written to `target`: directly, or through a link of the right
// suffix.
std::vector<Aim> aims_at(const fs::path& folder, const Output& output, const std::string& target) {
    const std::string suffix = fs::path(output.file).extension();
    const bool any = suffix == ".json" || suffix == ".checkpoint";  // names may have any suffix
    std::vector<Aim> aims;
    const auto named = [&](const std::string& written) {
        return output.derived_from.empty() ? written : output.named_for(written);
    };
    const std::string given_for = output.derived_from.empty() ? output.file : "made.exr";
    if (any || fs::path(target).extension() == suffix) {
        aims.push_back({given_for, named(target), target});
        aims.push_back({given_for, named("./" + target), target});
    }
    const std::string link = "link" + suffix, hard = "hard" + suffix;
    fs::remove(folder / link);
    fs::create_symlink(target, folder / link);
    aims.push_back({given_for, named(link), target});
    if (fs::exists(folder / target)) {
        fs::remove(folder / hard);
        fs::create_hard_link(folder / target, folder / hard);
        aims.push_back({given_for, named(hard), target});
    }
    return aims;
}

TEST_F(EveryOutput, OnAFileThatIsRead_IsRefusedAndNothingIsLost) {
    for (const Command& command : commands()) {
        const std::vector<std::string> inputs = read_by(command);
        EXPECT_THAT(inputs, IsSupersetOf(command.inputs)) << command.name;
        begin_anew();
        // Two of hundreds of photographs suffice.
        int photographs = 0;
        for (const std::string& input : inputs) {
            if (input.starts_with("view_") && ++photographs > 2) continue;
            for (const Output& output : command.outputs) {
                // A checkpoint may be updated in place: both options may name the same file.
                if (output.option == "--checkpoint" && input == "kept.checkpoint") continue;
                for (const Aim& aim : aims_at(folder_->path(), output, input))
                    expect_refused(command, {{aim.given_for, aim.name}});
            }
        }
    }
}

TEST_F(EveryOutput, OnAnotherOutput_IsRefusedAndNothingIsMade) {
    for (const Command& command : commands()) {
        begin_anew();
        for (const Output& one : command.outputs) {
            for (const Output& other : command.outputs) {
                if (&one == &other || !other.derived_from.empty()) continue;
                for (const Aim& aim : aims_at(folder_->path(), one, other.file)) {
                    if (aim.given_for == other.file) continue;  // it cannot be in two places
                    expect_refused(command, {{aim.given_for, aim.name}});
                }
            }
        }
    }
}

// Devices hold nothing that could be lost, so two streams, or one stream twice, are accepted.
TEST_F(EveryOutput, Devices_MayBeGivenToAny) {
    begin_anew();
    const Finished finished = run_command(
        {"compare", "picture.exr", "reference.exr", "--json", "/dev/null", "--signed", "made.exr"},
        {folder_->path()});
    EXPECT_EQ(finished.code, 0) << finished.err;
    const Finished render = run_command(
        {"render", "scene.pbrt", "-o", "made.exr", "--stats", "/dev/null", "--checkpoint", "/dev/null"},
        {folder_->path()});
    EXPECT_EQ(render.code, 0) << render.err;
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

// A file of the user's own stands where the cell table would be stored.
TEST_F(EveryOutput, CellTable_NeverReplacesWhatIsNone) {
    begin_anew();
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"render", "scene.pbrt", "-o", "made.exr"},
          {"light", "emit", "lamp.exr", "--rays", "10", "-o", "made.dat"},
          {"light", "acquire", "rig.toml", "-o", "lamp.exr"}}) {
        std::ofstream(*folder_ / "lamp.cells") << "notes about the lamp";
        const Finished finished = run_command(words, {folder_->path()});
        EXPECT_EQ(finished.code, 0) << finished.err;
        EXPECT_THAT(finished.err, HasSubstr("lamp.cells: is not a cell table; it is left as it is"));
        EXPECT_EQ(read_text(*folder_ / "lamp.cells"), "notes about the lamp");
    }
    // A damaged or an outdated cell table is replaced.
    fs::remove(*folder_ / "lamp.cells");
    std::ofstream(*folder_ / "lamp.cells") << "LUCCELLS of long ago";
    EXPECT_EQ(
        run_command({"light", "emit", "lamp.exr", "--rays", "10", "-o", "made.dat"}, {folder_->path()}).code,
        0);
    EXPECT_GT(fs::file_size(*folder_ / "lamp.cells"), 1000U);
}

// Tests files that a command names itself.
TEST_F(EveryOutput, PhotographsAndParts_NeverReplaceWhatIsRead) {
    begin_anew();
    fs::create_directory(*folder_ / "made-parts");
    for (const char* name : {"model.bin", "model.gltf"}) fs::copy(*folder_ / name, *folder_ / "made-parts");
    fs::rename(*folder_ / "made-parts" / "model.gltf", *folder_ / "made-parts" / "mesh-0.ply");
    fs::create_symlink("made-parts/mesh-0.ply", *folder_ / "linked.gltf");
    fs::copy(*folder_ / "rig.toml", *folder_ / "shots.toml", fs::copy_options::overwrite_existing);
    fs::create_directory(*folder_ / "shots");
    fs::rename(*folder_ / "rig.toml", *folder_ / "shots" / "manifest.toml");
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"import", "linked.gltf", "-o", "made.pbrt", "--overwrite"},
          {"light", "acquire", "shots/manifest.toml", "-o", "made.exr", "--photographs", "shots"},
          {"light", "acquire", "shots.toml", "-o", "shots/view_x.exr", "--photographs", "./shots"}}) {
        const Contents before = contents(folder_->path()), parts = contents(*folder_ / "made-parts"),
                       shots = contents(*folder_ / "shots");
        const Finished finished = run_command(words, {folder_->path()});
        EXPECT_EQ(finished.code, 1) << finished.out << finished.err;
        EXPECT_THAT(finished.err, HasSubstr("writes files of such names into"));
        EXPECT_TRUE(before == contents(folder_->path()) && parts == contents(*folder_ / "made-parts") &&
                    shots == contents(*folder_ / "shots"))
            << finished.err;
    }
}

}  // namespace outputs_test
}  // namespace lucerna
