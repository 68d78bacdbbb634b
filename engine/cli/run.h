// The `lucerna` command as a function, called by main() and by tests.
//
// Exit codes: 0 success, 1 bad input or an unfit environment, 2 an internal error, 128 + the signal's number
// if the user stopped the work and its results were written. Errors and stops are reported in one line on
// `err`: "lucerna: place: cause; what is accepted". There is no global state; the owner of the process
// decides what Ctrl-C does and passes two flags.
#pragma once

#include <atomic>
#include <ostream>
#include <string_view>

namespace lucerna {

// The properties of the process in which a command runs.
struct ProcessContext {
    bool terminal = false;  // `err` is a terminal that understands \r and ESC [K
    const std::atomic<int>* stop =
        nullptr;  // the signal by which the user asks to stop, 0: none; may be null
    // True while the command listens for `stop` and has results to keep; at other times a signal may end the
    // process at once. May be null.
    std::atomic<bool>* listening = nullptr;
};

// Call it in a catch block. Prints one line on `err` that begins with `who` and describes the exception, and
// returns the exit code.
int report_error(std::ostream& err, const ProcessContext& process, std::string_view who = "lucerna");

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err,
        const ProcessContext& process = {});

}  // namespace lucerna
