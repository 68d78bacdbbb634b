// The integrator: pbrt's names for ours, its parameters, and what the command line puts over both.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/base/names.h"
#include "engine/pbrt/read_scene.h"
#include "engine/pbrt/state.h"

namespace lucerna {
namespace {

// What pbrt calls a parameter that we have under another name, or not at all (`ours` empty: no effect here).
struct Alias {
    std::string_view integrator, pbrt, ours;
};
constexpr Alias kAliases[] = {
    {"path", "rrthreshold", ""},
    {"direct", "maxdepth", "maxspeculardepth"},
    {"photonmap", "directphotons", ""},
    {"photonmap", "directwithphotons", ""},
    {"photonmap", "finalgathersamples", "gatherrays"},
    {"photonmap", "gatherangle", ""},
    {"photonmap", "gathersamples", "gatherrays"},
    {"photonmap", "maxdepth", "maxspeculardepth"},
    {"photonmap", "maxdist", "radius"},
    {"photonmap", "maxphotondepth", ""},
    {"photonmap", "nused", "k"},
    {"igi", "gathersamples", ""},
    {"igi", "maxdepth", "maxspeculardepth"},
};

// Integrators of pbrt that we do not have: the nearest of ours, and why it is the nearest.
struct Stranger {
    std::string_view pbrt, ours, why;
};
constexpr Stranger kStrangers[] = {
    {"directlighting", "direct", ""},  // the same thing under another name
    {"exphotonmap", "photonmap", ""},
    {"whitted", "direct", "direct light, mirrors and glass, with area lights sampled instead of skipped"},
    {"ambientocclusion", "direct", "on white surfaces under an even sky, which is ambient occlusion"},
    {"ao", "direct", "on white surfaces under an even sky, which is ambient occlusion"},
    {"sppm", "photonmap", "photon mapping in one pass instead of many"},
    {"irradiancecache", "photonmap", "the same light, by final gather"},
    {"bdpt", "path", "the same light, unbiased"},
    {"mlt", "path", "the same light, unbiased"},
    {"metropolis", "path", "the same light, unbiased"},
    {"volpath", "path", ""},
    {"simplepath", "path", "the same light, unbiased"},
    {"simplevolpath", "path", "the same light, unbiased"},
    {"randomwalk", "path", "the same light, unbiased"},
    {"lightpath", "path", "the same light, seen from the camera's end"},
    {"dipolesubsurface", "path", "without light below the surface"},
    {"diffuseprt", "path", "the light that precomputed transfer approximates"},
    {"glossyprt", "path", "the light that precomputed transfer approximates"},
    {"useprobes", "path", "the light that radiance probes approximate"},
    {"debug", "direct", "a picture instead of numbers"},
};
constexpr std::string_view kOurs[] = {"path", "direct", "photonmap", "igi"};

// Ours by pbrt's name; says so where it is not the same method.
std::string our_name(const Reading& reading, const std::string& kind, const Params& params) {
    if (std::ranges::find(kOurs, kind) != std::ranges::end(kOurs)) return kind;
    std::vector<std::string_view> known(std::begin(kOurs), std::end(kOurs));
    for (const Stranger& stranger : kStrangers) {
        if (kind == stranger.pbrt) {
            if (!stranger.why.empty()) {
                reading.warn(params.place(),
                             fmt::format("Integrator \"{}\" is not here; {} takes its place: {}", kind,
                                         stranger.ours, stranger.why));
            }
            return std::string(stranger.ours);
        }
        known.push_back(stranger.pbrt);
    }
    fail(params.place(), "unknown Integrator \"{}\"; {}ours are {}", shown(kind), did_you_mean(kind, known),
         fmt::join(kOurs, ", "));
}

bool is_occlusion(std::string_view kind) {
    return kind == "ambientocclusion" || kind == "ao";
}

// Parameters that steer how pbrt works and have no counterpart here; taken without a warning.
void accept_foreign(Params& params) {
    params.accept({"imagereconstruction", "imagewritefrequency", "lightsampler", "lightsamplestrategy",
                   "nsamples", "pixelbounds", "regularize", "strategy", "visualizestrategies",
                   "visualizeweights"});
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

namespace {

// Version 2's igi clamps the geometric factor cos cos / d² at `glimit`; ours fades near virtual lights out
// from the distance at which two facing surfaces reach that factor.
SettingValue mindist_of(Params& params, double glimit) {
    if (!(glimit > 0))
        fail(params.place_of("glimit"), "\"glimit\": {:g} is not accepted; more than 0 is", glimit);
    return 1 / std::sqrt(glimit);
}

// Parameters that say in pbrt's way what ours says in another. True if `param` was one.
bool read_translated(IntegratorSettings& settings, Params& params, const Param& param) {
    const std::string_view ours = integrator_name(settings);
    const Location at = param.place.location();
    if (ours == "photonmap" && param.name == "finalgather") {
        const bool gather = params.boolean("finalgather", true);
        set_in_one_line(settings, "indirect", std::string(gather ? "gather" : "map"), at);
        return true;
    }
    if (ours == "photonmap" && param.name == "photonsperiteration") {
        // All passes at once, within what a machine holds.
        constexpr double kMost = 2e7;
        const double passes =
            params.integer(params.has("numiterations") ? "numiterations" : "iterations", 64);
        const double each = params.integer("photonsperiteration", 1);
        set_in_one_line(settings, "photons", std::clamp(passes * each, 1.0, kMost), at);
        return true;
    }
    if (ours == "igi" && param.name == "glimit") {
        set_in_one_line(settings, "mindist", mindist_of(params, params.real("glimit", 10)), at);
        return true;
    }
    return false;
}

void read_parameters(IntegratorSettings& settings, Params& params) {
    const std::string name(integrator_name(settings));
    for (const Field& field : fields(settings))
        params.accept({field.name});  // so that warnings can offer them
    for (const Param& param : params.all()) {
        if (read_translated(settings, params, param)) continue;
        std::string_view target = param.name;
        for (const Alias& alias : kAliases) {
            if (alias.integrator == name && alias.pbrt == param.name) target = alias.ours;
        }
        if (target.empty()) continue;  // left unused: a warning
        params.accept({param.name});
        set_in_one_line(settings, target, value_of(param), param.place.location());
    }
}

// Of another method than ours: what has the same name may stay, the rest is a warning.
void read_shared_parameters(IntegratorSettings& settings, Params& params) {
    const std::string name(integrator_name(settings));
    std::vector<Field> known = fields(settings);
    for (const Param& param : params.all()) {
        if (read_translated(settings, params, param)) continue;
        const auto same = [&](const Field& field) { return field.name == param.name; };
        if (param.name != "radius" && std::ranges::any_of(known, same)) {
            params.accept({param.name});
            set_in_one_line(settings, param.name, value_of(param), param.place.location());
        }
    }
}

}  // namespace

IntegratorSettings read_integrator(Reading& reading, const std::string& kind, Params& params,
                                   const std::string& override_name) {
    const bool ours = std::ranges::find(kOurs, kind) != std::ranges::end(kOurs);
    const std::string name = our_name(reading, kind, params);
    accept_foreign(params);
    if (!override_name.empty() && override_name != name) {
        // The scene's parameters belong to another method.
        for (const Param& param : params.all()) params.accept({param.name});
        return make_settings(override_name, {"--integrator"});
    }
    IntegratorSettings settings = make_settings(name, params.place().location());
    if (ours || kind == "directlighting" || kind == "exphotonmap") {
        read_parameters(settings, params);
    } else {
        read_shared_parameters(settings, params);
    }
    if (is_occlusion(kind) && override_name.empty()) reading.draft.occlusion = true;
    return settings;
}

void apply_settings(IntegratorSettings& settings, const SceneOverrides& overrides) {
    for (const auto& [name, text] : overrides.set) {
        set_in_one_line(settings, name, parse_setting(text), {"--set " + name + "=" + text});
    }
}

}  // namespace lucerna
