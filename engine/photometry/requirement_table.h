// Requirements as a command line states them: by value, or as a row of a user's own table, such as one with
// the rows of EN 12464-1 that a planner works with.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "engine/photometry/en12464.h"

namespace lucerna {

struct RequiredLighting {
    Requirements limits;
    std::filesystem::path table;  // empty: none
    std::string task;             // reference and name of the table's row: "34.2 writing, reading"
};

// Parses "Em=500,U0=0.6" or "tasks.csv#34.2,UGR=16", in which values replace those of the row 34.2. Reads the
// table: the first line names the columns, "reference", "task" (which may be left out) and requirements;
// empty fields require nothing; fields follow RFC 4180. Throws InputError.
RequiredLighting parse_required_lighting(const Location& at, std::string_view word);

}  // namespace lucerna
