// The ranks of a parallel job at work together: what they agree on, and how they share work.
//
// Every rank has the whole scene and runs the same code; at the collective calls below, which all of them
// make in the same order, they meet. Work is a loop over numbered items whose results depend neither on the
// rank nor on the time at which they are made. Each rank does the items that it owns (tiles of an image,
// engine/ranks/shared_work.h), or ranks take items from a counter that all of them share, a few at a time, so
// that a slow node gets fewer and delays nobody. The image therefore has the same bits for any
// number of ranks and threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/ranks/communicator.h"
#include "engine/ranks/packing.h"

namespace lucerna {

class Ranks {
  public:
    // `threads` is the number of this rank's threads. Collective.
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
    int on_this_host() const;  // ranks, including this one

    // --- Agreement: these calls are collective. `what` names the transfer in the statistics.

    // Returns rank 0's value on all ranks.
    template <typename T>
    T agree(T value) {
        static_assert(is_plain_data<T>);
        broadcast("agreement", std::as_writable_bytes(std::span(&value, 1)));
        return value;
    }
    std::vector<std::byte> broadcast(std::string_view what, std::vector<std::byte> bytes);
    // The bytes that all ranks sent, by rank.
    struct Gathered : std::vector<std::span<const std::byte>> {
        std::unique_ptr<std::byte[]> bytes;
    };
    // Returns what all ranks sent: at rank 0 alone (empty elsewhere), or everywhere.
    Gathered gather(std::string_view what, const std::vector<std::byte>& own) {
        return join(what, own, false);
    }
    Gathered all_gather(std::string_view what, const std::vector<std::byte>& own) {
        return join(what, own, true);
    }

    // Sets how rank 0 learns that the user asks to stop; called from any thread.
    void listen_to(std::function<bool()> asked_to_stop) { asked_to_stop_ = std::move(asked_to_stop); }
    // Rank 0 asks the user, and all ranks get the answer, which stopped() repeats until they ask again.
    bool agree_to_stop() {
        stopped_ = agree(leads() && asked_to_stop());
        return stopped_;
    }
    bool stopped() const { return stopped_; }
    // Asks rank 0's user between two meetings.
    bool asked_to_stop() const { return asked_to_stop_ && asked_to_stop_(); }

    // --- Shared work

    struct Loop {
        // The items that only this rank does, and then those that any rank takes, which are the same on all
        // ranks.
        std::vector<std::int64_t> own = {}, shared = {};
        // So many seconds after the loop's beginning no rank begins another item.
        double seconds = std::numeric_limits<double>::infinity();

        // Rank 0 calls these, from any of its threads. Once `ends` returns true, no rank begins another item
        // (the others learn of it within a tenth of a second); `advance` says how many more items are done,
        // by whichever rank.
        std::function<bool()> ends = {};
        std::function<void(std::int64_t)> advance = {};

        // If `made` is set, on all ranks, its bytes go to rank 0 as soon as an item is done on another rank,
        // and rank 0 passes them to `arrived`, one at a time. If that throws, the loop ends, and work()
        // rethrows it at rank 0.
        std::function<std::vector<std::byte>(std::int64_t item)> made = {};
        std::function<void(std::int64_t item, int rank, std::span<const std::byte> made)> arrived = {};
    };

    // Calls body(item) for this rank's items, from all of its threads, and returns those for which it is
    // true. At rank 0 it returns when all ranks are done. Collective (shared_loop() serves one process, too).
    std::vector<std::int64_t> work(const Workers& workers, const Loop& loop,
                                   const std::function<bool(std::int64_t)>& body);
    // Returns whether rank 0 has ended the loop at hand, as known a tenth of a second ago. For an item that
    // takes long; from any thread.
    bool has_ended();

    // Bytes sent and received, and the time that this took.
    struct Traffic {
        std::uint64_t calls = 0, bytes = 0;
        double waited = 0;   // seconds, for the last rank to come
        double seconds = 0;  // of the transfer
    };
    const std::map<std::string, Traffic, std::less<>>& traffic() const { return traffic_; }

    // Ends all ranks.
    void abort(int exit_code) { communicator_->abort(exit_code); }

  private:
    class Share;

    void broadcast(std::string_view what, std::span<std::byte> bytes);
    Gathered join(std::string_view what, std::span<const std::byte> own, bool everywhere);
    void count(std::string_view what, std::size_t bytes, double waited, double seconds);
    void begin_loop();
    void end_loop();
    std::int64_t report_done();

    std::unique_ptr<Communicator> communicator_;
    std::vector<std::string> hosts_;
    std::vector<int> threads_;
    int all_threads_ = 1;
    std::function<bool()> asked_to_stop_;
    bool stopped_ = false;
    std::mutex traffic_mutex_;
    std::map<std::string, Traffic, std::less<>> traffic_;
    int exceptions_;  // in flight when the job was joined

    // The loop at hand. Its counters, of the items taken and done, are not those of the loop before.
    int taken_counter_ = 0, done_counter_ = 1;
    std::atomic<bool> is_in_loop_{false}, ended_{false};
    std::atomic<std::int64_t> unreported_{0};  // items that this rank has done since it last said so
    std::mutex reporting_;
    Stopwatch since_report_;  // of has_ended()
};

// A monitor whose stopped() is what all ranks agreed on, and which reports to rank 0's user.
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

// Returns rank 0's value on all ranks of a job: for what depends on a clock or on the machine.
template <typename T>
T agreed(const Workers& workers, T value) {
    return workers.ranks ? workers.ranks->agree(value) : value;
}

}  // namespace lucerna
