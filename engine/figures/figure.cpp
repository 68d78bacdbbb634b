#include "engine/figures/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <set>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/float_traps.h"
#include "engine/figures/markup.h"
#include "engine/image/pictures.h"

namespace lucerna {
namespace {

using Imath::V2d;

constexpr const char* kFont = "DejaVu Sans";
constexpr double kFontSize = 12, kSmallFont = 10, kLeastFont = 7;  // pixels
constexpr double kDigitWidth = 0.64;  // for DejaVu Sans, relative to the font size
constexpr double kMargin = 14, kTitleHeight = 26;
constexpr double kLegendWidth = 110, kLegendGap = 18, kBarWidth = 16, kLeastLegend = 150;
constexpr double kAxisLeft = 52, kAxisBelow = 42;
constexpr double kCaptionMargin = 6, kBarGap = 8;
constexpr double kWideLetters =
    1.1;  // how much wider than digits a caption's words are at most, with their m and W

double text_width(std::string_view text, double size) {
    const auto bytes = std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; });
    return kDigitWidth * size * static_cast<double>(bytes);
}

std::string hex(const Rgb& c) {
    const auto byte = [](float v) { return static_cast<int>(std::clamp(v, 0.0F, 1.0F) * 255 + 0.5F); };
    return fmt::format("#{:02x}{:02x}{:02x}", byte(c.x), byte(c.y), byte(c.z));
}

// Returns a clockwise rotation about a point.
std::string turned(const V2d& at, double degrees) {
    return fmt::format("transform=\"rotate({:.1f} {:.1f} {:.1f})\"", degrees, at.x, at.y);
}

// Returns black or white, whichever is more legible on a display-referred colour.
const char* ink_on(const Rgb& c) {
    return 0.299F * c.x + 0.587F * c.y + 0.114F * c.z > 0.5F ? "#000000" : "#ffffff";
}

// The elements of a drawing; later ones cover earlier ones.
class Drawing {
  public:
    template <typename... Args>
    void add(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(elements_), format, std::forward<Args>(args)...);
        elements_ += '\n';
    }
    void rect(const V2d& corner, const V2d& size, const Rgb& fill) {
        add(R"(<rect x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}" fill="{}" shape-rendering="crispEdges"/>)",
            corner.x, corner.y, size.x, size.y, hex(fill));
    }
    void line(const V2d& a, const V2d& b, const char* stroke, double width) {
        add(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="{:g}"/>)", a.x,
            a.y, b.x, b.y, stroke, width);
    }
    // `anchor` is start, middle or end; `more` contains further attributes.
    void text(const V2d& at, std::string_view text, const char* anchor, double size = kFontSize,
              std::string_view more = {}) {
        add(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" font-size="{:g}"{}{}>{}</text>)", at.x, at.y,
            anchor, size, more.empty() ? "" : " ", more, svg_text(text));
    }
    // Adds text with a light outline, legible on any background.
    void label(const V2d& at, std::string_view what, const char* anchor, double size, double degrees = 0) {
        const std::string turn = degrees == 0 ? "" : turned(at, degrees) + " ";
        text(
            at, what, anchor, size,
            turn +
                R"(fill="#ffffff" stroke="#ffffff" stroke-width="3" stroke-linejoin="round" aria-hidden="true")");
        text(at, what, anchor, size, turn + R"(class="label")");
    }
    void image(const V2d& corner, const V2d& size, const Image& picture) {
        add(R"(<image x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}" preserveAspectRatio="none" href="{}"/>)",
            corner.x, corner.y, size.x, size.y, data_url(picture));
    }

    std::string svg(double width, double height, const std::string& title) const {
        return fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 "
            "{0:.0f} "
            "{1:.0f}\" font-family=\"{2}, Verdana, sans-serif\" font-size=\"{3:g}\" fill=\"#000000\">\n"
            "{4}<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{5}</svg>\n",
            std::ceil(width), std::ceil(height), kFont, kFontSize,
            title.empty() ? std::string() : fmt::format("<title>{}</title>\n", svg_text(title)), elements_);
    }

  private:
    std::string elements_;
};

// Values, their colours and the levels of their isolines.
struct Shown {
    explicit Shown(const FigureValues& figure)
        : colour(figure.scale, figure.values.values),
          unit(unit_as_written(figure.unit)),
          levels(!figure.isolines.shown           ? std::vector<double>()
                 : figure.isolines.levels.empty() ? isoline_levels(colour.range(), colour.scaling())
                                                  : figure.isolines.levels) {
        for (const double v : figure.values.values) {
            below = below || v < colour.range().low;
            above = above || v > colour.range().high;
            missing = missing || std::isnan(v);
        }
    }

