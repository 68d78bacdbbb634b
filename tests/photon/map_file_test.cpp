// Tests photon maps on disk.
#include "photon/build_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "engine/system/files.h"
#include "photon/map_points.h"
#include "tests/support/error_of.h"
#include "tests/support/scenes.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace map_file_test {

using testing::error_of;
using ::testing::HasSubstr;
using testing::SceneMaker;

// Returns a box with a lamp and a mirror; `wall` is its albedo.
Scene box(float wall) {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(wall)));
    make.sphere({0.5F, 0.3F, 0.5F}, 0.2F, make.material(MirrorMaterial{}));
    make.light(make_point_light({0.5F, 0.8F, 0.2F}, Rgb(1, 2, 3)));
    return make.build();
}

constexpr std::size_t kAtPhotons = 48;  // offset in the file

class MapFile : public ::testing::Test {
  protected:
    MapParameters parameters() const {
        MapParameters parameters;
        parameters.paths = 5000;
        parameters.wanted = {true, true, true};
        parameters.seed = 3;
        return parameters;
    }
    Facts saved(const Scene& scene) {
        Monitor silent;
        maps_ = build_photon_maps(scene, parameters(), Workers{2}, silent);
        const Facts facts = map_facts(parameters());
        save_maps(file_, maps_, {"box.pbrt", "W", V3d(10, 20, 30), facts});
        return facts;
    }
    PhotonMaps loaded(const Facts& facts, std::size_t lights = 1) {
        return load_maps(file_, facts, lights, IndexKind::tree, Workers{1});
    }

    testing::TemporaryFolder folder_;
    std::filesystem::path file_ = folder_.path() / "maps.photons";
    PhotonMaps maps_;
};

TEST_F(MapFile, Loaded_HasTheSamePhotonsInTheSameOrder) {
    const PhotonMaps again = loaded(saved(box(0.7F)));
    for (const MapKind kind : {MapKind::direct, MapKind::global, MapKind::caustic}) {
        ASSERT_TRUE(again.find(kind)) << map_name(kind);
        const PhotonMap& a = *maps_.find(kind);
        const PhotonMap& b = *again.find(kind);
        ASSERT_GT(a.size(), 100) << map_name(kind);
        ASSERT_EQ(a.size(), b.size());
        for (std::size_t i = 0; i < a.size(); ++i) {
            ASSERT_EQ(a.positions()[i], b.positions()[i]);
            ASSERT_EQ(a.photons()[i].power, b.photons()[i].power);
            ASSERT_EQ(a.photons()[i].direction.unpack(), b.photons()[i].direction.unpack());
            ASSERT_EQ(a.normals()[i].unpack(), b.normals()[i].unpack());
        }
        EXPECT_EQ(again.counts[static_cast<std::size_t>(kind)].stored,
                  maps_.counts[static_cast<std::size_t>(kind)].stored);
    }
    EXPECT_EQ(again.find(MapKind::volume), nullptr);
    EXPECT_EQ(again.ledger.emitted, maps_.ledger.emitted);
}

// Reads the file by its header, as other programs do.
TEST_F(MapFile, Points_AreThePhotonsInThePlacesOfTheScene) {
    saved(box(0.7F));
    const std::filesystem::path file = folder_.path() / "maps.ply";
    const V3d origin(10, 20, 30);
    write_map_points(file, maps_, origin);
    const std::string whole = read_text(file);
    const std::size_t end = whole.find("end_header\n");
    ASSERT_NE(end, whole.npos);
    std::map<std::string, std::size_t> place;  // offset of a property within a vertex
    std::size_t vertices = 0, bytes = 0;
    std::istringstream head(whole.substr(0, end));
    for (std::string line; std::getline(head, line);) {
        std::istringstream words(line);
        std::string what, type, name;
        words >> what >> type >> name;
        if (what == "element") vertices = std::stoul(name);
        if (what != "property") continue;
        place[name] = bytes;
        bytes += type == "uchar" ? 1 : 4;
    }
    ASSERT_EQ(whole.size(), end + 11 + vertices * bytes);
    const auto number = [&](std::size_t vertex, const std::string& name) {
        float value = 0;
        std::memcpy(&value, &whole[end + 11 + vertex * bytes + place.at(name)], sizeof value);
        return value;
    };
    const auto vector = [&](std::size_t vertex, const char* x, const char* y, const char* z) {
        return V3f(number(vertex, x), number(vertex, y), number(vertex, z));
    };
    std::size_t at = 0;
    for (const MapKind kind : {MapKind::direct, MapKind::global, MapKind::caustic}) {
        const PhotonMap& map = *maps_.find(kind);
        for (std::size_t i = 0; i < map.size(); ++i, ++at) {
            const Photon& photon = map.photons()[i];
            ASSERT_LT((V3d(vector(at, "x", "y", "z")) - origin - V3d(map.positions()[i])).length(), 1e-5);
            ASSERT_EQ(vector(at, "dx", "dy", "dz"), photon.direction.unpack());
            ASSERT_EQ(vector(at, "nx", "ny", "nz"), map.normals()[i].unpack());
            ASSERT_EQ(vector(at, "power_r", "power_g", "power_b"),
                      V3f(photon.power.x, photon.power.y, photon.power.z));
            ASSERT_EQ(whole[end + 11 + at * bytes + place.at("map")], static_cast<char>(kind));
        }
    }
    EXPECT_EQ(at, vertices);
}

