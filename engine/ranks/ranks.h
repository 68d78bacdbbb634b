// The ranks of a job at work on one render: what they agree on, and how they share out what can be done in
// any order.
//
// Every rank has the whole scene and runs the same code; at places that all of them pass in the same order
// they meet (the collective calls below). Work is numbered items whose results do not depend on who does
// them, nor when. Rank 0 hands the items out, a few at a time, to whoever asks: a slow node gets fewer, and
// holds nobody up. So an image has the same bits on any number of ranks and threads.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/ranks/communicator.h"
#include "engine/ranks/packing.h"

namespace lucerna {

class Ranks {
  public:
    // `threads`: of this rank. Collective.
    Ranks(std::unique_ptr<Communicator> communicator, int threads);
    ~Ranks();
    Ranks(const Ranks&) = delete;
    Ranks& operator=(const Ranks&) = delete;

    int rank() const { return communicator_->rank(); }
    int size() const { return communicator_->size(); }
    bool leads() const { return rank() == 0; }
    const std::string& host(int rank) const { return hosts_[static_cast<std::size_t>(rank)]; }
    int threads(int rank) const { return threads_[static_cast<std::size_t>(rank)]; }
    int all_threads() const { return all_threads_; }
    int on_this_host() const;  // ranks, this one among them

    // --- Where ranks meet: collective. `what` names it in the statistics.

    // Rank 0's value.
    template <typename T>
    T agree(T value) {
        static_assert(is_plain_data<T>);
        broadcast("agreement", std::as_writable_bytes(std::span(&value, 1)));
        return value;
    }
    std::vector<std::byte> broadcast(std::string_view what, std::vector<std::byte> bytes);
    // What all ranks sent, by rank.
    class Gathered {
      public:
        Gathered() = default;
        explicit Gathered(std::span<const std::size_t> sizes);
        std::span<std::byte> all() { return {bytes_.get(), size_}; }
        std::size_t size() const { return parts_.size(); }
        std::span<const std::byte> operator[](std::size_t rank) const { return parts_[rank]; }
        auto begin() const { return parts_.begin(); }
        auto end() const { return parts_.end(); }

      private:
        std::size_t size_ = 0;
        std::unique_ptr<std::byte[]> bytes_;
        std::vector<std::span<const std::byte>> parts_;
    };
    // At rank 0 alone (elsewhere it is empty), or everywhere.
    Gathered gather(std::string_view what, std::vector<std::byte> own);
    Gathered all_gather(std::string_view what, std::vector<std::byte> own);

    // Whether the user asked to stop, as it was known when ranks last met: on all of them the same.
    bool stopped() const { return stopped_; }
    // Rank 0: by whom the user asks.
    void listen_to(std::function<bool()> asked_to_stop) { asked_to_stop_ = std::move(asked_to_stop); }

    // --- Work that is shared out

    struct Loop {
        // At rank 0: items, in the order in which they are handed out; and, where items have a state, which
        // rank has it, by item (kNobody: none yet). Ranks get those that they have first.
        std::vector<std::int64_t> items = {};
        std::vector<int> holders = {};
        // In the place of `items`, on all ranks: 0 to so many, of which every rank begins with some unasked.
        std::int64_t count = 0;
        // At rank 0, from any thread: no more is handed out; and seconds after which none of what was handed
        // out is begun.
        std::function<bool()> ends = {};
        double seconds = std::numeric_limits<double>::infinity();
        // At rank 0, from any thread: so many more are done, by whomever; that rank has its state now.
        std::function<void(std::int64_t)> advance = {};
        std::function<void(std::int64_t item, int rank)> moved = {};
        // Of items with a state: it leaves this rank, it is here.
        std::function<std::vector<std::byte>(std::int64_t item)> give = {};
        std::function<void(std::int64_t item, std::vector<std::byte> state)> take = {};
        // If set, on all ranks: what an item made elsewhere goes to rank 0 as soon as it is done. There it
        // arrives from another thread; where that throws, all are asked to stop, and rank 0 throws it at the
        // end.
        std::function<std::vector<std::byte>(std::int64_t item)> made = {};
        std::function<void(std::int64_t item, int rank, std::span<const std::byte> made)> arrived = {};
        // At rank 0: a rank gets an item only when it has none, instead of some in good time. Of few and long
        // ones.
        bool one_by_one = false;
    };
    static constexpr int kNobody = -1;

