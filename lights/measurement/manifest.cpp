#include "lights/measurement/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/image/photograph.h"
#include "engine/text/plain_text.h"
#include "engine/text/spelling.h"
#include "engine/text/units.h"
#include "lights/measurement/rig_file.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 4> kFields{"m", "n", "sign", "exposure"};
constexpr int kMostFilterExposures = 32;
constexpr double kLeastTime = 1e-9, kMostTime = 1e6;  // seconds
constexpr double kMostCount = 1e12;
constexpr double kMostCoordinate = 1e6;  // pixels

std::size_t slot(FilterSign sign) {
    return sign == FilterSign::positive ? 0 : 1;
}

std::vector<double> read_times(const TomlTable& table, std::string_view key) {
    std::vector<double> times = table.numbers(key, kLeastTime, kMostTime);
    if (times.empty() || times.size() > kMostFilterExposures) {
        input_error(table.place_of(key), "\"{}\" has {} values; expected 1 to {}", key, times.size(),
                    kMostFilterExposures);
    }
    for (std::size_t i = 1; i < times.size(); ++i) {
        if (times[i] > times[i - 1]) continue;
        input_error(table.place_of(key), "\"{}\" has {:g} s after {:g} s; expected ascending times", key,
                    times[i], times[i - 1]);
    }
    return times;
}

// Checks that the pattern has the fields that keep photographs' names distinct.
void require_field(const Manifest& manifest, const Location& place, std::string_view field, std::size_t count,
                   std::string_view what) {
    if (count < 2 || manifest.name.has(field)) return;
    input_error(place, "\"name\" lacks {{{}}}, which distinguishes {} {}", field, count, what);
}

void read_pattern(const TomlTable& table, Manifest& manifest) {
    const Location place = table.place_of("name");
    manifest.folder = std::filesystem::path(place.file).parent_path();
    manifest.name = ShotName(place, table.text("name"));
    manifest.exposures[0] = read_times(table, "exposures");
    manifest.exposures[1] =
        table.has("negative_exposures") ? read_times(table, "negative_exposures") : manifest.exposures[0];
    for (const FilterSign sign : kFilterSigns) {
        std::string& word = manifest.sign_words[slot(sign)];
        word = table.text(sign_name(sign), word);
    }
    if (manifest.sign_words[0] == manifest.sign_words[1]) {
        input_error(table.place_of("negative"), "both films are called \"{}\"; expected different names",
                    one_line(manifest.sign_words[0]));
    }
    manifest.count_from = table.whole("count_from", 0, 1'000'000, 0);
    require_field(manifest, place, "m", static_cast<std::size_t>(manifest.rig.views.x), "columns of views");
    require_field(manifest, place, "n", static_cast<std::size_t>(manifest.rig.views.y), "rows of views");
    require_field(manifest, place, "sign", 2, "films");
    require_field(manifest, place, "exposure",
                  std::max(manifest.exposures[0].size(), manifest.exposures[1].size()), "exposures");
}

V2d read_point(const TomlTable& table, std::string_view key) {
    const std::vector<double> xy = table.numbers(key, -kMostCoordinate, kMostCoordinate);
    if (xy.size() != 2)
        input_error(table.place_of(key), "\"{}\" has {} values; expected x and y in pixels", key, xy.size());
    return {xy[0], xy[1]};
}

void read_place_of_m(const TomlTable& table, Manifest& manifest) {
    if (table.has("crop") && table.has("corners")) {
        throw InputError(table.place_of("corners"),
                         "\"corners\" and \"crop\" exclude each other; use one of them");
    }
    manifest.corners_place = table.place_of(table.has("crop") ? "crop" : "corners");
    if (table.has("crop")) {
        const std::vector<double> box = table.numbers("crop", 0, kMostCoordinate);
        if (box.size() != 4 || !(box[2] > 0 && box[3] > 0)) {
            input_error(
                manifest.corners_place,
                "\"crop\" has {} values; expected left, top, width and height in pixels, the last two > 0",
                box.size());
        }
        manifest.corners = corners_of_crop({box[0], box[1]}, {box[2], box[3]});
    } else if (table.has("corners")) {
        const TomlTable corners = table.table("corners");
        manifest.corners = Corners{read_point(corners, "lower_left"), read_point(corners, "lower_right"),
                                   read_point(corners, "upper_right"), read_point(corners, "upper_left")};
        corners.done();
        try {
            Homography::of_rectangle({1, 1}, *manifest.corners);
        } catch (const InputError& error) {
            throw InputError(manifest.corners_place, error.what());
        }
    }
}

