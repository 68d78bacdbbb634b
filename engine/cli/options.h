// Options that are read by units.h, so that every bad word gets the same kind of answer.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/units.h"

namespace lucerna {

// Adds option `name`; `take` gets the word and throws InputError if it is none.
template <typename Take>
CLI::Option* add_word(CLI::App& app, const std::string& name, const std::string& type,
                      const std::string& help, Take take) {
    return app
        .add_option_function<std::string>(
            name, [take](const std::string& word) { take(word); }, help)
        ->type_name(type);
}

// --threads N
inline void add_threads(CLI::App& app, Workers& workers) {
    add_word(app, "--threads", "N", "threads that work (default: one per processor)",
             [&workers](const std::string& word) {
                 workers.threads = static_cast<int>(parse_whole({"--threads"}, word, 1, 1024));
             });
}

}  // namespace lucerna
