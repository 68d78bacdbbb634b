// Declares the program's version.
#pragma once

#include <string_view>

namespace lucerna {

// Returns e.g. "0.1.0".
std::string_view program_version();

}  // namespace lucerna
