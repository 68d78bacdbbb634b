#include "lights/exr_guard.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little, "OpenEXR headers are little-endian");

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kVersion = 2, kLongNames = 0x400;  // other flags: tiles, deep data, several parts
constexpr std::size_t kLongestName = 255;
// The library makes room for a block of at most 32 lines of halves before it has seen any of it. Packed light
// fields are not a thousandth as large as unpacked; the bound is far from that.
constexpr std::int64_t kBlockLines = 32, kBestPacking = 1 << 12, kSmallBlock = 1 << 20;

// The library reads as much as a type wants, not as much as the header says; with other sizes the two would
// part, and what is checked here would not be what is read there. -1: any size.
struct AttributeType {
    std::string_view name;
    std::int32_t bytes;
};
constexpr AttributeType kTypes[] = {
    {"box2i", 16},      {"box2f", 16},   {"chlist", -1},   {"chromaticities", 32},
    {"compression", 1}, {"double", 8},   {"envmap", 1},    {"float", 4},
    {"int", 4},         {"keycode", 28}, {"lineOrder", 1}, {"m33f", 36},
    {"m44f", 64},       {"rational", 8}, {"string", -1},   {"timecode", 8},
    {"v2i", 8},         {"v2f", 8},      {"v2d", 16},      {"v3i", 12},
    {"v3f", 12},        {"v3d", 24}};

void check_type(const std::string& type, std::int32_t size) {
    const auto* known = std::find_if(std::begin(kTypes), std::end(kTypes),
                                     [&type](const AttributeType& t) { return t.name == type; });
    if (known == std::end(kTypes))
        throw InputError("no light field: the OpenEXR file has an attribute of a type that they do not have");
    if (known->bytes >= 0 && known->bytes != size) {
        throw InputError(
            fmt::format("damaged OpenEXR file: an attribute of type {} and {} bytes", known->name, size));
    }
}

// Channels: a name, its NUL, 16 bytes; an empty name ends the list, and must end the attribute.
void check_channels(const std::string& list) {
    std::size_t at = 0;
    while (at < list.size() && list[at] != '\0')
        at = list.find('\0', at) == list.npos ? list.size() : list.find('\0', at) + 17;
    if (at + 1 != list.size()) throw InputError("damaged OpenEXR file: a list of channels without an end");
}

class Walker {
  public:
    explicit Walker(const std::filesystem::path& file)
        : in_(file, std::ios::binary), left_(std::filesystem::file_size(file)), bytes_(left_) {}

    void read(void* to, std::uint64_t bytes) {
        if (bytes > left_) throw InputError("damaged OpenEXR file: it ends in its header");
        in_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
        if (!in_) throw InputError("reading stopped in the OpenEXR header");
        left_ -= bytes;
    }
    template <typename T>
    T value() {
        T value;
        read(&value, sizeof value);
        return value;
    }
    // Up to its NUL; empty at the end of the header.
    std::string name() {
        std::string name;
        for (char c = value<char>(); c != '\0'; c = value<char>()) {
            if (name.size() == kLongestName) throw InputError("damaged OpenEXR file: a name without an end");
            name += c;
        }
        return name;
    }
    void skip(std::uint64_t bytes) {
        in_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur);
        left_ -= bytes;
    }
    std::uint64_t left() const { return left_; }
    std::int64_t bytes() const { return static_cast<std::int64_t>(bytes_); }

  private:
    std::ifstream in_;
    std::uint64_t left_, bytes_;
};

void check_data_window(const std::array<std::int32_t, 4>& window, std::int64_t file_bytes) {
    const std::int64_t width = std::int64_t{window[2]} - window[0] + 1;
    const std::int64_t height = std::int64_t{window[3]} - window[1] + 1;
    const bool there = width > 0 && height > 0;
    // Every 32 lines, at most, have an entry of 8 bytes in the table of offsets that follows the header.
    const bool fits = height / kBlockLines <= file_bytes / 8 &&
                      width * kBlockLines * 2 <= file_bytes * kBestPacking + kSmallBlock;
    if (!there || !fits) {
        throw InputError(fmt::format("damaged OpenEXR file: an image of {} x {} pixels in {} bytes", width,
                                     height, file_bytes));
    }
}

}  // namespace

void check_exr_header(const std::filesystem::path& file) {
    Walker walker(file);
    if (walker.bytes() < 8 || walker.value<std::uint32_t>() != kMagic)
        throw InputError("no OpenEXR file: it does not start with the number 20000630");
    const auto version = walker.value<std::uint32_t>();
    if ((version & ~kLongNames) != kVersion)
        throw InputError("not a single-part scan-line OpenEXR file of version 2");
    for (std::string name = walker.name(); !name.empty(); name = walker.name()) {
        const std::string type = walker.name();
        const auto size = walker.value<std::int32_t>();
        if (size < 0 || static_cast<std::uint64_t>(size) > walker.left()) {
            throw InputError(fmt::format("damaged OpenEXR file: an attribute of {} bytes, and {} are left",
                                         size, walker.left()));
        }
        check_type(type, size);
        if (name == "dataWindow" && size == 16) {
            check_data_window(walker.value<std::array<std::int32_t, 4>>(), walker.bytes());
        } else if (type == "chlist") {
            std::string list(static_cast<std::size_t>(size), '\0');
            walker.read(list.data(), list.size());
            check_channels(list);
        } else {
            walker.skip(static_cast<std::uint64_t>(size));
        }
    }
}

}  // namespace lucerna
