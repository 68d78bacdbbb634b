// Options of commands that write pictures, and messages about pictures.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/cli/commands.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

ToneCurve parse_tone_curve(const std::string& word) {
    const auto curve = tone_curve_named(word);
    if (!curve) {
        throw InputError({"--tone"}, fmt::format("\"{}\" is unknown; expected {}", one_line(word),
                                                 fmt::join(tone_curve_names(), " or ")));
    }
    return *curve;
}

std::optional<double> parse_white(const std::string& word) {
    if (word == "off") return std::nullopt;
    try {
        return parse_number({"--white-balance"}, word, kLeastWhite, kMostWhite);
    } catch (const InputError&) {
        throw InputError(
            {"--white-balance"},
            fmt::format(
                "\"{}\" is not accepted; expected a colour temperature from {:g} to {:g}, in kelvins, or off",
                one_line(word), kLeastWhite, kMostWhite));
    }
}

}  // namespace

void add_picture_options(CLI::App& app, PictureOptions& options) {
    add_word(
        app, "--exposure", "STOPS",
        "exposure of the picture; 0 shows radiance 1 as white (default: automatic, the mean luminance is "
        "middle grey)",
        [&options](const std::string& word) { options.stops = parse_number({"--exposure"}, word, -60, 60); });
    add_word(app, "--tone", "CURVE",
             "tone curve for highlights in the picture: neutral compresses them towards white and keeps "
             "their hue, linear clips them (default: neutral)",
             [&options](const std::string& word) { options.tone = parse_tone_curve(word); });
    add_word(app, "--white-balance", "KELVIN",
             "colour temperature that is shown as white in the picture: 1000 to 25000, for example 3000 for "
             "a warm lamp, or off (default: off)",
             [&options](const std::string& word) { options.white = parse_white(word); });
}

void add_image_output(CLI::App& app, ImageOutput& output, const std::string& help) {
    app.add_option("-o,--output", output.file, help)->required()->type_name("FILE.exr");
    app.add_flag("--png", output.png, "also write a tone-mapped picture beside the image");
    add_picture_options(app, output.picture);
    app.add_flag("--quiet", output.quiet, "print errors only");
}

void ImageOutput::write(const Image& image, const std::string& what, const Image& shown,
                        const Image& exposed_by, const CommandContext& context) const {
    write_exr(file, image);
    if (!quiet) fmt::print(context.out, "image    {} ({} x {}, {})\n", file, image.width, image.height, what);
    if (!png) return;
    const PictureLook look = picture.look(exposed_by);
    write_png(png_beside(file), shown, look);
    if (!quiet) fmt::print(context.out, "{}\n", picture_text(png_beside(file), look, image));
}

std::string picture_text(const std::filesystem::path& file, const PictureLook& look, const Image& of) {
    const auto unit = of.attributes.find("lucerna.unit");
    const std::string white = unit == of.attributes.end()
                                  ? ""
                                  : fmt::format(": {:.4g} {} is white", 1 / look.exposure, unit->second);
    return fmt::format("picture  {} (exposure {:+.2f} stops{}{}{})", file.string(), log2(look.exposure),
                       white, look.tone == ToneCurve::linear ? ", clipped" : "",
                       look.white ? fmt::format(", white of {:g} K", *look.white) : "");
}

}  // namespace lucerna
