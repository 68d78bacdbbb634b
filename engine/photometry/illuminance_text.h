// Formats illuminance as text, CSV, JSON and images.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/image/image.h"
#include "engine/photometry/en12464.h"
#include "engine/photometry/far_field_error.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/light_colour.h"
#include "engine/photometry/measurement_uncertainty.h"

namespace lucerna {

// Returns lines that tell how many of the surface's points do not count, and why; empty if all count.
std::string cut_off_text(const SurfaceIlluminance& surface);

// Returns a sentence that names quantity and unit, and what the numbers are relative to.
std::string quantity_text(const IlluminanceReport& report);

// Formats like "512.3 ± 1.2", with as many digits as the interval justifies.
std::string reading_text(const Reading95& reading);
// Aligns rows with equal numbers of cells in columns.
std::string table_text(const std::vector<std::vector<std::string>>& rows);
// Returns a table with one line for each surface.
std::string illuminance_text(const IlluminanceReport& report);
// Returns a table of the requirements and what became of each, its first row the heading.
std::vector<std::vector<std::string>> judgement_rows(std::span<const Judgement> judgements);
// Returns this table and a line with the result of all; empty if nothing was required.
std::string judgements_text(std::span<const Judgement> judgements);
// Says whether all are met, some missed, or some undecided.
std::string judgements_summary(std::span<const Judgement> judgements);
// Returns one line for each point under a line of column names (RFC 4180), with the uncertainty due to the
// lamps and the colour if they were computed.
std::string illuminance_csv(const IlluminanceReport& report, const MeasurementUncertainty& lamps = {},
                            const ColourReport& colour = {});
std::string illuminance_json(const IlluminanceReport& report, const MeasurementUncertainty& lamps = {},
                             const FarFieldErrors& far_field = {}, const ColourReport& colour = {},
                             std::span<const Judgement> judgements = {});
// Returns an image with one pixel for each point and v upwards. Its channels are Y (the illuminance),
// half_width, direct, indirect and lightgroup.NAME.
Image illuminance_image(const SurfaceIlluminance& surface, const IlluminanceReport& report);

}  // namespace lucerna
