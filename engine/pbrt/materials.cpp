// Materials of both dialects. A material's own name tells which one it is written in: matte, glass, metal and
// mirror are version 3's, diffuse, dielectric and conductor version 4's. Only their defaults and the map from
// roughness to GGX's alpha differ.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/pbrt/state.h"

namespace lucerna {
namespace {

using Type = Param::Type;

enum class Dialect : std::uint8_t { v3, v4 };

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

// eta or k of a conductor: rgb, or a metal's named spectrum ("metal-Cu-eta").
Rgb metal_spectrum(Params& params, std::string_view name, const Rgb& fallback) {
    const Param* param = params.find(name, {Type::rgb, Type::spectrum});
    if (!param) return fallback;
    if (param->type == Type::rgb) return to_rgb(*param);
    const std::string wanted = param->strings.size() == 1 ? param->strings.front() : std::string();
    for (const Metal& metal : kMetals) {
        if (wanted == fmt::format("metal-{}-eta", metal.name)) return metal.eta;
        if (wanted == fmt::format("metal-{}-k", metal.name)) return metal.k;
    }
    fail(param->place,
         "spectrum \"{}\" is not supported yet; rgb is, and metal-X-eta and metal-X-k with X of Ag, "
         "Al, Au, Cu",
         shown(wanted));
}

double glass_eta(Reading& reading, Params& params, std::string_view name, double fallback) {
    const Param* param = params.find(name, {Type::real, Type::spectrum});
    if (!param) return fallback;
    if (param->type == Type::real) return params.real_within(name, fallback, 0.01, 100);
    const std::string wanted = param->strings.size() == 1 ? param->strings.front() : std::string();
    for (const Glass& glass : kGlasses) {
        if (wanted != glass.name) continue;
        reading.warn(param->place,
                     fmt::format("{}: no dispersion, {} at 587.6 nm is taken", wanted, glass.eta));
        return glass.eta;
    }
    std::vector<std::string_view> names;
    for (const Glass& glass : kGlasses) names.push_back(glass.name);
    fail(param->place, "spectrum \"{}\" is not supported yet; a float is, and {}", shown(wanted),
         fmt::join(names, ", "));
}

// pbrt's RoughnessToAlpha: version 3 fits a polynomial in the logarithm, version 4 takes the root.
double roughness_to_alpha(double roughness, Dialect dialect) {
    if (dialect == Dialect::v4) return std::sqrt(roughness);
    const double x = std::log(std::max(roughness, 1e-3));
    return 1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)));
}

struct Alpha {
    float x = 0, y = 0;  // 0: smooth
};

double roughness(Params& params, std::string_view name, double fallback) {
    const Param* param = params.find_any(name);
    if (param && param->type == Type::texture) {
        fail(param->place, "\"{}\": a texture is not supported here yet; a float is", name);
    }
    return params.real_within(name, fallback, 0, 1);
}

// `smooth_at_zero`: roughness 0 is a perfect surface, which version 3's glass knows and its metal does not.
Alpha read_alpha(Params& params, double fallback, Dialect dialect, bool smooth_at_zero) {
    const double both = roughness(params, "roughness", fallback);
    const double u = roughness(params, "uroughness", both);
    const double v = roughness(params, "vroughness", both);
    const bool remap = params.boolean("remaproughness", true);
    if (smooth_at_zero && u == 0 && v == 0) return {};
    const double x = remap ? roughness_to_alpha(u, dialect) : u;
    const double y = remap ? roughness_to_alpha(v, dialect) : v;
    if (std::max(x, y) < 1e-3) return {};  // pbrt calls it effectively smooth
    return {static_cast<float>(std::max(x, 1e-4)), static_cast<float>(std::max(y, 1e-4))};
}

Rgb constant_color(Params& params, std::string_view name, const Rgb& fallback) {
    const Param* param = params.find_any(name);
    if (param && param->type == Type::texture) {
        fail(param->place, "\"{}\": a texture is not supported here yet; rgb is", name);
    }
    const Rgb value = params.rgb(name, fallback);
    require_reflectance(params, name, value);
    return value;
}

void refuse_bump(const Params& params) {
    for (const std::string_view name : {"bumpmap", "displacement", "normalmap"}) {
        if (params.has(name)) fail(params.place_of(name), "\"{}\" is not supported yet", name);
    }
}

MaterialModel read_matte(Reading& reading, Params& params) {
    if (const Param* sigma = params.find_any("sigma")) {
        const bool zero =
            sigma->type == Type::real && sigma->numbers.size() == 1 && sigma->numbers.front() == 0;
        if (!zero) fail(sigma->place, "\"sigma\" (Oren-Nayar) is not supported yet; 0 is accepted");
    }
    return DiffuseMaterial{read_color(reading, params, "Kd", Rgb(0.5F))};
}

