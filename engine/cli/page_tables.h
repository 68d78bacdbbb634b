// Tables of text cells in HTML pages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lucerna {

// Returns a row of cells <th> or <td>, the first `text_columns` of text and the others of the style of
// numbers, but for the last one, which has the style `last`.
std::string html_row(const std::vector<std::string>& cells, std::string_view cell, std::size_t text_columns,
                     std::string_view last = "number");

// Returns a table; the first row is the heading, and numbers are right-aligned.
std::string html_table(const std::vector<std::vector<std::string>>& rows, std::size_t text_columns);

}  // namespace lucerna
