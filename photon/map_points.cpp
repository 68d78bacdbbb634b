#include "photon/map_points.h"

#include <fmt/format.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "engine/system/files.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

constexpr std::size_t kFloats = 12;
constexpr std::size_t kBytes = kFloats * sizeof(float) + sizeof(std::int32_t) + 2;

std::string ply_header(std::size_t photons) {
    constexpr bool kLittle = std::endian::native == std::endian::little;
    std::string head = fmt::format("ply\nformat binary_{}_endian 1.0\ncomment photon maps of lucerna; map is",
                                   kLittle ? "little" : "big");
    for (int kind = 0; kind < kMapKinds; ++kind)
        head += fmt::format("{} {} {}", kind > 0 ? "," : "", kind, map_name(static_cast<MapKind>(kind)));
    head += fmt::format("\nelement vertex {}\n", photons);
    for (const char* name :
         {"x", "y", "z", "nx", "ny", "nz", "dx", "dy", "dz", "power_r", "power_g", "power_b"})
        head += fmt::format("property float {}\n", name);
    return head + "property int light\nproperty uchar map\nproperty uchar bounces\nend_header\n";
}

// Appends the bytes of a number.
template <typename T>
void put(std::vector<std::byte>& to, const T& value) {
    const std::size_t at = to.size();
    to.resize(at + sizeof value);
    std::memcpy(&to[at], &value, sizeof value);
}

void put_vector(std::vector<std::byte>& to, const V3f& v) {
    for (int c = 0; c < 3; ++c) put(to, v[c]);
}

void put_map(std::vector<std::byte>& to, const PhotonMap& map, MapKind kind, const V3d& origin) {
    for (std::size_t i = 0; i < map.size(); ++i) {
        const Photon& photon = map.photons()[i];
        const V3d place = V3d(map.positions()[i]) + origin;
        put_vector(
            to, V3f(static_cast<float>(place.x), static_cast<float>(place.y), static_cast<float>(place.z)));
        put_vector(to, kind == MapKind::volume ? V3f(0.0F) : map.normals()[i].unpack());
        put_vector(to, photon.direction.unpack());
        put_vector(to, V3f(photon.power.x, photon.power.y, photon.power.z));
        put(to, static_cast<std::int32_t>(photon.light));
        put(to, static_cast<std::uint8_t>(kind));
        put(to, std::uint8_t{map.bounces()[i]});
    }
}

}  // namespace

void write_map_points(const std::filesystem::path& file, const PhotonMaps& maps, const V3d& origin) {
    std::size_t photons = 0;
    for (const auto& map : maps.maps) photons += map ? map->size() : 0;
    require_memory(bytes_of(photons, kBytes), fmt::format("{} photons as points", photons),
                   "use fewer photons");
    const std::string head = ply_header(photons);
    std::vector<std::byte> points;
    points.reserve(photons * kBytes);
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (maps.maps[kind]) put_map(points, *maps.maps[kind], static_cast<MapKind>(kind), origin);
    }
    const std::span<const std::byte> parts[] = {std::as_bytes(std::span(head)), points};
    replace_file(file, parts);
}

}  // namespace lucerna
