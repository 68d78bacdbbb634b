// Preloaded into the command, kills it (SIGKILL) when a file is complete under its temporary name and before
// it replaces the old one. LUCERNA_TEST_KILL_FILE is the beginning of the temporary file's path, and
// LUCERNA_TEST_KILL_COUNT says at which of these files, from 1.
#include <dlfcn.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

std::string path_of(int descriptor) {
    std::array<char, 4096> path{};
    const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
    const ssize_t length = readlink(link.c_str(), path.data(), path.size());
    return length > 0 ? std::string(path.data(), static_cast<std::size_t>(length)) : std::string();
}

std::atomic<int> files = 0;

}  // namespace

extern "C" int fsync(int descriptor) {
    const char* const file = std::getenv("LUCERNA_TEST_KILL_FILE");
    const char* const count = std::getenv("LUCERNA_TEST_KILL_COUNT");
    if (file == nullptr || count == nullptr) std::abort();
    const std::string path = path_of(descriptor);
    if (path.starts_with(file) && path.ends_with(".part") && ++files == std::atoi(count)) {
        kill(getpid(), SIGKILL);
        for (;;) pause();
    }
    return reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, "fsync"))(descriptor);
}
