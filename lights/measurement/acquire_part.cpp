#include "lights/measurement/acquire.h"

#include <fcntl.h>
#include <unistd.h>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kMagic = 0x31545241504c4355U;  // "UCLPART1"

struct Head {
    std::uint64_t magic, key;
};

struct Record {
    std::uint64_t column, count, checksum;
};

std::uint64_t checksum(std::uint64_t column, std::span<const float> values) {
    WordHash hash;
    hash.add(column);
    for (const float v : values) hash.add(v);
    return hash.value();
}

template <typename T>
bool read_one(std::istream& in, T& value) {
    return bool(in.read(reinterpret_cast<char*>(&value), sizeof(T)));
}
template <typename T>
void write_one(std::ostream& out, const T& value) {
    out.write(reinterpret_cast<const char*>(&value), sizeof(T));
}
bool read_floats(std::istream& in, std::span<float> values) {
    return bool(
        in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size_bytes())));
}

}  // namespace

void require_own_part(const std::filesystem::path& file) {
    std::error_code none;
    const auto status = std::filesystem::symlink_status(file, none);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
        throw InputError({file.string()},
                         "is a link, folder, pipe or device, not an unfinished acquisition; remove it, or "
                         "choose another output");
}

AcquirePart::AcquirePart(const std::filesystem::path& file, std::uint64_t key) : file_(file) {
    require_own_part(file);
    std::error_code none;
    const std::uintmax_t size = std::filesystem::file_size(file, none);
    if (!none && size > 0) {
        read_list(key);
    } else {
        begin(key);
    }
}

void AcquirePart::begin(std::uint64_t key) {
    constexpr auto kMode = std::ios::binary | std::ios::in | std::ios::out | std::ios::trunc;
    // The file is created here or known to be regular, so no link is followed.
    const int made = open(file_.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (made >= 0) close(made);
    if (made >= 0) stream_.open(file_, kMode);
    write_one(stream_, Head{kMagic, key});
    if (!stream_.flush()) throw InputError({file_.string()}, "cannot be written");
}

void AcquirePart::read_list(std::uint64_t key) {
    stream_.open(file_, std::ios::binary | std::ios::in | std::ios::out);
    if (!stream_) throw InputError({file_.string()}, "cannot be opened");
    const std::uintmax_t size = std::filesystem::file_size(file_);
    Head head{};
    if (!read_one(stream_, head) || head.magic != kMagic) {
        throw InputError({file_.string()},
                         "is not an unfinished acquisition; remove it, or choose another output");
    }
    if (head.key != key && size < sizeof(Head) + sizeof(Record)) {
        stream_.close();
        return begin(key);
    }
    if (head.key != key) {
        throw InputError({file_.string()},
                         "is an unfinished acquisition with another description; finish that, remove the "
                         "file, or choose another output");
    }
    std::uintmax_t good = sizeof(Head);
    std::vector<float> values;
    for (Record record{}; read_one(stream_, record);) {
        const std::uintmax_t rest = size - good - sizeof(Record);  // >= 0, because the record was read
        if (record.count > rest / sizeof(float) || record.column > INT32_MAX) break;
        values.resize(record.count);
        if (!read_floats(stream_, values) || checksum(record.column, values) != record.checksum) break;
        places_[static_cast<int>(record.column)] = {good + sizeof(Record), record.count};
        good += sizeof(Record) + record.count * sizeof(float);
    }
    // The rest was being written when the work ended. The stream is reopened because its buffer holds it.
    stream_.close();
    std::filesystem::resize_file(file_, good);
    stream_.open(file_, std::ios::binary | std::ios::in | std::ios::out);
    if (!stream_) throw InputError({file_.string()}, "cannot be opened");
}

bool AcquirePart::take(int column, std::span<float> values) {
    const std::scoped_lock lock(mutex_);
    const auto place = places_.find(column);
    if (place == places_.end() || place->second.count != values.size()) return false;
    stream_.seekg(static_cast<std::streamoff>(place->second.offset));
    if (!read_floats(stream_, values)) throw InputError({file_.string()}, "can no longer be read");
    return true;
}

void AcquirePart::keep(int column, std::span<const float> values) {
    const auto number = static_cast<std::uint64_t>(column);
    const Record record{number, values.size(), checksum(number, values)};
    const std::scoped_lock lock(mutex_);
    stream_.seekp(0, std::ios::end);
    write_one(stream_, record);
    stream_.write(reinterpret_cast<const char*>(values.data()),
                  static_cast<std::streamsize>(values.size_bytes()));
    if (!stream_.flush()) throw WriteError({file_.string()}, "cannot be written: is the disk full?");
}

}  // namespace lucerna
