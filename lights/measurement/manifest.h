// The manifest of a measurement: the photographs that were taken of a lamp, with the rig and the camera.
//
// For every filter position (m, n) and each film there are one or more photographs with different exposure
// times. The manifest is written by hand as TOML; docs/reference/photographs.md is its reference. Only the
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

// A file name with fields for numbers: "view_{m:03}_{n:03}_{sign}_{exposure}.png". {m}, {n} and {exposure}
// count from `count_from`; a number after the colon is the minimum width, with a leading 0 for zero padding.
class ShotName {
  public:
    ShotName() = default;
    // Throws InputError at `place` if the name has an unknown field.
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

// The calibration of a camera. Absent values follow from the photographs' format.
struct CameraCalibration {
    double scale = 1;                 // irradiance [flux unit / m²] per count and second
    V2d transmission{1, 1};           // largest of the positive and of the negative film, in (0, 1]
    double pedestal = 0;              // counts without light at exposure time 0
    double gain = 1;                  // counts per electron
    double read_noise = 0;            // counts, standard deviation
    bool noise_known = false;         // gain or read_noise were given
    std::optional<double> saturated;  // counts; absent: the largest of an integer format, none for floats
    std::optional<double> black;      // counts; absent: 0 for integers, none for floats
    // For photographs in colour, the matrix [row][column] that maps the column vector (R, G, B) to (X, Y, Z)
    // on the scale of Y. Absent: linear sRGB.
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
    std::vector<Shot> darks;  // those of equal time are averaged; empty: only the pedestal

    // Returns the exposures of a view behind a film, ascending in time and not empty.
    std::vector<Shot> shots(int m, int n, FilterSign sign) const;
    std::size_t shot_count() const;  // of all views

    // Either the photographs follow a pattern …
    ShotName name;
    std::filesystem::path folder;
    std::array<std::string, 2> sign_words{"positive", "negative"};
    std::array<std::vector<double>, 2> exposures;  // seconds, of each film
    int count_from = 0;
    // … or they are listed by view (m, n) and film.
    std::map<std::pair<std::pair<int, int>, FilterSign>, std::vector<Shot>> listed;
};

std::string_view sign_name(FilterSign sign);

// Returns all photographs and dark frames that the manifest names.
std::vector<std::filesystem::path> files_of(const Manifest& manifest);

// Throw InputError naming file, line and column.
Manifest read_manifest(const std::filesystem::path& file);
Manifest read_manifest(const TomlTable& table);

// Write what read_manifest() reads. Files beside the manifest, at manifest.place, have only their names.
std::string manifest_text(const Manifest& manifest);
void write_manifest(const std::filesystem::path& file, const Manifest& manifest);

}  // namespace lucerna
