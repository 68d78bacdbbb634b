#include "lights/photometric_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/base/error.h"
#include "engine/base/files.h"

namespace lucerna {
namespace {

constexpr int kMostAngles = 100'000;
constexpr double kFoot = 0.3048;  // metres

enum class Edition { e1986, e1991, e1995_on };

Edition edition_of(std::string_view line) {
    if (line == "IESNA91" || line == "IESNA:LM-63-1991") return Edition::e1991;
    return line.starts_with("IESNA") || line.starts_with("IES:") ? Edition::e1995_on : Edition::e1986;
}

bool is_tilt(std::string_view line) {
    return trimmed(line).starts_with("TILT=");
}

// The numbers after the TILT line: separated by spaces, commas or line ends.
class Numbers {
  public:
    Numbers(std::vector<TextLine> lines, std::size_t first, std::string file)
        : lines_(std::move(lines)), line_(first), file_(std::move(file)) {}

    double next(std::string_view what) {
        const std::string_view word = next_word();
        if (word.empty()) {
            throw InputError({file_},
                             fmt::format("the file ends after {} numbers; expected {}", count_, what));
        }
        const auto value = number_of(word);
        if (!value) input_error(place_, "{} is \"{}\"; expected a number", what, shown_value(word));
        ++count_;
        return *value;
    }
    double next_within(std::string_view what, double least, double most) {
        const double value = next(what);
        if (!(value >= least && value <= most))
            input_error(place_, "{} is {:g}; expected {:g} to {:g}", what, value, least, most);
        return value;
    }
    int next_whole(std::string_view what, int least, int most) {
        const double value = next_within(what, least, most);
        if (value != std::floor(value))
            input_error(place_, "{} is {:g}; expected a whole number", what, value);
        return static_cast<int>(value);
    }
    // Of the number that came last.
    const Location& place() const { return place_; }
    // Of a word after the last number, if there is one.
    std::optional<Location> rest() {
        return next_word().empty() ? std::nullopt : std::optional<Location>(place_);
    }

  private:
    std::string_view next_word() {
        // Old files end in Ctrl-Z.
        constexpr std::string_view kBetween{" \t\v\f,\x1a\0", 7};
        for (; line_ < lines_.size(); ++line_, column_ = 0) {
            const std::string_view text = lines_[line_].text;
            const std::size_t begin = text.find_first_not_of(kBetween, column_);
            if (begin == std::string_view::npos) continue;
            const std::size_t end = std::min(text.find_first_of(kBetween, begin), text.size());
            place_ = {file_, lines_[line_].number, static_cast<int>(begin) + 1};
            column_ = end;
            return text.substr(begin, end - begin);
        }
        return {};
    }

