// Nothing is kept: the dynamic linker knows what is loaded, and asking it again costs microseconds.
#include "engine/system/module.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include <cfenv>
#include <string>

#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// Libraries expect the usual rounding and no traps while they are set up, and may change both, and the
// flushing of denormals, for the thread that loads them. Numbers must not depend on whether one was loaded.
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

// Asked of the linker instead of left to it: sanitizers load libraries on behalf of the program, and then its
// RUNPATH would not count.
std::vector<std::filesystem::path> library_folders() {
    std::vector<std::filesystem::path> folders;
    // Whatever this code was linked into: a program, whose name is empty, or a shared library.
    Dl_info here{};
    void* object = nullptr;
    if (dladdr1(reinterpret_cast<void*>(&library_folders), &here, &object, RTLD_DL_LINKMAP) == 0 || !object)
        return folders;
    const char* name = static_cast<const link_map*>(object)->l_name;
    void* program = dlopen(*name ? name : nullptr, RTLD_LAZY | RTLD_NOLOAD);
    if (!program) return folders;
    Dl_serinfo size{};
    if (dlinfo(program, RTLD_DI_SERINFOSIZE, &size) == 0) {
        // Of whole Dl_serinfo, so that it is aligned; the linker fills in the count and the names.
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
    // Never unloaded: what it made has its code there.
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
