#include "engine/ranks/communicator.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string_view>

#include "engine/base/error.h"
#include "engine/system/module.h"

namespace lucerna {
namespace {

// Returns 0 if the variable is not set or is no number.
int number_in_environment(const char* name) {
    const char* const text = std::getenv(name);
    if (!text) return 0;
    const std::string_view word(text);
    int number = 0;
    std::from_chars(word.data(), word.data() + word.size(), number);
    return number;
}

}  // namespace

bool is_parallel_job() {
    // mpirun goes first: within a Slurm job Slurm's variables may count mpirun's own daemons.
    if (number_in_environment("OMPI_COMM_WORLD_SIZE") > 0)
        return number_in_environment("OMPI_COMM_WORLD_SIZE") > 1;
    return std::getenv("PMIX_RANK") != nullptr && number_in_environment("SLURM_STEP_NUM_TASKS") > 1;
}

int rank_by_launcher() {
    if (!is_parallel_job()) return 0;
    return number_in_environment(std::getenv("OMPI_COMM_WORLD_RANK") ? "OMPI_COMM_WORLD_RANK" : "PMIX_RANK");
}

int processes_without_mpi() {
    for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"}) {
        if (std::getenv(name)) return 1;
    }
    return std::max(1, number_in_environment("SLURM_STEP_NUM_TASKS"));
}

std::unique_ptr<Communicator> join_parallel_job() {
    const Module module{"liblucerna_mpi.so", "lucerna_mpi_2", "several ranks need"};
    const auto join = reinterpret_cast<decltype(&lucerna_mpi_2)>(load_module(module, {"mpi"}));
    try {
        return std::unique_ptr<Communicator>(join());
    } catch (const std::runtime_error& error) {
        throw InputError({"mpi"}, error.what());
    }
}

}  // namespace lucerna
