// The ranks of a parallel job render the image of one process, bit for bit, for any number of ranks and
// threads, wherever they are stopped, and however many continue.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>

#include "engine/render/render.h"
#include "tests/support/materials.h"
#include "tests/support/media.h"
#include "tests/support/scenes.h"
#include "tests/support/thread_communicator.h"

namespace lucerna {
namespace render_ranks_test {

using testing::on_ranks;
using testing::SceneMaker;

struct Case {
    const char* name;
    IntegratorSettings settings;
    bool adaptive = true, parts = false, fog = false, small_lamp = false;
};
void PrintTo(const Case& which, std::ostream* out) {
    *out << which.name;
}

std::vector<Case> cases() {
    PathSettings guided_lights;
    guided_lights.guide_lights = 2'000;
    PhotonMapSettings gather;
    gather.photons = 8'000;
    gather.pre_pass = 2'000;
    PhotonMapSettings guided = gather;
    guided.direct = DirectMethod::guided;
    PhotonMapSettings map = gather;
    map.direct = DirectMethod::map;
    map.indirect = IndirectMethod::map;
    IgiSettings igi;
    igi.nlights = 16;
    igi.nsets = 4;
    igi.pre_pass = 2'000;
    igi.caustic_paths = 4'000;
    ProgressiveSettings progressive;
    progressive.photons = 4'000;
    progressive.pre_pass = 2'000;
    return {{"path", guided_lights},
            {"path in fog with layers", PathSettings{}, true, true, true},
            {"path, not adaptive", PathSettings{}, false},
            {"direct with layers", DirectSettings{}, true, true},
            {"photonmap", gather},
            {"photonmap guided", guided},
            {"photonmap of maps in fog", map, true, false, true},
            {"igi", igi},
            {"igi in fog with layers", igi, true, true, true},
            {"progressive", progressive},
            {"progressive in fog with layers", progressive, true, true, true},
            {"path over chains to a small lamp", PathSettings{}, true, false, false, true}};
}

// Returns a room with glass and a mirror.
Scene room(const Case& which) {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse({0.7F, 0.6F, 0.5F}));
    make.sphere({0.32F, 0.2F, 0.4F}, 0.18F, make.material(DielectricMaterial{}));
    make.sphere({0.75F, 0.15F, 0.35F}, 0.14F, make.material(MirrorMaterial{}));
    const float size = which.small_lamp ? 0.05F : 0.4F;
    make.quad_light({0.3F, 0.95F, 0.4F}, {size, 0, 0}, {0, 0, size}, make.diffuse(Rgb(0)), {9, 8, 6});
    if (which.fog) {
        make.region(
            testing::in_box(testing::homogeneous(Rgb(0.1F), Rgb(0.4F, 0.3F, 0.2F)), V3d(0.01), V3d(0.99)));
    }
    return make.build();
}

Job job_of(const Case& which, int spp) {
    Job job =
        testing::make_job(room(which), testing::camera({0.5F, 0.55F, 0.03F}, {0.5F, 0.45F, 1}, 52, 36, 90),
                          which.settings, spp);
    job.film.two_halves = true;
    job.film.adaptive = which.adaptive;
    job.film.parts = which.parts;
    return job;
}

RenderResult alone(const Case& which, int spp) {
    const Job job = job_of(which, spp);
    Monitor silent;
    return render(job, {5, Workers{2}}, silent);
}

// Each rank has a scene of its own, as on several machines. `change` edits rank 0's options.
RenderResult by_ranks(const Case& which, int spp, int size, const std::vector<int>& threads,
                      const std::function<void(RenderOptions&)>& change = {}, Monitor* user = nullptr) {
    RenderResult result;
    on_ranks(size, threads, [&](Ranks& ranks) {
        const Job job = job_of(which, spp);
        Monitor silent;
        RenderOptions options{5, Workers{ranks.threads(ranks.rank()), &ranks}};
        if (ranks.leads() && change) change(options);
        RenderResult own = render(job, options, ranks.leads() && user ? *user : silent);
        if (ranks.leads()) result = std::move(own);
    });
    return result;
}

void expect_same(const RenderResult& a, const RenderResult& b) {
    EXPECT_EQ(a.image.data, b.image.data);
    ASSERT_EQ(a.denoised.has_value(), b.denoised.has_value());
    if (a.denoised) {
        EXPECT_EQ(a.denoised->data, b.denoised->data);
    }
    ASSERT_EQ(a.parts.has_value(), b.parts.has_value());
    if (a.parts) {
        EXPECT_EQ(a.parts->data, b.parts->data);
    }
    EXPECT_EQ(a.report.relative_error, b.report.relative_error);
    EXPECT_EQ(a.report.denoised_error, b.report.denoised_error);
}

class RanksOfEveryMethod : public ::testing::TestWithParam<Case> {};

TEST_P(RanksOfEveryMethod, Long_MakeTheImageOfOneProcess_BitForBit) {
    const RenderResult expected = alone(GetParam(), 12);
    for (const int size : {1, 2, 3, 8}) {
        for (const std::vector<int>& threads : {std::vector{1}, std::vector{2}}) {
            if (size == 8 && threads.front() == 2) continue;  // 16 threads; tests/process covers it by mpirun
            SCOPED_TRACE(size * 10 + threads.front());
            const RenderResult result = by_ranks(GetParam(), 12, size, threads);
            expect_same(expected, result);
            // Counts and energies are summed over all ranks.
            for (const auto& [name, number] : expected.report.numbers()) {
                if (name.starts_with("photons.") || name.starts_with("paths.") ||
                    name.starts_with("ledger.") || name.starts_with("rays.invalid")) {
                    EXPECT_EQ(result.report.numbers().at(name), number) << name;
                }
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(, RanksOfEveryMethod, ::testing::ValuesIn(cases()));

// The method repeats no work on several ranks.
TEST(Ranks, RaysOfAll_AreThoseOfOne) {
    const Case direct{"direct", DirectSettings{}, false};
    const RenderResult expected = alone(direct, 6);
    const RenderResult result = by_ranks(direct, 6, 3, {1});
    EXPECT_EQ(result.report.rays_total, expected.report.rays_total);
}

// A user who asks to stop once so much of the image is done; 0: at once.
class StopAt final : public Monitor {
  public:
    explicit StopAt(int samples) : left_(samples) {}
    void begin(std::string_view phase, std::uint64_t /*total*/) override {
        counts_ = phase == "image" || phase == "passes";
    }
    void advance(std::uint64_t units) override {
        if (counts_) left_ -= static_cast<int>(units);
    }
    bool stopped() const override { return left_ <= 0; }

  private:
    bool counts_ = false;
    std::atomic<int> left_;  // samples of a tile
};

TEST(Ranks, Long_StoppedAnywhere_GoOnOnAnyNumberOfRanks) {
    constexpr int kSamples = 24;
    std::vector<Case> all = cases();
    int goes = 0;
    for (const std::size_t number : {0, 4, 7, 9}) {
        const Case& which = all[number];
        SCOPED_TRACE(which.name);
        const RenderResult expected = alone(which, kSamples);
        for (const int stop : {0, 12, 150}) {  // of 288
            SCOPED_TRACE(stop);
            Checkpoint kept;
            const auto keep = [&kept](RenderOptions& options) {
                options.keep_every = 1e9;
                options.keep = [&kept](Checkpoint checkpoint) { kept = std::move(checkpoint); };
            };
            StopAt user(stop);
            const RenderResult first = by_ranks(which, kSamples, 3, {1, 2}, keep, &user);
            EXPECT_LT(first.report.samples_done, kSamples);
            EXPECT_FALSE(first.report.complete);
            const auto go_on = [&kept](RenderOptions& options) { options.resume = &kept; };
            // Continue on fewer ranks, on more, and in one process without ranks.
            const int size = 1 + goes++ % 4;
            expect_same(expected, by_ranks(which, kSamples, size, {2, 1}, go_on));
            const Job job = job_of(which, kSamples);
            Monitor silent;
            expect_same(expected, render(job, {.seed = 5, .workers = {2}, .resume = &kept}, silent));
        }
    }
}

TEST(Ranks, CheckpointsAndDisplaysOnTheWay_ChangeNothing) {
    for (const Case& which : {cases()[0], cases()[9]}) {
        SCOPED_TRACE(which.name);
        const RenderResult expected = alone(which, 24);
        std::vector<Checkpoint> kept;
        int watched = 0, shown = 0;
        const RenderResult result = by_ranks(which, 24, 3, {1}, [&](RenderOptions& options) {
            options.keep_every = 0;
            options.keep = [&kept](Checkpoint checkpoint) { kept.push_back(std::move(checkpoint)); };
            options.watch_every = 0;
            options.watch = [&watched](const RenderResult&) { ++watched; };
            options.show_every = 0;
            options.show = [&shown](const RenderResult&) { ++shown; };
        });
        expect_same(expected, result);
        ASSERT_GT(kept.size(), 3U);
        EXPECT_GT(watched, 1);
        EXPECT_GT(shown, 1);
        const Checkpoint& middle = kept[kept.size() / 2];
        const auto go_on = [&middle](RenderOptions& options) { options.resume = &middle; };
        expect_same(expected, by_ranks(which, 24, 2, {1}, go_on));
    }
}

TEST(Ranks, InATime_EndInItWithAWholePicture) {
    for (const Case& which : {cases()[0], cases()[4], cases()[9]}) {
        SCOPED_TRACE(which.name);
        const Stopwatch clock;
        const RenderResult result = by_ranks(which, kNoEndOfSamples, 3, {1},
                                             [](RenderOptions& options) { options.limits.seconds = 1.5; });
        EXPECT_EQ(result.report.ended_by, "time");
        EXPECT_GT(result.report.samples_done, 0);
        EXPECT_TRUE(result.report.complete);
        for (int y = 0; y < result.image.height; ++y) {
            for (int x = 0; x < result.image.width; ++x) EXPECT_GT(luminance(result.image.rgb_at(x, y)), 0);
        }
        EXPECT_LT(clock.seconds(), 6);  // bounds the delay only; tests/process measures how punctual it is
    }
}

TEST(Ranks, ToAnError_TakeTheSamplesOfOneProcess) {
    for (Case which : {cases()[2], cases()[0], cases()[9]}) {
        SCOPED_TRACE(which.name);
        Job job = job_of(which, kNoEndOfSamples);
        Monitor silent;
        const RenderResult expected =
            render(job, {.seed = 5, .workers = {2}, .limits = {.error = 0.2}}, silent);
        const RenderResult result = by_ranks(which, kNoEndOfSamples, 3, {1},
                                             [](RenderOptions& options) { options.limits.error = 0.2; });
        EXPECT_EQ(result.report.ended_by, "error");
        EXPECT_EQ(result.report.samples_done, expected.report.samples_done);
        expect_same(expected, result);
    }
}

}  // namespace render_ranks_test
}  // namespace lucerna
