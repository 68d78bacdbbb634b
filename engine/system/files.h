// Files: the one way in which all readers open them, and a write that leaves the old file or the new one,
// never half a file.
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
// unless `file` is a regular file that can be read. Never waits: a pipe is not opened. Whoever hands a file's
// name to a library asks here first.
void require_readable(const std::filesystem::path& file);

// The file from its first byte, opened to read. Throws as require_readable does. No reader opens a stream in
// any other way (tests/architecture looks).
std::ifstream open_to_read(const std::filesystem::path& file);

// The whole file. Throws InputError, also for a file that memory cannot hold.
std::vector<std::byte> read_bytes(const std::filesystem::path& file);
std::string read_text(const std::filesystem::path& file);

// The whole file, unpacked if it is gzip'd. Throws InputError.
std::vector<std::byte> read_unpacked(const std::filesystem::path& file);

// What file a name leads to, through links and by whatever way into its folder; it need not be there yet.
class FileIdentity {
  public:
    explicit FileIdentity(const std::filesystem::path& file);

    bool operator==(const FileIdentity& other) const {
        return place_ == other.place_ || (there_ && other.there_ && number_ == other.number_);
    }
    // A pipe or a device: what is written there destroys nothing.
    bool is_stream() const { return stream_; }
    std::filesystem::path folder() const { return place_.parent_path(); }
    std::filesystem::path name() const { return place_.filename(); }

  private:
    std::filesystem::path place_;
    bool there_ = false, stream_ = false;
    std::pair<std::uintmax_t, std::uintmax_t> number_;  // of its device, and there
};
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

// What could not be written: a full disk, a missing permission. The input is not at fault.
class WriteError : public InputError {
  public:
    using InputError::InputError;
};

// Calls write(temporary) for a temporary file in the same folder, waits until that is on the disk, then
// renames it over `file`. If write throws (a stream that is told to throw, too), the temporary is removed and
// the error becomes a WriteError that names `file` and the system's cause; Stopped passes as it is. `write`
// must close what it wrote and see that it could.
//
// A symbolic link stays, and what it leads to is replaced, or made. The new file has the old one's mode and,
// where that is permitted, owner. The temporary is made by this call, readable by nobody who may not read the
// old file; whatever else has its name stays untouched. A pipe or a character device is written into; a pipe
// that nobody reads, a disk and a socket are refused.
void replace_file(const std::filesystem::path& file,
                  const std::function<void(const std::filesystem::path& temporary)>& write);
// The same for bytes that are there: the parts, one after the other.
void replace_file(const std::filesystem::path& file, std::span<const std::span<const std::byte>> parts);

// Throws InputError unless replace_file could begin to write there: tries it, and leaves nothing behind.
void require_replaceable(const std::filesystem::path& file);

// The end of the name, as ".exr", in lower case whatever the file's.
std::string suffix_of(const std::filesystem::path& file);

}  // namespace lucerna
