// Interrupted and resumed renders give, bit for bit, the image of an uninterrupted one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>

#include "engine/integrators/integrator.h"
#include "engine/render/checkpoint.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "engine/system/files.h"
#include "tests/support/error_of.h"
#include "tests/support/scenes.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace resume_test {

using testing::error_of;
using ::testing::HasSubstr;

// Simulates the user's stop request at the n-th query: in preparation, between tiles, anywhere.
class StopAt final : public Monitor {
  public:
    explicit StopAt(int asked) : left_(asked) {}
    bool stopped() const override { return left_.fetch_sub(1) <= 0; }
    int asked_of(int from) const { return from - left_; }

  private:
    mutable std::atomic<int> left_;
};

constexpr int kNeverStops = 1 << 30;

struct Case {
    const char* name;
    IntegratorSettings settings;
    FilterSettings filter = {};
    bool adaptive = false;
};

std::vector<Case> cases() {
    PhotonMapSettings gather;
    gather.photons = 5'000;
    gather.gather_rays = 2;
    PhotonMapSettings guided = gather;
    guided.direct = DirectMethod::guided;
    guided.pre_pass = 2'000;
    PhotonMapSettings map = gather;
    map.direct = DirectMethod::map;
    map.indirect = IndirectMethod::map;
    IgiSettings igi;
    igi.nlights = 16;
    igi.nsets = 4;
    IgiSettings igi_pre_pass = igi;
    igi_pre_pass.pre_pass = 1'000;
    ProgressiveSettings progressive;
    progressive.samples = 1;
    progressive.photons = 2'000;
    ProgressiveSettings two_samples = progressive;
    two_samples.samples = 2;
    two_samples.pre_pass = 1'000;
    FilterSettings negative;
    negative.kind = FilterSettings::Kind::mitchell;
    negative.radius = {2, 2};
    return {{"path", PathSettings{}},
            {"path, filter with negative lobes", PathSettings{}, negative},
            {"direct", DirectSettings{}},
            {"photonmap, final gather", gather},
            {"photonmap, guided, pre-pass", guided},
            {"photonmap, maps seen", map},
            {"igi", igi},
            {"igi, pre-pass", igi_pre_pass},
            {"progressive", progressive},
            {"progressive, two samples in a pass, pre-pass", two_samples}};
}
// Returns the same methods with separate photons for either half of the samples.
std::vector<Case> cases_of_halves() {
    std::vector<Case> all;
    for (const Case& which : cases()) {
        if (std::holds_alternative<PhotonMapSettings>(which.settings) ||
            std::holds_alternative<IgiSettings>(which.settings))
            all.push_back({which.name, which.settings, which.filter, true});
    }
    return all;
}

Job job_of(const Case& which, int spp) {
    Job job =
        testing::make_job(testing::small_cornell(), testing::small_cornell_camera(40), which.settings, spp);
    job.film.filter = which.filter;
    job.film.two_halves = job.film.adaptive = which.adaptive;
    return job;
}

RenderResult whole(const Case& which, int spp) {
    const Job job = job_of(which, spp);
    Monitor silent;
    return render(job, {11, Workers{2}}, silent);
}

// The result of an interrupted render and its last checkpoint. `asked` counts the queries whether to stop.
struct Left {
    RenderResult result;
    Checkpoint checkpoint;
    int asked = 0;
};
Left render_until(const Case& which, int spp, int stop, const Checkpoint* from, int threads = 1,
                  double keep_every = 1e9) {
    const Job job = job_of(which, spp);  // a scene of its own: only the checkpoint is carried over
    StopAt monitor(stop);
    RenderOptions options{11, Workers{threads}};
    Left left;
    options.keep_every = keep_every;
    options.keep = [&](Checkpoint checkpoint) { left.checkpoint = std::move(checkpoint); };
    options.resume = from;
    left.result = render(job, options, monitor);
    left.asked = monitor.asked_of(stop);
    return left;
}

Checkpoint through_file(const Checkpoint& checkpoint) {
    const testing::TemporaryFolder folder;
    save_checkpoint(folder / "checkpoint", checkpoint);
    return load_checkpoint(folder / "checkpoint");
}

