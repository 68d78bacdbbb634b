// Figures as SVG: positions of elements, and names that cannot escape from their text.
#include "engine/figures/figure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "engine/base/error.h"
#include "tests/support/cannot_run.h"

namespace lucerna {
namespace figure_test {

using ::testing::HasSubstr;
using ::testing::Not;

int count(const std::string& text, const std::string& part) {
    int found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

PlanFigure room() {
    PlanFigure figure;
    figure.title = "Room";
    figure.unit = "lx";
    figure.values = {8, 4, {}};
    figure.first = {0.5, 3.5};
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 8; ++column) figure.values.values.push_back(100 + 50 * column);
    }
    return figure;
}

TEST(Plans, HaveACellAndANumberForEachPoint) {
    const std::string svg = plan_svg(room());
    EXPECT_EQ(count(svg, "class=\"value\""), 32);
    EXPECT_THAT(svg, HasSubstr(">450</text>"));
    EXPECT_THAT(svg, HasSubstr(">lx</text>"));
    EXPECT_THAT(svg, HasSubstr("x [m]"));
    EXPECT_EQ(plan_svg(room()), svg);
    PlanFigure narrow = room();
    narrow.width = 300;
    EXPECT_EQ(count(plan_svg(narrow), "class=\"value\""), 0);  // they do not fit
    EXPECT_EQ(count(plan_svg(narrow), "class=\"lamp\""), 0);
}

// With E = 100 + 50 (x - 0.5) / m, the line of 200 is vertical at x = 2.5 m. Two outlines give the scale of
// the drawing.
TEST(Plans, Isolines_AreWhereTheMetresSay) {
    PlanFigure figure = room();
    figure.isolines.levels = {200};
    figure.outlines = {{{{0, 0}, {8, 0}, {8, 4}, {0, 4}}, true}};
    const std::string svg = plan_svg(figure);
    std::smatch line, outline;
    ASSERT_TRUE(
        std::regex_search(svg, line, std::regex(R"re(data-level="200" d="M([\d.]+) ([\d.]+) ([\d.]+) )re")));
    ASSERT_TRUE(std::regex_search(svg, outline, std::regex(R"re(points="([\d.]+),([\d.]+) ([\d.]+),)re")));
    const double x0 = std::stod(outline[1]), x8 = std::stod(outline[3]);
    EXPECT_NEAR(std::stod(line[1]), x0 + (x8 - x0) * 2.5 / 8, 0.11);
    EXPECT_NEAR(std::stod(line[3]), x0 + (x8 - x0) * 2.5 / 8, 0.11);
    // It begins at an edge of the outline, half a cell beyond the outermost points.
    const double edge = std::stod(outline[2]), height = (x8 - x0) / 2;
    const double begin = std::stod(line[2]);
    EXPECT_LT(std::min(std::fabs(begin - edge), std::fabs(begin - (edge - height))), 0.11) << begin;
    EXPECT_EQ(count(svg, "class=\"isoline\""), 1);
    figure.isolines.shown = false;
    EXPECT_EQ(count(plan_svg(figure), "class=\"isoline\""), 0);
}

// Captions of the smallest and largest values, drawn in the width that they ask for, leave their margins
// white.
TEST(Captions, FitIntoTheirWidth) {
    for (const Caption& caption :
         {Caption{{"distance 1 m", "2 m × 2 m", "peak 1 lx", "mean 0 lx"}, 13, "500 mm"},
          Caption{
              {"height 0.25 um", "mmmmmmmm", "peak 1.235e-06 W/m²", "mean -1.235e-06 W/m²"}, 30, "0.05 um"},
          Caption{{"distance 1.235e+04 m", "888.8 mm × 888.8 mm", "peak 1.235e+07 lx"}, 300, "888.8 mm"},
          Caption{{}, 0, ""}}) {
        const int width = caption_width(caption);
        const std::string svg = caption_svg(caption, width);
        EXPECT_EQ(count(svg, "<text "), static_cast<int>(caption.lines.size()) + 1);
        Image picture;
        try {
            picture = drawn(svg, "caption.png");
        } catch (const InputError& error) {
            LUCERNA_CANNOT_RUN() << error.what();
        }
        ASSERT_EQ(picture.width, width);
        int ink = 0;
        for (int y = 0; y < picture.height; ++y) {
            for (int x = 0; x < width; ++x) {
                const bool white = picture.rgb_at(x, y).x > 0.99F;
                const bool margin = std::min({x, y, width - 1 - x, picture.height - 1 - y}) < 3;
                EXPECT_TRUE(white || !margin) << x << ", " << y << " of " << svg;
                ink += white ? 0 : 1;
            }
        }
        EXPECT_GT(ink, 20 * static_cast<int>(caption.lines.size()));
    }
}

// Lines are farther apart than letters are high, and the bar is as long as it should be.
TEST(Captions, HaveLinesApart_AndABarOfItsLength) {
    const std::string svg = caption_svg({{"a", "b", "<c>"}, 40, "1 m"}, 200);
    std::vector<double> heights;
    const std::regex text(R"re(<text x="[\d.]+" y="([\d.]+)")re");
    for (std::sregex_iterator i(svg.begin(), svg.end(), text), end; i != end; ++i)
        heights.push_back(std::stod((*i)[1]));
    ASSERT_EQ(heights.size(), 4U);
    for (std::size_t i = 1; i < heights.size(); ++i) EXPECT_GE(heights[i] - heights[i - 1], 14);
    std::smatch bar;
    ASSERT_TRUE(std::regex_search(
        svg, bar, std::regex(R"re(<line x1="([\d.]+)" y1="([\d.]+)" x2="([\d.]+)" y2="([\d.]+)")re")));
    EXPECT_NEAR(std::stod(bar[3]) - std::stod(bar[1]), 40, 1e-9);
    EXPECT_EQ(bar[2], bar[4]);
    EXPECT_THAT(svg, HasSubstr("&lt;c&gt;"));
}

TEST(Units, AreWrittenWithASquare) {
    EXPECT_EQ(unit_as_written("cd/m^2"), "cd/m²");
    EXPECT_EQ(unit_as_written("W/m2"), "W/m²");
    EXPECT_EQ(unit_as_written("lx"), "lx");
}

TEST(Plans, Names_StayText) {
    PlanFigure figure = room();
    figure.title = "<script>\x01\n& \"a\"";
    figure.lamps = {{{1, 1}, "<b>"}, {{2, 2}, ""}};
    const std::string svg = plan_svg(figure);
    EXPECT_THAT(svg, Not(HasSubstr("<script")));
    EXPECT_THAT(svg, Not(HasSubstr("<b>")));
    EXPECT_THAT(svg, HasSubstr("&lt;script&gt;"));
    EXPECT_EQ(svg.find('\x01'), std::string::npos);
    EXPECT_EQ(count(svg, "class=\"lamp\""), 2);
}

TEST(Plans, Legend_NamesWhatIsOutside) {
    PlanFigure figure = room();
    EXPECT_THAT(plan_svg(figure), Not(HasSubstr("above")));
    figure.scale.range = ScaleRange{150, 300};
    figure.values.values[3] = NAN;
    const std::string svg = plan_svg(figure);
    for (const char* part : {"above 300", "below 150", "no value"}) EXPECT_THAT(svg, HasSubstr(part));
    EXPECT_EQ(count(svg, "class=\"value\""), 31);
}

TEST(Plans, OfAnyShape_AreDrawn) {
    for (const auto& [columns, rows] :
         {std::pair(1, 1), std::pair(1, 5), std::pair(30, 1), std::pair(2, 2)}) {
        PlanFigure figure;
        figure.values = {columns, rows, std::vector<double>(static_cast<std::size_t>(columns * rows), NAN)};
        const std::string svg = plan_svg(figure);
        EXPECT_THAT(svg, Not(HasSubstr("nan")));
        EXPECT_THAT(svg, Not(HasSubstr("inf")));
    }
}

PictureFigure slope() {
    PictureFigure figure;
    figure.unit = "cd/m^2";
    figure.values = {80, 60, {}};
    for (int y = 0; y < 60; ++y) {
        for (int x = 0; x < 80; ++x) figure.values.values.push_back(x);
    }
    return figure;
}

// The line passes the centre of pixel 40, the first with the value 40: half a pixel into it, plus the margin.
TEST(Pictures, Isolines_AreWhereThePixelsAre) {
    PictureFigure figure = slope();
    figure.isolines.levels = {40};
    const auto x_of_line = [](const std::string& svg) {
        std::smatch line;
        EXPECT_TRUE(std::regex_search(svg, line, std::regex(R"re(data-level="40" d="M([\d.]+) )re")));
        return std::stod(line[1]);
    };
    EXPECT_NEAR(x_of_line(picture_svg(figure)), 14 + 40.5, 0.06);
    figure.width = 160;
    EXPECT_NEAR(x_of_line(picture_svg(figure)), 14 + 2 * 40.5, 0.06);
    figure.smoothing = 2;  // of a slope changes nothing inside
    EXPECT_NEAR(x_of_line(picture_svg(figure)), 14 + 2 * 40.5, 0.06);
}

TEST(Pictures, Drawn_HaveTheirColoursAndTheLegend) {
    PictureFigure figure = slope();
    figure.isolines.shown = false;
    Image image;
    try {
        image = drawn(picture_svg(figure), "a.png");
    } catch (const InputError& error) {
        LUCERNA_CANNOT_RUN() << error.what();
    }
    EXPECT_EQ(image.width, 14 + 80 + 18 + 110);
    const FalseColour colour(figure.scale, figure.values.values);
    for (const int x : {1, 30, 78}) {
        const Rgb there = image.rgb_at(14 + x, 14 + 30);
        EXPECT_LT((there - colour(x)).length(), 0.03F) << x;
    }
    int dark = 0;  // letters beside the bar
    for (int y = 0; y < image.height; ++y) {
        for (int x = 14 + 80 + 18 + 24; x < image.width; ++x) dark += luminance(image.rgb_at(x, y)) < 0.3F;
    }
    EXPECT_GT(dark, 100);
    EXPECT_EQ(drawn(picture_svg(figure), "a.png").data, image.data);
}

TEST(Figures, Texts_AreAsPeopleWrite) {
    EXPECT_EQ(value_text(523.4), "523");
    EXPECT_EQ(value_text(99.96), "100");
    EXPECT_EQ(value_text(99.94), "99.9");
    EXPECT_EQ(value_text(0.01234), "0.0123");
    EXPECT_EQ(value_text(12345.6), "12346");
    EXPECT_EQ(unit_as_written("cd/m^2"), "cd/m²");
    EXPECT_EQ(unit_as_written("W/(m^2 sr)"), "W/(m² sr)");
}

}  // namespace figure_test
}  // namespace lucerna
