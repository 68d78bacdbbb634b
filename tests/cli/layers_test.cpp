// The layers of an image as the command writes them, as another program reads them, and relit.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "engine/denoise/denoise.h"
#include "engine/image/image.h"
#include "tests/cli/run_support.h"
#include "tests/support/cannot_run.h"

namespace lucerna {
namespace layers_test {

using ::testing::HasSubstr;
using testing::lucerna_run;
using testing::Outcome;

// Returns a scene with two groups of lamps, each with factors of its own, and one lamp without a group.
std::string scene_with_groups(const Rgb& stage = Rgb(1), const Rgb& window = Rgb(1)) {
    std::string text = testing::kScene;
    text += fmt::format(
        "LightSource \"spot\" \"rgb I\" [ {} {} {} ] \"point3 from\" [ 1 1.8 -0.5 ] \"point3 to\" [ 0 0 0.5 "
        "] "
        "\"string lightgroup\" \"stage\"\n",
        8 * stage.x, 7 * stage.y, 6 * stage.z);
    text += fmt::format(
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ {} {} {} ] \"string lightgroup\" "
        "\"window\"\n"
        "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -1.9 0.5 0  -1.9 1.5 0  "
        "-1.9 1.5 1  -1.9 0.5 1 ]\n"
        "AttributeEnd\n",
        3 * window.x, 4 * window.y, 5 * window.z);
    return text;
}

class RunLayers : public testing::RunTest {
  protected:
    void render(const std::string& image, const std::string& spp = "8") {
        const auto outcome = lucerna_run({"render", "scene.pbrt", "-o", image, "--spp", spp, "--layers"});
        ASSERT_EQ(outcome.code, 0) << outcome.err;
    }
};

double of(const Image& image, const std::string& channel, int x, int y) {
    const auto found = find_channel(image, channel);
    return found ? double{image.value(x, y, static_cast<int>(*found))} : NAN;
}

TEST_F(RunLayers, HaveTheNamesOfTheDocs_AndAddUp) {
    write("scene.pbrt", scene_with_groups());
    render("a.exr");
    const Image image = read_exr("a.exr");
    for (const char* name : {"emission.R",
                             "direct.variance.G",
                             "indirect.B",
                             "caustic.R",
                             "media.R",
                             "lightgroup.stage.R",
                             "lightgroup.window.variance.B",
                             "lightgroup.default.G",
                             "albedo.R",
                             "albedo.variance.R",
                             "N.X",
                             "Nc.Z",
                             "P.Y",
                             "Z",
                             "variance.Z",
                             "id.object",
                             "id.material",
                             "first.R",
                             "second.samples",
                             "denoised.R"})
        EXPECT_TRUE(find_channel(image, name)) << name;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            for (const std::string c : {".R", ".G", ".B"}) {
                const double all = of(image, c.substr(1), x, y);
                double parts = 0, groups = 0;
                for (const char* part : {"emission", "direct", "indirect", "caustic", "media"})
                    parts += of(image, part + c, x, y);
                for (const char* group : {"stage", "window", "default"})
                    groups += of(image, std::string("lightgroup.") + group + c, x, y);
                EXPECT_NEAR(parts, all, 1e-6 * all);
                EXPECT_NEAR(groups, all, 1e-6 * all);
            }
        }
    }
    // The image is the same as without layers.
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "b.exr", "--spp", "8", "--denoise"}).code, 0);
    const Image without = read_exr("b.exr");
    EXPECT_FALSE(find_channel(without, "direct.R"));
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) EXPECT_EQ(image.rgb_at(x, y), without.rgb_at(x, y));
    }
}

TEST_F(RunLayers, WithoutGroups_ThereAreNone) {
    render("a.exr");
    for (const std::string& channel : read_exr("a.exr").channels)
        EXPECT_FALSE(channel.starts_with("lightgroup.")) << channel;
    expect_refused({"relight", "a.exr", "-o", "b.exr"},
                   {"a.exr", "no light groups", "--layers", "lightgroup"});
}

