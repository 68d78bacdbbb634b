// The `lucerna` command, as a function: what main() calls and tests call.
//
// Exit codes: 0 done (also when the user stopped a render and what there was has been written), 1 bad input
// or an unfit environment, 2 a fault of ours. Errors are one line on `err`: "lucerna: place: cause; what is
// accepted". Nothing here is global; whoever owns the process decides what Ctrl-C does and passes a flag.
#pragma once

#include <atomic>
#include <ostream>
#include <string_view>

namespace lucerna {

// What a run must be told about the process around it.
struct Surroundings {
    bool terminal = false;                    // `err` is a terminal that understands \r and ESC [K
    const std::atomic<bool>* stop = nullptr;  // becomes true when the user asks to stop; may be null
};

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err,
        const Surroundings& around = {});

// "0.1.0"
std::string_view program_version();

}  // namespace lucerna
