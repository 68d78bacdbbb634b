// EULUMDAT photometric files (.ldt): one value per line, intensities in candela per 1000 lm of the lamps.
//
// Candela are value × conversion factor × the lamps' lumens / 1000; the luminaire's light output ratio is
// already in the values. Of several sets of lamps that a luminaire may be fitted with, the first counts.
//
// Source: the EULUMDAT file format (Stockmar 1990), as light planning programs describe it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "engine/base/monitor.h"
#include "lights/photometric.h"

namespace lucerna {

// Throws InputError naming file and line.
PhotometricWeb read_ldt(const std::filesystem::path& file, Monitor& monitor);
// The same from memory; `file` only names it in messages.
PhotometricWeb parse_ldt(std::string_view text, const std::string& file, Monitor& monitor);

// By the file's ending, .ies or .ldt in any case.
bool is_photometric(const std::filesystem::path& file);
PhotometricWeb read_photometric(const std::filesystem::path& file, Monitor& monitor);

}  // namespace lucerna