CameraCalibration read_calibration(const TomlTable& table) {
    CameraCalibration camera;
    camera.scale = table.number("scale", 1e-30, 1e30);
    if (table.has("transmission")) {
        const std::vector<double> films = table.numbers("transmission", 1e-6, 1);
        if (films.size() != 2) {
            input_error(
                table.place_of("transmission"),
                "\"transmission\" has {} values; expected those of the positive and of the negative film",
                films.size());
        }
        camera.transmission = {films[0], films[1]};
    }
    camera.pedestal = table.number("pedestal", -kMostCount, kMostCount, 0);
    camera.noise_known = table.has("gain") || table.has("read_noise");
    camera.gain = table.number("gain", 0, kMostCount, 1);
    camera.read_noise = table.number("read_noise", 0, kMostCount, 0);
    if (table.has("saturated")) camera.saturated = table.number("saturated", 1e-12, kMostCount);
    if (table.has("black")) camera.black = table.number("black", -kMostCount, kMostCount);
    if (table.has("to_xyz")) {
        const std::vector<double> rows = table.numbers("to_xyz", -1e6, 1e6);
        if (rows.size() != 9) {
            input_error(table.place_of("to_xyz"),
                        "\"to_xyz\" has {} values; expected a matrix of 9, the rows X, Y and Z, the columns "
                        "R, G and B",
                        rows.size());
        }
        Imath::M33d m;
        for (std::size_t i = 0; i < 9; ++i) m[static_cast<int>(i / 3)][static_cast<int>(i % 3)] = rows[i];
        if (!(std::fabs(m.determinant()) > 1e-12))
            throw InputError(table.place_of("to_xyz"),
                             "\"to_xyz\" is singular; expected an invertible matrix");
        camera.to_xyz = m;
    }
    if (camera.saturated && camera.black && !(*camera.saturated > *camera.black)) {
        input_error(table.place_of("saturated"), "\"saturated\" at {:g} is not above \"black\" at {:g}",
                    *camera.saturated, *camera.black);
    }
    table.done();
    return camera;
}

void add_listed(const TomlTable& table, Manifest& manifest) {
    const V2i view = table.wholes("view", 0, 65535);
    const V2i& views = manifest.rig.views;
    if (view.x >= views.x || view.y >= views.y) {
        input_error(table.place_of("view"),
                    "view [{}, {}] is outside the {} x {} views; expected [0, 0] to [{}, {}]", view.x, view.y,
                    views.x, views.y, views.x - 1, views.y - 1);
    }
    const FilterSign sign = table.choice("sign", {"positive", "negative"}) == "positive"
                                ? FilterSign::positive
                                : FilterSign::negative;
    const Shot shot{table.number("seconds", kLeastTime, kMostTime), table.path("file")};
    auto& shots = manifest.listed[{{view.x, view.y}, sign}];
    for (const Shot& other : shots) {
        if (other.file == shot.file)
            input_error(table.place_of("file"), "{} is listed twice for this view",
                        one_line(shot.file.string()));
    }
    if (shots.size() >= kMostFilterExposures)
        input_error(table.place(), "more than {} photographs of one view and film", kMostFilterExposures);
    const auto after = std::find_if(shots.begin(), shots.end(),
                                    [&](const Shot& other) { return other.seconds > shot.seconds; });
    shots.insert(after, shot);
    table.done();
}

// Throws InputError with the number of views without a listed photograph and the first of them by name.
void require_all_listed(const Manifest& manifest) {
    constexpr std::size_t kNamed = 3;
    const V2i& views = manifest.rig.views;
    const std::size_t all = 2 * static_cast<std::size_t>(views.x) * static_cast<std::size_t>(views.y);
    const std::size_t missing = all - manifest.listed.size();
    if (missing == 0) return;
    std::vector<std::string> named;
    for (int m = 0; m < views.x && named.size() < kNamed; ++m) {
        for (int n = 0; n < views.y && named.size() < kNamed; ++n) {
            for (const FilterSign sign : kFilterSigns) {
                if (named.size() < kNamed && !manifest.listed.contains({{m, n}, sign}))
                    named.push_back(fmt::format("view [{}, {}] {}", m, n, sign_name(sign)));
            }
        }
    }
    input_error(manifest.place, "{} of {} views and films have no [[photograph]]: {}{}", missing, all,
                fmt::join(named, ", "), missing > named.size() ? ", ..." : "");
}

}  // namespace

std::string_view sign_name(FilterSign sign) {
    return sign == FilterSign::positive ? "positive" : "negative";
}

