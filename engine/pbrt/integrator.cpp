// Reads the integrator: maps pbrt's names to Lucerna's, reads parameters and applies the command line.
#include <fmt/format.h>

#include <algorithm>

#include "engine/integrators/settings.h"
#include "engine/pbrt/read_scene.h"
#include "engine/pbrt/state.h"
#include "engine/scene/path_limits.h"
#include "engine/text/spelling.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

// A parameter that Lucerna has under another name, or not at all (empty `ours`: no effect).
struct Alias {
    std::string_view integrator, pbrt, ours;
};
constexpr Alias kAliases[] = {
    {"path", "rrthreshold", ""},
    {"photonmap", "directphotons", ""},
    {"photonmap", "directwithphotons", ""},
    {"photonmap", "finalgathersamples", "gatherrays"},
    {"photonmap", "gatherangle", ""},
    {"photonmap", "gathersamples", "gatherrays"},
    {"photonmap", "maxdist", "radius"},
    {"photonmap", "maxphotondepth", ""},
    {"photonmap", "nused", "k"},
};

// An integrator of pbrt that Lucerna lacks, the nearest one that it has, and the reason for the choice.
struct UnsupportedIntegrator {
    std::string_view pbrt, ours, why;
};
constexpr UnsupportedIntegrator kUnsupportedIntegrators[] = {
    {"directlighting", "direct", ""},  // another name of the same method
    {"exphotonmap", "photonmap", ""},
    {"whitted", "direct", "direct light, mirrors and glass, with area lights sampled instead of ignored"},
    {"ambientocclusion", "direct", "on white surfaces under a uniform sky, which is ambient occlusion"},
    {"ao", "direct", "on white surfaces under a uniform sky, which is ambient occlusion"},
    {"sppm", "progressive", ""},  // the same limit, with passes that are independent of each other
    {"irradiancecache", "photonmap", "the same light, by final gather"},
    {"bdpt", "path", "the same light, unbiased"},
    {"bidirectional", "path", "the same light, unbiased"},
    {"function", "direct", "a picture instead of numbers"},
    {"mlt", "path", "the same light, unbiased"},
    {"metropolis", "path", "the same light, unbiased"},
    {"volpath", "path", ""},
    {"simplepath", "path", "the same light, unbiased"},
    {"simplevolpath", "path", "the same light, unbiased"},
    {"randomwalk", "path", "the same light, unbiased"},
    {"lightpath", "path", "the same light, seen from the camera's end"},
    {"dipolesubsurface", "path", "without subsurface scattering"},
    {"diffuseprt", "path", "the light that precomputed transfer approximates"},
    {"glossyprt", "path", "the light that precomputed transfer approximates"},
    {"useprobes", "path", "the light that radiance probes approximate"},
    {"debug", "direct", "a picture instead of numbers"},
};
bool is_own_integrator(std::string_view name) {
    return std::ranges::find(integrator_names(), name) != integrator_names().end();
}

// Returns Lucerna's name for pbrt's, and reports where the method differs.
std::string our_name(Reading& reading, const std::string& kind, const Params& params) {
    if (is_own_integrator(kind)) return kind;
    const auto names = integrator_names();
    std::vector<std::string_view> known(names.begin(), names.end());
    for (const UnsupportedIntegrator& unsupported : kUnsupportedIntegrators) {
        if (kind == unsupported.pbrt) {
            if (!unsupported.why.empty()) {
                reading.warn_or_refuse(
                    params.place(), fmt::format("Integrator \"{}\" is not supported", kind),
                    fmt::format("{} is used instead: {}", unsupported.ours, unsupported.why));
            }
            return std::string(unsupported.ours);
        }
        known.push_back(unsupported.pbrt);
    }
    fail(params.place(), "unknown Integrator \"{}\"; {}expected {}", shown(kind), did_you_mean(kind, known),
         fmt::join(names, ", "));
}

bool is_occlusion(std::string_view kind) {
    return kind == "ambientocclusion" || kind == "ao";
}

