#include "engine/cli/render/scene_copy.h"

#include <stdlib.h>  // NOLINT: mkdtemp is POSIX's

#include <cerrno>
#include <cstring>
#include <span>

#include "engine/base/error.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

std::string whole_path(const std::filesystem::path& file) {
    return file.empty() ? "" : std::filesystem::absolute(file).lexically_normal().string();
}

}  // namespace

SceneCopy::SceneCopy(Ranks& ranks) : ranks_(ranks) {
    if (ranks.leads()) return;
    std::string folder = (std::filesystem::temp_directory_path() / "lucerna-XXXXXX").string();
    if (!mkdtemp(folder.data()))
        throw InputError({"--broadcast-scene"},
                         fmt::format("cannot create a folder in {}: {}; set TMPDIR to use another",
                                     std::filesystem::temp_directory_path().string(), std::strerror(errno)));
    folder_ = folder;
}

SceneCopy::~SceneCopy() {
    std::error_code failed;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, failed);
}

std::filesystem::path SceneCopy::place_of(const std::filesystem::path& there) const {
    return there.empty() ? there : folder_ / there.relative_path();
}

void SceneCopy::send(const Places& places, std::vector<std::filesystem::path> files) {
    files.push_back(places.scene);
    if (!places.maps.empty()) files.push_back(places.maps);
    std::vector<std::string> names;
    for (const std::filesystem::path& file : files) {
        std::error_code unknown;
        if (std::filesystem::is_regular_file(file, unknown) && sent_.insert(whole_path(file)).second)
            names.push_back(whole_path(file));
    }
    Packer packer;
    packer(whole_path(places.scene), whole_path(places.maps), names);
    ranks_.broadcast("scene files", packer.take());
    for (const std::string& name : names) ranks_.broadcast("scene files", read_bytes(name));
}

SceneCopy::Places SceneCopy::receive() {
    std::string scene, maps;
    std::vector<std::string> names;
    const std::vector<std::byte> list = ranks_.broadcast("scene files", std::vector<std::byte>());
    Unpacker unpacker(list);
    unpacker(scene, maps, names);
    for (const std::string& name : names) {
        const std::vector<std::byte> bytes = ranks_.broadcast("scene files", std::vector<std::byte>());
        const std::filesystem::path file = place_of(name);
        std::error_code failed;
        std::filesystem::create_directories(file.parent_path(), failed);
        const std::span<const std::byte> all(bytes);
        replace_file(file, std::span(&all, 1));
    }
    return {place_of(scene), place_of(maps)};
}

}  // namespace lucerna
