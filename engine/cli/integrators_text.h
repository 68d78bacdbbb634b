// The integrators and their parameters, as `lucerna info --integrators` and the reference page list them.
#pragma once

#include <string>
#include <string_view>

namespace lucerna {

std::string integrators_text();
// The same in Markdown: a heading of that level ("###") and a table for each.
std::string integrators_markdown(std::string_view level);

}  // namespace lucerna
