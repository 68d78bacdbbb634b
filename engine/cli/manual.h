// Makes the manual page, the reference page and the shell completion from the option tables of --help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lucerna {

// Returns the page lucerna(1), the program with all commands and options, in the macros of man(7).
std::string manual_page(const CLI::App& program);

// Returns the same as a Markdown page: docs/reference/commands.md.
std::string reference_page(const CLI::App& program);

// Returns a bash script that completes commands, options and values. The option's type name selects files of
// that suffix (FILE.exr), any file (FILE) or folders (DIR, FOLDER); a description that begins with "one of"
// lists words. Other values are not completed.
std::string bash_completion(const CLI::App& program);

}  // namespace lucerna
