#include "engine/image/pictures.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "engine/base/error.h"
#include "engine/system/content.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little, "OpenEXR headers are little-endian");

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kVersion = 2, kVersionMask = 0xFF, kLongNames = 0x400;
constexpr std::uint32_t kSeveralParts = 0x1000;  // other flags: tiles, deep data
constexpr std::size_t kLongestExrName = 255;
// The library makes room for a block of lines before it has seen any of it: at most 32 of halves in light
// fields, and by DWAB 256 of anything. Packed light fields are not a thousandth as large as unpacked; the
// bound is far from that. Runs of one value, packed twice as by DWA, get further.
struct Packing {
    std::int64_t lines, best;
};
constexpr Packing kOfLightFields{32, 1 << 12}, kOfAny{256, 1 << 16};
constexpr std::int64_t kSmallBlock = 1 << 20;
constexpr int kMostParts = 32;                       // of light fields
constexpr std::int64_t kWidestLightField = 1 << 24;  // pixels of the atlas, each way: as much as is written

// The library reads as much as a type wants, not as much as the header says; with other sizes the two would
// part, and what is checked here would not be what is read there. Below 0: any whole number of so many bytes.
struct AttributeType {
    std::string_view name;
    std::int32_t bytes;
};
constexpr AttributeType kTypes[] = {
    {"box2i", 16},      {"box2f", 16}, {"chlist", -1},      {"chromaticities", 32},
    {"compression", 1}, {"double", 8}, {"floatvector", -4}, {"envmap", 1},
    {"float", 4},       {"int", 4},    {"keycode", 28},     {"lineOrder", 1},
    {"m33f", 36},       {"m44f", 64},  {"rational", 8},     {"string", -1},
    {"timecode", 8},    {"v2i", 8},    {"v2f", 8},          {"v2d", 16},
    {"v3i", 12},        {"v3f", 12},   {"v3d", 24}};
// Those that other images have as well; types that are not known here are not known to the library either,
// which takes as many bytes as the header says.
constexpr AttributeType kMoreTypes[] = {
    {"tiledesc", 9}, {"deepImageState", 1}, {"preview", -1}, {"stringvector", -1}};

bool is_of_light(ExrKind kind) {
    return kind != ExrKind::any;
}

std::optional<std::int32_t> bytes_of(std::span<const AttributeType> types, const std::string& type) {
    const auto known =
        std::find_if(types.begin(), types.end(), [&type](const AttributeType& t) { return t.name == type; });
    return known == types.end() ? std::nullopt : std::optional(known->bytes);
}

void check_type(const std::string& type, std::int32_t size, ExrKind kind) {
    std::optional<std::int32_t> bytes = bytes_of(kTypes, type);
    if (!bytes && is_of_light(kind))
        throw InputError("not a light field: the OpenEXR file has an attribute of an unexpected type");
    if (!bytes) bytes = bytes_of(kMoreTypes, type);
    if (bytes && !(*bytes >= 0 ? size == *bytes : size % -*bytes == 0)) {
        throw InputError(
            fmt::format("damaged OpenEXR file: an attribute of type {} and {} bytes", type, size));
    }
}

// Channels: a name, its NUL, 16 bytes; an empty name ends the list, and must end the attribute. How many.
std::int64_t count_channels(const std::string& list) {
    std::size_t at = 0;
    std::int64_t count = 0;
    for (; at < list.size() && list[at] != '\0'; ++count)
        at = list.find('\0', at) == list.npos ? list.size() : list.find('\0', at) + 17;
    if (at + 1 != list.size()) throw InputError("damaged OpenEXR file: an unterminated list of channels");
    return count;
}

// Texts, each after its length.
void check_texts(const std::string& list) {
    for (std::size_t at = 0; at < list.size();) {
        std::int32_t length = -1;
        if (list.size() - at >= sizeof length) std::memcpy(&length, &list[at], sizeof length);
        at += sizeof length;
        if (length < 0 || static_cast<std::size_t>(length) > list.size() - at)
            throw InputError("damaged OpenEXR file: a list of strings with a wrong length");
        at += static_cast<std::size_t>(length);
    }
}

// A small picture: width and height, then four bytes for each pixel.
void check_preview(const std::string& preview) {
    std::array<std::uint32_t, 2> size{};
    if (preview.size() >= sizeof size) std::memcpy(size.data(), preview.data(), sizeof size);
    const std::uint64_t pixels = std::uint64_t{size[0]} * size[1];
    if (preview.size() < sizeof size || pixels != (preview.size() - sizeof size) / 4)
        throw InputError("damaged OpenEXR file: a preview with a wrong size");
}