// OpenImageIO's program selects the layers by their names and adds them.
TEST_F(RunLayers, InOiiotool_AddUpToTheImage) {
    if (std::system("oiiotool --version > version.txt 2>&1") != 0)
        LUCERNA_CANNOT_RUN() << "there is no oiiotool (Debian's openimageio-tools)";
    write("scene.pbrt", scene_with_groups());
    render("a.exr");
    const auto sum = [](const std::vector<std::string>& layers, const std::string& to) {
        std::string command = "oiiotool";
        for (std::size_t i = 0; i < layers.size(); ++i) {
            command += fmt::format(" a.exr --ch R={0}.R,G={0}.G,B={0}.B", layers[i]);
            if (i > 0) command += " --add";
        }
        return std::system((command + " -d float -o " + to + " > said.txt 2>&1").c_str());
    };
    const Image image = read_exr("a.exr");
    const auto most_apart = [&image](const std::string& file) {
        const Image added = read_exr(file);
        double most = 0;
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x) {
                const double all{luminance(image.rgb_at(x, y))};
                most = std::max(most, std::fabs(double{luminance(added.rgb_at(x, y))} - all) / all);
            }
        }
        return most;
    };
    ASSERT_EQ(sum({"emission", "direct", "indirect", "caustic", "media"}, "parts.exr"), 0);
    EXPECT_LT(most_apart("parts.exr"), 1e-6);
    ASSERT_EQ(sum({"lightgroup.stage", "lightgroup.window", "lightgroup.default"}, "groups.exr"), 0);
    EXPECT_LT(most_apart("groups.exr"), 1e-6);
    ASSERT_EQ(sum({"direct", "caustic"}, "some.exr"), 0);
    EXPECT_GT(most_apart("some.exr"), 1e-3);
}

// --- relight ---

float linear(int level) {
    const float v = static_cast<float>(level) / 255;
    return v <= 0.04045F ? v / 12.92F : std::pow((v + 0.055F) / 1.055F, 2.4F);
}

