// Implements Communicator by MPI. Every call starts a nonblocking operation and polls it with sleeps in
// between: a blocking call of MPI keeps a processor busy, which other ranks of the machine and other threads
// of this rank need.
#include <fmt/format.h>
#include <mpi.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "engine/ranks/communicator.h"

namespace lucerna {
namespace {

// MPI counts in int; larger transfers are made in pieces of this size.
constexpr std::size_t kMostBytes = std::size_t{1} << 30;

// The tags of what goes from one rank to another.
constexpr int kMessageTag = 1, kGatherTag = 2, kFetchTag = 3, kFetchedTag = 4;

void check(int code, const char* what) {
    if (code == MPI_SUCCESS) return;
    char text[MPI_MAX_ERROR_STRING] = {};
    int length = 0;
    MPI_Error_string(code, text, &length);
    throw std::runtime_error(
        fmt::format("{}: {}", what, std::string(text, static_cast<std::size_t>(length))));
}

// Polls without a pause for the first millisecond, then with pauses that grow to 0.3 ms.
void wait_for(MPI_Request& request, const char* what) {
    constexpr std::chrono::microseconds kWithoutPause(1000), kLongest(300);
    const auto begin = std::chrono::steady_clock::now();
    std::chrono::microseconds pause(20);
    for (;;) {
        int done = 0;
        check(MPI_Test(&request, &done, MPI_STATUS_IGNORE), what);
        if (done != 0) return;
        if (std::chrono::steady_clock::now() - begin < kWithoutPause) {
            std::this_thread::yield();
        } else {
            std::this_thread::sleep_for(pause);
            pause = std::min(2 * pause, kLongest);
        }
    }
}

int count_of(std::size_t bytes) {
    return static_cast<int>(bytes);
}

class OpenMpi final : public Communicator {
  public:
    OpenMpi() {
        int provided = 0;
        check(MPI_Init_thread(nullptr, nullptr, MPI_THREAD_MULTIPLE, &provided), "MPI_Init_thread");
        if (provided < MPI_THREAD_MULTIPLE) {
            MPI_Finalize();
            throw std::runtime_error("this MPI does not let several threads call it (MPI_THREAD_MULTIPLE)");
        }
        check(MPI_Comm_dup(MPI_COMM_WORLD, &collectives_), "MPI_Comm_dup");
        check(MPI_Comm_dup(MPI_COMM_WORLD, &messages_), "MPI_Comm_dup");
        MPI_Comm_set_errhandler(collectives_, MPI_ERRORS_RETURN);
        MPI_Comm_set_errhandler(messages_, MPI_ERRORS_RETURN);
        MPI_Comm_rank(collectives_, &rank_);
        MPI_Comm_size(collectives_, &size_);
    }
    ~OpenMpi() override {
        MPI_Comm_free(&messages_);
        MPI_Comm_free(&collectives_);
        MPI_Finalize();
    }
    OpenMpi(const OpenMpi&) = delete;
    OpenMpi& operator=(const OpenMpi&) = delete;

    int rank() const override { return rank_; }
    int size() const override { return size_; }
    std::string host() const override {
        char name[MPI_MAX_PROCESSOR_NAME] = {};
        int length = 0;
        MPI_Get_processor_name(name, &length);
        return {name, static_cast<std::size_t>(length)};
    }

    void broadcast(std::span<std::byte> bytes) override { broadcast_from(0, bytes); }

    void all_gather(std::span<const std::byte> own, std::span<const std::size_t> sizes,
                    std::span<std::byte> all) override {
        if (all.size() > kMostBytes) {
            for (int r = 0; r < size_; ++r) {
                const auto part = all.first(sizes[static_cast<std::size_t>(r)]);
                if (r == rank_) std::copy(own.begin(), own.end(), part.begin());
                broadcast_from(r, part);
                all = all.subspan(part.size());
            }
            return;
        }
        std::vector<int> counts, begins;
        std::size_t begin = 0;
        for (const std::size_t size : sizes) {
            counts.push_back(count_of(size));
            begins.push_back(count_of(begin));
            begin += size;
        }
        MPI_Request request{};
        check(MPI_Iallgatherv(own.data(), count_of(own.size()), MPI_BYTE, all.data(), counts.data(),
                              begins.data(), MPI_BYTE, collectives_, &request),
              "MPI_Iallgatherv");
        wait_for(request, "MPI_Iallgatherv");
    }

    void gather(std::span<const std::byte> own, std::span<const std::size_t> sizes,
                std::span<std::byte> all) override {
        if (rank_ != 0) return send_in_pieces(own);
        for (int r = 0; r < size_; ++r) {
            const auto part = all.first(sizes[static_cast<std::size_t>(r)]);
            if (r == 0) {
                std::copy(own.begin(), own.end(), part.begin());
            } else {
                receive_in_pieces(r, part);
            }
            all = all.subspan(part.size());
        }
    }

