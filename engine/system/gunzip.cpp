#include "engine/system/gunzip.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>

#include "engine/base/error.h"
#include "engine/system/memory.h"

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

// The last four bytes: how many there were before they were packed, modulo 2^32. Of a file of several pieces
// that is the last one's; so there are at least so many, or the data are damaged. Believed as far as deflate
// can pack.
std::size_t told_size(const std::vector<std::byte>& packed) {
    constexpr std::size_t kBest = 1032;
    std::uint32_t size = 0;
    if (packed.size() >= sizeof size) std::memcpy(&size, &packed[packed.size() - sizeof size], sizeof size);
    return size / kBest <= packed.size() ? size : 0;
}

// No scene, mesh or ray file is so even that it packs like this, once it is large: only a trap does.
constexpr std::size_t kMostTimes = 400, kLittle = std::size_t{64} << 20;

// Into a container of bytes or characters.
template <typename Container>
Container unpacked(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                   std::size_t most) {
    Inflater inflater;
    z_stream& in = inflater.stream;
    Container out;
    const auto make_room = [&](std::size_t bytes) {
        require_memory(bytes, file.string() + ", unpacked", "use a smaller file");
        out.resize(bytes);
    };
    const auto refuse_a_trap = [&](std::size_t bytes, std::size_t from) {
        if (bytes <= kLittle || bytes / kMostTimes <= from) return;
        throw InputError(
            {file.string()},
            fmt::format("expands to more than {} times its size; such files may be at most {} MiB",
                        kMostTimes, kLittle >> 20));
    };
    const std::size_t told = told_size(packed);
    refuse_a_trap(told, packed.size());
    // Room for no more than is accepted, and one byte more, so that the end is found without growing.
    most = std::min(most, std::max(kLittle, kMostTimes * packed.size()) + kMostTimes);
    make_room(std::min(most, std::max(told + 1, 4 * packed.size() + 1024)));
    std::size_t taken = 0, made = 0;
    for (;;) {
        constexpr std::size_t kStep = std::size_t{1} << 26;  // zlib counts in 32 bits
        const std::size_t offered = std::min(kStep, packed.size() - taken);
        const std::size_t room = std::min(kStep, out.size() - made);
        in.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data() + taken));  // only read
        in.avail_in = static_cast<uInt>(offered);
        in.next_out = reinterpret_cast<Bytef*>(out.data() + made);
        in.avail_out = static_cast<uInt>(room);
        const int state = inflate(&in, Z_NO_FLUSH);
        taken += offered - in.avail_in;
        made += room - in.avail_out;
        refuse_a_trap(made, taken);
        if (state == Z_STREAM_END) {
            if (taken == packed.size()) break;
            inflateReset(&in);  // a file may be several, one after the other
        } else if (state != Z_OK && state != Z_BUF_ERROR) {
            throw InputError({file.string()}, "its compressed data are damaged");
        } else if (made == out.size()) {
            if (made == most) {
                throw InputError({file.string()},
                                 fmt::format("expands to more than {} bytes, the limit", most));
            }
            // By large steps, as what is there is copied each time, while that leaves memory for others.
            const std::size_t there = available_memory().value_or(most);
            make_room(std::min(most, (8 * out.size() <= there ? 4 : 2) * out.size()));
        } else if (taken == packed.size()) {
            throw InputError({file.string()}, "its compressed data end too early");
        }
    }
    out.resize(made);
    return out;
}

}  // namespace

bool is_gzip(const std::vector<std::byte>& bytes) {
    return bytes.size() >= 2 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b};
}

std::vector<std::byte> gunzip(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                              std::size_t most) {
    return unpacked<std::vector<std::byte>>(packed, file, most);
}

std::string gunzip_text(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                        std::size_t most) {
    return unpacked<std::string>(packed, file, most);
}

}  // namespace lucerna