    FalseColour colour;
    std::string unit;
    std::vector<double> levels;
    bool below = false, above = false, missing = false;
};

// Draws the colour bar, numbers, unit and outside colours, `height` from the unit to the last mark.
void draw_legend(Drawing& drawing, const V2d& corner, double height, const Shown& shown) {
    constexpr double kRow = 18;
    const FalseColour& colour = shown.colour;
    const auto [low, high] = colour.range();
    drawing.text(corner + V2d(0, kFontSize), shown.unit, "start", kFontSize,
                 R"(font-weight="bold" class="unit")");
    double top = corner.y + 8 + kFontSize, bottom = corner.y + height;
    const auto swatch = [&](double y, const Rgb& fill, const std::string& what) {
        drawing.rect({corner.x, y}, {kBarWidth, 12}, fill);
        drawing.text({corner.x + kBarWidth + 8, y + 10}, what, "start", kSmallFont);
    };
    if (shown.missing) swatch(bottom -= kRow, colour.outside().missing, "no value");
    if (shown.below) swatch(bottom -= kRow, colour.outside().below, fmt::format("below {:g}", low));
    if (shown.above) {
        swatch(top, colour.outside().above, fmt::format("above {:g}", high));
        top += kRow;
    }
    top += 4, bottom -= 10;
    constexpr int kBands = 96;
    const double step = (bottom - top) / kBands;
    for (int i = 0; i < kBands; ++i) {
        const double y = bottom - (i + 1) * step;
        drawing.rect({corner.x, y}, {kBarWidth, step + 0.3}, colour_at(colour.map(), (i + 0.5) / kBands));
    }
    const auto height_of = [&](double value) { return bottom - colour.share(value) * (bottom - top); };
    for (const double level : shown.levels) {
        if (level < low || level > high) continue;
        drawing.line({corner.x, height_of(level)}, {corner.x + kBarWidth, height_of(level)}, "#000000", 1);
    }
    const int most = std::clamp(static_cast<int>((bottom - top) / 26), 2, 10);
    for (const double tick : round_numbers(colour.range(), colour.scaling(), most)) {
        const double y = height_of(tick);
        drawing.line({corner.x + kBarWidth, y}, {corner.x + kBarWidth + 4, y}, "#000000", 1);
        drawing.text({corner.x + kBarWidth + 8, y + 4}, fmt::format("{:g}", tick), "start", kSmallFont + 1,
                     R"(class="tick")");
    }
}

// The place and direction of a line's label.
struct LabelPlace {
    V2d at;
    double degrees;
};

// An axis-aligned box with half its side lengths.
struct LabelBox {
    V2d at, half;
    bool meets(const LabelBox& other) const {
        const V2d apart = at - other.at;
        return std::fabs(apart.x) < half.x + other.half.x && std::fabs(apart.y) < half.y + other.half.y;
    }
};

class LabelPlaces {
  public:
    // `numbers` are boxes of values that labels avoid.
    explicit LabelPlaces(const std::vector<LabelBox>& numbers) : numbers_(numbers) {}

