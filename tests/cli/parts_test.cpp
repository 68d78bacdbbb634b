// A picture is rendered in parts and merged, with the bits of a single render; and merging refuses parts that
// do not fit.
#include <fmt/format.h>

#include "engine/image/image.h"
#include "engine/render/image_part.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace parts_test {

using ::testing::HasSubstr;
using testing::lucerna_run;
using Words = std::vector<std::string>;

struct Method {
    const char* name;
    Words settings;
};
void PrintTo(const Method& method, std::ostream* out) {
    *out << method.name;
}

class Parts : public testing::RunTest {
  protected:
    void SetUp() override {
        RunTest::SetUp();
        write("scene.pbrt",
              testing::kScene + std::string("LightSource \"spot\" \"rgb I\" [ 8 7 6 ] \"point3 from\" "
                                            "[ 1 1.8 -0.5 ] \"string lightgroup\" \"stage\"\n"));
    }

    static void render(const std::string& image, const Words& words) {
        Words all{"render", "scene.pbrt", "-o", image, "--quiet"};
        all.insert(all.end(), words.begin(), words.end());
        const auto outcome = lucerna_run(all);
        ASSERT_EQ(outcome.code, 0) << outcome.err;
    }
    // Renders the files "part1.exr" and so on.
    static Words render_parts(int of, Words words) {
        Words files;
        for (int number = 1; number <= of; ++number) {
            files.push_back(fmt::format("part{}.exr", number));
            Words own = words;
            own.insert(own.end(), {"--part", fmt::format("{}/{}", number, of)});
            render(files.back(), own);
        }
        return files;
    }
    static void merge(const Words& parts, const std::string& image, const Words& more = {}) {
        Words all{"merge"};
        all.insert(all.end(), parts.begin(), parts.end());
        all.insert(all.end(), {"-o", image});
        all.insert(all.end(), more.begin(), more.end());
        const auto outcome = lucerna_run(all);
        ASSERT_EQ(outcome.code, 0) << outcome.err;
    }
};

void expect_same_bits(const std::string& a, const std::string& b) {
    const Image one = read_exr_as_stated(a), other = read_exr_as_stated(b);
    ASSERT_EQ(one.channels, other.channels);
    ASSERT_EQ(one.width, other.width);
    ASSERT_EQ(one.height, other.height);
    EXPECT_TRUE(one.data == other.data);
    EXPECT_EQ(one.corner, other.corner);
    EXPECT_EQ(one.picture, other.picture);
    EXPECT_EQ(one.space, other.space);
}

class PartsOfEveryMethod : public Parts, public ::testing::WithParamInterface<Method> {};

TEST_P(PartsOfEveryMethod, Merged_AreOneRenderBitForBit) {
    Words words{"--resolution",  "40x24",     "--spp",  "8", "--integrator",
                GetParam().name, "--denoise", "--seed", "3"};
    for (const std::string& setting : GetParam().settings) words.insert(words.end(), {"--set", setting});
    Words whole = words;
    whole.push_back("--no-adaptive");
    render("whole.exr", whole);
    for (const int of : {1, 2, 3, 8}) {
        SCOPED_TRACE(of);
        merge(render_parts(of, words), "merged.exr");
        expect_same_bits("merged.exr", "whole.exr");
    }
}

INSTANTIATE_TEST_SUITE_P(
    , PartsOfEveryMethod,
    ::testing::Values(Method{"path", {"guidelights=5000"}}, Method{"direct", {}},
                      Method{"photonmap", {"photons=20000"}},
                      Method{"photonmap", {"photons=20000", "direct=map", "indirect=map"}},
                      Method{"igi", {"nsets=4", "prepass=2000"}}, Method{"progressive", {"photons=2000"}}));

TEST_F(Parts, OfACropWithLayersInAnotherColourSpace_MergedAreOneRender) {
    const Words words{"--resolution", "40x24",          "--crop", "3,2,33,19", "--spp", "4",
                      "--layers",     "--colour-space", "acescg"};
    Words whole = words;
    whole.push_back("--no-adaptive");
    render("whole.exr", whole);
    const Words parts = render_parts(6, words);
    const Image part = read_exr("part1.exr");
    EXPECT_EQ(part.corner, V2i(3, 2));
    EXPECT_EQ(part.picture, V2i(40, 24));
    EXPECT_TRUE(find_channel(part, "direct.R"));
    merge(parts, "merged.exr");
    expect_same_bits("merged.exr", "whole.exr");
}

