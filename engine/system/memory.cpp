#include "engine/system/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

#include "engine/base/error.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

// Returns the number that a file consists of. "max" and a missing file mean that there is no limit.
std::uint64_t number_in(const std::filesystem::path& file) {
    std::uint64_t number = 0;
    std::ifstream in(file);
    return in >> number ? number : kNoLimit;
}

// Reads /proc/meminfo: "MemAvailable:   23456789 kB".
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

// --- control groups ---

// Lists the names of files and statistics in the two versions. A group's numbers include those of the groups
// within it. In version 2 its statistics do so, too; version 1 has separate names ("total_...") for that.
struct GroupFiles {
    const char *most, *used, *inactive, *active;
};
constexpr GroupFiles kVersion1{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file",
                               "total_active_file"};
constexpr GroupFiles kVersion2{"memory.max", "memory.current", "inactive_file", "active_file"};

// Returns the bytes that one group leaves. Cached pages of files can be reclaimed and do not count as used.
std::uint64_t left_in(const std::filesystem::path& folder, const GroupFiles& files) {
    const std::uint64_t most = number_in(folder / files.most);
    std::uint64_t used = number_in(folder / files.used);
    if (most == kNoLimit || used == kNoLimit) return kNoLimit;
    std::ifstream statistics(folder / "memory.stat");
    std::string name;
    for (std::uint64_t bytes = 0; statistics >> name >> bytes;) {
        if (name == files.inactive || name == files.active) used -= std::min(used, bytes);
    }
    return most - std::min(most, used);
}

bool has_word(const std::string& list, std::string_view word) {
    std::istringstream words(list);
    for (std::string one; std::getline(words, one, ',');) {
        if (one == word) return true;
    }
    return false;
}

// Describes a tree of groups: where it is mounted, and which of its groups is visible there.
struct Mount {
    std::filesystem::path folder, group;
    bool version2;
};

// Reads /proc/self/mountinfo: "29 23 0:26 /GROUP /FOLDER rw,… shared:4 - cgroup2 cgroup rw,…". For
// version 1 it takes the tree that limits memory.
std::vector<Mount> group_mounts(const std::filesystem::path& root) {
    std::vector<Mount> mounts;
    std::ifstream in(root / "proc/self/mountinfo");
    for (std::string line; std::getline(in, line);) {
        const std::size_t middle = line.find(" - ");
        if (middle == line.npos) continue;
        std::istringstream left(line.substr(0, middle)), right(line.substr(middle + 3));
        std::string id, parent, device, group, folder, kind, source, options;
        left >> id >> parent >> device >> group >> folder;
        right >> kind >> source >> options;
        const bool version2 = kind == "cgroup2";
        if (folder.empty() || (!version2 && (kind != "cgroup" || !has_word(options, "memory")))) continue;
        mounts.push_back({root / std::filesystem::path(folder).relative_path(), group, version2});
    }
    return mounts;
}

// Reads /proc/self/cgroup: "0::/GROUP" in version 2, "7:cpu,memory:/GROUP" in version 1.
std::optional<std::filesystem::path> own_group(const std::filesystem::path& root, bool version2) {
    std::ifstream in(root / "proc/self/cgroup");
    for (std::string line; std::getline(in, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (first == line.npos || second == line.npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        if (version2 ? controllers.empty() : has_word(controllers, "memory"))
            return std::filesystem::path(line.substr(second + 1));
    }
    return std::nullopt;
}

// Returns the least of what the process's group and those around it leave, up to the mounted one. A container
// sees no more.
std::uint64_t left_up_to_the_mount(const Mount& mount, const std::filesystem::path& own) {
    const std::filesystem::path below = own.lexically_relative(mount.group);
    const GroupFiles& files = mount.version2 ? kVersion2 : kVersion1;
    std::filesystem::path folder = mount.folder;
    std::uint64_t least = left_in(folder, files);
    for (const std::filesystem::path& part : below) {
        if (part == "." || part == "..") continue;  // the group itself, or one outside the mount
        folder /= part;
        least = std::min(least, left_in(folder, files));
    }
    return least;
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

std::optional<std::uint64_t> available_in_groups(const std::filesystem::path& root) {
    std::uint64_t least = kNoLimit;
    for (const Mount& mount : group_mounts(root)) {
        const auto own = own_group(root, mount.version2);
        least = std::min(least, left_up_to_the_mount(mount, own.value_or(mount.group)));
    }
    return least == kNoLimit ? std::nullopt : std::optional(least);
}

// Linux reports KiB.
std::uint64_t peak_memory() {
    rusage usage{};
    if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::optional<std::uint64_t> available_memory() {
    const std::optional<std::uint64_t> machine = of_the_machine(), groups = available_in_groups();
    const std::uint64_t least =
        std::min({machine.value_or(kNoLimit), groups.value_or(kNoLimit), of_the_process()});
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
    if (bytes < 1 << 20) return;
    if (const auto available = available_memory()) require_memory(bytes, *available, what, instead);
}

void require_threads(int count) {
    constexpr std::uint64_t kAtFirst = std::uint64_t{128} << 20, kLeastStack = std::uint64_t{2} << 20;
    rlimit stack{};
    const bool is_known = getrlimit(RLIMIT_STACK, &stack) == 0 && stack.rlim_cur != RLIM_INFINITY;
    const std::uint64_t each = is_known ? std::max<std::uint64_t>(stack.rlim_cur, kLeastStack) : kLeastStack;
    require_memory(bytes_of(static_cast<std::uint64_t>(count), each) + kAtFirst, of_the_process(),
                   fmt::format("{} threads", count), "use more memory or fewer --threads");
}

void MemoryWatch::add(std::uint64_t bytes) {
    since_ += bytes;
    if (since_ < kStep) return;
    since_ = 0;
    require_memory(std::max(bytes, kStep), what_, instead_);
}

}  // namespace lucerna
