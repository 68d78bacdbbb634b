#include "lights/photometric_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "lights/ies_words.h"

namespace lucerna {
namespace {

constexpr int kMostAngles = 100'000;
constexpr double kFoot = 0.3048;  // metres

enum class Edition { e1986, e1991, e1995, e2002_on };

Edition edition_of(std::string_view line) {
    if (line == "IESNA91" || line == "IESNA:LM-63-1991") return Edition::e1991;
    if (line == "IESNA:LM-63-1995") return Edition::e1995;
    return line.starts_with("IESNA") || line.starts_with("IES:") ? Edition::e2002_on : Edition::e1986;
}

bool is_tilt(std::string_view line) {
    return trimmed(line).starts_with("TILT=");
}

// Gives the numbers after the TILT line, one after the other.
class Numbers {
  public:
    Numbers(std::vector<IesWord> words, std::string file)
        : words_(std::move(words)), file_(std::move(file)) {}

    double next(std::string_view what) {
        if (next_ == words_.size()) {
            throw InputError({file_},
                             fmt::format("the file ends after {} numbers; expected {}", next_, what));
        }
        const IesWord& word = words_[next_++];
        const auto value = number_of(word.text);
        if (!value) input_error(place(), "{} is \"{}\"; expected a number", what, shown_value(word.text));
        return *value;
    }
    double next_within(std::string_view what, double least, double most) {
        const double value = next(what);
        if (!(value >= least && value <= most))
            input_error(place(), "{} is {:g}; expected {:g} to {:g}", what, value, least, most);
        return value;
    }
    int next_whole(std::string_view what, int least, int most) {
        const double value = next_within(what, least, most);
        if (value != std::floor(value))
            input_error(place(), "{} is {:g}; expected a whole number", what, value);
        return static_cast<int>(value);
    }
    // Returns the location of the last number.
    Location place() const { return next_ > 0 ? place_of(words_[next_ - 1]) : Location{file_}; }
    // Returns the location of the word after the last number, if there is one.
    std::optional<Location> rest() const {
        return next_ < words_.size() ? std::optional(place_of(words_[next_])) : std::nullopt;
    }

  private:
    Location place_of(const IesWord& word) const { return {file_, word.line, word.column}; }