TEST_F(Parts, InAnyOrderAndByAnyThreads_AreTheSamePicture) {
    const Words words{"--resolution", "33x17", "--integrator", "igi", "--set", "nsets=4"};
    Words whole = words, one = words, three = words;
    whole.insert(whole.end(), {"--threads", "2"});
    render("whole.exr", whole);
    one.insert(one.end(), {"--threads", "1", "--part", "1/2"});
    three.insert(three.end(), {"--threads", "3", "--part", "2/2"});
    render("a.exr", one);
    render("b.exr", three);
    merge({"b.exr", "a.exr"}, "merged.exr", {"--png"});
    expect_same_bits("merged.exr", "whole.exr");
    EXPECT_TRUE(std::filesystem::exists("merged.png"));
}

TEST_F(Parts, ThatAreNoneOrMissingOrThereTwice_AreNamed) {
    const Words parts = render_parts(4, {"--spp", "1"});
    expect_refused({"merge", "part1.exr", "part4.exr", "-o", "m.exr"}, {"2 of 4 parts are missing: 2, 3"});
    expect_refused({"merge", "part1.exr", "part2.exr", "part1.exr", "part3.exr", "part4.exr", "-o", "m.exr"},
                   {"part1.exr", "part 1 of 4 is given twice: part1.exr and part1.exr"});
    render("whole.exr", {});
    expect_refused({"merge", "whole.exr", "-o", "m.exr"}, {"whole.exr", "is not part", "--part"});
    render("other.exr", {"--spp", "1", "--seed", "7", "--part", "2/4"});
    expect_refused({"merge", "part1.exr", "other.exr", "-o", "m.exr"},
                   {"other.exr", "its seed is 7, in part1.exr it is 0"});
    render("other.exr", {"--spp", "2", "--part", "2/4"});
    expect_refused({"merge", "part1.exr", "other.exr", "-o", "m.exr"}, {"its number of samples is 2"});
    render("other.exr", {"--spp", "1", "--part", "2/3"});
    expect_refused({"merge", "part1.exr", "other.exr", "-o", "m.exr"},
                   {"one of 3 parts, part1.exr is one of 4"});
    expect_refused({"merge", "part1.exr", "-o", "part1.exr"}, {"part1.exr"});
}

TEST_F(Parts, OfDifferentLayers_AreRefusedByTheOptions) {
    render("plain.exr", {"--spp", "2", "--part", "1/2"});
    render("denoised.exr", {"--spp", "2", "--part", "2/2", "--denoise"});
    render("layers.exr", {"--spp", "2", "--part", "1/2", "--layers"});
    expect_refused({"merge", "plain.exr", "denoised.exr", "-o", "m.exr"},
                   {"denoised.exr was rendered with --denoise or --layers, plain.exr was not"});
    expect_refused({"merge", "denoised.exr", "plain.exr", "-o", "m.exr"},
                   {"denoised.exr was rendered with --denoise or --layers, plain.exr was not"});
    expect_refused({"merge", "layers.exr", "denoised.exr", "-o", "m.exr"},
                   {"layers.exr was rendered with --layers, denoised.exr was not"});
}

TEST_F(Parts, WithoutAnOutput_HaveNamesOfTheirOwn) {
    for (const char* part : {"1/2", "2/2"}) {
        const auto outcome = lucerna_run({"render", "scene.pbrt", "--spp", "1", "--quiet", "--part", part});
        ASSERT_EQ(outcome.code, 0) << outcome.err;
    }
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "--spp", "1", "--quiet", "--no-adaptive"}).code, 0);
    std::vector<std::filesystem::path> whole;
    for (const auto& entry : std::filesystem::directory_iterator(".")) {
        const std::string stem = entry.path().stem().string();
        if (entry.path().extension() == ".exr" && stem.find("-part") == stem.npos)
            whole.push_back(entry.path());
    }
    ASSERT_EQ(whole.size(), 1U);
    const std::string stem = whole.front().stem().string();
    merge({stem + "-part1of2.exr", stem + "-part2of2.exr"}, "merged.exr");
    expect_same_bits("merged.exr", whole.front().string());
}