    // Calls body(item) for this rank's share of the loop's items, from any of its threads. Returns those for
    // which it is true; another rank may still be at work (unless Loop::made is set), so that what the loop
    // refers to must live until ranks meet again. Collective.
    template <typename Body>
    std::vector<std::int64_t> work(const Workers& workers, Loop loop, Body&& body);
    // Meets, to learn whether the user asked to stop.
    bool agree_to_stop() {
        stopped_ = agree(leads() && asked_to_stop());
        return stopped_;
    }
    // Between two meetings, from any thread; elsewhere than at rank 0 by a message, a few times a second.
    bool asked_to_stop();
    // At rank 0, after that: of the last loop's items, how many Loop::advance was not told of.
    std::int64_t untold(std::int64_t items) const { return items - told_; }

    // What was sent and received, and how long that took, by name.
    struct Traffic {
        std::uint64_t calls = 0, bytes = 0;
        double waited = 0;   // seconds, for the last rank to come
        double seconds = 0;  // of the transfer
    };
    const std::map<std::string, Traffic, std::less<>>& traffic() const { return traffic_; }

    // Ends all ranks.
    void abort(int exit_code) { communicator_->abort(exit_code); }

  private:
    struct Item {
        std::int64_t number;
        int holder;
    };
    // What rank 0 has not handed out yet: by who has the items' state, at the end those that nobody has.
    class Queue {
      public:
        void fill(const Loop& loop, int ranks);
        std::vector<Item> take(int rank, int threads, double seconds_per_item, int all_threads);

      private:
        std::vector<std::deque<std::int64_t>> of_;
    };
    struct Request {
        std::int32_t kind;
        std::int32_t threads = 0;
        std::int64_t done = 0;  // since the last one
        double seconds = 0;     // of one item
        std::int64_t item = 0;
    };
    struct Answer {
        std::vector<Item> items;
        double seconds = 0;  // until when they may be begun
        bool one_by_one = false;
        template <typename Archive>
        void fields(Archive& archive) {
            archive(items, seconds, one_by_one);
        }
    };
    // kMade is followed by what was made.
    enum : std::int32_t { kTake, kFetch, kMade, kAskedToStop };

    // This rank's share of the items. A thread of its own asks for more before there are none.
    class Share {
      public:
        Share(Ranks& ranks, int threads);
        ~Share() { stop_asking(); }
        Share(const Share&) = delete;
        Share& operator=(const Share&) = delete;

        std::optional<std::int64_t> next();
        void done(std::int64_t item, double seconds);
        void give_up();
        std::vector<std::int64_t> finish();

      private:
        void keep_asking();
        void stop_asking();
        Request request();
        Answer asked(const Request& request);
        bool wants_more() const {
            return one_by_one_ ? items_.empty() && idle_ > 0
                               : items_.size() < static_cast<std::size_t>((threads_ + 1) / 2);
        }

        Ranks& ranks_;
        int threads_;
        std::mutex mutex_;
        std::condition_variable came_, wanted_;
        std::deque<std::int64_t> items_;
        int idle_ = 0;  // threads that wait for an item
        bool ended_ = false, given_up_ = false, one_by_one_ = false;
        std::exception_ptr failure_;                              // of asking
        double until_ = std::numeric_limits<double>::infinity();  // by clock_
        Stopwatch clock_;
        std::vector<std::int64_t> done_;
        std::size_t told_ = 0;  // of them, to rank 0
        double busy_ = 0;       // seconds, of all threads
        std::thread asker_;
    };

    void broadcast(std::string_view what, std::span<std::byte> bytes);
    std::vector<std::size_t> sizes_of_all(std::size_t own);
    void count(std::string_view what, std::size_t bytes, double waited, double seconds);
    static std::int64_t first_items(const Loop& loop);
    void begin(Loop loop);
    Answer hand_out(int rank, const Request& request);
    std::vector<std::byte> fetch(std::int64_t item, int from);
    void deliver(std::int64_t item);
    void take_delivery(std::int64_t item, int from, std::span<const std::byte> made);
    void end_deliveries();
    // Before an exception takes away what the loop refers to: others may still ask about it.
    void forget_loop();
    std::vector<std::byte> answer(int from, const Request& request, std::span<const std::byte> made);
    void serve();
    void hurry(bool leave);

