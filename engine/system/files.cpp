#include "engine/system/files.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <ios>
#include <memory>
#include <stdexcept>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/system/gzip.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"

namespace lucerna {

namespace {

// Owns a file descriptor and closes it.
class Descriptor {
  public:
    explicit Descriptor(int number) : number_(number) {}
    ~Descriptor() {
        if (number_ >= 0) close(number_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    operator int() const { return number_; }

  private:
    int number_;
};

// Says what a file is that is not a regular one, and returns "" for a regular file.
std::string_view other_kind(mode_t mode) {
    if (S_ISREG(mode)) return "";
    if (S_ISDIR(mode)) return "is a folder, not a file";
    if (S_ISFIFO(mode)) return "is a pipe; expected a regular file";
    if (S_ISCHR(mode) || S_ISBLK(mode)) return "is a device; expected a regular file";
    return "is not a regular file";
}

}  // namespace

void require_readable(const std::filesystem::path& file) {
    const Location at{file.string()};
    const auto check_kind = [&at](const struct stat& about) {
        if (const std::string_view kind = other_kind(about.st_mode); !kind.empty())
            throw InputError(at, std::string(kind));
    };
    struct stat about {};
    if (stat(file.c_str(), &about) != 0) {
        if (errno != ENOENT && errno != ENOTDIR)
            throw InputError(at, std::string("cannot be opened: ") + std::strerror(errno));
        std::error_code status;
        if (std::filesystem::is_symlink(file, status)) throw InputError(at, "no such file: a broken link");
        throw InputError(at, "no such file");
    }
    check_kind(about);  // opening may wait, or start a device
    const Descriptor opened(open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
    if (opened < 0) throw InputError(at, std::string("cannot be opened: ") + std::strerror(errno));
    if (fstat(opened, &about) == 0) check_kind(about);
    if (about.st_size == 0) throw InputError(at, "the file is empty");
}

std::ifstream open_to_read(const std::filesystem::path& file) {
    require_readable(file);
    std::ifstream in(file, std::ios::binary);
    if (!in) throw InputError({file.string()}, std::string("cannot be opened: ") + std::strerror(errno));
    return in;
}

namespace {

// Returns the last four bytes of a gzip file: the unpacked size of its last member, modulo 2^32.
std::size_t stated_size(const std::filesystem::path& file) {
    std::uint32_t size = 0;
    open_to_read(file).seekg(-4, std::ios::end).read(reinterpret_cast<char*>(&size), sizeof size);
    return size;
}

// Reads into a container of bytes or characters.
template <typename Container>
Container unpacked(const std::filesystem::path& file) {
    GzipReader in(file);
    const std::size_t size = std::filesystem::file_size(file),
                      stated = in.packed() ? stated_size(file) : size;
    const std::size_t expected = is_packed_trap(stated, size) ? 0 : stated;
    Container out;
    std::size_t made = 0;
    do {
        // Makes room for one more byte than expected, so that the end is found without growing.
        const std::size_t room = std::max(expected, 2 * made) + 1;
        require_memory(room, file.string() + (in.packed() ? ", unpacked" : ""), "use a smaller file");
        out.resize(room);
        made += in.read(out.data() + made, room - made);
    } while (made == out.size());
    out.resize(made);
    return out;
}

}  // namespace

std::vector<std::byte> read_bytes(const std::filesystem::path& file) {
    std::ifstream in = open_to_read(file);
    in.seekg(0, std::ios::end);
    const std::streamoff size = in.tellg();
    if (size < 0) throw InputError({file.string()}, "its size cannot be determined");
    // A file of holes may state any size.
    require_memory(static_cast<std::uint64_t>(size), file.string(), "use a smaller file");
    std::vector<std::byte> bytes(static_cast<std::size_t>(size));
    in.seekg(0);
    in.read(reinterpret_cast<char*>(bytes.data()), size);
    if (!in) throw InputError({file.string()}, "reading failed before the end of the file");
    return bytes;
}

std::vector<std::byte> read_unpacked(const std::filesystem::path& file) {
    return unpacked<std::vector<std::byte>>(file);
}

std::string read_text(const std::filesystem::path& file) {
    return unpacked<std::string>(file);
}

namespace {

// Returns the end of a chain of links, whether it exists or not.
std::filesystem::path behind_links(std::filesystem::path file) {
    constexpr int kMostLinks = 40;  // the system's own limit
    for (int i = 0; i < kMostLinks; ++i) {
        std::error_code none;
        const std::filesystem::path next = std::filesystem::read_symlink(file, none);
        if (none) return file;
        file = file.parent_path() / next;  // this is `next` if that is absolute
    }
    throw std::runtime_error(std::strerror(ELOOP));
}

// Returns the canonical path of a file that need not exist.
std::filesystem::path place_of(const std::filesystem::path& file) {
    const std::filesystem::path end = behind_links(std::filesystem::absolute(file));
    std::error_code unknown;
    const std::filesystem::path folder = std::filesystem::weakly_canonical(end.parent_path(), unknown);
    return (unknown ? end.parent_path().lexically_normal() : folder) / end.filename();
}

// Waits until the file is on the disk. Some file systems only report here that they are full.
void flush_to_disk(const std::filesystem::path& file) {
    const Descriptor handle(open(file.c_str(), O_RDONLY | O_CLOEXEC));
    if (handle < 0) throw std::runtime_error(std::strerror(errno));
    // EINVAL means that there is no disk.
    if (fsync(handle) != 0 && errno != EINVAL) throw std::runtime_error(std::strerror(errno));
}

// Writes the folder's entry to the disk, too. If this fails, the old file may come back after a power cut.
void flush_folder(const std::filesystem::path& file) {
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    const Descriptor handle(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (handle >= 0) fsync(handle);
}

// Returns the system's message for errors of streams, which only say "iostream error".
std::string cause_of(const std::exception& error, int system_error) {
    const bool stream = dynamic_cast<const std::ios_base::failure*>(&error) != nullptr;
    return stream && system_error != 0 ? std::strerror(system_error) : one_line(error.what());
}

// Makes a new file beside `target`, with the target's mode and owner. It is removed unless it was renamed.
// Its name was free: no existing file is opened, followed or replaced.
class Temporary {
  public:
    Temporary(const std::filesystem::path& target, std::string_view suffix) {
        struct stat old {};
        const bool replaces = stat(target.c_str(), &old) == 0;
        constexpr int kMostTries = 1000;
        for (int i = 0; i < kMostTries; ++i) {
            path_ = target;
            path_ += i == 0 ? fmt::format(".{}{}", getpid(), suffix)
                            : fmt::format(".{}-{}{}", getpid(), i, suffix);
            constexpr int kNew = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
            const Descriptor made(open(path_.c_str(), kNew, replaces ? 0600 : 0666));
            if (made < 0 && errno == EEXIST) continue;
            if (made < 0) break;
            // The owner is set first, because that clears bits of the mode. A failure is ignored.
            if (replaces) [[maybe_unused]]
                const int kept = fchown(made, old.st_uid, old.st_gid);
            if (replaces) fchmod(made, old.st_mode & 0777U);
            return;
        }
        throw std::runtime_error(std::strerror(errno));
    }
    ~Temporary() {
        const int cause = errno;  // of the failure that unwinds the stack
        std::error_code ignored;
        if (!path_.empty()) std::filesystem::remove(path_, ignored);
        errno = cause;
    }
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

    const std::filesystem::path& path() const { return path_; }
    void rename_to(const std::filesystem::path& target) {
        std::filesystem::rename(path_, target);
        path_.clear();
    }

  private:
    std::filesystem::path path_;
};

using WriteTo = std::function<void(const std::filesystem::path& temporary)>;

void replace_regular(const std::filesystem::path& file, const WriteTo& write) {
    const std::filesystem::path target = behind_links(file);
    Temporary temporary(target, ".part");
    errno = 0;
    write(temporary.path());
    flush_to_disk(temporary.path());
    temporary.rename_to(target);
    flush_folder(target);
}

// Opens a pipe or a device without waiting, so that a pipe that nobody reads is an error.
Descriptor open_stream(const std::filesystem::path& file) {
    return Descriptor(open(file.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
}

// Collects the bytes in memory and then writes them, because writers seek and a pipe cannot.
void write_into(const std::filesystem::path& file, const WriteTo& write) {
    const Descriptor memory(memfd_create("lucerna", MFD_CLOEXEC));
    if (memory < 0) throw std::runtime_error(std::strerror(errno));
    write(fmt::format("/proc/self/fd/{}", static_cast<int>(memory)));
    const Descriptor out = open_stream(file);
    if (out < 0) throw std::runtime_error(std::strerror(errno));
    fcntl(out, F_SETFL, fcntl(out, F_GETFL) & ~O_NONBLOCK);
    std::vector<char> block(std::size_t{1} << 20);
    for (ssize_t got = 0; (got = read(memory, block.data(), block.size())) != 0;) {
        if (got < 0) throw std::runtime_error(std::strerror(errno));
        for (ssize_t done = 0; done < got;) {
            const ssize_t put = ::write(out, block.data() + done, static_cast<std::size_t>(got - done));
            if (put < 0 && errno != EINTR) throw std::runtime_error(std::strerror(errno));
            done += std::max<ssize_t>(put, 0);
        }
    }
}

// Returns whether this is a pipe or a character device. Throws for a file that cannot be written to.
bool is_stream(const std::filesystem::path& file) {
    struct stat about {};
    if (stat(file.c_str(), &about) != 0 || S_ISREG(about.st_mode)) return false;
    if (S_ISFIFO(about.st_mode) || S_ISCHR(about.st_mode)) return true;
    throw std::runtime_error(std::string(other_kind(about.st_mode)));
}

}  // namespace

FileIdentity::FileIdentity(const std::filesystem::path& file) : place_(place_of(file)) {
    struct stat about {};
    there_ = stat(file.c_str(), &about) == 0;
    if (!there_) return;
    stream_ = S_ISFIFO(about.st_mode) || S_ISCHR(about.st_mode);
    number_ = {about.st_dev, about.st_ino};
}

bool same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
    return FileIdentity(a) == FileIdentity(b);
}

void require_replaceable(const std::filesystem::path& file) {
    try {
        if (!is_stream(file)) {
            const Temporary probe(behind_links(file), ".try");
        } else if (open_stream(file) < 0) {
            throw std::runtime_error(std::strerror(errno));
        }
    } catch (const std::runtime_error& error) {
        throw InputError({file.string()}, std::string("cannot be written: ") + error.what());
    }
}

void replace_file(const std::filesystem::path& file, const WriteTo& write) {
    try {
        is_stream(file) ? write_into(file, write) : replace_regular(file, write);
    } catch (const Stopped&) {
        throw;
    } catch (const std::exception& error) {
        throw WriteError({file.string()}, "cannot be written: " + cause_of(error, errno));
    }
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
    return lower_case(file.extension().string());
}

}  // namespace lucerna
