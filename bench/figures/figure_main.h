// The common main() of all figures, in which an error prints one line and fails.
#pragma once

#include <fmt/core.h>

#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

namespace lucerna {

// `run` gets the words of the command line.
template <typename Run>
int figure_main(const char* name, int argc, char** argv, Run&& run) {
    try {
        run(std::vector<std::string>(argv + 1, argv + argc));
        return EXIT_SUCCESS;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}: {}\n", name, error.what());
        return EXIT_FAILURE;
    }
}

}  // namespace lucerna
