#include "engine/system/unpacked_file.h"

#include <zip.h>

#include <algorithm>
#include <fstream>
#include <utility>

#include "engine/base/error.h"
#include "engine/system/content.h"
#include "engine/system/files.h"
#include "engine/system/gzip.h"
#include "engine/text/plain_text.h"

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

class Archive {
  public:
    explicit Archive(const std::filesystem::path& file) : file_(file) {
        require_readable(file);
        int code = 0;
        zip_.reset(zip_open(file.c_str(), ZIP_RDONLY, &code));
        if (zip_) return;
        zip_error_t error;
        zip_error_init_with_code(&error, code);
        const std::string cause = one_line(zip_error_strerror(&error));
        zip_error_fini(&error);
        input_error({file.string()}, "the zip archive cannot be read: {}", cause);
    }
    std::uint64_t entries() const { return static_cast<std::uint64_t>(zip_get_num_entries(zip_.get(), 0)); }
    zip_stat_t about(std::uint64_t entry) const {
        zip_stat_t about;
        zip_stat_init(&about);
        if (zip_stat_index(zip_.get(), entry, 0, &about) != 0 || about.name == nullptr)
            input_error({file_.string()}, "the directory of the zip archive is damaged at its file {}",
                        entry + 1);
        return about;
    }
    // Returns the path with the entry's name behind it.
    std::string name(std::uint64_t entry) const { return file_.string() + "/" + inner_name(entry); }
    // Returns the entry's name as errors show it.
    std::string inner_name(std::uint64_t entry) const { return one_line(plain_text(about(entry).name)); }
    zip_t* get() const { return zip_.get(); }

  private:
    struct Discard {
        void operator()(zip_t* zip) const { zip_discard(zip); }
    };
    std::filesystem::path file_;
    std::unique_ptr<zip_t, Discard> zip_;
};

class ZipStream final : public UnpackedFile::Stream {
  public:
    ZipStream(std::shared_ptr<const Archive> archive, std::uint64_t entry)
        : archive_(std::move(archive)), entry_(entry) {
        open();
    }
    std::size_t read(void* to, std::size_t bytes) override {
        std::size_t done = 0;
        for (zip_int64_t got = 1; got > 0 && done < bytes; done += static_cast<std::size_t>(got)) {
            if (is_packed_trap(made_ + done, packed_)) refuse_packed_trap(archive_->name(entry_));
            got = zip_fread(in_.get(), static_cast<std::byte*>(to) + done, bytes - done);
            if (got < 0)
                input_error({archive_->name(entry_)}, "its compressed data are damaged: {}",
                            one_line(zip_file_strerror(in_.get())));
        }
        made_ += done;
        return done;
    }
    void rewind() override { open(); }
    std::uint64_t size() override { return counted(*this); }

  private:
    void open() {
        packed_ = archive_->about(entry_).comp_size;
        made_ = 0;
        in_.reset(zip_fopen_index(archive_->get(), entry_, 0));
        if (in_) return;
        input_error({archive_->name(entry_)}, "cannot be unpacked: {}",
                    one_line(zip_strerror(archive_->get())));
    }

    struct Close {
        void operator()(zip_file_t* file) const { zip_fclose(file); }
    };
    std::shared_ptr<const Archive> archive_;
    std::uint64_t entry_;
    std::unique_ptr<zip_file_t, Close> in_;
    std::size_t packed_ = 0, made_ = 0;
};

// Two bytes are not enough: a ray file may begin with a number of these.
bool is_gzip(std::span<const std::byte> first) {
    const std::string_view bytes(reinterpret_cast<const char*>(first.data()), first.size());
    return bytes.starts_with("\x1f\x8b\x08");
}

bool is_zip(std::span<const std::byte> first) {
    const std::string_view bytes(reinterpret_cast<const char*>(first.data()), first.size());
    return bytes.starts_with("PK\x03\x04") || bytes.starts_with("PK\x05\x06");
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
std::uint64_t wanted_entry(const std::shared_ptr<const Archive>& archive, const Location& at,
                           UnpackedFile::Wanted wanted, const char* noun) {
    std::vector<std::string> found, others;
    std::uint64_t entry = 0;
    for (std::uint64_t i = 0; i < archive->entries(); ++i) {
        if (archive->about(i).size == 0) continue;  // a folder, too
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
    if (is_zip(first)) {
        const auto archive = std::make_shared<const Archive>(file);
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