constexpr int kMostPasses = 1 << 24;

// Accepts without a warning parameters that steer how pbrt works and have no counterpart.
void accept_foreign(Params& params) {
    params.accept({"imagereconstruction", "imagewritefrequency", "lightsampler", "lightsamplestrategy",
                   "nsamples", "pixelbounds", "regularize", "strategy", "visualizestrategies",
                   "visualizeweights"});
}

SettingValue value_of(const Param& param) {
    if (param.count() != 1)
        fail(param.place, "\"{}\" has {} values; expected 1", shown(param.name), param.count());
    if (!param.flags.empty()) return SettingValue(static_cast<bool>(param.flags.front()));
    if (!param.numbers.empty()) return param.numbers.front();
    return param.strings.front();
}

// Sets a parameter, with errors in one line, as set_parameter quotes values including line breaks.
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

// The igi of pbrt version 2 clamps VPLs only by `glimit` and compensates with 16 rays unless `gathersamples`
// is given. One ray suffices here, because it also serves direct light.
void read_second_igi(IntegratorSettings& settings, Params& params, const Param& param) {
    const Location at = param.place.location();
    params.accept({"glimit"});
    set_in_one_line(settings, "glimit", value_of(param), at);
    if (!params.has("gathersamples")) set_in_one_line(settings, "gathersamples", 1.0, at);
}

// Reads parameters that pbrt and Lucerna express differently. Returns true if `param` is one.
bool read_translated(IntegratorSettings& settings, Params& params, const Param& param) {
    const std::string_view ours = integrator_name(settings);
    const Location at = param.place.location();
    if (ours == "photonmap" && param.name == "finalgather") {
        const bool gather = params.boolean("finalgather", true);
        set_in_one_line(settings, "indirect", std::string(gather ? "gather" : "map"), at);
        return true;
    }
    if (ours == "progressive" && param.name == "photonsperiteration") {
        // -1 means as many as there are pixels; Lucerna has its own default.
        const int photons = params.integer("photonsperiteration", -1);
        if (photons > 0) set_in_one_line(settings, "photons", double(photons), at);
        return true;
    }
    if (ours == "progressive" && (param.name == "numiterations" || param.name == "iterations")) return true;
    if (ours == "igi" && param.name == "glimit") {
        read_second_igi(settings, params, param);
        return true;
    }
    return false;
}

// The number of passes belongs to the integrator in pbrt, and to the samples per pixel in Lucerna.
void read_passes(Reading& reading, Params& params) {
    for (const std::string_view name : {"numiterations", "iterations"}) {
        if (!params.has(name)) continue;
        const int passes = params.integer(name, 1), held = std::clamp(passes, 1, kMostPasses);
        if (held != passes) {
            params.warn_or_refuse(
                params.place_of(name),
                fmt::format("\"{}\": {} is not accepted; expected 1 to {}", name, passes, kMostPasses),
                fmt::format("{} is used", held));
        }
        reading.draft.passes = held;
    }
}

// Keeps the default for a value that Lucerna rejects. Returns the result of `set` unless it throws.
template <typename Set>
bool or_default(const Params& params, const Param& param, const Set& set) {
    std::string message;
    try {
        return set();
    } catch (const TextError& error) {
        message = error.message();
    } catch (const InputError& error) {  // from set_parameter, which prefixes the place
        const std::string place = to_string(param.place.location()) + ": ";
        message = printable(error.what());
        if (message.starts_with(place)) message.erase(0, place.size());
    }
    params.warn_or_refuse(param.place, message, "the default is used");
    return true;
}

// Sets a parameter. One that Lucerna lacks stays unused, which is reported.
void set_leniently(IntegratorSettings& settings, Params& params, std::string_view target,
                   const Param& param) {
    if (const auto instead = instead_of_removed(settings, target)) {
        params.accept({param.name});
        params.warn_or_refuse(param.place, fmt::format("\"{}\" has been removed", param.name), *instead);
        return;
    }
    const std::vector<Field> known = fields(settings);
    if (std::ranges::none_of(known, [&](const Field& field) { return field.name == target; })) return;
    params.accept({param.name});
    or_default(params, param, [&] {
        set_in_one_line(settings, target, value_of(param), param.place.location());
        return true;
    });
}

