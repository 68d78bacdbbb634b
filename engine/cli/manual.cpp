#include "engine/cli/manual.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>
#include <vector>

#include "engine/base/version.h"
#include "engine/cli/integrators_text.h"
#include "engine/figures/markup.h"

namespace lucerna {
namespace {

// Escapes text for man(7): every minus can be copied, and no line is a request.
std::string roff(std::string_view text) {
    std::string escaped;
    if (text.starts_with('.') || text.starts_with('\'')) escaped = "\\&";
    for (const char c : text) {
        switch (c) {
            case '\\':
                escaped += "\\e";
                break;
            case '-':
                escaped += "\\-";
                break;
            case '\'':
                escaped += "\\(aq";
                break;
            case '`':
                escaped += "\\(ga";
                break;
            case '^':
                escaped += "\\(ha";
                break;
            case '~':
                escaped += "\\(ti";
                break;
            default:
                escaped += c;
        }
    }
    return escaped;
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
    return app.get_subcommands([](const CLI::App*) { return true; });
}

// Returns a name like "lucerna light import".
std::string full_name(const CLI::App& app) {
    const CLI::App* parent = app.get_parent();
    return parent ? full_name(*parent) + " " + app.get_name() : app.get_name();
}

// Returns "LAMP [RIG] RAYS...", with a blank before each.
std::string positionals_text(const CLI::App& app) {
    std::string text;
    for (const CLI::Option* option : app.get_options()) {
        if (!option->get_positional()) continue;
        const std::string name = option->get_name(true) + (option->get_items_expected_max() > 1 ? "..." : "");
        text += option->get_required() ? " " + name : " [" + name + "]";
    }
    return text;
}

std::vector<std::string> names_of(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    return names;
}

bool takes_value(const CLI::Option& option) {
    return option.get_items_expected_max() > 0;
}

// Returns "-o, --output FILE.exr (required)", with names in bold and the value in italics.
std::string option_heading(const CLI::Option& option) {
    std::string heading;
    if (option.get_positional()) {
        heading = "\\fI" + roff(option.get_name(true)) + "\\fR";
    } else {
        for (const std::string& name : names_of(option))
            heading += (heading.empty() ? "\\fB" : ", \\fB") + roff(name) + "\\fR";
        if (takes_value(option)) heading += " \\fI" + roff(option.get_type_name()) + "\\fR";
    }
    if (option.get_required() && !option.get_positional()) heading += " (required)";
    return heading;
}

void append_option(const CLI::Option& option, std::string& page) {
    page += ".TP\n" + option_heading(option) + "\n" + roff(option.get_description()) + "\n";
    std::string others;
    for (const CLI::Option* other : option.get_excludes())
        others += (others.empty() ? "" : ", ") + other->get_name();
    if (!others.empty()) page += roff(fmt::format("(not together with {})", others)) + "\n";
}

// Appends a command's text below its options; indented lines stay separate, the others are filled.
void append_text(const std::string& text, std::string& page) {
    std::istringstream lines(text);
    bool as_it_is = false;
    page += ".PP\n";
    for (std::string line; std::getline(lines, line);) {
        const bool indented = line.starts_with(' ');
        if (indented != as_it_is) page += indented ? ".nf\n" : ".fi\n";
        as_it_is = indented;
        page += line.empty() ? std::string(".PP") : roff(line);
        page += '\n';
    }
    if (as_it_is) page += ".fi\n";
}

void append_commands(const CLI::App& app, std::string& page) {
    for (const CLI::App* command : commands_of(app)) {
        page += fmt::format(".SS {}\n{}.\n", roff(full_name(*command)), roff(command->get_description()));
        page += fmt::format(".PP\n\\fB{}\\fR {}{}\n", roff(full_name(*command)),
                            commands_of(*command).empty() ? "[OPTIONS]" : "COMMAND",
                            roff(positionals_text(*command)));
        for (const CLI::Option* option : command->get_options()) {
            if (option->get_positional()) append_option(*option, page);
        }
        for (const CLI::Option* option : command->get_options()) {
            if (!option->get_positional()) append_option(*option, page);
        }
        append_text(command->get_footer(), page);
        append_commands(*command, page);
    }
}

constexpr const char* kExitStatus = R"(.SH EXIT STATUS
.TP
0
Success.
.TP
1
An error in an input or in the environment; one line on standard error states where it is, the cause and what was
expected.
.TP
2
An internal error.
.TP
128 + N
Interrupted by signal N; the results so far have been written: 130 after Ctrl\-C.
)";

}  // namespace

