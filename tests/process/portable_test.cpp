// A portable build makes the same image on every machine that can run it [docs/explanation/portable.md]. Two
// differences simulate other machines: Embree's instruction set, which a preloaded library overrides, and the
// variants of libm's functions that glibc chooses.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>

#include "engine/image/image.h"
#include "engine/scene/accelerator.h"
#include "engine/scene/arithmetic.h"
#include "engine/system/hash.h"
#include "tests/support/cannot_run.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace portable_test {

using ::testing::HasSubstr;

// Fine meshes in rotated and stretched instances, a texture with alpha 0 and 1/2, glass, metal, a mesh lamp
// and a spot.
constexpr const char* kScene = R"(
LookAt 0 1 -3.9  0 0.9 0  0 1 0
Camera "perspective" "float fov" 42
Film "rgb" "integer xresolution" 48 "integer yresolution" 48 "string filename" "picture.exr"
Sampler "independent" "integer pixelsamples" 4
WorldBegin
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 12 11 9 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
  "point3 P" [ -0.4 1.99 -0.4  0.4 1.99 -0.4  0.4 1.99 0.4  -0.4 1.99 0.4 ]
AttributeEnd
LightSource "spot" "rgb I" [ 3 5 8 ] "point3 from" [ -1.5 1.8 -2 ] "point3 to" [ 0.4 0.2 0.3 ] "float coneangle" 25
Texture "wood" "spectrum" "checkerboard" "float uscale" 7 "float vscale" 7
  "rgb tex1" [ 0.7 0.6 0.5 ] "rgb tex2" [ 0.2 0.3 0.4 ]
Texture "holes" "float" "checkerboard" "float uscale" 5 "float vscale" 5 "float tex1" 1 "float tex2" 0.3
Material "matte" "texture Kd" "wood"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -4  -2 0 2  2 0 2  2 0 -4 ]
  "float uv" [ 0 0 0 1 1 1 1 0 ]
Material "matte" "rgb Kd" [ 0.6 0.5 0.4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 2  -2 2 2  2 2 2  2 0 2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -4  -2 2 -4  -2 2 2  -2 0 2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 2 -4  2 2 -4  2 2 2  -2 2 2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
  "point3 P" [ -1.4 0.2 1  -0.6 0.2 0.6  -0.6 1.2 0.6  -1.4 1.2 1 ]
  "texture alpha" "holes" "float uv" [ 0 0 1 0 1 1 0 1 ]
ObjectBegin "thing"
Shape "loopsubdiv" "integer levels" 4 "integer indices" [ 0 1 2 0 2 3 0 3 1 1 3 2 ]
  "point3 P" [ 0 0 0  0.4 0.8 0  0.8 0 0  0.4 0.2 0.6 ]
ObjectEnd
AttributeBegin Translate 0.5 0.1 0.4 Rotate 20 0 1 0 ObjectInstance "thing" AttributeEnd
AttributeBegin Material "substrate" "rgb Kd" [ 0.4 0.1 0.1 ] "float uroughness" 0.1 "float vroughness" 0.1
  Translate -1 0.1 -0.6 Rotate 60 0.2 1 0 Scale 0.8 0.9 0.8 ObjectInstance "thing" AttributeEnd
AttributeBegin Material "glass" Translate 0.6 0.35 -0.9 Shape "sphere" "float radius" 0.3 AttributeEnd
AttributeBegin Material "metal" "float roughness" 0.05 Translate -0.2 0.9 0.9
  Shape "sphere" "float radius" 0.3 AttributeEnd
)";

// Tunable names of glibc 2.33 and later.
constexpr const char* kOldLibm = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4";

struct Case {
    const char *name, *options;
    friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};
constexpr Case kCases[] = {
    {"path", "--integrator path"},
    {"photonmap", "--integrator photonmap --set photons=30000 --set gatherrays=4"},
    {"progressive", "--integrator progressive --set photons=10000"},
    {"igi", "--integrator igi --set nlights=64 --set nsets=4 --set causticpaths=20000"},
};

class PortableImages : public ::testing::TestWithParam<Case> {
  protected:
    void SetUp() override { std::ofstream(folder_ / "scene.pbrt") << kScene; }

