// Textures of colours: constant, checkerboard, imagemap, and scale of constants.
#include <algorithm>

#include "engine/pbrt/state.h"

namespace lucerna {
namespace {

using Type = Param::Type;

NamedTexture constant_texture(const Rgb& value) {
    return {RgbTexture::constant(value), value, max_component(value)};
}

// A parameter that must be the same everywhere: rgb, a float for grey, or a constant texture.
Rgb constant_value(Reading& reading, Params& params, std::string_view name, const Rgb& fallback) {
    const Param* param = params.find(name, {Type::rgb, Type::texture, Type::real});
    if (!param) return fallback;
    if (param->type == Type::rgb) return to_rgb(*param);
    if (param->type == Type::real) return Rgb(static_cast<float>(params.real_within(name, 1, 0, 1e30)));
    const std::string wanted = param->strings.size() == 1 ? param->strings.front() : std::string();
    const auto found = reading.textures.find(wanted);
    if (found == reading.textures.end()) {
        fail(param->place, "\"{}\": no texture \"{}\" was made before", name, shown(wanted));
    }
    if (!found->second.constant) {
        fail(param->place, "\"{}\": texture \"{}\" varies; only a constant one is supported here yet", name,
             shown(wanted));
    }
    return *found->second.constant;
}

// Repeats of the pattern per unit of u and v; plain uv coordinates are the only ones.
V2f read_uv_scale(Params& params) {
    const std::string mapping = params.string("mapping", "uv");
    if (mapping != "uv") {
        fail(params.place_of("mapping"), "mapping \"{}\" is not supported yet; uv is", shown(mapping));
    }
    for (const std::string_view name : {"udelta", "vdelta"}) {
        if (params.real(name, 0) != 0) fail(params.place_of(name), "\"{}\" is not supported yet; 0 is", name);
    }
    return {static_cast<float>(params.real_within("uscale", 1, -1e6, 1e6)),
            static_cast<float>(params.real_within("vscale", 1, -1e6, 1e6))};
}

NamedTexture read_checkerboard(Reading& reading, Params& params) {
    if (params.integer("dimension", 2) != 2) {
        fail(params.place_of("dimension"),
             "a checkerboard in space is not supported yet; \"dimension\" 2 is");
    }
    params.accept({"aamode"});
    const Rgb even = constant_value(reading, params, "tex1", Rgb(1.0F));
    const Rgb odd = constant_value(reading, params, "tex2", Rgb(0.0F));
    const float largest = std::max(max_component(even), max_component(odd));
    return {RgbTexture::checkerboard(even, odd, read_uv_scale(params)), std::nullopt, largest};
}

// A choice of which only some values are supported.
void require_choice(Params& params, std::string_view name, std::string_view fallback,
                    std::initializer_list<std::string_view> accepted) {
    const std::string value = params.string(name, fallback);
    if (std::find(accepted.begin(), accepted.end(), value) != accepted.end()) return;
    fail(params.place_of(name), "{} \"{}\" is not supported yet; \"{}\" is", name, shown(value),
         *accepted.begin());
}

float largest_of(const Image& image) {
    return image.data.empty() ? 0.0F : *std::max_element(image.data.begin(), image.data.end());
}

double image_scale(Params& params) {
    const Param* scale = params.find("scale", {Type::real});
    return scale ? params.real_within("scale", 1, 0, 1e6) : 1;
}

NamedTexture read_imagemap(Reading& reading, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    const std::string name = params.string("filename", "");
    require_choice(params, "wrap", "repeat", {"repeat"});
    require_choice(params, "encoding", "sRGB", {"sRGB"});
    if (params.boolean("invert", false)) fail(params.place_of("invert"), "\"invert\" is not supported yet");
    if (!params.boolean("gamma", true))
        fail(params.place_of("gamma"), "\"gamma\" false is not supported yet");
    params.accept({"filter", "maxanisotropy", "trilinear"});
    const double scale = image_scale(params);
    const V2f uv_scale = read_uv_scale(params);

    std::shared_ptr<const Image>& image = reading.images[name];
    try {
        if (!image) image = read_texture_image(reading.resolve(name));
    } catch (const InputError& error) {
        fail(params.place_of("filename"), "{}", printable(error.what()));
    }
    if (scale == 1) return {RgbTexture::image(image, uv_scale), std::nullopt, largest_of(*image)};
    auto scaled = std::make_shared<Image>(*image);
    for (float& value : scaled->data) value *= static_cast<float>(scale);
    const float largest = largest_of(*scaled);
    return {RgbTexture::image(std::move(scaled), uv_scale), std::nullopt, largest};
}

// Version 4 multiplies "tex" by "scale", version 3 "tex1" by "tex2".
NamedTexture read_scale(Reading& reading, Params& params) {
    if (params.has("tex1") || params.has("tex2")) {
        return constant_texture(constant_value(reading, params, "tex1", Rgb(1.0F)) *
                                constant_value(reading, params, "tex2", Rgb(1.0F)));
    }
    return constant_texture(constant_value(reading, params, "tex", Rgb(1.0F)) *
                            constant_value(reading, params, "scale", Rgb(1.0F)));
}

}  // namespace

NamedTexture read_texture(Reading& reading, const std::string& kind, Params& params) {
    if (kind == "constant") return constant_texture(constant_value(reading, params, "value", Rgb(1.0F)));
    if (kind == "checkerboard") return read_checkerboard(reading, params);
    if (kind == "imagemap") return read_imagemap(reading, params);
    if (kind == "scale") return read_scale(reading, params);
    refuse_kind(
        params.place(), "Texture", kind, {"constant", "checkerboard", "imagemap", "scale"},
        {"bilerp", "directionmix", "dots", "fbm", "marble", "mix", "ptex", "uv", "windy", "wrinkled"});
}

FloatTexture read_float_texture(Reading& /*reading*/, const std::string& kind, Params& params) {
    if (kind != "constant") refuse_kind(params.place(), "Texture", kind, {"constant"}, {});
    return FloatTexture::constant(static_cast<float>(params.real("value", 1)));
}

FloatTexture read_float(Reading& reading, Params& params, std::string_view name, double fallback) {
    const Param* param = params.find(name, {Type::real, Type::texture});
    if (!param) return FloatTexture::constant(static_cast<float>(fallback));
    if (param->type == Type::real) return FloatTexture::constant(static_cast<float>(params.real(name, 1)));
    const std::string wanted = param->strings.size() == 1 ? param->strings.front() : std::string();
    const auto found = reading.float_textures.find(wanted);
    if (found == reading.float_textures.end()) {
        fail(param->place, "\"{}\": no texture \"{}\" of floats was made before", name, shown(wanted));
    }
    return found->second;
}

}  // namespace lucerna
