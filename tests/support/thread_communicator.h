// The ranks of a job as threads of one process: for tests of what ranks do together.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <map>
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

// What they share.
class ThreadHub {
  public:
    explicit ThreadHub(int size) : size_(size), parts_(static_cast<std::size_t>(size)) {}
    int size() const { return size_; }

    // All ranks' bytes, once all are there.
    std::vector<std::vector<std::byte>> exchange(int rank, std::span<const std::byte> own) {
        std::unique_lock lock(mutex_);
        parts_[static_cast<std::size_t>(rank)].assign(own.begin(), own.end());
        meet(lock);
        std::vector<std::vector<std::byte>> all = parts_;
        meet(lock);  // nobody writes before all have read
        return all;
    }
    void send(int from, int to, int tag, std::span<const std::byte> bytes) {
        const std::lock_guard lock(mutex_);
        boxes_[{to, tag}].push_back({from, {bytes.begin(), bytes.end()}});
        changed_.notify_all();
    }
    std::vector<std::byte> receive(int at, int from, int tag) {
        std::unique_lock lock(mutex_);
        for (;;) {
            auto& box = boxes_[{at, tag}];
            const auto found =
                std::find_if(box.begin(), box.end(), [&](const auto& m) { return m.from == from; });
            if (found != box.end()) {
                std::vector<std::byte> bytes = std::move(found->bytes);
                box.erase(found);
                return bytes;
            }
            wait(lock);
        }
    }
    std::optional<Communicator::Message> try_receive(int at, int tag) {
        const std::lock_guard lock(mutex_);
        auto& box = boxes_[{at, tag}];
        if (box.empty()) return std::nullopt;
        Communicator::Message message = std::move(box.front());
        box.pop_front();
        return message;
    }
    // Nobody is waited for any more.
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
        if (failed_) throw std::runtime_error("another rank has failed");
        changed_.wait(lock);
        if (failed_) throw std::runtime_error("another rank has failed");
    }

    int size_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::vector<std::byte>> parts_;
    int there_ = 0, turn_ = 0;
    std::map<std::pair<int, int>, std::deque<Communicator::Message>> boxes_;
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
    void send(int to, int tag, std::span<const std::byte> bytes) override {
        hub_.send(rank_, to, tag, bytes);
    }
    std::vector<std::byte> receive(int from, int tag) override { return hub_.receive(rank_, from, tag); }
    std::optional<Message> try_receive(int tag) override { return hub_.try_receive(rank_, tag); }
    void abort(int /*exit_code*/) override { hub_.fail(); }

  private:
    ThreadHub& hub_;
    int rank_;
};

// Calls body(ranks) on so many ranks at once, each with its own number of threads (`threads` of rank r, the
// last for all others). Rethrows what the first rank threw that failed by itself.
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
            } catch (const Stopped&) {  // by all of them: another may still be where they meet
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
