#include "engine/pbrt/material_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/names.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// Complex refractive indices as linear sRGB, as Tungsten's table (Bitterli) has them: measured spectra
// integrated against the CIE colour matching functions.
struct Metal {
    std::string_view name;
    Rgb eta, k;
};
const Metal kMetals[] = {
    {"Ag", {0.1552646F, 0.1167232F, 0.1383807F}, {4.8283433F, 3.1222459F, 2.1470504F}},
    {"Al", {1.6574600F, 0.8803689F, 0.5212287F}, {9.2238691F, 6.2695232F, 4.8370012F}},
    {"Au", {0.1431190F, 0.3749570F, 1.4424785F}, {3.9831604F, 2.3857207F, 1.6032152F}},
    {"Cu", {0.2004377F, 0.9240334F, 1.1022120F}, {3.9129485F, 2.4528477F, 2.1421880F}},
};

// Refractive indices at the d line, 587.6 nm (the makers' data sheets).
struct Glass {
    std::string_view name;
    double eta;
};
constexpr Glass kGlasses[] = {{"glass-BK7", 1.5168},    {"glass-BAF10", 1.67003}, {"glass-FK51A", 1.48656},
                              {"glass-LASF9", 1.85025}, {"glass-SF5", 1.67271},   {"glass-SF10", 1.72825},
                              {"glass-SF11", 1.78472}};

// Indices beyond these are no glass, and nothing here divides by less.
constexpr double kLeastEta = 0.01, kMostEta = 100;

std::string only_string(const Param& param) {
    return param.strings.size() == 1 ? param.strings.front() : std::string();
}

std::optional<Rgb> named_metal(const std::string& name) {
    for (const Metal& metal : kMetals) {
        if (name == fmt::format("metal-{}-eta", metal.name)) return metal.eta;
        if (name == fmt::format("metal-{}-k", metal.name)) return metal.k;
    }
    return std::nullopt;
}

const NamedTexture& color_texture(Reading& reading, const Param& param) {
    const std::string wanted = only_string(param);
    const auto found = reading.textures.find(wanted);
    if (found == reading.textures.end()) {
        std::vector<std::string_view> names;
        for (const auto& [known, texture] : reading.textures) names.push_back(known);
        fail(param.place, "\"{}\": no texture \"{}\" of colours was made before; {}there are {}", param.name,
             shown(wanted), did_you_mean(wanted, names), names.size());
    }
    return found->second;
}

}  // namespace

FloatTexture read_number(Reading& reading, Params& params, std::string_view name, double fallback,
                         double least, double most) {
    const FloatTexture number = read_float(reading, params, name, fallback);
    const auto value = number.constant_value();
    if (!value || !params.has(name)) return number;
    const auto x = static_cast<double>(*value);
    if (!(x >= least && x <= most)) {
        fail(params.place_of(name), "\"{}\" of {}: {:g} is not accepted; {:g} to {:g} is", name,
             params.owner(), x, least, most);
    }
    return number;
}

RgbTexture read_color(Reading& reading, Params& params, std::string_view name, const Rgb& fallback) {
    const Param* param = params.find_any(name);
    if (param && param->type == Type::texture) return color_texture(reading, *param).texture;
    const Rgb value = read_spectrum(reading, params, name, ColorUse::ratio).value_or(fallback);
    if (max_component(value) <= 1) return RgbTexture::constant(value);
    const Rgb held(std::min(value.x, 1.0F), std::min(value.y, 1.0F), std::min(value.z, 1.0F));
    reading.warn(params.place_of(name),
                 fmt::format("\"{}\" is {:g} {:g} {:g}; a surface reflects at most 1, which is taken", name,
                             value.x, value.y, value.z));
    return RgbTexture::constant(held);
}

RgbTexture read_index_spectrum(Reading& reading, Params& params, std::string_view name, const Rgb& fallback) {
    const Param* param = params.find_any(name);
    if (param && param->type == Type::texture) return color_texture(reading, *param).texture;
    if (param && param->type == Type::spectrum) {
        if (const auto metal = named_metal(only_string(*param))) return RgbTexture::constant(*metal);
    }
    return RgbTexture::constant(read_spectrum(reading, params, name, ColorUse::ratio).value_or(fallback));
}

