// The subcommands: each adds its options, help and action to the command line. One file each.
#pragma once

#include <ostream>

#include "engine/cli/run.h"

namespace CLI {
class App;
}

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
void add_compare_command(CLI::App& program, const CommandContext& context);
void add_study_command(CLI::App& program, const CommandContext& context);
void add_info_command(CLI::App& program, const CommandContext& context);

}  // namespace lucerna
