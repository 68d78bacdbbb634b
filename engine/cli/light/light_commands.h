// Functions that the subcommands of lucerna light share; most subcommands are in files light_NAME.cpp.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/system/files.h"
#include "lights/light_field.h"
#include "lights/lumigraph.h"
#include "lights/ray_set.h"

namespace lucerna {

// Options of every subcommand that makes a light field.
struct LampOutput {
    std::string file;
    Workers workers;
    bool quiet = false;
};

void add_lamp_output(CLI::App& app, LampOutput& output);
// Declares the light field and the table beside it as outputs.
void declare_lamp(const std::filesystem::path& file, std::string_view by, CommandFiles& files);
ConsoleSettings console_settings(const LampOutput& output, const CommandContext& context);

// Adds --views, --pixels and --distance, which determine the planes.
void add_planes(CLI::App& app, V2i& views, V2i& pixels, double& distance);

// Writes the field, or the slabs, and the lamp's table from which particles are sampled. Returns, and
// tabulates, the field as a reader of the file gets it, rounded to halves.
Lumigraph write_lamp(const Lumigraph& made, const std::filesystem::path& file, const Workers& workers,
                     Monitor& monitor);
// Writes the lamp and prints its description unless the output is quiet.
Lumigraph finish_lamp(const Lumigraph& made, const LampOutput& output, ConsoleMonitor& monitor,
                      const CommandContext& context);

// Runs `work` and adds the file's name to errors about its content, which lack the name.
template <typename Work>
auto naming(const std::string& file, Work&& work) {
    try {
        return work();
    } catch (const Stopped&) {
        throw;
    } catch (const InputError& error) {
        if (std::string_view(error.what()).find(file) != std::string_view::npos) throw;
        throw InputError({file}, error.what());
    }
}

// Parses a list like "5mm,20mm", each part by parse(part).
template <typename Parse>
auto parse_list(std::string_view word, Parse parse) {
    std::vector<std::invoke_result_t<Parse, std::string_view>> all;
    for (;;) {
        const std::size_t comma = word.find(',');
        all.push_back(parse(word.substr(0, comma)));
        if (comma == std::string_view::npos) return all;
        word.remove_prefix(comma + 1);
    }
}

// Each function adds its subcommand to `lucerna light`.
void add_light_import(CLI::App& light, const CommandContext& context);
void add_light_acquire(CLI::App& light, const CommandContext& context);
void add_light_edit(CLI::App& light, const CommandContext& context);
void add_light_emit(CLI::App& light, const CommandContext& context);
void add_light_assemble(CLI::App& light, const CommandContext& context);
void add_light_info(CLI::App& light, const CommandContext& context);
void add_light_project(CLI::App& light, const CommandContext& context);
void add_light_view(CLI::App& light, const CommandContext& context);
void add_light_farfield(CLI::App& light, const CommandContext& context);
void add_light_ugr(CLI::App& light, const CommandContext& context);

// Adds --efficacy, which states the luminous efficacy of a lamp in W [lm/W].
void add_efficacy(CLI::App& app, double& efficacy);

// The content of a lamp's file, whose type follows from the suffix.

using LampFile = std::variant<Lumigraph, RaySet>;

// Reads an .exr as a light field, or as several of one lamp, and other files as rays. Throws InputError
// naming file and cause.
inline LampFile read_lamp_file(const std::filesystem::path& file, Monitor& monitor) {
    if (suffix_of(file) == ".exr") return read_lumigraph(file);
    return read_rays(file, monitor);
}

inline FluxUnit unit_of(const LampFile& lamp) {
    if (const auto* field = std::get_if<Lumigraph>(&lamp)) return field->unit();
    return std::get<RaySet>(lamp).unit;
}

}  // namespace lucerna
