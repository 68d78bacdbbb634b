// A scene's files, which rank 0 sends to ranks that share no disk with it (--broadcast-scene).
#pragma once

#include <filesystem>
#include <set>
#include <vector>

#include "engine/ranks/ranks.h"

namespace lucerna {

// On ranks other than 0, files are in a temporary folder during the object's lifetime, each under its full
// path, so that relative names among them lead to the same files as at rank 0. Calls are collective.
class SceneCopy {
  public:
    // Throws InputError if no folder can be created.
    explicit SceneCopy(Ranks& ranks);
    ~SceneCopy();
    SceneCopy(const SceneCopy&) = delete;
    SceneCopy& operator=(const SceneCopy&) = delete;

    struct Places {
        std::filesystem::path scene, maps;  // maps: empty if there are none
    };
    // Sends, at rank 0, these files and the scene's `files`, as far as they exist and were not sent before.
    void send(const Places& places, std::vector<std::filesystem::path> files);
    // Returns the places on the other ranks. Throws InputError if a file cannot be written.
    Places receive();

  private:
    std::filesystem::path place_of(const std::filesystem::path& there) const;

    Ranks& ranks_;
    std::filesystem::path folder_;
    std::set<std::filesystem::path> sent_;
};

}  // namespace lucerna
