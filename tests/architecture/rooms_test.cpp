// The house's walls: which room may include which, where packages may be named, and what every header begins
// with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "engine/base/files.h"

namespace lucerna {
namespace {

namespace fs = std::filesystem;

// The rooms that each room may include beside itself; docs/architecture.md draws the graph.
const std::map<std::string, std::set<std::string>> kEdges = {
    {"engine/base", {}},
    {"kdtree", {"engine/base"}},
    {"lights", {"engine/base"}},
    {"engine/world", {"engine/base", "lights"}},
    {"photon", {"engine/base", "lights", "engine/world", "kdtree"}},
    {"engine/render", {"engine/base", "lights", "engine/world", "kdtree", "photon"}},
    {"engine/pbrt", {"engine/base", "lights", "engine/world", "kdtree", "photon", "engine/render"}},
    {"engine/app",
     {"engine/base", "lights", "engine/world", "kdtree", "photon", "engine/render", "engine/pbrt"}},
};

// Where a package's headers may be named, by the beginning of the include.
const std::vector<std::pair<std::string, std::set<std::string>>> kPackages = {
    {"embree3/", {"engine/world/scene.cpp"}},
    {"flann/", {"kdtree/flann_tree.cpp"}},
    {"omp.h", {"engine/base/parallel.h"}},
    {"OpenEXR/", {"engine/base/exr.cpp", "lights/light_field_io.cpp"}},
    {"OpenImageIO/", {"engine/base/png.cpp", "engine/world/texture.cpp"}},
    {"Random123/", {"engine/base/stream.cpp"}},
};

std::string room_of(const std::string& path) {
    for (const auto& [room, edges] : kEdges) {
        if (path.starts_with(room + "/")) return room;
    }
    return "";
}

// What is wrong with one source file; one line each.
std::vector<std::string> violations(const std::string& path, const std::string& text) {
    std::vector<std::string> found;
    const std::string room = room_of(path);
    static const std::regex include(R"re(#include\s+(["<])([^">]+)[">])re");
    for (auto i = std::sregex_iterator(text.begin(), text.end(), include); i != std::sregex_iterator(); ++i) {
        const bool ours = (*i)[1] == "\"";
        const std::string target = (*i)[2];
        const std::string target_room = room_of(target);
        if (ours && target_room.empty())
            found.push_back(path + " includes \"" + target + "\", which is in no room");
        if (ours && !target_room.empty() && target_room != room && !kEdges.at(room).contains(target_room)) {
            found.push_back(path + " includes " + target + " against the graph");
        }
        for (const auto& [package, files] : kPackages) {
            if (!ours && target.starts_with(package) && !files.contains(path)) {
                found.push_back(path + " names " + target);
            }
        }
    }
    if (text.find("#pragma omp") != std::string::npos && path != "engine/base/parallel.h") {
        found.push_back(path + " writes #pragma omp");
    }
    if (text.find("using namespace") != std::string::npos) found.push_back(path + " says using namespace");
    if (text.find("std::exit") != std::string::npos && room != "engine/app") found.push_back(path + " exits");
    if (path.ends_with(".h")) {
        if (!text.starts_with("//")) found.push_back(path + " does not begin with a comment");
        if (text.find("#pragma once") == std::string::npos) found.push_back(path + " has no #pragma once");
    }
    return found;
}

std::vector<std::string> sources() {
    std::vector<std::string> files;
    const fs::path root(LUCERNA_SOURCE_DIR);
    for (const char* folder : {"engine", "lights", "photon", "kdtree"}) {
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            const std::string extension = entry.path().extension().string();
            if (extension == ".h" || extension == ".cpp") {
                files.push_back(fs::relative(entry.path(), root).generic_string());
            }
        }
    }
    std::sort(files.begin(), files.end());
    return files;
}

TEST(Architecture, EverySource_KeepsToTheRooms) {
    const std::vector<std::string> files = sources();
    ASSERT_GT(files.size(), 50U);
    for (const std::string& file : files) {
        for (const std::string& violation :
             violations(file, read_text(fs::path(LUCERNA_SOURCE_DIR) / file))) {
            ADD_FAILURE() << violation;
        }
    }
}

TEST(Architecture, PlantedViolations_AreFound) {
    using ::testing::IsEmpty;
    using ::testing::Not;
    EXPECT_THAT(violations("lights/x.cpp", "#include \"engine/world/scene.h\"\n"), Not(IsEmpty()));
    EXPECT_THAT(violations("photon/x.cpp", "#include \"engine/render/film.h\"\n"), Not(IsEmpty()));
    EXPECT_THAT(violations("photon/x.cpp", "#include \"nowhere.h\"\n"), Not(IsEmpty()));
    EXPECT_THAT(violations("photon/x.cpp", "#include <flann/flann.hpp>\n"), Not(IsEmpty()));
    EXPECT_THAT(violations("photon/x.cpp", "#pragma omp parallel for\n"), Not(IsEmpty()));
    EXPECT_THAT(violations("photon/x.h", "#pragma once\n"), Not(IsEmpty()));
    EXPECT_THAT(violations("photon/x.h", "// Says what it is.\n#pragma once\n"), IsEmpty());
    EXPECT_THAT(violations("photon/x.cpp", "#include \"engine/world/scene.h\"\n#include <vector>\n"),
                IsEmpty());
}

}  // namespace
}  // namespace lucerna
