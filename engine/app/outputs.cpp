#include "engine/app/outputs.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <span>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/pictures.h"

namespace lucerna {
void require_writable(const std::filesystem::path& file, std::string_view suffix) {
    const Location at{file.string()};
    if (file.empty()) throw InputError("the output needs a file name");
    if (!suffix.empty() && suffix_of(file) != suffix) {
        input_error(at, "the output's name must end in {}", suffix);
    }
    std::error_code status;
    if (std::filesystem::is_directory(file, status))
        throw InputError(at, "is a folder; a file name is needed");
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (!std::filesystem::exists(folder, status)) {
        input_error(at, "cannot be written: there is no folder {}", folder.string());
    }
    if (!std::filesystem::is_directory(folder, status)) {
        input_error(at, "cannot be written: {} is not a folder", folder.string());
    }
    // Permissions say less than a try: quotas, read-only mounts, a superuser.
    std::filesystem::path probe = file;
    probe += fmt::format(".{}.try", getpid());
    errno = 0;
    const bool opened = std::ofstream(probe).is_open();
    const int cause = errno;
    if (!opened) input_error(at, "cannot be written: {}", std::strerror(cause));
    std::filesystem::remove(probe, status);
    if (suffix_of(file) == ".png") pictures(file);  // what writes it must be there, too
}

void write_text(const std::filesystem::path& file, std::string_view text) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    replace_file(file, std::span(&bytes, 1));
}

}  // namespace lucerna
