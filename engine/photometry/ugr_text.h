// Formats UGR tables as text and CSV.
#pragma once

#include <string>

#include "engine/photometry/ugr_table.h"

namespace lucerna {

// Returns the name of the method of a table's values.
std::string ugr_method(const UgrTable& table);
// Returns the table for 1000 lm and that for the luminaire's own lamps, with a line for each room.
std::string ugr_text(const UgrTable& table);
// Returns one line for each rating under a line of column names (RFC 4180). A rating where no luminaire
// shines at the eye is an empty cell.
std::string ugr_csv(const UgrTable& table);

}  // namespace lucerna
