// Ranks share the measurement of lamps and the renders of a study, with the bits of one process, and keep the
// work that is done when they are stopped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <mutex>
#include <numeric>

#include "engine/cli/light/acquire_scene.h"
#include "engine/cli/study/study_runs.h"
#include "engine/image/image.h"
#include "engine/system/files.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/camera_simulation.h"
#include "tests/cli/run_support.h"
#include "tests/support/impatient_monitor.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thread_communicator.h"

namespace lucerna {
namespace shared_work_test {

using ::testing::Each;
using testing::ImpatientMonitor;
using testing::on_ranks;
using testing::TemporaryFolder;

struct Job {
    int ranks;
    std::vector<int> threads;
};
const std::vector<Job> kJobs{{1, {2}}, {2, {1}}, {3, {2, 1, 3}}};

void expect_same(const FilterImages& a, const FilterImages& b) {
    EXPECT_EQ(a.flux, b.flux);
    ASSERT_EQ(a.coloured(), b.coloured());
    for (const int c : a.channels())
        for (const FilterSign sign : kFilterSigns) EXPECT_TRUE(a.of(sign, c) == b.of(sign, c)) << c;
}

Rig bench(bool travels) {
    Rig rig;
    rig.views = {6, 5};
    rig.spacing = {0.008, 0.008};
    rig.pixels = travels ? V2i(15, 12) : V2i(10, 8);
    rig.pixel = travels ? V2d(0.004, 0.004) : V2d(0.012, 0.012);
    rig.distance = 0.05;
    rig.shift = travels ? V2i(2, 2) : V2i(0, 0);
    return rig;
}

TEST(SharedWork, WhatItemsMade_ArrivesOnceBeforeTheLoopEnds) {
    constexpr std::int64_t kItems = 200;
    std::vector<int> came(kItems), made_at(kItems, -1);
    std::mutex mutex;
    on_ranks(3, {2, 1, 3}, [&](Ranks& ranks) {
        Ranks::Loop loop;
        loop.shared.resize(kItems);
        std::iota(loop.shared.begin(), loop.shared.end(), std::int64_t{0});
        loop.made = [&](std::int64_t item) {
            Packer packer;
            packer(item * item, ranks.rank());
            return packer.take();
        };
        loop.arrived = [&](std::int64_t item, int rank, std::span<const std::byte> made) {
            std::int64_t square = 0;
            int maker = 0;
            Unpacker unpacker(made);
            unpacker(square, maker);
            EXPECT_EQ(square, item * item);
            EXPECT_EQ(maker, rank);
            const std::lock_guard lock(mutex);
            ++came[static_cast<std::size_t>(item)];
        };
        ranks.work({ranks.threads(ranks.rank())}, loop, [&](std::int64_t item) {
            const std::lock_guard lock(mutex);
            made_at[static_cast<std::size_t>(item)] = ranks.rank();
            return true;
        });
        if (!ranks.leads()) return;
        for (std::size_t i = 0; i < came.size(); ++i) EXPECT_EQ(came[i], made_at[i] == 0 ? 0 : 1) << i;
    });
    EXPECT_THAT(made_at, Each(::testing::Ge(0)));
}

TEST(SharedWork, WhatCannotArrive_StopsAllAndIsThrownByRank0) {
    const auto broken = [](Ranks& ranks) {
        Ranks::Loop loop;
        loop.shared.assign(1000, 0);
        loop.made = [](std::int64_t) { return std::vector<std::byte>(1); };
        loop.arrived = [](std::int64_t, int, std::span<const std::byte>) { throw InputError("a full disk"); };
        std::atomic<int> done{0};
        try {
            ranks.work({1}, loop, [&](std::int64_t) {
                // Wait until another rank has done an item.
                if (ranks.leads())
                    while (!ranks.has_ended()) std::this_thread::yield();
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
                ++done;
                return true;
            });
            EXPECT_FALSE(ranks.leads());
        } catch (const InputError& error) {
            EXPECT_STREQ(error.what(), "a full disk");
            EXPECT_TRUE(ranks.leads());
        }
        EXPECT_LT(done, 1000);
    };
    on_ranks(2, {1}, broken);
}

// The loop's functions refer to what is gone by then.
TEST(SharedWork, WhereRank0Fails_NothingArrivesAnyMore) {
    std::atomic<int> begun{0}, late{0};
    std::atomic<bool> has_failed{false};
    const auto failing = [&](Ranks& ranks) {
        Ranks::Loop loop;
        loop.shared.assign(1000, 0);
        loop.made = [](std::int64_t) { return std::vector<std::byte>(1); };
        loop.arrived = [&](std::int64_t, int, std::span<const std::byte>) { late += has_failed ? 1 : 0; };
        try {
            ranks.work({1}, loop, [&](std::int64_t) {
                if (ranks.leads()) {
                    while (begun < 2) std::this_thread::yield();
                    throw InputError("a full disk");
                }
                ++begun;
                while (begun >= 2 && !has_failed) std::this_thread::yield();
                return true;
            });
        } catch (const InputError&) {
            has_failed = true;
            std::this_thread::sleep_for(std::chrono::milliseconds(50));  // in which it arrives
            throw;
        }
    };
    EXPECT_THROW(on_ranks(2, {1}, failing), InputError);
    EXPECT_EQ(late, 0);
}

class SharedWorkOf : public ::testing::TestWithParam<bool> {
  protected:
    static EmitterModel lamp(bool coloured) {
        EmitterModel model = cosine_emitter(EmitterModel::Outline::disc, {0.01, 0.01}, 3, 2);
        if (coloured) set_colours(model, {Rgb(1.0F), Rgb(2, 0.6F, 1), {}});
        return model;
    }
};
INSTANTIATE_TEST_SUITE_P(BothSetups, SharedWorkOf, ::testing::Values(false, true),
                         [](const auto& setup) { return setup.param ? "SetupA" : "SetupB"; });

TEST_P(SharedWorkOf, FormulaOnRanks_IsThatOfOneProcess) {
    const Rig rig = bench(GetParam());
    Monitor silent;
    for (const bool coloured : {false, true}) {
        const EmitterModel model = lamp(coloured);
        const FilterImages expected = acquire_filters(model, rig, {2}, silent);
        const LightField canned = acquire_without_filter(model, rig, {2}, silent);
        CameraModel camera;
        camera.exposures = {1, 4};
        camera.shot_noise = true;
        const FilterImages seen = photographed(expected, camera, {2}, silent).images;
        for (const Job& job : kJobs) {
            on_ranks(job.ranks, job.threads, [&](Ranks& ranks) {
                const Workers workers{ranks.threads(ranks.rank()), &ranks};
                Monitor user;
                RanksMonitor monitor(ranks, user);
                const FilterImages images = acquire_filters(model, rig, workers, monitor);
                const LightField other = acquire_without_filter(model, rig, workers, monitor);
                const FilterImages photographs = photographed(expected, camera, workers, monitor).images;
                if (!ranks.leads()) return;
                expect_same(images, expected);
                expect_same(photographs, seen);
                EXPECT_EQ(content_hash(other), content_hash(canned));
            });
        }
    }
}

TEST(SharedWork, FormulaStoppedOnRanks_GoesOnFromAllColumnsThatWereDone) {
    const TemporaryFolder folder;
    const Rig rig = bench(true);
    const EmitterModel model = cosine_emitter(EmitterModel::Outline::disc, {0.01, 0.01}, 3, 2);
    Monitor silent;
    const FilterImages expected = acquire_filters(model, rig, {2}, silent);
    const std::filesystem::path file = folder / "lamp.part";
    for (const std::uint64_t after : {3U, 6U}) {  // columns, of 25
        on_ranks(3, {1}, [&](Ranks& ranks) {
            std::optional<AcquirePart> part;
            if (ranks.leads()) part.emplace(file, 7);
            ImpatientMonitor user(after);
            RanksMonitor monitor(ranks, user);
            ranks.listen_to([&user] { return user.stopped(); });
            AcquireOptions options;
            options.part = part ? &*part : nullptr;
            EXPECT_THROW(acquire_filters(model, rig, {1, &ranks}, monitor, options), Stopped);
        });
        const AcquirePart part(file, 7);
        EXPECT_GE(part.columns(), after);
        EXPECT_LT(part.columns(), 25U);
    }
    on_ranks(2, {1}, [&](Ranks& ranks) {
        std::optional<AcquirePart> part;
        if (ranks.leads()) part.emplace(file, 7);
        Monitor user;
        RanksMonitor monitor(ranks, user);
        AcquireOptions options;
        options.part = part ? &*part : nullptr;
        const FilterImages images = acquire_filters(model, rig, {1, &ranks}, monitor, options);
        if (ranks.leads()) expect_same(images, expected);
    });
    EXPECT_EQ(AcquirePart(file, 7).columns(), 25U);
}

// A luminaire of two colours, so that the sums have three channels, in blocks of few paths.
class SharedLuminaire : public SharedWorkOf {
  protected:
    void SetUp() override {
        std::ofstream(folder_ / "lamp.pbrt")
            << "Camera \"perspective\" Film \"rgb\" WorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" "
               "[0.2 0.5 0.7]\n"
               "Shape \"cylinder\" \"float radius\" 0.012 \"float zmin\" -0.01 \"float zmax\" 0\n"
               "Translate 0 0 -0.01 AreaLightSource \"diffuse\" \"rgb L\" [2 1 1] \"float power\" 5\n"
               "Shape \"disk\" \"float radius\" 0.01\n";
        emitter_.file = folder_ / "lamp.pbrt";
        emitter_.rays = 200'000;
        emitter_.block = 1 << 15;
        emitter_.unit = FluxUnit::lumen;
    }
    SceneAcquisition alone(const std::filesystem::path& part = {}) const {
        Monitor silent;
        return acquire_scene(emitter_, bench(GetParam()), part, {2}, silent);
    }
    // Calls `look` at rank 0.
    void on_job(const Job& job, const std::filesystem::path& part, Monitor& user,
                const std::function<void(const SceneAcquisition&)>& look) const {
        on_ranks(job.ranks, job.threads, [&](Ranks& ranks) {
            Monitor silent;
            RanksMonitor monitor(ranks, ranks.leads() ? user : silent);
            ranks.listen_to([&user] { return user.stopped(); });
            const SceneAcquisition made =
                acquire_scene(emitter_, bench(GetParam()), ranks.leads() ? part : std::filesystem::path(),
                              {ranks.threads(ranks.rank()), &ranks}, monitor);
            if (ranks.leads()) look(made);
        });
    }
    static void expect_same_lamp(const SceneAcquisition& a, const SceneAcquisition& b) {
        expect_same(a.images, b.images);
        EXPECT_EQ(a.images.info.colour, b.images.info.colour);
        EXPECT_EQ(a.noise.rms, b.noise.rms);
        EXPECT_EQ(a.account.total, b.account.total);
        EXPECT_EQ(a.account.backward, b.account.backward);
        EXPECT_EQ(a.account.beside_s, b.account.beside_s);
        EXPECT_EQ(a.account.beside_m, b.account.beside_m);
        EXPECT_EQ(a.account.not_in_basis, b.account.not_in_basis);
        EXPECT_EQ(a.emitted, b.emitted);
        EXPECT_EQ(a.absorbed, b.absorbed);
    }

