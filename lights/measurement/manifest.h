// The manifest of a measurement: which photographs were taken of a lamp, with what rig and what camera.
//
// For every filter position (m, n) and both films there are one or more photographs of different exposure
// times. People write the manifest as TOML; docs/reference/photographs.md is its reference. Nothing but the
// manifest itself is read here.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/system/toml.h"
#include "lights/light_field.h"
#include "lights/measurement/opacity.h"
#include "lights/measurement/rectification.h"

namespace lucerna {

struct Shot {
    double seconds = 1;
    std::filesystem::path file;
};

// A name with places for numbers: "view_{m:03}_{n:03}_{sign}_{exposure}.png". {m}, {n} and {exposure} count
// from `count_from`; a number after the colon is the least width, with a leading 0 if zeros fill it.
class ShotName {
  public:
    ShotName() = default;
    // Throws InputError at `place` if the name holds an unknown place.
    ShotName(const Location& place, std::string name);
    bool has(std::string_view field) const;
    struct Numbers {
        int m, n, exposure;
        std::string_view sign;
    };
    std::string of(const Numbers& numbers) const;
    const std::string& text() const { return text_; }

  private:
    struct Piece {
        std::string text;   // before the field
        std::string field;  // empty: none
        int width = 0;
        bool zeros = false;
    };
    std::vector<Piece> pieces_;
    std::string text_;
};

// How a camera counts. Numbers that are absent follow from the photographs' format.
struct CameraCalibration {
    double scale = 1;          // irradiance [flux unit / m²] per count and second
    V2d transmission{1, 1};    // of the clearest place of the positive and the negative film, in (0, 1]
    double pedestal = 0;       // counts of no light in no time
    double gain = 1;           // counts per electron
    double read_noise = 0;     // counts, standard deviation
    bool noise_known = false;  // whether gain or read_noise were given
    std::optional<double>
        saturated;                // counts; absent: the most of a format of whole numbers, none for floats
    std::optional<double> black;  // counts; absent: 0 for whole numbers, none for floats
    // Of photographs in colour: column vector (X, Y, Z) on the scale of Y over that of (R, G, B),
    // [row][column] of the matrix that is multiplied from the left. Absent: linear sRGB.
    std::optional<Imath::M33d> to_xyz;
};

struct Manifest {
    Location place;
    Rig rig;
    LightFieldInfo info;
    double flux = 0;  // of the whole lamp, flux unit; 0: unknown
    std::string channel;
    std::optional<Corners> corners;  // absent: M fills the photographs
    Location corners_place;
    CameraCalibration camera;
    std::vector<Shot> darks;  // several of the same time are averaged; none: the pedestal is all there is

    // Exposures of a view behind a film, rising in time. Not empty.
    std::vector<Shot> shots(int m, int n, FilterSign sign) const;
    std::size_t shot_count() const;  // of all views

    // Photographs by a pattern …
    ShotName name;
    std::filesystem::path folder;
    std::array<std::string, 2> sign_words{"positive", "negative"};
    std::array<std::vector<double>, 2> exposures;  // seconds, of each film
    int count_from = 0;
    // … or one by one, by view (m, n) and film.
    std::map<std::pair<std::pair<int, int>, FilterSign>, std::vector<Shot>> listed;
};

std::string_view sign_name(FilterSign sign);

// All photographs and dark frames that it names.
std::vector<std::filesystem::path> files_of(const Manifest& manifest);

// Throw InputError naming file, line and column.
Manifest read_manifest(const std::filesystem::path& file);
Manifest read_manifest(const TomlTable& table);

// What read_manifest reads; files that lie beside the manifest, at manifest.place, by their names alone.
std::string manifest_text(const Manifest& manifest);
void write_manifest(const std::filesystem::path& file, const Manifest& manifest);

}  // namespace lucerna
