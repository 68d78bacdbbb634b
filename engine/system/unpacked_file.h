// Reads a file's bytes from the first to the last, unpacked if gzip or zip packed it, without holding them in
// memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace lucerna {

class UnpackedFile {
  public:
    // Tells by the first bytes of a file, as many as first_bytes() returns, whether the caller reads it.
    using Wanted = bool (*)(std::span<const std::byte> first);

    // Opens the file or, if it is a zip archive, the only file in it that is wanted; `noun` is what errors
    // call one, for example "ray file". Throws InputError: the file cannot be read, packed data are damaged,
    // the archive is encrypted or has no wanted file or several, which are named.
    UnpackedFile(const std::filesystem::path& file, Wanted wanted, const char* noun);
    ~UnpackedFile();
    UnpackedFile(UnpackedFile&&) noexcept;
    UnpackedFile& operator=(UnpackedFile&&) noexcept;

    // Returns the path, with the name inside an archive behind it: "lamps.zip/lamp.dat".
    const std::string& name() const { return name_; }
    std::span<const std::byte> first() const { return first_; }
    // Returns the number of unpacked bytes. Packed data are unpacked once to count and check them. Is called
    // before read().
    std::uint64_t size();
    // Reads exactly `bytes` bytes, at most as many as are left. Throws InputError if that fails.
    void read(void* to, std::size_t bytes);
    void skip(std::uint64_t bytes);

    class Stream;

  private:
    std::string name_;
    std::unique_ptr<Stream> stream_;
    std::vector<std::byte> first_;
};

}  // namespace lucerna
