// The library of picture formats is found and loaded here. Nothing is kept: the dynamic linker knows what is
// loaded, and asking it again costs microseconds beside decoding a file.
#include "engine/base/pictures.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cfenv>

#include "engine/base/error.h"
#include "engine/base/files.h"

namespace lucerna {
namespace {

constexpr const char* kLibrary = "liblucerna_pictures.so";
constexpr const char* kEntry = "lucerna_pictures_1";

// Libraries expect the usual rounding and no traps while they are set up, and may change both, and the
// flushing of denormals, for the thread that loads them. Numbers must not depend on whether a picture was
// read before.
class KeptFloatEnvironment {
  public:
    KeptFloatEnvironment() {
        std::fegetenv(&kept_);
        std::fesetenv(FE_DFL_ENV);
    }
    ~KeptFloatEnvironment() { std::fesetenv(&kept_); }
    KeptFloatEnvironment(const KeptFloatEnvironment&) = delete;
    KeptFloatEnvironment& operator=(const KeptFloatEnvironment&) = delete;

  private:
    std::fenv_t kept_{};
};

std::string last_error() {
    const char* error = dlerror();
    return error ? one_line(error) : "no cause given";
}

std::filesystem::path found_in(const std::vector<std::filesystem::path>& folders,
                               const std::filesystem::path& wanted_by) {
    std::string looked;
    for (const auto& folder : folders) {
        std::error_code unknown;
        if (std::filesystem::exists(folder / kLibrary, unknown)) return folder / kLibrary;
        looked += (looked.empty() ? "" : ", ") + folder.string();
    }
    throw InputError({wanted_by.string()},
                     fmt::format("pictures need {}, which is in none of {}", kLibrary, looked));
}

}  // namespace

// Asked of the linker instead of left to it: sanitizers load libraries on behalf of the program, and then its
// RUNPATH would not count.
std::vector<std::filesystem::path> library_folders() {
    std::vector<std::filesystem::path> folders;
    void* program = dlopen(nullptr, RTLD_LAZY);
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

const Pictures& pictures(const std::filesystem::path& file,
                         const std::vector<std::filesystem::path>& folders) {
    const std::filesystem::path library = found_in(folders, file);
    const KeptFloatEnvironment kept;
    // Never unloaded: what it made has its code there.
    void* handle = dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL | RTLD_NODELETE);
    if (!handle) {
        throw InputError({file.string()},
                         fmt::format("pictures need {}, which cannot be loaded: {}", kLibrary, last_error()));
    }
    const auto entry = reinterpret_cast<decltype(&lucerna_pictures_1)>(dlsym(handle, kEntry));
    if (!entry) {
        throw InputError({file.string()}, fmt::format("pictures need {}; {} is of another version of Lucerna",
                                                      kLibrary, library.string()));
    }
    return *entry();
}

}  // namespace lucerna
