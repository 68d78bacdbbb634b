// The parts that pages are made of, as they stand in engine/cli/pages, and the filling in of their blanks.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "engine/evaluation/comparison.h"
#include "engine/figures/markup.h"
#include "engine/image/image.h"

namespace lucerna {

extern const std::string_view kComparePage;  // compare.html
extern const std::string_view kPageStyle;    // page.css
extern const std::string_view kImageStrip;   // image_strip.js: imageStrip(element, images, options)
extern const std::string_view kStudyPage;    // study.html
extern const std::string_view kStudyStyle;   // study.css, after page.css
extern const std::string_view kStudyScript;  // study_*.js: studyPage(study)
extern const std::string_view kLuxPage;      // lux.html
extern const std::string_view kD3;           // the package's own file, d3.min.js

// The page with every {{name}} replaced by blanks.at(name); what is filled in is not looked at again. A blank
// that the map lacks is a fault of ours.
std::string filled(std::string_view page, const std::map<std::string, std::string, std::less<>>& blanks);

// A string literal for a script inside HTML: no quote, line end or tag ends it.
std::string script_text(std::string_view text);

// A comparison as one HTML file that carries all it needs: images with a slider, a flip, zoom and exposure,
// maps of the errors, and the numbers.

// `error_range`: the relative error that is shown in full colour. Images of more than 2048 pixels on a side
// are shrunk by a whole factor, and the page says so.
std::string comparison_page(const ComparisonReport& report, const std::vector<NamedImage>& images,
                            const NamedImage& reference, double error_range);

}  // namespace lucerna