    // Returns the first of a few places along the line where the label fits without another label nearby and,
    // unless `covered`, without covering a number.
    std::optional<LabelPlace> find(const std::vector<V2d>& line, double width, bool covered) {
        std::vector<double> along{0};
        for (std::size_t i = 1; i < line.size(); ++i)
            along.push_back(along.back() + (line[i] - line[i - 1]).length());
        const double length = along.back();
        if (length < 2.5 * width) return std::nullopt;
        const auto at = [&](double s) {
            const auto next = std::clamp<std::ptrdiff_t>(
                std::upper_bound(along.begin(), along.end(), s) - along.begin(), 1, std::ssize(line) - 1);
            const auto i = static_cast<std::size_t>(next);
            const double part = along[i] - along[i - 1];
            return line[i - 1] + (line[i] - line[i - 1]) * (part > 0 ? (s - along[i - 1]) / part : 0);
        };
        for (const double share : {0.5, 0.42, 0.58, 0.35, 0.65, 0.27, 0.73, 0.2, 0.8, 0.12, 0.88}) {
            const double s = share * length;
            if (s < width / 2 || s > length - width / 2) continue;
            const V2d from = at(s - width / 2), to = at(s + width / 2), middle = at(s);
            // Rejects places where the line curves away from the label.
            if ((to - from).length() < 0.85 * width) continue;
            const auto is_near = [&](const Taken& other) {
                return (other.at - middle).length() < (other.width + width) / 2 + 6;
            };
            if (std::any_of(taken_.begin(), taken_.end(), is_near)) continue;
            const V2d way = (to - from) / (to - from).length();
            constexpr double kHigh = 0.8 * kSmallFont;
            const LabelBox box{middle,
                               {(std::fabs(way.x) * width + std::fabs(way.y) * kHigh) / 2,
                                (std::fabs(way.y) * width + std::fabs(way.x) * kHigh) / 2}};
            const auto is_covered = [&box](const LabelBox& number) { return box.meets(number); };
            if (!covered && std::any_of(numbers_.begin(), numbers_.end(), is_covered)) continue;
            taken_.push_back({middle, width});
            double degrees = atan2(to.y - from.y, to.x - from.x) * 180 / kPiD;
            if (degrees > 90) degrees -= 180;
            if (degrees <= -90) degrees += 180;
            return LabelPlace{middle, degrees};
        }
        return std::nullopt;
    }

  private:
    struct Taken {
        V2d at;
        double width;
    };
    const std::vector<LabelBox>& numbers_;
    std::vector<Taken> taken_;
};

// `place` maps grid points (column, row) to the drawing; `numbers` are the boxes of written values.
template <typename Place>
void draw_isolines(Drawing& drawing, const std::vector<Isoline>& lines, Place&& place,
                   const std::vector<LabelBox>& numbers = {}) {
    std::vector<std::vector<V2d>> all;
    for (const Isoline& line : lines) {
        std::vector<V2d> points;
        for (const V2d& p : line.points) points.push_back(place(p));
        std::string path;
        for (std::size_t i = 0; i < points.size(); ++i)
            fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", i == 0 ? "M" : " ", points[i].x,
                           points[i].y);
        if (line.closed()) path += "Z";
        drawing.add(
            R"(<path d="{0}" fill="none" stroke="#ffffff" stroke-opacity="0.55" stroke-width="2.6" stroke-linejoin="round"/>)"
            "\n"
            R"(<path class="isoline" data-level="{1:g}" d="{0}" fill="none" stroke="#000000" stroke-width="1.1" stroke-linejoin="round"/>)",
            path, line.level);
        all.push_back(std::move(points));
    }
    LabelPlaces places(numbers);
    // Long lines choose their labels first.
    std::vector<std::size_t> order(all.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return all[a].size() > all[b].size(); });
    std::set<double> labelled;
    const auto label = [&](std::size_t i, bool covered) {
        const std::string text = fmt::format("{:g}", lines[i].level);
        const auto found = places.find(all[i], text_width(text, kSmallFont) + 4, covered);
        if (!found) return;
        labelled.insert(lines[i].level);
        const double turn = found->degrees * kPiD / 180;
        drawing.label(found->at + V2d(-sin(turn), cos(turn)) * 3.5, text, "middle", kSmallFont,
                      found->degrees);
    };
    for (const std::size_t i : order) label(i, false);
    // Covering a number is better than leaving a level without a label.
    for (const std::size_t i : order) {
        if (!labelled.contains(lines[i].level)) label(i, true);
    }
}

// --- plan ---