    TemporaryFolder folder_;
    SceneEmitter emitter_;
};
INSTANTIATE_TEST_SUITE_P(BothSetups, SharedLuminaire, ::testing::Values(false, true),
                         [](const auto& setup) { return setup.param ? "SetupA" : "SetupB"; });

TEST_P(SharedLuminaire, OnRanks_IsThatOfOneProcess) {
    const SceneAcquisition expected = alone();
    EXPECT_TRUE(expected.images.coloured());
    Monitor silent;
    for (const Job& job : kJobs)
        on_job(job, {}, silent, [&](const SceneAcquisition& made) { expect_same_lamp(made, expected); });
}

TEST_P(SharedLuminaire, StoppedOnRanks_GoesOnAloneOrOnOtherRanks) {
    const SceneAcquisition expected = alone();
    const std::filesystem::path part = folder_ / "lamp.part";
    for (const bool then_alone : {true, false}) {
        ImpatientMonitor user(2U << 15);
        EXPECT_THROW(on_job({3, {1}}, part, user, [](const SceneAcquisition&) {}), Stopped);
        ASSERT_TRUE(std::filesystem::exists(part));
        if (then_alone) {
            expect_same_lamp(alone(part), expected);
        } else {
            Monitor silent;
            on_job({2, {2}}, part, silent,
                   [&](const SceneAcquisition& made) { expect_same_lamp(made, expected); });
        }
        std::filesystem::remove(part);
    }
}

class SharedStudy : public testing::RunTest {
  protected:
    void SetUp() override {
        RunTest::SetUp();
        write("study.toml", R"(title = "Two ways"
seeds = 2
[[scene]]
file = "scene.pbrt"
[reference]
integrator = "path"
spp = [16]
[[method]]
name = "paths"
integrator = "path"
spp = [1, 4]
[[method]]
name = "photons"
integrator = "photonmap"
set = "photons=500 gatherrays=1"
spp = [2]
)");
        description_ = read_study("study.toml");
        for (const StudyPoint& point : description_.points) {
            for (std::uint64_t seed = 0; seed < 3; ++seed)
                work_.push_back({&description_.scenes[0], &point, seed});
        }
    }
    std::vector<std::optional<StudyRun>> on_job(int size, const std::string& folder, Monitor& user,
                                                const StudyRuns::WhenMade& when_made) {
        std::vector<std::optional<StudyRun>> runs;
        on_ranks(size, {1}, [&](Ranks& ranks) {
            CommandFiles files;
            const ProcessContext around;
            StudyRuns own(folder, {files, around, {1}, false, {}, &ranks});
            Monitor silent;
            auto made = own.run_by_ranks(work_, ranks.leads() ? user : silent, when_made);
            if (ranks.leads()) runs = std::move(made);
        });
        return runs;
    }

