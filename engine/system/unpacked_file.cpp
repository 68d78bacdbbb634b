#include "engine/system/unpacked_file.h"

#include <algorithm>
#include <fstream>
#include <utility>

#include "engine/base/error.h"
#include "engine/system/content.h"
#include "engine/system/files.h"
#include "engine/system/gzip.h"
#include "engine/system/zip_archive.h"

namespace lucerna {

// The bytes of a file, however they are packed.
class UnpackedFile::Stream {
  public:
    virtual ~Stream() = default;
    // Returns the number of bytes read, less than `bytes` only at the end. Throws InputError.
    virtual std::size_t read(void* to, std::size_t bytes) = 0;
    virtual void rewind() = 0;
    virtual std::uint64_t size() = 0;
};

namespace {

// Reads to the end and returns the number of bytes, and begins again.
std::uint64_t counted(UnpackedFile::Stream& stream) {
    std::vector<std::byte> block(std::size_t{1} << 18);
    std::uint64_t size = 0;
    for (std::size_t got = block.size(); got == block.size(); size += got)
        got = stream.read(block.data(), block.size());
    stream.rewind();
    return size;
}

class PlainStream final : public UnpackedFile::Stream {
  public:
    explicit PlainStream(const std::filesystem::path& file) : file_(file), in_(open_to_read(file)) {}
    std::size_t read(void* to, std::size_t bytes) override {
        in_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
        return static_cast<std::size_t>(in_.gcount());
    }
    void rewind() override {
        in_.clear();
        in_.seekg(0);
    }
    std::uint64_t size() override { return std::filesystem::file_size(file_); }

  private:
    std::filesystem::path file_;
    std::ifstream in_;
};

class GzipStream final : public UnpackedFile::Stream {
  public:
    explicit GzipStream(const std::filesystem::path& file) : in_(file) {}
    std::size_t read(void* to, std::size_t bytes) override { return in_.read(to, bytes); }
    void rewind() override { in_.rewind(); }
    std::uint64_t size() override { return counted(*this); }

  private:
    GzipReader in_;
};

// --- zip ---------------------------------------------------------------------------------------------------

class ZipStream final : public UnpackedFile::Stream {
  public:
    ZipStream(std::shared_ptr<const ZipArchive> archive, std::uint64_t entry)
        : archive_(std::move(archive)), in_(*archive_, entry) {}
    std::size_t read(void* to, std::size_t bytes) override { return in_.read(to, bytes); }
    void rewind() override { in_.rewind(); }
    std::uint64_t size() override { return counted(*this); }

  private:
    std::shared_ptr<const ZipArchive> archive_;
    ZipArchive::Reader in_;
};

// Two bytes are not enough: a ray file may begin with a number of these.
bool is_gzip(std::span<const std::byte> first) {
    const std::string_view bytes(reinterpret_cast<const char*>(first.data()), first.size());
    return bytes.starts_with("\x1f\x8b\x08");
}

// Returns the first bytes of a stream, which then begins again.
std::vector<std::byte> first_of(UnpackedFile::Stream& stream) {
    std::vector<std::byte> first(kFirstBytes);
    first.resize(stream.read(first.data(), first.size()));
    stream.rewind();
    return first;
}

std::string list_of(const std::vector<std::string>& names) {
    constexpr std::size_t kMost = 8;
    std::string list;
    for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) list += (i == 0 ? "" : ", ") + names[i];
    if (names.size() > kMost) list += fmt::format(" and {} more", names.size() - kMost);
    return list;
}

// Returns the number of the only file of the archive that is wanted.
std::uint64_t wanted_entry(const std::shared_ptr<const ZipArchive>& archive, const Location& at,
                           UnpackedFile::Wanted wanted, const char* noun) {
    std::vector<std::string> found, others;
    std::uint64_t entry = 0;
    for (std::uint64_t i = 0; i < archive->entries(); ++i) {
        if (archive->size(i) == 0) continue;  // a folder, too
        ZipStream stream(archive, i);
        const bool take = wanted(first_of(stream));
        (take ? found : others).push_back(archive->inner_name(i));
        if (take) entry = i;
    }
    if (found.size() == 1) return entry;
    if (found.empty() && others.empty()) input_error(at, "the zip archive is empty; expected a {}", noun);
    if (found.empty()) input_error(at, "no {} in the zip archive, which holds {}", noun, list_of(others));
    input_error(at, "the zip archive holds {} {}s: {}; expected one, so unpack the one to be read",
                found.size(), noun, list_of(found));
}

}  // namespace

UnpackedFile::UnpackedFile(const std::filesystem::path& file, Wanted wanted, const char* noun)
    : name_(file.string()) {
    const std::vector<std::byte> first = first_bytes(file);
    if (is_zip({reinterpret_cast<const char*>(first.data()), first.size()})) {
        const auto archive = std::make_shared<const ZipArchive>(file);
        const std::uint64_t entry = wanted_entry(archive, {name_}, wanted, noun);
        name_ = archive->name(entry);
        stream_ = std::make_unique<ZipStream>(archive, entry);
    } else if (is_gzip(first)) {
        stream_ = std::make_unique<GzipStream>(file);
    } else {
        stream_ = std::make_unique<PlainStream>(file);
    }
    first_ = first_of(*stream_);
}

UnpackedFile::~UnpackedFile() = default;
UnpackedFile::UnpackedFile(UnpackedFile&&) noexcept = default;
UnpackedFile& UnpackedFile::operator=(UnpackedFile&&) noexcept = default;

std::uint64_t UnpackedFile::size() {
    return stream_->size();
}

void UnpackedFile::read(void* to, std::size_t bytes) {
    if (stream_->read(to, bytes) != bytes)
        throw InputError({name_}, "reading failed before the end of the file");
}

void UnpackedFile::skip(std::uint64_t bytes) {
    std::vector<std::byte> block(std::min(bytes, std::uint64_t{1} << 16));
    for (; bytes > 0; bytes -= std::min<std::uint64_t>(bytes, block.size()))
        read(block.data(), std::min<std::uint64_t>(bytes, block.size()));
}

}  // namespace lucerna
