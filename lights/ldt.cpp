#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "lights/ldt_values.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

constexpr int kMostLdtAngles = 100'000;
constexpr int kMostLampSets = 1000;
constexpr int kDirectRatios = 10;
constexpr double kMillimetre = 1e-3;

struct LdtHeader {
    int symmetry, planes, angles;
    double factor;  // from the file's values to candela
};

// Reads lines 1 to 12 and returns the location of the symmetry.
Location read_head(LdtValues& values, LdtHeader& header, PhotometricInfo& info) {
    const auto keep = [&](const char* key) { info.keywords.emplace_back(key, values.text(key)); };
    keep("manufacturer");
    values.number("line 2, the type", 0, 10, 0);
    header.symmetry = values.whole("line 3, the symmetry", 0, 4);
    const Location symmetry = values.place();
    header.planes = values.whole("line 4, the number of C planes", 1, kMostLdtAngles);
    values.number("line 5, the step of C", 0, 360, 0);
    header.angles = values.whole("line 6, the number of angles", 2, kMostLdtAngles);
    values.number("line 7, the step of the angles", 0, 180, 0);
    for (const char* key : {"report", "luminaire", "number", "file", "date"}) keep(key);
    return symmetry;
}

// Reads lines 13 to 26: sizes, ratios and lamps.
void read_lamps(LdtValues& values, LdtHeader& header, PhotometricInfo& info, Monitor& monitor) {
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
    int sets = values.whole("line 26, the number of lamp sets", -1, kMostLampSets);
    if (sets == 0) input_error(values.place(), "line 26, the number of lamp sets, is 0; expected at least 1");
    if (sets < 0) {
        monitor.warn(fmt::format("{}: -1 sets of lamps are read as 1", to_string(values.place())));
        sets = 1;
    }
    double lumens = 0;
    for (int i = 0; i < sets; ++i) {
        const double count = values.number("the number of lamps (negative: absolute)", -1e6, 1e6, 1);
        info.keywords.emplace_back("lamp", values.text("the lamps' type"));
        const double stated = values.number("the lamps' lumens", 0, 1e12);
        for (const char* key : {"colour", "colour rendering"})
            info.keywords.emplace_back(key, values.text(key));
        const double watts = values.number("the lamps' watts", 0, 1e9, 0);
        if (i > 0) continue;
        lumens = stated;
        info.lamp_lumens = count < 0 ? 0 : stated;
        info.watts = watts;
    }
    if (sets > 1)
        monitor.warn(fmt::format("{}: {} sets of lamps; the first is used", to_string(values.place()), sets));
    header.factor = conversion * lumens / 1000;
    if (!(header.factor > 0)) {
        monitor.warn(fmt::format(
            "{}: the lamp is dark, because its lumens, {:g}, or its conversion factor, {:g}, are 0",
            to_string(values.place()), lumens, conversion));
    }
}