// Includes the allocations decided before and after the interruption.
TEST(Resume, AdaptiveSamples_SameImageBitForBit) {
    constexpr int kSamples = 40;
    const Case adaptive{"path, adaptive", PathSettings{}, {}, true};
    const RenderResult expected = whole(adaptive, kSamples);
    const int asked = render_until(adaptive, kSamples, kNeverStops, nullptr).asked;
    for (int i = 1; i < 8; ++i) {
        const int stop = asked * i / 8;
        SCOPED_TRACE(stop);
        const Left first = render_until(adaptive, kSamples, stop, nullptr);
        EXPECT_FALSE(first.result.report.complete);
        const Checkpoint kept = through_file(first.checkpoint);
        const Left second = render_until(adaptive, kSamples, kNeverStops, &kept, 2);
        EXPECT_EQ(expected.image.data, second.result.image.data);
    }
    Checkpoint kept = render_until(adaptive, kSamples, asked / 2, nullptr).checkpoint;
    kept.allocation.pop_back();
    EXPECT_THAT(error_of([&] { render_until(adaptive, kSamples, kNeverStops, &kept); }),
                HasSubstr("another kind or size"));
}

TEST(Resume, Long_StoppedAnywhere_SameImageBitForBit) {
    constexpr int kSamples = 4;
    std::vector<Case> all = cases();
    for (Case& which : cases_of_halves()) all.push_back(std::move(which));
    for (const Case& which : all) {
        SCOPED_TRACE(which.name + std::string(which.adaptive ? ", two halves" : ""));
        const RenderResult expected = whole(which, kSamples);
        const int asked = render_until(which, kSamples, kNeverStops, nullptr).asked;
        ASSERT_GE(asked, 9 * 3);  // at least once for every tile of every round
        for (int i = 0; i < 6; ++i) {
            const int stop = i == 0 ? 0 : 1 + (asked - 2) * i / 5;
            SCOPED_TRACE(stop);
            const Left first = render_until(which, kSamples, stop, nullptr);
            EXPECT_FALSE(first.result.report.complete);
            const Checkpoint kept = through_file(first.checkpoint);
            const Left second = render_until(which, kSamples, kNeverStops, &kept, i % 2 == 0 ? 2 : 3);
            EXPECT_TRUE(second.result.report.complete);
            EXPECT_EQ(second.result.report.samples_done, kSamples);
            EXPECT_EQ(second.result.report.passes_done, expected.report.passes_done);
            EXPECT_EQ(expected.image.data, second.result.image.data);
        }
    }
}

TEST(Resume, StoppedAgainAndAgain_SameImageAndTheSameCountsOfPasses) {
    for (const Case& which : cases()) {
        SCOPED_TRACE(which.name);
        const RenderResult expected = whole(which, 3);
        const int asked = render_until(which, 3, kNeverStops, nullptr).asked;
        Checkpoint kept = render_until(which, 3, asked / 4, nullptr).checkpoint;
        RenderResult last;
        int renders = 0;
        do {
            // Preparation, which also queries, starts anew every time, so the number of queries must grow.
            const Left next = render_until(which, 3, asked / 2 + 7 * renders, &kept, 1, 0);
            kept = through_file(next.checkpoint);
            last = next.result;
            ASSERT_LT(++renders, 20) << "it never ends";
        } while (!last.report.complete);
        EXPECT_GT(renders, 1);
        EXPECT_EQ(expected.image.data, last.image.data);
        for (const auto& [name, number] : expected.report.numbers()) {
            if (name.starts_with("photons.") || name.starts_with("paths.")) {
                EXPECT_EQ(last.report.numbers()[name], number) << name;
            }
        }
    }
}

// Checkpoints are written as often as possible: states between two tiles of a round resume as well as whole
// rounds.
TEST(Resume, EveryStateThatIsKept_EndsInTheSameImage) {
    for (const Case& which : {cases()[0], cases()[9]}) {
        SCOPED_TRACE(which.name);
        const RenderResult expected = whole(which, 4);
        const Job job = job_of(which, 4);
        std::vector<Checkpoint> all;
        RenderOptions options{11, Workers{1}};
        options.keep_every = 0;
        options.keep = [&](Checkpoint checkpoint) { all.push_back(std::move(checkpoint)); };
        Monitor silent;
        EXPECT_EQ(expected.image.data, render(job, options, silent).image.data) << "keeping changes nothing";
        ASSERT_GT(all.size(), 12U);
        bool within = false;
        for (std::size_t i = 0; i < all.size(); i += 5) {
            for (const auto samples : all[i].tiles) within = within || samples != all[i].samples_done;
            EXPECT_EQ(expected.image.data, render_until(which, 4, kNeverStops, &all[i], 2).result.image.data);
        }
        EXPECT_TRUE(within);
    }
}