    std::unique_ptr<Communicator> communicator_;
    std::vector<std::string> hosts_;
    std::vector<int> threads_;
    int all_threads_ = 1;
    std::function<bool()> asked_to_stop_;
    bool stopped_ = false;
    std::map<std::string, Traffic, std::less<>> traffic_;
    int exceptions_;  // in flight when it was made

    std::mutex mutex_;  // of what the service reads
    Loop loop_;         // until ranks meet again: others may be at work when this one has nothing left to do
    Stopwatch loop_clock_;
    Queue queue_;
    bool ended_ = false;          // nothing more is handed out
    std::int64_t told_ = 0;       // items that are done
    std::exception_ptr failure_;  // of a delivery
    std::atomic<bool> failed_{false};
    std::mutex delivering_;  // one message at a time
    std::mutex arriving_;    // while Loop::arrived runs
    std::mutex stop_mutex_;
    std::optional<Stopwatch> since_asked_;  // whether to stop
    std::atomic<bool> told_to_stop_{false};
    std::mutex hurry_mutex_;
    std::condition_variable hurry_;
    bool hurries_ = false, leaving_ = false;
    std::thread service_;
};

// A monitor whose stopped() is what all ranks agreed on; rank 0's user is told of the rest.
class RanksMonitor final : public Monitor {
  public:
    RanksMonitor(Ranks& ranks, Monitor& user) : ranks_(ranks), user_(user) {}
    void begin(std::string_view phase, std::uint64_t total) override {
        if (ranks_.leads()) user_.begin(phase, total);
    }
    void advance(std::uint64_t units) override {
        if (ranks_.leads()) user_.advance(units);
    }
    void end() override {
        if (ranks_.leads()) user_.end();
    }
    void info(std::string_view line) override {
        if (ranks_.leads()) user_.info(line);
    }
    void warn(std::string_view line) override {
        if (ranks_.leads()) user_.warn(line);
    }
    bool stopped() const override { return ranks_.stopped(); }

  private:
    Ranks& ranks_;
    Monitor& user_;
};

template <typename Body>
std::vector<std::int64_t> Ranks::work(const Workers& workers, Loop loop, Body&& body) {
    begin(std::move(loop));
    std::vector<std::int64_t> own;
    try {
        Share share(*this, workers.threads);
        parallel_chunks(workers, workers.threads, [&](std::int64_t /*thread*/) {
            try {
                while (const auto item = share.next()) {
                    const Stopwatch clock;
                    if (!body(*item)) continue;
                    const double seconds = clock.seconds();
                    if (loop_.made && !leads()) deliver(*item);
                    share.done(*item, seconds);
                }
            } catch (...) {
                share.give_up();
                throw;
            }
        });
        own = share.finish();
    } catch (...) {
        forget_loop();
        throw;
    }
    if (loop_.made) end_deliveries();
    return own;
}

// Items whose state is on one rank at a time, and goes along when another takes the item over: tiles with
// their sums. fields(item, archive) packs and unpacks a state. Calls with ranks are collective.
class ItemStates {
  public:
    // No rank has worked on any yet.
    explicit ItemStates(std::size_t items = 0)
        : holders_(items, Ranks::kNobody), is_here_(items), is_newer_(items) {}

    void begin_at_rank_0(const Ranks& ranks, std::size_t item) {
        holders_[item] = 0;
        is_here_[item] = ranks.leads();
    }
    bool is_here(std::size_t item) const { return is_here_[item] != 0; }

    // Ranks::work(), of a loop without what moves states.
    template <typename Fields, typename Body>
    std::vector<std::int64_t> work(const Workers& workers, Ranks::Loop loop, Fields&& fields, Body&& body);
    // What is newer than rank 0's goes there; who has an item keeps it.
    template <typename Fields>
    void bring_to_rank_0(Ranks& ranks, std::string_view what, Fields&& fields);