class Plan {
  public:
    explicit Plan(const PlanFigure& figure) : figure_(figure), shown_(figure) {
        assert(figure.values.columns > 0 && figure.values.rows > 0);
        assert(figure.spacing.x > 0 && figure.spacing.y > 0 && figure.width >= 300);
        const V2d half = figure.spacing / 2;
        low_ = place_of(0, figure.values.rows - 1) - half;
        high_ = place_of(figure.values.columns - 1, 0) + half;
        const auto include = [&](const V2d& p) {
            low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y)};
            high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y)};
        };
        for (const PlanOutline& outline : figure.outlines)
            std::for_each(outline.points.begin(), outline.points.end(), include);
        for (const PlanDrawing& drawing : figure.drawings) {
            for (const auto& line : drawing.lines) std::for_each(line.begin(), line.end(), include);
        }
        const V2d size = high_ - low_;
        const double margin = 0.02 * std::max(size.x, size.y);  // keeps walls off the frame
        if (!figure.outlines.empty() || !figure.lamps.empty()) low_ -= V2d(margin), high_ += V2d(margin);
        corner_ = {kMargin + kAxisLeft, kMargin + (figure.title.empty() ? 0 : kTitleHeight)};
        const double room = figure.width - corner_.x - kLegendGap - kLegendWidth;
        scale_ = std::min(room / (high_.x - low_.x), 1.3 * figure.width / (high_.y - low_.y));
        extent_ = (high_ - low_) * scale_;
    }

    std::string svg() {
        fill();
        for (const PlanDrawing& drawing : figure_.drawings) draw(drawing);
        for (const PlanOutline& outline : figure_.outlines) draw(outline);
        for (const PlanLamp& lamp : figure_.lamps) {
            if (is_inside(lamp.place)) draw(lamp);
        }
        draw_plan_isolines();
        if (figure_.numbers) write_numbers();
        for (const PlanLabel& label : figure_.labels) {
            if (!is_inside(label.place)) continue;
            drawing_.label(on_paper(label.place) + V2d(0, 0.36 * kSmallFont), label.text, "middle",
                           kSmallFont);
        }
        axes();
        const double legend = std::max(extent_.y, kLeastLegend);
        draw_legend(drawing_, {corner_.x + extent_.x + kLegendGap, corner_.y}, legend, shown_);
        if (!figure_.title.empty())
            drawing_.text({corner_.x, kMargin + 13}, figure_.title, "start", 15, R"(font-weight="bold")");
        return drawing_.svg(figure_.width, corner_.y + std::max(extent_.y + kAxisBelow, legend) + kMargin,
                            figure_.title);
    }

  private:
    // Convert columns and rows to metres, and metres to pixels.
    V2d place_of(double column, double row) const {
        return {figure_.first.x + column * figure_.spacing.x, figure_.first.y - row * figure_.spacing.y};
    }
    V2d on_paper(const V2d& metres) const {
        return corner_ + V2d(metres.x - low_.x, high_.y - metres.y) * scale_;
    }

    bool is_inside(const V2d& metres) const {
        return metres.x >= low_.x && metres.x <= high_.x && metres.y >= low_.y && metres.y <= high_.y;
    }

    void fill() {
        const ValueGrid& values = figure_.values;
        for (int row = 0; row < values.rows; ++row) {
            for (int column = 0; column < values.columns; ++column)
                drawing_.rect(on_paper(place_of(column - 0.5, row - 0.5)), figure_.spacing * scale_,
                              shown_.colour(values.at(column, row)));
        }
    }

    // Draws isolines on a grid refined to a few pixels, as bilinear isolines curve inside a cell.
    void draw_plan_isolines() {
        constexpr double kPiece = 6;  // pixels
        const double cell = std::max(figure_.spacing.x, figure_.spacing.y) * scale_;
        const int parts = 2 * std::max(1, static_cast<int>(std::ceil(cell / (2 * kPiece))));
        draw_isolines(
            drawing_, isolines(refined(figure_.values, parts), shown_.levels),
            [&](const V2d& p) { return on_paper(place_of(p.x / parts - 0.5, p.y / parts - 0.5)); },
            figure_.numbers ? number_boxes() : std::vector<LabelBox>());
    }

    // Returns the font size with which all values fit into their cells, or 0 if they do not.
    double number_size() const {
        const V2d cell = figure_.spacing * scale_;
        double widest = 1e-9;
        for (const double v : figure_.values.values) {
            if (!std::isnan(v)) widest = std::max(widest, text_width(value_text(v), 1));
        }
        const double size = std::min({kSmallFont, 0.9 * cell.x / widest, 0.8 * cell.y});
        return size < kLeastFont ? 0 : size;
    }

    std::vector<LabelBox> number_boxes() const {
        const double size = number_size();
        std::vector<LabelBox> boxes;
        for (int row = 0; size > 0 && row < figure_.values.rows; ++row) {
            for (int column = 0; column < figure_.values.columns; ++column) {
                const double v = figure_.values.at(column, row);
                if (std::isnan(v)) continue;
                boxes.push_back(
                    {on_paper(place_of(column, row)), {text_width(value_text(v), size) / 2, 0.4 * size}});
            }
        }
        return boxes;
    }

    void write_numbers() {
        const double size = number_size();
        if (size == 0) return;
        for (int row = 0; row < figure_.values.rows; ++row) {
            for (int column = 0; column < figure_.values.columns; ++column) {
                const double v = figure_.values.at(column, row);
                if (std::isnan(v)) continue;
                const Rgb cell = shown_.colour(v);
                const V2d at = on_paper(place_of(column, row)) + V2d(0, 0.36 * size);
                drawing_.text(
                    at, value_text(v), "middle", size,
                    fmt::format(
                        R"(fill="{0}" stroke="{0}" stroke-width="2.5" stroke-linejoin="round" aria-hidden="true")",
                        hex(cell)));
                drawing_.text(at, value_text(v), "middle", size,
                              fmt::format(R"(class="value" fill="{}")", ink_on(cell)));
            }
        }
    }

    void draw(const PlanDrawing& drawing) {
        std::string path;
        for (const auto& [from, to] : drawing.lines) {
            const V2d a = on_paper(from), b = on_paper(to);
            fmt::format_to(std::back_inserter(path), "M{:.1f} {:.1f}L{:.1f} {:.1f}", a.x, a.y, b.x, b.y);
        }
        drawing_.add(R"(<path class="section" d="{}" fill="none" stroke="#000000" stroke-width="{:g}"/>)",
                     path, drawing.width);
    }

    void draw(const PlanOutline& outline) {
        std::string points;
        for (const V2d& p : outline.points) {
            const V2d at = on_paper(p);
            fmt::format_to(std::back_inserter(points), "{}{:.1f},{:.1f}", points.empty() ? "" : " ", at.x,
                           at.y);
        }
        drawing_.add(R"(<{} class="outline" points="{}" fill="none" stroke="#000000" stroke-width="2"/>)",
                     outline.closed ? "polygon" : "polyline", points);
    }

    // Draws the outline of a luminaire and its usual symbol, a crossed circle, neither of them filled.
    void draw(const PlanLamp& lamp) {
        constexpr double kRadius = 6;
        const V2d at = on_paper(lamp.place), d(kRadius * std::sqrt(0.5), kRadius * std::sqrt(0.5));
        const V2d size = lamp.size * scale_;
        if (std::max(size.x, size.y) > 2 * kRadius) {
            drawing_.add(
                R"(<rect class="luminaire" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="none" stroke="#000000" stroke-width="1.2" stroke-dasharray="6 3"/>)",
                at.x - size.x / 2, at.y - size.y / 2, size.x, size.y);
        }
        drawing_.add(
            R"(<circle class="lamp" cx="{:.1f}" cy="{:.1f}" r="{:g}" fill="none" stroke="#000000" stroke-width="1.4"/>)",
            at.x, at.y, kRadius);
        drawing_.line(at - d, at + d, "#000000", 1);
        drawing_.line(at + V2d(-d.x, d.y), at + V2d(d.x, -d.y), "#000000", 1);
        if (!lamp.name.empty()) drawing_.label(at + V2d(0, -kRadius - 4), lamp.name, "middle", kSmallFont);
    }

    void axes() {
        drawing_.add(
            R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="none" stroke="#000000" stroke-width="1"/>)",
            corner_.x, corner_.y, extent_.x, extent_.y);
        const double bottom = corner_.y + extent_.y;
        const auto most = [](double pixels) { return std::clamp(static_cast<int>(pixels / 55), 2, 12); };
        const V2d low = low_ + figure_.origin, high = high_ + figure_.origin;
        for (const double x : round_numbers({low.x, high.x}, Scaling::linear, most(extent_.x))) {
            const double at = on_paper({x - figure_.origin.x, low_.y}).x;
            drawing_.line({at, bottom}, {at, bottom + 5}, "#000000", 1);
            drawing_.text({at, bottom + 18}, fmt::format("{:g}", x), "middle", kSmallFont + 1);
        }
        for (const double y : round_numbers({low.y, high.y}, Scaling::linear, most(extent_.y))) {
            const double at = on_paper({low_.x, y - figure_.origin.y}).y;
            drawing_.line({corner_.x - 5, at}, {corner_.x, at}, "#000000", 1);
            drawing_.text({corner_.x - 9, at + 4}, fmt::format("{:g}", y), "end", kSmallFont + 1);
        }
        drawing_.text({corner_.x + extent_.x / 2, bottom + 36}, figure_.axes[0] + " [m]", "middle");
        const V2d side(kMargin + 4, corner_.y + extent_.y / 2);
        drawing_.text(side, figure_.axes[1] + " [m]", "middle", kFontSize, turned(side, -90));
    }

    const PlanFigure& figure_;
    Shown shown_;
    V2d low_, high_;  // m
    V2d corner_, extent_;
    double scale_ = 1;  // pixels per metre
    Drawing drawing_;
};

