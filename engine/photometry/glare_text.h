// Ratings of glare, for people, for spreadsheets and for programs.
#pragma once

#include <span>
#include <string>

#include "engine/photometry/glare.h"

namespace lucerna {

// A table, a line for each observer.
std::string glare_text(std::span<const GlareReport> reports);
// The same under a line of column names (RFC 4180).
std::string glare_csv(std::span<const GlareReport> reports);
// With each luminaire's term, and each source of daylight.
std::string glare_json(std::span<const GlareReport> reports);

}  // namespace lucerna
