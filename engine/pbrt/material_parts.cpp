#include "engine/pbrt/material_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/names.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// Indices beyond these are no glass, and nothing here divides by less.
constexpr double kLeastEta = 0.01, kMostEta = 100;

std::string only_string(const Param& param) {
    return param.strings.size() == 1 ? param.strings.front() : std::string();
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
    return RgbTexture::constant(read_spectrum(reading, params, name, ColorUse::ratio).value_or(fallback));
}

FloatTexture read_glass_eta(Reading& reading, Params& params, std::string_view name, double fallback) {
    const Param* param = params.find_any(name);
    if (!param || param->type == Type::real || param->type == Type::texture) {
        return read_number(reading, params, name, fallback, kLeastEta, kMostEta);
    }
    const Rgb index = read_spectrum(reading, params, name, ColorUse::ratio).value_or(Rgb(1.5F));
    const bool grey = index.x == index.y && index.y == index.z;
    const float eta = grey ? index.x : luminance(index);
    if (!(eta >= static_cast<float>(kLeastEta) && eta <= static_cast<float>(kMostEta))) {
        fail(params.place_of(name), "\"{}\" of {}: {:g} is not accepted; {:g} to {:g} is", name,
             params.owner(), eta, kLeastEta, kMostEta);
    }
    const std::string warning = fmt::format("\"{}\": no dispersion, {:g} is taken", name, eta);
    if (only_string(*param).rfind("glass-", 0) != 0) reading.warn(params.place_of(name), warning);
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