ShotName::ShotName(const Location& place, std::string name) : text_(std::move(name)) {
    std::string_view rest = text_;
    if (rest.empty())
        throw InputError(place, "\"name\" is empty; expected a file name with {m}, {n}, {sign}");
    while (true) {
        Piece piece;
        const std::size_t open = rest.find('{');
        piece.text = rest.substr(0, open);
        if (open == rest.npos) {
            pieces_.push_back(piece);
            return;
        }
        rest.remove_prefix(open + 1);
        const std::size_t close = rest.find('}');
        if (close == rest.npos) throw InputError(place, "\"name\" has a { without its }");
        const std::string_view field = rest.substr(0, close), word = field.substr(0, field.find(':'));
        if (std::find(kFields.begin(), kFields.end(), word) == kFields.end()) {
            input_error(
                place,
                "\"name\" has {{{}}}, which is unknown; {}expected {{m}}, {{n}}, {{sign}} or {{exposure}}",
                one_line(field), did_you_mean(word, kFields));
        }
        piece.field = word;
        if (word.size() < field.size()) {
            const std::string_view width = field.substr(word.size() + 1);
            piece.zeros = width.starts_with('0');
            piece.width = static_cast<int>(parse_whole(place, width, 0, 20));
        }
        pieces_.push_back(piece);
        rest.remove_prefix(close + 1);
    }
}

bool ShotName::has(std::string_view field) const {
    return std::any_of(pieces_.begin(), pieces_.end(),
                       [&](const Piece& piece) { return piece.field == field; });
}

std::string ShotName::of(const Numbers& numbers) const {
    std::string name;
    for (const Piece& piece : pieces_) {
        name += piece.text;
        if (piece.field.empty()) continue;
        if (piece.field == "sign") {
            name += numbers.sign;
            continue;
        }
        const int number = piece.field == "m" ? numbers.m : piece.field == "n" ? numbers.n : numbers.exposure;
        const std::string digits = std::to_string(number);
        const auto width = static_cast<std::size_t>(piece.width);
        if (digits.size() < width) name.append(width - digits.size(), piece.zeros ? '0' : ' ');
        name += digits;
    }
    return name;
}

std::vector<Shot> Manifest::shots(int m, int n, FilterSign sign) const {
    if (!listed.empty()) return listed.at({{m, n}, sign});
    std::vector<Shot> all;
    int number = count_from;
    for (const double seconds : exposures[slot(sign)]) {
        all.push_back(
            {seconds, folder / name.of({m + count_from, n + count_from, number++, sign_words[slot(sign)]})});
    }
    return all;
}

std::size_t Manifest::shot_count() const {
    std::size_t count = 0;
    for (const auto& [view, shots_of_view] : listed) count += shots_of_view.size();
    const std::size_t views = static_cast<std::size_t>(rig.views.x) * static_cast<std::size_t>(rig.views.y);
    return listed.empty() ? views * (exposures[0].size() + exposures[1].size()) : count;
}

Manifest read_manifest(const TomlTable& table) {
    Manifest manifest;
    manifest.place = table.place();
    manifest.rig = read_planes(table.table("rig"));
    manifest.rig.centre.z = table.position("setback", 0.0);
    manifest.info.unit = table.choice("unit", {"W", "lm"}) == "W" ? FluxUnit::watt : FluxUnit::lumen;
    manifest.info.colour = read_colour(table);
    manifest.info.provenance = one_line(table.text("provenance", ""));
    manifest.flux = table.number("flux", 1e-12, 1e12, 0);
    const TomlTable photographs = table.table("photographs");
    const std::vector<TomlTable> listed = table.tables("photograph");
    if (listed.empty()) {
        read_pattern(photographs, manifest);
    } else if (photographs.has("name")) {
        throw InputError(
            listed.front().place(),
            "[[photograph]] and a \"name\" in [photographs] exclude each other; use one of them");
    }
    for (const TomlTable& one : listed) add_listed(one, manifest);
    if (!listed.empty()) require_all_listed(manifest);
    manifest.channel = photographs.text("channel", "luminance");
    read_place_of_m(photographs, manifest);
    photographs.done();
    const TomlTable camera = table.table("camera");
    manifest.camera = read_calibration(camera);
    if (manifest.camera.to_xyz && manifest.channel != kColourChannels) {
        input_error(camera.place_of("to_xyz"),
                    "\"to_xyz\" is for photographs in colour; channel = \"{}\" is not",
                    one_line(manifest.channel));
    }
    for (const TomlTable& dark : table.tables("dark")) {
        manifest.darks.push_back({dark.number("seconds", kLeastTime, kMostTime), dark.path("file")});
        dark.done();
    }
    table.done();
    return manifest;
}

std::vector<std::filesystem::path> files_of(const Manifest& manifest) {
    std::vector<std::filesystem::path> files;
    const V2i views = manifest.rig.views;
    for (int view = 0; view < views.x * views.y; ++view) {
        for (const FilterSign sign : kFilterSigns) {
            for (const Shot& shot : manifest.shots(view / views.y, view % views.y, sign))
                files.push_back(shot.file);
        }
    }
    for (const Shot& dark : manifest.darks) files.push_back(dark.file);
    return files;
}

Manifest read_manifest(const std::filesystem::path& file) {
    return read_manifest(TomlTable::read(file));
}

}  // namespace lucerna
