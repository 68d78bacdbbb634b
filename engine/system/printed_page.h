// HTML pages printed to PDF by a browser: Chromium, Chrome or Edge, whichever is found.
#pragma once

#include <filesystem>
#include <string>

namespace lucerna {

// Returns the name of a browser on the PATH that can print. Throws InputError, located at `option`, with the
// names that were sought.
std::string printing_browser(const std::string& option);

// Prints a self-contained page to `file`, in place of what was there, by a name that printing_browser()
// returned. The browser runs without a window, a network or a profile of the user. Throws InputError with the
// browser's name if it fails.
void print_page(const std::string& html, const std::filesystem::path& file, const std::string& browser);

}  // namespace lucerna
