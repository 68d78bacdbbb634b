// The manual page, the reference page and the shell's completion, made of the same tables of options as
// --help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lucerna {

// The page lucerna(1): the program, all its commands and all their options, in the macros of man(7).
std::string manual_page(const CLI::App& program);

// The same as a page in Markdown: docs/reference/commands.md.
std::string reference_page(const CLI::App& program);

// A script for bash that completes commands, options and what these take: by the option's type name, files of
// that suffix (FILE.exr), any file (FILE), folders (DIR, FOLDER), or the words of a description that begins
// with "one of". Other values are not completed.
std::string bash_completion(const CLI::App& program);

}  // namespace lucerna
