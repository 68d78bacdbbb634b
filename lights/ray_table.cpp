// Text with a row of numbers for each ray, whose header says what the columns are.
//
// A table's header names its columns in one line, for example "# x[mm] y[mm] z[mm] l m n flux[lm]", or each
// in a line with its number, "# 4: kx". Units stand behind the names, or in lines such as "# length unit:
// mm". LightTools writes a header of keywords before rows of fixed columns.
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/system/content.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"
#include "lights/photometric_files.h"
#include "lights/ray_reader.h"

namespace lucerna {
namespace {

constexpr std::string_view kTableBlanks = " \t\r";

// Returns the text without the characters at both ends.
std::string_view without_ends(std::string_view text, std::string_view characters) {
    const std::size_t begin = text.find_first_not_of(characters);
    if (begin == text.npos) return {};
    return text.substr(begin, text.find_last_not_of(characters) + 1 - begin);
}

// --- rows --------------------------------------------------------------------------------------------------

// The values of a ray in the order in which RowTaker gets them.
enum Value : std::uint8_t { kX, kY, kZ, kDx, kDy, kDz, kFlux, kWavelength, kValues };
constexpr const char* kValueNames[kValues] = {"x",
                                              "y",
                                              "z",
                                              "the direction's x",
                                              "the direction's y",
                                              "the direction's z",
                                              "the flux",
                                              "the wavelength"};

struct RayTable {
    std::string kind = "table of rays";
    std::string text;                            // what the file says of itself
    std::vector<std::optional<Value>> columns;   // none: the column is ignored
    std::string_view separators = kTableBlanks;  // between numbers
    std::string_view end_mark;                   // of the rays; empty: they end with the file
    double metres = kMetresPerMillimetre, nanometres = 1;
    FluxUnit unit = FluxUnit::watt;
    double flux = NAN;  // of all rays
};

bool is_comment(std::string_view line) {
    line = without_ends(line, kTableBlanks);
    return line.empty() || std::string_view("#%;!/").find(line[0]) != line.npos;
}

// Returns true if the line is the mark, in any case; false if there is no mark.
bool is_mark(std::string_view line, std::string_view mark) {
    line = without_ends(line, kTableBlanks);
    return !mark.empty() && line.size() == mark.size() && lower_case(line) == mark;
}

bool has_wavelengths(const RayTable& table) {
    return std::ranges::find(table.columns, Value::kWavelength) != table.columns.end();
}

// Reads the rows from `line`, the first one, on.
RaySet read_table_rows(RayLines& lines, std::string_view line, const RayTable& table, RaySource& source,
                       Monitor& monitor) {
    RaySet set;
    set.unit = table.unit;
    (table.unit == FluxUnit::lumen ? set.header_lumens : set.header_watts) = table.flux;
    set.text = one_line(plain_text(table.text));
    RayColumns columns;
    columns.metres = table.metres;
    columns.nanometres = table.nanometres;
    columns.place = "line";
    if (has_wavelengths(table)) columns.wavelength = kWavelength;
    RowTaker rows(set, columns, 0);
    MemoryWatch memory(to_string(source.at()), "use fewer rays");
    const std::string expected = fmt::format("{} numbers, one for each column", table.columns.size());
    std::vector<float> numbers(table.columns.size());
    bool ended = false;
    Phase phase(monitor, "reading rays", source.left() + 1);
    std::uint64_t left = source.left();
    do {
        if (is_comment(line)) continue;
        ended = is_mark(line, table.end_mark);
        if (ended) break;
        const std::size_t count = read_numbers(line, table.separators, numbers, lines.at(), expected);
        if (count != numbers.size()) input_error(lines.at(), "{} numbers; expected {}", count, expected);
        std::array<float, kValues> row{};
        for (std::size_t i = 0; i < count; ++i) {
            if (table.columns[i]) row[*table.columns[i]] = numbers[i];
        }
        memory.add(sizeof(LampRay) + (columns.wavelength ? sizeof(V3f) : 0));
        rows.take(row.data(), static_cast<std::uint64_t>(lines.number()));
        phase.advance(left - source.left());
        left = source.left();
    } while (lines.next(line));
    if (!table.end_mark.empty() && !ended) {
        monitor.warn(fmt::format("{}: the end mark {} is missing; the file may be truncated",
                                 to_string(source.at()), table.end_mark));
    }
    set.provenance = fmt::format("{} {}, {} rays{}{}", table.kind, source.name(),
                                 set.rays.size() + set.skipped_nan + set.skipped_zero_direction,
                                 set.text.empty() ? "" : "; ", set.text);
    rows.settle(table.flux, RayTaker::Header::absolute, source, monitor);
    return set;
}

// --- units -------------------------------------------------------------------------------------------------

struct LengthUnit {
    std::string_view names;  // between blanks
    double metres;
};
constexpr LengthUnit kLengthUnits[] = {
    {" mm millimeter millimeters millimetre millimetres ", 1e-3},
    {" cm centimeter centimeters centimetre centimetres ", 0.01},
    {" m meter meters metre metres ", 1},
    {" in inch inches ", 0.0254},
    {" ft foot feet ", 0.3048},
    {" um µm micron microns micrometer micrometers micrometre micrometres ", 1e-6},
    {" nm nanometer nanometers nanometre nanometres ", 1e-9}};

std::optional<double> metres_of_word(std::string_view word) {
    const std::string between = " " + lower_case(word) + " ";
    for (const LengthUnit& unit : kLengthUnits) {
        if (unit.names.find(between) != unit.names.npos) return unit.metres;
    }
    return {};
}

double length_unit(std::string_view word, const Location& at) {
    if (const std::optional<double> metres = metres_of_word(word)) return *metres;
    input_error(at, "unit of length \"{}\"; expected mm, cm, m, in, ft, um or nm", shown_value(word));
}

FluxUnit flux_unit(std::string_view word, const Location& at) {
    const std::string lower = lower_case(word);
    if (lower == "w" || lower == "watt" || lower == "watts") return FluxUnit::watt;
    if (lower == "lm" || lower == "lumen" || lower == "lumens") return FluxUnit::lumen;
    input_error(at, "unit of flux \"{}\"; expected W or lm", shown_value(word));
}

double nanometres_of_word(std::string_view word, const Location& at) {
    const double metres = metres_of_word(word).value_or(0);
    if (metres == 1e-9 || metres == 1e-6) return metres * 1e9;
    input_error(at, "unit of wavelengths \"{}\"; expected nm or um", shown_value(word));
}

// --- headers of tables -------------------------------------------------------------------------------------

constexpr const char* kHeaderExample = "\"# x[mm] y[mm] z[mm] l m n flux[lm] wavelength[nm]\"";

// A column's name and unit, as they stand in a header.
struct NamedColumn {
    std::string name, unit;
};

// Splits "x[mm]", "x (mm)" or "x/mm".
NamedColumn named_column(std::string_view field) {
    field = without_ends(field, " \t\r\"'");
    const std::size_t mark = field.find_first_of("[(/");
    if (mark == field.npos || mark == 0) return {std::string(field), ""};
    return {std::string(without_ends(field.substr(0, mark), kTableBlanks)),
            std::string(without_ends(field.substr(mark + 1), " \t\r])"))};
}

// Returns the value that a column's name stands for, in any case and with blanks, - and _ left out.
std::optional<Value> value_named(std::string_view name) {
    std::string plain;
    for (const char c : lower_case(name)) {
        if (std::string_view(" _-").find(c) == std::string_view::npos) plain += c;
    }
    const auto is = [&plain](std::string_view names) { return names.find(" " + plain + " ") != names.npos; };
    if (plain.empty()) return {};
    if (is(" flux power phi energy radiantflux radiantpower luminousflux ")) return kFlux;
    if (is(" wavelength lambda wl λ ")) return kWavelength;
    constexpr std::string_view kPositions[] = {" x x0 xpos posx xposition positionx xstart startx px ",
                                               " y y0 ypos posy yposition positiony ystart starty py ",
                                               " z z0 zpos posz zposition positionz zstart startz pz "};
    constexpr std::string_view kDirections[] = {" l u a kx dx xdir dirx xdirection directionx ",
                                                " m v b ky dy ydir diry ydirection directiony ",
                                                " n w c kz dz zdir dirz zdirection directionz "};
    for (std::uint8_t axis = 0; axis < 3; ++axis) {
        if (is(kPositions[axis])) return static_cast<Value>(kX + axis);
        if (is(kDirections[axis])) return static_cast<Value>(kDx + axis);
    }
    return {};
}

// Collects what the lines of a header say.
class TableHeader {
  public:
    // Takes a line of the header, with its sign of a comment.
    void take(std::string_view line, const Location& at) {
        line = without_ends(line, " \t\r#%;!/\"");
        if (take_names(line, at) || take_number(line, at) || take_unit(line, at)) return;
        constexpr std::size_t kMostText = 1000;  // as in TM-25
        if (line.empty() || table_.text.size() > kMostText) return;
        table_.text += (table_.text.empty() ? "" : "; ") + std::string(line.substr(0, kMostText));
    }
    // Returns true if the header names a position.
    bool has_position() const { return named(kX) && named(kY) && named(kZ); }
    // Returns the table of a complete header. Throws InputError.
    RayTable settle(const Location& at);

