// On a full disk, every file that lucerna writes is an error that names the file and the cause, and the old
// file remains. The system's limit on the size of files simulates the disk.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <functional>

#include "engine/cli/command_files.h"
#include "engine/cli/light/sums_file.h"
#include "engine/colour/tone.h"
#include "engine/image/image.h"
#include "engine/image/photograph.h"
#include "engine/model/model.h"
#include "engine/model/write_pbrt.h"
#include "engine/render/checkpoint.h"
#include "engine/system/files.h"
#include "lights/cell_table.h"
#include "lights/measurement/manifest.h"
#include "lights/photometric_files.h"
#include "lights/ray_set.h"
#include "photon/build_maps.h"
#include "tests/cli/run_support.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/cannot_run.h"
#include "tests/support/error_of.h"
#include "tests/support/scenes.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace full_disk_test {

using ::testing::AllOf;
using testing::error_of;
using ::testing::HasSubstr;
using testing::lucerna_run;

// While an instance lives, no file of this process can grow beyond `bytes`.
class FullDisk {
  public:
    explicit FullDisk(rlim_t bytes) {
        getrlimit(RLIMIT_FSIZE, &before_);
        handler_ = std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FullDisk() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

  private:
    rlimit before_{};
    void (*handler_)(int) = SIG_DFL;
};

Image noise_image() {
    Image image(40, 30, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    Sampler sampler(1, Purpose::test, 0, 0);
    for (float& value : image.data) value = sampler.next();  // noise, which no compression makes small
    return image;
}

Photograph noise_photograph(int most) {
    Photograph photograph{{40, 30}, std::vector<float>(1200), most};
    Sampler sampler(2, Purpose::test, 0, 0);
    for (float& count : photograph.counts) count = sampler.next() * static_cast<float>(std::max(most, 1));
    return photograph;
}

PhotonMaps maps() {
    MapParameters parameters;
    parameters.paths = 2000;
    parameters.wanted = {true, true, true};
    Monitor silent;
    return build_photon_maps(testing::small_cornell(), parameters, Workers{1}, silent);
}

RaySet rays() {
    RaySet set;
    for (int i = 0; i < 500; ++i)
        set.rays.push_back({{0, 0, 0.001F * static_cast<float>(i)}, {0, 0, 1}, 1.0F});
    return set;
}

Manifest manifest() {
    return read_manifest(TomlTable::parse(
        "unit = \"W\"\n[rig]\nsetup = \"A\"\nviews = [3, 2]\nspacing = \"1.4mm\"\npixels = [15, 10]\npixel = "
        "\"0.2mm\"\n"
        "distance = \"39mm\"\n[photographs]\nname = \"v_{m}_{n}_{sign}_{exposure}.png\"\nexposures = [0.5, "
        "2]\n"
        "[camera]\nscale = 1e-3\n",
        "folder/manifest.toml"));
}

struct Writer {
    std::string file;
    std::function<void(const std::filesystem::path&)> write;
};

std::vector<Writer> writers() {
    using Path = std::filesystem::path;
    const Image image = noise_image();
    const LightField field = testing::random_field(testing::rig_b(), 0, 1, 7);
    return {
        {"image.exr", [=](const Path& to) { write_exr(to, image); }},
        {"picture.png", [=](const Path& to) { write_png(to, image, {}); }},
        {"display.png", [=](const Path& to) { write_png_display(to, image); }},
        {"stats.json", [](const Path& to) { write_text(to, std::string(30'000, 'x')); }},
        {"short.json", [](const Path& to) { write_text(to, "{}"); }},
        {"a.checkpoint",
         [](const Path& to) {
             Checkpoint checkpoint;
             checkpoint.film.resize(50'000);
             save_checkpoint(to, checkpoint);
         }},
        {"maps.photons",
         [all = std::make_shared<PhotonMaps>(maps())](const Path& to) { save_maps(to, *all, {}); }},
        {"acquire.sums",
         [](const Path& to) {
             save_state(to, {1, 2, {}, FilterSums(testing::rig_b())});
         }},
        {"lamp.exr", [=](const Path& to) { write_light_field(to, field); }},
        {"lamp.cells",
         [=](const Path& to) {
             Monitor silent;
             CellTable(field, Workers{1}, silent).save(to);
         }},
        {"lamp.tm25ray", [](const Path& to) { write_rays(to, rays()); }},
        {"lamp.dat", [](const Path& to) { write_rays(to, rays()); }},
        {"lamp.ray", [](const Path& to) { write_rays(to, rays()); }},
        {"manifest.toml", [](const Path& to) { write_manifest(to, manifest()); }},
        {"view.png", [](const Path& to) { write_photograph(to, noise_photograph(65535)); }},
        {"view.tif", [](const Path& to) { write_photograph(to, noise_photograph(65535)); }},
        {"view.exr", [](const Path& to) { write_photograph(to, noise_photograph(0)); }},
    };
}

TEST(FullDisk, EveryWriter_NamesFileAndCauseAndLeavesTheOldFile) {
    for (const Writer& writer : writers()) {
        const testing::TemporaryFolder folder;
        const std::filesystem::path file = folder / writer.file;
        writer.write(file);
        const std::vector<std::byte> old = read_bytes(file);
        const std::size_t size = old.size();
        for (const std::size_t room :
             {std::size_t{0}, std::size_t{1}, size / 2, size - std::min<std::size_t>(size, 4096), size - 1}) {
            SCOPED_TRACE(fmt::format("{}: room for {} of {} bytes", writer.file, room, size));
            const std::string error = [&] {
                const FullDisk full(room);
                return error_of([&] { writer.write(file); });
            }();
            EXPECT_THAT(error, AllOf(HasSubstr(file.string() + ": cannot be written: "),
                                     HasSubstr("File too large")));
            EXPECT_EQ(error.find('\n'), error.npos);
            EXPECT_EQ(read_bytes(file), old);
            EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1)
                << "a leftover";
        }
        // With enough room again, the writer gives the same bytes.
        writer.write(file);
        EXPECT_EQ(read_bytes(file), old) << writer.file;
    }
}

// Writes to the device that is always full, where the system has one.
TEST(FullDisk, NoRoomOnTheDevice_IsSaidInTheSystemsWords) {
    if (!std::filesystem::exists("/dev/full")) LUCERNA_CANNOT_RUN() << "there is no /dev/full";
    const testing::TemporaryFolder folder;
    const std::string error = error_of([&] {
        replace_file(folder / "a", [](const std::filesystem::path&) {
            std::ofstream out("/dev/full", std::ios::binary);
            out.exceptions(std::ios::badbit | std::ios::failbit);
            out << "something";
            out.close();
        });
    });
    EXPECT_THAT(error, HasSubstr("cannot be written: No space left on device"));
}

using RenderToFullDisk = testing::RunTest;

// Intermediate files may fail; the final ones may not.
TEST_F(RenderToFullDisk, Image_IsAnErrorAndTheOldOneStays) {
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--png", "--stats", "a.json"}).code, 0);
    const std::vector<std::byte> old = read_bytes("a.exr");
    const std::vector<std::string> before = files();
    const auto outcome = [] {
        const FullDisk full(500);
        return lucerna_run(
            {"render", "scene.pbrt", "-o", "a.exr", "--png", "--stats", "a.json", "--seed", "3"});
    }();
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, AllOf(::testing::StartsWith("lucerna: a.exr: cannot be written: "),
                                   HasSubstr("File too large")));
    EXPECT_EQ(read_bytes("a.exr"), old);
    EXPECT_EQ(files(), before);
}

// The image is worth more than its checkpoint, so it is written before the error is reported.
TEST_F(RenderToFullDisk, Checkpoint_IsAWarningThenAnErrorAndTheImageIsThere) {
    std::filesystem::create_directory("small");
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "--resolution", "200x200", "--spp", "1", "-o", "a.exr",
                           "--checkpoint", "c"})
                  .code,
              0);
    const std::vector<std::byte> old = read_bytes("c");
    const auto outcome = [&] {
        const FullDisk full(old.size() - 1000);  // larger than the image, which is compressed
        return lucerna_run({"render", "scene.pbrt", "--resolution", "200x200", "--spp", "2", "-o", "a.exr",
                            "--resume", "c"});
    }();
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err,
                HasSubstr("lucerna: warning: c: cannot be written: File too large; the render continues"));
    EXPECT_THAT(outcome.err, HasSubstr("\nlucerna: c: cannot be written: File too large\n"));
    EXPECT_EQ(read_exr("a.exr").attributes.at("lucerna.spp"), "2");
    EXPECT_EQ(read_bytes("c"), old);
}

}  // namespace full_disk_test
}  // namespace lucerna
