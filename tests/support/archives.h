// Packs bytes as gzip and zip do.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace lucerna::testing {

inline std::uint32_t crc_of(const std::string& bytes) {
    return static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

// Returns the bytes by RFC 1951.
inline std::string deflated(const std::string& bytes) {
    z_stream stream{};
    if (deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::runtime_error("no deflate");
    std::string out(compressBound(static_cast<uLong>(bytes.size())) + 16, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    deflate(&stream, Z_FINISH);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

// Appends a whole number of `size` bytes, the lowest first.
inline void append_whole(std::string& bytes, std::uint64_t number, int size) {
    for (int i = 0; i < size; ++i) bytes += static_cast<char>(number >> (8 * i) & 0xff);
}

// Returns the bytes by RFC 1952.
inline std::string gzip_of(const std::string& bytes) {
    std::string file("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10);
    file += deflated(bytes);
    append_whole(file, crc_of(bytes), 4);
    append_whole(file, bytes.size(), 4);
    return file;
}

struct ZipEntry {
    std::string name, bytes;
    bool packed = true;  // else stored
    bool encrypted = false;
};

// Returns an archive by APPNOTE.TXT 6.3.
inline std::string zip_of(const std::vector<ZipEntry>& entries) {
    std::string file, directory;
    for (const ZipEntry& entry : entries) {
        const std::string data = entry.packed ? deflated(entry.bytes) : entry.bytes;
        std::string common;  // to both headers
        append_whole(common, 20, 2);
        append_whole(common, entry.encrypted ? 1 : 0, 2);
        append_whole(common, entry.packed ? 8 : 0, 2);
        append_whole(common, 0x21 << 16, 4);  // 1980-01-01
        append_whole(common, crc_of(entry.bytes), 4);
        append_whole(common, data.size(), 4);
        append_whole(common, entry.bytes.size(), 4);
        append_whole(common, entry.name.size(), 2);
        append_whole(common, 0, 2);
        directory += std::string("PK\1\2\x14\0", 6) + common;
        append_whole(directory, 0, 2 + 2 + 2 + 4);
        append_whole(directory, file.size(), 4);
        directory += entry.name;
        file += "PK\3\4" + common + entry.name + data;
    }
    std::string end("PK\5\6\0\0\0\0", 8);
    append_whole(end, entries.size(), 2);
    append_whole(end, entries.size(), 2);
    append_whole(end, directory.size(), 4);
    append_whole(end, file.size(), 4);
    append_whole(end, 0, 2);
    return file + directory + end;
}

}  // namespace lucerna::testing
