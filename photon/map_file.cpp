// File format: a header, then lines of text "name<tab>value" that say what the maps were made for, then for
// each map that was built its positions, normals, photons and bounces, in this machine's byte order. A check
// value covers all of it.
#include "photon/build_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

constexpr char kMagic[8] = {'L', 'U', 'C', 'P', 'H', 'O', 'T', '4'};
constexpr std::uint64_t kByteOrder = 0x0102030405060708U;
constexpr std::uint64_t kNotBuilt = ~std::uint64_t{0};

struct Head {
    char magic[8];
    std::uint64_t byte_order;
    std::uint64_t text;                // bytes
    V3d place;                         // as of MapOrigin
    std::uint64_t photons[kMapKinds];  // kNotBuilt if there is no map
    DepositCount counts[kMapKinds];
    Ledger ledger;
    std::uint64_t check;  // of all other bytes
};
// Types that consist of numbers alone, so that their bytes are their value. (Imath's vectors have
// constructors of their own, so they are not formally trivial.)
static_assert(std::is_standard_layout_v<Head> && std::is_standard_layout_v<Photon> &&
              std::is_standard_layout_v<PackedDirection> && sizeof(V3d) == 24);
constexpr std::uint64_t kBytesOfPhoton =
    sizeof(V3f) + sizeof(PackedDirection) + sizeof(Photon) + sizeof(BounceCount);

// Names of the text lines before the facts.
constexpr std::string_view kScene = "file", kUnit = "unit";

bool is_photon(const V3f& position, const Photon& photon) {
    const Rgb& power = photon.power;
    return std::isfinite(position.x + position.y + position.z) &&
           std::isfinite(power.x + power.y + power.z) && std::min({power.x, power.y, power.z}) >= 0;
}

// Calls action(bytes) for each array of a map, in the order of the file.
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

std::string text_of(const MapOrigin& origin) {
    std::string text =
        fmt::format("{}\t{}\n{}\t{}\n", kScene, plain_line(origin.scene), kUnit, plain_line(origin.unit));
    for (const auto& [name, value] : origin.facts)
        text += fmt::format("{}\t{}\n", plain_line(name), plain_line(value));
    return text;
}

MapOrigin origin_in(std::string_view text, const V3d& place, const Location& at) {
    MapOrigin origin;
    origin.place = place;
    Facts lines;
    while (!text.empty()) {
        const std::size_t tab = text.find('\t'), end = text.find('\n');
        if (tab == text.npos || end == text.npos || tab > end) input_error(at, "the file is damaged");
        lines.emplace_back(text.substr(0, tab), text.substr(tab + 1, end - tab - 1));
        text.remove_prefix(end + 1);
    }
    if (lines.size() < 2 || lines[0].first != kScene || lines[1].first != kUnit)
        input_error(at, "the file is damaged");
    origin.scene = lines[0].second;
    origin.unit = lines[1].second;
    origin.facts.assign(lines.begin() + 2, lines.end());
    return origin;
}

// Reads the header and checks that it agrees with the length of the file, before any memory is allocated for
// the contents.
Head read_head(std::ifstream& in, const std::filesystem::path& file) {
    const Location at{file.string()};
    Head head{};
    in.read(reinterpret_cast<char*>(&head), sizeof head);
    if (!in || std::memcmp(head.magic, kMagic, sizeof kMagic) != 0 || head.byte_order != kByteOrder) {
        input_error(at, "not a file of photon maps of this version of lucerna");
    }
    std::uint64_t left = std::filesystem::file_size(file) - sizeof head;
    if (head.text > left) input_error(at, "the file is truncated or damaged");
    left -= head.text;
    for (const std::uint64_t count : head.photons) {
        if (count == kNotBuilt) continue;
        if (count > left / kBytesOfPhoton) input_error(at, "the file is truncated or damaged");
        left -= count * kBytesOfPhoton;
    }
    if (left != 0) input_error(at, "the file is damaged: {} bytes too long", left);
    // The photons are in memory twice: as read, and in the order of the index.
    require_memory(2 * std::filesystem::file_size(file), file.string() + ": its photons",
                   "use fewer photons");
    return head;
}

}  // namespace

