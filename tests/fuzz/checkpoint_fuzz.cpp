// libFuzzer's entry to checkpoints: bytes give a consistent state or an InputError. The file's checksum is
// corrected first, because it only protects against damage, not against malice.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "engine/render/checkpoint.h"
#include "engine/system/hash.h"
#include "tests/fuzz/input.h"

using lucerna::testing::bytes_of_input;
using lucerna::testing::file_of_bytes;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

// Offsets of the file's head, as in checkpoint.cpp.
constexpr std::size_t kAtText = 16, kAtTiles = 24, kAtFilm = 32, kAtCheck = 40, kHead = 48;

void repair(std::vector<std::byte>& bytes) {
    if (bytes.size() < kHead) return;
    const auto length = [&bytes](std::size_t at) {
        std::uint64_t value = 0;
        std::memcpy(&value, &bytes[at], 8);
        return value;
    };
    std::memset(&bytes[kAtCheck], 0, 8);
    lucerna::WordHash check;
    check.add_bytes(std::span(bytes).first(kHead));
    std::span<const std::byte> rest = std::span(bytes).subspan(kHead);
    if (length(kAtTiles) > rest.size() / 4) return;
    for (const std::uint64_t part : {length(kAtText), length(kAtTiles) * 4, length(kAtFilm)}) {
        if (part > rest.size()) return;
        check.add_bytes(rest.first(part));
        rest = rest.subspan(part);
    }
    const std::uint64_t value = check.value();
    std::memcpy(&bytes[kAtCheck], &value, 8);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::vector<std::byte> bytes = bytes_of_input(data, size);
    repair(bytes);
    const std::filesystem::path file = file_of_bytes(bytes, ".checkpoint");
    try {
        const lucerna::Checkpoint checkpoint = lucerna::load_checkpoint(file);
        require(checkpoint.film.size() + 4 * checkpoint.tiles.size() <= size, "more than the file holds");
        require(checkpoint.samples_done >= 0 && checkpoint.passes_done >= 0, "a count is negative");
        require(checkpoint.seconds >= 0, "the time is no number");
        for (const std::int32_t samples : checkpoint.tiles) {
            require(samples >= checkpoint.samples_done, "a tile lacks samples");
        }
        lucerna::require_same(file, checkpoint.facts, checkpoint.facts);
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
