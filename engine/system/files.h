// Opens files for all readers, and writes files so that either the old or the new one remains, never half of
// one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {

// Throws InputError with the cause in words (missing, a folder, a pipe, a device, not permitted, empty)
// unless `file` is a regular file that can be read. It never waits, because it does not open pipes. It is
// called before a library opens a file by its name.
void require_readable(const std::filesystem::path& file);

// Opens a file to read. Throws as require_readable does. Readers open streams in no other way, which
// tests/architecture checks.
std::ifstream open_to_read(const std::filesystem::path& file);

// Reads a whole file as it is. Throws InputError, also for a file that does not fit into memory.
std::vector<std::byte> read_bytes(const std::filesystem::path& file);
// Reads a whole file, and unpacks it if gzip packed it. Throws InputError, also for a gzip file that is
// damaged, or that unpacks to more than 64 MiB and more than 400 times its size.
std::vector<std::byte> read_unpacked(const std::filesystem::path& file);
std::string read_text(const std::filesystem::path& file);

// Identifies the file that a path leads to, through links and folders. The file need not exist yet.
class FileIdentity {
  public:
    explicit FileIdentity(const std::filesystem::path& file);

    bool operator==(const FileIdentity& other) const {
        return place_ == other.place_ || (there_ && other.there_ && number_ == other.number_);
    }
    // Returns whether this is a pipe or a device, where writing destroys nothing.
    bool is_stream() const { return stream_; }
    std::filesystem::path folder() const { return place_.parent_path(); }
    std::filesystem::path name() const { return place_.filename(); }

  private:
    std::filesystem::path place_;
    bool there_ = false, stream_ = false;
    std::pair<std::uintmax_t, std::uintmax_t> number_;  // of its device, and of its inode
};
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

// Thrown when a file cannot be written, for example because the disk is full. The input is not at fault.
class WriteError : public InputError {
  public:
    using InputError::InputError;
};

// Calls write(temporary) for a temporary file in the same folder, waits until that is on the disk, and
// renames it to `file`. If write throws (as a stream does that was set to), the temporary is removed and a
// WriteError names `file` and the system's cause; Stopped is passed on. `write` must close the file and check
// that this succeeded.
//
// A symbolic link stays, and its target is replaced or made. The new file has the old one's mode and, where
// that is permitted, its owner. The temporary is a new file that nobody can read who may not read the old
// one; other files of its name are not touched. A pipe or a character device is written to; a pipe that
// nobody reads, a disk and a socket are refused.
void replace_file(const std::filesystem::path& file,
                  const std::function<void(const std::filesystem::path& temporary)>& write);
// Writes the parts, one after the other.
void replace_file(const std::filesystem::path& file, std::span<const std::span<const std::byte>> parts);

// Throws InputError unless replace_file can begin to write there. It tries, and leaves nothing behind.
void require_replaceable(const std::filesystem::path& file);

// Returns the suffix of the name in lower case, for example ".exr".
std::string suffix_of(const std::filesystem::path& file);

}  // namespace lucerna
