// The `lucerna` command, as a function: what main() calls and tests call.
//
// Exit codes: 0 done, 1 bad input or an unfit environment, 2 a fault of ours, 128 + the signal's number when
// the user stopped the work and what there was has been written. Errors, and that work was stopped, are one
// line on `err`: "lucerna: place: cause; what is accepted". Nothing here is global; whoever owns the process
// decides what Ctrl-C does and passes two flags.
#pragma once

#include <atomic>
#include <ostream>
#include <string_view>

namespace lucerna {

// What a run must be told about the process around it.
struct Surroundings {
    bool terminal = false;  // `err` is a terminal that understands \r and ESC [K
    const std::atomic<int>* stop =
        nullptr;  // the signal by which the user asks to stop, 0: none; may be null
    // True while the command listens for `stop` and has something to keep; at any other time a signal may end
    // the process at once. May be null.
    std::atomic<bool>* listening = nullptr;
};

// In a catch block: one line on `err` that begins with `who` and tells what was thrown. Returns the exit
// code.
int report_error(std::ostream& err, const Surroundings& around, std::string_view who = "lucerna");

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err,
        const Surroundings& around = {});

}  // namespace lucerna
