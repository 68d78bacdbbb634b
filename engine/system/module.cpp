// No state is kept, because the dynamic linker knows what is loaded and asking it again takes microseconds.
#include "engine/system/module.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include <cfenv>
#include <string>

#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// Restores the floating-point environment. Libraries expect the default one while they are initialised, and
// may change rounding, traps and the flushing of denormals for the thread that loads them. Results must not
// depend on whether a library was loaded.
class SavedFloatEnvironment {
  public:
    SavedFloatEnvironment() {
        std::fegetenv(&kept_);
        std::fesetenv(FE_DFL_ENV);
    }
    ~SavedFloatEnvironment() { std::fesetenv(&kept_); }
    SavedFloatEnvironment(const SavedFloatEnvironment&) = delete;
    SavedFloatEnvironment& operator=(const SavedFloatEnvironment&) = delete;

  private:
    std::fenv_t kept_{};
};

std::string last_error() {
    const char* error = dlerror();
    return error ? one_line(error) : "no cause given";
}

std::filesystem::path found_in(const std::vector<std::filesystem::path>& folders, const Module& module,
                               const Location& wanted_by) {
    std::string looked;
    for (const auto& folder : folders) {
        std::error_code unknown;
        if (std::filesystem::exists(folder / module.library, unknown)) return folder / module.library;
        looked += (looked.empty() ? "" : ", ") + folder.string();
    }
    throw InputError(wanted_by,
                     fmt::format("{} {}, which was not found in {}", module.need, module.library, looked));
}

}  // namespace

// Asks the linker for the folders instead of letting it search, because sanitizers intercept dlopen, and then
// the program's RUNPATH would not be used.
std::vector<std::filesystem::path> library_folders() {
    std::vector<std::filesystem::path> folders;
    // This finds what this code was linked into: a program, whose name is empty, or a shared library.
    Dl_info here{};
    void* object = nullptr;
    if (dladdr1(reinterpret_cast<void*>(&library_folders), &here, &object, RTLD_DL_LINKMAP) == 0 || !object)
        return folders;
    const char* name = static_cast<const link_map*>(object)->l_name;
    void* program = dlopen(*name ? name : nullptr, RTLD_LAZY | RTLD_NOLOAD);
    if (!program) return folders;
    Dl_serinfo size{};
    if (dlinfo(program, RTLD_DI_SERINFOSIZE, &size) == 0) {
        // The buffer has elements of Dl_serinfo so that it is aligned. The linker fills in the names.
        std::vector<Dl_serinfo> buffer(size.dls_size / sizeof(Dl_serinfo) + 1);
        buffer[0] = size;
        if (dlinfo(program, RTLD_DI_SERINFO, buffer.data()) == 0) {
            const Dl_serpath* paths = &buffer[0].dls_serpath[0];
            for (unsigned i = 0; i < size.dls_cnt; ++i) folders.emplace_back(paths[i].dls_name);
        }
    }
    dlclose(program);
    return folders;
}

void* load_module(const Module& module, const Location& wanted_by,
                  const std::vector<std::filesystem::path>& folders) {
    const std::filesystem::path library = found_in(folders, module, wanted_by);
    const SavedFloatEnvironment kept;
    // The library is never unloaded, because objects that it made need its code.
    void* handle = dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL | RTLD_NODELETE);
    if (!handle) {
        throw InputError(wanted_by, fmt::format("{} {}, which cannot be loaded: {}", module.need,
                                                module.library, last_error()));
    }
    void* entry = dlsym(handle, module.entry);
    if (!entry) {
        throw InputError(wanted_by, fmt::format("{} {}; {} is of another version of Lucerna", module.need,
                                                module.library, library.string()));
    }
    return entry;
}

}  // namespace lucerna