FloatTexture read_glass_eta(Reading& reading, Params& params, std::string_view name, double fallback) {
    const Param* param = params.find_any(name);
    if (!param || param->type == Type::real || param->type == Type::texture) {
        return read_number(reading, params, name, fallback, kLeastEta, kMostEta);
    }
    const std::string wanted = only_string(*param);
    for (const Glass& glass : kGlasses) {
        if (wanted != glass.name) continue;
        reading.warn(param->place,
                     fmt::format("{}: no dispersion, {} at 587.6 nm is taken", wanted, glass.eta));
        return FloatTexture::constant(static_cast<float>(glass.eta));
    }
    const float eta = luminance(read_spectrum(reading, params, name, ColorUse::ratio).value_or(Rgb(1.5F)));
    if (!(eta >= static_cast<float>(kLeastEta) && eta <= static_cast<float>(kMostEta))) {
        fail(params.place_of(name), "\"{}\" of {}: {:g} is not accepted; {:g} to {:g} is", name,
             params.owner(), eta, kLeastEta, kMostEta);
    }
    reading.warn(params.place_of(name), fmt::format("\"{}\": no dispersion, {:g} is taken", name, eta));
    return FloatTexture::constant(eta);
}

namespace {

// A roughness above 1 is no surface that any version describes; scenes hold some by mistake.
FloatTexture read_rough_number(Reading& reading, Params& params, const std::string& name,
                               const FloatTexture& fallback) {
    if (!params.has(name)) return fallback;
    const FloatTexture number = read_float(reading, params, name, 0);
    const auto value = number.constant_value();
    if (!value) return number;
    if (!(*value >= 0)) {
        fail(params.place_of(name), "\"{}\" of {}: {:g} is not accepted; 0 to 1 is", name, params.owner(),
             *value);
    }
    if (*value <= 1) return number;
    reading.warn(params.place_of(name), fmt::format("\"{}\" is {:g}; 1 is taken", name, *value));
    return FloatTexture::constant(1);
}

}  // namespace

Roughness read_roughness(Reading& reading, Params& params, double fallback, Dialect dialect,
                         const std::string& prefix) {
    const FloatTexture both = read_rough_number(reading, params, prefix + "roughness",
                                                FloatTexture::constant(static_cast<float>(fallback)));
    Roughness roughness{read_rough_number(reading, params, prefix + "uroughness", both),
                        read_rough_number(reading, params, prefix + "vroughness", both)};
    // A scene that knows "remaproughness" is not older than version 3.
    if (dialect == Dialect::v2 && params.has("remaproughness")) dialect = Dialect::v3;
    if (params.boolean("remaproughness", true)) {
        roughness.map = dialect == Dialect::v2   ? RoughnessMap::v2
                        : dialect == Dialect::v3 ? RoughnessMap::v3
                                                 : RoughnessMap::v4;
    }
    if (!roughness.x.constant_value() || !roughness.y.constant_value()) return roughness;
    const V2f alpha = roughness.alpha(V2f(0, 0));  // once, not at every hit
    return Roughness::of_alpha(alpha.x, alpha.y);
}

std::shared_ptr<const CoatTable> cover_of(Reading& reading, float eta, const Roughness& roughness) {
    const auto alphas = roughness.constant_alpha();
    const V2f key = alphas.value_or(V2f(-1, -1));
    auto& table = reading.covers[{eta, key.x, key.y}];
    if (!table) table = std::make_shared<CoatTable>(eta, alphas);
    return table;
}

Coat read_coat(Reading& reading, Params& params, const std::string& prefix) {
    Coat coat;
    const FloatTexture eta = read_glass_eta(reading, params, prefix + "eta", 1.5);
    if (!eta.constant_value()) {
        fail(params.place_of(prefix + "eta"),
             "\"{}eta\" of {}: a texture is not accepted; a float or spectrum is", prefix, params.owner());
    }
    coat.eta = *eta.constant_value();
    coat.roughness = read_roughness(reading, params, 0, Dialect::v4, prefix);
    coat.table = cover_of(reading, coat.eta, coat.roughness);
    // How pbrt walks between the layers, and what it finds there: nothing scatters within this varnish.
    params.accept({"maxdepth", "nsamples", "g", "thickness"});
    const auto within = read_color(reading, params, "albedo", Rgb(0.0F));
    if (params.has("albedo") && !is_black(within.at(V2f(0.5F, 0.5F)))) {
        reading.warn(params.place_of("albedo"), "\"albedo\": the varnish is taken to be clear");
    }
    return coat;
}

Relief read_relief(Reading& reading, Params& params) {
    Relief relief;
    for (const std::string_view name : {"bumpmap", "displacement"}) {
        if (!params.has(name)) continue;
        const FloatTexture height = read_float(reading, params, name, 0);
        if (!height.constant_value()) relief.displacement = height;  // what is level bends nothing
    }
    if (!params.has("normalmap")) return relief;
    if (relief.displacement) {
        fail(params.place_of("normalmap"), "\"normalmap\" and \"displacement\" exclude each other");
    }
    const std::string name = params.string("normalmap", "");
    try {
        relief.normals =
            image_texture<Rgb>(reading.images->open(reading.resolve(name), {Encoding::Kind::linear}), {});
    } catch (const InputError& error) {
        fail(params.place_of("normalmap"), "{}", printable(error.what()));
    }
    return relief;
}

}  // namespace lucerna