    // Rank 0 serves the counters by messages: over TCP Open MPI 4.1 has no windows (MPI_Win_allocate), and a
    // passive target would have to call MPI, too.
    std::int64_t fetch_add(int counter, std::int64_t more) override {
        if (rank_ == 0) return counters_[static_cast<std::size_t>(counter)].fetch_add(more);
        const std::lock_guard lock(fetching_);
        const Fetch fetch{counter, more};
        std::int64_t before = 0;
        MPI_Request request{}, answer{};
        check(MPI_Irecv(&before, sizeof before, MPI_BYTE, 0, kFetchedTag, messages_, &answer), "MPI_Irecv");
        check(MPI_Isend(&fetch, sizeof fetch, MPI_BYTE, 0, kFetchTag, messages_, &request), "MPI_Isend");
        wait_for(request, "MPI_Isend");
        wait_for(answer, "MPI_Irecv");
        return before;
    }

    void send_to_rank_0(std::span<const std::byte> bytes) override {
        MPI_Request request{};
        check(MPI_Issend(bytes.data(), count_of(bytes.size()), MPI_BYTE, 0, kMessageTag, messages_, &request),
              "MPI_Issend");
        wait_for(request, "MPI_Issend");
    }
    std::optional<Message> try_receive() override {
        while (const auto request = try_receive(kFetchTag)) {
            Fetch fetch{};
            std::memcpy(&fetch, request->bytes.data(), sizeof fetch);
            const std::int64_t before = fetch_add(static_cast<int>(fetch.counter), fetch.more);
            MPI_Request answer{};
            check(MPI_Isend(&before, sizeof before, MPI_BYTE, request->from, kFetchedTag, messages_, &answer),
                  "MPI_Isend");
            wait_for(answer, "MPI_Isend");
        }
        return try_receive(kMessageTag);
    }

    void abort(int exit_code) override {
        MPI_Abort(MPI_COMM_WORLD, exit_code);
        std::abort();  // MPI_Abort does not return, but is not declared so.
    }

  private:
    void broadcast_from(int root, std::span<std::byte> bytes) {
        while (!bytes.empty()) {
            const auto piece = bytes.first(std::min(bytes.size(), kMostBytes));
            MPI_Request request{};
            check(MPI_Ibcast(piece.data(), count_of(piece.size()), MPI_BYTE, root, collectives_, &request),
                  "MPI_Ibcast");
            wait_for(request, "MPI_Ibcast");
            bytes = bytes.subspan(piece.size());
        }
    }

    void send_in_pieces(std::span<const std::byte> bytes) {
        while (!bytes.empty()) {
            const auto piece = bytes.first(std::min(bytes.size(), kMostBytes));
            MPI_Request request{};
            check(MPI_Isend(piece.data(), count_of(piece.size()), MPI_BYTE, 0, kGatherTag, collectives_,
                            &request),
                  "MPI_Isend");
            wait_for(request, "MPI_Isend");
            bytes = bytes.subspan(piece.size());
        }
    }
    void receive_in_pieces(int from, std::span<std::byte> bytes) {
        while (!bytes.empty()) {
            const auto piece = bytes.first(std::min(bytes.size(), kMostBytes));
            MPI_Request request{};
            check(MPI_Irecv(piece.data(), count_of(piece.size()), MPI_BYTE, from, kGatherTag, collectives_,
                            &request),
                  "MPI_Irecv");
            wait_for(request, "MPI_Irecv");
            bytes = bytes.subspan(piece.size());
        }
    }

    std::optional<Message> try_receive(int tag) {
        int there = 0;
        MPI_Message message{};
        MPI_Status status{};
        check(MPI_Improbe(MPI_ANY_SOURCE, tag, messages_, &there, &message, &status), "MPI_Improbe");
        if (there == 0) return std::nullopt;
        int count = 0;
        MPI_Get_count(&status, MPI_BYTE, &count);
        Message received{status.MPI_SOURCE, std::vector<std::byte>(static_cast<std::size_t>(count))};
        MPI_Request request{};
        check(MPI_Imrecv(received.bytes.data(), count, MPI_BYTE, &message, &request), "MPI_Imrecv");
        wait_for(request, "MPI_Imrecv");
        return received;
    }

    struct Fetch {
        std::int64_t counter, more;
    };

    int rank_ = 0, size_ = 1;
    MPI_Comm collectives_ = MPI_COMM_NULL, messages_ = MPI_COMM_NULL;
    std::array<std::atomic<std::int64_t>, kCounters> counters_{};  // at rank 0
    std::mutex fetching_;                                          // one answer at a time
};

}  // namespace
}  // namespace lucerna

extern "C" lucerna::Communicator* lucerna_mpi_2() {
    return new lucerna::OpenMpi();
}
