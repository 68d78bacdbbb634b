// Figures of measured values: a plan with axes in metres, an image in false colour, each with a legend, and
// the caption of a picture, as self-contained SVG or as pixels.
//
// An SVG is one element for a separate file or an HTML page, possibly several on one page: it has no ids, its
// own background and no script. Text is in DejaVu Sans, or in the viewer's replacement. The image
// contains a PNG, for which the library of picture formats is loaded (pictures.h).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/figures/false_colour.h"
#include "engine/figures/isolines.h"
#include "engine/image/image.h"

namespace lucerna {

struct IsolineSettings {
    bool shown = true;
    std::vector<double> levels;  // empty: isoline_levels()
};

// Properties of all figures.
struct FigureValues {
    std::string title;  // empty: none
    ValueGrid values;   // at least one point
    std::string unit;   // "lx", "cd/m^2", "%"; empty: none
    ScaleSettings scale;
    IsolineSettings isolines;
};

// Positions in metres: x to the right, y upwards.
struct PlanOutline {
    std::vector<Imath::V2d> points;
    bool closed = true;
};
// Lines of the model, such as a section through its walls.
struct PlanDrawing {
    std::vector<std::array<Imath::V2d, 2>> lines;
    double width = 1;  // pixels
};
struct PlanLamp {
    Imath::V2d place;       // of its middle
    std::string name;       // empty: the mark alone
    Imath::V2d size{0, 0};  // m, of its outline; 0: the mark alone
};

struct PlanLabel {
    Imath::V2d place;
    std::string text;
};

struct PlanFigure : FigureValues {
    Imath::V2d first{0, 0};    // m, position of the first value, at the top left
    Imath::V2d spacing{1, 1};  // m, > 0: between columns to the right, between rows downwards
    bool numbers = true;       // writes values at their points if all of them fit into their cells
    std::vector<PlanOutline> outlines;
    std::vector<PlanDrawing> drawings;
    // Those outside the values, outlines and drawings are left out.
    std::vector<PlanLamp> lamps;
    std::vector<PlanLabel> labels;
    // Names of the axes, and the coordinates of the origin in their numbers [m].
    std::array<std::string, 2> axes{"x", "y"};
    Imath::V2d origin{0, 0};
    double width = 900;  // of the whole figure, >= 300 pixels; the height follows
};

std::string plan_svg(const PlanFigure& figure);

struct PictureFigure : FigureValues {
    double smoothing =
        0;  // for the isolines: smoothed_for(); closed lines smaller than four times this are omitted
    double width = 0;  // pixels of the image in the figure; 0: as many as it has
};

std::string picture_svg(const PictureFigure& figure);

// The caption of a picture: lines of text, and below them a bar for a length in the picture.
struct Caption {
    std::vector<std::string> lines;
    double bar = 0;        // pixels
    std::string bar_text;  // the length that the bar has in the picture
};

// Returns the pixels across that all of the caption fits into.
int caption_width(const Caption& caption);
// Draws the caption on a white ground, `width` >= caption_width() pixels wide; the height follows from the
// number of lines.
std::string caption_svg(const Caption& caption, int width);

// Renders a figure to display-referred pixels. Throws InputError, naming `file`, the intended output, if
// there is no picture library, no font, or not enough memory.
Image drawn(const std::string& svg, const std::filesystem::path& file);

// Formats a value with three digits, or as a whole number from 100 on.
std::string value_text(double value);
// Converts "cd/m^2" to "cd/m²", and so does it with "W/m2".
std::string unit_as_written(std::string unit);

}  // namespace lucerna
