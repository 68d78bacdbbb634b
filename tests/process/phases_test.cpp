// Kills renders in every phase, by the command's own names, and while each file is being written: resumed,
// they end with the files of an undisturbed render, to the byte. In the meantime each file is the old one or
// the new one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "engine/image/image.h"
#include "engine/render/checkpoint.h"
#include "engine/system/files.h"
#include "tests/process/kill_at.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace phases_test {

using namespace testing;
using ::testing::IsSupersetOf;

// A room with two lamps and a mirror ball, and a body of many triangles, so that reading also takes time.
constexpr const char* kScene = R"(
LookAt 0 1 -3.9  0 1 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 40 "integer yresolution" 32 "string filename" "picture.exr"
Sampler "independent" "integer pixelsamples" 8
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.6 0.5 0.4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -4  -2 0 2  2 0 2  2 0 -4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 2  -2 2 2  2 2 2  2 0 2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -4  -2 2 -4  -2 2 2  -2 0 2 ]
LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ 0 1.7 0 ]
LightSource "point" "rgb I" [ 1 2 3 ] "point3 from" [ 1 1.7 -1 ]
Shape "loopsubdiv" "integer levels" 5 "integer indices" [ 0 1 2 0 2 3 0 3 1 1 3 2 ]
  "point3 P" [ 0.6 0.1 0.5  1 0.9 0.5  1.4 0.1 0.5  1 0.3 1.1 ]
Material "conductor"
Shape "sphere" "float radius" 0.3
)";

struct Case {
    std::string name, integrator;
    std::vector<std::string> set;
    std::vector<std::string> phases;  // the phases that it must have besides reading
    const char* spp = "8";            // large enough to hit the image phase

    friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

std::vector<Case> cases() {
    return {{"path", "path", {}, {"image"}, "64"},
            {"direct", "direct", {}, {"image"}, "1024"},
            {"photonmap",
             "photonmap",
             {"photons=20000", "gatherrays=2", "prepass=16384"},
             {"pre-pass", "photons", "irradiance", "image"}},
            {"guided",
             "photonmap",
             {"photons=20000", "gatherrays=1", "direct=guided"},
             {"guide", "photons", "irradiance", "image"}},
            {"igi",
             "igi",
             {"nlights=64", "nsets=4", "prepass=16384"},
             {"pre-pass", "virtual point lights", "image"}},
            {"igi_many",
             "igi",
             {"nlights=256", "nsets=16"},
             {"virtual point lights", "sorted virtual point lights", "image"}},
            {"progressive", "progressive", {"photons=10000", "prepass=16384"}, {"pre-pass", "passes"}}};
}

class KilledInPhase : public ::testing::TestWithParam<Case> {
  protected:
    void SetUp() override {
        std::ofstream(folder_ / "scene.pbrt") << kScene;
        const Ended undisturbed = command().run(words("expected"));
        ASSERT_EQ(undisturbed.code, 0) << undisturbed.said;
        phases_ = phases_of(undisturbed);
        expected_ = read_exr(folder_ / "expected.exr");
        picture_ = read_bytes(folder_ / "expected.png");
        // Makes the old files.
        std::vector<std::string> others = words("old", "2");
        others.insert(others.end(), {"--seed", "9"});
        ASSERT_EQ(command().run(others).code, 0);
        old_ = {read_bytes(folder_ / "old.exr"), read_bytes(folder_ / "old.png")};
    }

    KillableCommand command() const { return KillableCommand(folder_.path()); }

    std::vector<std::string> words(const std::string& name, const std::string& spp = GetParam().spp) const {
        std::vector<std::string> all{"render",
                                     "scene.pbrt",
                                     "--integrator",
                                     GetParam().integrator,
                                     "--threads",
                                     "2",
                                     "-o",
                                     name + ".exr",
                                     "--png",
                                     "--checkpoint",
                                     name + ".checkpoint",
                                     "--resume",
                                     name + ".checkpoint",
                                     "--checkpoint-every",
                                     "0.01s",
                                     "--spp",
                                     spp};
        for (const std::string& word : GetParam().set) {
            all.emplace_back("--set");
            all.push_back(word);
        }
        return all;
    }

    // Restores the state after an earlier render.
    void begin_anew() const {
        for (const char* suffix : {".exr", ".png"}) {
            std::filesystem::copy_file(folder_ / (std::string("old") + suffix),
                                       folder_ / (std::string("a") + suffix),
                                       std::filesystem::copy_options::overwrite_existing);
        }
        std::filesystem::remove(folder_ / "a.checkpoint");
        remove_parts(folder_.path());
    }

    void expect_old_or_new(const std::string& where) const {
        if (read_bytes(folder_ / "a.exr") != old_[0]) {
            EXPECT_EQ(expected_.data, read_exr(folder_ / "a.exr").data) << where;
        }
        const std::vector<std::byte> png = read_bytes(folder_ / "a.png");
        EXPECT_TRUE(png == old_[1] || png == picture_) << where;
        if (std::filesystem::exists(folder_ / "a.checkpoint")) {
            EXPECT_NO_THROW(load_checkpoint(folder_ / "a.checkpoint")) << where;
        }
    }

    void expect_resumed_to_the_same(const KillAt& when, const std::string& where) const {
        Ended ended = command().kill(words("a"), when, [this] { begin_anew(); });
        ASSERT_TRUE(ended.in_place) << where << ": no kill fell there\n" << ended.said;
        expect_old_or_new(where);
        // Kills the resumed run too, if it reaches the moment, and then runs undisturbed.
        ended = command().run(words("a"), when);
        ASSERT_TRUE(ended.killed || ended.code == 0) << where << " " << ended.code;
        expect_old_or_new(where);
        ASSERT_EQ(command().run(words("a")).code, 0) << where;
        EXPECT_EQ(expected_.data, read_exr(folder_ / "a.exr").data) << where;
        EXPECT_EQ(picture_, read_bytes(folder_ / "a.png")) << where;
    }

    TemporaryFolder folder_;
    std::vector<std::string> phases_;
    Image expected_;
    std::vector<std::byte> picture_;
    std::array<std::vector<std::byte>, 2> old_;
};

TEST_P(KilledInPhase, ByName_ResumesToTheSameFiles) {
    EXPECT_THAT(phases_, IsSupersetOf({"read scene", "build scene"}));
    EXPECT_THAT(phases_, IsSupersetOf(GetParam().phases));
    for (const std::string& phase : phases_) expect_resumed_to_the_same({phase, "", 1}, phase);
}

// Kills at the checkpoint's first, second and fourth write, so that one to resume from exists or not.
TEST_P(KilledInPhase, WhileAFileIsWritten_ResumesToTheSameFiles) {
    for (const int count : {1, 2, 4})
        expect_resumed_to_the_same({"", "a.checkpoint", count}, "checkpoint " + std::to_string(count));
    expect_resumed_to_the_same({"", "a.exr", 1}, "image");
    expect_resumed_to_the_same({"", "a.png", 1}, "picture");
}

INSTANTIATE_TEST_SUITE_P(EveryMethod, KilledInPhase, ::testing::ValuesIn(cases()),
                         [](const auto& test) { return test.param.name; });

}  // namespace phases_test
}  // namespace lucerna
