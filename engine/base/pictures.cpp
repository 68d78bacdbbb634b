// The library of picture formats is found and loaded here. Nothing is kept: the dynamic linker knows what is
// loaded, and asking it again costs microseconds beside decoding a file.
#include "engine/base/pictures.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cfenv>
#include <fstream>

#include "engine/base/error.h"
#include "engine/base/files.h"

namespace lucerna {
namespace {

constexpr const char* kLibrary = "liblucerna_pictures.so";
constexpr const char* kEntry = "lucerna_pictures_1";

// Libraries expect the usual rounding and no traps while they are set up, and may change both, and the
// flushing of denormals, for the thread that loads them. Numbers must not depend on whether a picture was
// read before.
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

// What the known formats reach with runs of one value, packed twice.
constexpr std::int64_t kBestCompression = 1 << 16;

}  // namespace

void check_header(const std::filesystem::path& file) {
    std::array<unsigned char, 10> head{};
    open_to_read(file).read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
    constexpr std::array<unsigned char, 4> kExr{0x76, 0x2F, 0x31, 0x01};
    constexpr std::array<unsigned char, 3> kGif{'G', 'I', 'F'};
    const auto begins = [&](const auto& with) { return std::equal(with.begin(), with.end(), head.begin()); };
    constexpr std::array<unsigned char, 8> kPng{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    if (begins(kExr)) check_exr_header(file, ExrKind::any);
    if (begins(kPng)) check_png_chunks(file);
    if (begins(kGif)) {
        // The screen on which its pictures lie, 16 bits for each side.
        PictureHeader screen;
        screen.width = head[6] | head[7] << 8;
        screen.height = head[8] | head[9] << 8;
        if (!is_credible(file, screen))
            throw InputError(fmt::format("image size {} × {} is not credible", screen.width, screen.height));
    }
}

bool is_credible(const std::filesystem::path& file, const PictureHeader& header) {
    constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
    constexpr int kLinesAtOnce = 64;  // for which decoders make room, however few there are
    if (header.width <= 0 || header.height <= 0 || header.width > kMaxPixels / header.height) return false;
    std::error_code unknown;
    const std::uintmax_t bytes = std::filesystem::file_size(file, unknown);
    const std::int64_t pixels = std::int64_t{header.width} * std::max(header.height, kLinesAtOnce);
    return static_cast<std::uintmax_t>(pixels / kBestCompression) <= bytes;
}

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
    const SavedFloatEnvironment kept;
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
