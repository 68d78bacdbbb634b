// Our own shared libraries that are loaded when they are first needed: what they are linked with takes longer
// to load than most commands run.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {

// Where our shared libraries are looked for: in the RUNPATH of the program, or of the shared library that
// this code was linked into, then in the system's folders.
std::vector<std::filesystem::path> library_folders();

struct Module {
    const char* library;    // the file's name
    const char* entry;      // the function that it gives away, named by its version
    std::string_view need;  // of an error: "pictures need"
};
// The address of the entry, of the library in the first of the folders that has it, loaded if it is not yet;
// safe from any thread. Throws InputError at `wanted_by`, on whose behalf it is wanted: there is none in any
// of the folders, or the first there is cannot be used.
void* load_module(const Module& module, const Location& wanted_by,
                  const std::vector<std::filesystem::path>& folders = library_folders());

}  // namespace lucerna
