#include "engine/pbrt/material_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/text/spelling.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// Refractive indices outside this range are not glass, and divisions by them are safe within it.
constexpr double kLeastEta = 0.01, kMostEta = 100;

std::string only_string(const Param& param) {
    return param.strings.size() == 1 ? param.strings.front() : std::string();
}

// Returns null, with a report, if there is no such texture.
const NamedTexture* color_texture(Reading& reading, const Params& params, const Param& param) {
    const std::string wanted = only_string(param);
    const auto found = reading.textures.find(wanted);
    if (found != reading.textures.end()) return &found->second;
    std::vector<std::string_view> names;
    for (const auto& [known, texture] : reading.textures) names.push_back(known);
    params.warn_or_refuse(param.place,
                          fmt::format("\"{}\": there is no colour texture \"{}\"; {}{} are defined",
                                      param.name, shown(wanted), did_you_mean(wanted, names), names.size()),
                          "the default is used");
    return nullptr;
}

}  // namespace

FloatTexture read_number(Reading& reading, Params& params, std::string_view name, double fallback,
                         double least, double most) {
    const FloatTexture number = read_float(reading, params, name, fallback);
    const auto value = number.constant_value();
    if (!value || !params.has(name)) return number;
    const auto x = static_cast<double>(*value);
    if (!(x >= least && x <= most)) {
        const double held = std::clamp(x, least, most);
        params.warn_or_refuse(params.place_of(name),
                              fmt::format("\"{}\" of {}: {:g} is not accepted; expected {:g} to {:g}", name,
                                          params.owner(), x, least, most),
                              fmt::format("{:g} is used", held));
        return FloatTexture::constant(static_cast<float>(held));
    }
    return number;
}

namespace {

// Returns the texture that a parameter names, `fallback` for an unknown name, nothing for a value.
std::optional<RgbTexture> texture_named(Reading& reading, Params& params, std::string_view name,
                                        const Rgb& fallback) {
    const Param* param = params.find_any(name);
    if (!param || param->type != Type::texture) return std::nullopt;
    const NamedTexture* named = color_texture(reading, params, *param);
    return named ? named->texture : RgbTexture::constant(fallback);
}

}  // namespace

RgbTexture read_color(Reading& reading, Params& params, std::string_view name, const Rgb& fallback) {
    if (const auto texture = texture_named(reading, params, name, fallback)) return *texture;
    const Rgb value = read_spectrum(reading, params, name, ColorUse::ratio).value_or(fallback);
    if (max_component(value) <= 1) return RgbTexture::constant(value);
    const Rgb held = at_most_one(value);
    params.warn_or_refuse(params.place_of(name),
                          fmt::format("\"{}\" is {:g} {:g} {:g}; a surface reflects at most 1", name, value.x,
                                      value.y, value.z),
                          "1 is used");
    return RgbTexture::constant(held);
}

RgbTexture read_index_spectrum(Reading& reading, Params& params, std::string_view name, const Rgb& fallback) {
    if (const auto texture = texture_named(reading, params, name, fallback)) return *texture;
    return RgbTexture::constant(read_spectrum(reading, params, name, ColorUse::ratio).value_or(fallback));
}

FloatTexture read_glass_eta(Reading& reading, Params& params, std::string_view name, double fallback) {
    const Param* param = params.find_any(name);
    if (!param || param->type == Type::real || param->type == Type::texture) {
        return read_number(reading, params, name, fallback, kLeastEta, kMostEta);
    }
    const Rgb index = read_spectrum(reading, params, name, ColorUse::ratio).value_or(Rgb(1.5F));
    const bool grey = index.x == index.y && index.y == index.z;
    const float shade =
        reading.colours().is_srgb() ? luminance(index) : reading.colours().weights().dot(index);
    const float eta = grey ? index.x : shade;
    if (!(eta >= static_cast<float>(kLeastEta) && eta <= static_cast<float>(kMostEta))) {
        params.warn_or_refuse(params.place_of(name),
                              fmt::format("\"{}\" of {}: {:g} is not accepted; expected {:g} to {:g}", name,
                                          params.owner(), eta, kLeastEta, kMostEta),
                              fmt::format("{:g} is used", fallback));
        return FloatTexture::constant(static_cast<float>(fallback));
    }
    if (only_string(*param).rfind("glass-", 0) != 0) {
        params.warn_or_refuse(params.place_of(name), fmt::format("\"{}\": dispersion is not supported", name),
                              fmt::format("{:g} is used", eta));
    }
    return FloatTexture::constant(eta);
}

