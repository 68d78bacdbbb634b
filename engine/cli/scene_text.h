// Scenes in words: what `lucerna info` says about them.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "engine/render/job.h"

namespace lucerna {

// `ignored`: the warnings with which the scene was read.
void print_scene(std::ostream& out, const Job& job, const std::vector<std::string>& ignored);

}  // namespace lucerna
