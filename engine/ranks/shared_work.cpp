#include "engine/ranks/shared_work.h"

#include <iterator>

namespace lucerna {

std::vector<std::int64_t> shared_loop(const Workers& workers, const Ranks::Loop& loop,
                                      const std::function<bool(std::int64_t)>& body) {
    if (workers.ranks) return workers.ranks->work(workers, loop, body);
    std::vector<std::int64_t> items = loop.own, done;
    items.insert(items.end(), loop.shared.begin(), loop.shared.end());
    std::vector<std::uint8_t> is_done(items.size());
    std::atomic<bool> has_ended{false};
    const Stopwatch clock;
    parallel_chunks(workers, static_cast<std::int64_t>(items.size()), [&](std::int64_t chunk) {
        const auto i = static_cast<std::size_t>(chunk);
        if (has_ended || clock.seconds() >= loop.seconds || (loop.ends && loop.ends())) {
            has_ended = true;
        } else if (body(items[i])) {
            is_done[i] = 1;
            if (loop.advance) loop.advance(1);
        }
    });
    for (std::size_t i = 0; i < items.size(); ++i)
        if (is_done[i]) done.push_back(items[i]);
    return done;
}

OwnedItems::OwnedItems(const Workers& workers, std::span<const std::int64_t> cards) : owners_(cards.size()) {
    if (!workers.ranks) return;
    const Ranks& ranks = *workers.ranks;
    rank_ = ranks.rank();
    std::vector<int> rank_of_thread;
    for (int r = 0; r < ranks.size(); ++r)
        rank_of_thread.insert(rank_of_thread.end(), static_cast<std::size_t>(ranks.threads(r)), r);
    for (std::size_t i = 0; i < cards.size(); ++i)
        owners_[i] = rank_of_thread[static_cast<std::size_t>(cards[i]) % rank_of_thread.size()];
}

std::vector<std::int64_t> OwnedItems::own() const {
    std::vector<std::int64_t> items;
    for (std::size_t i = 0; i < owners_.size(); ++i)
        if (owners_[i] == rank_) items.push_back(static_cast<std::int64_t>(i));
    return items;
}

std::set<std::int64_t> OwnedItems::work(const Workers& workers, std::span<const std::int64_t> items,
                                        Ranks::Loop loop, const std::function<void(std::int64_t)>& body) {
    std::ranges::copy_if(items, std::back_inserter(loop.own),
                         [this](std::int64_t item) { return is_own(item); });
    std::set<std::int64_t> left(loop.own.begin(), loop.own.end());
    for (const std::int64_t done : shared_loop(workers, loop, [&](std::int64_t item) {
             const Stopwatch clock;
             body(item);
             seconds_ += clock.seconds();
             return true;
         }))
        left.erase(done);
    if (workers.ranks) {
        exchange(*workers.ranks, "items left", ResultsGo::to_all_ranks, std::set(left),
                 [&left](std::int64_t item, auto&) { left.insert(item); });
    }
    return left;
}

// Sets the new owners, on all ranks alike, and returns the items that this rank hands over. A rank's items
// count as equally costly; each rank keeps one at least.
std::vector<std::int64_t> OwnedItems::hand_over(const std::vector<double>& seconds) {
    std::vector<std::int64_t> handed_over;
    const double mean = std::reduce(seconds.begin(), seconds.end()) / static_cast<double>(seconds.size());
    if (*std::ranges::max_element(seconds) <= 1.1 * mean) return handed_over;
    std::vector<std::vector<std::size_t>> items(seconds.size());
    for (std::size_t i = 0; i < owners_.size(); ++i) items[static_cast<std::size_t>(owners_[i])].push_back(i);
    std::size_t to = 0;
    double room = mean - seconds[0];  // seconds that `to` has left
    for (std::size_t from = 0; from < seconds.size(); ++from) {
        const std::size_t all = items[from].size();
        if (seconds[from] <= mean || all == 0) continue;
        const double each = seconds[from] / static_cast<double>(all);
        const auto count = std::min(all - 1, static_cast<std::size_t>((seconds[from] - mean) / each));
        // Every so many of them, because neighbours cost alike.
        for (std::size_t i = 0; i < count; ++i) {
            while (room < 0.5 * each) {
                if (++to == seconds.size()) return handed_over;
                room = mean - seconds[to];
            }
            const std::size_t item = items[from][i * all / count];
            owners_[item] = static_cast<int>(to);
            room -= each;
            if (static_cast<int>(from) == rank_) handed_over.push_back(static_cast<std::int64_t>(item));
        }
    }
    return handed_over;
}

}  // namespace lucerna
