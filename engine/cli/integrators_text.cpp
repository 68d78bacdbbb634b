#include "engine/cli/integrators_text.h"

#include <fmt/format.h>

#include "engine/figures/markup.h"
#include "engine/integrators/integrator.h"

namespace lucerna {
namespace {

std::string accepted(const Field& field) {
    if (!field.choices.empty()) return fmt::format("{}", fmt::join(field.choices, " | "));
    return fmt::format("{} >= {:g}", field.whole ? "whole" : "number", field.least);
}

std::string_view purpose(std::string_view integrator) {
    if (integrator == "path")
        return "unbiased path tracing, the reference: slow, and noisy where light is focused";
    if (integrator == "direct") return "direct light only, through mirrors and glass";
    if (integrator == "photonmap") return "photon maps with projected density estimation and final gather";
    if (integrator == "progressive") return "photon mapping in passes with a shrinking radius; consistent";
    return "instant global illumination with virtual point lights: smooth images; caustics from photons; "
           "complete with gathersamples=1";
}

}  // namespace

std::string integrators_text() {
    std::string text =
        "Set by the scene's Integrator line, or by --integrator NAME and --set KEY=VALUE.\n"
        "Each line: parameter, default, meaning, [accepted values].\n";
    for (const std::string_view name : integrator_names()) {
        text += fmt::format("\n{}: {}\n", name, purpose(name));
        IntegratorSettings settings = make_settings(name, {});
        bool in_studies = false;
        for (const Field& field : fields(settings)) {
            if (field.in_studies && !in_studies) text += "  for studies:\n";
            in_studies = field.in_studies;
            text += fmt::format("  {:<17} {:<12} {}  [{}]\n", field.name, field.text(), field.help,
                                accepted(field));
        }
    }
    return text;
}

std::string integrators_markdown(std::string_view level) {
    std::string text;
    for (const std::string_view name : integrator_names()) {
        text += fmt::format(
            "\n{} {}\n\n{}.\n\n| parameter | default | meaning | accepted |\n| --- | --- | --- | --- |\n",
            level, name, markdown(purpose(name)));
        IntegratorSettings settings = make_settings(name, {});
        bool in_studies = false;
        for (const Field& field : fields(settings)) {
            if (field.in_studies && !in_studies) text += "| **for studies** | | | |\n";
            in_studies = field.in_studies;
            text += fmt::format("| `{}` | {} | {} | {} |\n", field.name, markdown(field.text()),
                                markdown(field.help), markdown(accepted(field)));
        }
    }
    return text;
}

}  // namespace lucerna
