#include "engine/photometry/requirement_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

constexpr std::string_view kReference = "reference", kTask = "task";

// A line of the table and its fields.
struct Row {
    Location at;
    std::vector<std::string> fields;
};

std::vector<Row> rows_of(const std::filesystem::path& file) {
    const std::string content = read_text(file);
    std::vector<Row> rows;
    for (const TextLine& line : lines_of(without_byte_order_mark(content))) {
        if (!trimmed(line.text).empty())
            rows.push_back({{file.string(), line.number, 1}, csv_fields(line.text)});
    }
    return rows;
}

// Returns the column with a name, or the number of columns.
std::size_t column_of(const Row& head, std::string_view name) {
    return static_cast<std::size_t>(std::ranges::find(head.fields, name) - head.fields.begin());
}

// Returns the requirements of a row as a word of the command line.
std::string word_of(const Row& head, const Row& row) {
    std::string word;
    for (std::size_t i = 0; i < std::min(head.fields.size(), row.fields.size()); ++i) {
        if (head.fields[i] == kReference || head.fields[i] == kTask || row.fields[i].empty()) continue;
        word += fmt::format("{}{}={}", word.empty() ? "" : ",", head.fields[i], row.fields[i]);
    }
    return word;
}

RequiredLighting read_row(const std::filesystem::path& file, std::string_view reference) {
    const std::vector<Row> rows = rows_of(file);
    const std::size_t key = rows.empty() ? 0 : column_of(rows.front(), kReference);
    if (rows.empty() || key == rows.front().fields.size()) {
        throw InputError({file.string(), 1, 1},
                         fmt::format("expected names of columns, among them \"{}\"", kReference));
    }
    const std::size_t task = column_of(rows.front(), kTask);
    std::vector<std::string> references;
    std::optional<RequiredLighting> found;
    for (std::size_t i = 1; i < rows.size(); ++i) {
        const std::vector<std::string>& fields = rows[i].fields;
        if (key >= fields.size()) continue;
        references.push_back(plain_text(fields[key]));
        if (fields[key] != reference) continue;
        if (found) throw InputError(rows[i].at, fmt::format("is a second row \"{}\"", references.back()));
        found = {parse_requirements(rows[i].at, word_of(rows.front(), rows[i])), file,
                 fields[key] + (task < fields.size() ? ' ' + fields[task] : std::string())};
    }
    if (found) return *std::move(found);
    throw InputError({file.string()}, fmt::format("has no row with the {} \"{}\"; it has {}", kReference,
                                                  plain_text(reference), fmt::join(references, ", ")));
}

}  // namespace

RequiredLighting parse_required_lighting(const Location& at, std::string_view word) {
    const std::string_view first = word.substr(0, word.find(','));
    const std::size_t mark = first.rfind('#');
    if (mark == first.npos) return {parse_requirements(at, word), {}, {}};
    RequiredLighting all = read_row(first.substr(0, mark), first.substr(mark + 1));
    if (first.size() == word.size()) return all;
    const Requirements given = parse_requirements(at, word.substr(first.size() + 1));
    for (std::size_t i = 0; i < given.size(); ++i) {
        if (given[i]) all.limits[i] = given[i];
    }
    return all;
}

}  // namespace lucerna