MaterialModel read_dielectric(Reading& reading, Params& params, Dialect dialect) {
    DielectricMaterial glass;
    double eta = glass_eta(reading, params, "eta", 1.5);
    if (dialect == Dialect::v3) {
        if (!params.has("eta")) eta = glass_eta(reading, params, "index", 1.5);
        glass.reflect = constant_color(params, "Kr", Rgb(1.0F));
        glass.transmit = constant_color(params, "Kt", Rgb(1.0F));
    }
    glass.eta = static_cast<float>(eta);
    const Alpha alpha = read_alpha(params, 0, dialect, true);
    glass.alpha_x = alpha.x, glass.alpha_y = alpha.y;
    return glass;
}

MaterialModel read_conductor(Params& params, Dialect dialect) {
    ConductorMaterial metal;
    const Metal& copper = kMetals[3];
    const bool by_reflectance = dialect == Dialect::v4 && params.has("reflectance");
    if (by_reflectance) {
        if (params.has("eta") || params.has("k")) {
            fail(params.place_of("reflectance"), "\"reflectance\" and \"eta\" or \"k\" exclude each other");
        }
        // pbrt: eta = 1 and the k whose reflectance at normal incidence is r.
        const Rgb r = constant_color(params, "reflectance", Rgb(0.5F));
        metal.eta = Rgb(1.0F);
        for (int c = 0; c < 3; ++c) {
            const float clamped = std::clamp(r[c], 0.0F, 0.9999F);  // keeps the divisor away from 0
            metal.k[c] = 2 * std::sqrt(clamped) / std::sqrt(1 - clamped);
        }
    } else {
        metal.eta = metal_spectrum(params, "eta", copper.eta);
        metal.k = metal_spectrum(params, "k", copper.k);
    }
    const Alpha alpha = dialect == Dialect::v4 ? read_alpha(params, 0, dialect, true)
                                               : read_alpha(params, 0.01, dialect, false);
    metal.alpha_x = alpha.x, metal.alpha_y = alpha.y;
    return metal;
}

}  // namespace

RgbTexture read_color(Reading& reading, Params& params, std::string_view name, const Rgb& fallback) {
    const Param* param = params.find(name, {Type::rgb, Type::texture});
    if (param && param->type == Type::texture) {
        const std::string wanted = param->strings.size() == 1 ? param->strings.front() : std::string();
        const auto found = reading.textures.find(wanted);
        if (found == reading.textures.end()) {
            fail(param->place, "\"{}\": no texture \"{}\" was made before", name, shown(wanted));
        }
        if (!(found->second.largest <= 1)) {
            fail(param->place, "\"{}\": texture \"{}\" reaches {:g}; a surface reflects at most 1", name,
                 shown(wanted), found->second.largest);
        }
        return found->second.texture;
    }
    const Rgb value = param ? to_rgb(*param) : fallback;
    require_reflectance(params, name, value);
    return RgbTexture::constant(value);
}

void require_reflectance(const Params& params, std::string_view name, const Rgb& value) {
    if (max_component(value) <= 1) return;
    fail(params.place_of(name), "\"{}\" is {:g} {:g} {:g}; a surface reflects at most 1, channel by channel",
         name, value.x, value.y, value.z);
}

MaterialModel read_material(Reading& reading, const std::string& kind, Params& params) {
    refuse_bump(params);
    if (kind == "diffuse") return DiffuseMaterial{read_color(reading, params, "reflectance", Rgb(0.5F))};
    if (kind == "matte") return read_matte(reading, params);
    if (kind == "mirror") return MirrorMaterial{read_color(reading, params, "Kr", Rgb(0.9F))};
    if (kind == "dielectric") return read_dielectric(reading, params, Dialect::v4);
    if (kind == "glass") return read_dielectric(reading, params, Dialect::v3);
    if (kind == "conductor") return read_conductor(params, Dialect::v4);
    if (kind == "metal") return read_conductor(params, Dialect::v3);
    if (kind.empty() || kind == "none" || kind == "interface") return InterfaceMaterial{};
    refuse_kind(params.place(), "Material", kind,
                {"diffuse", "dielectric", "conductor", "interface", "matte", "glass", "metal", "mirror"},
                {"bluepaint",           "brushedmetal", "clay",      "coateddiffuse", "coatedconductor",
                 "diffusetransmission", "disney",       "felt",      "fourier",       "hair",
                 "kdsubsurface",        "measured",     "mix",       "plastic",       "primer",
                 "shinymetal",          "skin",         "substrate", "subsurface",    "thindielectric",
                 "translucent",         "uber"});
}

}  // namespace lucerna
