// What `lucerna study` is asked to measure: a file that names scenes, a reference and methods, with lists of
// the settings that are to be tried.
//
//   title = "Direct light, four ways"
//   seeds = 2
//
//   [[scene]]
//   file = "../../scenes/cloister/cloister.pbrt"     # from the folder of this file
//   resolution = "120x80"
//
//   [reference]
//   integrator = "path"
//   spp = [1024]
//
//   [[method]]
//   name = "guided"
//   integrator = "photonmap"
//   set = "indirect=none direct=guided candidates=4|16"   # every one of the alternatives
//   spp = [4, 16, 64]
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "engine/pbrt/read_scene.h"

namespace lucerna {

struct StudyScene {
    std::string name;
    std::filesystem::path file;
    V2i resolution{0, 0};                                         // (0,0): the scene's own
    double mask_above = std::numeric_limits<double>::infinity();  // compare.h
};

// One method with all its settings chosen.
struct StudyPoint {
    std::string method;
    std::string settings;  // those that were written down, as "k=50 spp=16"
    SceneOverrides overrides;
};

struct StudyDescription {
    std::string title;
    int seeds = 1;
    std::vector<StudyScene> scenes;
    StudyPoint reference;
    std::vector<StudyPoint> points;
};

// Throws InputError naming file, line and column.
StudyDescription read_study(const std::filesystem::path& file);

}  // namespace lucerna
