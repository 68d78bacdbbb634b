// Ranks do every item of a loop once, agree on values, and keep states at their owners.
#include "engine/ranks/shared_work.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/support/thread_communicator.h"

namespace lucerna {
namespace ranks_test {

using ::testing::Each;
using testing::on_ranks;

std::vector<std::int64_t> items_to(std::int64_t count) {
    std::vector<std::int64_t> items(static_cast<std::size_t>(count));
    std::iota(items.begin(), items.end(), 0);
    return items;
}

struct Record {
    std::int32_t number = 0;
    std::string text;
    std::vector<std::uint8_t> bytes;
    std::array<std::vector<double>, 2> pair;
    template <typename Archive>
    void fields(Archive& archive) {
        archive(number, text, bytes, pair);
    }
    bool operator==(const Record&) const = default;
};

TEST(Packing, Unpacked_IsWhatWasPacked) {
    const Record one{7, "seven", {1, 2, 3}, {{{0.5}, {}}}}, other{-1, "", {}, {{{}, {2.5, 3.5}}}};
    Packer packer;
    const std::vector<Record> both{one, other};
    packer(both, 3.25F);
    const std::vector<std::byte> bytes = packer.take();
    Unpacker unpacker(bytes);
    std::vector<Record> back;
    float last = 0;
    unpacker(back, last);
    EXPECT_EQ(back, both);
    EXPECT_EQ(last, 3.25F);
    EXPECT_TRUE(unpacker.empty());
}

TEST(Ranks, Chunks_AreEverywhereWhateverTheRanksAndThreads) {
    constexpr std::int64_t kChunks = 57;
    for (const int size : {1, 2, 3, 8}) {
        for (const std::vector<int>& threads : {std::vector{1}, std::vector{2, 1, 3}}) {
            std::atomic<int> calls{0}, told{0};
            on_ranks(size, threads, [&](Ranks& ranks) {
                const Workers workers{ranks.threads(ranks.rank()), &ranks};
                std::vector<std::vector<int>> made(kChunks);
                const bool whole = shared_chunks(
                    workers, "squares", kChunks, ResultsGo::to_all_ranks,
                    [&](std::int64_t chunk) {
                        ++calls;
                        made[static_cast<std::size_t>(chunk)] = {static_cast<int>(chunk * chunk), 1};
                    },
                    [&](std::int64_t chunk, auto& archive) {
                        archive(made[static_cast<std::size_t>(chunk)]);
                    },
                    [&](std::int64_t more) { told += static_cast<int>(more); });
                EXPECT_TRUE(whole);
                for (int chunk = 0; chunk < kChunks; ++chunk)
                    EXPECT_EQ(made[static_cast<std::size_t>(chunk)], (std::vector<int>{chunk * chunk, 1}));
            });
            EXPECT_EQ(calls, kChunks);
            EXPECT_EQ(told, kChunks);
        }
    }
}

TEST(Ranks, ASlowRank_GetsLessAndHoldsNobodyUp) {
    std::array<std::atomic<int>, 3> done{};
    on_ranks(3, {1}, [&](Ranks& ranks) {
        Ranks::Loop loop;
        loop.shared = items_to(120);
        ranks.work({1, &ranks}, loop, [&](std::int64_t) {
            std::this_thread::sleep_for(std::chrono::milliseconds(ranks.rank() == 1 ? 40 : 2));
            ++done[static_cast<std::size_t>(ranks.rank())];
            return true;
        });
        ranks.agree_to_stop();
    });
    EXPECT_EQ(done[0] + done[1] + done[2], 120);
    // With an equal share this rank would take 1.6 s, in which the others do 800 items.
    EXPECT_LT(done[1], 12);
    EXPECT_GT(done[1], 0);
}

// Every item counts up at its owner, and rank 0 gets it.
TEST(Ranks, OwnedItems_AreDoneAtTheirOwnersInEveryRound) {
    constexpr std::int64_t kItems = 40;
    constexpr int kRounds = 6;
    on_ranks(3, {2, 1, 2}, [&](Ranks& ranks) {
        const Workers workers{ranks.threads(ranks.rank()), &ranks};
        std::vector<std::vector<int>> states(kItems);
        const auto fields = [&](std::int64_t item, auto& archive) {
            archive(states[static_cast<std::size_t>(item)]);
        };
        OwnedItems owned(workers, items_to(kItems));
        for (int round = 0; round < kRounds; ++round) {
            std::atomic<int> done{0};
            const auto left = owned.work(workers, items_to(kItems), {}, [&](std::int64_t item) {
                states[static_cast<std::size_t>(item)].push_back(round);
                ++done;
            });
            EXPECT_TRUE(left.empty());
            EXPECT_EQ(done, 8 * workers.threads);
            if (round % 2 == 1) exchange(ranks, "states", ResultsGo::to_rank_0, owned.own(), fields);
        }
        const std::vector<int> rounds{0, 1, 2, 3, 4, 5};
        for (std::size_t item = 0; ranks.leads() && item < kItems; ++item) EXPECT_EQ(states[item], rounds);
    });
}

// A loop that ends early leaves the same items on all ranks, and the next loop does them.
TEST(Ranks, OwnedItemsThatAreLeft_AreKnownToAllRanks) {
    constexpr std::int64_t kItems = 60;
    on_ranks(3, {1}, [&](Ranks& ranks) {
        std::vector<int> done(kItems);
        OwnedItems owned({1, &ranks}, items_to(kItems));
        Ranks::Loop loop;
        loop.ends = [&done] { return done[0] > 0; };
        const auto count = [&](std::int64_t item) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            ++done[static_cast<std::size_t>(item)];
        };
        const std::set<std::int64_t> left = owned.work({1, &ranks}, items_to(kItems), loop, count);
        EXPECT_GT(left.size(), kItems / 3U);
        const std::vector<std::int64_t> rest(left.begin(), left.end());
        EXPECT_TRUE(owned.work({1, &ranks}, rest, {}, count).empty());
        for (std::int64_t item = 0; item < kItems; ++item)
            EXPECT_EQ(done[static_cast<std::size_t>(item)], owned.is_own(item) ? 1 : 0);
    });
}

// Items move from a slow rank to others with their states, and rank 0 gets all of them.
TEST(Ranks, BalancedItems_MoveFromASlowRankWithTheirStates) {
    constexpr std::int64_t kItems = 90;
    constexpr int kRounds = 6;
    std::array<std::atomic<int>, 3> last{};
    on_ranks(3, {1}, [&](Ranks& ranks) {
        const Workers workers{1, &ranks};
        std::vector<std::vector<int>> states(kItems);
        const auto fields = [&](std::int64_t item, auto& archive) {
            archive(states[static_cast<std::size_t>(item)]);
        };
        OwnedItems owned(workers, items_to(kItems));
        for (int round = 0; round < kRounds; ++round) {
            int done = 0;
            owned.work(workers, items_to(kItems), {}, [&](std::int64_t item) {
                std::this_thread::sleep_for(std::chrono::milliseconds(ranks.rank() == 1 ? 8 : 2));
                states[static_cast<std::size_t>(item)].push_back(round);
                ++done;
            });
            last[static_cast<std::size_t>(ranks.rank())] = done;
            owned.balance(ranks, fields);
        }
        exchange(ranks, "states", ResultsGo::to_rank_0, owned.own(), fields);
        const std::vector<int> rounds{0, 1, 2, 3, 4, 5};
        for (std::size_t item = 0; ranks.leads() && item < kItems; ++item) EXPECT_EQ(states[item], rounds);
    });
    // Four times as slow, it has a ninth of the items.
    EXPECT_EQ(last[0] + last[1] + last[2], kItems);
    EXPECT_LE(last[1], 16);
    EXPECT_GE(last[1], 6);
}

// Rank 0 learns of the progress of all ranks while they work on items of their own.
TEST(Ranks, Progress_IsThatOfAllRanksOnTheWay) {
    constexpr int kEach = 40;
    std::atomic<std::int64_t> told{0}, told_before_the_end{0};
    on_ranks(2, {1}, [&](Ranks& ranks) {
        Ranks::Loop loop;
        loop.own = items_to(ranks.leads() ? 1 : kEach);
        loop.advance = [&](std::int64_t more) { told += more; };
        ranks.work({1, &ranks}, loop, [&](std::int64_t item) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            if (item == kEach - 1) told_before_the_end = told.load();
            return true;
        });
    });
    EXPECT_GT(told_before_the_end, kEach / 4);
    EXPECT_EQ(told, kEach + 1);
}

