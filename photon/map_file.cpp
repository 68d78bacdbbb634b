// The file: a head, then for each map that was built its positions, normals and photons. In this machine's
// byte order; a check over all of it.
#include "photon/build_maps.h"

#include <cstring>
#include <fstream>
#include <type_traits>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/memory.h"
#include "engine/base/monitor.h"
#include "engine/scene/arithmetic.h"

namespace lucerna {
namespace {

constexpr char kMagic[8] = {'L', 'U', 'C', 'P', 'H', 'O', 'T', '3'};
constexpr std::uint64_t kByteOrder = 0x0102030405060708U;
constexpr std::uint64_t kNotBuilt = ~std::uint64_t{0};

struct Head {
    char magic[8];
    std::uint64_t byte_order;
    std::uint64_t key;
    char arithmetic[kArithmeticLength + 1];  // by which they were made; zeros to its end
    std::uint64_t photons[kMapKinds];        // kNotBuilt where there is no map
    DepositCount counts[kMapKinds];
    Ledger ledger;
    std::uint64_t check;  // of all else
};
// Numbers and nothing else, so that their bytes are all there is to them. (Imath's vectors have constructors
// of their own, which keeps them from being formally trivial.)
static_assert(std::is_standard_layout_v<Head> && std::is_standard_layout_v<Photon> &&
              std::is_standard_layout_v<PackedDirection> && sizeof(V3d) == 24);
constexpr std::uint64_t kBytesOfPhoton =
    sizeof(V3f) + sizeof(PackedDirection) + sizeof(Photon) + sizeof(BounceCount);

bool is_photon(const V3f& position, const Photon& photon, std::size_t lights) {
    const Rgb& power = photon.power;
    return std::isfinite(position.x + position.y + position.z) &&
           std::isfinite(power.x + power.y + power.z) && std::min({power.x, power.y, power.z}) >= 0 &&
           photon.light < lights;
}

// Calls action(bytes) for each array of a map, in the order in which they lie in the file.
template <typename Map, typename Action>
void for_each_array(Map&& map, Action&& action) {
    action(std::as_bytes(std::span(map.positions())));
    action(std::as_bytes(std::span(map.normals())));
    action(std::as_bytes(std::span(map.photons())));
    action(std::as_bytes(std::span(map.bounces())));
}

std::uint64_t check_of(Head head, WordHash check) {
    head.check = 0;
    check.add_bytes(std::as_bytes(std::span(&head, 1)));
    return check.value();
}

template <typename T>
std::vector<T> read_array(std::ifstream& in, std::uint64_t count, WordHash& check) {
    std::vector<T> all(count);
    const auto bytes = std::as_writable_bytes(std::span(all));
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    check.add_bytes(bytes);
    return all;
}

// Head and length agree; nothing is allocated before that is known.
Head read_head(std::ifstream& in, const std::filesystem::path& file, std::uint64_t key) {
    const Location at{file.string()};
    Head head{};
    in.read(reinterpret_cast<char*>(&head), sizeof head);
    if (!in || std::memcmp(head.magic, kMagic, sizeof kMagic) != 0 || head.byte_order != kByteOrder) {
        input_error(at, "not a file of photon maps of this version of lucerna");
    }
    if (head.arithmetic[kArithmeticLength] != 0) input_error(at, "the file is damaged");
    if (head.arithmetic != arithmetic()) {
        input_error(at, "these maps were written by another build: \"{}\"; this one is \"{}\"",
                    head.arithmetic, arithmetic());
    }
    if (head.key != key) {
        input_error(at, "these maps are for a different scene, lights, seed or settings");
    }
    std::uint64_t left = std::filesystem::file_size(file) - sizeof head;
    for (const std::uint64_t count : head.photons) {
        if (count == kNotBuilt) continue;
        if (count > left / kBytesOfPhoton) input_error(at, "the file is truncated or damaged");
        left -= count * kBytesOfPhoton;
    }
    if (left != 0) input_error(at, "the file is damaged: {} bytes too long", left);
    // Read, then put into the index's order.
    require_memory(2 * std::filesystem::file_size(file), file.string() + ": its photons",
                   "use fewer photons");
    return head;
}

}  // namespace

void save_maps(const std::filesystem::path& file, const PhotonMaps& maps, std::uint64_t key) {
    Head head{};
    std::memcpy(head.magic, kMagic, sizeof kMagic);
    head.byte_order = kByteOrder;
    head.key = key;
    arithmetic().copy(head.arithmetic, kArithmeticLength);
    head.ledger = maps.ledger;
    WordHash check;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        head.counts[kind] = maps.counts[kind];
        const std::optional<PhotonMap>& map = maps.maps[kind];
        head.photons[kind] = map ? map->size() : kNotBuilt;
        if (map) for_each_array(*map, [&](std::span<const std::byte> bytes) { check.add_bytes(bytes); });
    }
    head.check = check_of(head, check);
    std::vector<std::span<const std::byte>> parts{std::as_bytes(std::span(&head, 1))};
    for (const std::optional<PhotonMap>& map : maps.maps) {
        if (map) for_each_array(*map, [&](std::span<const std::byte> bytes) { parts.push_back(bytes); });
    }
    replace_file(file, parts);
}

PhotonMaps load_maps(const std::filesystem::path& file, std::uint64_t key, std::size_t lights,
                     IndexKind index, const Workers& workers) {
    const Location at{file.string()};
    std::ifstream in = open_to_read(file);
    const Head head = read_head(in, file, key);

    PhotonMaps maps;
    maps.ledger = head.ledger;
    WordHash check;
    std::array<Photons, kMapKinds> deposited;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        maps.counts[kind] = head.counts[kind];
        if (head.photons[kind] == kNotBuilt) continue;
        Photons& photons = deposited[kind];
        photons.positions = read_array<V3f>(in, head.photons[kind], check);
        photons.normals = read_array<PackedDirection>(in, head.photons[kind], check);
        photons.photons = read_array<Photon>(in, head.photons[kind], check);
        photons.bounces = read_array<BounceCount>(in, head.photons[kind], check);
    }
    if (!in || check_of(head, check) != head.check) input_error(at, "the file is damaged");

    const Stopwatch indexing;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (head.photons[kind] == kNotBuilt) continue;
        for (std::size_t i = 0; i < deposited[kind].size(); ++i) {
            if (!is_photon(deposited[kind].positions[i], deposited[kind].photons[i], lights)) {
                input_error(at, "the file is damaged: photon {} of the {} map is invalid", i,
                            map_name(static_cast<MapKind>(kind)));
            }
        }
        maps.maps[kind].emplace(deposited[kind], index, workers);
    }
    maps.seconds_index = indexing.seconds();
    return maps;
}

}  // namespace lucerna
