// The templates of pages from engine/cli/pages, and their substitution.
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

// Returns the page with every {{name}} replaced by blanks.at(name), without substituting in the inserted
// text. The map must contain every blank of the page.
std::string filled(std::string_view page, const std::map<std::string, std::string, std::less<>>& blanks);

// Returns a string literal for a script in HTML, which no quote, line end or tag in the text can end.
std::string script_text(std::string_view text);

// Returns a comparison as one self-contained HTML file: images with a slider, a flip, zoom and exposure,
// error maps, and the numbers.

// `error_range` is the relative error shown in full colour. Images of more than 2048 pixels on a side are
// shrunk by an integer factor, and the page says so.
std::string comparison_page(const ComparisonReport& report, const std::vector<NamedImage>& images,
                            const NamedImage& reference, double error_range);

}  // namespace lucerna
