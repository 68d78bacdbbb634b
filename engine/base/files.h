// Files: the one way in which all readers open them, and a write that leaves the old file or the new one,
// never half a file.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
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

// Whether the bytes begin as gzip's do.
bool is_gzip(const std::vector<std::byte>& bytes);
// Unpacked, at most `most` bytes. Throws InputError that names `file`: damaged, cut off, longer than that
// or than memory, or 400 times as long as it was and more than 64 MiB.
std::vector<std::byte> gunzip(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                              std::size_t most);
std::string gunzip_text(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                        std::size_t most);
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

// A library's message with its line breaks folded away.
std::string one_line(std::string_view text);

// A hash by which work and contents are named and files are checked: not for secrets.

// FNV-1a's step on words, with the high half folded down so that every bit of a word reaches every later one.
class WordHash {
  public:
    void add(std::uint64_t word) {
        value_ = (value_ ^ word) * 0x100000001b3U;
        value_ ^= value_ >> 29;
    }
    void add(int number) { add(static_cast<std::uint64_t>(number)); }
    void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
    void add(float number) { add(std::uint64_t{std::bit_cast<std::uint32_t>(number)}); }
    // With its length, so that two texts in a row are not one.
    void add(std::string_view text) {
        add(std::uint64_t{text.size()});
        for (const char c : text) add(std::uint64_t{static_cast<unsigned char>(c)});
    }
    // Eight at a time, the last ones one by one.
    void add_bytes(std::span<const std::byte> bytes) {
        std::size_t i = 0;
        for (; i + 8 <= bytes.size(); i += 8) {
            std::uint64_t word = 0;
            std::memcpy(&word, &bytes[i], 8);
            add(word);
        }
        for (; i < bytes.size(); ++i) add(static_cast<std::uint64_t>(bytes[i]));
    }
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 0xcbf29ce484222325U;
};

}  // namespace lucerna
