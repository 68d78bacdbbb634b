// The process around run(): its streams, and what Ctrl-C does.
#include <unistd.h>
#include <csignal>
#include <iostream>

#include "engine/app/run.h"
#include "engine/base/float_traps.h"

namespace {

// The one process-wide thing: a signal handler can reach nothing else.
std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

extern "C" void ask_to_stop(int) {
    stop_asked.store(true);
}

// The first Ctrl-C (or a polite kill) asks to stop; as the handler is then gone, a second one ends the
// process.
void listen_for(int signal) {
    struct sigaction action {};
    action.sa_handler = ask_to_stop;
    action.sa_flags = SA_RESETHAND | SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
}

}  // namespace

int main(int argc, char** argv) {
    const lucerna::FloatTraps traps(lucerna::kFaults);
    listen_for(SIGINT);
    listen_for(SIGTERM);
    return lucerna::run(argc, argv, std::cout, std::cerr, {isatty(STDERR_FILENO) != 0, &stop_asked});
}
