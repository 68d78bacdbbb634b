#include "lights/photometric_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

constexpr int kMostLdtAngles = 100'000;
constexpr int kMostLampSets = 1000;
constexpr int kDirectRatios = 10;
constexpr double kMillimetre = 1e-3;

constexpr std::size_t kTextLines = 12;  // the lines of the head, most of them text

// Gives the values, one per line, in order. A comma is a decimal comma, as in the countries of the format. In
// a file with decimal points, a comma before three digits may also separate thousands.
class Values {
  public:
    Values(std::string_view text, std::string file) : lines_(lines_of(text)), file_(std::move(file)) {
        for (std::size_t i = kTextLines; i < lines_.size() && !points_; ++i) {
            const std::string_view word = trimmed(lines_[i].text);
            points_ = word.find('.') != std::string_view::npos && number_of(word);
        }
    }

    std::string_view text(std::string_view what) {
        if (next_ == lines_.size()) {
            throw InputError({file_}, fmt::format("the file ends after line {}; expected {}", next_, what));
        }
        return trimmed(lines_[next_++].text);
    }
    // An empty line gives `empty`, if that is set.
    double number(std::string_view what, double least, double most, std::optional<double> empty = {}) {
        const std::string_view word = text(what);
        if (word.empty() && empty) return *empty;
        if (points_ && may_separate_thousands(word)) {
            input_error(place(),
                        "{} is \"{}\", whose comma may separate thousands or decimals, as other numbers of "
                        "the file have decimal points; expected a decimal point, or none",
                        what, shown_value(word));
        }
        const auto value = number_of(with_decimal_point(word));
        if (!value) input_error(place(), "{} is \"{}\"; expected a number", what, shown_value(word));
        if (!(*value >= least && *value <= most))
            input_error(place(), "{} is {:g}; expected {:g} to {:g}", what, *value, least, most);
        return *value;
    }
    int whole(std::string_view what, int least, int most) {
        const double value = number(what, least, most);
        if (value != std::floor(value))
            input_error(place(), "{} is {:g}; expected a whole number", what, value);
        return static_cast<int>(value);
    }
    // Returns the location of the last value.
    Location place() const { return {file_, static_cast<int>(next_), 1}; }
    bool any_left() const {
        return std::any_of(lines_.begin() + static_cast<std::ptrdiff_t>(next_), lines_.end(),
                           [](const TextLine& line) { return trimmed(line.text).size() > 1; });
    }

  private:
    std::vector<TextLine> lines_;
    std::string file_;
    std::size_t next_ = 0;
    bool points_ = false;  // some numbers of the file have decimal points
};

struct LdtHeader {
    int symmetry, planes, angles;
    double factor;  // from the file's values to candela
};

// Reads lines 1 to 12.
LdtHeader read_head(Values& values, PhotometricInfo& info) {
    LdtHeader header{};
    const auto keep = [&](const char* key) { info.keywords.emplace_back(key, values.text(key)); };
    keep("manufacturer");
    values.number("line 2, the type", 0, 10, 0);
    header.symmetry = values.whole("line 3, the symmetry", 0, 4);
    header.planes = values.whole("line 4, the number of C planes", 1, kMostLdtAngles);
    values.number("line 5, the step of C", 0, 360, 0);
    header.angles = values.whole("line 6, the number of angles", 2, kMostLdtAngles);
    values.number("line 7, the step of the angles", 0, 180, 0);
    for (const char* key : {"report", "luminaire", "number", "file", "date"}) keep(key);
    return header;
}

// Reads lines 13 to 26: sizes, ratios and lamps.
void read_lamps(Values& values, LdtHeader& header, PhotometricInfo& info, Monitor& monitor) {
    double size[9];
    for (double& millimetres : size) millimetres = values.number("a dimension", 0, 1e6, 0) * kMillimetre;
    // Lengths lie along C90-C270; a width of 0 is a circle. The luminous sizes are preferred where they are
    // stated.
    const bool luminous = size[3] > 0;
    const double length = luminous ? size[3] : size[0], width = luminous ? size[4] : size[1];
    const bool round = length > 0 && width == 0;
    info.opening =
        LuminousOpening(round ? LuminousOpening::Shape::cylinder_upright : LuminousOpening::Shape::box,
                        round ? length : width, length, {size[5], size[6], size[7], size[8]});
    values.number("line 22, the downward flux fraction", 0, 1000, 0);
    info.output_ratio = values.number("line 23, the light output ratio", 0, 1000, 0) / 100;
    const double conversion = values.number("line 24, the conversion factor", 0, 1e6, 1);
    values.number("line 25, the tilt", -360, 360, 0);
    const int sets = values.whole("line 26, the number of lamp sets", 1, kMostLampSets);
    double lumens = 0;
    for (int i = 0; i < sets; ++i) {
        const double count = values.number("the number of lamps (negative: absolute)", -1e6, 1e6, 1);
        info.keywords.emplace_back("lamp", values.text("the lamps' type"));
        const double stated = values.number("the lamps' lumens", 0, 1e12);
        for (const char* key : {"colour", "colour rendering"}) values.text(key);
        const double watts = values.number("the lamps' watts", 0, 1e9, 0);
        if (i > 0) continue;
        lumens = stated;
        info.lamp_lumens = count < 0 ? 0 : stated;
        info.watts = watts;
    }
    if (sets > 1)
        monitor.warn(fmt::format("{}: {} sets of lamps; the first is used", to_string(values.place()), sets));
    header.factor = conversion * lumens / 1000;
    for (int i = 0; i < kDirectRatios; ++i) values.number("a direct ratio", -1e6, 1e6, 0);
}

