// The maintenance factor: the share of its initial illuminance that an installation keeps until it is cleaned
// or its lamps are replaced [CIE 97:2005; EN 12464-1:2021, 4.3].
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/photometry/illuminance.h"

namespace lucerna {

struct MaintenanceFactors {
    double all = 1;                                      // of light that belongs to no group below
    std::vector<std::pair<std::string, double>> groups;  // of the light groups named
    bool applies() const { return all != 1 || !groups.empty(); }
};

// Parses a factor above 0 and at most 1, "0.8", or that of a light group, "spots=0.7". Throws InputError.
void parse_maintenance(const Location& at, std::string_view word, MaintenanceFactors& factors);
// Turns initial illuminances into maintained ones. Half-widths get the greatest factor. Throws InputError for
// a group that the scene does not have.
void maintain(IlluminanceReport& report, const MaintenanceFactors& factors);

}  // namespace lucerna