TEST_F(Parts, OfAHeaderThatLies_AreRefused) {
    render_parts(2, {"--spp", "1"});
    const Image part = read_exr("part1.exr");
    const auto refused_with = [&](const char* name, const std::string& value, const char* because) {
        Image lying = part;
        lying.attributes[name] = value;
        write_exr("lying.exr", lying);
        expect_refused({"merge", "lying.exr", "part2.exr", "-o", "m.exr"}, {"lying.exr", because});
    };
    refused_with("lucerna.part", "2", "not part 2 of 2");
    refused_with("lucerna.part", "3", "3");
    refused_with("lucerna.parts", "1000000", "damaged");
    refused_with("lucerna.view", "0 0 2000000000 2000000000", "damaged");
    refused_with("lucerna.view", "0 0", "damaged");
    refused_with("lucerna.stopped", "1 spp", "stopped");
    refused_with("lucerna.picture", "", "different picture");
    Image cut = part;
    cut.corner.x += 1;
    write_exr("lying.exr", cut);
    expect_refused({"merge", "lying.exr", "part2.exr", "-o", "m.exr"}, {"lying.exr", "damaged"});
}

TEST_F(Parts, AskedForWrongly_AreRefused) {
    const auto refused = [&](const Words& words, const Words& named) {
        Words all{"render", "scene.pbrt", "-o", "a.exr"};
        all.insert(all.end(), words.begin(), words.end());
        expect_refused(all, named);
    };
    refused({"--part", "3"}, {"--part", "\"3\"", "3/16"});
    refused({"--part", "4/3"}, {"--part", "4"});
    refused({"--part", "0/3"}, {"--part", "0"});
    refused({"--part", "1/97"}, {"12 x 8 pixels", "97 parts"});
    refused({"--part", "1/2", "--time", "1s"}, {"--part", "--spp"});
    refused({"--part", "1/2", "--error", "1%"}, {"--part", "--spp"});
    refused({"--part", "1/2", "--integrator", "photonmap", "--save-maps", "a.photons"},
            {"--part", "--load-maps"});
    refused({"--crop", "1,2,3"}, {"--crop", "x0,y0,x1,y1"});
    refused({"--crop", "3,0,3,4"}, {"--crop", "x0 < x1"});
    refused({"--crop", "0,0,13,4"}, {"--crop", "(13, 4)", "12 x 8"});
}

TEST_F(Parts, ACrop_IsCutOutOfThePictureAndKnowsItsPlace) {
    const Words words{"--integrator", "path", "--spp", "2"};
    render("whole.exr", words);
    Words cropped = words;
    cropped.insert(cropped.end(), {"--crop", "2,3,9,7"});
    render("crop.exr", cropped);
    const Image whole = read_exr("whole.exr"), crop = read_exr("crop.exr");
    EXPECT_EQ(crop.corner, V2i(2, 3));
    EXPECT_EQ(crop.picture, V2i(12, 8));
    ASSERT_EQ(V2i(crop.width, crop.height), V2i(7, 4));
    for (int y = 0; y < crop.height; ++y) {
        for (int x = 0; x < crop.width; ++x) EXPECT_EQ(crop.rgb_at(x, y), whole.rgb_at(x + 2, y + 3));
    }
}

TEST(Boxes, OfAPicture_CoverEveryPixelOnce) {
    const PixelBox whole{{3, 5}, {103, 66}};
    for (const int of : {1, 2, 3, 7, 16, 61, 100, 600}) {
        SCOPED_TRACE(of);
        std::vector<int> seen(100 * 61);
        for (int number = 1; number <= of; ++number) {
            const auto box = box_of({number, of}, whole);
            ASSERT_TRUE(box);
            for (int y = box->begin.y; y < box->end.y; ++y) {
                for (int x = box->begin.x; x < box->end.x; ++x)
                    ++seen[static_cast<std::size_t>(100 * (y - 5) + x - 3)];
            }
        }
        EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 100 * 61);
    }
    EXPECT_FALSE(box_of({1, 101}, whole)) << "a prime number, more than columns or rows";
    EXPECT_EQ(box_of({1, 12}, {{0, 0}, {64, 48}})->size(), V2i(16, 16)) << "as square as can be";
}

}  // namespace parts_test
}  // namespace lucerna
