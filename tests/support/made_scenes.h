// Locates the shipped scenes with their meshes and measured lamps, which git does not hold. The fixture
// Scenes.AreMade makes them in the build's folder (tests/reference/make_scenes.sh); ctest runs it before any
// test that needs them.
#pragma once

#include <filesystem>
#include <stdexcept>

namespace lucerna::testing {

// Returns the folder. Throws if a file is missing, because no test may pass without it.
inline std::filesystem::path made_scenes() {
    const std::filesystem::path folder(LUCERNA_MADE_SCENES);
    for (const char* const made : {"cloister/mesh", "cloister/lamp.exr", "lamps/flashlight/flashlight.exr",
                                   "lamps/projector/projector.exr"}) {
        if (!std::filesystem::exists(folder / made))
            throw std::runtime_error((folder / made).string() + " is not made: ctest -R Scenes.AreMade");
    }
    return folder;
}

}  // namespace lucerna::testing
