// Figures of measured values: a plan with axes in metres, and an image in false colour, each with a legend,
// as SVG that needs nothing beside it; and as pixels.
//
// An SVG here is one element that may stand in a file of its own or in an HTML page, several on one page: it
// has no ids, its own background and no script. Text is in DejaVu Sans, or what the viewer has instead. The
// smooth plan and the image carry a PNG inside, for which the library of picture formats is loaded
// (pictures.h).
#pragma once

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

// What all figures have.
struct FigureValues {
    std::string title;  // empty: none
    ValueGrid values;   // at least one point
    std::string unit;   // "lx", "cd/m^2", "%"; empty: none
    ScaleSettings scale;
    IsolineSettings isolines;
};

// Each point as a cell around it, or bilinear between points, without what lies beyond the outermost.
enum class PlanFill : std::uint8_t { cells, smooth };

// Places in metres: x to the right, y upwards.
struct PlanOutline {
    std::vector<Imath::V2d> points;
    bool closed = true;
};
struct PlanLamp {
    Imath::V2d place;
    std::string name;  // empty: the mark alone
};

struct PlanFigure : FigureValues {
    Imath::V2d first{0, 0};    // m: of the first value, which is at the top left
    Imath::V2d spacing{1, 1};  // m, > 0: from column to column to the right, from row to row downwards
    PlanFill fill = PlanFill::cells;
    bool numbers = true;  // each value at its point, where all of them fit into their cells
    std::vector<PlanOutline> outlines;
    std::vector<PlanLamp> lamps;
    double width = 900;  // pixels of the whole figure, >= 300; its height follows
};

std::string plan_svg(const PlanFigure& figure);

struct PictureFigure : FigureValues {
    double smoothing =
        0;             // of the isolines: smoothed_for(); closed lines within four times that are left out
    double width = 0;  // pixels of the image in the figure; 0: as many as it has
};

std::string picture_svg(const PictureFigure& figure);

// A figure as pixels, display-referred. Throws InputError, which names `file`, on whose behalf it is wanted:
// no library of pictures, no font, or not enough memory for so many pixels.
Image drawn(const std::string& svg, const std::filesystem::path& file);

// A value as people write it: three digits, whole from 100 on.
std::string value_text(double value);
// "cd/m²" of "cd/m^2".
std::string unit_as_written(std::string unit);

}  // namespace lucerna
