// The subcommands: each adds its options, help and action to the command line. One file each.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/cli/run.h"
#include "engine/colour/tone.h"
#include "engine/image/displayed.h"
#include "engine/image/image.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"
#include "lights/flux_unit.h"

namespace lucerna {

// Where a command speaks. Outlives the parsing, in which the actions run.
struct CommandContext {
    std::ostream& out;
    std::ostream& err;
    const Surroundings& around;
};

void add_render_command(CLI::App& program, const CommandContext& context);
void add_light_command(CLI::App& program, const CommandContext& context);
void add_import_command(CLI::App& program, const CommandContext& context);
void add_denoise_command(CLI::App& program, const CommandContext& context);
void add_merge_command(CLI::App& program, const CommandContext& context);
void add_relight_command(CLI::App& program, const CommandContext& context);
void add_compare_command(CLI::App& program, const CommandContext& context);
void add_falsecolour_command(CLI::App& program, const CommandContext& context);
void add_study_command(CLI::App& program, const CommandContext& context);
void add_lux_command(CLI::App& program, const CommandContext& context);
void add_glare_command(CLI::App& program, const CommandContext& context);
void add_info_command(CLI::App& program, const CommandContext& context);

// Options that are read by units.h, so that every bad word gets the same kind of answer.

// Adds option `name`; `take` gets the word and throws InputError if it is none.
template <typename Take>
CLI::Option* add_word(CLI::App& app, const std::string& name, const std::string& type,
                      const std::string& help, Take take) {
    return app
        .add_option_function<std::string>(
            name, [take](const std::string& word) { take(word); }, help)
        ->type_name(type);
}

// How a command's pictures look, as its options say.
struct PictureOptions {
    std::optional<double> stops;  // none: by auto_exposure() of the image
    ToneCurve tone = ToneCurve::neutral;
    std::optional<double> white;  // kelvins

    PictureLook look(const Image& image) const {
        return {stops ? static_cast<float>(std::exp2(*stops)) : auto_exposure(image), tone, white};
    }
};
// --exposure STOPS, --tone CURVE, --white-balance KELVIN
void add_picture_options(CLI::App& app, PictureOptions& options);
// What a command makes of an image.
struct ImageOutput {
    std::string file;
    bool png = false, quiet = false;
    PictureOptions picture;

    // Writes the image, and what people are to look at if they want a picture, exposed as `exposed_by` is;
    // says so: `what` of the image beside its size.
    void write(const Image& image, const std::string& what, const Image& shown, const Image& exposed_by,
               const CommandContext& context) const;
};
// -o FILE.exr, of which `help` tells; --png, the options of pictures, and --quiet.
void add_image_output(CLI::App& app, ImageOutput& output, const std::string& help);

// Where an image's picture goes.
inline std::filesystem::path png_beside(std::filesystem::path image) {
    return image.replace_extension(".png");
}
// What is said of a picture that was written of an image: its exposure, and what it shows as white in the
// image's unit.
std::string picture_text(const std::filesystem::path& file, const PictureLook& look, const Image& of);

// --threads N
inline void add_threads(CLI::App& app, Workers& workers) {
    add_word(app, "--threads", "N", "number of threads (default: one per processor)",
             [&workers](const std::string& word) {
                 workers.threads = static_cast<int>(parse_whole({"--threads"}, word, 1, 1024));
             });
}

// --unit NAME: what a scene's light counts in, in the place of the scene's own Option "unit".
inline void add_unit_option(CLI::App& app, std::optional<FluxUnit>& unit) {
    add_word(app, "--unit", "NAME",
             "unit of all light in the scene: photometric (lm, cd/m²) or radiometric (W, W/(m² sr)); "
             "overrides the scene's Option \"unit\"",
             [&unit](const std::string& word) {
                 unit = unit_named(word);
                 if (!unit) {
                     throw InputError({"--unit"},
                                      fmt::format("\"{}\" is unknown; expected photometric or radiometric",
                                                  one_line(word)));
                 }
             });
}

// When a command is to be asked to stop, instead of being ended.

// While one lives, a signal asks the command to stop, and it keeps what there is. Reading is not under one:
// what was read is worth nothing yet, and reading asks nobody.
class Listening {
  public:
    explicit Listening(const Surroundings& around) : listening_(around.listening) {
        if (listening_) *listening_ = true;
    }
    ~Listening() {
        if (listening_) *listening_ = false;
    }
    Listening(const Listening&) = delete;
    Listening& operator=(const Listening&) = delete;

  private:
    std::atomic<bool>* listening_;
};

}  // namespace lucerna
