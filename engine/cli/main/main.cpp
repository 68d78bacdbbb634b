// The process around run(): its streams, its signal handlers and its allocator.
#include <unistd.h>

#include <csignal>
#include <iostream>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "engine/base/float_traps.h"
#include "engine/cli/run.h"

namespace {

// The only process-wide state, because a signal handler can reach nothing else.
std::atomic<int> stop_asked{0};
std::atomic<bool> listening{false};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free,
              "a signal handler may only touch lock-free atomics");

// Asks a listening command to stop; ends any other command at once, and every command at the second signal.
extern "C" void ask_to_stop(int signal) {
    int none = 0;
    if (listening && stop_asked.compare_exchange_strong(none, signal)) return;
    std::signal(signal, SIG_DFL);
    raise(signal);  // delivered when this returns
}

void listen_for(int signal) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (before.sa_handler == SIG_IGN) return;  // nohup, or a background job of a script: stays ignored
    struct sigaction action {};
    action.sa_handler = ask_to_stop;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
}

// Keeps freed memory for later planes of an image: pages that the system has to provide anew take as long as
// the work on them.
void keep_freed_memory() {
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 1 << 25);  // the largest that mallopt() accepts
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
}

}  // namespace

int main(int argc, char** argv) {
    keep_freed_memory();
    const lucerna::FloatTraps traps(lucerna::kFaults);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) listen_for(signal);
    // A closed pipe and a full disk are write errors that lose no image.
    for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
    return lucerna::run(argc, argv, std::cout, std::cerr,
                        {isatty(STDERR_FILENO) != 0, &stop_asked, &listening});
}
