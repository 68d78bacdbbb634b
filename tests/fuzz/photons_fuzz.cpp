// libFuzzer's entry to saved photon maps: bytes in, maps that can be asked or an InputError out. The check
// over the file is put right first: it keeps damage out, not malice.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "engine/base/files.h"
#include "engine/scene/arithmetic.h"
#include "photon/build_maps.h"
#include "tests/fuzz/input.h"

using lucerna::kMapKinds;
using lucerna::testing::bytes_of_input;
using lucerna::testing::file_of_bytes;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

constexpr std::uint64_t kKey = 0x6b6579;
constexpr std::size_t kLights = 2;

// The file's head, as map_file.cpp has it.
constexpr std::size_t kAtKey = 16, kAtArithmetic = 24;
constexpr std::size_t kAtPhotons = kAtArithmetic + lucerna::kArithmeticLength + 1;
constexpr std::size_t kAtCheck =
    kAtPhotons + kMapKinds * (8 + sizeof(lucerna::DepositCount)) + sizeof(lucerna::Ledger);
constexpr std::size_t kHead = kAtCheck + 8;

void repair(std::vector<std::byte>& bytes) {
    if (bytes.size() < kHead) return;
    std::memcpy(&bytes[kAtKey], &kKey, 8);
    const std::string own = lucerna::arithmetic();
    std::memset(&bytes[kAtArithmetic], 0, lucerna::kArithmeticLength + 1);
    std::memcpy(&bytes[kAtArithmetic], own.data(), own.size());
    std::memset(&bytes[kAtCheck], 0, 8);
    std::uint64_t counts[kMapKinds];
    std::memcpy(counts, &bytes[kAtPhotons], sizeof counts);
    lucerna::WordHash check;
    std::span<const std::byte> rest = std::span(bytes).subspan(kHead);
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

void require_sound(const lucerna::PhotonMaps& maps) {
    for (const auto& map : maps.maps) {
        if (!map) continue;
        for (std::size_t i = 0; i < map->size(); ++i) {
            const lucerna::Photon& photon = map->photons()[i];
            require(lucerna::is_finite(map->positions()[i]), "a position is no number");
            require(lucerna::is_finite(photon.power), "a power is no number");
            require(std::fabs(photon.direction.unpack().length() - 1) < 1e-4F,
                    "a direction is no unit vector");
            require(photon.light < kLights, "a light is none");
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::vector<std::byte> bytes = bytes_of_input(data, size);
    repair(bytes);
    const std::filesystem::path file = file_of_bytes(bytes, ".photons");
    try {
        require_sound(lucerna::load_maps(file, kKey, kLights, lucerna::IndexKind::tree, lucerna::Workers{1}));
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
