// Runs the ranks of a job as threads of one process, for tests of the communication between ranks.
#pragma once

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "engine/ranks/ranks.h"

namespace lucerna {
namespace testing {

// The state that the ranks share.
class ThreadHub {
  public:
    explicit ThreadHub(int size) : size_(size), parts_(static_cast<std::size_t>(size)) {}
    int size() const { return size_; }

    // Waits for all ranks and returns the bytes of each.
    std::vector<std::vector<std::byte>> exchange(int rank, std::span<const std::byte> own) {
        std::unique_lock lock(mutex_);
        parts_[static_cast<std::size_t>(rank)].assign(own.begin(), own.end());
        meet(lock);
        std::vector<std::vector<std::byte>> all = parts_;
        meet(lock);  // no rank writes before all have read
        return all;
    }
    void send_to_rank_0(int from, std::span<const std::byte> bytes) {
        std::unique_lock lock(mutex_);
        messages_.push_back({from, {bytes.begin(), bytes.end()}});
        for (const std::int64_t number = ++sent_; received_ < number;) wait(lock);
    }
    std::optional<Communicator::Message> try_receive() {
        const std::lock_guard lock(mutex_);
        require_all();
        if (messages_.empty()) return std::nullopt;
        Communicator::Message message = std::move(messages_.front());
        messages_.pop_front();
        ++received_;
        changed_.notify_all();
        return message;
    }
    std::int64_t fetch_add(int counter, std::int64_t more) {
        const std::lock_guard lock(mutex_);
        require_all();
        std::int64_t& number = counters_[static_cast<std::size_t>(counter)];
        return std::exchange(number, number + more);
    }
    // Makes the calls of all other ranks throw.
    void fail() {
        const std::lock_guard lock(mutex_);
        failed_ = true;
        changed_.notify_all();
    }

  private:
    void meet(std::unique_lock<std::mutex>& lock) {
        const int turn = turn_;
        if (++there_ == size_) {
            there_ = 0;
            ++turn_;
            changed_.notify_all();
            return;
        }
        while (turn == turn_) wait(lock);
    }
    void wait(std::unique_lock<std::mutex>& lock) {
        require_all();
        changed_.wait(lock);
        require_all();
    }
    void require_all() const {
        if (failed_) throw std::runtime_error("another rank has failed");
    }

    int size_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::vector<std::byte>> parts_;
    int there_ = 0, turn_ = 0;
    std::deque<Communicator::Message> messages_;  // to rank 0
    std::int64_t sent_ = 0, received_ = 0;
    std::array<std::int64_t, Communicator::kCounters> counters_{};
    bool failed_ = false;
};

class ThreadCommunicator final : public Communicator {
  public:
    ThreadCommunicator(ThreadHub& hub, int rank) : hub_(hub), rank_(rank) {}

    int rank() const override { return rank_; }
    int size() const override { return hub_.size(); }
    std::string host() const override { return "here"; }
    void broadcast(std::span<std::byte> bytes) override {
        const auto all = hub_.exchange(rank_, bytes);
        std::copy(all[0].begin(), all[0].end(), bytes.begin());
    }
    void all_gather(std::span<const std::byte> own, std::span<const std::size_t> sizes,
                    std::span<std::byte> all) override {
        const auto parts = hub_.exchange(rank_, own);
        for (std::size_t r = 0; r < parts.size(); ++r) {
            if (parts[r].size() != sizes[r]) throw std::logic_error("a rank sends another size than it said");
            std::copy(parts[r].begin(), parts[r].end(), all.begin());
            all = all.subspan(sizes[r]);
        }
    }
    void gather(std::span<const std::byte> own, std::span<const std::size_t> sizes,
                std::span<std::byte> all) override {
        const auto parts = hub_.exchange(rank_, own);
        for (std::size_t r = 0; rank_ == 0 && r < parts.size(); ++r) {
            std::copy(parts[r].begin(), parts[r].end(), all.begin());
            all = all.subspan(sizes[r]);
        }
    }
    std::int64_t fetch_add(int counter, std::int64_t more) override { return hub_.fetch_add(counter, more); }
    void send_to_rank_0(std::span<const std::byte> bytes) override { hub_.send_to_rank_0(rank_, bytes); }
    std::optional<Message> try_receive() override { return hub_.try_receive(); }
    void abort(int /*exit_code*/) override { hub_.fail(); }

  private:
    ThreadHub& hub_;
    int rank_;
};

// Calls body(ranks) on `size` ranks at once. Rank r has threads[r] threads, or the last number for ranks
// beyond the list. Rethrows the first exception that a rank threw.
inline void on_ranks(int size, std::vector<int> threads, const std::function<void(Ranks&)>& body) {
    ThreadHub hub(size);
    std::mutex mutex;
    std::exception_ptr failure;
    std::vector<std::thread> ranks;
    for (int r = 0; r < size; ++r) {
        ranks.emplace_back([&, r] {
            try {
                const int own = threads[std::min(static_cast<std::size_t>(r), threads.size() - 1)];
                Ranks rank(std::make_unique<ThreadCommunicator>(hub, r), own);
                body(rank);
            } catch (const Stopped&) {  // all ranks stop: another may still wait in exchange()
                const std::lock_guard lock(mutex);
                if (!failure) failure = std::current_exception();
            } catch (...) {
                const std::lock_guard lock(mutex);
                if (!failure) failure = std::current_exception();
                hub.fail();
            }
        });
    }
    for (std::thread& rank : ranks) rank.join();
    if (failure) std::rethrow_exception(failure);
}

}  // namespace testing
}  // namespace lucerna