TEST_F(RunLayers, Relit_AreTheSumOfWhatTheirGroupsHaveBecome) {
    write("scene.pbrt", scene_with_groups());
    render("a.exr");
    const auto outcome = lucerna_run({"relight", "a.exr", "--group", "stage=0.5,#ffd080", "--group",
                                      "window=2:1:0", "-o", "b.exr", "--png"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("stage"));
    EXPECT_EQ(files(), (std::vector<std::string>{"a.exr", "b.exr", "b.png", "scene.pbrt"}));
    const Image before = read_exr("a.exr"), after = read_exr("b.exr");
    EXPECT_FALSE(find_channel(after, "direct.R"));
    EXPECT_EQ(after.attributes.at("lucerna.unit"), before.attributes.at("lucerna.unit"));
    const Rgb stage(0.5F * linear(0xff), 0.5F * linear(0xd0), 0.5F * linear(0x80)), window(2, 1, 0);
    for (int y = 0; y < before.height; ++y) {
        for (int x = 0; x < before.width; ++x) {
            for (int c = 0; c < 3; ++c) {
                const std::string colour(1, "RGB"[c]);
                const auto group = [&](const Image& image, const std::string& name) {
                    return of(image, "lightgroup." + name + "." + colour, x, y);
                };
                const double expected = stage[c] * group(before, "stage") +
                                        window[c] * group(before, "window") + group(before, "default");
                EXPECT_NEAR(of(after, colour, x, y), expected, 1e-6 * expected);
                EXPECT_NEAR(group(after, "stage"), stage[c] * group(before, "stage"), 1e-6 * expected);
                EXPECT_GE(of(after, "variance." + colour, x, y), 0);
            }
        }
    }
}

TEST_F(RunLayers, NotChanged_IsTheImageThatWas) {
    write("scene.pbrt", scene_with_groups());
    render("a.exr");
    ASSERT_EQ(lucerna_run({"relight", "a.exr", "-o", "b.exr"}).code, 0);
    // Relights once more and back: a factor of 0 is irreversible, all others can be undone.
    ASSERT_EQ(lucerna_run({"relight", "b.exr", "--group", "stage=4", "-o", "c.exr"}).code, 0);
    ASSERT_EQ(lucerna_run({"relight", "c.exr", "--group", "stage=0.25,#ffffff", "-o", "d.exr"}).code, 0);
    const Image before = read_exr("a.exr"), same = read_exr("b.exr"), changed = read_exr("c.exr"),
                back = read_exr("d.exr");
    double most = 0;
    for (int y = 0; y < before.height; ++y) {
        for (int x = 0; x < before.width; ++x) {
            const double all = of(before, "G", x, y);
            EXPECT_NEAR(of(same, "G", x, y), all, 1e-6 * all);
            EXPECT_EQ(of(same, "variance.G", x, y), of(before, "variance.G", x, y));
            EXPECT_NEAR(of(back, "G", x, y), all, 1e-6 * all);
            most = std::max(most, std::fabs(of(changed, "G", x, y) / all - 1));
        }
    }
    EXPECT_GT(most, 0.1);
}

// A dimmed image equals a render of dimmed lamps.
TEST_F(RunLayers, Relit_AreWhatARenderOfSuchLampsShows) {
    const Rgb stage(0.2F, 0.1F, 0.3F), window(3, 2, 1);
    write("scene.pbrt", scene_with_groups());
    render("a.exr", "4096");
    ASSERT_EQ(lucerna_run({"relight", "a.exr", "--group", "stage=0.2:0.1:0.3", "--group", "window=3:2:1",
                           "-o", "b.exr"})
                  .code,
              0);
    write("scene.pbrt", scene_with_groups(stage, window));
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "c.exr", "--spp", "4096", "--seed", "5"}).code, 0);
    const Image before = read_exr("a.exr"), relit = read_exr("b.exr"), rendered = read_exr("c.exr");
    for (const std::string c : {"R", "G", "B"}) {
        double difference = 0, variance = 0, all = 0, untouched = 0;
        for (int y = 0; y < relit.height; ++y) {
            for (int x = 0; x < relit.width; ++x) {
                difference += of(relit, c, x, y) - of(rendered, c, x, y);
                variance += of(relit, "variance." + c, x, y) + of(rendered, "variance." + c, x, y);
                all += of(rendered, c, x, y);
                untouched += of(before, c, x, y) - of(rendered, c, x, y);
            }
        }
        // Four sigmas are exceeded once in 16000.
        EXPECT_LT(std::fabs(difference), 4 * std::sqrt(variance)) << c;
        EXPECT_LT(4 * std::sqrt(variance), 0.05 * all) << "the test says nothing";
        EXPECT_GT(std::fabs(untouched), 4 * std::sqrt(variance)) << c;
    }
}

TEST_F(RunLayers, WhatRelightCannotDo_IsRefusedByName) {
    write("scene.pbrt", scene_with_groups());
    render("a.exr", "1");
    const auto refused = [this](const std::string& change, const std::vector<std::string>& named) {
        expect_refused({"relight", "a.exr", "--group", change, "-o", "b.exr"}, named);
    };
    refused("stag=0.5", {"a.exr", "\"stag\"", "stage, window"});
    refused("stage", {"--group", "\"stage\"", "NAME=CHANGE"});
    refused("stage=", {"--group", "NAME=CHANGE"});
    refused("stage=bright", {"--group", "bright"});
    refused("stage=-1", {"--group", "-1"});
    refused("stage=0.5,#ffd08", {"--group", "#ffd08", "six hexadecimal digits"});
    refused("stage=#gggggg", {"--group", "#gggggg"});
    refused("stage=0.5,red", {"--group", "red", "#rrggbb"});
    refused("stage=1:2", {"--group", "1:2"});
    refused("stage=1:2:-3", {"--group", "-3"});
    expect_refused({"relight", "a.exr", "--group", "stage=1", "--group", "stage=2", "-o", "b.exr"},
                   {"stage", "twice"});
    expect_refused({"relight", "a.exr", "-o", "a.exr"}, {"a.exr"});
    expect_refused({"relight", "missing.exr", "-o", "b.exr"}, {"missing.exr"});
}

