// Textures of colours and of numbers, of every kind in pbrt except ptex. Both use the same readers; they
// differ in how a value is written and in which names they see.
//
// The current transformation places a texture in the world, so a texture is evaluated at the inverse
// transform of a point. Versions 1 to 3 use the transformation itself for textures that fill space, and none
// for the planar mapping. This reader does so where the text shows that it is of version 1 or 2, as version 3
// cannot be told from version 4.
#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

#include "engine/pbrt/state.h"
#include "engine/scene/texture_patterns.h"
#include "engine/text/spelling.h"

namespace lucerna {
namespace {

using Type = Param::Type;

std::string name_in(const Param& param) {
    return param.strings.size() == 1 ? param.strings.front() : std::string();
}

// Returns null, with a report, if there is no such texture.
template <typename Textures>
auto made_before(const Textures& textures, const Params& params, const Param& param, std::string_view of)
    -> const typename Textures::mapped_type* {
    const std::string wanted = name_in(param);
    const auto found = textures.find(wanted);
    if (found != textures.end()) return &found->second;
    std::vector<std::string_view> names;
    for (const auto& [name, texture] : textures) names.push_back(name);
    params.warn_or_refuse(
        param.place,
        fmt::format("\"{}\": there is no texture \"{}\" of {}; {}{} are defined", shown(param.name),
                    shown(wanted), of, did_you_mean(wanted, names), names.size()),
        "the default is used");
    return nullptr;
}

// Reads a parameter that may vary: a value, or the name of a texture of the same type.
template <typename Value>
Texture<Value> read_value(Reading& reading, Params& params, std::string_view name, float fallback) {
    if constexpr (std::is_same_v<Value, float>) {
        return read_float(reading, params, name, static_cast<double>(fallback));
    } else {
        const Param* param = params.find_any(name);
        if (!param) return RgbTexture::constant(Rgb(fallback));
        if (param->type == Type::texture) {
            const NamedTexture* named = made_before(reading.textures, params, *param, "colours");
            return named ? named->texture : RgbTexture::constant(Rgb(fallback));
        }
        if (param->type == Type::real) {
            return RgbTexture::constant(Rgb(static_cast<float>(params.real_within(name, 1, 0, 1e30))));
        }
        return RgbTexture::constant(
            read_spectrum(reading, params, name, ColorUse::ratio).value_or(Rgb(fallback)));
    }
}

// Reads a parameter that must be constant.
template <typename Value>
Value read_constant(Reading& reading, Params& params, std::string_view name, float fallback) {
    const auto value = read_value<Value>(reading, params, name, fallback).constant_value();
    if (value) return *value;
    params.warn_or_refuse(params.place_of(name),
                          fmt::format("\"{}\" of {}: expected a constant", name, params.owner()),
                          fmt::format("{:g} is used", fallback));
    return Value(fallback);
}

M44d texture_from_world(const Reading& reading, const Params& params) {
    const std::optional<M44d> result = inverse(reading.state.ctm);
    if (result) return *result;
    params.warn_or_refuse(params.place(), params.owner() + ": its transformation is not invertible",
                          "the texture uses world coordinates");
    return M44d();
}

V3d read_vector(Params& params, std::string_view name, const V3d& fallback) {
    const Param* param = params.find(name, {Type::vector3, Type::point3, Type::normal3});
    if (!param) return fallback;
    if (param->numbers.size() != 3) {
        fail(param->place, "\"{}\" has {} numbers; expected 3", name, param->numbers.size());
    }
    return {param->numbers[0], param->numbers[1], param->numbers[2]};
}

Mapping2 read_mapping(Reading& reading, Params& params) {
    const std::string mapping = params.string("mapping", "uv");
    const auto number = [&](std::string_view name, double fallback) {
        return params.real_within(name, fallback, -1e6, 1e6);
    };
    if (mapping == "uv") {
        return UvMapping{V2f(V2d(number("uscale", 1), number("vscale", 1))),
                         V2f(V2d(number("udelta", 0), number("vdelta", 0)))};
    }
    if (mapping == "spherical") return SphericalMapping{texture_from_world(reading, params)};
    if (mapping == "cylindrical") return CylindricalMapping{texture_from_world(reading, params)};
    if (mapping == "planar") {
        return PlanarMapping{reading.old_dialect ? M44d() : texture_from_world(reading, params),
                             read_vector(params, "v1", V3d(1, 0, 0)),
                             read_vector(params, "v2", V3d(0, 1, 0)),
                             {number("udelta", 0), number("vdelta", 0)}};
    }
    constexpr std::string_view known[] = {"uv", "spherical", "cylindrical", "planar"};
    params.warn_or_refuse(
        params.place_of("mapping"),
        fmt::format("mapping \"{}\" is unknown; {}expected uv, spherical, cylindrical or planar",
                    shown(mapping), did_you_mean(mapping, known)),
        "uv is used");
    return UvMapping{V2f(1, 1), V2f(0, 0)};
}

Mapping3 read_mapping_in_space(const Reading& reading, const Params& params) {
    if (reading.old_dialect) return {reading.state.ctm};
    return {texture_from_world(reading, params)};
}

Octaves read_octaves(Params& params) {
    Octaves octaves;
    octaves.count = params.integer("octaves", octaves.count);
    if (octaves.count < 0 || octaves.count > 64) {
        const int held = std::clamp(octaves.count, 0, 64);
        params.warn_or_refuse(params.place_of("octaves"),
                              fmt::format("octaves {} is not accepted; expected 0 to 64", octaves.count),
                              fmt::format("{} is used", held));
        octaves.count = held;
    }
    octaves.omega = params.real_within("roughness", octaves.omega, 0, 4);
    return octaves;
}

template <typename Value>
Texture<Value> read_checkerboard(Reading& reading, Params& params) {
    const int dimension = params.integer("dimension", 2);
    if (dimension != 2 && dimension != 3) {
        fail(params.place_of("dimension"), "\"dimension\" {} is not accepted; expected 2 or 3", dimension);
    }
    params.accept({"aamode"});
    const auto even = read_value<Value>(reading, params, "tex1", 1);
    const auto odd = read_value<Value>(reading, params, "tex2", 0);
    if (dimension == 3) return checkerboard_texture(even, odd, read_mapping_in_space(reading, params));
    return checkerboard_texture(even, odd, read_mapping(reading, params));
}

// Version 4 multiplies "tex" by a number "scale", version 3 "tex1" by "tex2".
template <typename Value>
Texture<Value> read_scale(Reading& reading, Params& params) {
    if (params.has("tex1") || params.has("tex2")) {
        return product_texture(read_value<Value>(reading, params, "tex1", 1),
                               read_value<Value>(reading, params, "tex2", 1));
    }
    const auto scaled = read_value<Value>(reading, params, "tex", 1);
    const Param* scale = params.find_any("scale");
    const bool of_color = scale && scale->type != Type::real && scale->type != Type::texture;
    if (of_color) return product_texture(scaled, read_value<Value>(reading, params, "scale", 1));
    return scaled_texture(scaled, read_float(reading, params, "scale", 1));
}

template <typename Value>
Texture<Value> read_mix_texture(Reading& reading, Params& params) {
    const auto a = read_value<Value>(reading, params, "tex1", 0);
    const auto b = read_value<Value>(reading, params, "tex2", 1);
    return mix_texture(a, b, read_float(reading, params, "amount", 0.5));
}

template <typename Value>
Texture<Value> read_direction_mix(Reading& reading, Params& params) {
    const auto a = read_value<Value>(reading, params, "tex1", 0);
    const auto b = read_value<Value>(reading, params, "tex2", 1);
    const V3d direction = transform_vector(reading.state.ctm, read_vector(params, "dir", V3d(0, 1, 0)));
    if (!(direction.length2() > 0))
        fail(params.place_of("dir"), "\"dir\" of {} has no length", params.owner());
    return direction_mix_texture(a, b, direction.normalized());
}

template <typename Value>
Texture<Value> read_bilerp(Reading& reading, Params& params) {
    const std::array<Value, 4> corners = {
        read_constant<Value>(reading, params, "v00", 0), read_constant<Value>(reading, params, "v01", 1),
        read_constant<Value>(reading, params, "v10", 0), read_constant<Value>(reading, params, "v11", 1)};
    return bilerp_texture(corners, read_mapping(reading, params));
}

template <typename Value>
Texture<Value> read_dots(Reading& reading, Params& params) {
    const auto inside = read_value<Value>(reading, params, "inside", 1);
    const auto outside = read_value<Value>(reading, params, "outside", 0);
    return dots_texture(inside, outside, read_mapping(reading, params));
}

// Reads the encoding. "encoding" is version 4's; "gamma" is a Boolean in version 3 and an exponent in version
// 2.
Encoding read_encoding(Params& params) {
    if (const Param* gamma = params.find("gamma", {Type::boolean, Type::real})) {
        if (gamma->type == Type::real) {
            return {Encoding::Kind::power, static_cast<float>(params.real_within("gamma", 1, 0.01, 100))};
        }
        return {params.boolean("gamma", true) ? Encoding::Kind::srgb : Encoding::Kind::linear};
    }
    if (!params.has("encoding")) return {};
    const std::string name = params.string("encoding", "sRGB");
    if (name == "sRGB") return {Encoding::Kind::srgb};
    if (name == "linear") return {Encoding::Kind::linear};
    if (name.starts_with("gamma ")) {
        const double exponent = number_value(std::string_view(name).substr(6), params.place_of("encoding"));
        if (exponent >= 0.01 && exponent <= 100) return {Encoding::Kind::power, static_cast<float>(exponent)};
    }
    params.warn_or_refuse(
        params.place_of("encoding"),
        fmt::format("encoding \"{}\" is unknown; expected sRGB, linear or \"gamma x\" (0.01 to 100)",
                    shown(name)),
        "sRGB is used");
    return {Encoding::Kind::srgb};
}

Wrap read_wrap(Reading& reading, Params& params) {
    const std::string name = params.string("wrap", "repeat");
    if (name == "repeat") return Wrap::repeat;
    if (name == "clamp") return Wrap::clamp;
    if (name == "black") return Wrap::black;
    if (name == "octahedralsphere") {
        reading.warn_or_refuse(params.place_of("wrap"), "wrap octahedralsphere is not supported",
                               "clamp is used");
        return Wrap::clamp;
    }
    params.warn_or_refuse(
        params.place_of("wrap"),
        fmt::format("wrap \"{}\" is unknown; expected repeat, clamp, black or octahedralsphere", shown(name)),
        "repeat is used");
    return Wrap::repeat;
}

template <typename Value>
Texture<Value> read_imagemap(Reading& reading, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    const std::string name = params.string("filename", "");
    params.accept({"filter", "maxanisotropy", "trilinear"});
    ImageLookup lookup;
    lookup.mapping = read_mapping(reading, params);
    lookup.wrap = read_wrap(reading, params);
    lookup.scale = static_cast<float>(params.real_within("scale", 1, 0, 1e6));
    lookup.invert = params.boolean("invert", false);
    const Encoding encoding = read_encoding(params);
    const std::filesystem::path file = reading.resolve(name);
    std::error_code status;
    if (reading.skip_missing && !std::filesystem::exists(file, status)) {
        reading.warn(params.place_of("filename"),
                     fmt::format("{}: the file is missing; grey is used", printable(file.string())));
        return Texture<Value>::constant(Value(0.5F));
    }
    try {
        // A texture of numbers uses the luminance of the image.
        const WorkingSpace colours = std::is_same_v<Value, float> ? WorkingSpace() : reading.colours();
        const auto warn = [&](const std::string& text) {
            reading.warn(params.place_of("filename"), printable(text));
        };
        return image_texture<Value>(reading.images->open(file, encoding, colours, warn), lookup);
    } catch (const InputError& error) {
        fail_always(params.place_of("filename"), "{}", printable(error.what()));
    }
}

// Converts a pattern that has colours of its own, in linear sRGB.
template <typename Value>
Texture<Value> from_color(const Reading& reading, const RgbTexture& texture) {
    if constexpr (std::is_same_v<Value, float>) {
        return luminance_texture(texture);
    } else {
        return ratio_texture(texture, reading.colours());
    }
}

// Converts noise, which is a number, to grey that is not negative.
template <typename Value>
Texture<Value> from_number(const FloatTexture& texture) {
    if constexpr (std::is_same_v<Value, float>) {
        return texture;
    } else {
        return grey_texture(texture);
    }
}

RgbTexture read_marble(Reading& reading, Params& params) {
    Marble marble;
    marble.octaves = read_octaves(params);
    marble.scale = params.real_within("scale", marble.scale, -1e6, 1e6);
    marble.variation = params.real_within("variation", marble.variation, -1e6, 1e6);
    return marble_texture(marble, read_mapping_in_space(reading, params));
}

// ptex has one texel array per face, a format that is not supported.
template <typename Value>
Texture<Value> read_ptex(Params& params) {
    params.accept({"filename", "gamma", "encoding", "scale"});
    params.warn_or_refuse(params.place(), params.owner() + " is not supported", "grey of 0.5 is used",
                          "the image on the surface");
    return Texture<Value>::constant(Value(0.5F));
}

[[noreturn]] void refuse_texture(const std::string& kind, const Params& params) {
    refuse_kind(params.place(), "Texture", kind,
                {"bilerp", "checkerboard", "constant", "directionmix", "dots", "fbm", "imagemap", "marble",
                 "mix", "ptex", "scale", "uv", "windy", "wrinkled"},
                {});
}

template <typename Value>
Texture<Value> read_any(Reading& reading, const std::string& kind, Params& params) {
    if (kind == "constant") return read_value<Value>(reading, params, "value", 1);
    if (kind == "imagemap") return read_imagemap<Value>(reading, params);
    if (kind == "scale") return read_scale<Value>(reading, params);
    if (kind == "mix") return read_mix_texture<Value>(reading, params);
    if (kind == "directionmix") return read_direction_mix<Value>(reading, params);
    if (kind == "checkerboard") return read_checkerboard<Value>(reading, params);
    if (kind == "bilerp") return read_bilerp<Value>(reading, params);
    if (kind == "dots") return read_dots<Value>(reading, params);
    if (kind == "uv") return from_color<Value>(reading, uv_texture(read_mapping(reading, params)));
    if (kind == "marble") return from_color<Value>(reading, read_marble(reading, params));
    if (kind == "ptex") return read_ptex<Value>(params);
    const bool noise = kind == "fbm" || kind == "wrinkled" || kind == "windy";
    if (!noise) refuse_texture(kind, params);
    const Octaves octaves = kind == "windy" ? Octaves{} : read_octaves(params);
    const Mapping3 mapping = read_mapping_in_space(reading, params);
    if (kind == "fbm") return from_number<Value>(fbm_texture(octaves, mapping));
    if (kind == "wrinkled") return from_number<Value>(wrinkled_texture(octaves, mapping));
    return from_number<Value>(windy_texture(mapping));
}

}  // namespace

NamedTexture read_texture(Reading& reading, const std::string& kind, Params& params) {
    const RgbTexture texture = read_any<Rgb>(reading, kind, params);
    return {texture, texture.constant_value(), texture.largest()};
}

FloatTexture read_float_texture(Reading& reading, const std::string& kind, Params& params) {
    return read_any<float>(reading, kind, params);
}

FloatTexture read_float(Reading& reading, Params& params, std::string_view name, double fallback) {
    const Param* param = params.find(name, {Type::real, Type::texture});
    if (!param) return FloatTexture::constant(static_cast<float>(fallback));
    if (param->type == Type::texture) {
        const FloatTexture* named = made_before(reading.float_textures, params, *param, "floats");
        return named ? *named : FloatTexture::constant(static_cast<float>(fallback));
    }
    return FloatTexture::constant(static_cast<float>(params.real_within(name, fallback, -1e30, 1e30)));
}

}  // namespace lucerna
