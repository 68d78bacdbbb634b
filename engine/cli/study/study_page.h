// A study as one self-contained HTML file: error against time with the Pareto front, bias and noise
// separately, the images of every point beside the reference, and a table of all results.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/evaluation/study.h"

namespace lucerna {

// The pictures of a study's page: the image of each point, its error and its FLIP.
//
// A page must stay small enough to open and send, so pictures are shrunk by integer factors until all fit;
// those of Pareto-optimal points keep their pixels longest.

// Limit of all pictures of a page as data URLs, bytes.
inline constexpr double kPicturesBudget = 19e6;

// The maximum numbers of pixels of one picture; 0 leaves it out.
struct PictureCaps {
    double best = 0;  // of the references and of Pareto-optimal points
    double maps = 0;  // of the errors of these points
    double rest = 0;  // of other points and of their errors
};

// The pictures of one scene.
struct PictureLoad {
    int width = 0, height = 0;
    std::size_t best = 0, rest = 0;  // numbers of points; the reference is one more picture
};

// Returns the largest caps with which at most `budget` bytes are needed, whatever the pictures show.
PictureCaps picture_caps(const std::vector<PictureLoad>& scenes, double budget);
// Returns the maximum size of pictures under the caps.
double most_bytes(const std::vector<PictureLoad>& scenes, const PictureCaps& caps);
// Returns the smallest integer factor that shrinks width and height to at most `cap` > 0 pixels.
int shrink_factor(int width, int height, double cap);

// An 8-bit code of relative errors for one channel of a picture: 128 is zero, and 127 steps to either side
// grow as log(1 + |e| / least), up to `most`.
struct ErrorCode {
    double least = 0.002, most = 20;

    int of(double error) const;  // 1 to 255; NaN is 128
};

struct StudyPicture {
    std::string url;  // empty: left out
    int factor = 1;   // each pixel is the mean of factor x factor pixels
};

// A picture's radiance (error_pictures.h) and its maps: red is the signed error in ErrorCode, green is FLIP.
struct PointPictures {
    StudyPicture radiance, maps;
};

struct ScenePictures {
    int width = 0, height = 0;
    double stops = 0;  // initial exposure, and that of FLIP
    StudyPicture reference;
    std::vector<PointPictures> points;  // of the scene's results, in their order
};

// Reads the first seed's image of every result and sets its `flip`. `references` has one file per scene with
// results, in the order of the scenes. Throws InputError.
std::vector<ScenePictures> study_pictures(const StudyDescription& description,
                                          const std::vector<std::filesystem::path>& references,
                                          std::vector<StudyResult>& results, const Workers& workers,
                                          Monitor& monitor);

struct StudyReport {
    const StudyDescription& description;
    const std::vector<StudyResult>& results;
    const std::vector<ScenePictures>& pictures;  // of the description's first scenes, which have results
    const StudyOrigin& origin;
    std::string command;           // command that repeats the study
    std::string description_text;  // text of the description's file
};

std::string study_page(const StudyReport& report);

}  // namespace lucerna
