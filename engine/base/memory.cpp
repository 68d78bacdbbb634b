#include "engine/base/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include "engine/base/error.h"
#include "engine/base/units.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

// The first number of a file that holds nothing else; "max", and what is not there, is no limit.
std::uint64_t number_in(const std::string& file) {
    std::uint64_t number = 0;
    std::ifstream in(file);
    return in >> number ? number : kNoLimit;
}

// /proc/meminfo: "MemAvailable:   23456789 kB".
std::optional<std::uint64_t> of_the_machine() {
    std::ifstream in("/proc/meminfo");
    std::uint64_t sum = 0;
    bool known = false;
    std::string name, unit;
    for (std::uint64_t kilobytes = 0; in >> name >> kilobytes; std::getline(in, unit)) {
        if (name != "MemAvailable:" && name != "SwapFree:") continue;
        known = known || name == "MemAvailable:";
        sum += kilobytes * 1024;
    }
    return known ? std::optional(sum) : std::nullopt;
}

// Of the control group that the process sees as its root: a container's. Pages of files can be taken back,
// and do not count.
std::uint64_t of_the_group() {
    const std::string v2 = "/sys/fs/cgroup/memory.", v1 = "/sys/fs/cgroup/memory/memory.";
    std::uint64_t most = number_in(v2 + "max"), used = number_in(v2 + "current");
    std::ifstream statistics(v2 + "stat");
    if (most == kNoLimit) {
        most = number_in(v1 + "limit_in_bytes");
        used = number_in(v1 + "usage_in_bytes");
        statistics = std::ifstream(v1 + "stat");
    }
    if (most == kNoLimit || used == kNoLimit) return kNoLimit;
    std::string name;
    for (std::uint64_t bytes = 0; statistics >> name >> bytes;) {
        if (name == "inactive_file" || name == "active_file") used -= std::min(used, bytes);
    }
    return most - std::min(most, used);
}

std::uint64_t of_the_process() {
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kNoLimit;
    const std::uint64_t pages = number_in("/proc/self/statm");
    if (pages == kNoLimit) return kNoLimit;
    const std::uint64_t used = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    return limit.rlim_cur - std::min<std::uint64_t>(limit.rlim_cur, used);
}

}  // namespace

std::optional<std::uint64_t> available_memory() {
    const std::optional<std::uint64_t> machine = of_the_machine();
    const std::uint64_t least = std::min({machine.value_or(kNoLimit), of_the_group(), of_the_process()});
    return least == kNoLimit ? std::nullopt : std::optional(least);
}

void require_memory(std::uint64_t bytes, std::uint64_t available, std::string_view what,
                    std::string_view instead) {
    if (bytes <= available) return;
    throw InputError(fmt::format("{}: needs {} of memory, {} are available; {}", what,
                                 bytes_text(static_cast<double>(bytes)),
                                 bytes_text(static_cast<double>(available)), instead));
}

void require_memory(std::uint64_t bytes, std::string_view what, std::string_view instead) {
    if (const auto available = available_memory()) require_memory(bytes, *available, what, instead);
}

}  // namespace lucerna
