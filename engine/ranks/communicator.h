// The ranks of a parallel job, in the sense of MPI: processes of one program, on one machine or on several,
// that work together. The implementation by MPI is a shared library (engine/mpi/), which is loaded if a job
// has more than one rank.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lucerna {

// Every call waits without keeping a processor busy for long. If a rank dies, the launcher ends those that
// wait for it.
class Communicator {
  public:
    struct Message {
        int from;
        std::vector<std::byte> bytes;
    };

    // Waits until all ranks leave, unless abort() was called.
    virtual ~Communicator() = default;

    virtual int rank() const = 0;
    virtual int size() const = 0;
    virtual std::string host() const = 0;  // of this rank

    // These calls are collective: every rank makes the same ones in the same order, each from one thread at a
    // time.

    // Copies rank 0's bytes to all ranks, which pass spans of the same size.
    virtual void broadcast(std::span<std::byte> bytes) = 0;
    // Concatenates the bytes of rank 0, 1, … in `all`, on every rank. All ranks know the sizes.
    virtual void all_gather(std::span<const std::byte> own, std::span<const std::size_t> sizes,
                            std::span<std::byte> all) = 0;
    // Does the same at rank 0 alone; the other ranks ignore `sizes` and `all`.
    virtual void gather(std::span<const std::byte> own, std::span<const std::size_t> sizes,
                        std::span<std::byte> all) = 0;

    // These calls may be made by any thread at any time.

    // Adds to one of the counters that all ranks share, and returns the value before. Counters begin at 0 and
    // are rank 0's: on another rank the call waits until rank 0 calls try_receive().
    static constexpr int kCounters = 4;
    virtual std::int64_t fetch_add(int counter, std::int64_t more) = 0;
    // Sends a message of less than a gigabyte to rank 0, and returns when rank 0 receives it.
    virtual void send_to_rank_0(std::span<const std::byte> bytes) = 0;
    // Returns the next message at rank 0, if one has come.
    virtual std::optional<Message> try_receive() = 0;

    // Ends all ranks, including this one.
    virtual void abort(int exit_code) = 0;
};

// Returns whether the launcher (mpirun, srun) has started more than one rank of this program, by the
// variables that it sets in the environment.
bool is_parallel_job();
// Returns this rank's number before it joins the job; 0 outside a parallel job.
int rank_by_launcher();

// Returns how many processes srun has started that know nothing of each other: without --mpi=pmix it starts a
// program several times. 1 means that this process is the only one, or
// that they know each other already.
int processes_without_mpi();

// Joins the job. Throws InputError if the library is missing or MPI cannot start.
std::unique_ptr<Communicator> join_parallel_job();

}  // namespace lucerna

// The only function that liblucerna_mpi.so exports. Its number changes with the types above. Throws
// std::runtime_error.
extern "C" lucerna::Communicator* lucerna_mpi_2();
