// A study: its description, the measurement of errors, and its results.
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/evaluation/seeds.h"
#include "engine/pbrt/read_scene.h"

namespace lucerna {

// The description of a study is a file that names scenes, a reference and methods, with lists of settings to
// try.
//
//   title = "Direct light, four ways"
//   seeds = 2
//
//   [[scene]]
//   file = "../../scenes/cloister/cloister.pbrt"     # from the folder of this file
//   resolution = "120x80"
//   mask_lamps = true                                     # leave out pixels that see a lamp or the sky
//
//   [reference]
//   integrator = "path"
//   spp = [1024]
//
//   [[method]]
//   name = "guided"
//   integrator = "photonmap"
//   set = "indirect=none direct=guided candidates=4|16"   # every one of the alternatives
//   spp = [4, 16, 64]                                     # or: time = ["5s", "1min"]

struct StudyScene {
    std::string name;
    std::filesystem::path file;
    V2i resolution{0, 0};                                         // (0,0): the scene's own
    double mask_above = std::numeric_limits<double>::infinity();  // compare.h
    // Excludes pixels that see a lamp or the sky, directly or over mirrors and clear glass.
    bool mask_lamps = false;
    Location place = {};  // of `file` in the description
};
// Channels with the light of visible lamps in the reference of a scene with mask_lamps
// (docs/reference/layers.md).
inline constexpr std::string_view kLampChannels[] = {"emission.R", "emission.G", "emission.B"};

// One method with all its settings chosen.
struct StudyPoint {
    std::string method;
    std::string settings;  // those in the description, as "k=50 spp=16"
    SceneOverrides overrides;
    double seconds = 0;    // limit of the render including reading; 0: limited by samples
    std::string end_name;  // what ends the render, "spp" or "time", and its value
    std::string end_value;
};

struct StudyDescription {
    std::string title;
    int seeds = 1;
    std::vector<StudyScene> scenes;
    StudyPoint reference;
    std::vector<StudyPoint> points;
};

// Throws InputError naming file, line and column.
StudyDescription read_study(const std::filesystem::path& file);

// The results of a study: error against time of every point, the best points, and advice in sentences.

// The result of one point of the description on one scene. Errors are squared and relative, of one image.
struct StudyResult {
    std::string scene, method, settings;
    std::vector<std::pair<std::string, std::string>> set;  // each setting, with spp or time last
    std::filesystem::path image;                           // of the first seed
    double seconds = 0;           // reading, preparation and one image; mean over seeds
    std::set<std::string> hosts;  // of a parallel job
    double error2 = 0;
    std::optional<double> error2_error;     // standard error, for two seeds or more
    std::optional<Estimate> bias2, noise2;  // for two seeds or more
    double reference_noise2 = 0;  // is in error2 but not in bias2; 0 if the reference does not state it
    double mean_ratio = 1;        // mean luminance over the reference's
    std::optional<double> flip;   // mean FLIP of the first seed's image, 0 to 1
    bool best = false;            // no other point is both faster and better

    double error() const;  // root of error2, a fraction
};

// Machines and dates that the renders state. Times of several machines, or of different numbers of threads,
// cannot be compared.
struct StudyOrigin {
    std::set<std::string> machines;
    std::set<int> threads;
    std::set<std::string> dates;       // in UTC, ascending
    std::set<std::string> hosts = {};  // of the ranks of a parallel job
};

// Marks the points of the Pareto front of each scene.
void mark_best(std::vector<StudyResult>& results);

// Returns sentences like "for 5 % error on cornell the fastest is guided, spp=16 (1.2 s)" for each scene and
// each error of 1, 2, 5, 10 … % that some point reached.
std::vector<std::string> advice(const std::vector<StudyResult>& results);

// Returns one line for each scene whose reference is too noisy, with noise above half of the smallest
// measured error.
std::vector<std::string> doubts(const std::vector<StudyResult>& results);

std::string study_csv(const std::vector<StudyResult>& results);
std::string study_json(const StudyDescription& description, const std::vector<StudyResult>& results,
                       const StudyOrigin& origin);

// The functions below measure errors by the one measure of the program: the root mean square difference of
// luminance relative to the reference's luminance plus a tenth of its mean (both squared). `render --error`
// estimates this error, so "2 %" has the same meaning everywhere and does not depend on the unit of radiance.

// Reads the reference's image, with NaN in the pixels that the scene's mask_lamps excludes.
NamedImage read_reference(const std::filesystem::path& file, const StudyScene& scene);

class StudyMeasure {
  public:
    // Excludes pixels that are not finite or of which a channel of the reference is above `mask_above`.
    // Throws InputError if the reference is black in all others, where no relative error is defined.
    StudyMeasure(const NamedImage& reference, double mask_above);

    // Sets errors and mean ratio from one image per seed. Warns of pixels that are not finite. Throws
    // InputError, naming the image, if it cannot be compared.
    void measure(const std::vector<NamedImage>& images, StudyResult& result, Monitor& monitor) const;

  private:
    NamedImage scaled(const NamedImage& image) const;

    NamedImage reference_;  // scaled luminance and its variance; NaN where excluded
    double scale_ = 1;
    double noise2_ = 0;  // of the reference, on the scale of the errors
};

}  // namespace lucerna