// --- denoised light groups ---

constexpr const char* kGroups[] = {"stage", "window", "default"};

TEST_F(RunLayers, DenoisedGroups_AreThoseOfEachGroupsHalves) {
    write("scene.pbrt", scene_with_groups());
    render("a.exr", "16");
    const Image image = read_exr("a.exr");
    for (const std::string group : kGroups) {
        const std::string layer = "lightgroup." + group + ".";
        const Image denoised = denoise(denoiser_input_of(image, "a.exr", layer), {}).image;
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x) {
                for (int c = 0; c < 3; ++c) {
                    const std::string colour(1, "RGB"[c]);
                    ASSERT_EQ(of(image, "denoised." + layer + colour, x, y), double{denoised.value(x, y, c)});
                    // The group's halves have their own sample counts, and the image's are those of all
                    // groups.
                    const double n_a = of(image, "first." + layer + "samples", x, y);
                    ASSERT_EQ(n_a, of(image, "first.samples", x, y));
                    const double mean = 0.5 * (of(image, "first." + layer + colour, x, y) +
                                               of(image, "second." + layer + colour, x, y));
                    const double value = of(image, layer + colour, x, y);
                    ASSERT_NEAR(mean, value, 1e-5 * value);
                }
            }
        }
    }
}

TEST_F(RunLayers, Relit_HaveTheSumOfTheDenoisedGroups) {
    write("scene.pbrt", scene_with_groups());
    render("a.exr", "16");
    ASSERT_EQ(lucerna_run({"relight", "a.exr", "--group", "stage=0.5", "--group", "window=2:1:0", "-o",
                           "b.exr", "--png"})
                  .code,
              0);
    ASSERT_EQ(lucerna_run({"relight", "a.exr", "-o", "same.exr"}).code, 0);
    const Image before = read_exr("a.exr"), after = read_exr("b.exr"), same = read_exr("same.exr");
    const Rgb factors[] = {Rgb(0.5F), Rgb(2, 1, 0), Rgb(1)};
    for (int y = 0; y < before.height; ++y) {
        for (int x = 0; x < before.width; ++x) {
            for (int c = 0; c < 3; ++c) {
                const std::string colour(1, "RGB"[c]);
                for (const std::string of_what : {"denoised.", "first.", "second."}) {
                    double sum = 0;
                    for (int g = 0; g < 3; ++g) {
                        const std::string name = of_what + "lightgroup." + kGroups[g] + "." + colour;
                        sum += double{factors[g][c]} * of(before, name, x, y);
                        EXPECT_NEAR(of(after, name, x, y), double{factors[g][c]} * of(before, name, x, y),
                                    1e-6 * of(before, name, x, y));
                    }
                    EXPECT_NEAR(of(after, of_what + colour, x, y), sum, 1e-6 * sum);
                    const double all = of(before, of_what + colour, x, y);
                    EXPECT_NEAR(of(same, of_what + colour, x, y), all, 1e-6 * all);
                }
            }
            EXPECT_EQ(of(after, "albedo.G", x, y), of(before, "albedo.G", x, y));
            EXPECT_EQ(of(after, "first.samples", x, y), of(before, "first.samples", x, y));
        }
    }
}

