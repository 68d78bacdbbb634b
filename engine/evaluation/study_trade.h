// What a study found: error against time of every point, the best of them, and a sentence for people.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/evaluation/seeds.h"
#include "engine/evaluation/study_description.h"

namespace lucerna {

// One point of the description on one scene. Errors are squared and relative (study_measure.h), of one image.
struct StudyResult {
    std::string scene, method, settings;
    std::vector<std::pair<std::string, std::string>> set;  // the settings one by one, spp the last
    std::filesystem::path image;                           // of the first seed
    double seconds = 0;  // reading, preparation and one image; the mean over seeds
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
    std::set<std::string> dates;  // of UTC; in order
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

}  // namespace lucerna
