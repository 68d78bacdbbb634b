// What a render tells of its work, beside the image.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace lucerna {

// What a render did, for --stats. Names are stable: they are the JSON's keys.
struct RenderReport {
    std::vector<std::pair<std::string, double>> seconds;  // per phase, in order
    std::map<std::string, double> numbers;                // counts and energies, by dotted name
    std::map<std::string, std::string> notes;             // what was built and why
    int samples_done = 0;                                 // per pixel
    int passes_done = 0;                                  // of an integrator that works in passes
    bool complete = true;                                 // false: stopped early by the user
};

}  // namespace lucerna
