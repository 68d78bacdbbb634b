// Runs readers in a child process, where a crash, a hang or excessive memory does no harm and is reported.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace lucerna::testing {

struct TrialLimits {
    std::uint64_t inputs = 1000;
    double seconds_each = 10;
    // Bytes beyond the process's initial memory. Neither limit holds under a sanitizer.
    std::size_t memory = std::size_t{3} << 30;
    // The limit of one `new`, as in the fuzzers.
    std::size_t memory_at_once = std::size_t{1} << 30;
};

struct TrialOutcome {
    std::uint64_t done = 0;  // inputs that were read or refused
    std::string finding;     // how the next one ended the process, and its last output; empty: none did
};

// Reads one input; ends the process, throws or hangs in case of a fault.
using Reading = std::function<void(const std::string& input)>;

// Calls read(input(0)), read(input(1)), … in a child process, whose temporary files go to `folder`. Every
// call must return.
TrialOutcome try_inputs(const Reading& read, const std::function<std::string(std::uint64_t)>& input,
                        const std::filesystem::path& folder, const TrialLimits& limits = {});

}  // namespace lucerna::testing
