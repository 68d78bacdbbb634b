// A study as one HTML file that carries all it needs: error against time with the Pareto front, bias and
// noise apart, the images of every point beside the reference's, and a table of everything.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/evaluation/study.h"

namespace lucerna {

// The pictures of a study's page: what each point looks like, where it errs, and how much of that is seen.
//
// A page must stay small enough to be opened and sent, so pictures are shrunk by whole factors until all of
// them fit: those of points that nothing beats keep their pixels longest.

// What all pictures of a page may take as data URLs, bytes.
inline constexpr double kPicturesBudget = 19e6;

// The most pixels that one picture may have. 0: it is left out.
struct PictureCaps {
    double best = 0;  // of the references and of points that nothing beats
    double maps = 0;  // of the errors of those points
    double rest = 0;  // of other points, and of their errors
};

// The pictures of one scene.
struct PictureLoad {
    int width = 0, height = 0;
    std::size_t best = 0, rest = 0;  // points; the reference is one picture more
};

// The largest caps with which no more than `budget` bytes are needed, whatever the pictures show.
PictureCaps picture_caps(const std::vector<PictureLoad>& scenes, double budget);
// The most that pictures under the caps can need.
double most_bytes(const std::vector<PictureLoad>& scenes, const PictureCaps& caps);
// The least whole factor by which width and height are shrunk to no more pixels than the cap, > 0.
int shrink_factor(int width, int height, double cap);

// An 8-bit code of relative errors for one channel of a picture: 128 is none, 127 steps to either side grow
// as log(1 + |e| / least), to `most`.
struct ErrorCode {
    double least = 0.002, most = 20;

    int of(double error) const;  // 1 to 255; NaN is 128
};

struct StudyPicture {
    std::string url;  // empty: left out
    int factor = 1;   // each pixel is the mean of factor x factor
};

// One picture's radiance (error_pictures.h), and its maps: red is the signed error in ErrorCode, green is
// FLIP.
struct PointPictures {
    StudyPicture radiance, maps;
};

struct ScenePictures {
    int width = 0, height = 0;
    double stops = 0;  // the exposure at first, and that of FLIP
    StudyPicture reference;
    std::vector<PointPictures> points;  // of the scene's results, in their order
};

// Looks at the first seed's image of every result and sets its `flip`. `references`: one file per scene of
// which there are results, in the order of the scenes. Throws InputError.
std::vector<ScenePictures> study_pictures(const StudyDescription& description,
                                          const std::vector<std::filesystem::path>& references,
                                          std::vector<StudyResult>& results, const Workers& workers,
                                          Monitor& monitor);

struct StudyReport {
    const StudyDescription& description;
    const std::vector<StudyResult>& results;
    const std::vector<ScenePictures>& pictures;  // of the description's first scenes, those that have results
    const StudyOrigin& origin;
    std::string command;           // that repeats the study
    std::string description_text;  // of the description's file
};

std::string study_page(const StudyReport& report);

}  // namespace lucerna
