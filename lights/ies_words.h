// The words of an IES file's numbers, and what its commas mean.
//
// By the standard, numbers are separated by spaces, line ends and commas; some writers use decimal commas all
// the same: 996,19. The file's own counts of angles tell how many numbers it has, and so which of the two its
// commas are.
#pragma once

#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "lights/photometric_files.h"

namespace lucerna {

struct IesWord {
    std::string text;  // a decimal comma is written as a point
    int line = 0, column = 0;
    bool either = false;  // its comma may be a decimal comma, or separate two numbers
};

// The words from lines[first] on, which follow the line TILT=; `tilt`: numbers of the tilt come first. Warns
// of decimal commas. Throws InputError where the counts do not tell what the commas mean, and where they
// may separate thousands. `file` only names it in messages.
std::vector<IesWord> ies_words(const std::vector<TextLine>& lines, std::size_t first, bool tilt,
                               const std::string& file, Monitor& monitor);

}  // namespace lucerna
