// Text and pictures as parts of HTML, SVG and Markdown.
#pragma once

#include <string>
#include <string_view>

#include "engine/image/image.h"

namespace lucerna {

// Text that shows as itself in HTML, also inside quotes.
std::string html_text(std::string_view text);
// The same for SVG in a file of its own, on one line: control characters, which XML does not allow, are
// written out.
std::string svg_text(std::string_view text);

// Text that Markdown prints as it is; in a table's cell, too.
std::string markdown(std::string_view text);

// "data:image/png;base64,…" of a plain picture.
std::string data_url(const Image& picture);

}  // namespace lucerna