namespace {

// Limits roughness to 1, as no version describes rougher surfaces and some scenes contain them by mistake.
FloatTexture read_rough_number(Reading& reading, Params& params, const std::string& name,
                               const FloatTexture& fallback) {
    if (!params.find(name, {Type::real, Type::texture})) return fallback;
    const FloatTexture number =
        read_float(reading, params, name, static_cast<double>(fallback.constant_value().value_or(0)));
    const auto value = number.constant_value();
    if (!value || (*value >= 0 && *value <= 1)) return number;
    const float held = *value > 1 ? 1 : 0;
    params.warn_or_refuse(
        params.place_of(name),
        fmt::format("\"{}\" of {}: {:g} is not accepted; expected 0 to 1", name, params.owner(), *value),
        fmt::format("{:g} is used", held));
    return FloatTexture::constant(held);
}

}  // namespace

Roughness read_roughness(Reading& reading, Params& params, double fallback, Dialect dialect,
                         const std::string& prefix) {
    const FloatTexture both = read_rough_number(reading, params, prefix + "roughness",
                                                FloatTexture::constant(static_cast<float>(fallback)));
    Roughness roughness{read_rough_number(reading, params, prefix + "uroughness", both),
                        read_rough_number(reading, params, prefix + "vroughness", both)};
    // "remaproughness" exists from version 3 on.
    if (dialect == Dialect::v2 && params.has("remaproughness")) dialect = Dialect::v3;
    if (params.boolean("remaproughness", true)) {
        roughness.map = dialect == Dialect::v2   ? RoughnessMap::v2
                        : dialect == Dialect::v3 ? RoughnessMap::v3
                                                 : RoughnessMap::v4;
    }
    if (!roughness.x.constant_value() || !roughness.y.constant_value()) return roughness;
    const V2f alpha = roughness.alpha(V2f(0, 0));  // computed once instead of at every hit
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
        params.warn_or_refuse(
            params.place_of(prefix + "eta"),
            fmt::format("\"{}eta\" of {}: a texture is not accepted; expected a float or spectrum", prefix,
                        params.owner()),
            "1.5 is used");
    }
    coat.eta = eta.constant_value().value_or(1.5F);
    coat.roughness = read_roughness(reading, params, 0, Dialect::v4, prefix);
    coat.table = cover_of(reading, coat.eta, coat.roughness);
    // Accepts parameters of pbrt's random walk and medium between the layers; this varnish is clear.
    params.accept({"maxdepth", "nsamples", "g", "thickness"});
    const auto within = read_color(reading, params, "albedo", Rgb(0.0F));
    if (params.has("albedo") && !is_black(within.at(V2f(0.5F, 0.5F)))) {
        params.warn_or_refuse(params.place_of("albedo"), "\"albedo\" of a coating is not supported",
                              "the coating is clear");
    }
    return coat;
}

Relief read_relief(Reading& reading, Params& params) {
    Relief relief;
    for (const std::string_view name : {"bumpmap", "displacement"}) {
        if (!params.has(name)) continue;
        const FloatTexture height = read_float(reading, params, name, 0);
        if (!height.constant_value()) relief.displacement = height;  // a constant has no relief
    }
    const std::string name = params.string("normalmap", "");
    if (name.empty()) return relief;
    if (relief.displacement) {
        params.accept({"normalmap"});
        params.warn_or_refuse(params.place_of("normalmap"),
                              "\"normalmap\" and \"displacement\" exclude each other",
                              "the displacement is used");
        return relief;
    }
    try {
        relief.normals =
            image_texture<Rgb>(reading.images->open(reading.resolve(name), {Encoding::Kind::linear}), {});
    } catch (const InputError& error) {
        fail_always(params.place_of("normalmap"), "{}", printable(error.what()));
    }
    return relief;
}

}  // namespace lucerna
