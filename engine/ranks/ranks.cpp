#include "engine/ranks/ranks.h"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <thread>

namespace lucerna {
namespace {

// Rank 0 adds this to the number of items done to end a loop. No loop has as many items.
constexpr std::int64_t kEnded = std::int64_t{1} << 40;

}  // namespace

Ranks::Ranks(std::unique_ptr<Communicator> communicator, int threads)
    : communicator_(std::move(communicator)), exceptions_(std::uncaught_exceptions()) {
    Packer own;
    own(communicator_->host(), threads);
    for (const std::span<const std::byte> bytes : all_gather("ranks", own.take())) {
        Unpacker unpacker(bytes);
        unpacker(hosts_.emplace_back(), threads_.emplace_back());
    }
    all_threads_ = 0;
    for (const int of_rank : threads_) all_threads_ += of_rank;
}

Ranks::~Ranks() {
    // After an error the other ranks wait for this one in a collective call, and cannot leave with it.
    if (std::uncaught_exceptions() > exceptions_) (void)communicator_.release();
}

int Ranks::on_this_host() const {
    return static_cast<int>(std::count(hosts_.begin(), hosts_.end(), host(rank())));
}

// --- Agreement

void Ranks::broadcast(std::string_view what, std::span<std::byte> bytes) {
    const Stopwatch clock;
    communicator_->broadcast(bytes);
    count(what, bytes.size(), 0, clock.seconds());
}

std::vector<std::byte> Ranks::broadcast(std::string_view what, std::vector<std::byte> bytes) {
    bytes.resize(agree(bytes.size()));
    broadcast(what, std::span(bytes));
    return bytes;
}

// The sizes go first, and with them all ranks wait for the last one.
Ranks::Gathered Ranks::join(std::string_view what, std::span<const std::byte> own, bool everywhere) {
    const Stopwatch clock;
    const std::size_t size_here = own.size();
    std::vector<std::size_t> sizes(static_cast<std::size_t>(size()));
    const std::vector<std::size_t> each(sizes.size(), sizeof size_here);
    communicator_->all_gather(std::as_bytes(std::span(&size_here, 1)), each,
                              std::as_writable_bytes(std::span(sizes)));
    const double waited = clock.seconds();
    Gathered all;
    std::size_t bytes = 0;
    if (everywhere || leads()) {
        bytes = std::reduce(sizes.begin(), sizes.end());
        all.bytes = std::make_unique_for_overwrite<std::byte[]>(bytes);
        const std::byte* begin = all.bytes.get();
        for (const std::size_t size : sizes) all.emplace_back(std::exchange(begin, begin + size), size);
    }
    const std::span<std::byte> to(all.bytes.get(), bytes);
    everywhere ? communicator_->all_gather(own, sizes, to) : communicator_->gather(own, sizes, to);
    count(what, all.empty() ? own.size() : bytes, waited, clock.seconds() - waited);
    return all;
}

void Ranks::count(std::string_view what, std::size_t bytes, double waited, double seconds) {
    const std::lock_guard lock(traffic_mutex_);
    Traffic& traffic = traffic_[std::string(what)];
    ++traffic.calls;
    traffic.bytes += bytes;
    traffic.waited += waited;
    traffic.seconds += seconds;
}

// --- Shared work

// A loop on one rank: the items that it does, and at rank 0 what it does beside them.
class Ranks::Share {
  public:
    Share(Ranks& ranks, const Loop& loop, int threads) : ranks_(ranks), loop_(loop), threads_(threads) {}

    // Returns the next item: one of this rank's own, then one that it takes from the counter; none if all are
    // taken, the time is up or the loop has ended.
    std::optional<std::int64_t> next() {
        const std::lock_guard lock(mutex_);
        if (failed_ || clock_.seconds() >= loop_.seconds || has_ended()) return {};
        if (next_own_ < loop_.own.size()) return loop_.own[next_own_++];
        if (next_ == end_) take();
        if (next_ == end_) return {};
        return loop_.shared[static_cast<std::size_t>(next_++)];
    }
    void done(std::int64_t item) {
        if (loop_.made && !ranks_.leads()) send_made(item);
        ++ranks_.unreported_;
        const std::lock_guard lock(mutex_);
        done_.push_back(item);
    }
    void fail() { failed_ = true; }

    // Returns the items that this rank has done; at rank 0 when all ranks are done.
    std::vector<std::int64_t> finish() {
        ranks_.is_in_loop_ = false;
        if (ranks_.leads()) {
            constexpr std::chrono::microseconds kLongest(300);
            attend([this] { return ranks_done_ + 1 == ranks_.size(); }, kLongest);
            if (failure_) std::rethrow_exception(failure_);
        } else {
            ranks_.report_done();
            ranks_.communicator_->send_to_rank_0({});  // says that this rank is done
        }
        return std::move(done_);
    }