TEST_F(RunLayers, Relit_CanBeDenoisedAsAWhole) {
    write("scene.pbrt", scene_with_groups());
    render("a.exr", "16");
    ASSERT_EQ(lucerna_run({"relight", "a.exr", "--group", "stage=1", "-o", "same.exr"}).code, 0);
    const Outcome outcome = lucerna_run({"denoise", "same.exr", "-o", "clean.exr"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Image before = read_exr("a.exr"), clean = read_exr("clean.exr");
    for (int y = 0; y < before.height; ++y) {
        for (int x = 0; x < before.width; ++x) {
            const double all = of(before, "denoised.G", x, y);
            EXPECT_NEAR(of(clean, "G", x, y), all, 1e-3 * all);
        }
    }
    ASSERT_EQ(lucerna_run({"relight", "a.exr", "--group", "stage=0.3", "-o", "b.exr"}).code, 0);
    EXPECT_EQ(lucerna_run({"denoise", "b.exr", "-o", "c.exr"}).code, 0);
}

// Both ways of denoising a relit image bring it closer to a converged render of the dimmed lamps.
TEST_F(RunLayers, RelitAndDenoised_IsCloserToTheTruth) {
    const Rgb stage(0.3F), window(2.0F);
    write("scene.pbrt", scene_with_groups());
    ASSERT_EQ(lucerna_run(
                  {"render", "scene.pbrt", "-o", "a.exr", "--spp", "16", "--layers", "--resolution", "48x32"})
                  .code,
              0);
    ASSERT_EQ(
        lucerna_run({"relight", "a.exr", "--group", "stage=0.3", "--group", "window=2", "-o", "b.exr"}).code,
        0);
    ASSERT_EQ(lucerna_run({"denoise", "b.exr", "-o", "c.exr"}).code, 0);
    write("scene.pbrt", scene_with_groups(stage, window));
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "r.exr", "--spp", "1024", "--seed", "7",
                           "--resolution", "48x32"})
                  .code,
              0);
    const Image relit = read_exr("b.exr"), clean = read_exr("c.exr"), truth = read_exr("r.exr");
    double measured = 0, summed = 0, whole = 0;
    for (int y = 0; y < truth.height; ++y) {
        for (int x = 0; x < truth.width; ++x) {
            const double right = of(truth, "G", x, y), scale = right + 0.1;
            measured += sqr((of(relit, "G", x, y) - right) / scale);
            summed += sqr((of(relit, "denoised.G", x, y) - right) / scale);
            whole += sqr((of(clean, "G", x, y) - right) / scale);
        }
    }
    EXPECT_LT(summed, 0.7 * measured);
    EXPECT_LT(whole, 0.7 * measured);
}

TEST_F(RunLayers, RelitOfAnImageWithoutDenoisedGroups_HasNone) {
    write("scene.pbrt", scene_with_groups());
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--layers=lightgroup"}).code, 0);
    ASSERT_EQ(lucerna_run({"relight", "a.exr", "--group", "stage=0.5", "-o", "b.exr"}).code, 0);
    const Image relit = read_exr("b.exr");
    EXPECT_FALSE(find_channel(relit, "denoised.R"));
    EXPECT_FALSE(find_channel(relit, "first.R"));
    expect_refused({"denoise", "b.exr", "-o", "c.exr"}, {"b.exr", "first.R"});
}

// --- which layers ---

std::vector<std::string> channels_of(const std::string& file) {
    std::vector<std::string> names = read_exr(file).channels;
    std::sort(names.begin(), names.end());
    return names;
}

