// lucerna compare: numbers between an image and its reference.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "engine/app/commands.h"
#include "engine/app/options.h"
#include "engine/app/outputs.h"
#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/render/compare.h"

namespace lucerna {
namespace {

constexpr const char* kFooter =
    R"(Numbers, over all pixels and colour channels, with t the image and r the reference:
  MSE           mean of (t - r)^2
  relative MSE  mean of (t - r)^2 / (r^2 + 0.0001)
  MAPE          mean of |t - r| / (|r| + 0.01)
  mean ratio    mean t / mean r, per channel
Pixels with NaN or infinity are counted and left out. If both images carry variances, as all that lucerna renders
do, each pixel's difference is tested against its noise (z-test, corrected for so many pixels by Sidak). A lamp that
is seen is a few bright pixels that decide every mean: --mask leaves them out.

Examples:
  lucerna compare room.exr reference.exr
  lucerna compare room.exr reference.exr --json numbers.json
  lucerna compare room.exr reference.exr --json -
  lucerna compare cornell.exr reference.exr --mask 4)";

struct CompareOptions {
    std::string image, reference;
    std::string json;  // "-": to out, in place of the text
    double mask = std::numeric_limits<double>::infinity();
};

void print_z_test(std::ostream& out, const ZTest& z) {
    if (z.tests == 0) {
        fmt::print(out, "z-test         no pixel has a variance\n");
    } else {
        fmt::print(
            out,
            "z-test         {} of {} values differ beyond their noise (level {:.3g} each, {:g} in all)\n",
            z.rejected, z.tests, z.corrected_level, z.level);
        fmt::print(out, "               p = {:.3g} for the image; smallest at ({}, {}) {}\n", z.p_value, z.x,
                   z.y, z.channel.empty() ? "-" : z.channel);
    }
    if (z.untestable > 0)
        fmt::print(out, "               {} values differ but have no variance\n", z.untestable);
}

void print_text(std::ostream& out, const Comparison& c) {
    fmt::print(out, "MSE            {:.6g}\n", c.mse);
    fmt::print(out, "relative MSE   {:.6g}   mean of (t-r)^2/(r^2+0.0001)\n", c.relative_mse);
    fmt::print(out, "MAPE           {:.6g}   mean of |t-r|/(|r|+0.01)\n", c.mape);
    for (const ChannelComparison& channel : c.channels) {
        fmt::print(out, "mean {:<9} {:.6g}, reference {:.6g}, ratio {}\n", channel.name, channel.mean,
                   channel.reference_mean, channel.ratio ? fmt::format("{:.6g}", *channel.ratio) : "none");
    }
    if (c.largest.channel.empty()) {
        fmt::print(out, "largest        no difference\n");
    } else {
        fmt::print(out, "largest        {:.6g} at ({}, {}) {}\n", c.largest.value, c.largest.x, c.largest.y,
                   c.largest.channel);
    }
    fmt::print(out, "pixels         {} compared; not finite: {} in the image, {} in the reference\n",
               c.pixels, c.bad_pixels, c.bad_reference_pixels);
    if (c.masked_pixels > 0)
        fmt::print(out, "masked         {} pixels, brighter in the reference than asked for\n",
                   c.masked_pixels);
    if (!c.left_out.empty())
        fmt::print(out, "left out       {} (in one image only)\n", fmt::join(c.left_out, ", "));
    if (c.z_test) print_z_test(out, *c.z_test);
}

std::string unit_of(const Image& image) {
    const auto found = image.attributes.find("lucerna.unit");
    return found == image.attributes.end() ? std::string() : one_line(found->second);
}

void print_units(std::ostream& out, const std::string& unit, const std::string& reference) {
    const auto named = [](const std::string& name) { return name.empty() ? "not stated" : name; };
    if (unit == reference) {
        if (!unit.empty()) fmt::print(out, "unit           {}\n", unit);
    } else {
        fmt::print(out, "unit           {}, of the reference {}: NOT THE SAME\n", named(unit),
                   named(reference));
    }
}

std::string to_json(const CompareOptions& options, const Comparison& c, const std::string& unit,
                    const std::string& reference_unit) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["image"] = options.image;
    json["reference"] = options.reference;
    json["unit"] = unit;
    json["reference_unit"] = reference_unit;
    json["mse"] = c.mse;
    json["relative_mse"] = c.relative_mse;
    json["mape"] = c.mape;
    json["definitions"] = {{"mse", "mean (t-r)^2"},
                           {"relative_mse", "mean (t-r)^2/(r^2+1e-4)"},
                           {"mape", "mean |t-r|/(|r|+1e-2)"}};
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
    if (c.z_test) {
        const ZTest& z = *c.z_test;
        json["z_test"] = {{"tests", z.tests},
                          {"untestable", z.untestable},
                          {"rejected", z.rejected},
                          {"level", z.level},
                          {"corrected_level", z.corrected_level},
                          {"smallest_p", z.smallest_p},
                          {"p_value", z.p_value},
                          {"x", z.x},
                          {"y", z.y},
                          {"channel", z.channel}};
    }
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void act(const CompareOptions& options, const CommandContext& context) {
    const bool to_file = !options.json.empty() && options.json != "-";
    if (to_file) require_writable(options.json, "");
    const Image image = read_exr(options.image), reference = read_exr(options.reference);
    const Comparison result = compare(image, reference, options.image, options.reference, options.mask);
    const std::string unit = unit_of(image), reference_unit = unit_of(reference);
    if (options.json == "-") {
        context.out << to_json(options, result, unit, reference_unit);
        return;
    }
    if (to_file) write_text(options.json, to_json(options, result, unit, reference_unit));
    print_units(context.out, unit, reference_unit);
    print_text(context.out, result);
}

}  // namespace

void add_compare_command(CLI::App& program, const CommandContext& context) {
    const auto options = std::make_shared<CompareOptions>();
    CLI::App& app = *program.add_subcommand("compare", "Numbers between an image and its reference");
    app.footer(kFooter);
    app.add_option("IMAGE", options->image, "OpenEXR image")->required();
    app.add_option("REFERENCE", options->reference, "OpenEXR image of the same size")->required();
    app.add_option("--json", options->json, "write the numbers as JSON; - for standard output")
        ->type_name("FILE");
    add_word(app, "--mask", "VALUE", "leave out pixels of which the reference is above this, in its own unit",
             [options](const std::string& word) { options->mask = parse_number({"--mask"}, word, 0, 1e30); });
    app.callback([options, &context] { act(*options, context); });
}

}  // namespace lucerna