std::vector<double> read_angles(LdtValues& values, int count, std::string_view what) {
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

// Describes the last part of the file, which starts with the direct ratios. In the format there are ten of
// these, and the planes that do not follow from the symmetry are stored.
struct Layout {
    int ratios = kDirectRatios;
    int symmetry = 0;
    enum class Listed { all, stored } listed = Listed::all;
    // Tells which of the listed planes are stored.
    std::size_t first = 0, count = 0;
};

std::vector<double> mirrors_of(int symmetry) {
    if (symmetry == 2) return {0};
    if (symmetry == 3) return {90};
    return symmetry == 4 ? std::vector<double>{0, 90} : std::vector<double>();
}

std::size_t stored_count(int symmetry, std::size_t planes) {
    switch (symmetry) {
        case 1:
            return 1;
        case 2:
        case 3:
            return planes / 2 + 1;
        case 4:
            return planes / 4 + 1;
        default:
            return planes;
    }
}

void find_first_plane(Layout& layout, const std::vector<double>& planes, const Location& place) {
    if (layout.symmetry != 3 || layout.listed == Layout::Listed::stored) return;
    const auto c90 = std::find(planes.begin(), planes.end(), 90.0);
    if (c90 == planes.end())
        input_error(place, "symmetry 3 without a plane C90; expected it among the C angles");
    layout.first = static_cast<std::size_t>(c90 - planes.begin());
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

// A list of the stored planes alone ends where its symmetry mirrors it; a list of all planes goes around.
void require_range(const Layout& layout, int stated, const std::vector<double>& planes,
                   const Location& place) {
    const double first = planes.front(), last = planes.back();
    const bool listed = layout.listed == Layout::Listed::stored;
    const double most = layout.symmetry == 4 ? 90 : layout.symmetry == 2 ? 180 : 270;
    const bool within = last <= most && (layout.symmetry != 3 || first >= 90);
    const bool around = layout.symmetry != 0 || layout.symmetry == stated || last - first > 180;
    if ((listed && !within) || !around)
        input_error(place, "C planes from {:g} to {:g} degrees; expected others", first, last);
}

// Reads the direct ratios, the angles and the intensities.
PhotometricGrid read_table(LdtValues& values, const LdtHeader& header, Layout layout,
                           const Location& symmetry) {
    for (int i = 0; i < layout.ratios; ++i) values.number("a direct ratio", -1e6, 1e6, 0);
    const std::vector<double> planes = read_angles(values, header.planes, "a C angle");
    PhotometricGrid grid{
        PhotometricPlanes::c, read_angles(values, header.angles, "a vertical angle"), {}, {}};
    require_range(layout, header.symmetry, planes, symmetry);
    find_first_plane(layout, planes, symmetry);
    for (std::size_t i = 0; i < layout.count; ++i) {
        const std::size_t plane = layout.first + i;
        if (plane >= planes.size()) {
            input_error(symmetry, "symmetry {} needs a plane beyond the last of the {} C planes",
                        layout.symmetry, planes.size());
        }
        grid.azimuth.push_back(planes[plane]);
        for (int g = 0; g < header.angles; ++g) {
            const double candela = values.number("an intensity", 0, 1e30) * header.factor;
            if (!(candela <= 1e30))
                input_error(values.place(), "an intensity is {:g} cd; expected 0 to 1e30", candela);
            grid.candela.push_back(static_cast<float>(candela));
        }
    }
    if (layout.count == 1) grid.azimuth.front() = 0;
    complete_c_planes(grid, mirrors_of(layout.symmetry));
    if (layout.symmetry > 1 && layout.listed == Layout::Listed::all)
        require_symmetry(planes, grid, layout.symmetry, symmetry);
    if (const std::string why = grid.fault(); !why.empty()) throw InputError(symmetry, why);
    return grid;
}

// Returns the layouts that files have, beside the format's own, and that hold as many numbers as are left.
std::vector<Layout> layouts_of(const LdtHeader& header, std::size_t left) {
    const auto planes = static_cast<std::size_t>(header.planes),
               angles = static_cast<std::size_t>(header.angles);
    std::vector<Layout> found;
    for (int ratios = kDirectRatios; ratios >= 0; --ratios) {
        const auto try_layout = [&](int symmetry, std::size_t count, Layout::Listed listed) {
            if (left != static_cast<std::size_t>(ratios) + planes + angles + count * angles) return;
            found.push_back({ratios, symmetry, listed, 0, count});
        };
        try_layout(header.symmetry, stored_count(header.symmetry, planes), Layout::Listed::all);
        if (planes == 1) continue;
        if (header.symmetry != 0) try_layout(0, planes, Layout::Listed::all);
        if (header.symmetry > 1) try_layout(header.symmetry, planes, Layout::Listed::stored);
        if (header.symmetry != 1) try_layout(1, 1, Layout::Listed::all);
        if (header.symmetry != 4) try_layout(4, stored_count(4, planes), Layout::Listed::all);
    }
    return found;
}

std::string name_of(const Layout& layout, const LdtHeader& header) {
    std::string name;
    if (layout.ratios != kDirectRatios) name += fmt::format("{} direct ratios instead of 10", layout.ratios);
    const auto add = [&name](const std::string& text) { name += (name.empty() ? "" : " and ") + text; };
    if (layout.listed == Layout::Listed::stored) {
        add(fmt::format("a list of the stored planes alone, of symmetry {}", layout.symmetry));
    } else if (layout.symmetry != header.symmetry) {
        add(fmt::format("the {} planes of symmetry {} instead of {}", layout.count, layout.symmetry,
                        header.symmetry));
    }
    return name.empty() ? "empty lines or several numbers in a line" : name;
}

// Reads the last part as the format has it or, where that fails or leaves numbers over, in the only other
// layout that fits all of them.
PhotometricGrid read_any_table(LdtValues& values, const LdtHeader& header, const Location& symmetry,
                               Monitor& monitor) {
    const auto count = stored_count(header.symmetry, static_cast<std::size_t>(header.planes));
    const Layout stated{kDirectRatios, header.symmetry, Layout::Listed::all, 0, count};
    std::optional<PhotometricGrid> grid;
    std::optional<InputError> error;
    LdtValues rest = values;
    try {
        grid = read_table(rest, header, stated, symmetry);
        if (!rest.any_left()) return *grid;
    } catch (const InputError& failure) {
        error = failure;
    }
    std::vector<std::pair<Layout, PhotometricGrid>> others;
    if (const auto words = values.words_left()) {
        for (const Layout& layout : layouts_of(header, words->left())) {
            try {
                LdtValues copy = *words;
                others.emplace_back(layout, read_table(copy, header, layout, symmetry));
            } catch (const InputError&) {  // this layout does not fit
            }
        }
    }
    if (others.size() == 1) {
        monitor.warn(fmt::format("{}: the file has {}", to_string(values.place()),
                                 name_of(others.front().first, header)));
        return std::move(others.front().second);
    }
    if (error) throw *error;
    monitor.warn(fmt::format("{}: the text after the intensities is ignored", to_string(rest.place())));
    return *grid;
}

}  // namespace

PhotometricWeb parse_ldt(std::string_view text, const std::string& file, Monitor& monitor) {
    LdtValues values(ldt_lines(text, file, monitor), file);
    PhotometricInfo info;
    info.axis_along_c90 = true;
    LdtHeader header{};
    const Location symmetry = read_head(values, header, info);
    read_lamps(values, header, info, monitor);
    PhotometricGrid grid = read_any_table(values, header, symmetry, monitor);
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

}  // namespace lucerna
