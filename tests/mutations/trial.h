// Readers on trial: each input in a process of their own, where a crash, a hang or a hunger for memory does
// no harm and is told.
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
    // Bytes, beyond what the process has when it begins. Neither limit holds under a sanitizer.
    std::size_t memory = std::size_t{3} << 30;
    // By one `new`, as the fuzzers have it.
    std::size_t memory_at_once = std::size_t{1} << 30;
};

struct TrialOutcome {
    std::uint64_t done = 0;  // inputs that were read or refused
    std::string finding;     // how the next one ended the process, and what it said last; empty: nothing did
};

// One read: ends the process, throws or hangs where it must not.
using Reading = std::function<void(const std::string& input)>;

// read(input(0)), read(input(1)), … in a child process, whose temporary files go to `folder`. Every input
// must return.
TrialOutcome try_inputs(const Reading& read, const std::function<std::string(std::uint64_t)>& input,
                        const std::filesystem::path& folder, const TrialLimits& limits = {});

}  // namespace lucerna::testing
