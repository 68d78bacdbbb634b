// Loops that the ranks of a parallel job share, or one process does alone: over items in general, over chunks
// whose results all ranks need, and over items that keep their state on one rank. All calls with workers or
// ranks are collective.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <numeric>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/ranks/ranks.h"

namespace lucerna {

// Does Ranks::work(), or the same in this process alone.
std::vector<std::int64_t> shared_loop(const Workers& workers, const Ranks::Loop& loop,
                                      const std::function<bool(std::int64_t)>& body);

// Which ranks get results.
enum class ResultsGo : std::uint8_t { to_all_ranks, to_rank_0 };

// Copies the state of each rank's `own` items to the other ranks, or to rank 0. fields(item, archive) packs
// and unpacks a state.
template <typename Items, typename Fields>
void exchange(Ranks& ranks, std::string_view what, ResultsGo results, const Items& own, Fields&& fields) {
    Packer packer;
    for (const std::int64_t item : own) {
        if (results == ResultsGo::to_rank_0 && ranks.leads()) break;
        packer(item);
        fields(item, packer);
    }
    const auto all = results == ResultsGo::to_all_ranks ? ranks.all_gather(what, packer.take())
                                                        : ranks.gather(what, packer.take());
    for (std::size_t r = 0; r < all.size(); ++r) {
        Unpacker unpacker(all[r]);
        while (static_cast<int>(r) != ranks.rank() && !unpacker.empty())
            fields(unpacker.next<std::int64_t>(), unpacker);
    }
}

// Does what parallel_chunks() does on all ranks. fields(chunk, archive) packs and unpacks a chunk's result.
// advance(n) reports that n more chunks are done, at rank 0, from any thread. Returns false if the user
// stopped the ranks; then results are missing. In one process it returns true, and bodies ask the monitor.
template <typename Body, typename Fields, typename Advance>
bool shared_chunks(const Workers& workers, std::string_view what, std::int64_t chunks, ResultsGo results,
                   Body&& body, Fields&& fields, Advance&& advance) {
    Ranks* const ranks = workers.ranks;
    Ranks::Loop loop;
    loop.shared.resize(static_cast<std::size_t>(chunks));
    std::iota(loop.shared.begin(), loop.shared.end(), std::int64_t{0});
    if (ranks) loop.ends = [ranks] { return ranks->asked_to_stop(); };
    loop.advance = [&advance](std::int64_t n) { advance(n); };
    const auto own = shared_loop(workers, loop, [&body](std::int64_t chunk) { return body(chunk), true; });
    if (!ranks) return true;
    if (ranks->agree_to_stop()) return false;
    exchange(*ranks, what, results, own, fields);
    return true;
}
template <typename Body, typename Fields>
bool shared_chunks(const Workers& workers, std::string_view what, std::int64_t chunks, ResultsGo results,
                   Body&& body, Fields&& fields) {
    return shared_chunks(workers, what, chunks, results, std::forward<Body>(body),
                         std::forward<Fields>(fields), [](std::int64_t) {});
}

// Items with a state, such as tiles with their sums. In a loop each is worked on by the rank that owns it,
// which has the newest state; before the first loop all ranks have the same states. fields(item, archive)
// packs and unpacks a state.
class OwnedItems {
  public:
    // Deals the items to the ranks, in proportion to their threads: `cards[item]` says whose turn it is.
    OwnedItems(const Workers& workers, std::span<const std::int64_t> cards);

    bool is_own(std::int64_t item) const { return owners_[static_cast<std::size_t>(item)] == rank_; }
    std::vector<std::int64_t> own() const;
    // Calls body(item) for the items, the same on all ranks, each at its owner. Returns those that were not
    // done, on any rank, because the loop ended early. `loop` has no items.
    std::set<std::int64_t> work(const Workers& workers, std::span<const std::int64_t> items, Ranks::Loop loop,
                                const std::function<void(std::int64_t)>& body);
    // Moves items from ranks that were busier than the mean since the last call to those that were less busy,
    // where the busiest was so by a tenth: for nodes of different speed, and costs that change.
    template <typename Fields>
    void balance(Ranks& ranks, Fields&& fields);

  private:
    std::vector<std::int64_t> hand_over(const std::vector<double>& seconds);

    int rank_ = 0;
    std::vector<int> owners_;
    std::atomic<double> seconds_{0};  // of this rank's threads since the items were balanced
};

template <typename Fields>
void OwnedItems::balance(Ranks& ranks, Fields&& fields) {
    std::vector<double> seconds(static_cast<std::size_t>(ranks.size()));
    const std::int64_t here = ranks.rank();
    seconds[static_cast<std::size_t>(here)] = seconds_.exchange(0) / ranks.threads(ranks.rank());
    exchange(ranks, "balance", ResultsGo::to_all_ranks, std::span(&here, 1),
             [&](std::int64_t rank, auto& archive) { archive(seconds[static_cast<std::size_t>(rank)]); });
    // A state goes to all ranks, and its new owner takes it.
    exchange(ranks, "items moved", ResultsGo::to_all_ranks, hand_over(seconds),
             [&](std::int64_t item, auto& archive) {
                 std::vector<std::byte> state;
                 if constexpr (std::remove_reference_t<decltype(archive)>::kUnpacks) {
                     archive(state);
                     Unpacker unpacker(state);
                     if (is_own(item)) fields(item, unpacker);
                 } else {
                     Packer packer;
                     fields(item, packer);
                     archive(packer.take());
                 }
             });
}

}  // namespace lucerna
