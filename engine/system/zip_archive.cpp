#include "engine/system/zip_archive.h"

#include <zip.h>

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/system/gzip.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {}  // namespace

struct ZipArchive::State {
    struct Discard {
        void operator()(zip_t* opened) const { zip_discard(opened); }
    };
    std::string name, bytes;  // `bytes` is empty for a file
    std::unique_ptr<zip_t, Discard> zip;

    zip_stat_t about(std::uint64_t entry) const {
        zip_stat_t stat;
        zip_stat_init(&stat);
        if (zip_stat_index(zip.get(), entry, 0, &stat) != 0 || stat.name == nullptr)
            input_error({name}, "the directory of the zip archive is damaged at its file {}", entry + 1);
        return stat;
    }
    // Takes the archive, or throws the error.
    void take(zip_t* opened, zip_error_t& error) {
        zip.reset(opened);
        const std::string cause = opened ? std::string() : one_line(zip_error_strerror(&error));
        zip_error_fini(&error);
        if (!opened) input_error({name}, "the zip archive cannot be read: {}", cause);
    }
};

ZipArchive::ZipArchive(const std::filesystem::path& file)
    : state_(std::make_unique<State>(State{file.string(), {}, {}})) {
    require_readable(file);
    int code = 0;
    zip_t* opened = zip_open(file.c_str(), ZIP_RDONLY, &code);
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    state_->take(opened, error);
}

ZipArchive::ZipArchive(std::string bytes, std::string name)
    : state_(std::make_unique<State>(State{std::move(name), std::move(bytes), {}})) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(state_->bytes.data(), state_->bytes.size(), 0, &error);
    zip_t* opened = source ? zip_open_from_source(source, ZIP_RDONLY, &error) : nullptr;
    if (source && !opened) zip_source_free(source);
    state_->take(opened, error);
}

ZipArchive::~ZipArchive() = default;
ZipArchive::ZipArchive(ZipArchive&&) noexcept = default;
ZipArchive& ZipArchive::operator=(ZipArchive&&) noexcept = default;

std::uint64_t ZipArchive::entries() const {
    return static_cast<std::uint64_t>(zip_get_num_entries(state_->zip.get(), 0));
}
std::uint64_t ZipArchive::size(std::uint64_t entry) const {
    return state_->about(entry).size;
}
std::string ZipArchive::path(std::uint64_t entry) const {
    return state_->about(entry).name;
}
std::string ZipArchive::inner_name(std::uint64_t entry) const {
    return one_line(plain_text(path(entry)));
}
std::string ZipArchive::name(std::uint64_t entry) const {
    return state_->name + "/" + inner_name(entry);
}

std::optional<std::uint64_t> ZipArchive::find(std::string_view wanted) const {
    std::optional<std::uint64_t> found;
    int similar = 0;
    for (std::uint64_t i = 0; i < entries(); ++i) {
        const std::string given = path(i);
        if (given == wanted) return i;
        if (lower_case(given) == lower_case(wanted)) found = i, ++similar;
    }
    return similar == 1 ? found : std::nullopt;
}

std::string ZipArchive::text(std::uint64_t entry) const {
    Reader reader(*this, entry);
    constexpr std::size_t kBlock = std::size_t{1} << 18;
    std::string text;
    for (std::size_t got = kBlock; got == kBlock;) {
        const std::size_t size = text.size();
        text.resize(size + kBlock);
        got = reader.read(text.data() + size, kBlock);
        text.resize(size + got);
    }
    return text;
}

struct ZipArchive::Reader::File {
    struct Close {
        void operator()(zip_file_t* file) const { zip_fclose(file); }
    };
    std::unique_ptr<zip_file_t, Close> in;
};

ZipArchive::Reader::Reader(const ZipArchive& archive, std::uint64_t entry)
    : archive_(&archive), entry_(entry), file_(std::make_unique<File>()) {
    rewind();
}

ZipArchive::Reader::~Reader() = default;

void ZipArchive::Reader::rewind() {
    packed_ = archive_->state_->about(entry_).comp_size;
    made_ = 0;
    file_->in.reset(zip_fopen_index(archive_->state_->zip.get(), entry_, 0));
    if (file_->in) return;
    input_error({archive_->name(entry_)}, "cannot be unpacked: {}",
                one_line(zip_strerror(archive_->state_->zip.get())));
}

std::size_t ZipArchive::Reader::read(void* to, std::size_t bytes) {
    std::size_t done = 0;
    for (zip_int64_t got = 1; got > 0 && done < bytes; done += static_cast<std::size_t>(got)) {
        if (is_packed_trap(made_ + done, packed_)) refuse_packed_trap(archive_->name(entry_));
        got = zip_fread(file_->in.get(), static_cast<std::byte*>(to) + done, bytes - done);
        if (got < 0) {
            input_error({archive_->name(entry_)}, "its compressed data are damaged: {}",
                        one_line(zip_file_strerror(file_->in.get())));
        }
    }
    made_ += done;
    return done;
}

bool is_zip(std::string_view first) {
    return first.starts_with("PK\x03\x04") || first.starts_with("PK\x05\x06");
}

}  // namespace lucerna
