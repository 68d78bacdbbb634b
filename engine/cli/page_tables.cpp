#include "engine/cli/page_tables.h"

#include <fmt/format.h>

#include "engine/figures/markup.h"

namespace lucerna {

std::string html_row(const std::vector<std::string>& cells, std::string_view cell, std::size_t text_columns,
                     std::string_view last) {
    std::string html = "<tr>";
    for (std::size_t c = 0; c < cells.size(); ++c) {
        const std::string_view style = c < text_columns ? "" : c + 1 < cells.size() ? "number" : last;
        html += fmt::format("<{0}{1}>{2}</{0}>", cell,
                            style.empty() ? std::string() : fmt::format(" class=\"{}\"", style),
                            html_text(cells[c]));
    }
    return html + "</tr>\n";
}

std::string html_table(const std::vector<std::vector<std::string>>& rows, std::size_t text_columns) {
    std::string html = "<table>\n<thead>" + html_row(rows.front(), "th", text_columns) + "</thead>\n";
    for (std::size_t r = 1; r < rows.size(); ++r) html += html_row(rows[r], "td", text_columns);
    return html + "</table>\n";
}

}  // namespace lucerna
