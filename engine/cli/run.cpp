#include "engine/cli/run.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/base/version.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/manual.h"
#include "engine/cli/parallel_job.h"
#include "engine/scene/arithmetic.h"
#include "engine/text/plain_text.h"
#include "engine/text/spelling.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr int kDone = 0;
constexpr int kBadInput = 1;
constexpr int kOurFault = 2;
constexpr int kStopped = 128;  // plus the signal's number, as in shells

constexpr const char* kRunFooter = R"(Examples:
  lucerna render scenes/room/room.pbrt -o room.exr --png
  lucerna light import lamp.tm25ray -o lamp.exr
  lucerna import model.glb -o model.pbrt
  lucerna compare room.exr reference.exr
  lucerna lux room.pbrt --height 0.75 -o lux.csv
  lucerna falsecolour lux.exr -o lux.png --isolines
  lucerna study direct.toml -o out/direct
  lucerna info --integrators

For the options of a command: lucerna render --help)";

int fail(std::ostream& err, int code, std::string_view message, std::string_view who = "lucerna") {
    fmt::print(err, "{}: {}\n", who, plain_text(one_line(message)));
    return code;
}

std::vector<std::string> command_names(const CLI::App& program) {
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(command->get_name());
    return names;
}

// Tells whether a first word is no command, which CLI11 would only call unexpected.
bool is_unknown_command(const CLI::App& program, std::string_view word) {
    if (word.starts_with('-')) return false;
    const std::vector<std::string> names = command_names(program);
    return std::find(names.begin(), names.end(), word) == names.end();
}

// Returns a message on the first word that looks like an option but is none of the command's; empty if there
// is none.
std::string unknown_option(const CLI::App& app) {
    const std::vector<std::string> rest = app.remaining();
    const auto found = std::ranges::find_if(rest, [](const std::string& w) { return w.starts_with("--"); });
    if (found == rest.end()) return {};
    const std::string name = found->substr(0, found->find('='));
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        for (const std::string& known : option->get_lnames()) names.push_back("--" + known);
    }
    const std::vector<std::string_view> known(names.begin(), names.end());
    return fmt::format("unknown option {}; {}", name, did_you_mean(name, known));
}

// Reports CLI11's error in one line, with a hint at the command's help.
int fail_parsing(std::ostream& err, const CLI::App& program, const CLI::ParseError& error) {
    std::string command = "lucerna";
    const CLI::App* app = &program;
    while (!app->get_subcommands().empty()) {
        app = app->get_subcommands().front();
        command += " " + app->get_name();
    }
    // Uses the exit code, because the error's name is that of the command.
    const bool extras = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
    std::string what = extras ? unknown_option(*app) : std::string();
    if (what.empty()) what = one_line(error.what()) + "; ";
    return fail(err, kBadInput, fmt::format("{}see {} --help", what, command));
}

// Reports a full disk or a closed pipe as failure.
int written(std::ostream& out, std::ostream& err) {
    return out.flush() ? kDone : fail(err, kBadInput, "standard output: cannot be written");
}

// Adds a flag that prints text(program) and ends the parsing.
void add_text_flag(CLI::App& program, const std::string& name, const std::string& help,
                   std::string (*text)(const CLI::App&), std::ostream& out) {
    program
        .add_flag_callback(
            name,
            [&program, text, &out] {
                out << text(program);
                throw CLI::Success();
            },
            help)
        ->trigger_on_parse();
}

int parse_and_act(CLI::App& program, int argc, const char* const* argv, std::ostream& out,
                  std::ostream& err) {
    try {
        program.parse(argc, argv);
        return written(out, err);
    } catch (const CLI::Success& success) {  // --help, --version
        program.exit(success, out, err);
        return written(out, err);
    } catch (const CLI::ParseError& error) {
        if (rank_by_launcher() > 0) leave_it_to_rank_0();
        return fail_parsing(err, program, error);
    }
}

}  // namespace

int run(int argc, const char* const* argv, std::ostream& all_out, std::ostream& err,
        const ProcessContext& process) {
    PlainStream out(all_out);
    try {
        const std::span<const char* const> words(argv + std::min(argc, 1), argv + argc);
        if (!has_work_here(words)) return kDone;
        CLI::App program("Lucerna renders scenes lit by measured lamps, with photons.", "lucerna");
        program.footer(kRunFooter);
        program.set_version_flag("--version", fmt::format("lucerna {}\n{}", program_version(), arithmetic()));
        add_text_flag(program, "--manual", "Print the manual page (for man -l -) and exit", manual_page, out);
        add_text_flag(program, "--reference", "Print the reference of all commands in Markdown and exit",
                      reference_page, out);
        add_text_flag(program, "--bash-completion", "Print the bash completion script and exit",
                      bash_completion, out);
        program.require_subcommand(0, 1);
        const CommandContext context{out, err, process};
        add_render_command(program, context);
        add_light_command(program, context);
        add_import_command(program, context);
        add_denoise_command(program, context);
        add_relight_command(program, context);
        add_merge_command(program, context);
        add_compare_command(program, context);
        add_falsecolour_command(program, context);
        add_study_command(program, context);
        add_lux_command(program, context);
        add_glare_command(program, context);
        add_info_command(program, context);
        if (argc < 2) {
            out << program.help();
            return fail(err, kBadInput,
                        fmt::format("a command is missing: {}", fmt::join(command_names(program), ", ")));
        }
        if (is_unknown_command(program, argv[1])) {
            const std::vector<std::string> names = command_names(program);
            const std::vector<std::string_view> known(names.begin(), names.end());
            return fail(err, kBadInput,
                        fmt::format("unknown command \"{}\"; {}known are {}", argv[1],
                                    did_you_mean(argv[1], known), fmt::join(known, ", ")));
        }
        say_if_alone(words, err);
        return parse_and_act(program, argc, argv, out, err);
    } catch (...) {
        if (rank_by_launcher() > 0) leave_it_to_rank_0();
        return report_error(err, process);
    }
}

int report_error(std::ostream& err, const ProcessContext& process, std::string_view who) {
    try {
        throw;
    } catch (const Stopped& stopped) {
        return fail(err, kStopped + (process.stop ? process.stop->load() : 0), stopped.what(), who);
    } catch (const InputError& error) {
        return fail(err, kBadInput, error.what(), who);
    } catch (const std::filesystem::filesystem_error& error) {
        return fail(err, kBadInput, error.what(), who);
    } catch (const std::bad_alloc&) {
        return fail(err, kBadInput, "not enough memory; use fewer photons, a smaller image or a smaller lamp",
                    who);
    } catch (const std::exception& error) {
        return fail(err, kOurFault,
                    fmt::format("internal error; please report it with the command line: {}", error.what()),
                    who);
    }
}

}  // namespace lucerna