TEST(Resume, MoreSamples_ImageOfARenderThatHadThemFromTheStart) {
    for (const Case& which : cases()) {
        SCOPED_TRACE(which.name);
        // 3 samples are no multiple of a pass's two: the last pass is truncated, and repeated in full.
        const Left three = render_until(which, 3, kNeverStops, nullptr);
        ASSERT_TRUE(three.result.report.complete);
        const Left seven = render_until(which, 7, kNeverStops, &three.checkpoint);
        EXPECT_EQ(whole(which, 7).image.data, seven.result.image.data);
    }
}

TEST(Resume, NothingLeftToDo_ImageAtOnceWithoutPreparation) {
    for (const Case& which : cases()) {
        SCOPED_TRACE(which.name);
        const Left done = render_until(which, 2, kNeverStops, nullptr);
        const Left again = render_until(which, 2, kNeverStops, &done.checkpoint);
        EXPECT_EQ(done.result.image.data, again.result.image.data);
        EXPECT_EQ(again.result.report.ended_by, "samples");
        // The count contains only the rays of the first render.
        EXPECT_EQ(again.result.report.numbers().at("rays.total"), static_cast<double>(done.checkpoint.rays));
    }
}

TEST(Resume, ErrorReachedBefore_EndsWhereTheFirstDid) {
    for (const Case& which : {cases()[0], cases()[8]}) {
        const auto with_error = [&](const Checkpoint* from, int stop) {
            const Job job = job_of(which, 4096);
            StopAt monitor(stop);
            RenderOptions options{11, Workers{1}};
            options.limits.error = 0.4;
            Left left;
            options.keep_every = 1e9;
            options.keep = [&](Checkpoint checkpoint) { left.checkpoint = std::move(checkpoint); };
            options.resume = from;
            left.result = render(job, options, monitor);
            left.asked = monitor.asked_of(stop);
            return left;
        };
        const Left first = with_error(nullptr, kNeverStops);
        ASSERT_EQ(first.result.report.ended_by, "error");
        EXPECT_EQ(first.result.image.data, with_error(&first.checkpoint, kNeverStops).result.image.data);
        const Left stopped = with_error(nullptr, first.asked * 2 / 3);
        ASSERT_FALSE(stopped.result.report.complete);
        EXPECT_EQ(first.result.image.data, with_error(&stopped.checkpoint, kNeverStops).result.image.data);
    }
}

TEST(Resume, TimeOfEarlierRenders_CountsAgainstTheLimit) {
    const Case which = cases()[0];
    Checkpoint kept = render_until(which, 4, kNeverStops, nullptr).checkpoint;
    kept.seconds = 100;
    const Job job = job_of(which, 1 << 20);
    RenderOptions options{11, Workers{1}};
    options.limits.seconds = 50;
    options.resume = &kept;
    Monitor silent;
    const RenderResult result = render(job, options, silent);
    EXPECT_EQ(result.report.ended_by, "time");
    EXPECT_EQ(result.report.samples_done, 4);
}

TEST(Resume, FewerSamplesOrAnotherSize_IsRefused) {
    const Case which = cases()[0];
    const Checkpoint kept = render_until(which, 4, kNeverStops, nullptr).checkpoint;
    EXPECT_THAT(error_of([&] { render_until(which, 3, kNeverStops, &kept); }),
                HasSubstr("holds up to 4 samples per pixel; --spp 3 is too small, use 4 or more"));
    // The film is of another kind: by passes.
    EXPECT_THAT(error_of([&] { render_until(cases()[9], 4, kNeverStops, &kept); }),
                HasSubstr("another kind or size"));
    Checkpoint fewer = kept;
    fewer.tiles.pop_back();
    EXPECT_THAT(error_of([&] { render_until(which, 4, kNeverStops, &fewer); }),
                HasSubstr("another kind or size"));
}

TEST(Watch, ImageIsShownBetweenTilesAndAtTheEnd_AndChangesNothing) {
    const Case which = cases()[0];
    constexpr int kSamples = 4;
    const Job job = job_of(which, kSamples);
    RenderOptions options{11, Workers{2}};
    std::vector<Image> shown;
    options.watch_every = 0;
    options.watch = [&](const RenderResult& result) { shown.push_back(result.image); };
    Monitor silent;
    const RenderResult result = render(job, options, silent);
    EXPECT_EQ(whole(which, kSamples).image.data, result.image.data);
    // The first is due at once. Others follow as time permits, at most a twentieth of it (Recurring).
    ASSERT_GE(shown.size(), 2U);
    EXPECT_NE(shown.front().data, result.image.data);
    EXPECT_EQ(shown.back().data, result.image.data);
}

// --- the file ---

