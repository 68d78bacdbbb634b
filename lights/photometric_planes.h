// What the files of photometry share: numbers in text, and planes that symmetry leaves out.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "lights/photometric.h"

namespace lucerna {

// A line of a file, without its end (any of \n, \r, \r\n).
struct TextLine {
    std::string_view text;
    int number = 0;  // from 1
};
std::vector<TextLine> lines_of(std::string_view text);
// Without white space at both ends.
std::string_view trimmed(std::string_view text);
// At most 60 characters, without control characters: a value of a file, as an error shows it.
std::string shown_value(std::string_view text);

// The whole word as a finite number; none if it is not one.
std::optional<double> number_of(std::string_view word);

// Planes of type C as a file lists them, to all of them, from 0 to 360 or from -90 to 270: the planes that
// the file leaves out because they are mirrored. `planes` ascend; the intensities are [plane][angle]. One
// plane holds for all; 0 to 90 and 0 to 180 are mirrored, 90 to 270 is mirrored about the plane through them,
// and planes all around are closed if the last step is missing. Throws InputError at `place` for other
// planes.
void complete_c_planes(PhotometricGrid& grid, const Location& place);

}  // namespace lucerna