bool read_leniently_translated(IntegratorSettings& settings, Params& params, const Param& param) {
    return or_default(params, param, [&] { return read_translated(settings, params, param); });
}

void read_parameters(IntegratorSettings& settings, Params& params) {
    const std::string name(integrator_name(settings));
    for (const Field& field : fields(settings))
        params.accept({field.name});  // so that warnings can suggest them
    for (const Param& param : params.all()) {
        if (read_leniently_translated(settings, params, param)) continue;
        std::string_view target = param.name;
        for (const Alias& alias : kAliases) {
            if (alias.integrator == name && alias.pbrt == param.name) target = alias.ours;
        }
        if (target.empty()) continue;  // stays unused and gives a warning
        set_leniently(settings, params, target, param);
    }
}

// Reads parameters for a replacing method: those of the same name apply, the others give a warning.
void read_shared_parameters(IntegratorSettings& settings, Params& params) {
    const std::string name(integrator_name(settings));
    std::vector<Field> known = fields(settings);
    for (const Param& param : params.all()) {
        if (read_leniently_translated(settings, params, param)) continue;
        const auto same = [&](const Field& field) { return field.name == param.name; };
        if (param.name != "radius" && std::ranges::any_of(known, same))
            set_leniently(settings, params, param.name, param);
    }
}

// Converts pbrt's `maxdepth` where it does not limit whole paths from the light to the eye.
void translate_max_depth(const Reading& reading, const std::string& kind, IntegratorSettings& settings) {
    const int max_depth = max_depth_of(settings);
    if (kind == "sppm") {
        // It limits camera and photon paths separately, and the surface where they meet counts in both.
        if (max_depth > 0) set_max_depth(settings, 2 * std::min(max_depth, kMaxBounces) - 1);
    } else if (reading.old_dialect && (kind == "photonmap" || kind == "exphotonmap" || kind == "igi")) {
        // It limits mirrors and glass on camera paths only; other rules end everything else.
        set_max_depth(settings, 0);
    }
}

// Returns the depth limit of an integrator that another one replaces.
int max_depth_in(const Reading& reading, const std::string& kind, const std::string& name, Params& params) {
    IntegratorSettings own = make_settings(name, params.place().location());
    for (const Param& param : params.all()) {
        if (param.name == "maxdepth") set_leniently(own, params, param.name, param);
    }
    translate_max_depth(reading, kind, own);
    return max_depth_of(own);
}

}  // namespace

IntegratorSettings read_integrator(Reading& reading, const std::string& kind, Params& params,
                                   const std::string& override_name) {
    const std::string name = our_name(reading, kind, params);
    accept_foreign(params);
    if (!override_name.empty() && override_name != name) {
        // The scene's other parameters belong to another method.
        IntegratorSettings settings = make_settings(override_name, {"--integrator"});
        set_max_depth(settings, max_depth_in(reading, kind, name, params));
        for (const Param& param : params.all()) params.accept({param.name});
        return settings;
    }
    IntegratorSettings settings = make_settings(name, params.place().location());
    if (name == "progressive") read_passes(reading, params);
    if (is_own_integrator(kind) || kind == "directlighting" || kind == "exphotonmap" || kind == "sppm") {
        read_parameters(settings, params);
    } else {
        read_shared_parameters(settings, params);
    }
    translate_max_depth(reading, kind, settings);
    if (is_occlusion(kind) && override_name.empty()) reading.draft.occlusion = true;
    return settings;
}

void apply_settings(IntegratorSettings& settings, const SceneOverrides& overrides) {
    for (const auto& [name, text] : overrides.set) {
        set_in_one_line(settings, name, parse_setting(text), {"--set " + name + "=" + text});
    }
}

}  // namespace lucerna