std::string manual_page(const CLI::App& program) {
    std::string what = program.get_description();  // "Lucerna renders …."
    if (what.starts_with("Lucerna ")) what.erase(0, what.find(' ') + 1);
    if (what.ends_with('.')) what.pop_back();
    std::string page =
        fmt::format(".TH LUCERNA 1 \"\" \"lucerna {}\" \"User Commands\"\n", roff(program_version()));
    page += fmt::format(".SH NAME\nlucerna \\- {}\n", roff(what));
    page += ".SH SYNOPSIS\n\\fBlucerna\\fR \\fICOMMAND\\fR [OPTIONS] ...\n";
    page += ".SH DESCRIPTION\n" + roff(program.get_description()) + "\n";
    append_text(program.get_footer(), page);
    page += ".SH OPTIONS\n";
    for (const CLI::Option* option : program.get_options()) append_option(*option, page);
    page += ".SH COMMANDS\n";
    append_commands(program, page);
    return page + kExitStatus;
}

// ---- The reference page.

namespace {

// Returns the anchor of a heading: "lucerna light import" becomes "lucerna-light-import".
std::string anchor(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

// Returns "`-o`, `--output` FILE.exr".
std::string option_cell(const CLI::Option& option) {
    std::string cell;
    if (option.get_positional()) {
        cell = "`" + option.get_name(true) + "`";
    } else {
        for (const std::string& name : names_of(option)) cell += (cell.empty() ? "`" : ", `") + name + "`";
        if (takes_value(option)) cell += " " + markdown(option.get_type_name());
    }
    return cell;
}

void append_rows(const CLI::App& app, bool positional, std::string& page) {
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_positional() != positional) continue;
        page += fmt::format("| {} | {}{}", option_cell(*option), option->get_required() ? "(required) " : "",
                            markdown(option->get_description()));
        std::string others;
        for (const CLI::Option* other : option->get_excludes())
            others += (others.empty() ? "`" : ", `") + other->get_name() + "`";
        page += others.empty() ? " |\n" : fmt::format(" (not together with {}) |\n", others);
    }
}

// Appends a command's text below its options; indented lines become code, the others are filled.
void append_paragraphs(const std::string& text, std::string& page) {
    std::istringstream lines(text);
    bool code = false;
    for (std::string line; std::getline(lines, line);) {
        const bool indented = line.starts_with(' ');
        if (indented && !code) page += '\n';
        if (!indented && code && !line.empty()) page += '\n';
        code = indented;
        page += (indented ? "  " + line : markdown(line)) + '\n';
    }
}

void append_reference(const CLI::App& app, std::string_view level, std::string& page) {
    for (const CLI::App* command : commands_of(app)) {
        const std::string name = full_name(*command);
        page += fmt::format("\n{} {}\n\n{}.\n\n", level, name, markdown(command->get_description()));
        if (commands_of(*command).empty())
            page += fmt::format("    {} [OPTIONS]{}\n\n", name, positionals_text(*command));
        page += "| argument or option | |\n| --- | --- |\n";
        append_rows(*command, true, page);
        append_rows(*command, false, page);
        page += '\n';
        append_paragraphs(command->get_footer(), page);
        append_reference(*command, "###", page);
    }
}

void append_index(const CLI::App& app, std::string& page) {
    for (const CLI::App* command : commands_of(app)) {
        const std::string name = full_name(*command);
        page +=
            fmt::format("| [`{}`](#{}) | {} |\n", name, anchor(name), markdown(command->get_description()));
        append_index(*command, page);
    }
}

constexpr const char* kReferenceExit = R"(
## Exit status

| code | |
| --- | --- |
| 0 | done |
| 1 | an input or the environment is wrong; one line on standard error states place, cause and what is expected |
| 2 | an internal error |
| 128 + N | signal N ended the work early, and the result so far was written: 130 after Ctrl-C |
)";

}  // namespace

std::string reference_page(const CLI::App& program) {
    std::string page =
        "# Commands\n\nAll commands and options of `lucerna`, from the same tables as `--help`. This page is "
        "the "
        "output of `lucerna --reference`.\n\n| command | |\n| --- | --- |\n";
    append_index(program, page);
    page += "\n## General options\n\n| option | |\n| --- | --- |\n";
    append_rows(program, false, page);
    append_reference(program, "##", page);
    page +=
        "\n## Integrators\n\nSet by the scene's `Integrator` line, or by `--integrator NAME` and `--set "
        "KEY=VALUE`.\n";
    page += integrators_markdown("###");
    return page + kReferenceExit;
}

// ---- Completion.