    // Returns the hash of the picture's values on a machine where Embree uses `isa` and libm obeys
    // `tunables`.
    std::uint64_t picture(const std::string& isa, const std::string& tunables, int seed = 0) const {
        const std::string command = fmt::format(
            "cd '{}' && rm -f note && LD_PRELOAD='{}' LUCERNA_TEST_ISA={} LUCERNA_TEST_NOTE=note "
            "GLIBC_TUNABLES={} '{}' render scene.pbrt {} --seed {} -o a.exr --quiet",
            folder_.path().string(), LUCERNA_OTHER_ISA, isa, tunables, LUCERNA_COMMAND, GetParam().options,
            seed);
        EXPECT_EQ(std::system(command.c_str()), 0) << command;
        std::string note;
        std::getline(std::ifstream(folder_ / "note"), note);
        EXPECT_THAT(note, HasSubstr(",isa=avx2 -> ")) << "what the program asks Embree for";
        EXPECT_TRUE(note.ends_with(",isa=" + isa)) << note;
        const Image image = read_exr(folder_ / "a.exr");
        double light = 0;
        WordHash hash;
        for (const float value : image.data) {
            hash.add(value);
            light += double{value};
        }
        EXPECT_GT(light, 0);
        return hash.value();
    }

    testing::TemporaryFolder folder_;
};

TEST_P(PortableImages, ThreeInstructionSetsAndTwoLibms_SameImageToTheBit) {
    if (!kPortableBuild) LUCERNA_CANNOT_RUN() << "this is a native build";
    const std::uint64_t expected = picture("avx2", "''");
    EXPECT_EQ(picture("sse2", "''"), expected);
    EXPECT_EQ(picture("sse4.2", "''"), expected);
    EXPECT_EQ(picture("avx2", kOldLibm), expected);
    EXPECT_EQ(picture("sse2", kOldLibm), expected);
    EXPECT_NE(picture("avx2", "''", 1), expected) << "another seed is another image";
}

INSTANTIATE_TEST_SUITE_P(EveryMethod, PortableImages, ::testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

std::string output_of(const std::string& command) {
    std::string said;
    FILE* const pipe = popen(command.c_str(), "r");
    char part[256];
    while (pipe != nullptr && fgets(part, sizeof part, pipe) != nullptr) said += part;
    if (pipe == nullptr || pclose(pipe) != 0) said += "failed";
    return said;
}

// Verifies the test above: a program with the system's libm gets other bits under these tunables; otherwise
// the test would show nothing about libm.
TEST(PortableBuild, TunablesThemselves_ChangeAProgramThatTakesLibmAsItIs) {
    const std::string sum =
        " python3 -c 'import math; print(hash(tuple(math.sin(i * 0.37) + math.exp(i * 1e-4) for i in "
        "range(100000))))'";
    const std::string own = output_of(sum);
    EXPECT_GT(own.size(), 5U);
    EXPECT_EQ(own, output_of(sum));
    EXPECT_NE(own, output_of("GLIBC_TUNABLES=" + std::string(kOldLibm) + sum));
}

// Their results would be those of the machine's C library. OpenSubdiv's headers call sin and cos for weights
// of floats, and erfc serves statistics, not images.
TEST(PortableBuild, CallsNoElementaryFunctionOfTheCLibrary) {
    const std::string called = output_of("nm -D --undefined-only '" LUCERNA_COMMAND "'");
    EXPECT_NE(called.find("U erfc"), called.npos);  // nm has read the symbols
    std::istringstream lines(called);
    const std::regex elementary(
        "U (((sin|cos|sincos)f)|(a(sin|cos|tan)|tan|atan2|exp|exp2|exp10|expm1|log|log2|log10|log1p|pow|cbrt|"
        "hypot|tgamma|lgamma_r)f?)(@.*)?");
    for (std::string line; std::getline(lines, line);) {
        const std::size_t at = line.find("U ");
        EXPECT_FALSE(at != line.npos && std::regex_match(line.substr(at), elementary)) << line;
    }
}

TEST(PortableBuild, SaysWhatItIs) {
    EXPECT_EQ(output_of("'" LUCERNA_COMMAND "' --version"), fmt::format("lucerna 0.1.0\n{}\n", arithmetic()));
    if (!kPortableBuild) LUCERNA_CANNOT_RUN() << "this is a native build";
    EXPECT_THAT(arithmetic(), ::testing::StartsWith(
                                  fmt::format("portable, x86-64-v3, Embree {} avx2, ", embree_version())));
}

}  // namespace portable_test
}  // namespace lucerna