    std::vector<IesWord> words_;
    std::string file_;
    std::size_t next_ = 0;
};

// Reads "[KEY] value"; [MORE] continues the previous keyword. Lines without brackets are the labels of 1986.
void read_keyword(std::string_view line, PhotometricInfo& info) {
    line = trimmed(line);
    if (line.empty()) return;
    const std::size_t close = line.find(']');
    if (!line.starts_with('[') || close == std::string_view::npos) {
        info.keywords.emplace_back("", line);
        return;
    }
    const std::string_view key = line.substr(1, close - 1), value = trimmed(line.substr(close + 1));
    if (key == "MORE" && !info.keywords.empty()) {
        info.keywords.back().second += ' ';
        info.keywords.back().second += value;
    } else {
        info.keywords.emplace_back(key, value);
    }
}

// Skips the factors by which the lamp's flux changes with tilt.
void read_included_tilt(Numbers& numbers) {
    numbers.next_within("TILT's lamp-to-luminaire geometry", 0, 3);
    const int pairs = numbers.next_whole("TILT's number of angles", 1, kMostAngles);
    for (int i = 0; i < pairs; ++i) numbers.next("a tilt angle");
    for (int i = 0; i < pairs; ++i) numbers.next("a tilt factor");
}

// Returns the body given by the signs of width, length and height, or none if no edition defines them. A
// negative size belongs to a round cross-section. Signs that one edition does not
// define are read as in another one.
//
//                    1986, 1991        1995               2002, 2019
//     disc, ellipse  -d 0 0, -w l 0    -d 0 0, -w l 0     -d -d 0, -w -l 0
//     upright        -d 0 h            -d 0 h, -w l h     -d -d h, -w -l h      (cylinders)
//     along C0                         0 l -d             -d l -d, -w l -h
//     along C90                        w 0 -d             w -d -d, w -l -h
//     facing C0                                           -d 0 -d, -w 0 -h      (vertical disc, ellipse)
//     ellipsoid      -w l h            -d 0 -d, -w l -h   -d -d -d, -w -l -h
//
// Up to 1995 width and length may be exchanged.
std::optional<LuminousOpening> opening_of(Edition edition, double w, double l, double h) {
    using Shape = LuminousOpening::Shape;
    const double width = std::fabs(w), length = std::fabs(l), height = std::fabs(h);
    const auto body = [&](Shape shape) { return LuminousOpening(shape, V3d(length, width, height)); };
    const bool late = edition == Edition::e2002_on;
    if (w >= 0 && l >= 0 && h >= 0) return body(Shape::box);
    if (w < 0 && l < 0) return body(h < 0 ? Shape::ellipsoid : Shape::cylinder_upright);
    if (w >= 0 && l >= 0) {  // only the height is negative
        if (w == 0 && l > 0) return LuminousOpening(Shape::cylinder_along_c0, V3d(length, height, height));
        if (l == 0 && w > 0) return LuminousOpening(Shape::cylinder_along_c90, V3d(height, width, height));
        return std::nullopt;
    }
    // Either the width or the length is negative.
    if (h < 0 && late) return body(w < 0 ? Shape::cylinder_along_c0 : Shape::cylinder_along_c90);
    const bool oval = w != 0 && l != 0, early = edition < Edition::e1995;
    const double d = width + length;  // for a circle, whose other size is 0
    const V3d sizes = oval ? V3d(length, width, height) : V3d(d, d, height);
    return LuminousOpening(h < 0 || (oval && early && h > 0) ? Shape::ellipsoid : Shape::cylinder_upright,
                           sizes);
}

struct Luminaire {
    double multiplier;
    int vertical, horizontal;
    PhotometricPlanes planes;
};

// Reads the ten numbers of the luminaire.
Luminaire read_luminaire(Numbers& numbers, Edition edition, PhotometricInfo& info, Monitor& monitor) {
    Luminaire luminaire{};
    const double lamps = numbers.next_within("the number of lamps", 0, 1e6);
    const double lumens = numbers.next_within("lumens per lamp", -1e9, 1e9);
    info.lamp_lumens = lumens > 0 ? lamps * lumens : 0;  // -1: absolute photometry
    luminaire.multiplier = numbers.next_within("the candela multiplier", 0, 1e9);
    luminaire.vertical = numbers.next_whole("the number of vertical angles", 2, kMostAngles);
    luminaire.horizontal = numbers.next_whole("the number of horizontal angles", 1, kMostAngles);
    constexpr PhotometricPlanes kTypes[] = {PhotometricPlanes::c, PhotometricPlanes::b, PhotometricPlanes::a};
    luminaire.planes = kTypes[numbers.next_whole("the photometric type (1 C, 2 B, 3 A)", 1, 3) - 1];
    const double unit = numbers.next_whole("the unit (1 feet, 2 metres)", 1, 2) == 1 ? kFoot : 1;
    double size[3];
    constexpr const char* kNames[] = {"the opening's width", "the opening's length", "the opening's height"};
    for (int i = 0; i < 3; ++i) size[i] = numbers.next_within(kNames[i], -1e4, 1e4) * unit;
    const auto opening = opening_of(edition, size[0], size[1], size[2]);
    if (!opening) {
        monitor.warn(
            fmt::format("{}: width {:g}, length {:g} and height {:g} m are no luminous opening of "
                        "LM-63; the luminaire has none, and no luminance",
                        to_string(numbers.place()), size[0], size[1], size[2]));
    }
    info.opening = opening.value_or(LuminousOpening());
    return luminaire;
}

std::vector<double> read_angles(Numbers& numbers, int count, std::string_view what) {
    std::vector<double> angles;
    for (int i = 0; i < count; ++i) {
        const double angle = numbers.next_within(what, -360, 360);
        if (!angles.empty() && !(angle > angles.back())) {
            input_error(numbers.place(), "{} {:g} follows {:g}; expected ascending angles", what, angle,
                        angles.back());
        }
        angles.push_back(angle);
    }
    return angles;
}

// Reads [horizontal][vertical], the order of every type in the file.
std::vector<float> read_candela(Numbers& numbers, const Luminaire& luminaire, double factor) {
    std::vector<float> candela;
    for (int h = 0; h < luminaire.horizontal; ++h) {
        for (int v = 0; v < luminaire.vertical; ++v) {
            const double value = numbers.next("a candela value");
            const double scaled = value * factor;
            if (!(scaled >= 0 && scaled <= 1e30)) {
                input_error(numbers.place(), "a candela value is {:g}; expected 0 to 1e30 after all factors",
                            value);
            }
            candela.push_back(static_cast<float>(scaled));
        }
    }
    return candela;
}

// Planes of type B turn by the vertical angle, planes of type A by the horizontal one. A file that begins at
// H = 0 omits the mirrored side.
PhotometricGrid grid_of_a_or_b(PhotometricPlanes planes, std::vector<double> h, const std::vector<double>& v,
                               std::vector<float> candela) {
    if (h.front() == 0 && h.size() > 1) {
        std::vector<double> all;
        std::vector<float> values;
        const auto row = [&](std::size_t i) {
            const auto begin = candela.begin() + static_cast<std::ptrdiff_t>(i * v.size());
            values.insert(values.end(), begin, begin + static_cast<std::ptrdiff_t>(v.size()));
        };
        for (std::size_t i = h.size(); i-- > 1;) all.push_back(-h[i]), row(i);
        for (std::size_t i = 0; i < h.size(); ++i) all.push_back(h[i]), row(i);
        h = std::move(all);
        candela = std::move(values);
    }
    PhotometricGrid grid{planes, {}, {}, {}};
    if (planes == PhotometricPlanes::a) {
        for (const double angle : v) grid.polar.push_back(90 + angle);
        grid.azimuth = h;
        grid.candela = std::move(candela);
        return grid;
    }
    for (const double angle : h) grid.polar.push_back(90 + angle);
    grid.azimuth = v;
    for (std::size_t j = 0; j < v.size(); ++j) {
        for (std::size_t i = 0; i < h.size(); ++i) grid.candela.push_back(candela[i * v.size() + j]);
    }
    return grid;
}

PhotometricGrid read_grid(Numbers& numbers, const Luminaire& luminaire, double factor) {
    std::vector<double> v = read_angles(numbers, luminaire.vertical, "vertical angle");
    const Location vertical = numbers.place();
    std::vector<double> h = read_angles(numbers, luminaire.horizontal, "horizontal angle");
    const Location horizontal = numbers.place();
    const bool c = luminaire.planes == PhotometricPlanes::c;
    const double least = c ? 0 : -180, most = 180;
    if (!(v.front() >= least && v.back() <= most)) {
        input_error(vertical, "vertical angles go from {:g} to {:g}; expected {:g} to {:g}", v.front(),
                    v.back(), least, most);
    }
    std::vector<float> candela = read_candela(numbers, luminaire, factor);
    PhotometricGrid grid;
    if (c) {
        grid = {luminaire.planes, std::move(v), std::move(h), std::move(candela)};
        complete_ies_planes(grid, horizontal);
    } else {
        grid = grid_of_a_or_b(luminaire.planes, std::move(h), v, std::move(candela));
    }
    if (const std::string why = grid.fault(); !why.empty()) throw InputError(horizontal, why);
    return grid;
}

std::string provenance_of(const PhotometricInfo& info, std::string_view edition) {
    std::string text(edition);
    for (const char* key : {"MANUFAC", "LUMCAT", "LUMINAIRE", "TEST"}) {
        const auto found = std::find_if(info.keywords.begin(), info.keywords.end(),
                                        [key](const auto& pair) { return pair.first == key; });
        if (found != info.keywords.end() && !found->second.empty()) text += ", " + found->second;
    }
    return one_line(text);
}

}  // namespace

PhotometricWeb parse_ies(std::string_view text, const std::string& file, Monitor& monitor) {
    text = without_byte_order_mark(text);
    const std::vector<TextLine> lines = lines_of(text);
    const std::string_view first = lines.empty() ? std::string_view() : trimmed(lines.front().text);
    const Edition edition = edition_of(first);

    PhotometricInfo info;
    std::size_t at = edition == Edition::e1986 ? 0 : 1;
    while (at < lines.size() && !is_tilt(lines[at].text)) read_keyword(lines[at++].text, info);
    if (at == lines.size()) {
        throw InputError({file}, "no line begins with TILT=, as required in an IES LM-63 photometric file");
    }
    const std::string_view tilt = trimmed(trimmed(lines[at].text).substr(5));
    const bool tilt_included = tilt == "INCLUDE";
    Numbers numbers(ies_words(lines, at + 1, tilt_included, file, monitor), file);
    if (tilt_included) read_included_tilt(numbers);

    const Luminaire luminaire = read_luminaire(numbers, edition, info, monitor);
    const double ballast = numbers.next_within("the ballast factor", 0, 1e3);
    const double third = numbers.next("the ballast-lamp factor");
    const bool early = edition < Edition::e1995;
    if (early && !(third >= 0 && third <= 1e3)) {
        input_error(numbers.place(), "the ballast-lamp photometric factor is {:g}; expected 0 to 1000",
                    third);
    }
    info.watts = std::max(0.0, numbers.next("input watts"));
    const double factor = luminaire.multiplier * ballast * (early ? third : 1);
    PhotometricGrid grid = read_grid(numbers, luminaire, factor);
    if (const auto rest = numbers.rest())
        monitor.warn(fmt::format("{}: the text after the candela values is ignored", to_string(*rest)));
    info.provenance = provenance_of(info, edition == Edition::e1986 ? "LM-63-1986" : first);
    return PhotometricWeb(std::move(grid), std::move(info));
}

PhotometricWeb read_ies(const std::filesystem::path& file, Monitor& monitor) {
    return parse_ies(read_text(file), file.string(), monitor);
}

}  // namespace lucerna