    StudyDescription description_;
    std::vector<StudyWork> work_;
};

TEST_F(SharedStudy, OnRanks_RendersWhatOneProcessDoes) {
    CommandFiles files;
    const ProcessContext around;
    Monitor silent;
    StudyRuns alone("alone", {files, around, {2}, false, {}, nullptr});
    std::vector<Image> expected;
    for (const StudyWork& work : work_) expected.push_back(read_exr(alone.run(work, silent)->image));
    for (const int size : {1, 3}) {
        const std::string folder = "ranks" + std::to_string(size);
        std::map<std::uint64_t, int> seeds;
        const auto runs = on_job(size, folder, silent, [&](const StudyWork& work, const StudyRun& run, int) {
            ++seeds[work.seed];
            EXPECT_FALSE(run.found);
        });
        ASSERT_EQ(runs.size(), work_.size());
        for (std::size_t i = 0; i < runs.size(); ++i) {
            ASSERT_TRUE(runs[i]);
            EXPECT_TRUE(read_exr(runs[i]->image).data == expected[i].data);
            EXPECT_EQ(runs[i]->image.parent_path(), folder);
            EXPECT_EQ(runs[i]->host, "here");
            EXPECT_GT(runs[i]->seconds, 0);
        }
        EXPECT_THAT(seeds, ::testing::ElementsAre(std::pair(0U, 3), std::pair(1U, 3), std::pair(2U, 3)));
        // The next job finds the results.
        for (const auto& again : on_job(2, folder, silent, [](const StudyWork&, const StudyRun&run, int) {
                 EXPECT_TRUE(run.found);
             })) {
            ASSERT_TRUE(again);
            EXPECT_EQ(again->host, "here");
        }
    }
}

TEST_F(SharedStudy, Stopped_KeepsWhatWasMade) {
    struct User : Monitor {
        bool stopped() const override { return asks; }
        std::atomic<bool> asks{false};
    } user;
    std::size_t came = 0;
    const auto runs = on_job(3, "out", user, [&](const StudyWork&, const StudyRun&, int) {
        if (++came == 2) user.asks = true;
    });
    const auto made = static_cast<std::size_t>(
        std::count_if(runs.begin(), runs.end(), [](const auto& run) { return run.has_value(); }));
    EXPECT_EQ(made, came);
    EXPECT_LT(made, work_.size());
    for (const auto& run : runs) {
        if (run) {
            EXPECT_TRUE(std::filesystem::exists(run->image));
        }
    }
}

// A folder stands where an image should be.
TEST_F(SharedStudy, WhatCannotBeKept_IsThrownByRank0) {
    Monitor silent;
    const auto runs = on_job(1, "first", silent, [](const StudyWork&, const StudyRun&, int) {});
    std::filesystem::create_directories("out" / runs[1]->image.filename());
    for (const int size : {1, 2}) {
        std::filesystem::remove_all("out/" + runs[0]->image.filename().string());
        EXPECT_THROW(on_job(size, "out", silent, [](const StudyWork&, const StudyRun&, int) {}), WriteError);
    }
}

}  // namespace shared_work_test
}  // namespace lucerna
