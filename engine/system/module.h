// Loads our own shared libraries when they are first needed, because their dependencies take longer to load
// than most commands run.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {

// Returns the folders in which our shared libraries are searched: the RUNPATH of the program or the shared
// library that this code was linked into, then the system's folders.
std::vector<std::filesystem::path> library_folders();

struct Module {
    const char* library;    // file name
    const char* entry;      // the function that it exports, named by its version
    std::string_view need;  // the beginning of an error, for example "pictures need"
};
// Returns the address of the entry in the library of the first folder that has it, and loads it if it is not
// loaded yet; thread-safe. Throws InputError at `wanted_by`, which needs it, if none of the folders has the
// library or if the first one found cannot be used.
void* load_module(const Module& module, const Location& wanted_by,
                  const std::vector<std::filesystem::path>& folders = library_folders());

}  // namespace lucerna
