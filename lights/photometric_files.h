// Photometric files: IES and EULUMDAT are read into a web, IES is written from one.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "lights/photometric.h"

namespace lucerna {

// IES LM-63 photometric files (.ies), all editions: 1986, 1991, 1995, 2002, 2019.
//
// Every edition has keywords, a line TILT=, and numbers that wrap anywhere: ten for the luminaire, three for
// its ballast, the angles, and the candela values. Intensities are value × multiplier × ballast factor (and ×
// the ballast-lamp factor in the editions of 1986 and 1991) [cd] and absolute. TILT says how the lamp's flux
// falls when the luminaire is tilted out of its measured position; it is read and checked but not applied,
// because a scene's lamp hangs as it was measured.
//
// The meaning of commas is described in ies_words.h.
//
// Source: IESNA LM-63-1995, ANSI/IESNA LM-63-2002.

// Throws InputError naming file, line and column.
PhotometricWeb read_ies(const std::filesystem::path& file, Monitor& monitor);
// As above, from memory; `file` only names the file in messages.
PhotometricWeb parse_ies(std::string_view text, const std::string& file, Monitor& monitor);

// Returns LM-63-2002, type C, absolute photometry; `title` becomes [TEST] and [LUMINAIRE]. A web of type A or
// B is resampled on a grid of 2.5 by 5 degrees; a web of type C is written as it is.
std::string ies_text(const PhotometricWeb& web, std::string_view title);
void write_ies(const std::filesystem::path& file, const PhotometricWeb& web, std::string_view title);

// EULUMDAT photometric files (.ldt) have one value per line and intensities in candela per 1000 lm of the
// lamps.
//
// Intensities are value × conversion factor × the lamps' lumens / 1000 [cd]; the values already include the
// luminaire's light output ratio. If several sets of lamps are listed, the first one counts. The file lists
// all C planes but C360 and stores the planes that do not follow from the symmetry.
//
// Source: the EULUMDAT file format [Stockmar 1990], as light planning programs describe it.

// Throws InputError naming file and line.
PhotometricWeb read_ldt(const std::filesystem::path& file, Monitor& monitor);
// As above, from memory; `file` only names the file in messages.
PhotometricWeb parse_ldt(std::string_view text, const std::string& file, Monitor& monitor);

// Chooses the format by the suffix, .ies or .ldt in any case.
bool is_photometric(const std::filesystem::path& file);
PhotometricWeb read_photometric(const std::filesystem::path& file, Monitor& monitor);

// Shared by the photometric formats: numbers in text, and planes that symmetry leaves out.

// A line of a file, without its end (any of \n, \r, \r\n).
struct TextLine {
    std::string_view text;
    int number = 0;  // from 1
};
std::vector<TextLine> lines_of(std::string_view text);
// Returns the text without white space at both ends.
std::string_view trimmed(std::string_view text);
// Returns a file's value as an error message shows it: at most 60 characters, no control characters.
std::string shown_value(std::string_view text);

// Parses the whole word as a finite number; none if it is not one.
std::optional<double> number_of(std::string_view word);
// Returns the word with commas replaced by decimal points.
std::string with_decimal_point(std::string_view word);
// Returns true for one comma between digits, with one to three digits before it (not starting with 0) and
// three behind: 33,200.
bool may_separate_thousands(std::string_view word);

// Completes ascending planes of type C, with intensities [plane][angle], to planes all around. Each plane is
// mirrored about the angles `mirrors`, in their order, where the grid has no plane yet, and the first plane
// is repeated after 360 degrees. A single plane holds for all azimuths.
void complete_c_planes(PhotometricGrid& grid, std::span<const double> mirrors);
// As above for an IES file, whose planes imply its symmetry: 0 to 90 and 0 to 180 are mirrored about C0-C180
// (and C90-C270), 90 to 270 about C90-C270. Planes all around may omit the last one, which repeats the first,
// if the gap is no wider than the others. Throws InputError at `place` for other planes.
void complete_ies_planes(PhotometricGrid& grid, const Location& place);

}  // namespace lucerna