namespace {

// Returns the completer of a value, as named by the script's functions: "files exr", "files", "folders",
// "words a b", or nothing.
std::string completer_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    constexpr std::string_view kOneOf = "one of ";
    if (option.get_description().starts_with(kOneOf)) {
        std::string words = option.get_description().substr(kOneOf.size());
        std::erase(words, ',');
        return "words " + words;
    }
    if (type == "DIR" || type == "FOLDER") return "folders";
    if (const auto dot = type.rfind('.'); dot != type.npos && dot + 1 < type.size() && type[dot + 1] != '.')
        return "files " + type.substr(dot + 1);
    const bool any_file = option.get_positional() || type == "FILE" || type == "RAYS";
    return any_file ? "files" : "";
}

// Joins the words of a bash list, which is quoted as a whole.
std::string joined(const std::vector<std::string>& words) {
    return fmt::format("{}", fmt::join(words, " "));
}

// Returns a command's key in the script: "light import"; empty for the program.
std::string path_of(const CLI::App& app) {
    if (!app.get_parent()) return "";
    const std::string before = path_of(*app.get_parent());
    return before.empty() ? app.get_name() : before + " " + app.get_name();
}

struct CompletionTables {
    std::string commands;  // patterns of a command after its parent command
    std::string words;     // of each command: its commands, options, positional
    std::string values;    // of each option that takes a value
};

void append_tables(const CLI::App& app, CompletionTables& tables) {
    const std::string path = path_of(app);
    std::vector<std::string> commands, options;
    std::string positional;
    for (const CLI::App* command : commands_of(app)) {
        commands.push_back(command->get_name());
        tables.commands += fmt::format("            \"{} {}\") ;;\n", path, command->get_name());
    }
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_positional() && positional.empty()) positional = completer_of(*option);
        std::string pattern;
        for (const std::string& name : names_of(*option)) {
            options.push_back(name);
            pattern += fmt::format("{}\"{} {}\"", pattern.empty() ? "" : " | ", path, name);
        }
        if (option->get_positional() || !takes_value(*option)) continue;
        const std::string completer = completer_of(*option);
        tables.values +=
            fmt::format("        {}) {} ;;\n", pattern, completer.empty() ? ":" : "_lucerna_" + completer);
    }
    tables.words += fmt::format("        \"{}\") commands=\"{}\" options=\"{}\" positional=\"{}\" ;;\n", path,
                                joined(commands), joined(options), positional);
    for (const CLI::App* command : commands_of(app)) append_tables(*command, tables);
}

// {0}, {1} and {2} are the tables.
constexpr const char* kScript = R"(# bash completion for lucerna, made by lucerna --bash-completion
# Each function offers what begins with $word.
_lucerna_words() {{
    mapfile -t COMPREPLY < <(compgen -W "$*" -- "$word")
}}
_lucerna_folders() {{
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -d -- "$word")
}}
# Files of a suffix, and folders; all files if there is neither.
_lucerna_files() {{
    compopt -o filenames 2>/dev/null
    [ -z "$1" ] || mapfile -t COMPREPLY < <({{ compgen -f -X "!*.$1" -- "$word"; compgen -d -- "$word"; }} | sort -u)
    [ "${{#COMPREPLY[@]}}" -gt 0 ] || mapfile -t COMPREPLY < <(compgen -f -- "$word")
}}
# Whether a value stands for option $1 of $command, which has been offered then.
_lucerna_value() {{
    case "$command $1" in
{2}        *) return 1 ;;
    esac
}}
_lucerna() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} command="" i
    local commands options positional
    COMPREPLY=()
    # --option=value is three words here.
    if [ "$word" = "=" ]; then
        word=""
    elif [ "$before" = "=" ]; then
        before=${{COMP_WORDS[COMP_CWORD - 2]}}
    fi
    for ((i = 1; i < COMP_CWORD; ++i)); do
        case "$command ${{COMP_WORDS[i]}}" in
{0}            *) continue ;;
        esac
        command="${{command:+$command }}${{COMP_WORDS[i]}}"
    done
    case $command in
{1}    esac
    _lucerna_value "$before" && return
    case $word in
        -*) _lucerna_words "$options" ;;
        *) if [ -n "$commands" ]; then _lucerna_words "$commands"; elif [ -n "$positional" ]; then _lucerna_$positional; fi ;;
    esac
}}
complete -F _lucerna lucerna
)";

}  // namespace

std::string bash_completion(const CLI::App& program) {
    CompletionTables tables;
    append_tables(program, tables);
    return fmt::format(kScript, tables.commands, tables.words, tables.values);
}

}  // namespace lucerna
