#include "engine/base/ranks.h"

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

std::vector<std::vector<std::byte>> cut(std::span<const std::byte> all, std::span<const std::size_t> sizes) {
    std::vector<std::vector<std::byte>> parts;
    for (const std::size_t size : sizes) {
        parts.emplace_back(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(size));
        all = all.subspan(size);
    }
    return parts;
}

}  // namespace

Ranks::Ranks(std::unique_ptr<Communicator> communicator, int threads)
    : communicator_(std::move(communicator)), exceptions_(std::uncaught_exceptions()) {
    Packer own;
    own(communicator_->host(), threads);
    for (const std::vector<std::byte>& bytes : all_gather("ranks", own.take())) {
        Unpacker unpacker(bytes);
        unpacker(hosts_.emplace_back(), threads_.emplace_back());
    }
    all_threads_ = 0;
    for (const int of_rank : threads_) all_threads_ += of_rank;
    service_ = std::thread([this] { serve(); });
}

Ranks::~Ranks() {
    leaving_ = true;
    service_.join();
    // The others wait for what this rank will not do: they cannot leave together.
    if (std::uncaught_exceptions() > exceptions_) (void)communicator_.release();
}

int Ranks::on_this_host() const {
    return static_cast<int>(std::count(hosts_.begin(), hosts_.end(), host(rank())));
}

// --- Where ranks meet

Ranks::Traffic& Ranks::traffic_of(std::string_view what) {
    const auto found = traffic_.find(what);
    return found != traffic_.end() ? found->second : traffic_[std::string(what)];
}

void Ranks::broadcast(std::string_view what, std::span<std::byte> bytes) {
    const Stopwatch clock;
    communicator_->broadcast(bytes);
    Traffic& traffic = traffic_of(what);
    ++traffic.calls;
    traffic.bytes += bytes.size();
    traffic.seconds += clock.seconds();
}

std::vector<std::byte> Ranks::broadcast(std::string_view what, std::vector<std::byte> bytes) {
    bytes.resize(agree(bytes.size()));
    broadcast(what, std::span(bytes));
    return bytes;
}

std::vector<std::vector<std::byte>> Ranks::all_gather(std::string_view what, std::vector<std::byte> own) {
    const Stopwatch clock;
    const std::size_t size = own.size();
    std::vector<std::size_t> one(static_cast<std::size_t>(this->size()), sizeof size), sizes(one.size());
    communicator_->all_gather(std::as_bytes(std::span(&size, 1)), one,
                              std::as_writable_bytes(std::span(sizes)));
    const double waited = clock.seconds();
    std::size_t total = 0;
    for (const std::size_t of_rank : sizes) total += of_rank;
    std::vector<std::byte> all(total);
    communicator_->all_gather(own, sizes, all);
    Traffic& traffic = traffic_of(what);
    ++traffic.calls;
    traffic.bytes += total;
    traffic.waited += waited;
    traffic.seconds += clock.seconds() - waited;
    return cut(all, sizes);
}

std::vector<std::vector<std::byte>> Ranks::gather(std::string_view what, std::vector<std::byte> own) {
    const Stopwatch clock;
    const std::size_t size = own.size();
    std::vector<std::size_t> one(static_cast<std::size_t>(this->size()), sizeof size), sizes(one.size());
    communicator_->all_gather(std::as_bytes(std::span(&size, 1)), one,
                              std::as_writable_bytes(std::span(sizes)));
    const double waited = clock.seconds();
    std::size_t total = 0;
    for (const std::size_t of_rank : sizes) total += of_rank;
    std::vector<std::byte> all(leads() ? total : 0);
    communicator_->gather(own, sizes, all);
    Traffic& traffic = traffic_of(what);
    ++traffic.calls;
    traffic.bytes += leads() ? total : size;
    traffic.waited += waited;
    traffic.seconds += clock.seconds() - waited;
    return leads() ? cut(all, sizes) : std::vector<std::vector<std::byte>>();
}

