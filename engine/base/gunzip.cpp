// The only file that names zlib.
#include <zlib.h>

#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/files.h"

namespace lucerna {
namespace {

// Frees what inflateInit2 made.
struct Inflater {
    z_stream stream{};
    Inflater() {
        constexpr int kGzip = 16 + MAX_WBITS;
        if (inflateInit2(&stream, kGzip) != Z_OK) throw std::bad_alloc();
    }
    ~Inflater() { inflateEnd(&stream); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;
};

}  // namespace

bool is_gzip(const std::vector<std::byte>& bytes) {
    return bytes.size() >= 2 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b};
}

std::vector<std::byte> gunzip(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                              std::size_t most) {
    Inflater inflater;
    z_stream& in = inflater.stream;
    std::vector<std::byte> out(std::min(most, 4 * packed.size() + 1024));
    std::size_t taken = 0, made = 0;
    for (;;) {
        constexpr std::size_t kStep = std::size_t{1} << 30;  // zlib counts in 32 bits
        const std::size_t offered = std::min(kStep, packed.size() - taken);
        const std::size_t room = std::min(kStep, out.size() - made);
        in.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data() + taken));  // only read
        in.avail_in = static_cast<uInt>(offered);
        in.next_out = reinterpret_cast<Bytef*>(out.data() + made);
        in.avail_out = static_cast<uInt>(room);
        const int state = inflate(&in, Z_NO_FLUSH);
        taken += offered - in.avail_in;
        made += room - in.avail_out;
        if (state == Z_STREAM_END) {
            if (taken == packed.size()) break;
            inflateReset(&in);  // a file may be several, one after the other
        } else if (state != Z_OK && state != Z_BUF_ERROR) {
            throw InputError({file.string()}, "its compressed data are damaged");
        } else if (made == out.size()) {
            if (made == most) {
                throw InputError({file.string()},
                                 fmt::format("unpacks to more than {} bytes; no more are accepted", most));
            }
            out.resize(std::min(most, 2 * out.size()));
        } else if (taken == packed.size()) {
            throw InputError({file.string()}, "its compressed data end too early");
        }
    }
    out.resize(made);
    return out;
}

}  // namespace lucerna
