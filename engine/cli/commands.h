// The subcommands: each adds its options, help and action to the command line, from a file of its own.
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

#include "engine/base/elementary.h"
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

// The streams and process of a command. It outlives the parsing, in which the actions run.
struct CommandContext {
    std::ostream& out;
    std::ostream& err;
    const ProcessContext& process;
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

// Options that are parsed by units.h, so that all errors have the same form.

// Adds option `name`; `take` gets the word and throws InputError if it is invalid.
template <typename Take>
CLI::Option* add_word(CLI::App& app, const std::string& name, const std::string& type,
                      const std::string& help, Take take) {
    return app
        .add_option_function<std::string>(
            name, [take](const std::string& word) { take(word); }, help)
        ->type_name(type);
}

// The look of a command's pictures according to its options.
struct PictureOptions {
    std::optional<double> stops;  // none: auto_exposure() of the image
    ToneCurve tone = ToneCurve::neutral;
    std::optional<double> white;  // kelvins

    PictureLook look(const Image& image) const {
        return {stops ? static_cast<float>(exp2(*stops)) : auto_exposure(image), tone, white};
    }
};
// Adds --exposure STOPS, --tone CURVE and --white-balance KELVIN.
void add_picture_options(CLI::App& app, PictureOptions& options);
// The output of a command that makes an image.
struct ImageOutput {
    std::string file;
    bool png = false, quiet = false;
    PictureOptions picture;

    // Writes the image and, if requested, its picture, which is `shown` at the exposure of `exposed_by`.
    // Prints a line with the image's size and the description `what`.
    void write(const Image& image, const std::string& what, const Image& shown, const Image& exposed_by,
               const CommandContext& context) const;
};
// Adds -o FILE.exr with this `help`, --png, the picture options and --quiet.
void add_image_output(CLI::App& app, ImageOutput& output, const std::string& help);

// Returns the file of an image's picture.
inline std::filesystem::path png_beside(std::filesystem::path image) {
    return image.replace_extension(".png");
}
// Returns a line on a picture of an image: its exposure and its white in the image's unit.
std::string picture_text(const std::filesystem::path& file, const PictureLook& look, const Image& of);

// Adds --threads N.
inline void add_threads(CLI::App& app, Workers& workers) {
    add_word(app, "--threads", "N", "number of threads (default: one per processor)",
             [&workers](const std::string& word) {
                 workers.threads = static_cast<int>(parse_whole({"--threads"}, word, 1, 1024));
             });
}

// Adds --unit NAME, the unit of a scene's light, which overrides the scene's Option "unit".
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

// The class below decides when a signal asks a command to stop instead of ending it.

// While an object lives, a signal asks the command to stop and keep its results. It does not cover reading,
// which has no results to keep and does not poll for a stop.
class StopOnSignals {
  public:
    explicit StopOnSignals(const ProcessContext& process) : listening_(process.listening) {
        if (listening_) *listening_ = true;
    }
    ~StopOnSignals() {
        if (listening_) *listening_ = false;
    }
    StopOnSignals(const StopOnSignals&) = delete;
    StopOnSignals& operator=(const StopOnSignals&) = delete;

  private:
    std::atomic<bool>* listening_;
};

}  // namespace lucerna