class HeaderReader {
  public:
    explicit HeaderReader(const std::filesystem::path& file)
        : in_(open_to_read(file)), left_(std::filesystem::file_size(file)), bytes_(left_) {}

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
            if (name.size() == kLongestExrName)
                throw InputError("damaged OpenEXR file: an unterminated name");
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

// What a part's header says about its pixels.
struct Part {
    std::array<std::int32_t, 4> window{0, 0, -1, -1};
    std::int64_t channels = 0;
    std::array<std::uint32_t, 2> tile{0, 0};  // 0: scan lines
    std::string type;                         // of image, where there are several parts
    std::int32_t chunks = 0;                  // as they are stated there
};

// Bytes of width × height pixels of the part; more than there can be stays more.
double bytes_of(const Part& part, std::int64_t width, std::int64_t height) {
    return static_cast<double>(width) * static_cast<double>(height) * 4 * static_cast<double>(part.channels);
}

void check_sizes(const Part& part, std::int64_t file_bytes, ExrKind kind) {
    const Packing packing = is_of_light(kind) ? kOfLightFields : kOfAny;
    const std::int64_t width = std::int64_t{part.window[2]} - part.window[0] + 1;
    const std::int64_t height = std::int64_t{part.window[3]} - part.window[1] + 1;
    const bool there = width > 0 && height > 0;
    if (is_of_light(kind) && std::max(width, height) > kWidestLightField) {
        throw InputError(fmt::format("damaged light field: an image of {} x {} pixels; at most {} on a side",
                                     width, height, kWidestLightField));
    }
    // Every block and every tile has an entry of 8 bytes in the table of offsets that follows the header.
    double entries = static_cast<double>(height) / static_cast<double>(packing.lines);
    double block = bytes_of(part, width, packing.lines);
    if (part.tile[0] > 0 && part.tile[1] > 0) {
        entries = std::ceil(static_cast<double>(width) / part.tile[0]) *
                  std::ceil(static_cast<double>(height) / part.tile[1]);
        block = bytes_of(part, part.tile[0], part.tile[1]);
    }
    double most = static_cast<double>(file_bytes * packing.best + kSmallBlock);
    // The whole of a light field is measured where its views are known.
    if (kind == ExrKind::any) block = std::max(block, bytes_of(part, width, height));
    if (is_of_light(kind)) most *= 2;  // of halves
    if (!there || entries > static_cast<double>(file_bytes) / 8 || block > most) {
        throw InputError(fmt::format("damaged OpenEXR file: an image of {} x {} pixels in {} bytes", width,
                                     height, file_bytes));
    }
    // Of a block, the library holds the packed bytes and the unpacked ones, for every thread that it reads
    // with.
    const double lines = bytes_of(part, width, std::min(packing.lines, height));
    require_memory(static_cast<std::uint64_t>(std::min(2 * lines, 1e18)),
                   fmt::format("an OpenEXR image {} pixels wide", width), "use a narrower one");
}

void read_attribute(HeaderReader& reader, const std::string& name, const std::string& type, std::int32_t size,
                    Part& part) {
    if (name == "dataWindow" && type == "box2i") {
        part.window = reader.value<std::array<std::int32_t, 4>>();
    } else if (name == "chunkCount" && type == "int") {
        part.chunks = reader.value<std::int32_t>();
    } else if (name == "type" && type == "string") {
        part.type.resize(static_cast<std::size_t>(size));
        reader.read(part.type.data(), part.type.size());
    } else if (type == "tiledesc") {
        part.tile = reader.value<std::array<std::uint32_t, 2>>();
        reader.skip(1);
    } else if (type == "chlist" || type == "stringvector" || type == "preview") {
        std::string value(static_cast<std::size_t>(size), '\0');
        reader.read(value.data(), value.size());
        // A list by another name is an attribute that the library reads, and no list of what the file has.
        if (type == "chlist") {
            const std::int64_t channels = count_channels(value);
            if (name == "channels") part.channels = channels;
        }
        if (type == "stringvector") check_texts(value);
        if (type == "preview") check_preview(value);
    } else {
        reader.skip(static_cast<std::uint64_t>(size));
    }
}

// One part's header; false if there is none: an empty name where its first attribute would be.
bool check_part(HeaderReader& reader, ExrKind kind) {
    Part part;
    bool any = false;
    for (std::string name = reader.name(); !name.empty(); name = reader.name()) {
        any = true;
        const std::string type = reader.name();
        const auto size = reader.value<std::int32_t>();
        if (size < 0 || static_cast<std::uint64_t>(size) > reader.left()) {
            throw InputError(fmt::format("damaged OpenEXR file: an attribute of {} bytes, and {} are left",
                                         size, reader.left()));
        }
        check_type(type, size, kind);
        read_attribute(reader, name, type, size, part);
    }
    if (!any) return false;
    check_sizes(part, reader.bytes(), kind);
    // The library makes a table of as many chunks as are stated.
    if (part.chunks < 0 || part.chunks > reader.bytes() / 8) {
        throw InputError(fmt::format("damaged OpenEXR file: a part of {} chunks in {} bytes", part.chunks,
                                     reader.bytes()));
    }
    if (kind == ExrKind::light_fields && !part.type.empty() && part.type != "scanlineimage")
        throw InputError("not a light field: a part of the OpenEXR file is not made of scan lines");
    return true;
}

}  // namespace

int check_exr_header(const std::filesystem::path& file, ExrKind kind) {
    HeaderReader reader(file);
    if (reader.bytes() < 8 || reader.value<std::uint32_t>() != kMagic)
        throw InputError(fmt::format("not an OpenEXR file: {}", content_of(file)));
    const auto version = reader.value<std::uint32_t>();
    const bool several = (version & kSeveralParts) != 0;
    if (kind == ExrKind::light_field && (version & ~kLongNames) == (kVersion | kSeveralParts))
        throw InputError("an OpenEXR file of several parts; expected a single light field");
    if (kind == ExrKind::light_field && (version & ~kLongNames) != kVersion)
        throw InputError("not a single-part scan-line OpenEXR file of version 2");
    if (kind == ExrKind::light_fields && (version & ~(kLongNames | kSeveralParts)) != kVersion)
        throw InputError("not a scan-line OpenEXR file of version 2");
    if ((version & kVersionMask) != kVersion) throw InputError("not an OpenEXR file of version 2");
    if (!check_part(reader, kind)) throw InputError("damaged OpenEXR file: it has an empty header");
    int parts = 1;
    while (several && check_part(reader, kind)) {
        if (++parts > kMostParts && is_of_light(kind))
            throw InputError(fmt::format("an OpenEXR file of more than {} parts", kMostParts));
    }
    return parts;
}

}  // namespace lucerna
