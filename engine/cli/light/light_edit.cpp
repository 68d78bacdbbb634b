// lucerna light edit: turns, moves, mirrors, dims and cuts lamps, and adds them to one lamp.
#include <fmt/ostream.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "engine/base/error.h"
#include "engine/cli/command_files.h"
#include "engine/cli/light/lamp_text.h"
#include "engine/cli/light/light_commands.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"
#include "lights/lamp_edit.h"
#include "lights/measurement/join_sides.h"

namespace lucerna {
namespace {

constexpr const char* kEditFooter =
    R"(Options that follow a lamp are edits of that lamp alone, and they are applied in the order in which they stand: a lamp
that is moved away from the origin and then turned goes around the origin. The edited lamps are added. One lamp may be
given several times.

Light fields (.exr) are not fitted again: a turn or a move changes the place of their planes S and M, a mirror mirrors both
planes, and the sum is the list of the slabs of all lamps, at most 64. Ray files make a ray file, in which every ray is
edited. Lamps in watts stay in watts if they have the same luminous efficacy; otherwise they become lumens.

--sides keeps the light that leaves towards these sides of the lamp, before the edits that follow: of a light field the
slabs that face them, of a ray file the rays that leave closest to them.

Examples:
  lucerna light edit lamp.exr --turn x,180 --move 0,0,2.5m -o hanging.exr
  lucerna light edit left.exr left.exr --mirror x -o pair.exr
  lucerna light edit bulb.exr --sides +z,+x,-x,+y,-y -o shielded.exr
  lucerna light edit cold.exr --dim 0.3 warm.exr --dim 0.7 -o tuned.exr
  lucerna light edit led.exr --move 20mm,0,0 led.exr --move 20mm,0,0 --turn z,120 led.exr --move 20mm,0,0 --turn z,240 -o ring.exr
  lucerna light edit led.tm25ray --turn y,30 -o turned.tm25ray)";

// One edit, as a function of a light field or a ray set.
using Edit = std::function<LampFile(LampFile)>;

struct EditedLamp {
    std::string file;
    std::vector<Edit> edits;
    std::string text;  // the edits as the command line has them
};

struct EditCommand {
    std::vector<std::string> files;  // words of the command line, from which take_in_order() makes the lamps
    std::vector<EditedLamp> lamps;
    std::string output;
    Workers workers;
    bool quiet = false;
};

template <typename Change>
Edit edit_by(Change change) {
    return [change](LampFile lamp) {
        return std::visit([&](auto& of) -> LampFile { return change(std::move(of)); }, lamp);
    };
}
Edit place_by(const LampPlacement& place) {
    return edit_by([place](auto lamp) { return placed(std::move(lamp), place); });
}

int parse_axis(const char* option, std::string_view word) {
    if (word.size() == 1 && word[0] >= 'x' && word[0] <= 'z') return word[0] - 'x';
    input_error({option}, "\"{}\" is not accepted as an axis; expected x, y or z", one_line(word));
}

Edit parse_turn(const std::string& word) {
    const std::size_t comma = word.find(',');
    if (comma == std::string::npos)
        input_error({"--turn"}, "\"{}\" is not accepted; expected AXIS,DEGREES, such as z,90",
                    one_line(word));
    const int axis = parse_axis("--turn", std::string_view(word).substr(0, comma));
    return place_by(LampPlacement::turn(axis, parse_number({"--turn"}, word.substr(comma + 1), -360, 360)));
}

Edit parse_move(const std::string& word) {
    const std::vector<double> by =
        parse_list(word, [](std::string_view part) { return parse_place({"--move"}, part); });
    if (by.size() != 3)
        input_error({"--move"}, "\"{}\" is not accepted; expected X,Y,Z, such as 20mm,0,-5mm",
                    one_line(word));
    return place_by(LampPlacement::move({by[0], by[1], by[2]}));
}

Edit parse_mirror(const std::string& word) {
    return place_by(LampPlacement::mirror(parse_axis("--mirror", word)));
}

Edit parse_dim(const std::string& word) {
    const double factor = parse_number({"--dim"}, word, 1e-6, 1e6);
    return edit_by([factor](auto lamp) { return dimmed(std::move(lamp), factor); });
}

Edit parse_cut(const std::string& word) {
    const std::vector<SlabAxes> sides =
        parse_list(word, [](std::string_view part) { return parse_side("--sides", part); });
    require_different_sides("--sides", sides);
    return edit_by([sides](auto lamp) { return cut_to_sides(std::move(lamp), sides); });
}

double flux_of(const LampFile& lamp) {
    if (const auto* field = std::get_if<Lumigraph>(&lamp)) return field->flux();
    return std::get<RaySet>(lamp).flux;
}

// Writes into the lamp where it comes from. An edited lamp is no replicate of the file that the original is a
// replicate of.
void note_edits(LampFile& lamp, const EditedLamp& edited, const std::string& place) {
    const auto noted = [&](const std::string& before) {
        return fmt::format("{}{}{}{}", place, before, edited.text.empty() ? "" : "; edited:", edited.text);
    };
    if (auto* rays = std::get_if<RaySet>(&lamp)) {
        rays->provenance = noted(rays->provenance);
        rays->text = noted(rays->text);
        return;
    }
    for (Slab& slab : std::get<Lumigraph>(lamp).slabs()) {
        LightFieldInfo info = slab.field.info();
        info.provenance = noted(info.provenance);
        info.replicate_of = 0;
        slab.field = std::move(slab.field).with(std::move(info));
    }
}

// Reads each file once and edits it for each of its uses. `lines` gets the account of each lamp's flux.
std::vector<LampFile> edited_lamps(const EditCommand& command, Monitor& monitor,
                                   std::vector<std::string>& lines) {
    std::map<std::string, LampFile> originals;
    std::vector<LampFile> lamps;
    for (const EditedLamp& edited : command.lamps) {
        if (!originals.contains(edited.file))
            originals.emplace(edited.file, read_lamp_file(edited.file, monitor));
        LampFile lamp = originals.at(edited.file);
        const double before = flux_of(lamp);
        const std::string unit(flux_unit_name(unit_of(lamp)));
        lamp = naming(edited.file, [&] {
            for (const Edit& edit : edited.edits) lamp = edit(std::move(lamp));
            return std::move(lamp);
        });
        const std::size_t number = lamps.size() + 1, count = command.lamps.size();
        note_edits(lamp, edited, count > 1 ? fmt::format("lamp {} of {}: ", number, count) : "");
        lines.push_back(fmt::format("{:<21}{}{}: {:.6g} {} of {:.6g} {}\n", fmt::format("lamp {}", number),
                                    edited.file, edited.text, flux_of(lamp), unit, before, unit));
        lamps.push_back(std::move(lamp));
    }
    return lamps;
}

template <typename Kind>
std::vector<Kind> all_of(std::vector<LampFile> lamps) {
    std::vector<Kind> all;
    for (LampFile& lamp : lamps) all.push_back(std::get<Kind>(std::move(lamp)));
    return all;
}

// A lamp's kind follows from the names of the files, so that mistakes are found before the files are read.
bool makes_rays(const EditCommand& command) {
    const bool rays = suffix_of(command.output) != ".exr";
    if (rays && !has_ray_suffix(command.output)) {
        input_error({command.output},
                    "\"{}\" is not accepted; expected .exr for light fields, or {} for rays",
                    suffix_of(command.output), kRaySuffixes);
    }
    for (const EditedLamp& lamp : command.lamps) {
        if ((suffix_of(lamp.file) != ".exr") == rays) continue;
        if (rays) {
            input_error({lamp.file},
                        "a light field cannot become the ray file {}; write .exr, or use lucerna "
                        "light emit",
                        command.output);
        }
        input_error({lamp.file},
                    "rays cannot become the light field {}; make a light field of them first, with "
                    "lucerna light import",
                    command.output);
    }
    return rays;
}

RaySet join_edited(const EditCommand& command, std::vector<RaySet> sets) {
    if (sets.size() == 1) return std::move(sets[0]);
    std::vector<DrivenRays> parts;
    for (std::size_t i = 0; i < sets.size(); ++i)
        parts.push_back({std::move(sets[i]), command.lamps[i].file, 1});
    RaySet joined = join_rays(std::move(parts));
    joined.text = joined.provenance;
    return joined;
}

void act_edit(const EditCommand& command, const CommandContext& context) {
    const bool rays = makes_rays(command);
    CommandFiles files;
    std::vector<std::string> names;
    for (const EditedLamp& lamp : command.lamps) {
        require_readable(lamp.file);
        files.reads(lamp.file);
        names.push_back(lamp.file);
    }
    if (rays)
        files.writes(command.output, "", "-o");
    else
        declare_lamp(command.output, "-o", files);
    const LampOutput output{command.output, command.workers, command.quiet};
    ConsoleMonitor monitor(context.out, context.err, console_settings(output, context));
    std::vector<std::string> lines;
    std::vector<LampFile> lamps = edited_lamps(command, monitor, lines);
    if (rays) {
        const RaySet sum = join_edited(command, all_of<RaySet>(std::move(lamps)));
        write_rays(command.output, sum);
        if (!command.quiet) print_ray_set(context.out, sum);
    } else {
        finish_lamp(added(all_of<Lumigraph>(std::move(lamps)), names), output, monitor, context);
    }
    if (command.quiet) return;
    for (const std::string& line : lines) fmt::print(context.out, "{}", line);
}

struct EditOption {
    const char* name;
    const char* type;
    const char* help;
    Edit (*parse)(const std::string& word);
};
constexpr EditOption kEdits[] = {
    {"--turn", "AXIS,DEGREES",
     "turn the lamp around an axis through the origin, for example z,60: anticlockwise, seen from the tip of "
     "the axis",
     parse_turn},
    {"--move", "X,Y,Z", "move the lamp, for example 20mm,0,-5mm", parse_move},
    {"--mirror", "AXIS", "mirror the lamp: change the sign of this coordinate, x, y or z", parse_mirror},
    {"--dim", "FACTOR", "multiply the flux by this factor", parse_dim},
    {"--sides", "AXIS,...", "keep only the light towards these sides, for example +z,-x", parse_cut},
};

// Assigns the edits to the lamps after which they stand.
void take_in_order(const CLI::App& app, EditCommand& command) {
    std::map<const CLI::Option*, std::size_t> taken;
    for (const CLI::Option* option : app.parse_order()) {
        const std::string name = option->get_name();
        const std::size_t number = taken[option]++;
        if (name == "LAMP") command.lamps.push_back({option->results().at(number), {}, {}});
        for (const EditOption& edit : kEdits) {
            if (name != edit.name) continue;
            const std::string& word = option->results().at(number);
            if (command.lamps.empty()) {
                input_error({name},
                            "\"{}\" stands before the first lamp; expected the option after the lamp "
                            "that it edits",
                            one_line(word));
            }
            command.lamps.back().edits.push_back(edit.parse(word));
            command.lamps.back().text += fmt::format(" {} {}", name, word);
        }
    }
}

}  // namespace

void add_light_edit(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<EditCommand>();
    CLI::App& app = *light.add_subcommand("edit", "Turn, move, mirror, dim and cut lamps, and add them");
    app.footer(kEditFooter);
    app.add_option("LAMP", command->files, "light fields (.exr) or ray files, each followed by its edits")
        ->type_name("FILE")
        ->required();
    for (const EditOption& edit : kEdits) {
        app.add_option_function<std::vector<std::string>>(
               edit.name, [](const std::vector<std::string>&) {}, edit.help)
            ->type_name(edit.type)
            ->expected(1)
            ->allow_extra_args(false)
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    }
    app.add_option("-o,--output", command->output,
                   fmt::format("the lamp: a light field (.exr), or of ray files {}", kRaySuffixes))
        ->type_name("FILE")
        ->required();
    add_threads(app, command->workers);
    app.add_flag("--quiet", command->quiet, "print warnings and errors only");
    app.callback([command, &context, &app] {
        take_in_order(app, *command);
        act_edit(*command, context);
    });
}

}  // namespace lucerna
