// A study: what is asked, how errors are measured, what was found.
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

// What `lucerna study` is asked to measure: a file that names scenes, a reference and methods, with lists of
// the settings that are to be tried.
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
    // Whether pixels that see a lamp or the sky, straight or by way of mirrors and clear glass, are left out.
    bool mask_lamps = false;
    Location place = {};  // of `file` in the description
};
// In a reference of a scene with mask_lamps: the light of lamps that are seen (docs/reference/layers.md).
inline constexpr std::string_view kLampChannels[] = {"emission.R", "emission.G", "emission.B"};

// One method with all its settings chosen.
struct StudyPoint {
    std::string method;
    std::string settings;  // those that were written down, as "k=50 spp=16"
    SceneOverrides overrides;
    double seconds = 0;    // the render ends by then, with reading; 0: by its samples
    std::string end_name;  // "spp" or "time": what ends the render, and its value
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

// What a study found: error against time of every point, the best of them, and a sentence for people.

// One point of the description on one scene. Errors are squared and relative, of one image.
struct StudyResult {
    std::string scene, method, settings;
    std::vector<std::pair<std::string, std::string>> set;  // the settings one by one, spp or time the last
    std::filesystem::path image;                           // of the first seed
    double seconds = 0;           // reading, preparation and one image; the mean over seeds
    std::set<std::string> hosts;  // that measured them, of a parallel job
    double error2 = 0;
    std::optional<double> error2_error;     // standard error; of two seeds or more
    std::optional<Estimate> bias2, noise2;  // of two seeds or more
    double reference_noise2 = 0;            // is in error2, not in bias2; 0: the reference does not say
    double mean_ratio = 1;                  // mean luminance over the reference's
    std::optional<double> flip;             // mean FLIP of the first seed's image, 0 to 1
    bool best = false;                      // nothing measured was both faster and better

    double error() const;  // the root of error2, a share of 1
};

// Where and when the renders were made, as they say themselves. Times of several machines, or of different
// numbers of threads, do not compare.
struct StudyOrigin {
    std::set<std::string> machines;
    std::set<int> threads;
    std::set<std::string> dates;       // of UTC; in order
    std::set<std::string> hosts = {};  // of the ranks of a parallel job
};

// Marks, scene by scene, the points of the Pareto front.
void mark_best(std::vector<StudyResult>& results);

// "for 5 % error on cornell the fastest is guided, spp=16 (1.2 s)", for errors of 1, 2, 5, 10 … % that some
// point reached; scene by scene.
std::vector<std::string> advice(const std::vector<StudyResult>& results);

// One line for each scene whose reference is too noisy for what was measured against it: its own noise is
// more than half of the least error.
std::vector<std::string> doubts(const std::vector<StudyResult>& results);

std::string study_csv(const std::vector<StudyResult>& results);
std::string study_json(const StudyDescription& description, const std::vector<StudyResult>& results,
                       const StudyOrigin& origin);

// How far a point's images are from the reference, by one measure throughout the program: the root mean
// square over the pixels of the difference of luminance over the reference's luminance, plus a tenth of its
// mean (both squared). What `render --error` estimates of its noise is this, so "2 %" means the same wherever
// it is said, and whatever the scene's unit of radiance.

// The reference's image from its file, with NaN where pixels are left out as the scene's mask_lamps asks.
NamedImage read_reference(const std::filesystem::path& file, const StudyScene& scene);

class StudyMeasure {
  public:
    // Pixels of which a channel of the reference is above `mask_above` are left out, and so are those that
    // are not finite. Throws InputError if the reference is black in all others: nothing is relative to that.
    StudyMeasure(const NamedImage& reference, double mask_above);

    // Fills in errors and mean ratio, from one image per seed. Warns of pixels that are not finite. Throws
    // InputError, naming the image, if it does not compare.
    void measure(const std::vector<NamedImage>& images, StudyResult& result, Monitor& monitor) const;

  private:
    NamedImage scaled(const NamedImage& image) const;

    NamedImage reference_;  // luminance, scaled, and its variance; NaN where nothing is compared
    double scale_ = 1;
    double noise2_ = 0;  // of the reference, as errors are
};

}  // namespace lucerna