std::vector<double> read_angles(Values& values, int count, std::string_view what) {
    std::vector<double> angles;
    for (int i = 0; i < count; ++i) {
        const double angle = values.number(what, 0, 360);
        if (!angles.empty() && !(angle > angles.back())) {
            input_error(values.place(), "{} {:g} follows {:g}; expected ascending angles", what, angle,
                        angles.back());
        }
        angles.push_back(angle);
    }
    return angles;
}

// Tells which of the listed planes are stored, and about which planes they are mirrored.
struct Stored {
    std::size_t first, count;
    std::vector<double> mirrors;
};

Stored stored_planes(int symmetry, const std::vector<double>& planes, const Location& place) {
    const std::size_t count = planes.size();
    switch (symmetry) {
        case 1:
            return {0, 1, {}};
        case 2:
            return {0, count / 2 + 1, {0}};
        case 3: {
            const auto c90 = std::find(planes.begin(), planes.end(), 90.0);
            if (c90 == planes.end())
                input_error(place, "symmetry 3 without a plane C90; expected it among the C angles");
            return {static_cast<std::size_t>(c90 - planes.begin()), count / 2 + 1, {90}};
        }
        case 4:
            return {0, count / 4 + 1, {0, 90}};
        default:
            return {0, count, {}};
    }
}

// The file lists all planes, also those that its symmetry omits. A listed plane that completion did not
// create shows that the list does not have the symmetry.
void require_symmetry(const std::vector<double>& planes, const PhotometricGrid& grid, int symmetry,
                      const Location& place) {
    for (const double listed : planes) {
        constexpr double kSame = 1e-6;  // degrees
        const auto made = std::lower_bound(grid.azimuth.begin(), grid.azimuth.end(), listed - kSame);
        if (made != grid.azimuth.end() && *made <= listed + kSame) continue;
        input_error(place,
                    "symmetry {} does not fit the {} C planes: C{:g} is not a mirror image of one of the "
                    "first planes",
                    symmetry, planes.size(), listed);
    }
}

}  // namespace

PhotometricWeb parse_ldt(std::string_view text, const std::string& file, Monitor& monitor) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark
    Values values(text, file);
    PhotometricInfo info;
    LdtHeader header = read_head(values, info);
    const Location symmetry{file, 3, 1};
    read_lamps(values, header, info, monitor);

    const std::vector<double> planes = read_angles(values, header.planes, "a C angle");
    const Stored stored = stored_planes(header.symmetry, planes, symmetry);
    PhotometricGrid grid;
    grid.polar = read_angles(values, header.angles, "an angle gamma");
    for (std::size_t i = 0; i < stored.count; ++i) {
        // After the last listed plane, which is below 360, the list starts again.
        const std::size_t at = stored.first + i;
        grid.azimuth.push_back(planes[at % planes.size()] + (at < planes.size() ? 0 : 360));
        for (int j = 0; j < header.angles; ++j) {
            const double value = values.number("an intensity", 0, 1e12) * header.factor;
            grid.candela.push_back(static_cast<float>(value));
        }
    }
    if (header.symmetry == 1) grid.azimuth.front() = 0;
    complete_c_planes(grid, stored.mirrors);
    if (header.symmetry > 1) require_symmetry(planes, grid, header.symmetry, symmetry);
    if (const std::string why = grid.fault(); !why.empty()) throw InputError({file}, why);
    if (values.any_left())
        monitor.warn(fmt::format("{}: the text after the intensities is ignored", to_string(values.place())));
    std::string provenance = "EULUMDAT";
    for (const std::size_t i : {0, 2}) {
        if (!info.keywords[i].second.empty()) provenance += ", " + info.keywords[i].second;
    }
    info.provenance = one_line(provenance);
    return PhotometricWeb(std::move(grid), std::move(info));
}

PhotometricWeb read_ldt(const std::filesystem::path& file, Monitor& monitor) {
    return parse_ldt(read_text(file), file.string(), monitor);
}

bool is_photometric(const std::filesystem::path& file) {
    const std::string suffix = suffix_of(file);
    return suffix == ".ies" || suffix == ".ldt";
}

PhotometricWeb read_photometric(const std::filesystem::path& file, Monitor& monitor) {
    const std::string suffix = suffix_of(file);
    if (suffix == ".ies") return read_ies(file, monitor);
    if (suffix == ".ldt") return read_ldt(file, monitor);
    input_error({file.string()}, "\"{}\" is not a photometric file; expected .ies or .ldt",
                shown_value(suffix));
}

}  // namespace lucerna
