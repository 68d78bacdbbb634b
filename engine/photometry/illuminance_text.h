// What was found of illuminance, for people, for spreadsheets and for programs.
#pragma once

#include <string>
#include <vector>

#include "engine/image/image.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/measurement_uncertainty.h"

namespace lucerna {

// "512.3 ± 1.2": as many digits as the interval leaves to tell.
std::string reading_text(const Reading95& reading);
// Rows of as many cells each, as lines of columns.
std::string table_text(const std::vector<std::vector<std::string>>& rows);
// A table, a line for each surface.
std::string illuminance_text(const IlluminanceReport& report);
// A line for each point, under a line of column names (RFC 4180). With the uncertainty by the lamps, if it
// was computed.
std::string illuminance_csv(const IlluminanceReport& report, const MeasurementUncertainty& lamps = {});
std::string illuminance_json(const IlluminanceReport& report, const MeasurementUncertainty& lamps = {});
// A pixel for each point, v upwards. Channels: Y (the illuminance), half_width, direct, indirect and
// lightgroup.NAME.
Image illuminance_image(const SurfaceIlluminance& surface, const IlluminanceReport& report);

}  // namespace lucerna