void save_maps(const std::filesystem::path& file, const PhotonMaps& maps, const MapOrigin& origin) {
    const std::string text = text_of(origin);
    Head head{};
    std::memcpy(head.magic, kMagic, sizeof kMagic);
    head.byte_order = kByteOrder;
    head.text = text.size();
    head.place = origin.place;
    head.ledger = maps.ledger;
    std::vector<std::span<const std::byte>> parts{{}, std::as_bytes(std::span(text))};
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        head.counts[kind] = maps.counts[kind];
        const std::optional<PhotonMap>& map = maps.maps[kind];
        head.photons[kind] = map ? map->size() : kNotBuilt;
        if (map) for_each_array(*map, [&](std::span<const std::byte> bytes) { parts.push_back(bytes); });
    }
    WordHash check;
    for (const std::span<const std::byte>& part : parts) check.add_bytes(part);
    head.check = check_of(head, check);
    parts.front() = std::as_bytes(std::span(&head, 1));
    replace_file(file, parts);
}

SavedMaps read_maps(const std::filesystem::path& file) {
    const Location at{file.string()};
    std::ifstream in = open_to_read(file);
    const Head head = read_head(in, file);

    SavedMaps saved;
    saved.ledger = head.ledger;
    WordHash check;
    const std::vector<char> text = read_array<char>(in, head.text, check);
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        saved.counts[kind] = head.counts[kind];
        if (head.photons[kind] == kNotBuilt) continue;
        Photons& photons = saved.maps[kind].emplace();
        photons.positions = read_array<V3f>(in, head.photons[kind], check);
        photons.normals = read_array<PackedDirection>(in, head.photons[kind], check);
        photons.photons = read_array<Photon>(in, head.photons[kind], check);
        photons.bounces = read_array<BounceCount>(in, head.photons[kind], check);
    }
    if (!in || check_of(head, check) != head.check) input_error(at, "the file is damaged");
    saved.origin = origin_in({text.data(), text.size()}, head.place, at);
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!saved.maps[kind]) continue;
        for (std::size_t i = 0; i < saved.maps[kind]->size(); ++i) {
            if (!is_photon(saved.maps[kind]->positions[i], saved.maps[kind]->photons[i])) {
                input_error(at, "the file is damaged: photon {} of the {} map is invalid", i,
                            map_name(static_cast<MapKind>(kind)));
            }
        }
    }
    return saved;
}

PhotonMaps load_maps(const std::filesystem::path& file, const Facts& facts, std::size_t lights,
                     IndexKind index, const Workers& workers) {
    const Location at{file.string()};
    SavedMaps saved = read_maps(file);
    if (const auto difference = first_difference(saved.origin.facts, facts)) {
        input_error(at,
                    "these maps were made for another scene or by other settings: their {} is {}, here it is "
                    "{}; only camera, film, samples and the settings of the second pass may differ",
                    difference->name, difference->of_first, difference->of_second);
    }
    PhotonMaps maps;
    maps.ledger = saved.ledger;
    maps.counts = saved.counts;
    const Stopwatch indexing;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!saved.maps[kind]) continue;
        const Photons& photons = *saved.maps[kind];
        if (std::ranges::any_of(photons.photons,
                                [&](const Photon& photon) { return photon.light >= lights; }))
            input_error(at, "the file is damaged: the {} map names a light that the scene does not have",
                        map_name(static_cast<MapKind>(kind)));
        maps.maps[kind].emplace(photons, index, workers);
        saved.maps[kind].reset();
    }
    maps.seconds_index = indexing.seconds();
    return maps;
}

}  // namespace lucerna
