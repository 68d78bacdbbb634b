// Replaces unsupported materials of pbrt by the nearest supported one. It preserves the reflectance and
// roughly its division into diffuse and gloss.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/pbrt/material_parts.h"

namespace lucerna {
namespace {

float normal_reflectance(float eta) {
    const float r = (eta - 1) / (eta + 1);
    return r * r;
}

template <typename Each>
Rgb each_channel(const Rgb& color, const Each& each) {
    return {each(color.x), each(color.y), each(color.z)};
}

std::shared_ptr<const Material> part(MaterialModel model) {
    return std::make_shared<const Material>(Material{"part", std::move(model)});
}
MaterialModel mixed(MaterialModel first, MaterialModel second, const FloatTexture& share) {
    return MixMaterial{part(std::move(first)), part(std::move(second)), share};
}

// ---- hair

// Returns the colour of a whole head of hair with this absorption and azimuthal roughness of the fibres
// [Chiang 2016, 4.2].
float color_of_hair(float sigma_a, float beta) {
    const float b2 = beta * beta;
    const float d = 5.969F - 0.215F * beta + 2.532F * b2 - 10.73F * b2 * beta + 5.574F * b2 * b2 +
                    0.245F * b2 * b2 * beta;
    return exp(-std::sqrt(std::max(0.0F, sigma_a)) * d);
}

// Absorption per concentration [d'Eon 2011], in red, green and blue.
const Rgb kEumelanin(0.419F, 0.697F, 1.37F), kPheomelanin(0.187F, 0.4F, 1.05F);

RgbTexture read_hair_color(Reading& reading, Params& params, float beta) {
    const Rgb eumelanin_sigma = reading.colours().ratio(kEumelanin);
    const auto of_absorption = [beta](const Rgb& sigma_a) {
        return RgbTexture::constant(
            each_channel(sigma_a, [beta](float sigma) { return color_of_hair(sigma, beta); }));
    };
    for (const std::string_view name : {"reflectance", "color"}) {
        if (params.has(name)) return read_color(reading, params, name, Rgb(0.5F));
    }
    if (params.has("sigma_a")) {
        const auto sigma_a = read_index_spectrum(reading, params, "sigma_a", eumelanin_sigma * 1.3F);
        return of_absorption(sigma_a.constant_value().value_or(eumelanin_sigma * 1.3F));
    }
    const bool given = params.has("eumelanin") || params.has("pheomelanin");
    const auto amount = [&](std::string_view name, double fallback) {
        return read_number(reading, params, name, fallback, 0, 1e6)
            .constant_value()
            .value_or(static_cast<float>(fallback));
    };
    const float eumelanin = amount("eumelanin", given ? 0 : 1.3), pheomelanin = amount("pheomelanin", 0);
    return of_absorption(eumelanin_sigma * eumelanin + reading.colours().ratio(kPheomelanin) * pheomelanin);
}

// Reads hair. Half of the light passes through the fibre, so that light behind thin hair is visible.
MaterialModel read_hair(Reading& reading, Params& params) {
    const auto number = [&](std::string_view name, double fallback) {
        return read_number(reading, params, name, fallback, 0, 10)
            .constant_value()
            .value_or(static_cast<float>(fallback));
    };
    const float along = number("beta_m", 0.3), around = number("beta_n", 0.3), eta = number("eta", 1.55);
    const RgbTexture color = read_hair_color(reading, params, around);
    params.accept({"alpha"});
    const Roughness roughness = Roughness::of_alpha(std::clamp(along, 0.05F, 1.0F));
    SubstrateMaterial back{color, RgbTexture::constant(Rgb(std::min(1.0F, normal_reflectance(eta)))),
                           roughness};
    DiffuseTransmissionMaterial onward{RgbTexture::constant(Rgb(0)), color};
    return mixed(std::move(back), std::move(onward), FloatTexture::constant(0.5F));
}

// ---- subsurface scattering

// Returns the internal diffuse reflectance of a refracting surface (the fit of [Egan and Hilgeman 1979] in
// [Jensen et al. 2001]).
float inner_reflectance(float eta) {
    return std::clamp(-1.440F / (eta * eta) + 0.710F / eta + 0.668F + 0.0636F * eta, 0.0F, 0.99F);
}

// Returns the total diffuse reflectance of a half-space by the dipole [Jensen et al. 2001, 2.4], relative to
// the light that enters it.
float dipole_reflectance(float sigma_a, float reduced_sigma_s, float eta) {
    const float extinction = sigma_a + reduced_sigma_s;
    if (!(extinction > 0)) return 0;
    const float albedo = reduced_sigma_s / extinction;
    const float fdr = inner_reflectance(eta), a = (1 + fdr) / (1 - fdr);
    const float root = std::sqrt(3 * (1 - albedo));
    return albedo / 2 * (1 + exp(-4.0F / 3 * a * root)) * exp(-root);
}

// Returns the albedo of the base that gives this reflectance after interreflection below the surface.
float base_of(float reflectance, float eta) {
    const float fdr = inner_reflectance(eta);
    return reflectance / (1 - fdr + reflectance * fdr);
}

struct Volume {
    Rgb sigma_a, sigma_s;
};

Volume read_volume_coefficients(Reading& reading, Params& params) {
    const MeasuredMedium& fallback = *measured_medium("Wholemilk");
    const WorkingSpace& colours = reading.colours();
    Volume volume{colours.ratio(fallback.sigma_a), colours.ratio(fallback.sigma_s)};
    const std::string name = params.string("name", "");
    if (const MeasuredMedium* named = measured_medium(name)) {
        volume = {colours.ratio(named->sigma_a), colours.ratio(named->sigma_s)};
    } else if (!name.empty()) {
        params.warn_or_refuse(
            params.place_of("name"),
            fmt::format("\"name\": \"{}\" is unknown; {}", shown(name), accepted_measured_media(name)),
            "the coefficients given, or whole milk's, are used");
    }
    const auto coefficient = [&](std::string_view what, const Rgb& otherwise) {
        const auto texture = read_index_spectrum(reading, params, what, otherwise);
        const Rgb value = texture.constant_value().value_or(texture.at(V2f(0.5F, 0.5F)));
        return each_channel(value, [](float x) { return std::max(0.0F, x); });
    };
    volume.sigma_a = coefficient("sigma_a", volume.sigma_a);
    volume.sigma_s = coefficient("sigma_s", volume.sigma_s);
    volume.sigma_s = coefficient("sigma_prime_s", volume.sigma_s);
    return volume;
}

MaterialModel read_subsurface(Reading& reading, Params& params) {
    const std::string_view index = params.has("eta") ? "eta" : "index";
    const float eta = read_glass_eta(reading, params, index, 1.33).constant_value().value_or(1.33F);
    const auto g = static_cast<float>(params.real_within("g", 0, -1, 1));
    // Accepts parameters of the mean free path, which a surface does not show.
    params.accept({"scale", "mfp", "meanfreepath"});
    CoatedDiffuseMaterial material;
    const auto as_base = [eta](const RgbTexture& reflectance) {
        const auto value = reflectance.constant_value();
        if (!value) return reflectance;  // for a texture, interreflection between base and surface is ignored
        return RgbTexture::constant(each_channel(*value, [eta](float r) { return base_of(r, eta); }));
    };
    if (params.has("Kd") || params.owner().find("kdsubsurface") != std::string::npos) {
        material.reflectance = as_base(read_color(reading, params, "Kd", Rgb(0.5F)));
    } else if (params.has("reflectance")) {
        material.reflectance = as_base(read_color(reading, params, "reflectance", Rgb(0.5F)));
    } else {
        const Volume volume = read_volume_coefficients(reading, params);
        Rgb base;
        for (int k = 0; k < 3; ++k) {
            base[k] = base_of(dipole_reflectance(volume.sigma_a[k], volume.sigma_s[k] * (1 - g), eta), eta);
        }
        material.reflectance = RgbTexture::constant(base);
    }
    const bool rough = params.has("roughness") || params.has("uroughness") || params.has("vroughness");
    const bool version3 = params.has("Kr") || params.has("Kt") || reading.old_dialect;
    const auto zero = [&](std::string_view name) {
        return !params.has(name) || read_float(reading, params, name, 0).constant_value() == 0.0F;
    };
    const bool smooth = !rough || (zero("roughness") && zero("uroughness") && zero("vroughness"));
    params.accept({"remaproughness"});
    if (!smooth)
        material.coat.roughness = read_roughness(reading, params, 0, version3 ? Dialect::v3 : Dialect::v4);
    params.accept({"Kr", "Kt"});
    if (!(std::fabs(eta - 1) > 1e-3F)) return DiffuseMaterial{material.reflectance};
    material.coat.eta = eta;
    material.coat.table = cover_of(reading, eta, material.coat.roughness);
    return material;
}

// ---- "disney" of version 3

MaterialModel read_disney(Reading& reading, Params& params) {
    const RgbTexture color = read_color(reading, params, "color", Rgb(0.5F));
    const auto share = [&](std::string_view name) { return read_number(reading, params, name, 0, 0, 1); };
    const FloatTexture rough = read_number(reading, params, "roughness", 0.5, 0, 1);
    const float r = rough.constant_value().value_or(0.5F);
    const Roughness roughness = Roughness::of_alpha(std::max(1e-3F, r * r));
    const FloatTexture eta = read_glass_eta(reading, params, "eta", 1.5);
    const float gloss = normal_reflectance(eta.constant_value().value_or(1.5F));
    params.accept({"anisotropic", "speculartint", "sheen", "sheentint", "clearcoat", "clearcoatgloss",
                   "scatterdistance", "thin", "difftrans", "flatness"});
    MaterialModel model =
        SubstrateMaterial{color, RgbTexture::constant(Rgb(std::min(1.0F, gloss))), roughness};
    const FloatTexture metallic = share("metallic"), glassy = share("spectrans");
    if (glassy.constant_value() != 0.0F) {
        DielectricMaterial glass;
        glass.eta = eta;
        glass.transmit = color;
        glass.roughness = roughness;
        model = mixed(std::move(model), std::move(glass), glassy);
    }
    if (metallic.constant_value() != 0.0F) {
        ConductorMaterial metal;
        metal.reflectance = color;
        metal.roughness = roughness;
        model = mixed(std::move(model), std::move(metal), metallic);
    }
    return model;
}

// ---- tables, and appearances that a file's name suggests

struct NamedAppearance {
    std::string_view word;  // in the file's name
    Rgb color;
    float gloss;  // reflectance at normal incidence; 1: a metal of that colour
};
constexpr float kVarnish = 0.04F;
const NamedAppearance kAppearances[] = {
    {"gold", {0.96F, 0.77F, 0.35F}, 1},          {"copper", {0.93F, 0.62F, 0.51F}, 1},
    {"silver", {0.95F, 0.93F, 0.90F}, 1},        {"alum", {0.91F, 0.92F, 0.92F}, 1},
    {"brass", {0.89F, 0.77F, 0.43F}, 1},         {"chrome", {0.55F, 0.56F, 0.56F}, 1},
    {"steel", {0.57F, 0.56F, 0.55F}, 1},         {"nickel", {0.66F, 0.61F, 0.53F}, 1},
    {"metal", {0.60F, 0.60F, 0.60F}, 1},         {"leather", {0.20F, 0.12F, 0.08F}, kVarnish},
    {"wood", {0.35F, 0.22F, 0.12F}, kVarnish},   {"white", {0.75F, 0.75F, 0.75F}, kVarnish},
    {"black", {0.03F, 0.03F, 0.03F}, kVarnish},  {"red", {0.45F, 0.05F, 0.04F}, kVarnish},
    {"green", {0.08F, 0.30F, 0.08F}, kVarnish},  {"blue", {0.05F, 0.12F, 0.45F}, kVarnish},
    {"yellow", {0.65F, 0.50F, 0.06F}, kVarnish}, {"orange", {0.60F, 0.25F, 0.04F}, kVarnish},
    {"purple", {0.25F, 0.08F, 0.35F}, kVarnish}, {"pink", {0.70F, 0.35F, 0.40F}, kVarnish},
    {"ceramic", {0.70F, 0.70F, 0.68F}, kVarnish}};

MaterialModel appearance_of_name(const std::string& name, const WorkingSpace& colours) {
    constexpr float kAlpha = 0.2F;
    std::string lower = name;
    std::ranges::transform(lower, lower.begin(),
                           [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
    if (lower.find("glass") != lower.npos) {
        DielectricMaterial glass;
        glass.roughness = Roughness::of_alpha(kAlpha);
        return glass;
    }
    for (const NamedAppearance& appearance : kAppearances) {
        if (lower.find(appearance.word) == lower.npos) continue;
        if (appearance.gloss < 1) {
            return SubstrateMaterial{RgbTexture::constant(colours.ratio(appearance.color)),
                                     RgbTexture::constant(Rgb(appearance.gloss)),
                                     Roughness::of_alpha(kAlpha)};
        }
        ConductorMaterial metal;
        metal.reflectance = RgbTexture::constant(colours.ratio(appearance.color));
        metal.roughness = Roughness::of_alpha(kAlpha);
        return metal;
    }
    return SubstrateMaterial{RgbTexture::constant(Rgb(0.5F)), RgbTexture::constant(Rgb(kVarnish)),
                             Roughness::of_alpha(kAlpha)};
}

// Converts a fit, which is in linear sRGB.
MaterialModel appearance_of_table(const TableFit& fit, const WorkingSpace& colours) {
    const Roughness roughness = Roughness::of_alpha(fit.alpha);
    const auto constant = [&](const Rgb& c) { return RgbTexture::constant(colours.ratio(c)); };
    MaterialModel front = SubstrateMaterial{constant(fit.diffuse), constant(fit.gloss), roughness};
    const float through = luminance(fit.transmitted), all = through + luminance(fit.diffuse + fit.gloss);
    if (!(through > 0.02F)) return front;
    DielectricMaterial glass;
    glass.eta = FloatTexture::constant(fit.eta);
    glass.transmit = constant(fit.transmitted * (1 / std::max(through, max_component(fit.transmitted))));
    glass.roughness = roughness;
    if (through > 0.5F * all) return glass;
    return mixed(std::move(front), std::move(glass), FloatTexture::constant(through / all));
}

MaterialModel read_table(Reading& reading, const std::string& kind, Params& params) {
    const std::string_view parameter = kind == "fourier" ? "bsdffile" : "filename";
    const std::string name = params.string(parameter, "");
    const std::filesystem::path file = reading.resolve(name);
    std::optional<TableFit> fit;
    std::error_code status;
    if (!name.empty() && std::filesystem::is_regular_file(file, status)) fit = fit_bsdf_table(file);
    params.warn_or_refuse(params.place(), fmt::format("material \"{}\" is not supported", kind),
                          fit ? "a diffuse and a glossy lobe fitted to its table are used"
                              : fmt::format("a diffuse and a glossy lobe chosen by the name \"{}\" are used",
                                            shown(std::filesystem::path(name).stem().string())),
                          "the table's detail");
    const WorkingSpace& colours = reading.colours();
    return fit ? appearance_of_table(*fit, colours)
               : appearance_of_name(std::filesystem::path(name).stem().string(), colours);
}

// ---- measured paints and cloths of version 1

struct Paint {
    std::string_view name;
    Rgb diffuse;
    float gloss, alpha;
};
// Estimated by eye from the reflection of such surfaces: a paint has the gloss of its binder, cloth and clay
// almost none.
const Paint kPaints[] = {{"bluepaint", {0.31F, 0.40F, 0.70F}, 0.04F, 0.25F},
                         {"clay", {0.38F, 0.26F, 0.27F}, 0.02F, 0.7F},
                         {"felt", {0.08F, 0.08F, 0.08F}, 0.01F, 1.0F},
                         {"primer", {0.13F, 0.13F, 0.14F}, 0.03F, 0.5F},
                         {"skin", {0.43F, 0.30F, 0.33F}, 0.028F, 0.4F}};

std::optional<MaterialModel> read_paint(const Reading& reading, const std::string& kind, Params& params) {
    std::optional<MaterialModel> model;
    if (kind == "brushedmetal") {
        ConductorMaterial metal;
        metal.reflectance = RgbTexture::constant(Rgb(0.6F));
        metal.roughness = Roughness::of_alpha(0.15F, 0.4F);
        model = std::move(metal);
    }
    for (const Paint& paint : kPaints) {
        if (kind != paint.name) continue;
        model = SubstrateMaterial{RgbTexture::constant(reading.colours().ratio(paint.diffuse)),
                                  RgbTexture::constant(Rgb(paint.gloss)), Roughness::of_alpha(paint.alpha)};
    }
    if (model) {
        params.warn_or_refuse(params.place(), fmt::format("material \"{}\" is not supported", kind),
                              "a diffuse and a glossy lobe of similar appearance are used",
                              "its measured lobes");
    }
    return model;
}

}  // namespace

std::optional<MaterialModel> read_stand_in(Reading& reading, const std::string& kind, Params& params) {
    const auto instead = [&](std::string_view what, std::string_view lost) {
        params.warn_or_refuse(params.place(), fmt::format("material \"{}\" is not supported", kind), what,
                              lost);
    };
    if (kind == "hair") {
        instead("a diffuse and a glossy lobe of its colour are used, half of it transmitted",
                "the position of highlights along the fibre");
        return read_hair(reading, params);
    }
    if (kind == "subsurface" || kind == "kdsubsurface") {
        instead("a coated diffuse surface of the same albedo is used", "subsurface scattering");
        return read_subsurface(reading, params);
    }
    if (kind == "disney") {
        instead("a mixture of coated diffuse, metal and glass in its proportions is used",
                "sheen, clear coat and subsurface scattering");
        return read_disney(reading, params);
    }
    if (kind == "fourier" || kind == "measured") return read_table(reading, kind, params);
    return read_paint(reading, kind, params);
}

}  // namespace lucerna