TEST_F(MapFile, Read_TellsWhatItWasMadeFor) {
    const Facts facts = saved(box(0.7F));
    const SavedMaps read = read_maps(file_);
    EXPECT_EQ(read.origin.scene, "box.pbrt");
    EXPECT_EQ(read.origin.unit, "W");
    EXPECT_EQ(read.origin.place, V3d(10, 20, 30));
    EXPECT_EQ(read.origin.facts, facts);
    EXPECT_FALSE(read.maps[static_cast<std::size_t>(MapKind::volume)]);
    ASSERT_TRUE(read.maps[static_cast<std::size_t>(MapKind::global)]);
    EXPECT_EQ(read.maps[static_cast<std::size_t>(MapKind::global)]->size(),
              maps_.find(MapKind::global)->size());
}

TEST_F(MapFile, OfOtherParameters_IsRefusedByTheirName) {
    saved(box(0.7F));
    const auto refused = [this](auto change) {
        MapParameters other = parameters();
        change(other);
        return error_of([&] { loaded(map_facts(other)); });
    };
    EXPECT_THAT(refused([](MapParameters& p) { p.seed = 4; }), HasSubstr("their seed is 3, here it is 4"));
    EXPECT_THAT(refused([](MapParameters& p) { p.pass = 1; }), HasSubstr("their pass is 0, here it is 1"));
    EXPECT_THAT(refused([](MapParameters& p) { p.paths = 5001; }),
                HasSubstr("number of light paths is 5000"));
    EXPECT_THAT(refused([](MapParameters& p) { p.wanted[0] = false; }), HasSubstr("list of maps"));
    EXPECT_THAT(refused([](MapParameters& p) { p.targets[2] = 9; }), HasSubstr("target of the caustic map"));
    EXPECT_THAT(refused([](MapParameters& p) { p.volume_direct = true; }), HasSubstr("volume map"));
    EXPECT_THAT(refused([](MapParameters& p) { p.specular_below = 0.1F; }), HasSubstr("specular is 0,"));
    EXPECT_THAT(refused([](MapParameters& p) { p.longest = 3; }), HasSubstr("longest path"));
    loaded(map_facts(parameters()));
}

TEST_F(MapFile, Damaged_IsRefused) {
    const Facts key = saved(box(0.7F));
    EXPECT_THAT(error_of([&] { loaded(key, 0); }), HasSubstr("damaged"));  // light 0 does not exist
    const std::string whole = read_text(file_);
    const auto with = [&](const std::string& bytes) {
        std::ofstream(file_, std::ios::binary) << bytes;
        return error_of([&] { loaded(key); });
    };
    EXPECT_THAT(with("no maps"), HasSubstr("not a file of photon maps"));
    EXPECT_THAT(with(whole.substr(0, whole.size() - 1)), HasSubstr("truncated"));
    EXPECT_THAT(with(whole + "x"), HasSubstr("1 bytes too long"));
    for (const std::size_t place : {std::size_t{250}, whole.size() / 2, whole.size() - 3}) {
        std::string flipped = whole;
        flipped[place] = static_cast<char>(flipped[place] ^ 0x40);
        EXPECT_THAT(with(flipped), HasSubstr("damaged")) << place;
    }
    // A header with a wrong number of photons must not cause a large allocation.
    std::string lying = whole;
    lying[kAtPhotons + 7] = 0x7f;
    EXPECT_THAT(with(lying), HasSubstr("damaged"));
}

}  // namespace map_file_test
}  // namespace lucerna
