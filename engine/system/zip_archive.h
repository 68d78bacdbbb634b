// Zip archives: their files by number, read from the first byte to the last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace lucerna {

class ZipArchive {
  public:
    // Opens a file, or an archive in memory that errors call `name`. Throws InputError: the file cannot be
    // read, or it is no archive.
    explicit ZipArchive(const std::filesystem::path& file);
    ZipArchive(std::string bytes, std::string name);
    ~ZipArchive();
    ZipArchive(ZipArchive&&) noexcept;
    ZipArchive& operator=(ZipArchive&&) noexcept;

    std::uint64_t entries() const;
    std::uint64_t size(std::uint64_t entry) const;  // unpacked; 0 for a folder
    // Returns the entry's path in the archive as it is, and as errors show it: alone, or behind the
    // archive's.
    std::string path(std::uint64_t entry) const;
    std::string inner_name(std::uint64_t entry) const;
    std::string name(std::uint64_t entry) const;
    // Returns the entry of the path, or of the only path that differs from it in case alone.
    std::optional<std::uint64_t> find(std::string_view path) const;
    // Reads a whole entry. Throws InputError: it is damaged, encrypted, or expands like a trap.
    std::string text(std::uint64_t entry) const;

    // Reads an entry from its start. The archive must outlive it.
    class Reader {
      public:
        Reader(const ZipArchive& archive, std::uint64_t entry);
        ~Reader();
        // Returns the number of bytes read, less than `bytes` only at the end. Throws InputError.
        std::size_t read(void* to, std::size_t bytes);
        void rewind();

      private:
        struct File;
        const ZipArchive* archive_;
        std::uint64_t entry_;
        std::unique_ptr<File> file_;
        std::size_t packed_ = 0, made_ = 0;
    };

  private:
    struct State;
    std::unique_ptr<State> state_;
};

// Tells by the first bytes of a file whether it is a zip archive.
bool is_zip(std::string_view first);

}  // namespace lucerna