// --- Work that is shared out

void Ranks::Queue::fill(const Loop& loop, int ranks) {
    of_.assign(static_cast<std::size_t>(ranks) + 1, {});
    for (const std::int64_t item : loop.items) {
        const int holder = loop.holders.empty() ? kNobody : loop.holders[static_cast<std::size_t>(item)];
        of_[static_cast<std::size_t>(holder == kNobody ? ranks : holder)].push_back(item);
    }
    left_ = static_cast<std::int64_t>(loop.items.size());
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
    left_ -= static_cast<std::int64_t>(count);
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
    return loop_.give(request.item);
}

void Ranks::serve() {
    constexpr std::chrono::microseconds kShortest(30), kLongest(300);
    auto pause = kShortest;
    while (!leaving_) {
        if (const auto message = communicator_->try_receive(kRequestTag)) {
            Request request{};
            Unpacker unpacker(message->bytes);
            unpacker(request);
            communicator_->send(message->from, kAnswerTag + request.kind,
                                answer(message->from, request, unpacker.left()));
            pause = kShortest;
        } else {
            std::this_thread::sleep_for(pause);
            pause = std::min(2 * pause, kLongest);
        }
    }
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
    Traffic& traffic = traffic_of("items made");
    ++traffic.calls;
    traffic.bytes += made.size();
    traffic.seconds += clock.seconds();
}

void Ranks::take_delivery(std::int64_t item, int from, std::span<const std::byte> made) {
    // The loop stays as long as one is at work who delivers.
    std::unique_lock lock(mutex_);
    const auto arrived = loop_.arrived;
    lock.unlock();
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

std::optional<std::int64_t> Ranks::Share::next() {
    std::unique_lock lock(mutex_);
    for (;;) {
        if (clock_.seconds() >= until_) {
            items_.clear();
            ended_ = true;
        }
        if (given_up_ || (ended_ && items_.empty())) return std::nullopt;
        std::optional<std::int64_t> item;
        if (!items_.empty()) {
            item = items_.front();
            items_.pop_front();
        }
        // In good time, while the others are still at work.
        const bool few = one_by_one_ ? !item && items_.empty()
                                     : items_.size() < static_cast<std::size_t>((threads_ + 1) / 2);
        if (few && !ended_ && !asking_) ask(lock);
        if (item) return item;
        if (items_.empty() && !ended_ && asking_)
            came_.wait(lock, [this] { return !items_.empty() || !asking_; });
    }
}

void Ranks::Share::ask(std::unique_lock<std::mutex>& lock) {
    Request request{kTake};
    request.threads = threads_;
    request.done = static_cast<std::int64_t>(done_.size() - told_);
    request.seconds = done_.empty() ? 0 : busy_ / static_cast<double>(done_.size());
    told_ = done_.size();
    asking_ = true;
    lock.unlock();
    Answer answer;
    try {
        answer = asked(request);
    } catch (...) {
        lock.lock();
        asking_ = false;
        given_up_ = true;
        came_.notify_all();
        throw;
    }
    lock.lock();
    asking_ = false;
    for (const Item& item : answer.items) items_.push_back(item.number);
    if (answer.items.empty()) ended_ = true;
    one_by_one_ = answer.one_by_one;
    until_ = clock_.seconds() + answer.seconds;
    came_.notify_all();
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
            Traffic& traffic = ranks_.traffic_of("moved items");
            ++traffic.calls;
            traffic.bytes += state.size();
            traffic.seconds += clock.seconds();
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
}

std::vector<std::int64_t> Ranks::Share::finish() {
    const auto left = static_cast<std::int64_t>(done_.size() - told_);
    if (ranks_.leads() && left > 0) {
        const std::lock_guard lock(ranks_.mutex_);
        ranks_.told_ += left;
        if (ranks_.loop_.advance) ranks_.loop_.advance(left);
    }
    return std::move(done_);
}

}  // namespace lucerna
