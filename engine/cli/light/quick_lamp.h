// A lamp that options of lucerna light acquire describe, without a rig file: a flat emitter and its planes.
#pragma once

#include <string>

#include "engine/cli/commands.h"
#include "lights/measurement/rig_file.h"

namespace lucerna {

struct QuickLamp {
    std::string emitter = "disc";
    double radius = 0.025;  // metres
    V2d size{0.02, 0.01};   // metres
    bool has_radius = false, has_size = false;
    double exponent = 1, flux = 1000;  // flux in `unit`
    std::string unit = "lm";
    Rgb colour{1.0F};    // luminance 1
    double setback = 0;  // metres
    V2i views{9, 9}, pixels{128, 128};
    double distance = 0;  // metres; 0: chosen automatically
    double capture = 0.98;
};

// Adds the options of the emitter; those of the planes are add_planes() and --capture.
void add_quick_lamp(CLI::App& app, QuickLamp& lamp);

// Returns the emitter and, where no distance is given, planes that suit it. Throws InputError naming the
// option whose value is out of range or does not apply to the emitter.
RigDescription describe(const QuickLamp& lamp);

}  // namespace lucerna
