// Embeds text and pictures in HTML, SVG and Markdown.
#pragma once

#include <string>
#include <string_view>

#include "engine/image/image.h"

namespace lucerna {

// Escapes text for HTML, also inside quotes.
std::string html_text(std::string_view text);
// Escapes text for a separate SVG file, on one line. Control characters, which XML does not allow, are spelt
// out.
std::string svg_text(std::string_view text);

// Escapes text for Markdown, also in a table's cell.
std::string markdown(std::string_view text);

// Returns "data:image/png;base64,…" for a plain picture.
std::string data_url(const Image& picture);

}  // namespace lucerna
