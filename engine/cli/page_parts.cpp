#include "engine/cli/page_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/evaluation/error_pictures.h"
#include "engine/figures/colour_maps.h"
#include "engine/text/plain_text.h"

namespace lucerna {

std::string filled(std::string_view page, const std::map<std::string, std::string, std::less<>>& blanks) {
    std::string result;
    for (std::size_t at = 0;;) {
        const std::size_t open = page.find("{{", at);
        const std::size_t close = page.find("}}", open);
        result += page.substr(at, open == std::string_view::npos ? open : open - at);
        if (open == std::string_view::npos) return result;
        if (close == std::string_view::npos) throw std::logic_error("a page's placeholder has no end");
        result += blanks.at(std::string(page.substr(open + 2, close - open - 2)));
        at = close + 2;
    }
}

std::string script_text(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        const auto code = static_cast<unsigned char>(c);
        if (code < 0x20 || c == '"' || c == '\\' || c == '<' || c == '>' || c == '&')
            fmt::format_to(std::back_inserter(result), "\\u{:04x}", code);
        else
            result += c;
    }
    return result + "\"";
}

namespace {

constexpr int kMostPixels = 2048;  // on a side of an image in a page

// Builds the script's list of images and the scales of the maps beside it.
class PagePictures {
  public:
    explicit PagePictures(int factor) : factor_(factor) {}

    void radiance(const std::string& name, const Image& image) {
        entry(name, "radiance", radiance_picture(fitting(image)));
    }
    void map(const std::string& name, const Image& one_channel, double scale, bool is_signed) {
        const Image small = fitting(one_channel);
        entry(name, "picture", is_signed ? diverging_picture(small, scale) : magma_picture(small, scale));
        add_scale(name, scale, is_signed);
    }
    const std::string& entries() const { return entries_; }
    const std::string& scales() const { return scales_; }

  private:
    Image fitting(const Image& image) const { return factor_ == 1 ? image : shrunk(image, factor_); }

    void entry(const std::string& name, const char* kind, const Image& picture) {
        fmt::format_to(std::back_inserter(entries_), "{{\"name\": {}, \"kind\": \"{}\", \"src\": \"{}\"}},\n",
                       script_text(name), kind, data_url(picture));
    }

    void add_scale(const std::string& name, double scale, bool is_signed) {
        std::string colours;
        constexpr int kSteps = 16;
        for (int i = 0; i <= kSteps; ++i) {
            const double v = static_cast<double>(i) / kSteps;
            const Rgb c = (is_signed ? diverging_colour(2 * v - 1) : magma_colour(v)) * 255.0F;
            fmt::format_to(std::back_inserter(colours), "{}rgb({:.0f} {:.0f} {:.0f})", i == 0 ? "" : ", ",
                           c.x, c.y, c.z);
        }
        fmt::format_to(
            std::back_inserter(scales_),
            "<div class=\"scale\"><span class=\"scale-name\">{}</span><span>{:g}</span><span "
            "class=\"scale-colours\" style=\"background: linear-gradient(to right, {})\"></span><span>{:g}"
            "</span></div>\n",
            html_text(name), is_signed ? -scale : 0.0, colours, scale);
    }