class CheckpointFile : public ::testing::Test {
  protected:
    CheckpointFile() {
        kept_.facts = {{"scene", "a\tb\nc"}, {"seed", "11"}};
        kept_.seconds = 1.0 / 3;
        kept_.samples_done = 2;
        kept_.tiles = {2, 3, 2};
        kept_.film.assign(44 * 8, std::byte{7});
        kept_.numbers = {{"photons.global.stored", 0.1}, {"large", 1e300}};
        kept_.notes = {{"unit", "lx"}};
        kept_.bad_samples = 3;
        kept_.first_bad = "pixel (1, 2)";
        save_checkpoint(file_, kept_);
        bytes_ = read_bytes(file_);
    }
    void write(std::span<const std::byte> bytes) const {
        std::ofstream(file_, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }
    std::string refusal() const {
        return error_of([&] { load_checkpoint(file_); });
    }

    testing::TemporaryFolder folder_;
    std::filesystem::path file_ = folder_ / "a.checkpoint";
    Checkpoint kept_;
    std::vector<std::byte> bytes_;
};

TEST_F(CheckpointFile, WhatWasSaved_ComesBack) {
    const Checkpoint back = load_checkpoint(file_);
    EXPECT_EQ(back.facts, (Facts{{"scene", "a b c"}, {"seed", "11"}}));
    EXPECT_EQ(back.seconds, kept_.seconds);
    EXPECT_EQ(back.samples_done, 2);
    EXPECT_EQ(back.tiles, kept_.tiles);
    EXPECT_EQ(back.film, kept_.film);
    EXPECT_EQ(back.numbers, kept_.numbers);
    EXPECT_EQ(back.notes, kept_.notes);
    EXPECT_EQ(back.bad_samples, 3U);
    EXPECT_EQ(back.first_bad, kept_.first_bad);
}

TEST_F(CheckpointFile, CutOffAnywhere_IsRefusedInOneLine) {
    for (std::size_t length = 0; length < bytes_.size(); ++length) {
        write(std::span(bytes_).first(length));
        const std::string cause = refusal();
        ASSERT_THAT(cause, HasSubstr(file_.string())) << length;
        ASSERT_EQ(cause.find('\n'), cause.npos);
        if (length >= 48) {
            ASSERT_THAT(cause, HasSubstr("truncated")) << length;
        }
    }
}

TEST_F(CheckpointFile, AnyByteChanged_IsRefused) {
    for (std::size_t i = 0; i < bytes_.size(); ++i) {
        std::vector<std::byte> changed = bytes_;
        changed[i] ^= std::byte{0x10};
        write(changed);
        ASSERT_NE(refusal(), "no error") << i;
    }
}

TEST_F(CheckpointFile, OtherKinds_AreToldApart) {
    const auto with = [&](std::size_t at, std::uint8_t value) {
        std::vector<std::byte> changed = bytes_;
        changed[at] = std::byte{value};
        write(changed);
        return refusal();
    };
    EXPECT_THAT(with(0, 'X'), HasSubstr("is not a checkpoint"));
    EXPECT_THAT(with(8, 4), HasSubstr("from a newer version of lucerna: format 4; expected 3"));
    EXPECT_THAT(with(12, 1), HasSubstr("byte order"));
    // The lengths fit only if they wrap around.
    EXPECT_THAT(with(31, 0x80), HasSubstr("truncated or damaged"));
    std::vector<std::byte> longer = bytes_;
    longer.push_back(std::byte{0});
    write(longer);
    EXPECT_THAT(refusal(), HasSubstr("1 bytes too long"));
    std::filesystem::remove(file_);
    EXPECT_THAT(refusal(), HasSubstr("no such file"));
}

TEST_F(CheckpointFile, OfAnotherRender_NamesTheFirstDifference) {
    const auto against = [&](Facts facts) {
        return error_of([&] { require_same(file_, load_checkpoint(file_).facts, facts); });
    };
    EXPECT_EQ(against(kept_.facts), "no error");
    EXPECT_THAT(against({{"scene", "a b c"}, {"seed", "12"}}), HasSubstr("its seed is 11, here it is 12"));
    EXPECT_THAT(against({{"scene", "d"}, {"seed", "12"}}), HasSubstr("its scene is a b c, here it is d"));
    EXPECT_THAT(against({{"scene", "a b c"}}), HasSubstr("its seed is 11, here it is nothing"));
    EXPECT_THAT(against({{"scene", "a b c"}, {"seed", "11"}, {"k", "7"}}),
                HasSubstr("its k is nothing, here it is 7"));
}

}  // namespace resume_test
}  // namespace lucerna
