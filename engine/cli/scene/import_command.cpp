// lucerna import: converts a model of another format to a scene.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <array>
#include <memory>
#include <optional>

#include "engine/base/error.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/model/write_pbrt.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr const char* kImportFooter =
    R"(The scene is a text file to edit further: it names a camera, materials, lights and shapes; the meshes (.ply) and embedded
pictures are in a folder beside it, room-parts for room.pbrt. A model without a camera gets one that shows all of it,
a model without lights gets a sky and a sun.

Conversion: metals become conductors of the base colour; everything else becomes coated diffuse, or glass if it
transmits: a thin pane, unless KHR_materials_volume gives it a thickness. Emissive surfaces become area lights;
KHR_lights_punctual become point, spot and distant lights, EXT_lights_ies lights of photometric files. Animations, skins,
points and lines are left out, with a warning, and so is what extensions say that are not read.

An OBJ file states neither its unit nor its axes: give them by --unit and --up. Kd and map_Kd become the diffuse
reflectance, under a coat if Ks is not black; a material of which d is at most 0.5 becomes a pane, and Ke an area light
of as many cd/m². What else is read is in docs/reference/scene-files.md.

Examples:
  lucerna import model.glb -o model.pbrt
  lucerna import room.obj --unit mm --up z -o room.pbrt
  lucerna import room.gltf -o scenes/mine/room.pbrt
  lucerna render model.pbrt --spp 16 --png)";

struct ImportCommand {
    std::string model, output;
    std::optional<std::string> unit, up;  // of an OBJ file
    bool overwrite = false;
    bool quiet = false;
};

// Returns the metres of a unit of length.
double unit_of(const std::string& word) {
    constexpr std::array<std::pair<std::string_view, double>, 5> kUnits{
        {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}, {"in", 0.0254}, {"ft", 0.3048}}};
    for (const auto& [name, metres] : kUnits) {
        if (word == name) return metres;
    }
    try {
        return parse_number({"--unit"}, word, 1e-6, 1e6);
    } catch (const InputError&) {
        input_error(
            {"--unit"},
            "\"{}\" is not accepted; expected mm, cm, m, in, ft, or metres as a number from 1e-06 to 1e+06",
            one_line(word));
    }
}

Model read_model(const ImportCommand& command, Monitor& monitor) {
    if (suffix_of(command.model) != ".obj") return read_gltf(command.model, monitor);
    return read_obj(command.model, {unit_of(command.unit.value_or("m")), command.up == "z"}, monitor);
}

// Refuses to overwrite files unless the user allows it, because a scene is text that people edit.
void check(const ImportCommand& command, CommandFiles& files) {
    require_readable(command.model);
    const std::string suffix = suffix_of(command.model);
    if (suffix != ".gltf" && suffix != ".glb" && suffix != ".obj") {
        input_error({command.model}, "\"{}\" is not accepted; expected .gltf, .glb or .obj", suffix);
    }
    if (suffix != ".obj" && (command.unit || command.up)) {
        input_error({command.model}, "{} is for OBJ files; in glTF lengths are metres and y is up",
                    command.unit ? "--unit" : "--up");
    }
    if (command.up && command.up != "y" && command.up != "z")
        input_error({"--up"}, "\"{}\" is not accepted; expected y or z", one_line(*command.up));
    files.reads(command.model);
    files.writes(command.output, ".pbrt", "-o");
    files.writes_into(parts_folder(command.output), "-o", is_part_name);
    if (command.overwrite) return;
    for (const std::filesystem::path& there :
         {std::filesystem::path(command.output), parts_folder(command.output)}) {
        if (std::filesystem::exists(there)) {
            input_error({there.string()}, "already exists; use --overwrite to replace it");
        }
    }
}

void act(const ImportCommand& command, const CommandContext& context) {
    CommandFiles files;
    check(command, files);
    ConsoleMonitor monitor(context.out, context.err,
                           {context.process.terminal, command.quiet, context.process.stop, {}});
    const Model model = read_model(command, monitor);
    files.reads(model.files);
    const WrittenScene made =
        write_pbrt(model, command.output, std::filesystem::path(command.model).filename().string(), monitor);
    if (command.quiet) return;
    for (const std::string& note : made.notes) fmt::print(context.out, "note     {}\n", note);
    fmt::print(context.out, "scene    {} ({} shapes, {} triangles, {} materials, {} lights)\n",
               command.output, made.shapes, made.triangles, made.materials, made.lights);
    fmt::print(context.out, "parts    {} ({} files)\n", parts_folder(command.output).string(),
               made.files - 1);
}

}  // namespace

void add_import_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<ImportCommand>();
    CLI::App& app =
        *program.add_subcommand("import", "Convert a glTF 2.0 or OBJ model (.gltf, .glb, .obj) into a scene");
    app.footer(kImportFooter);
    app.add_option("MODEL", command->model, "glTF 2.0 model, .gltf or .glb, or Wavefront OBJ, .obj")
        ->required()
        ->type_name("FILE");
    app.add_option("-o,--output", command->output, "the scene")->type_name("SCENE.pbrt")->required();
    app.add_option("--unit", command->unit,
                   "the unit of an OBJ file: mm, cm, m, in, ft, or its metres as a number (default m)")
        ->type_name("UNIT");
    app.add_option("--up", command->up, "the axis of an OBJ file that points up, y or z (default y)")
        ->type_name("AXIS");
    app.add_flag("--overwrite", command->overwrite, "replace an existing scene and its parts folder");
    app.add_flag("--quiet", command->quiet, "print warnings and errors only");
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