    int factor_;
    std::string entries_, scales_;
};

// Returns a table of the images' header texts, side by side where they differ.
std::string settings_table(const std::vector<NamedImage>& images, const NamedImage& reference) {
    std::set<std::string> names;
    std::vector<const NamedImage*> columns;
    for (const NamedImage& one : images) columns.push_back(&one);
    columns.push_back(&reference);
    for (const NamedImage* one : columns) {
        for (const auto& [name, text] : one->image.attributes) names.insert(name);
    }
    std::string rows = "<tr><th></th>";
    for (const NamedImage* one : columns) rows += "<th>" + html_text(one->name) + "</th>";
    rows += "</tr>\n";
    for (const std::string& name : names) {
        rows += "<tr><th>" + html_text(name) + "</th>";
        for (const NamedImage* one : columns) {
            const auto found = one->image.attributes.find(name);
            rows += "<td>" +
                    (found == one->image.attributes.end() ? "" : html_text(one_line(found->second))) +
                    "</td>";
        }
        rows += "</tr>\n";
    }
    return names.empty() ? "<p>Not stated in the files.</p>"
                         : "<div class=\"wide\"><table>\n" + rows + "</table></div>";
}

std::string seeds_table(const ComparisonReport& report) {
    if (!report.seeds) return "";
    std::string rows =
        "<tr><th>image</th><th>MSE</th><th>relative MSE</th><th>MAPE</th><th>FLIP</th>"
        "<th>HDR-FLIP</th></tr>\n";
    const auto flip_of = [](const std::optional<FlipNumbers>& flip, std::size_t i) {
        return flip ? fmt::format("{:.4g}", flip->each[i]) : std::string();
    };
    for (std::size_t i = 0; i < report.images.size(); ++i) {
        const ImageNumbers& one = report.images[i];
        fmt::format_to(
            std::back_inserter(rows),
            "<tr><td>{}</td><td>{:.4g}</td><td>{:.4g}</td><td>{:.4g}</td><td>{}</td><td>{}</td></tr>\n",
            html_text(one.name), one.mse, one.relative_mse, one.mape, flip_of(report.flip, i),
            flip_of(report.hdr_flip, i));
    }
    return "<h2>Every seed</h2>\n<table>\n" + rows + "</table>";
}

std::string verdict_line(const ComparisonReport& report) {
    const auto& z = report.numbers.z_test;
    if (!z || z->tests == 0) return "No test: at least one image has no variances.";
    return fmt::format("{} (p = {:.3g}, level {:g})",
                       z->equal() ? "Equal within the noise" : "Different beyond the noise", z->verdict_p,
                       z->level);
}

std::string shown_line(const ComparisonReport& report, int factor) {
    std::string line =
        "Radiance is shown at the exposure chosen above, in stops; wheel and drag zoom and move, f flips. "
        "Errors are "
        "relative to the reference's luminance plus a tenth of its mean.";
    if (report.seeds)
        line += " The signed error is that of the mean of the images; FLIP maps are means over them.";
    if (factor > 1) line += fmt::format(" Every pixel here is the mean of {} x {}.", factor, factor);
    return line;
}

}  // namespace

std::string comparison_page(const ComparisonReport& report, const std::vector<NamedImage>& images,
                            const NamedImage& reference, double error_range) {
    const ComparedPictures& all = report.pictures;
    const int longest = std::max(all.reference.width, all.reference.height);
    const int factor = (longest + kMostPixels - 1) / kMostPixels;
    PagePictures pictures(factor);
    pictures.radiance(images[0].name, all.first);
    pictures.radiance("reference: " + reference.name, all.reference);
    if (report.seeds) pictures.radiance("mean of the images", all.mean);
    pictures.map("signed error", all.error, error_range, true);
    if (all.noise) pictures.map("noise of one image", *all.noise, error_range, false);
    if (report.hdr_flip) pictures.map("HDR-FLIP", report.hdr_flip->map, 1, false);
    if (report.flip) pictures.map("FLIP", report.flip->map, 1, false);
    // The exposure slider moves in quarters of a stop.
    const double stops = std::round(4 * log2(report.exposure)) / 4;
    const std::string count = images.size() == 1 ? "" : fmt::format(" and {} more", images.size() - 1);
    return filled(
        kComparePage,
        {{"title", html_text(images[0].name + count + " against " + reference.name)},
         {"style", std::string(kPageStyle)},
         {"script", std::string(kImageStrip)},
         {"verdict", html_text(verdict_line(report))},
         {"scales", pictures.scales()},
         {"shown", html_text(shown_line(report, factor))},
         {"numbers", html_text(comparison_text(report))},
         {"seeds", seeds_table(report)},
         {"settings", settings_table(images, reference)},
         {"data",
          fmt::format("{{\"images\": [\n{}], \"options\": {{\"left\": 0, \"right\": 1, \"stops\": {}}}}}",
                      pictures.entries(), stops)}});
}

}  // namespace lucerna
