// What memory there is, and a refusal before long work rather than a kill in the middle of it.
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

// Bytes that this process can still have: what the system calls available, with its swap, under the limits of
// the process and of its control groups. None where the system does not say.
std::optional<std::uint64_t> available_memory();

// Bytes that the control group of this process and those around it, up to the root, leave: the least of them
// all, of either version of control groups. Read below `root` ("/proc/self/cgroup", "/proc/self/mountinfo"
// and where that says the groups are mounted). None where no group has a limit.
std::optional<std::uint64_t> available_in_groups(const std::filesystem::path& root = "/");

// The most that this process has held; 0 where the system does not say.
std::uint64_t peak_memory();

// Of `count` things of so many bytes each; where that is more than a number holds, the largest there is.
constexpr std::uint64_t bytes_of(std::uint64_t count, std::uint64_t each) {
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
    return each != 0 && count > kMost / each ? kMost : count * each;
}

// Throws InputError "WHAT: needs 18.3 GB of memory, 12.0 GB are available; INSTEAD" if `bytes` are more than
// there are. That they are enough is no promise: others may take them. To look at what there is takes a tenth
// of a millisecond, so of less than a megabyte nobody is asked.
void require_memory(std::uint64_t bytes, std::string_view what, std::string_view instead);
// The same, of a machine that has `available` bytes.
void require_memory(std::uint64_t bytes, std::uint64_t available, std::string_view what,
                    std::string_view instead);

// For what grows by many pieces of unknown number, each of which is small: looks at what there is once for so
// many bytes.
class MemoryWatch {
  public:
    MemoryWatch(std::string what, std::string instead)
        : what_(std::move(what)), instead_(std::move(instead)) {}

    // Before `bytes` more are allocated. Throws as require_memory() does.
    void add(std::uint64_t bytes);

  private:
    static constexpr std::uint64_t kStep = std::uint64_t{64} << 20;

    std::string what_, instead_;
    std::uint64_t since_ = 0;  // bytes since the last look
};

}  // namespace lucerna
