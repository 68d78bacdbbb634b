// The integrator: pbrt's names for ours, its parameters, and what the command line puts over both.
#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/pbrt/read_scene.h"
#include "engine/pbrt/state.h"

namespace lucerna {
namespace {

// What pbrt calls a parameter that we have under another name, or not at all (`ours` empty: no effect here).
struct Alias {
    std::string_view integrator, pbrt, ours;
};
constexpr Alias kAliases[] = {
    {"path", "lightsampler", ""},
    {"path", "lightsamplestrategy", ""},
    {"path", "pixelbounds", ""},
    {"path", "regularize", ""},
    {"path", "rrthreshold", ""},
    {"direct", "maxdepth", "maxspeculardepth"},
    {"direct", "pixelbounds", ""},
    {"direct", "strategy", ""},
    {"photonmap", "causticphotons", ""},
    {"photonmap", "directphotons", ""},
    {"photonmap", "finalgathersamples", "gatherrays"},
    {"photonmap", "gatherangle", ""},
    {"photonmap", "indirectphotons", ""},
    {"photonmap", "maxdepth", "maxspeculardepth"},
    {"photonmap", "maxdist", "radius"},
    {"photonmap", "maxphotondepth", ""},
    {"photonmap", "nused", "k"},
    {"igi", "gathersamples", ""},
    {"igi", "glimit", ""},
    {"igi", "maxdepth", "maxspeculardepth"},
};

std::string_view our_name(const std::string& kind, const Params& params) {
    if (kind == "path" || kind == "photonmap" || kind == "igi" || kind == "direct") return kind;
    if (kind == "directlighting") return "direct";
    refuse_kind(
        params.place(), "Integrator", kind, {"path", "direct", "photonmap", "igi"},
        {"ambientocclusion", "ao", "bdpt", "dipolesubsurface", "exphotonmap", "function", "irradiancecache",
         "lightpath", "mlt", "randomwalk", "simplepath", "simplevolpath", "sppm", "volpath", "whitted"});
}

SettingValue value_of(const Param& param) {
    if (param.count() != 1)
        fail(param.place, "\"{}\" has {} values; 1 is accepted", shown(param.name), param.count());
    if (!param.flags.empty()) return SettingValue(static_cast<bool>(param.flags.front()));
    if (!param.numbers.empty()) return param.numbers.front();
    return param.strings.front();
}

// "1e6" as a number, "true" as a truth value, all else as a word.
SettingValue parse_setting(const std::string& text) {
    if (text == "true" || text == "false") return SettingValue(text == "true");
    double number = 0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, number);
    if (error == std::errc() && rest == end && std::isfinite(number)) return number;
    return text;
}

// set_parameter quotes the value as it stands, line breaks included.
void set_in_one_line(IntegratorSettings& settings, std::string_view name, const SettingValue& value,
                     const Location& at) {
    try {
        set_parameter(settings, name, value, at);
    } catch (const InputError& error) {
        throw InputError(printable(error.what()));
    }
}

}  // namespace

IntegratorSettings read_integrator(const std::string& kind, Params& params,
                                   const std::string& override_name) {
    const std::string name(our_name(kind, params));
    IntegratorSettings settings = make_settings(name, params.place().location());
    if (!override_name.empty() && override_name != name) {
        // The scene's parameters belong to another method.
        for (const Param& param : params.all()) params.accept({param.name});
        return make_settings(override_name, {"--integrator"});
    }
    for (const Field& field : fields(settings))
        params.accept({field.name});  // so that warnings can offer them
    for (const Param& param : params.all()) {
        std::string_view target = param.name;
        for (const Alias& alias : kAliases) {
            if (alias.integrator == name && alias.pbrt == param.name) target = alias.ours;
        }
        if (target.empty()) continue;  // left unused: a warning
        params.accept({param.name});
        if (name == "photonmap" && param.name == "finalgather") {
            const bool gather = params.boolean("finalgather", true);
            set_in_one_line(settings, "indirect", std::string(gather ? "gather" : "map"),
                            param.place.location());
            continue;
        }
        set_in_one_line(settings, target, value_of(param), param.place.location());
    }
    return settings;
}

void apply_settings(IntegratorSettings& settings, const SceneOverrides& overrides) {
    for (const auto& [name, text] : overrides.set) {
        set_in_one_line(settings, name, parse_setting(text), {"--set " + name + "=" + text});
    }
}

}  // namespace lucerna
