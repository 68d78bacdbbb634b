// lucerna light import: turns one or more ray files of one lamp into a light field.
#include <fmt/ostream.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/cli/command_files.h"
#include "engine/cli/light/lamp_text.h"
#include "engine/cli/light/light_commands.h"
#include "engine/colour/spectrum.h"
#include "engine/render/progress.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"
#include "lights/measurement/lumigraph_fit.h"
#include "lights/measurement/ray_bootstrap.h"
#include "lights/ray_set.h"

namespace lucerna {
namespace {

constexpr const char* kLightImportFooter =
    R"(Options that are not given are chosen from the rays. The light field is for a scene's
  LightSource "lightfield" "string filename" "lamp.exr"

The resolution of the field is limited by the number of rays: half of them make a field, and the other half measure the
error of the light that it casts, on planes from contact to the far field. The resolution and the smoothing with the
least error are used. A quarter of the rays has no part in this choice; the printed errors of the field of the whole file
are estimated from them, because an estimate by the rays that chose would be biased.

A light field holds light that leaves towards one side, +z. A lamp that also emits towards other sides gets several,
one for each of up to six sides of a box around it (slabs); all are in one file and form one lamp. Light is
divided among them by its direction, so none is counted twice; --slabs sets their number.

Several ray files in one frame, such as an LED package's red, green and blue, form one lamp; --drive sets the
factor for the flux of each file. The field of rays of several colours has several colours. Files in watts that are
combined with files in lumens are converted to lumens by their data on the light: a spectrum, wavelengths, or lumens as
well as watts. If a file does not have them, or they are wrong, give the light of each file with --colours (528nm, a single
wavelength; light.spd, a spectrum in a file; file, the file's own data), or its lumens per watt with --efficacy.

If the spectra of all rays are known, the light field keeps one to three spectra of which its light is a mixture, and the error
of that, for lucerna lux --colour.

--replicates 20 also writes lamp-replicate-01.exr to lamp-replicate-20.exr, from which lucerna lux --replicates computes the
measurement uncertainty of illuminance. Each is the field of as many rays, drawn from the file's rays with replacement
(bootstrap), with the flux that the file states; everything that is chosen for the lamp, such as slabs, resolution and
smoothing, is chosen anew for each. They scatter as imports of repeated measurements would, or somewhat more. A replicate
takes as much time as the lamp, and a file about as large. From N replicates the uncertainty is known to
± 1/sqrt(2 (N - 1)): 16 % for 20. What is the same in all replicates is not in it: the mean bias by resolution and
smoothing (the errors printed include it), and systematic errors of the goniophotometer, such as its calibration and
alignment.

Examples:
  lucerna light import lamp.tm25ray -o lamp.exr
  lucerna light import red.tm25ray green.tm25ray blue.tm25ray --drive 1,0.8,1.2 -o lamp.exr
  lucerna light import green.dat blue.dat --colours 528nm,457nm -o lamp.exr
  lucerna light import lamp.tm25ray -o lamp.exr --capture 99%
  lucerna light import lamp.tm25ray -o lamp.exr --views 16x16 --pixels 96x96
  lucerna light import lamp.dat -o lamp.exr --distance 40mm --height 0.5mm
  lucerna light import lamp.tm25ray -o lamp.exr --replicates 20)";

struct ImportOptions {
    std::vector<std::string> rays;
    std::vector<double> drives;        // one per file; none: all 1
    std::vector<std::string> colours;  // one per file, as 528nm, light.spd or file; none: as in the files
    std::vector<double> efficacies;    // one per file, lm/W; 0: as in the file; none: all as in the files
    LumigraphOptions lumigraph;
    LampOutput lamp;
    int replicates = 0;
    std::uint64_t seed = 0;  // of the replicates
};

// Parses "1,0.8,1.2".
std::vector<double> parse_numbers(const char* option, std::string_view word, double most) {
    return parse_list(word, [&](std::string_view part) { return parse_number({option}, part, 0, most); });
}

constexpr std::string_view kAsTheFileSays = "file";

bool is_wavelength(const std::string& word) {
    return word.ends_with("nm") && !word.ends_with(".nm") && word.find('/') == word.npos;
}
bool is_spectrum_file(const std::string& word) {
    return !is_wavelength(word) && word != kAsTheFileSays;
}

// Reads "528nm" or a spectrum's file, which must have visible light.
Spectrum parse_light(const std::string& word) {
    const Location at{"--colours"};
    if (is_wavelength(word)) {
        const double nanometres =
            parse_number(at, word.substr(0, word.size() - 2), kFirstVisible, kLastVisible);
        if (!(cie_xyz(nanometres).y > 0)) input_error(at, "\"{}\" is outside the visible range", word);
        return {{nanometres, 1}};
    }
    if (suffix_of(word) != ".spd")
        input_error(at,
                    "\"{}\" is not accepted; expected a wavelength such as 528nm, a spectrum such as "
                    "light.spd, or \"{}\"",
                    word, kAsTheFileSays);
    Spectrum spectrum = read_spd(word);
    if (spectrum.size() < 2 || !(xyz_per_watt(spectrum).y > 0))
        throw InputError({word}, "a spectrum without visible light; expected two or more samples");
    return spectrum;
}

// Applies the options for a file's light.
void state_light(const ImportOptions& options, std::size_t i, RaySet& set) {
    if (!options.colours.empty() && options.colours[i] != kAsTheFileSays)
        state_spectrum(set, parse_light(options.colours[i]));
    if (options.efficacies.empty() || !(options.efficacies[i] > 0)) return;
    if (set.unit != FluxUnit::watt) {
        input_error({"--efficacy"}, "the flux of {} is already in lumens; expected 0", options.rays[i]);
    }
    state_efficacy(set, options.efficacies[i]);
}

std::vector<DrivenRays> read_parts(const ImportOptions& options, Monitor& monitor) {
    std::vector<DrivenRays> parts;
    for (std::size_t i = 0; i < options.rays.size(); ++i) {
        parts.push_back({read_rays(options.rays[i], monitor), options.rays[i],
                         options.drives.empty() ? 1 : options.drives[i]});
        state_light(options, i, parts.back().set);
    }
    return parts;
}

// Returns the rays of a single file unchanged, or of all files as one lamp.
RaySet lamp_rays(std::vector<DrivenRays> parts, const ImportOptions& options) {
    if (parts.size() == 1 && options.drives.empty()) return std::move(parts[0].set);
    return join_rays(std::move(parts));
}

// Resamples the rays of each file.
RaySet replicate_rays(const std::vector<DrivenRays>& parts, BootstrapKey key, const ImportOptions& options) {
    std::vector<DrivenRays> drawn;
    for (key.part = 0; key.part < parts.size(); ++key.part) {
        const DrivenRays& part = parts[key.part];
        drawn.push_back({resampled(part.set, key, options.lamp.workers), part.name, part.drive});
    }
    return lamp_rays(std::move(drawn), options);
}

// Writes the replicates in order, each with all choices made anew, as for the lamp. `lamp` is the content of
// its file.
void write_replicates(const std::vector<DrivenRays>& parts, const Lumigraph& lamp,
                      const ImportOptions& options, Monitor& monitor) {
    const std::uint64_t hash = content_hash(lamp);
    const Workers& workers = options.lamp.workers;
    Phase phase(monitor, "making replicates", static_cast<std::uint64_t>(options.replicates));
    PassMonitor of_replicate(monitor);
    for (int b = 1; b <= options.replicates; ++b) {
        if (monitor.stopped()) {
            throw Stopped(
                fmt::format("interrupted: {} of {} replicates are written", b - 1, options.replicates));
        }
        // The hash makes lamps of one scene independent even with the same seed.
        const RaySet rays = replicate_rays(parts, {options.seed ^ hash, b, 0}, options);
        Lumigraph replicate = fit_lumigraph(rays, options.lumigraph, workers, of_replicate).lamp;
        for (Slab& slab : replicate.slabs()) {
            LightFieldInfo info = slab.field.info();
            info.replicate_of = hash;
            slab.field = std::move(slab.field).with(std::move(info));
        }
        write_lamp(replicate, replicate_file(options.lamp.file, b), workers, of_replicate);
        phase.advance(1);
    }
}

void act_import(const ImportOptions& options, const CommandContext& context) {
    const auto require_each = [&](const char* option, std::size_t count) {
        if (count == 0 || count == options.rays.size()) return;
        input_error({option}, "{} values for {} ray files; expected one for each file", count,
                    options.rays.size());
    };
    require_each("--drive", options.drives.size());
    require_each("--colours", options.colours.size());
    require_each("--efficacy", options.efficacies.size());
    if (options.lumigraph.fit.z && options.lumigraph.slabs > 1)
        throw InputError({"--height"}, "applies to one slab only; add --slabs 1");
    CommandFiles files;
    for (const std::string& word : options.colours) {
        if (word == kAsTheFileSays) continue;
        parse_light(word);  // checks the word before the rays are read
        if (is_spectrum_file(word)) files.reads(word);
    }
    for (const std::string& file : options.rays) {
        require_readable(file);
        files.reads(file);
    }
    declare_lamp(options.lamp.file, "-o", files);
    for (int b = 1; b <= options.replicates; ++b)
        declare_lamp(replicate_file(options.lamp.file, b), "--replicates", files);
    ConsoleMonitor monitor(context.out, context.err, console_settings(options.lamp, context));
    std::vector<DrivenRays> parts = read_parts(options, monitor);
    const LumigraphFit made = naming(fmt::format("{}", fmt::join(options.rays, " + ")), [&] {
        const RaySet rays = lamp_rays(options.replicates > 0 ? parts : std::move(parts), options);
        return fit_lumigraph(rays, options.lumigraph, options.lamp.workers, monitor);
    });
    const Lumigraph lamp = finish_lamp(made.lamp, options.lamp, monitor, context);
    if (!options.lamp.quiet) print_fit(context.out, made);
    if (options.replicates == 0) return;
    write_replicates(parts, lamp, options, monitor);
    if (options.lamp.quiet) return;
    fmt::print(context.out, "replicates           {} to {}\n", replicate_file(options.lamp.file, 1).string(),
               replicate_file(options.lamp.file, options.replicates).filename().string());
}

}  // namespace

void add_light_import(CLI::App& light, const CommandContext& context) {
    const auto options = std::make_shared<ImportOptions>();
    CLI::App& app = *light.add_subcommand("import", "Make a light field from a measured lamp's rays");
    app.footer(kLightImportFooter);
    app.add_option("RAYS", options->rays, fmt::format("ray files of one lamp: {}", kReadRayFormats))
        ->type_name("FILE")
        ->required();
    add_word(app, "--drive", "NUMBERS",
             "factor for the flux of each file, for example 1,0.8,1.2 (default 1 each)",
             [options](const std::string& word) { options->drives = parse_numbers("--drive", word, 1e6); });
    add_word(app, "--colours", "WORDS",
             "spectrum of each file's light: a wavelength such as 528nm, a spectrum file such as light.spd, "
             "or \"file\" (default)",
             [options](const std::string& word) {
                 options->colours = parse_list(word, [](std::string_view part) { return std::string(part); });
             });
    add_word(
        app, "--efficacy", "NUMBERS",
        "luminous efficacy of radiation of each file in watts, in lm/W; 0: as given in the file (default)",
        [options](const std::string& word) {
            options->efficacies = parse_numbers("--efficacy", word, kMostLumensPerWatt);
        });
    add_planes(app, options->lumigraph.fit.views, options->lumigraph.fit.pixels,
               options->lumigraph.fit.distance);
    add_word(app, "--capture", "SHARE",
             "share of the forward light that the planes should capture (default 99.3%)",
             [options](const std::string& word) {
                 options->lumigraph.fit.capture = parse_share({"--capture"}, word);
             });
    add_word(
        app, "--slabs", "N",
        "number of slabs: 1 (+z), 2 (+z, -z) or 6 (default: the smallest that captures 99% of the light)",
        [options](const std::string& word) {
            if (word != "1" && word != "2" && word != "6")
                input_error({"--slabs"}, "\"{}\" is not accepted; expected 1, 2 or 6", one_line(word));
            options->lumigraph.slabs = word[0] - '0';
        });
    add_word(
        app, "--height", "LENGTH",
        "height of the sampling plane in the rays' frame (default: the waist of the rays, in front of the "
        "lamp)",
        [options](const std::string& word) { options->lumigraph.fit.z = parse_place({"--height"}, word); });
    add_word(
        app, "--replicates", "N",
        "also write N bootstrap replicates beside the light field, for lucerna lux --replicates; 5 to 999, "
        "for example 20",
        [options](const std::string& word) {
            options->replicates =
                static_cast<int>(parse_whole({"--replicates"}, word, kLeastReplicates, kMostReplicates));
        });
    add_word(app, "--seed", "N", "seed of the random numbers of --replicates (default 0)",
             [options](const std::string& word) { options->seed = parse_seed({"--seed"}, word); });
    add_lamp_output(app, options->lamp);
    app.callback([options, &context] { act_import(*options, context); });
}

}  // namespace lucerna