// Removes closed lines no larger than the noise that smoothing leaves.
std::vector<Isoline> without_specks(std::vector<Isoline> lines, double extent) {
    std::erase_if(lines, [&](const Isoline& line) {
        if (line.points.front() != line.points.back()) return false;
        V2d low = line.points.front(), high = low;
        for (const V2d& p : line.points) {
            low = {std::min(low.x, p.x), std::min(low.y, p.y)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y)};
        }
        return std::max(high.x - low.x, high.y - low.y) < extent;
    });
    return lines;
}

}  // namespace

std::string plan_svg(const PlanFigure& figure) {
    return Plan(figure).svg();
}

std::string picture_svg(const PictureFigure& figure) {
    const ValueGrid& values = figure.values;
    assert(values.columns > 0 && values.rows > 0);
    const Shown shown(figure);
    const double scale = figure.width > 0 ? figure.width / values.columns : 1;
    const V2d corner(kMargin, kMargin + (figure.title.empty() ? 0 : kTitleHeight));
    const V2d size = V2d(values.columns, values.rows) * scale;
    Image picture = Image::rgb(values.columns, values.rows);
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) picture.set_rgb(x, y, shown.colour(values.at(x, y)));
    }
    Drawing drawing;
    drawing.image(corner, size, picture);
    const ValueGrid smooth = smoothed_for(shown.levels, values, figure.smoothing);
    draw_isolines(drawing, without_specks(isolines(smooth, shown.levels), 4 * figure.smoothing),
                  [&](const V2d& p) { return corner + (p + V2d(0.5)) * scale; });
    const double legend = std::max(size.y, kLeastLegend);
    draw_legend(drawing, {corner.x + size.x + kLegendGap, corner.y}, legend, shown);
    if (!figure.title.empty())
        drawing.text({corner.x, kMargin + 13}, figure.title, "start", 15, R"(font-weight="bold")");
    return drawing.svg(corner.x + size.x + kLegendGap + kLegendWidth, corner.y + legend + kMargin,
                       figure.title);
}

