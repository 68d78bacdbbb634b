#include "lights/photometric_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/files.h"

namespace lucerna {
namespace {

constexpr int kMostLdtAngles = 100'000;
constexpr int kMostLampSets = 1000;
constexpr int kDirectRatios = 10;
constexpr double kMillimetre = 1e-3;

// The values, one per line, in order.
class Values {
  public:
    Values(std::string_view text, std::string file) : lines_(lines_of(text)), file_(std::move(file)) {}

    std::string_view text(std::string_view what) {
        if (next_ == lines_.size()) {
            throw InputError({file_}, fmt::format("the file ends after line {}; expected {}", next_, what));
        }
        return trimmed(lines_[next_++].text);
    }
    // An empty line is `empty`, if that is given.
    double number(std::string_view what, double least, double most, std::optional<double> empty = {}) {
        std::string word(text(what));
        if (word.empty() && empty) return *empty;
        std::replace(word.begin(), word.end(), ',', '.');  // of countries where that is the decimal sign
        const auto value = number_of(word);
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
    // Of the value that came last.
    Location place() const { return {file_, static_cast<int>(next_), 1}; }
    bool any_left() const {
        return std::any_of(lines_.begin() + static_cast<std::ptrdiff_t>(next_), lines_.end(),
                           [](const TextLine& line) { return trimmed(line.text).size() > 1; });
    }

  private:
    std::vector<TextLine> lines_;
    std::string file_;
    std::size_t next_ = 0;
};

struct LdtHeader {
    int symmetry, planes, angles;
    double factor;  // from the file's values to candela
};

// Lines 1 to 12.
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

// Lines 13 to 26: sizes, ratios and lamps.
void read_lamps(Values& values, LdtHeader& header, PhotometricInfo& info, Monitor& monitor) {
    double size[9];
    for (double& millimetres : size) millimetres = values.number("a dimension", 0, 1e6, 0) * kMillimetre;
    // Lengths lie along C90-C270; a width of 0 is a circle. The luminous sizes, where they are stated.
    const bool luminous = size[3] > 0;
    const double length = luminous ? size[3] : size[0], width = luminous ? size[4] : size[1];
    info.round_opening = length > 0 && width == 0;
    info.opening = V3d(info.round_opening ? length : width, length, *std::max_element(size + 5, size + 9));
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

// Which of the listed planes are stored.
struct Stored {
    std::size_t first, count;
};

Stored stored_planes(const LdtHeader& header, const Location& place) {
    const auto planes = static_cast<std::size_t>(header.planes);
    const auto divides = [&](std::size_t by) {
        if (planes % by == 0) return;
        input_error(place, "{} C planes with symmetry {}; expected a multiple of {}", planes, header.symmetry,
                    by);
    };
    switch (header.symmetry) {
        case 1:
            return {0, 1};
        case 2:
            divides(2);
            return {0, planes / 2 + 1};
        case 3:
            divides(4);
            return {planes / 4, planes / 2 + 1};
        case 4:
            divides(4);
            return {0, planes / 4 + 1};
        default:
            return {0, planes};
    }
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

}  // namespace

PhotometricWeb parse_ldt(std::string_view text, const std::string& file, Monitor& monitor) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // some editors' mark
    Values values(text, file);
    PhotometricInfo info;
    LdtHeader header = read_head(values, info);
    const Location symmetry{file, 3, 1};
    const Stored stored = stored_planes(header, symmetry);
    read_lamps(values, header, info, monitor);

    // Angles and intensities.
    const std::vector<double> planes = read_angles(values, header.planes, "a C angle");
    PhotometricGrid grid;
    grid.polar = read_angles(values, header.angles, "an angle gamma");
    for (std::size_t i = 0; i < stored.count; ++i) {
        // A mirror's plane at 360 is not listed: the list begins anew.
        grid.azimuth.push_back(planes[(stored.first + i) % planes.size()]);
        for (int j = 0; j < header.angles; ++j) {
            const double value = values.number("an intensity", 0, 1e12) * header.factor;
            grid.candela.push_back(static_cast<float>(value));
        }
    }
    for (std::size_t i = 1; i < grid.azimuth.size(); ++i) {
        if (!(grid.azimuth[i] > grid.azimuth[i - 1])) {
            input_error(symmetry, "symmetry {} does not fit {} C planes up to {:g} degrees", header.symmetry,
                        header.planes, planes.back());
        }
    }
    complete_c_planes(grid, symmetry);
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
