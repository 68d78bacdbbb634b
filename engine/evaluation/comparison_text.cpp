// Formats a comparison as text and as JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "engine/base/elementary.h"
#include "engine/evaluation/comparison.h"

namespace lucerna {
namespace {

using Json = nlohmann::ordered_json;

// --- text ---

class TextWriter {
  public:
    template <typename... Args>
    void line(std::string_view label, fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(text_), "{:<14} ", label);
        fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
        text_ += '\n';
    }
    std::string take() { return std::move(text_); }

  private:
    std::string text_;
};

std::string with_error(const Estimate& e) {
    return e.error ? fmt::format("{:.6g} +- {:.2g}", e.value, *e.error) : fmt::format("{:.6g}", e.value);
}

// Returns the root with the sign of its argument, because an estimate of a square may be negative.
double root_of(double square) {
    return std::copysign(std::sqrt(std::fabs(square)), square);
}

// A bias is detected if it exceeds two standard errors.
std::string bias_text(const Estimate& square) {
    if (!square.error || square.value > 2 * *square.error)
        return fmt::format("bias {:.4g}", root_of(square.value));
    return fmt::format("no bias detected; it is below {:.4g}",
                       std::sqrt(std::max(0.0, square.value) + 2 * *square.error));
}

void write_parts(TextWriter& out, const ErrorParts& parts) {
    std::string left_in;
    if (parts.reference_noise2 > 0)
        left_in = fmt::format("; {:.4g} including the reference's noise",
                              root_of(parts.bias2.value + parts.reference_noise2));
    out.line("  bias^2", "{}   {}{}", with_error(parts.bias2), bias_text(parts.bias2), left_in);
    out.line("  noise^2", "{}   noise {:.4g} of one image", with_error(parts.noise2),
             root_of(parts.noise2.value));
}

void write_errors(TextWriter& out, const ComparisonReport& report) {
    const Comparison& c = report.numbers;
    out.line("MSE", "{:.6g}", c.mse);
    if (report.seeds) write_parts(out, report.seeds->absolute);
    out.line("relative MSE", "{:.6g}   mean of (t-r)^2/(r^2+0.0001)", c.relative_mse);
    if (report.seeds) write_parts(out, report.seeds->relative);
    out.line("MAPE", "{:.6g}   mean of |t-r|/(|r|+0.01)", c.mape);
    out.line("error", "{:.3g} %   of luminance, defined as for render --error", 100 * c.error);
    if (report.flip)
        out.line("FLIP", "{:.6g}   at exposure {:+.2f} stops, {:.4g} pixels per degree", report.flip->mean,
                 log2(report.exposure), report.pixels_per_degree);
    if (report.hdr_flip)
        out.line("HDR-FLIP", "{:.6g}   {} exposures from {:+.2f} to {:+.2f} stops", report.hdr_flip->mean,
                 report.exposures->count, report.exposures->start, report.exposures->stop);
}

void write_seeds(TextWriter& out, const BiasAndNoise& seeds) {
    out.line("images", "{} seeds; errors are averages over single images, everything else is for their mean",
             seeds.images);
    if (seeds.equal_pairs > 0)
        out.line("", "{} of {} pairs are THE SAME IMAGE: no noise between them", seeds.equal_pairs,
                 seeds.images * (seeds.images - 1) / 2);
    if (seeds.images < 3)
        out.line("", "three or more seeds are needed for standard errors of bias and noise");
    if (seeds.reference_has_variance)
        out.line("", "the noise stated by the reference, {:.3g} of the MSE, is not included in the bias",
                 seeds.absolute.reference_noise2);
    else
        out.line("", "the reference states no variance: its noise is included in the bias");
    if (seeds.stated_over_actual)
        out.line("", "the variance stated by the images is {:.3g} of that between them",
                 *seeds.stated_over_actual);
}

void write_channels(TextWriter& out, const ComparisonReport& report) {
    for (std::size_t i = 0; i < report.numbers.channels.size(); ++i) {
        const ChannelComparison& channel = report.numbers.channels[i];
        std::string error;
        if (report.seeds && i < report.seeds->channels.size()) {
            const auto& ratio = report.seeds->channels[i].ratio;
            if (ratio && ratio->error) error = fmt::format(" +- {:.2g}", *ratio->error);
        }
        out.line("mean " + channel.name, "{:.6g}, reference {:.6g}, ratio {}{}", channel.mean,
                 channel.reference_mean, channel.ratio ? fmt::format("{:.6g}", *channel.ratio) : "none",
                 error);
    }
}

std::string verdict(const ZTest& z) {
    if (z.equal()) return "equal within the noise";
    if (z.answered_by == "largest") return "DIFFERENT: the largest difference is beyond the noise";
    if (z.answered_by == "beyond") return "DIFFERENT: too many pixels deviate more than this noise explains";
    return "DIFFERENT: the sums differ beyond the noise";
}

void write_z_test(TextWriter& out, const ZTest& z) {
    if (z.tests == 0) {
        out.line("z-test", "no pixel has a variance");
    } else {
        if (z.cell > 1) out.line("z-test", "of cells of {0} x {0} pixels", z.cell);
        out.line(z.cell > 1 ? "" : "z-test",
                 "{} of {} values differ beyond their noise (level {:.3g} each, {:g} in all)", z.rejected,
                 z.tests, z.corrected_level, z.level);
        out.line("", "p = {:.3g} for the largest, at ({}, {}) {}", z.p_value, z.x, z.y,
                 z.channel.empty() ? "-" : z.channel);
        for (const BeyondSigma& b : z.beyond)
            out.line("", "beyond {:g} sigma: {:.4g} % of the values, expected {:.4g} % (p = {:.3g})",
                     b.sigmas, 100 * b.share, 100 * b.expected, b.p_value);
        out.line("", "mean z {:+.4g} +- {:.2g} at most; sums of differences: p = {:.3g}", z.mean_z,
                 z.mean_z_error, z.mean_p);
        out.line("verdict", "{} (p = {:.3g}; equal images are called different with {:g} % at most)",
                 verdict(z), z.verdict_p, 100 * z.level);
    }
    if (z.untestable > 0) out.line("", "{} values differ but have no variance", z.untestable);
}

void write_units(TextWriter& out, const ComparisonReport& report) {
    const auto named = [](const std::string& name) { return name.empty() ? "not stated" : name; };
    if (report.unit != report.reference_unit)
        out.line("unit", "{}, of the reference {}: NOT THE SAME", named(report.unit),
                 named(report.reference_unit));
    else if (!report.unit.empty())
        out.line("unit", "{}", report.unit);
}

void write_pixels(TextWriter& out, const Comparison& c) {
    if (c.largest.channel.empty())
        out.line("largest", "no difference");
    else
        out.line("largest", "{:.6g} at ({}, {}) {}", c.largest.value, c.largest.x, c.largest.y,
                 c.largest.channel);
    out.line("pixels", "{} compared; not finite: {} in the image, {} in the reference", c.pixels,
             c.bad_pixels, c.bad_reference_pixels);
    if (c.masked_pixels > 0)
        out.line("masked", "{} pixels that are brighter than the limit in the reference", c.masked_pixels);
    if (!c.left_out.empty()) out.line("left out", "{} (in one image only)", fmt::join(c.left_out, ", "));
}

// --- JSON ---

Json to_json(const Estimate& e) {
    return {{"value", e.value}, {"standard_error", e.error ? Json(*e.error) : Json()}};
}

Json to_json(const ErrorParts& parts) {
    return {{"mse", to_json(parts.mse)},
            {"bias2", to_json(parts.bias2)},
            {"noise2", to_json(parts.noise2)},
            {"reference_noise2", parts.reference_noise2},
            {"bias2_with_reference_noise", parts.bias2.value + parts.reference_noise2}};
}

Json to_json(const BiasAndNoise& seeds) {
    Json json{
        {"images", seeds.images},
        {"pixels", seeds.pixels},
        {"absolute", to_json(seeds.absolute)},
        {"relative", to_json(seeds.relative)},
        {"reference_has_variance", seeds.reference_has_variance},
        {"stated_over_actual_variance", seeds.stated_over_actual ? Json(*seeds.stated_over_actual) : Json()},
        {"equal_pairs", seeds.equal_pairs}};
    for (const ChannelOfSeeds& channel : seeds.channels)
        json["channels"][channel.name] = {{"mean", to_json(channel.mean)},
                                          {"reference_mean", channel.reference_mean},
                                          {"ratio", channel.ratio ? to_json(*channel.ratio) : Json()}};
    return json;
}

Json to_json(const ZTest& z) {
    Json json{{"cell", z.cell},
              {"tests", z.tests},
              {"untestable", z.untestable},
              {"rejected", z.rejected},
              {"level", z.level},
              {"corrected_level", z.corrected_level},
              {"smallest_p", z.smallest_p},
              {"p_value", z.p_value},
              {"x", z.x},
              {"y", z.y},
              {"channel", z.channel}};
    json["beyond"] = Json::array();
    for (const BeyondSigma& b : z.beyond)
        json["beyond"].push_back({{"sigmas", b.sigmas},
                                  {"values", b.values},
                                  {"share", b.share},
                                  {"expected", b.expected},
                                  {"p_value", b.p_value}});
    json["mean_z"] = z.mean_z;
    json["mean_z_error"] = z.mean_z_error;
    json["mean_p"] = z.mean_p;
    json["verdict"] = {{"equal", z.equal()}, {"p_value", z.verdict_p}, {"by", z.answered_by}};
    return json;
}

void add_flip(Json& json, const ComparisonReport& report) {
    if (!report.flip) return;
    json["flip"] = {{"pixels_per_degree", report.pixels_per_degree},
                    {"ldr",
                     {{"mean", report.flip->mean},
                      {"largest", report.flip->largest},
                      {"exposure_stops", log2(report.exposure)}}}};
    if (!report.hdr_flip) return;
    json["flip"]["hdr"] = {{"mean", report.hdr_flip->mean},
                           {"largest", report.hdr_flip->largest},
                           {"start_stops", report.exposures->start},
                           {"stop_stops", report.exposures->stop},
                           {"exposures", report.exposures->count}};
}

void add_images(Json& json, const ComparisonReport& report) {
    for (std::size_t i = 0; i < report.images.size(); ++i) {
        const ImageNumbers& one = report.images[i];
        Json entry{{"image", one.name},
                   {"mse", one.mse},
                   {"relative_mse", one.relative_mse},
                   {"mape", one.mape},
                   {"error", one.error}};
        if (report.flip) entry["flip"] = report.flip->each[i];
        if (report.hdr_flip) entry["hdr_flip"] = report.hdr_flip->each[i];
        json["images"].push_back(std::move(entry));
    }
}

}  // namespace

