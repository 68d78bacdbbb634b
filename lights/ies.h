// IES LM-63 photometric files (.ies), all editions: 1986, 1991, 1995, 2002, 2019.
//
// Every edition is keywords, a line TILT=, and numbers that wrap wherever they like: ten of the luminaire,
// three of its ballast, the angles, the candela values. Candela are value × multiplier × ballast factor (and
// × the ballast-lamp factor in the editions of 1986 and 1991), in the file's own scale: absolute. TILT tells
// how the lamp's flux falls when the luminaire is tilted out of the position it was measured in; it is read,
// checked and not applied, as a scene's lamp is measured in the position it has.
//
// Source: ANSI/IESNA LM-63-2002.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "engine/base/monitor.h"
#include "lights/photometric.h"

namespace lucerna {

// Throws InputError naming file, line and column.
PhotometricWeb read_ies(const std::filesystem::path& file, Monitor& monitor);
// The same from memory; `file` only names it in messages.
PhotometricWeb parse_ies(std::string_view text, const std::string& file, Monitor& monitor);

// LM-63-2002, type C, absolute photometry; `title` becomes [TEST] and [LUMINAIRE]. A web of type A or B is
// resampled on a grid of 2.5 by 5 degrees; of type C, the file holds the very web.
std::string ies_text(const PhotometricWeb& web, std::string_view title);
void write_ies(const std::filesystem::path& file, const PhotometricWeb& web, std::string_view title);

}  // namespace lucerna