int caption_width(const Caption& caption) {
    double widest = 0;
    for (const std::string& line : caption.lines) widest = std::max(widest, text_width(line, kFontSize));
    widest = std::max(widest, caption.bar + kBarGap + text_width(caption.bar_text, kSmallFont));
    return static_cast<int>(std::ceil(kWideLetters * widest + 2 * kCaptionMargin));
}

std::string caption_svg(const Caption& caption, int width) {
    constexpr double kLine = 16, kTick = 4;
    Drawing drawing;
    double y = kCaptionMargin;
    for (const std::string& line : caption.lines)
        drawing.text({kCaptionMargin, (y += kLine) - 4}, line, "start");
    y += kLine - 4;
    const V2d left(kCaptionMargin, y), right(kCaptionMargin + caption.bar, y);
    drawing.line(left, right, "#000000", 2);
    for (const V2d& end : {left, right}) drawing.line(end - V2d(0, kTick), end + V2d(0, kTick), "#000000", 1);
    drawing.text(right + V2d(kBarGap, 4), caption.bar_text, "start", kSmallFont, R"(class="bar")");
    return drawing.svg(width, y + kTick + kCaptionMargin, caption.lines.empty() ? "" : caption.lines.front());
}

Image drawn(const std::string& svg, const std::filesystem::path& file) {
    const FloatTraps none(kNoFaults);
    DrawnSvg pixels;
    try {
        pixels = pictures(file).draw_svg(svg, 1, kFont);
    } catch (const InputError&) {
        throw;
    } catch (const std::runtime_error& error) {
        throw InputError({file.string()}, fmt::format("cannot be drawn: {}", error.what()));
    }
    Image image = Image::rgb(pixels.width, pixels.height);
    for (std::size_t i = 0; i < image.data.size(); ++i)
        image.data[i] = static_cast<float>(pixels.rgb[i]) / 255;
    return image;
}

std::string value_text(double value) {
    return std::fabs(value) >= 99.95 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
}

std::string unit_as_written(std::string unit) {
    for (const std::string_view square : {"m^2", "m2"}) {
        for (std::size_t at; (at = unit.find(square)) != std::string::npos;)
            unit.replace(at, square.size(), "m²");
    }
    return unit;
}

}  // namespace lucerna
