#include "engine/base/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <ios>
#include <stdexcept>

#include "engine/base/error.h"

namespace lucerna {

void require_readable(const std::filesystem::path& file) {
    std::error_code status;
    if (!std::filesystem::exists(file, status)) throw InputError({file.string()}, "no such file");
    if (std::filesystem::is_directory(file, status))
        throw InputError({file.string()}, "is a folder, not a file");
    if (!std::ifstream(file, std::ios::binary)) {
        throw InputError({file.string()}, std::string("cannot be opened: ") + std::strerror(errno));
    }
    if (std::filesystem::is_regular_file(file, status) && std::filesystem::file_size(file, status) == 0) {
        throw InputError({file.string()}, "the file is empty");
    }
}

namespace {

// Into a container of bytes or characters.
template <typename Container>
Container read_all(const std::filesystem::path& file) {
    require_readable(file);
    std::ifstream in(file, std::ios::binary | std::ios::ate);
    const std::streamoff size = in.tellg();
    if (size < 0) throw InputError({file.string()}, "its size cannot be told");
    Container bytes(static_cast<std::size_t>(size), typename Container::value_type{});
    in.seekg(0);
    in.read(reinterpret_cast<char*>(bytes.data()), size);
    if (!in) throw InputError({file.string()}, "reading stopped before the end of the file");
    return bytes;
}

bool begins_as_gzip(const std::filesystem::path& file) {
    std::array<char, 2> first{};
    std::ifstream(file, std::ios::binary).read(first.data(), first.size());
    return first[0] == '\x1f' && first[1] == '\x8b';
}

}  // namespace

std::vector<std::byte> read_bytes(const std::filesystem::path& file) {
    return read_all<std::vector<std::byte>>(file);
}

std::vector<std::byte> read_unpacked(const std::filesystem::path& file) {
    constexpr std::size_t kMost = std::size_t{1} << 36;  // what unpacks to more is a trap
    std::vector<std::byte> bytes = read_bytes(file);
    if (is_gzip(bytes)) return gunzip(bytes, file, kMost);
    return bytes;
}

std::string read_text(const std::filesystem::path& file) {
    require_readable(file);
    if (!begins_as_gzip(file)) return read_all<std::string>(file);  // no second copy of a large text
    const std::vector<std::byte> bytes = read_unpacked(file);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

namespace {

// On the disk, not only on its way there. Some file systems tell only now that they are full.
void settle(const std::filesystem::path& file) {
    const int handle = open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (handle < 0) throw std::runtime_error(std::strerror(errno));
    const int failed = fsync(handle) == 0 ? 0 : errno;
    close(handle);
    // EINVAL: what is written to has no disk.
    if (failed != 0 && failed != EINVAL) throw std::runtime_error(std::strerror(failed));
}

// The folder's entry, too. Without that the old file may come back after a power cut: that is allowed.
void settle_folder(const std::filesystem::path& file) {
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    const int handle = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (handle < 0) return;
    fsync(handle);
    close(handle);
}

// Streams throw "iostream error"; the system knows more.
std::string cause_of(const std::exception& error, int system_error) {
    const bool stream = dynamic_cast<const std::ios_base::failure*>(&error) != nullptr;
    return stream && system_error != 0 ? std::strerror(system_error) : one_line(error.what());
}

}  // namespace

void replace_file(const std::filesystem::path& file,
                  const std::function<void(const std::filesystem::path& temporary)>& write) {
    std::filesystem::path temporary = file;
    temporary += fmt::format(".{}.part", getpid());
    errno = 0;
    try {
        write(temporary);
        settle(temporary);
        std::filesystem::rename(temporary, file);
    } catch (const std::exception& error) {
        const std::string cause = cause_of(error, errno);
        std::error_code ignored;
        std::filesystem::remove(temporary, ignored);
        throw InputError({file.string()}, "cannot be written: " + cause);
    }
    settle_folder(file);
}

void replace_file(const std::filesystem::path& file, std::span<const std::span<const std::byte>> parts) {
    replace_file(file, [&](const std::filesystem::path& temporary) {
        std::ofstream out(temporary, std::ios::binary);
        out.exceptions(std::ios::badbit | std::ios::failbit);
        for (const std::span<const std::byte> part : parts) {
            out.write(reinterpret_cast<const char*>(part.data()), static_cast<std::streamsize>(part.size()));
        }
        out.close();
    });
}

std::string suffix_of(const std::filesystem::path& file) {
    std::string suffix = file.extension().string();
    std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return suffix;
}

std::string one_line(std::string_view text) {
    std::string folded;
    for (const char c : text) {
        if (c == '\n' || c == '\r') {
            if (!folded.empty() && folded.back() != ' ') folded += ' ';
        } else {
            folded += c;
        }
    }
    while (!folded.empty() && folded.back() == ' ') folded.pop_back();
    return folded;
}

}  // namespace lucerna
