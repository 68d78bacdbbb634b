// libFuzzer's entry to saved photon maps: bytes give maps of valid photons or an InputError. The file's
// checksum is corrected first, because it only protects against damage, not against malice.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "engine/system/hash.h"
#include "photon/build_maps.h"
#include "tests/fuzz/input.h"

using lucerna::kMapKinds;
using lucerna::testing::bytes_of_input;
using lucerna::testing::file_of_bytes;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

// Offsets of the file's head, as in map_file.cpp.
constexpr std::size_t kAtText = 16, kAtPhotons = kAtText + 8 + sizeof(lucerna::V3d);
constexpr std::size_t kAtCheck =
    kAtPhotons + kMapKinds * (8 + sizeof(lucerna::DepositCount)) + sizeof(lucerna::Ledger);
constexpr std::size_t kHead = kAtCheck + 8;

void repair(std::vector<std::byte>& bytes) {
    if (bytes.size() < kHead) return;
    std::memset(&bytes[kAtCheck], 0, 8);
    std::uint64_t text = 0, counts[kMapKinds];
    std::memcpy(&text, &bytes[kAtText], sizeof text);
    std::memcpy(counts, &bytes[kAtPhotons], sizeof counts);
    lucerna::WordHash check;
    std::span<const std::byte> rest = std::span(bytes).subspan(kHead);
    if (text <= rest.size()) {
        check.add_bytes(rest.first(text));
        rest = rest.subspan(text);
    }
    for (const std::uint64_t count : counts) {
        for (const std::size_t one : {sizeof(lucerna::V3f), sizeof(lucerna::PackedDirection),
                                      sizeof(lucerna::Photon), sizeof(lucerna::BounceCount)}) {
            if (count > rest.size() / one) continue;
            check.add_bytes(rest.first(count * one));
            rest = rest.subspan(count * one);
        }
    }
    check.add_bytes(std::span(bytes).first(kHead));
    const std::uint64_t value = check.value();
    std::memcpy(&bytes[kAtCheck], &value, 8);
}

void require_sound(const lucerna::SavedMaps& saved) {
    for (const auto& photons : saved.maps) {
        if (!photons) continue;
        for (std::size_t i = 0; i < photons->size(); ++i) {
            const lucerna::Photon& photon = photons->photons[i];
            require(lucerna::is_finite(photons->positions[i]), "a position is no number");
            require(lucerna::is_finite(photon.power), "a power is no number");
            require(std::fabs(photon.direction.unpack().length() - 1) < 1e-4F,
                    "a direction is no unit vector");
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::vector<std::byte> bytes = bytes_of_input(data, size);
    repair(bytes);
    const std::filesystem::path file = file_of_bytes(bytes, ".photons");
    try {
        require_sound(lucerna::read_maps(file));
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
