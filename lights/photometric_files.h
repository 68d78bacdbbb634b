// Photometric files, IES and EULUMDAT: read into a web, written from one.
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
// Every edition is keywords, a line TILT=, and numbers that wrap wherever they like: ten of the luminaire,
// three of its ballast, the angles, the candela values. Candela are value × multiplier × ballast factor (and
// × the ballast-lamp factor in the editions of 1986 and 1991), in the file's own scale: absolute. TILT tells
// how the lamp's flux falls when the luminaire is tilted out of the position it was measured in; it is read,
// checked and not applied, as a scene's lamp is measured in the position it has.
//
// What commas mean is in ies_words.h.
//
// Source: IESNA LM-63-1995, ANSI/IESNA LM-63-2002.

// Throws InputError naming file, line and column.
PhotometricWeb read_ies(const std::filesystem::path& file, Monitor& monitor);
// The same from memory; `file` only names it in messages.
PhotometricWeb parse_ies(std::string_view text, const std::string& file, Monitor& monitor);

// LM-63-2002, type C, absolute photometry; `title` becomes [TEST] and [LUMINAIRE]. A web of type A or B is
// resampled on a grid of 2.5 by 5 degrees; of type C, the file holds the very web.
std::string ies_text(const PhotometricWeb& web, std::string_view title);
void write_ies(const std::filesystem::path& file, const PhotometricWeb& web, std::string_view title);

// EULUMDAT photometric files (.ldt): one value per line, intensities in candela per 1000 lm of the lamps.
//
// Candela are value × conversion factor × the lamps' lumens / 1000; the luminaire's light output ratio is
// already in the values. Of several sets of lamps that a luminaire may be fitted with, the first counts. All
// C planes but C360 are listed, and those are stored that the symmetry does not give.
//
// Source: the EULUMDAT file format [Stockmar 1990], as light planning programs describe it.

// Throws InputError naming file and line.
PhotometricWeb read_ldt(const std::filesystem::path& file, Monitor& monitor);
// The same from memory; `file` only names it in messages.
PhotometricWeb parse_ldt(std::string_view text, const std::string& file, Monitor& monitor);

// By the file's ending, .ies or .ldt in any case.
bool is_photometric(const std::filesystem::path& file);
PhotometricWeb read_photometric(const std::filesystem::path& file, Monitor& monitor);

// What the files of photometry share: numbers in text, and planes that symmetry leaves out.

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
// The word with its commas as decimal points.
std::string with_decimal_point(std::string_view word);
// One comma between digits, one to three before it, of which the first is not 0, and three behind: 33,200.
bool may_separate_thousands(std::string_view word);

// Completes planes of type C that ascend, with intensities [plane][angle], to planes all around: each plane
// is mirrored about the planes of the angles `mirrors`, in their order, where the grid has none there yet,
// and the first plane is repeated after 360 degrees. One plane holds for all.
void complete_c_planes(PhotometricGrid& grid, std::span<const double> mirrors);
// The same for an IES file, whose planes tell its symmetry: 0 to 90 and 0 to 180 are mirrored about C0-C180
// (and C90-C270), 90 to 270 about C90-C270; planes all around may lack the last one, which is the first, if
// the gap is no wider than the others. Throws InputError at `place` for other planes.
void complete_ies_planes(PhotometricGrid& grid, const Location& place);

}  // namespace lucerna