    // Lets rank 0 report progress, end the loop and receive what others made, until `leaves` is true. Its
    // calls of the communicator let the other ranks reach the counters. It polls at once after a message,
    // then less and less often, because polling takes time of a processor that others work on.
    template <typename Leaves>
    void attend(Leaves&& leaves, std::chrono::microseconds longest) {
        constexpr std::chrono::microseconds kShortest(30);
        auto pause = kShortest;
        while (!leaves()) {
            advance();
            has_ended();
            if (const auto message = ranks_.communicator_->try_receive()) {
                message->bytes.empty() ? void(++ranks_done_) : receive(*message);
                pause = kShortest;
            } else {
                std::this_thread::sleep_for(pause);
                pause = std::min(2 * pause, longest);
            }
        }
        advance();
    }

  private:
    // Returns whether rank 0 has ended the loop; at rank 0 it asks and ends it.
    bool has_ended() {
        if (ranks_.leads() && !ranks_.ended_ && loop_.ends && loop_.ends()) ranks_.end_loop();
        return ranks_.has_ended();
    }
    // Takes a quarter of what would be this rank's share of the items that are left, so that one that is four
    // times as slow as the others is done with them [Polychronopoulos and Kuck 1987].
    void take() {
        const auto items = static_cast<std::int64_t>(loop_.shared.size());
        if (end_ == items) return;
        const std::int64_t more =
            std::max<std::int64_t>(1, (items - end_) * threads_ / (4 * ranks_.all_threads()));
        ranks_.report_done();
        if (ranks_.ended_) return;
        const std::int64_t first = ranks_.communicator_->fetch_add(ranks_.taken_counter_, more);
        next_ = std::min(first, items);
        end_ = std::min(first + more, items);
    }
    void send_made(std::int64_t item) {
        Packer packer;
        packer(item);
        const std::vector<std::byte> made = loop_.made(item);
        packer(std::span(made));
        const Stopwatch clock;
        ranks_.communicator_->send_to_rank_0(packer.take());
        ranks_.count("items made", made.size(), 0, clock.seconds());
    }
    void receive(const Communicator::Message& message) {
        if (failure_) return;
        try {
            std::int64_t item = 0;
            Unpacker unpacker(message.bytes);
            unpacker(item);
            loop_.arrived(item, message.from, unpacker.left());
        } catch (...) {
            failure_ = std::current_exception();
            ranks_.end_loop();
        }
    }
    void advance() {
        const std::int64_t done = ranks_.report_done();
        if (done > told_ && loop_.advance) loop_.advance(done - told_);
        told_ = done;
    }

    Ranks& ranks_;
    const Loop& loop_;
    int threads_;
    Stopwatch clock_;
    std::mutex mutex_;
    std::atomic<bool> failed_{false};
    std::size_t next_own_ = 0;
    std::int64_t next_ = 0, end_ = 0;  // taken and not begun: places in Loop::shared
    std::vector<std::int64_t> done_;
    // At rank 0:
    std::int64_t told_ = 0;       // items, to Loop::advance
    int ranks_done_ = 0;          // other ranks
    std::exception_ptr failure_;  // of Loop::arrived
};

std::vector<std::int64_t> Ranks::work(const Workers& workers, const Loop& loop,
                                      const std::function<bool(std::int64_t)>& body) {
    constexpr std::chrono::microseconds kLongest(500);
    begin_loop();
    Share share(*this, loop, workers.threads);
    std::exception_ptr failure;
    std::jthread attendant;
    if (leads()) {
        attendant = std::jthread([&](const std::stop_token& stop) {
            try {
                share.attend([&] { return stop.stop_requested(); }, kLongest);
            } catch (...) {
                failure = std::current_exception();
                share.fail();
            }
        });
    }
    parallel_chunks(workers, workers.threads, [&](std::int64_t /*thread*/) {
        try {
            while (const auto item = share.next())
                if (body(*item)) share.done(*item);
        } catch (...) {
            share.fail();
            throw;
        }
    });
    attendant = {};
    if (failure) std::rethrow_exception(failure);
    return share.finish();
}

// Two loops take turns with the counters: when rank 0 clears those of the last loop but one, all ranks have
// begun the last one, and none uses them any more.
void Ranks::begin_loop() {
    taken_counter_ = (taken_counter_ + 2) % Communicator::kCounters;
    done_counter_ = taken_counter_ + 1;
    if (leads()) {
        for (const int counter : {taken_counter_, done_counter_})
            communicator_->fetch_add(counter, -communicator_->fetch_add(counter, 0));
    }
    ended_ = false;
    is_in_loop_ = true;
    unreported_ = 0;
    since_report_ = {};
    all_gather("begin", {});
}

void Ranks::end_loop() {
    communicator_->fetch_add(done_counter_, kEnded);
    ended_ = true;
}

// Returns how many items all ranks have reported.
std::int64_t Ranks::report_done() {
    const std::int64_t own = unreported_.exchange(0);
    const std::int64_t all = communicator_->fetch_add(done_counter_, own) + own;
    if (all >= kEnded) ended_ = true;
    return all % kEnded;
}

bool Ranks::has_ended() {
    constexpr double kSecondsBetween = 0.1;
    if (leads() || ended_ || !is_in_loop_) return ended_;
    const std::unique_lock lock(reporting_, std::try_to_lock);
    if (!lock || since_report_.seconds() < kSecondsBetween) return ended_;
    report_done();
    since_report_ = {};
    return ended_;
}

}  // namespace lucerna
