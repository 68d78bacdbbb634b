// A study as one HTML file that carries all it needs: error against time with the Pareto front, bias and
// noise apart, the images of every point beside the reference's, and a table of everything.
#pragma once

#include <string>
#include <vector>

#include "engine/app/study_pictures.h"
#include "engine/app/study_plan.h"
#include "engine/app/study_trade.h"

namespace lucerna {

struct StudyReport {
    const StudyPlan& plan;
    const std::vector<StudyResult>& results;
    const std::vector<ScenePictures>& pictures;  // of the plan's first scenes, those that have results
    const StudyOrigin& origin;
    std::string command;    // that repeats the study
    std::string plan_text;  // of the plan's file
};

std::string study_page(const StudyReport& report);

}  // namespace lucerna
