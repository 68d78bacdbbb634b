// Measures the available memory, so that work that needs more is refused before it begins instead of killed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lucerna {

// Returns the bytes that this process can still allocate: what the system calls available, including swap,
// within the limits of the process and of its control groups. None if the system does not say.
std::optional<std::uint64_t> available_memory();

// Returns the least number of bytes that the control group of this process or one around it leaves, in either
// version of control groups. It reads below `root`: "/proc/self/cgroup", "/proc/self/mountinfo", and the
// folders in which that says the groups are mounted. None if no group has a limit.
std::optional<std::uint64_t> available_in_groups(const std::filesystem::path& root = "/");

// Returns the peak memory of this process in bytes, or 0 if the system does not say.
std::uint64_t peak_memory();

// Returns count * each, or the largest number if that overflows.
constexpr std::uint64_t bytes_of(std::uint64_t count, std::uint64_t each) {
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
    return each != 0 && count > kMost / each ? kMost : count * each;
}

// Throws InputError "WHAT: needs 18.3 GB of memory, 12.0 GB are available; INSTEAD" if more `bytes` are
// needed than are available. Other processes may still take them before they are allocated. The check takes a
// tenth of a millisecond, so less than a mebibyte is not checked.
void require_memory(std::uint64_t bytes, std::string_view what, std::string_view instead);
// Checks against a given number of available bytes.
void require_memory(std::uint64_t bytes, std::uint64_t available, std::string_view what,
                    std::string_view instead);

// Throws InputError if the limit of the process's address space does not leave enough for the stacks of so
// many threads and what they allocate at first (128 MiB). Libraries that fail to start threads may end the
// process.
void require_threads(int count);

// Checks the memory for data that grow by an unknown number of small pieces: once for every kStep bytes.
class MemoryWatch {
  public:
    MemoryWatch(std::string what, std::string instead)
        : what_(std::move(what)), instead_(std::move(instead)) {}

    // Is called before `bytes` more are allocated. Throws as require_memory() does.
    void add(std::uint64_t bytes);

  private:
    static constexpr std::uint64_t kStep = std::uint64_t{64} << 20;

    std::string what_, instead_;
    std::uint64_t since_ = 0;  // bytes since the last check
};

}  // namespace lucerna