  private:
    std::vector<int> holders_;  // at rank 0
    std::vector<std::uint8_t> is_here_;
    std::vector<std::uint8_t> is_newer_;  // than what rank 0 has
};

template <typename Fields, typename Body>
std::vector<std::int64_t> ItemStates::work(const Workers& workers, Ranks::Loop loop, Fields&& fields,
                                           Body&& body) {
    Ranks& ranks = *workers.ranks;
    if (ranks.leads()) loop.holders = holders_;
    loop.moved = [this](std::int64_t item, int rank) { holders_[static_cast<std::size_t>(item)] = rank; };
    loop.give = [this, fields](std::int64_t item) {
        is_here_[static_cast<std::size_t>(item)] = 0;
        Packer packer;
        fields(item, packer);
        return packer.take();
    };
    loop.take = [this, fields](std::int64_t item, const std::vector<std::byte>& state) {
        const auto i = static_cast<std::size_t>(item);
        is_here_[i] = 1;
        if (state.empty()) return;
        is_newer_[i] = 1;
        Unpacker unpacker(state);
        fields(item, unpacker);
    };
    return ranks.work(workers, std::move(loop), [&](std::int64_t item) {
        body(item);
        is_newer_[static_cast<std::size_t>(item)] = 1;
        return true;
    });
}

template <typename Fields>
void ItemStates::bring_to_rank_0(Ranks& ranks, std::string_view what, Fields&& fields) {
    Packer packer;
    for (std::size_t i = 0; i < is_here_.size() && !ranks.leads(); ++i) {
        if (!is_here_[i] || !std::exchange(is_newer_[i], std::uint8_t{0})) continue;
        const auto item = static_cast<std::int64_t>(i);
        packer(item);
        fields(item, packer);
    }
    const auto all = ranks.gather(what, packer.take());
    for (std::size_t r = 1; r < all.size(); ++r) {
        Unpacker unpacker(all[r]);
        while (!unpacker.empty()) {
            std::int64_t item = 0;
            unpacker(item);
            fields(item, unpacker);
        }
    }
}

// What rank 0 found by a clock or of its machine, on all ranks.
template <typename T>
T agreed(const Workers& workers, T value) {
    return workers.ranks ? workers.ranks->agree(value) : value;
}

// parallel_chunks() over all ranks. What a chunk made, fields(chunk, archive) packs and unpacks: every rank
// has all of it then, or rank 0 alone. `advance(n)`: so many more chunks are done, told to rank 0; from any
// thread. False: the user stopped it, and nothing is whole.
enum class ResultsOf : std::uint8_t { everywhere, at_rank_0 };
template <typename Body, typename Fields, typename Advance>
bool shared_chunks(const Workers& workers, std::string_view what, std::int64_t chunks, ResultsOf results,
                   Body&& body, Fields&& fields, Advance&& advance) {
    if (!workers.ranks) {
        parallel_chunks(workers, chunks, [&](std::int64_t chunk) {
            body(chunk);
            advance(std::int64_t{1});
        });
        return true;
    }
    Ranks& ranks = *workers.ranks;
    Ranks::Loop loop;
    loop.count = chunks;
    if (ranks.leads()) {
        loop.ends = [&ranks] { return ranks.asked_to_stop(); };
        loop.advance = [&advance](std::int64_t n) { advance(n); };
    }
    const std::vector<std::int64_t> own = ranks.work(workers, std::move(loop), [&](std::int64_t chunk) {
        body(chunk);
        return true;
    });
    if (ranks.agree_to_stop()) return false;
    if (ranks.leads()) advance(ranks.untold(chunks));
    Packer packer;
    for (const std::int64_t chunk : own) {
        packer(chunk);
        fields(chunk, packer);
    }
    const auto all = results == ResultsOf::everywhere ? ranks.all_gather(what, packer.take())
                                                      : ranks.gather(what, packer.take());
    for (std::size_t r = 0; r < all.size(); ++r) {
        if (static_cast<int>(r) == ranks.rank()) continue;
        Unpacker unpacker(all[r]);
        while (!unpacker.empty()) {
            std::int64_t chunk = 0;
            unpacker(chunk);
            fields(chunk, unpacker);
        }
    }
    return true;
}
template <typename Body, typename Fields>
bool shared_chunks(const Workers& workers, std::string_view what, std::int64_t chunks, ResultsOf results,
                   Body&& body, Fields&& fields) {
    return shared_chunks(workers, what, chunks, results, std::forward<Body>(body),
                         std::forward<Fields>(fields), [](std::int64_t) {});
}

}  // namespace lucerna