std::string comparison_text(const ComparisonReport& report) {
    TextWriter out;
    write_units(out, report);
    if (report.seeds) write_seeds(out, *report.seeds);
    write_errors(out, report);
    write_channels(out, report);
    write_pixels(out, report.numbers);
    if (report.numbers.z_test)
        write_z_test(out, *report.numbers.z_test);
    else
        out.line("z-test",
                 "none: an image lacks variance.C for a channel C; images rendered by lucerna have it");
    return out.take();
}

std::string comparison_json(const ComparisonReport& report) {
    const Comparison& c = report.numbers;
    Json json;
    json["image"] = report.images[0].name;
    json["reference"] = report.reference;
    json["unit"] = report.unit;
    json["reference_unit"] = report.reference_unit;
    json["mse"] = c.mse;
    json["relative_mse"] = c.relative_mse;
    json["mape"] = c.mape;
    json["error"] = c.error;
    json["definitions"] = {{"mse", "mean (t-r)^2"},
                           {"relative_mse", "mean (t-r)^2/(r^2+1e-4)"},
                           {"mape", "mean |t-r|/(|r|+1e-2)"},
                           {"error", "root mean (Lt-Lr)^2/(Lr^2+(mean Lr/10)^2), L luminance"}};
    add_flip(json, report);
    for (const ChannelComparison& channel : c.channels) {
        json["channels"][channel.name] = {{"mean", channel.mean},
                                          {"reference_mean", channel.reference_mean},
                                          {"ratio", channel.ratio ? Json(*channel.ratio) : Json()}};
    }
    json["largest"] = {
        {"value", c.largest.value}, {"x", c.largest.x}, {"y", c.largest.y}, {"channel", c.largest.channel}};
    json["pixels"] = c.pixels;
    json["masked_pixels"] = c.masked_pixels;
    json["bad_pixels"] = c.bad_pixels;
    json["bad_reference_pixels"] = c.bad_reference_pixels;
    json["left_out"] = c.left_out;
    if (c.z_test) json["z_test"] = to_json(*c.z_test);
    if (report.seeds) {
        add_images(json, report);
        json["seeds"] = to_json(*report.seeds);
    }
    // File names need not be UTF-8.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace lucerna
