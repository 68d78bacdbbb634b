// A small scene, the command as a function, and a folder to run it in.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "engine/cli/run.h"
#include "tests/support/temporary_folder.h"

namespace lucerna::testing {

// A floor and a wall under a small lamp, which every integrator can render.
inline constexpr const char* kScene = R"(
LookAt 0 1 -3  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 12 "integer yresolution" 8 "string filename" "folder/picture.exr"
Sampler "independent" "integer pixelsamples" 2
Integrator "path" "integer maxdepth" 4
WorldBegin
MakeNamedMaterial "grey" "string type" "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
NamedMaterial "grey"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -2  -2 0 2  2 0 2  2 0 -2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 2  -2 2 2  2 2 2  2 0 2 ]
LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ 0 1.5 0 ]
)";

struct Outcome {
    int code;
    std::string out, err;
};

inline Outcome lucerna_run(const std::vector<std::string>& words, const ProcessContext& around = {}) {
    std::vector<const char*> argv{"lucerna"};
    for (const std::string& word : words) argv.push_back(word.c_str());
    std::ostringstream out, err;
    const int code = run(static_cast<int>(argv.size()), argv.data(), out, err, around);
    return {code, out.str(), err.str()};
}

// Runs every test in its own folder, because outputs without a folder go to the current one.
class RunTest : public ::testing::Test {
  protected:
    void SetUp() override {
        before_ = std::filesystem::current_path();
        std::filesystem::current_path(folder_.path());
        write("scene.pbrt", kScene);
    }
    void TearDown() override { std::filesystem::current_path(before_); }

    static void write(const std::string& name, const std::string& text) { std::ofstream(name) << text; }

    // Returns the sorted names of the files in the folder.
    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
            names.push_back(std::filesystem::relative(entry.path(), folder_.path()).string());
        }
        std::sort(names.begin(), names.end());
        return names;
    }

    // Expects exit code 1, one line that contains all of `named`, and no new files.
    void expect_refused(const std::vector<std::string>& words, const std::vector<std::string>& named) {
        SCOPED_TRACE(::testing::PrintToString(words));
        const std::vector<std::string> before = files();
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
        EXPECT_THAT(outcome.err, ::testing::StartsWith("lucerna: "));
        for (const std::string& part : named) EXPECT_THAT(outcome.err, ::testing::HasSubstr(part));
        EXPECT_EQ(files(), before);
    }

    TemporaryFolder folder_;
    std::filesystem::path before_;
};

}  // namespace lucerna::testing
