// A study as one HTML file that carries all it needs: error against time with the Pareto front, bias and
// noise apart, the images of every point beside the reference's, and a table of everything.
#pragma once

#include <string>
#include <vector>

#include "engine/cli/study_pictures.h"
#include "engine/evaluation/study_description.h"
#include "engine/evaluation/study_trade.h"

namespace lucerna {

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