TEST_F(RunLayers, Chosen_AreWrittenAndNoOthers) {
    write("scene.pbrt", scene_with_groups());
    render("all.exr");
    const std::vector<std::string> words{"render", "scene.pbrt", "-o", "a.exr", "--spp", "8"};
    const auto written = [&](const std::vector<std::string>& more) {
        std::vector<std::string> all = words;
        all.insert(all.end(), more.begin(), more.end());
        const auto outcome = lucerna_run(all);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return channels_of("a.exr");
    };
    std::vector<std::string> expected{"B", "G", "R", "variance.B", "variance.G", "variance.R"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.end(), expected.begin(), expected.end());
        std::sort(more.begin(), more.end());
        return more;
    };
    EXPECT_EQ(written({"--layers=direct,Z"}),
              with({"direct.R", "direct.G", "direct.B", "direct.variance.R", "direct.variance.G",
                    "direct.variance.B", "Z", "variance.Z"}));
    // The layers are bit for bit those that --layers writes.
    const Image some = read_exr("a.exr"), all = read_exr("all.exr");
    for (const std::string& channel : some.channels) {
        for (int y = 0; y < all.height; ++y) {
            for (int x = 0; x < all.width; ++x) ASSERT_EQ(of(some, channel, x, y), of(all, channel, x, y));
        }
    }
    EXPECT_EQ(
        written({"--layers=lightgroup.stage", "--layers=id"}),
        with({"id.object", "id.material", "lightgroup.stage.R", "lightgroup.stage.G", "lightgroup.stage.B",
              "lightgroup.stage.variance.R", "lightgroup.stage.variance.G", "lightgroup.stage.variance.B"}));
    // The denoised light is where it would be without layers.
    EXPECT_EQ(written({"--layers=id", "--denoise"}),
              with({"id.object", "id.material", "denoised.R", "denoised.G", "denoised.B"}));
    EXPECT_EQ(written({"--layers=denoised.lightgroup.window"}),
              with({"denoised.lightgroup.window.R", "denoised.lightgroup.window.G",
                    "denoised.lightgroup.window.B"}));
    // These layers suffice for the denoiser.
    written({"--layers=first,second,albedo,N,P,Z,Ng,emitter"});
    EXPECT_EQ(lucerna_run({"denoise", "a.exr", "-o", "b.exr"}).code, 0);
    // Without names --layers writes all of them.
    EXPECT_EQ(written({"--layers"}), channels_of("all.exr"));
}

TEST_F(RunLayers, ChosenOfParts_AreThoseOfTheMergedPicture) {
    write("scene.pbrt", scene_with_groups());
    for (const char* part : {"1/2", "2/2"})
        ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", std::string(1, part[0]) + ".exr", "--spp", "8",
                               "--layers=direct,denoised", "--part", part})
                      .code,
                  0);
    ASSERT_EQ(lucerna_run({"merge", "1.exr", "2.exr", "-o", "merged.exr"}).code, 0);
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "one.exr", "--spp", "8", "--layers=direct,denoised",
                           "--no-adaptive"})
                  .code,
              0);
    EXPECT_EQ(channels_of("merged.exr"), channels_of("one.exr"));
    const Image merged = read_exr("merged.exr"), one = read_exr("one.exr");
    ASSERT_TRUE(find_channel(one, "denoised.lightgroup.stage.R"));
    for (const std::string& channel : one.channels) {
        for (int y = 0; y < one.height; ++y) {
            for (int x = 0; x < one.width; ++x)
                ASSERT_EQ(of(merged, channel, x, y), of(one, channel, x, y)) << channel;
        }
    }
}

TEST_F(RunLayers, UnknownNames_AreRefusedBeforeTheRender) {
    write("scene.pbrt", scene_with_groups());
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--layers=direct,albdo"},
                   {"--layers", "no layer \"albdo\"", "did you mean \"albedo\"?", "lightgroup.stage", "Nc"});
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--layers=lightgroup.stag"},
                   {"did you mean \"lightgroup.stage\"?"});
    write("scene.pbrt", testing::kScene);
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--layers=lightgroup.stage"},
                   {"no layer \"lightgroup.stage\"", "emission"});
    EXPECT_FALSE(std::filesystem::exists("a.exr"));
}

TEST_F(RunLayers, OfGroupsThatAMethodCannotTell_AreRefused) {
    write("scene.pbrt", scene_with_groups());
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--layers", "--integrator", "photonmap"},
                   {"light groups", "photonmap", "path", "igi", "progressive", "precompute"});
    EXPECT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--layers", "--integrator", "photonmap",
                           "--set", "precompute=0", "--set", "photons=1000"})
                  .code,
              0);
}

TEST_F(RunLayers, NamesThatNoLayerMayHave_AreRefused) {
    std::string text = scene_with_groups();
    text.replace(text.find("\"stage\""), 7, "\"a.b\"");
    write("scene.pbrt", text);
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--strict"},
                   {"scene.pbrt", "lightgroup", "a.b", "letters"});
}

}  // namespace layers_test
}  // namespace lucerna
