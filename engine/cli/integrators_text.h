// Lists the integrators and their parameters for `lucerna info --integrators` and the reference page.
#pragma once

#include <string>
#include <string_view>

namespace lucerna {

std::string integrators_text();
// Returns the same list in Markdown: a heading of that level ("###") and a table for each.
std::string integrators_markdown(std::string_view level);

}  // namespace lucerna