TEST(Ranks, AskedToStop_AllKnowAndLeaveTheRest) {
    std::atomic<int> done{0};
    on_ranks(3, {2}, [&](Ranks& ranks) {
        std::vector<int> made(20'000);
        if (ranks.leads()) ranks.listen_to([&done] { return done >= 20; });
        EXPECT_FALSE(ranks.stopped());
        const bool whole = shared_chunks(
            {2, &ranks}, "slow", 20'000, ResultsGo::to_all_ranks,
            [&](std::int64_t) {
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
                ++done;
            },
            [&](std::int64_t chunk, auto& archive) { archive(made[static_cast<std::size_t>(chunk)]); });
        EXPECT_FALSE(whole);
        EXPECT_TRUE(ranks.stopped());
    });
    EXPECT_LT(done, 2'000);  // six threads do this number in some tenths of a second
}

TEST(Ranks, WhenTimeIsUp_NothingIsBegun) {
    std::atomic<int> done{0};
    on_ranks(2, {1}, [&](Ranks& ranks) {
        Ranks::Loop loop;
        loop.shared = items_to(10'000);
        loop.seconds = 0.05;
        ranks.work({1, &ranks}, loop, [&](std::int64_t) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            ++done;
            return true;
        });
        ranks.agree_to_stop();
    });
    EXPECT_LT(done, 200);
    EXPECT_GT(done, 0);
}

TEST(Ranks, AnErrorOfOneRank_EndsThemAll) {
    EXPECT_THROW(on_ranks(3, {2},
                          [](Ranks& ranks) {
                              shared_chunks(
                                  {2, &ranks}, "bad", 50, ResultsGo::to_all_ranks,
                                  [&](std::int64_t chunk) {
                                      if (chunk == 17) throw InputError("seventeen");
                                  },
                                  [](std::int64_t, auto&) {});
                          }),
                 std::exception);
}

TEST(Ranks, AgreedValues_AreRank0s) {
    on_ranks(3, {1}, [](Ranks& ranks) {
        EXPECT_EQ(ranks.agree(10 + ranks.rank()), 10);
        EXPECT_EQ(agreed({1, &ranks}, 2.5 + ranks.rank()), 2.5);
        std::vector<std::byte> bytes(ranks.leads() ? 3 : 100, std::byte(ranks.rank()));
        bytes = ranks.broadcast("bytes", std::move(bytes));
        EXPECT_EQ(bytes.size(), 3U);
        EXPECT_THAT(bytes, Each(std::byte(0)));
        EXPECT_EQ(ranks.on_this_host(), 3);
        EXPECT_EQ(ranks.all_threads(), 3);
    });
    EXPECT_EQ(agreed({1}, 4), 4);
}

}  // namespace ranks_test
}  // namespace lucerna