  private:
    bool named(Value value) const { return std::ranges::find(table_.columns, value) != table_.columns.end(); }
    // Takes a line that names all columns.
    bool take_names(std::string_view line, const Location& at);
    // Takes a line "4: kx" or "column 4 kx".
    bool take_number(std::string_view line, const Location& at);
    // Takes a line "length unit: mm".
    bool take_unit(std::string_view line, const Location& at);
    void set_column(std::size_t number, std::string_view name, const Location& at);
    void set_unit(std::optional<Value> value, const NamedColumn& column, const Location& at);

    RayTable table_;
    std::optional<double> metres_, nanometres_;
    std::optional<FluxUnit> unit_;
};

// Returns the fields of a line of names, and the separators of its table.
std::vector<std::string> fields_of(std::string_view line, std::string_view& separators) {
    separators = line.find(';') != line.npos ? ";" : line.find(',') != line.npos ? "," : kTableBlanks;
    std::vector<std::string> fields;
    for (std::size_t begin = 0; begin < line.size();) {
        const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
        const std::string_view field = without_ends(line.substr(begin, end - begin), kTableBlanks);
        begin = end + 1;
        // A unit that stands alone belongs to the name before it.
        const bool blanks = separators == kTableBlanks;
        if (blanks && !fields.empty() && (field.starts_with('[') || field.starts_with('('))) {
            fields.back() += field;
        } else if (!blanks || !field.empty()) {
            fields.emplace_back(field);
        }
    }
    return fields;
}

bool TableHeader::take_names(std::string_view line, const Location& at) {
    std::string_view separators;
    const std::vector<std::string> fields = fields_of(line, separators);
    std::array<bool, kValues> found{};
    for (const std::string& field : fields) {
        if (const std::optional<Value> value = value_named(named_column(field).name)) found[*value] = true;
    }
    if (!found[kX] || !found[kY] || !found[kZ]) return false;
    table_.columns.clear();
    table_.separators = separators;
    for (std::size_t i = 0; i < fields.size(); ++i) set_column(i, named_column(fields[i]).name, at);
    for (std::size_t i = 0; i < fields.size(); ++i) set_unit(table_.columns[i], named_column(fields[i]), at);
    return true;
}

bool TableHeader::take_number(std::string_view line, const Location& at) {
    constexpr std::size_t kMostColumns = 64;
    const std::string lower = lower_case(line);
    std::size_t begin = lower.starts_with("column") ? 6 : lower.starts_with("col") ? 3 : 0;
    begin = std::min(line.find_first_not_of(" \t.", begin), line.size());
    std::size_t number = 0;
    const char* const from = line.data() + begin;
    const auto [end, error] = std::from_chars(from, line.data() + line.size(), number);
    if (error != std::errc() || number < 1 || number > kMostColumns) return false;
    const NamedColumn column =
        named_column(without_ends(line.substr(static_cast<std::size_t>(end - line.data())), " \t\r:=.)-"));
    if (column.name.empty()) return false;
    set_column(number - 1, column.name, at);
    set_unit(table_.columns[number - 1], column, at);
    return true;
}

bool TableHeader::take_unit(std::string_view line, const Location& at) {
    const std::size_t mark = line.find_first_of(":=");
    if (mark == line.npos) return false;
    const std::string key = lower_case(line.substr(0, mark));
    const std::string_view unit = without_ends(line.substr(mark + 1), kTableBlanks);
    if (key.find("unit") == key.npos) return false;
    if (key.find("wavelength") != key.npos) {
        nanometres_ = nanometres_of_word(unit, at);
    } else if (key.find("flux") != key.npos || key.find("power") != key.npos) {
        unit_ = flux_unit(unit, at);
    } else if (key.find("length") != key.npos || key.find("position") != key.npos) {
        metres_ = length_unit(unit, at);
    } else {
        return false;
    }
    return true;
}

void TableHeader::set_column(std::size_t number, std::string_view name, const Location& at) {
    if (table_.columns.size() <= number) table_.columns.resize(number + 1);
    const std::optional<Value> value = value_named(name);
    if (value && named(*value)) input_error(at, "two columns for {}; expected one", kValueNames[*value]);
    table_.columns[number] = value;
}

void TableHeader::set_unit(std::optional<Value> value, const NamedColumn& column, const Location& at) {
    if (!value) return;
    const std::string name = lower_case(column.name);
    if (*value == kFlux && name.starts_with("radiant")) unit_ = FluxUnit::watt;
    if (*value == kFlux && name.starts_with("luminous")) unit_ = FluxUnit::lumen;
    if (column.unit.empty()) return;
    if (*value == kFlux) {
        unit_ = flux_unit(column.unit, at);
    } else if (*value == kWavelength) {
        nanometres_ = nanometres_of_word(column.unit, at);
    } else if (*value <= kZ) {
        const double metres = length_unit(column.unit, at);
        if (metres_ && *metres_ != metres) throw InputError(at, "positions have several units; expected one");
        metres_ = metres;
    }
}

RayTable TableHeader::settle(const Location& at) {
    for (const Value value : {kX, kY, kZ, kDx, kDy, kDz, kFlux}) {
        if (!named(value))
            input_error(at, "no column for {}; expected a line such as {}", kValueNames[value],
                        kHeaderExample);
    }
    const auto require_unit = [&at](bool known, const char* of) {
        if (known) return;
        input_error(at, "no unit of {}; expected one behind the name of the column, as in {}", of,
                    kHeaderExample);
    };
    require_unit(metres_.has_value(), "the positions");
    require_unit(unit_.has_value(), "the flux");
    require_unit(nanometres_.has_value() || !named(kWavelength), "the wavelength");
    table_.metres = *metres_;
    table_.unit = *unit_;
    table_.nanometres = nanometres_.value_or(1);
    return table_;
}

// Returns true if the line begins with a number: it is a row, and the header has ended.
bool begins_with_number(std::string_view line) {
    line = without_ends(line, kTableBlanks);
    if (line.starts_with('+')) line.remove_prefix(1);
    double number = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
    if (error == std::errc::invalid_argument) return false;
    return end == line.data() + line.size() ||
           std::string_view(" \t\r,;").find(*end) != std::string_view::npos;
}

// Takes the lines of a header. Returns the first row, or an empty line if there is none.
std::string_view take_header(RayLines& lines, TableHeader& header) {
    std::string_view line;
    while (lines.next(line)) {
        if (!is_comment(line) && begins_with_number(line)) return line;
        header.take(line, lines.at());
    }
    return {};
}

// --- LightTools --------------------------------------------------------------------------------------------

constexpr std::string_view kStartOfData = "lt_startofdata", kEndOfData = "lt_endofdata";

// Takes a line "keyword: value" of LightTools's header.
void take_keyword(const std::string& key, std::string_view value, RayTable& table, const Location& at,
                  Monitor& monitor) {
    const std::string word = lower_case(value);
    const auto refuse = [&](const char* accepted) {
        input_error(at, "{} \"{}\"; expected {}", key, shown_value(value), accepted);
    };
    if (key == "lt_rdf_version") {
        if (!word.starts_with("2")) refuse("2.0 (no polarisation)");
    } else if (key == "lt_datatype") {
        if (word != "radiant_power" && word != "luminous_flux") refuse("radiant_power or luminous_flux");
        table.unit = word == "luminous_flux" ? FluxUnit::lumen : FluxUnit::watt;
    } else if (key == "lt_far_field_data") {
        if (word != "no") refuse("no (rays with positions)");
    } else if (key == "lt_color_info") {
        if (word != "none" && word != "wavelength") refuse("none or wavelength");
        table.columns.resize(word == "none" ? kFlux + 1 : kWavelength + 1);
        if (word == "wavelength") table.columns[kWavelength] = kWavelength;
    } else if (key == "lt_length_units") {
        if (word == "system") {
            monitor.warn(fmt::format("{}: lengths are in the unit of the original model; mm is assumed",
                                     to_string(at)));
        } else {
            table.metres = length_unit(value, at);
        }
    } else if (key == "lt_radiant_flux" || key == "lt_luminous_flux") {
        const std::optional<double> flux = number_of(value);
        constexpr double kMost = std::numeric_limits<float>::max();  // rays store their share as a float
        if (!flux || std::fabs(*flux) > kMost) refuse("a number up to 3.4e38");
        table.flux = *flux;
    } else if (key == "dataname") {
        table.text = value;
    }
}

// Takes the lines up to the mark of the first row.
RayTable lighttools_table(RayLines& lines, RaySource& source, Monitor& monitor) {
    RayTable table;
    table.kind = "LightTools text ray file";
    table.end_mark = kEndOfData;
    for (const Value value : {kX, kY, kZ, kDx, kDy, kDz, kFlux}) table.columns.emplace_back(value);
    std::string_view line;
    while (lines.next(line)) {
        if (is_comment(line)) continue;
        const std::size_t colon = std::min(line.find(':'), line.size());
        const std::string key = lower_case(without_ends(line.substr(0, colon), kTableBlanks));
        if (key == kStartOfData) return table;
        take_keyword(key, without_ends(line.substr(colon), " \t\r:"), table, lines.at(), monitor);
    }
    input_error(source.at(), "truncated in the header: there is no line {}", kStartOfData);
}

}  // namespace

bool is_lighttools_text(std::span<const std::byte> first) {
    const std::string text = lower_case(text_of(first));
    return text.find(kStartOfData) != text.npos || text.find("lt_rdf_version") != text.npos;
}

RaySet read_lighttools_text(RaySource& source, Monitor& monitor) {
    RayLines lines(source);
    const RayTable table = lighttools_table(lines, source, monitor);
    std::string_view line;
    if (!lines.next(line)) throw InputError(source.at(), "truncated in the rays: there are none");
    return read_table_rows(lines, line, table, source, monitor);
}

bool is_ray_table(std::span<const std::byte> first) {
    if (content_name(first) != kPlainText) return false;
    const std::string_view text = text_of(first);
    TableHeader header;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        const std::string_view line = text.substr(begin, end - begin);
        begin = end + 1;
        if (!is_comment(line) && begins_with_number(line)) break;
        try {
            header.take(line, {});
        } catch (const InputError&) {
            break;  // the reader says what is wrong with it
        }
    }
    return header.has_position();
}

RaySet read_ray_table(RaySource& source, Monitor& monitor) {
    RayLines lines(source);
    TableHeader header;
    const std::string_view line = take_header(lines, header);
    const RayTable table = header.settle(lines.at());
    if (line.empty()) throw InputError(source.at(), "truncated in the rays: there are none");
    return read_table_rows(lines, line, table, source, monitor);
}

}  // namespace lucerna
