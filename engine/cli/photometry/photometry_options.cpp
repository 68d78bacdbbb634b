#include "engine/cli/photometry/photometry_options.h"

#include "engine/system/files.h"
#include "engine/text/units.h"

namespace lucerna {

void PhotometryOptions::declare(CommandFiles& files) const {
    require_readable(scene);
    files.reads(scene);
    if (!csv.empty()) files.writes(csv, "", "-o");
    if (!json.empty() && !prints_json()) files.writes(json, "", "--json");
}

Job PhotometryOptions::read(const Workers& workers, CommandFiles& files, Monitor& monitor) const {
    SceneOverrides in_srgb = overrides;
    in_srgb.colours = WorkingSpace();
    Job job = read_scene(scene, in_srgb, workers, monitor);
    files.reads(job.files);
    return job;
}

void add_photometry_files(CLI::App& app, PhotometryOptions& options, const std::string& each,
                          const std::string& everything) {
    app.add_option("SCENE", options.scene, "scene file in pbrt's text format")
        ->required()
        ->type_name("SCENE.pbrt");
    app.add_option("-o,--output", options.csv, "write a line for each " + each)->type_name("FILE.csv");
    app.add_option("--json", options.json, "write " + everything + " as JSON; - for standard output")
        ->type_name("FILE");
}

void add_photometry_options(CLI::App& app, PhotometryOptions& options, std::uint64_t& seed,
                            Workers& workers) {
    add_word(app, "--seed", "N", "seed of the random numbers (default 0)",
             [&seed](const std::string& word) { seed = parse_seed({"--seed"}, word); });
    add_threads(app, workers);
    add_unit_option(app, options.overrides.unit);
    app.add_flag("--skip-missing", options.overrides.skip_missing,
                 "leave out meshes and textures whose file does not exist, with a warning");
    app.add_flag(
        "--strict", options.overrides.strict,
        "stop with an error, instead of a warning, if part of the scene cannot be rendered as specified");
    app.add_flag("--quiet", options.quiet, "print results, warnings and errors only");
}

}  // namespace lucerna
