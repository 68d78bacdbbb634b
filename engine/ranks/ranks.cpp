#include "engine/ranks/ranks.h"

#include <algorithm>
#include <chrono>
#include <exception>

namespace lucerna {
namespace {

constexpr int kRequestTag = 1, kAnswerTag = 2;  // and the request's kind: several may wait at a time

template <typename T>
std::vector<std::byte> packed(T value) {
    Packer packer;
    packer(value);
    return packer.take();
}
template <typename T>
T unpacked(std::span<const std::byte> bytes) {
    T value{};
    Unpacker unpacker(bytes);
    unpacker(value);
    return value;
}

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
    service_ = std::thread([this] { serve(); });
}

Ranks::~Ranks() {
    hurry(true);
    service_.join();
    // The others wait for what this rank will not do: they cannot leave together.
    if (std::uncaught_exceptions() > exceptions_) (void)communicator_.release();
}

int Ranks::on_this_host() const {
    return static_cast<int>(std::count(hosts_.begin(), hosts_.end(), host(rank())));
}

// --- Where ranks meet

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

Ranks::Gathered::Gathered(std::span<const std::size_t> sizes) {
    for (const std::size_t size : sizes) size_ += size;
    bytes_ = std::make_unique_for_overwrite<std::byte[]>(size_);
    const std::byte* begin = bytes_.get();
    for (const std::size_t size : sizes) {
        parts_.emplace_back(begin, size);
        begin += size;
    }
}

// The sizes go first, by which all ranks wait for the last.
Ranks::Gathered Ranks::all_gather(std::string_view what, std::vector<std::byte> own) {
    const Stopwatch clock;
    const std::vector<std::size_t> sizes = sizes_of_all(own.size());
    const double waited = clock.seconds();
    Gathered all(sizes);
    communicator_->all_gather(own, sizes, all.all());
    count(what, all.all().size(), waited, clock.seconds() - waited);
    return all;
}

Ranks::Gathered Ranks::gather(std::string_view what, std::vector<std::byte> own) {
    const Stopwatch clock;
    const std::vector<std::size_t> sizes = sizes_of_all(own.size());
    const double waited = clock.seconds();
    Gathered all = leads() ? Gathered(sizes) : Gathered();
    communicator_->gather(own, sizes, all.all());
    count(what, leads() ? all.all().size() : own.size(), waited, clock.seconds() - waited);
    return all;
}

std::vector<std::size_t> Ranks::sizes_of_all(std::size_t own) {
    std::vector<std::size_t> sizes(static_cast<std::size_t>(size()));
    const std::vector<std::size_t> each(sizes.size(), sizeof own);
    communicator_->all_gather(std::as_bytes(std::span(&own, 1)), each,
                              std::as_writable_bytes(std::span(sizes)));
    return sizes;
}

// From any thread that does not hold the mutex.
void Ranks::count(std::string_view what, std::size_t bytes, double waited, double seconds) {
    const std::lock_guard lock(mutex_);
    Traffic& traffic = traffic_[std::string(what)];
    ++traffic.calls;
    traffic.bytes += bytes;
    traffic.waited += waited;
    traffic.seconds += seconds;
}

// --- Work that is shared out

// Of a loop with a count: those with which ranks begin unasked. Half of them, so that the rest evens out how
// fast ranks are.
std::int64_t Ranks::first_items(const Loop& loop) {
    return loop.count / 2;
}

void Ranks::Queue::fill(const Loop& loop, int ranks) {
    of_.assign(static_cast<std::size_t>(ranks) + 1, {});
    for (const std::int64_t item : loop.items) {
        const int holder = loop.holders.empty() ? kNobody : loop.holders[static_cast<std::size_t>(item)];
        of_[static_cast<std::size_t>(holder == kNobody ? ranks : holder)].push_back(item);
    }
    for (std::int64_t item = first_items(loop); item < loop.count; ++item)
        of_[static_cast<std::size_t>(ranks)].push_back(item);
}

// Its own first, then what nobody has, then the last of whoever has most left. So many at a time that a rank
// asks some ten times a second, and that none has much left when the others have nothing.
std::vector<Ranks::Item> Ranks::Queue::take(int rank, int threads, double seconds_per_item, int all_threads) {
    constexpr double kSeconds = 0.1;
    const auto nobodys = of_.size() - 1;
    std::size_t from = static_cast<std::size_t>(rank);
    if (of_[from].empty()) from = nobodys;
    if (of_[from].empty()) {
        const auto more = [](const auto& a, const auto& b) { return a.size() < b.size(); };
        from = static_cast<std::size_t>(std::max_element(of_.begin(), of_.end(), more) - of_.begin());
    }
    const bool own = from == static_cast<std::size_t>(rank);
    auto& queue = of_[from];
    const double per_thread = seconds_per_item > 0 ? std::max(1.0, kSeconds / seconds_per_item) : 1.0;
    const double fair =
        0.25 * static_cast<double>(queue.size()) * (own ? 1.0 : static_cast<double>(threads) / all_threads);
    const double least = own ? threads : 1;
    const double wanted = std::min(per_thread * threads, std::max(fair, least));
    const std::size_t count = std::min(queue.size(), static_cast<std::size_t>(wanted));
    std::vector<Item> items;
    const int holder = from == nobodys ? kNobody : static_cast<int>(from);
    for (std::size_t i = 0; i < count; ++i) {
        const bool first = own || from == nobodys;
        items.push_back({first ? queue.front() : queue.back(), holder});
        first ? queue.pop_front() : queue.pop_back();
    }
    return items;
}

void Ranks::begin(Loop loop) {
    {
        const std::lock_guard lock(mutex_);
        loop_ = std::move(loop);
        loop_clock_ = {};
        ended_ = false;
        told_ = 0;
        failure_ = nullptr;
        if (leads()) queue_.fill(loop_, size());
    }
    hurry(false);
    // Nobody asks before all can answer.
    all_gather("begin", {});
}

Ranks::Answer Ranks::hand_out(int rank, const Request& request) {
    const std::lock_guard lock(mutex_);
    told_ += request.done;
    if (request.done > 0 && loop_.advance) loop_.advance(request.done);
    if (!ended_ && loop_.ends && loop_.ends()) ended_ = true;
    Answer answer;
    answer.seconds = loop_.seconds - loop_clock_.seconds();
    answer.one_by_one = loop_.one_by_one;
    if (ended_) return answer;
    const double seconds_per_item = loop_.one_by_one ? 0 : request.seconds;
    answer.items = queue_.take(rank, request.threads, seconds_per_item, all_threads_);
    if (loop_.moved) {
        for (const Item& item : answer.items) loop_.moved(item.number, rank);
    }
    return answer;
}

std::vector<std::byte> Ranks::answer(int from, const Request& request, std::span<const std::byte> made) {
    switch (request.kind) {
        case kTake:
            return packed(hand_out(from, request));
        case kAskedToStop:
            return packed(asked_to_stop());
        case kMade:
            take_delivery(request.item, from, made);
            return {};
        default:
            break;  // kFetch
    }
    const std::lock_guard lock(mutex_);
    return loop_.give ? loop_.give(request.item) : std::vector<std::byte>();
}

// Looks for messages, soon after one has come or a loop has begun, and less and less often: looking takes
// time of a processor that others work on.
void Ranks::serve() {
    constexpr std::chrono::microseconds kShortest(30), kLongest(2000);
    auto pause = kShortest;
    std::unique_lock lock(hurry_mutex_);
    while (!leaving_) {
        lock.unlock();
        const auto message = communicator_->try_receive(kRequestTag);
        if (message) {
            Request request{};
            Unpacker unpacker(message->bytes);
            unpacker(request);
            communicator_->send(message->from, kAnswerTag + request.kind,
                                answer(message->from, request, unpacker.left()));
        }
        lock.lock();
        if (message || hurry_.wait_for(lock, pause, [this] { return hurries_ || leaving_; })) {
            hurries_ = false;
            pause = kShortest;
        } else {
            pause = std::min(2 * pause, kLongest);
        }
    }
}

void Ranks::hurry(bool leave) {
    const std::lock_guard lock(hurry_mutex_);
    hurries_ = true;
    leaving_ = leave;
    hurry_.notify_all();
}

std::vector<std::byte> Ranks::fetch(std::int64_t item, int from) {
    Request request{kFetch};
    request.item = item;
    communicator_->send(from, kRequestTag, packed(request));
    return communicator_->receive(from, kAnswerTag + kFetch);
}

void Ranks::deliver(std::int64_t item) {
    Request request{kMade};
    request.item = item;
    Packer packer;
    packer(request);
    const std::vector<std::byte> made = loop_.made(item);
    packer(std::span(made));
    const std::lock_guard lock(delivering_);
    const Stopwatch clock;
    communicator_->send(0, kRequestTag, packer.take());
    communicator_->receive(0, kAnswerTag + kMade);
    count("items made", made.size(), 0, clock.seconds());
}

void Ranks::take_delivery(std::int64_t item, int from, std::span<const std::byte> made) {
    const std::lock_guard arriving(arriving_);
    std::unique_lock lock(mutex_);
    const auto arrived = loop_.arrived;
    lock.unlock();
    if (!arrived) return;
    try {
        arrived(item, from, made);
    } catch (...) {
        lock.lock();
        if (!failure_) failure_ = std::current_exception();
        failed_ = true;  // which stops the others, too
        ended_ = true;
    }
}

void Ranks::end_deliveries() {
    all_gather("end", {});
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
}

void Ranks::forget_loop() {
    const std::lock_guard arriving(arriving_);
    const std::lock_guard lock(mutex_);
    loop_ = {};
    ended_ = true;
}

bool Ranks::asked_to_stop() {
    constexpr double kSecondsBetween = 0.3;
    if (leads()) return failed_ || (asked_to_stop_ && asked_to_stop_());
    const std::unique_lock lock(stop_mutex_, std::try_to_lock);
    if (told_to_stop_ || !lock || (since_asked_ && since_asked_->seconds() < kSecondsBetween))
        return told_to_stop_;
    communicator_->send(0, kRequestTag, packed(Request{kAskedToStop}));
    told_to_stop_ = unpacked<bool>(communicator_->receive(0, kAnswerTag + kAskedToStop));
    since_asked_.emplace();
    return told_to_stop_;
}

Ranks::Share::Share(Ranks& ranks, int threads) : ranks_(ranks), threads_(threads) {
    std::int64_t before = 0;
    for (int r = 0; r < ranks.rank(); ++r) before += ranks.threads(r);
    const std::int64_t first = first_items(ranks.loop_), all = ranks.all_threads();
    const std::int64_t end = first * (before + ranks.threads(ranks.rank())) / all;
    for (std::int64_t item = first * before / all; item < end; ++item) items_.push_back(item);
    asker_ = std::thread([this] { keep_asking(); });
}

std::optional<std::int64_t> Ranks::Share::next() {
    std::unique_lock lock(mutex_);
    for (;;) {
        if (clock_.seconds() >= until_) {
            items_.clear();
            ended_ = true;
        }
        if (given_up_ || (ended_ && items_.empty())) return std::nullopt;
        if (!items_.empty()) {
            const std::int64_t item = items_.front();
            items_.pop_front();
            if (wants_more()) wanted_.notify_one();
            return item;
        }
        ++idle_;
        wanted_.notify_one();
        came_.wait(lock, [this] { return !items_.empty() || ended_ || given_up_; });
        --idle_;
    }
}

void Ranks::Share::keep_asking() {
    // With what a rank begins unasked it may be at work for long, and rank 0's user cannot wait for that.
    constexpr std::chrono::milliseconds kPatience(300);
    std::unique_lock lock(mutex_);
    for (;;) {
        const bool woken =
            wanted_.wait_for(lock, kPatience, [this] { return ended_ || given_up_ || wants_more(); });
        if (ended_ || given_up_) break;
        if (!woken) {
            if (first_items(ranks_.loop_) == 0) continue;
            lock.unlock();
            const bool stop = ranks_.asked_to_stop();
            lock.lock();
            if (!stop) continue;
            items_.clear();
            ended_ = true;
            break;
        }
        const Request what = request();
        lock.unlock();
        Answer answer;
        std::exception_ptr failure;
        try {
            answer = asked(what);
        } catch (...) {
            failure = std::current_exception();
        }
        lock.lock();
        for (const Item& item : answer.items) items_.push_back(item.number);
        if (answer.items.empty()) ended_ = true;
        one_by_one_ = answer.one_by_one;
        until_ = clock_.seconds() + answer.seconds;
        if (failure) failure_ = failure, given_up_ = true;
        came_.notify_all();
    }
    came_.notify_all();
}

void Ranks::Share::stop_asking() {
    if (!asker_.joinable()) return;
    give_up();
    asker_.join();
}

Ranks::Request Ranks::Share::request() {
    Request request{kTake};
    request.threads = threads_;
    request.done = static_cast<std::int64_t>(done_.size() - told_);
    request.seconds = done_.empty() ? 0 : busy_ / static_cast<double>(done_.size());
    told_ = done_.size();
    return request;
}

Ranks::Answer Ranks::Share::asked(const Request& request) {
    Answer answer;
    if (ranks_.leads()) {
        answer = ranks_.hand_out(0, request);
    } else {
        ranks_.communicator_->send(0, kRequestTag, packed(request));
        answer = unpacked<Answer>(ranks_.communicator_->receive(0, kAnswerTag + kTake));
    }
    if (!ranks_.loop_.take) return answer;
    // A state that is elsewhere is fetched by whoever gets the item, and is here from then on.
    for (const Item& item : answer.items) {
        const bool elsewhere = item.holder != kNobody && item.holder != ranks_.rank();
        std::vector<std::byte> state;
        if (elsewhere) {
            const Stopwatch clock;
            state = ranks_.fetch(item.number, item.holder);
            ranks_.count("moved items", state.size(), 0, clock.seconds());
        }
        ranks_.loop_.take(item.number, std::move(state));
    }
    return answer;
}

void Ranks::Share::done(std::int64_t item, double seconds) {
    const std::lock_guard lock(mutex_);
    done_.push_back(item);
    busy_ += seconds;
}

void Ranks::Share::give_up() {
    const std::lock_guard lock(mutex_);
    given_up_ = true;
    wanted_.notify_all();
    came_.notify_all();
}

std::vector<std::int64_t> Ranks::Share::finish() {
    stop_asking();
    if (failure_) std::rethrow_exception(failure_);
    const auto left = static_cast<std::int64_t>(done_.size() - told_);
    if (ranks_.leads() && left > 0) {
        const std::lock_guard lock(ranks_.mutex_);
        ranks_.told_ += left;
        if (ranks_.loop_.advance) ranks_.loop_.advance(left);
    }
    return std::move(done_);
}

}  // namespace lucerna
