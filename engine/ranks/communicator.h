// The ranks of a parallel job, as MPI names them: processes of one program, on one machine or on many, that
// work together. By a library that is loaded where a job has more than one (engine/mpi/).
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lucerna {

// Every call waits without keeping a processor busy for long. What a dead rank leaves waiting the launcher
// ends.
class Communicator {
  public:
    struct Message {
        int from;
        std::vector<std::byte> bytes;
    };

    // All ranks leave together; not after abort().
    virtual ~Communicator() = default;

    virtual int rank() const = 0;
    virtual int size() const = 0;
    virtual std::string host() const = 0;  // of this rank

    // Collectives: every rank calls the same ones in the same order, each from one thread at a time.

    // Rank 0's bytes, as many on every rank.
    virtual void broadcast(std::span<std::byte> bytes) = 0;
    // `all`: of rank 0, 1, …, one after the other; sizes[r] bytes of rank r, known to all.
    virtual void all_gather(std::span<const std::byte> own, std::span<const std::size_t> sizes,
                            std::span<std::byte> all) = 0;
    // The same for rank 0 alone; elsewhere `sizes` and `all` are not looked at.
    virtual void gather(std::span<const std::byte> own, std::span<const std::size_t> sizes,
                        std::span<std::byte> all) = 0;

    // Messages of less than a gigabyte, from any thread. Those of one tag between two ranks keep their order.
    virtual void send(int to, int tag, std::span<const std::byte> bytes) = 0;
    virtual std::vector<std::byte> receive(int from, int tag) = 0;
    virtual std::optional<Message> try_receive(int tag) = 0;  // from any rank

    // Ends all ranks, this one, too.
    virtual void abort(int exit_code) = 0;
};

// Whether the launcher (mpirun, srun) has started more than one rank of this program, by the environment that
// it leaves.
bool is_parallel_job();
// Which of them this is, before it joins; 0 outside a parallel job.
int rank_by_launcher();

// How many processes srun started that know nothing of each other: without --mpi=pmix it starts a program so
// many times. 1: none beside this one.
int processes_without_mpi();

// Joins the job. Throws InputError where the library is missing or MPI cannot start.
std::unique_ptr<Communicator> join_parallel_job();

}  // namespace lucerna

// The one thing that liblucerna_mpi.so gives away. The number changes with the types above. Throws
// std::runtime_error.
extern "C" lucerna::Communicator* lucerna_mpi_1();
