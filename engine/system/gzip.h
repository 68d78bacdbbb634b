// Reads files that gzip packed, piece by piece.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

struct gzFile_s;  // zlib's

namespace lucerna {

// Returns true if so many bytes were packed to so few that they are made to fill the memory: more than 64
// MiB, and more than 400 times as many.
bool is_packed_trap(std::size_t made, std::size_t packed);
// Throws InputError that says so.
[[noreturn]] void refuse_packed_trap(const std::string& file);

class GzipReader {
  public:
    // Opens a file; one that gzip did not pack is read as it is. Throws as require_readable() does.
    explicit GzipReader(const std::filesystem::path& file);

    bool packed() const;
    // Returns the number of bytes read, less than `bytes` only at the end. Throws InputError for packed data
    // that are damaged, end too early or are a trap.
    std::size_t read(void* to, std::size_t bytes);
    // Begins again with the first byte.
    void rewind();

  private:
    std::filesystem::path file_;
    std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> in_;
    std::size_t made_ = 0;
};

}  // namespace lucerna
