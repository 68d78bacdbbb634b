#include "tests/mutations/trial.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "tests/support/sanitized.h"

namespace lucerna::testing {
namespace {

// The largest allocation in bytes; 0: unlimited. It is set in the child only.
std::size_t most_at_once = 0;

// Memory shared by parent and child.
struct Shared {
    std::atomic<std::uint64_t> done{0};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free, "two processes share it");

class SharedPage {
  public:
    SharedPage() {
        void* page = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        if (page == MAP_FAILED) throw std::runtime_error("no shared memory");
        shared_ = new (page) Shared;
    }
    ~SharedPage() { munmap(shared_, sizeof(Shared)); }
    SharedPage(const SharedPage&) = delete;
    SharedPage& operator=(const SharedPage&) = delete;
    Shared* operator->() const { return shared_; }

  private:
    Shared* shared_;
};

void limit(int what, rlim_t most) {
    const rlimit limits{most, most};
    setrlimit(what, &limits);
}

std::size_t address_space() {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

[[noreturn]] void be_the_child(const Reading& read, const std::function<std::string(std::uint64_t)>& input,
                               const std::filesystem::path& folder, const TrialLimits& limits,
                               const SharedPage& shared) {
    const int log = open((folder / "said").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(log, STDERR_FILENO);
    setenv("TMPDIR", folder.c_str(), 1);
    limit(RLIMIT_CORE, 0);
    // The limit on file size also stops an endless file.
    limit(RLIMIT_FSIZE, std::size_t{1} << 28);
    if (!kSanitized) limit(RLIMIT_AS, address_space() + limits.memory);
    for (std::uint64_t i = 0; i < limits.inputs; ++i) {
        const std::string text = input(i);
        most_at_once = limits.memory_at_once;
        try {
            read(text);
        } catch (const std::exception& error) {
            // Prints what() explicitly, because an uncaught exception does not always print it.
            const std::string what = std::string("threw: ") + error.what() + "\n";
            [[maybe_unused]] const ssize_t told = write(STDERR_FILENO, what.data(), what.size());
            _exit(3);
        }
        shared->done = i + 1;
    }
    _exit(0);
}

std::string last_words(const std::filesystem::path& folder) {
    std::ostringstream text;
    text << std::ifstream(folder / "said").rdbuf();
    const std::string all = text.str();
    return all.size() > 2000 ? all.substr(0, 2000) + " …" : all;
}

void* allocate(std::size_t size) {
    if (most_at_once > 0 && size > most_at_once) {
        // Aborts instead of throwing: readers catch std::bad_alloc, so a wrong size in a header would look
        // like a damaged file.
        constexpr std::string_view kText = "asked for too much memory at once\n";
        [[maybe_unused]] const ssize_t told = write(STDERR_FILENO, kText.data(), kText.size());
        std::abort();
    }
    if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
    throw std::bad_alloc();
}

}  // namespace
}  // namespace lucerna::testing

// Replaces every `new` of the program and its libraries. Sanitizers have their own.
#ifndef LUCERNA_SANITIZED
void* operator new(std::size_t size) {
    return lucerna::testing::allocate(size);
}
void* operator new[](std::size_t size) {
    return lucerna::testing::allocate(size);
}
void operator delete(void* p) noexcept {
    std::free(p);
}
void operator delete[](void* p) noexcept {
    std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}
void operator delete[](void* p, std::size_t) noexcept {
    std::free(p);
}
#endif

namespace lucerna::testing {

TrialOutcome try_inputs(const Reading& read, const std::function<std::string(std::uint64_t)>& input,
                        const std::filesystem::path& folder, const TrialLimits& limits) {
    using Clock = std::chrono::steady_clock;
    const SharedPage shared;
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("no process");
    if (child == 0) be_the_child(read, input, folder, limits, shared);

    int status = 0;
    std::uint64_t seen = 0;
    auto since = Clock::now();
    while (waitpid(child, &status, WNOHANG) == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        if (const std::uint64_t done = shared->done; done != seen) {
            seen = done;
            since = Clock::now();
        } else if (std::chrono::duration<double>(Clock::now() - since).count() > limits.seconds_each) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            return {seen, "hangs"};
        }
    }
    if (WIFSIGNALED(status)) {
        return {shared->done,
                std::string("ended by ") + strsignal(WTERMSIG(status)) + ": " + last_words(folder)};
    }
    const int code = WEXITSTATUS(status);
    if (code == 0) return {shared->done, ""};
    return {shared->done, "left with " + std::to_string(code) + ": " + last_words(folder)};
}

}  // namespace lucerna::testing