    std::vector<TextLine> lines_;
    std::size_t line_, column_ = 0;
    std::string file_;
    Location place_{file_};
    std::size_t count_ = 0;
};

// "[KEY] value"; [MORE] goes on with the keyword before it. Lines without brackets are the labels of 1986.
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

// Factors by which the lamp's flux changes with tilt: read to come past them.
void read_included_tilt(Numbers& numbers) {
    numbers.next_within("TILT's lamp-to-luminaire geometry", 0, 3);
    const int pairs = numbers.next_whole("TILT's number of angles", 1, kMostAngles);
    for (int i = 0; i < pairs; ++i) numbers.next("a tilt angle");
    for (int i = 0; i < pairs; ++i) numbers.next("a tilt factor");
}

struct Luminaire {
    double multiplier;
    int vertical, horizontal;
    PhotometricPlanes planes;
};

// The ten numbers.
Luminaire read_luminaire(Numbers& numbers, PhotometricInfo& info) {
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
    // Negative sizes: round.
    double size[3];
    constexpr const char* kNames[] = {"the opening's width", "the opening's length", "the opening's height"};
    for (int i = 0; i < 3; ++i) {
        size[i] = numbers.next_within(kNames[i], -1e4, 1e4) * unit;
        info.round_opening = info.round_opening || size[i] < 0;
    }
    info.opening = V3d(std::fabs(size[1]), std::fabs(size[0]), std::fabs(size[2]));
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

// [horizontal][vertical], as every type has them in the file.
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
// H = 0 leaves out the mirrored side.
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
        complete_c_planes(grid, horizontal);
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
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // some editors' mark
    const std::vector<TextLine> lines = lines_of(text);
    const std::string_view first = lines.empty() ? std::string_view() : trimmed(lines.front().text);
    const Edition edition = edition_of(first);

    // Keywords, up to TILT.
    PhotometricInfo info;
    std::size_t at = edition == Edition::e1986 ? 0 : 1;
    while (at < lines.size() && !is_tilt(lines[at].text)) read_keyword(lines[at++].text, info);
    if (at == lines.size()) {
        throw InputError({file}, "no line begins with TILT=, as required in an IES LM-63 photometric file");
    }
    const std::string_view tilt = trimmed(trimmed(lines[at].text).substr(5));
    Numbers numbers(lines, at + 1, file);
    if (tilt == "INCLUDE") read_included_tilt(numbers);

    // Numbers.
    const Luminaire luminaire = read_luminaire(numbers, info);
    const double ballast = numbers.next_within("the ballast factor", 0, 1e3);
    const double third = numbers.next("the ballast-lamp factor");
    if (edition != Edition::e1995_on && !(third >= 0 && third <= 1e3)) {
        input_error(numbers.place(), "the ballast-lamp photometric factor is {:g}; expected 0 to 1000",
                    third);
    }
    info.watts = std::max(0.0, numbers.next("input watts"));
    const double factor = luminaire.multiplier * ballast * (edition == Edition::e1995_on ? 1 : third);
    PhotometricGrid grid = read_grid(numbers, luminaire, factor);
    if (const auto rest = numbers.rest())
        monitor.warn(fmt::format("{}: the text after the candela values is ignored", to_string(*rest)));
    info.provenance = provenance_of(info, edition == Edition::e1986 ? "LM-63-1986" : first);
    return PhotometricWeb(std::move(grid), std::move(info));
}

PhotometricWeb read_ies(const std::filesystem::path& file, Monitor& monitor) {
    return parse_ies(read_text(file), file.string(), monitor);
}

namespace {

// The file's lines are at most 132 characters long.
template <typename Values>
void append_numbers(std::string& text, const Values& values) {
    constexpr std::size_t kPerLine = 10;
    std::size_t i = 0;
    for (const auto value : values) {
        text += fmt::format("{:.7g}", static_cast<double>(value));
        text += ++i % kPerLine == 0 || i == values.size() ? "\n" : " ";
    }
}

// Every plane from 0 to 360 once; the planes at the ends are the same one.
std::vector<double> planes_from_zero(const PhotometricGrid& grid) {
    std::vector<double> planes{0, 360};
    for (const double azimuth : grid.azimuth) planes.push_back(azimuth - 360 * std::floor(azimuth / 360));
    std::sort(planes.begin(), planes.end());
    planes.erase(std::unique(planes.begin(), planes.end(), [](double a, double b) { return b - a < 1e-6; }),
                 planes.end());
    return planes;
}

}  // namespace

std::string ies_text(const PhotometricWeb& given, std::string_view title) {
    const bool is_c = given.grid().planes == PhotometricPlanes::c;
    const PhotometricWeb web = is_c ? given : resampled(given, 2.5, 5);
    const PhotometricGrid& grid = web.grid();
    const PhotometricInfo& info = web.info();
    // One plane is enough for a lamp that is alike all around.
    const bool round = std::equal(grid.candela.begin() + static_cast<std::ptrdiff_t>(grid.polar.size()),
                                  grid.candela.end(), grid.candela.begin());
    const std::vector<double> planes = round ? std::vector<double>{0} : planes_from_zero(grid);
    const std::string name = shown_value(one_line(title));
    const double sign = info.round_opening ? -1 : 1;

    std::string text = "IESNA:LM-63-2002\n";
    text += fmt::format(
        "[TEST] {0}\n[TESTLAB] not stated\n[ISSUEDATE] not stated\n[MANUFAC] not stated\n"
        "[LUMINAIRE] {0}\n[OTHER] absolute photometry, written by lucerna\nTILT=NONE\n",
        name);
    text += fmt::format("1 -1 1 {} {} 1 2 {:.6g} {:.6g} {:.6g}\n1 1 {:g}\n", grid.polar.size(), planes.size(),
                        sign * info.opening.y, sign * info.opening.x, info.opening.z, info.watts);
    append_numbers(text, grid.polar);
    append_numbers(text, planes);
    for (const double c : planes) {
        std::vector<double> row;
        for (const double gamma : grid.polar) row.push_back(web.intensity(web.direction(gamma, c)));
        append_numbers(text, row);
    }
    return text;
}

void write_ies(const std::filesystem::path& file, const PhotometricWeb& web, std::string_view title) {
    const std::string text = ies_text(web, title);
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    replace_file(file, std::span(&bytes, 1));
}

}  // namespace lucerna
