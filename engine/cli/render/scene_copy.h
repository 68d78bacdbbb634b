// A scene's files, sent by rank 0 to ranks that share no disk with it (--broadcast-scene).
#pragma once

#include <filesystem>
#include <set>
#include <vector>

#include "engine/ranks/ranks.h"

namespace lucerna {

// On other ranks than 0 files are in a temporary folder, as long as this lives, each under its whole path:
// relative names among them lead to the same files as at rank 0. Calls are collective.
class SceneCopy {
  public:
    // Throws InputError where no folder can be made.
    explicit SceneCopy(Ranks& ranks);
    ~SceneCopy();
    SceneCopy(const SceneCopy&) = delete;
    SceneCopy& operator=(const SceneCopy&) = delete;

    struct Places {
        std::filesystem::path scene, maps;  // maps: empty if there are none
    };
    // Rank 0: these and the scene's `files`, of those that exist the ones not sent before.
    void send(const Places& places, std::vector<std::filesystem::path> files);
    // Other ranks: where they are. Throws InputError where one cannot be written.
    Places receive();

  private:
    std::filesystem::path place_of(const std::filesystem::path& there) const;

    Ranks& ranks_;
    std::filesystem::path folder_;
    std::set<std::filesystem::path> sent_;
};

}  // namespace lucerna
