// Formats ratings of glare as text, CSV and JSON.
#pragma once

#include <span>
#include <string>

#include "engine/photometry/glare.h"

namespace lucerna {

// Formats a rating with its interval; "none" where no luminaire is seen, or "undefined".
std::string rating_text(const Reading95& rating);
// Returns a table with one line for each observer.
std::string glare_text(std::span<const GlareReport> reports);
// Returns one line for each observer under a line of column names (RFC 4180).
std::string glare_csv(std::span<const GlareReport> reports);
// Returns the ratings with the term of each luminaire and each source of daylight.
std::string glare_json(std::span<const GlareReport> reports);

}  // namespace lucerna
