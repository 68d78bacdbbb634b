// libFuzzer's entry to the sums of an interrupted acquisition: bytes give sums for the requesting rig or an
// InputError. The file's checksum is corrected first, because it only protects against damage, not against
// malice.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "engine/cli/light/sums_file.h"
#include "engine/system/hash.h"
#include "tests/fuzz/input.h"

using lucerna::testing::bytes_of_input;
using lucerna::testing::file_of_bytes;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

constexpr std::uint64_t kKey = 7;
// Offsets of the file's head, as in sums_file.cpp: words of eight bytes, of which the checksum is the last.
constexpr std::size_t kAtBlocks = 24, kAtNumbers = 40, kWords = 26 + 3, kAtCheck = kAtNumbers + 8 * kWords,
                      kHead = kAtCheck + 8;

// Returns the rig to which the corpus's sums belong.
lucerna::Rig rig() {
    lucerna::Rig rig;
    rig.views = {2, 1};
    rig.spacing = {0.01, 0.01};
    rig.pixels = {2, 3};
    rig.pixel = {0.01, 0.01};
    rig.distance = 0.1;
    return rig;
}

void repair(std::vector<std::byte>& bytes) {
    if (bytes.size() < kHead) return;
    lucerna::WordHash check;
    const auto add = [&](std::size_t at) {
        std::uint64_t word = 0;
        std::memcpy(&word, &bytes[at], 8);
        check.add(word);
    };
    add(kAtBlocks);
    for (std::size_t i = 0; i < kWords; ++i) add(kAtNumbers + 8 * i);
    for (std::size_t at = kHead; at + 8 <= bytes.size(); at += 8) add(at);
    const std::uint64_t value = check.value();
    std::memcpy(&bytes[kAtCheck], &value, 8);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::vector<std::byte> bytes = bytes_of_input(data, size);
    repair(bytes);
    try {
        const auto state = lucerna::load_state(file_of_bytes(bytes, ".part"), kKey, rig());
        if (!state) {  // interrupted before there are any sums
            std::uint64_t blocks = 1;
            if (bytes.size() >= kHead) std::memcpy(&blocks, &bytes[kAtBlocks], 8);
            require(blocks == 0, "a file is no file");
            return 0;
        }
        require(state->blocks >= 0, "fewer than no blocks");
        require(state->sums.positive.size() == rig().coefficients(), "sums are missing");
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
