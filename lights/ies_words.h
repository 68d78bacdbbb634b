// The numbers of an IES file as words, and the meaning of their commas.
//
// The standard separates numbers by spaces, line ends and commas, but some writers use decimal commas:
// 996,19. The file's own counts of angles give the number of its values, which decides what the commas mean.
#pragma once

#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "lights/photometric_files.h"

namespace lucerna {

struct IesWord {
    std::string text;  // a decimal comma is written as a point
    int line = 0, column = 0;
    bool either = false;  // its comma may be decimal or may separate two numbers
};

// Returns the words from lines[first] on, which follow the line TILT=. If `tilt`, the numbers of the tilt
// come first. Warns of decimal commas. Throws InputError where the counts do not decide what the commas mean,
// and where commas may separate thousands. `file` only names the file in messages.
std::vector<IesWord> ies_words(const std::vector<TextLine>& lines, std::size_t first, bool tilt,
                               const std::string& file, Monitor& monitor);

}  // namespace lucerna
