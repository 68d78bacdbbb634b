// Photometric files: IES LM-63, EULUMDAT, IES TM-33 and GLDF are read into webs, IES is written from one.
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

class ZipArchive;

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
// Files depart from the format. Those whose numbers fit in one way alone are read with a warning: fewer than
// ten direct ratios, planes of another symmetry than the stated one, a list of the stored planes alone, empty
// lines, several numbers in a line, lines before the first one, a missing first line.
//
// Source: the EULUMDAT file format [Stockmar 1990], as light planning programs describe it.

// Throws InputError naming file and line.
PhotometricWeb read_ldt(const std::filesystem::path& file, Monitor& monitor);
// As above, from memory; `file` only names the file in messages.
PhotometricWeb parse_ldt(std::string_view text, const std::string& file, Monitor& monitor);

// Tells whether lines 2 to 7 of the text, or of its beginning, are those of an EULUMDAT file.
bool looks_like_ldt(std::string_view text);

// IES TM-33 files (XML) have emitters with luminous intensities that name their angles.
//
// The root is IESTM33-18, IESTM33-22 (TM-33-23) or IESTM33, or LuminaireOpticalData (ATLA S001, UNI 11733).
// Intensities are IntData × Multiplier [cd]; the planes are completed by the stated symmetry. An emitter's
// EmissionAreas are its luminous opening; without them it is the luminaire's rectangle, Length × Width.
// Radiant and photon intensities, spectra and angular colours are not read.
//
// Source: TM-33-18 and TM-33-23, as their public schemas describe them.

bool is_tm33_root(std::string_view name);
// `file` only names the file in messages. Throws InputError naming file and line.
std::vector<LuminaireEmitter> parse_tm33(std::string_view text, const std::string& file, Monitor& monitor);

// GLDF files are zip archives of a product's description (product.xml), photometries (EULUMDAT, IES, TM-33)
// and geometries (L3D).
//
// A variant names emitters and, in an L3D model, the light-emitting objects that are their places. The flux
// that the product states replaces that of the photometry's lamps. An emitter's modes exclude each other; the
// first that is not for emergencies alone is used.
//
// Source: [GLDF 1.0].

// Reads the variant of that id, or the first one if `variant` is empty; `file` is the archive's name.
std::vector<LuminaireEmitter> read_gldf(const ZipArchive& archive, const std::string& file,
                                        const std::string& variant, Monitor& monitor);

// All of these formats, told by their content; the suffixes .ies, .ldt and .gldf only tell what a file should
// be whose content does not. A GLDF file's name may be followed by '#' and a variant.

// XML with another root is claimed, too, so that the error names the root; no other lamp's file is XML.
bool is_photometric(const std::filesystem::path& path);
// Returns the path without a variant.
std::filesystem::path photometric_file(const std::filesystem::path& path);
// Returns the emitters of the luminaire, at least one. Throws InputError.
std::vector<LuminaireEmitter> read_luminaire(const std::filesystem::path& path, Monitor& monitor);
// Does the same for a file in memory that is no archive; `file` names it.
std::vector<LuminaireEmitter> parse_luminaire(std::string_view text, const std::string& file,
                                              Monitor& monitor);
// Returns the far field of the whole luminaire.
PhotometricWeb read_photometric(const std::filesystem::path& path, Monitor& monitor);

// Shared by the photometric formats: numbers in text, and planes that symmetry leaves out.

// A line of a file, without its end (any of \n, \r, \r\n).
struct TextLine {
    std::string_view text;
    int number = 0;  // from 1
};
std::vector<TextLine> lines_of(std::string_view text);
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
