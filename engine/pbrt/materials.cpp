// Materials of all versions, with one reader per name or per name and its successor.
#include <fmt/format.h>

#include <algorithm>

#include "engine/pbrt/material_parts.h"
#include "engine/text/spelling.h"

namespace lucerna {
namespace {

Dialect old_dialect(const Reading& reading) {
    return reading.old_dialect ? Dialect::v2 : Dialect::v3;
}

MaterialModel read_matte(Reading& reading, Params& params) {
    return DiffuseMaterial{read_color(reading, params, "Kd", Rgb(0.5F)),
                           read_number(reading, params, "sigma", 0, 0, 90)};
}

FloatTexture read_old_eta(Reading& reading, Params& params) {
    return read_glass_eta(reading, params, params.has("eta") ? "eta" : "index", 1.5);
}

MaterialModel read_glass(Reading& reading, Params& params) {
    DielectricMaterial glass;
    glass.eta = read_old_eta(reading, params);
    glass.reflect = read_color(reading, params, "Kr", Rgb(1.0F));
    glass.transmit = read_color(reading, params, "Kt", Rgb(1.0F));
    // Version 3's roughness map has no smooth surface, but its glass has.
    const bool rough = params.has("roughness") || params.has("uroughness") || params.has("vroughness");
    const auto zero = [&](std::string_view name) {
        return read_float(reading, params, name, 0).constant_value() == 0.0F;
    };
    const bool remap = params.boolean("remaproughness", true);
    const bool smooth = !rough || (zero("roughness") && zero("uroughness") && zero("vroughness"));
    if (!smooth || !remap) glass.roughness = read_roughness(reading, params, 0, old_dialect(reading));
    return glass;
}

MaterialModel read_dielectric(Reading& reading, Params& params) {
    DielectricMaterial glass;
    glass.eta = read_glass_eta(reading, params, "eta", 1.5);
    glass.roughness = read_roughness(reading, params, 0, Dialect::v4);
    return glass;
}

// pbrt's default, copper, with the values of the spectra metal-Cu-eta and metal-Cu-k.
const Rgb kCopperEta(0.166367F, 0.974422F, 1.213025F), kCopperK(3.247826F, 2.586601F, 2.357576F);

ConductorMaterial read_metal_of(Reading& reading, Params& params, const std::string& prefix) {
    ConductorMaterial metal;
    const std::string eta = prefix + "eta", k = prefix + "k";
    if (params.has("reflectance")) {
        if (params.has(eta) || params.has(k)) {
            params.accept({eta, k});
            params.warn_or_refuse(
                params.place_of("reflectance"),
                fmt::format("\"reflectance\" and \"{}\" or \"{}\" exclude each other", eta, k),
                "the reflectance is used");
        }
        metal.reflectance = read_color(reading, params, "reflectance", Rgb(0.5F));
        return metal;
    }
    metal.eta = read_index_spectrum(reading, params, eta, kCopperEta);
    metal.k = read_index_spectrum(reading, params, k, kCopperK);
    return metal;
}

MaterialModel read_conductor(Reading& reading, Params& params) {
    ConductorMaterial metal = read_metal_of(reading, params, "");
    metal.roughness = read_roughness(reading, params, 0, Dialect::v4);
    return metal;
}

MaterialModel read_metal(Reading& reading, Params& params) {
    ConductorMaterial metal;
    metal.eta = read_index_spectrum(reading, params, "eta", kCopperEta);
    metal.k = read_index_spectrum(reading, params, "k", kCopperK);
    metal.roughness = read_roughness(reading, params, 0.01, old_dialect(reading));
    return metal;
}

MaterialModel read_coated_diffuse(Reading& reading, Params& params) {
    return CoatedDiffuseMaterial{read_color(reading, params, "reflectance", Rgb(0.5F)),
                                 read_coat(reading, params, "")};
}

MaterialModel read_coated_conductor(Reading& reading, Params& params) {
    CoatedConductorMaterial material{read_coat(reading, params, "interface."),
                                     read_metal_of(reading, params, "conductor.")};
    material.metal.roughness = read_roughness(reading, params, 0, Dialect::v4, "conductor.");
    return material;
}

// Reads "transmittance", a parameter of Lucerna: the visible transmittance of a window at normal incidence.
MaterialModel read_pane(Reading& reading, Params& params) {
    ThinDielectricMaterial pane{read_glass_eta(reading, params, "eta", 1.5)};
    if (!params.has("transmittance")) return pane;
    const auto transmittance = static_cast<float>(params.real("transmittance", 1));
    const Place& at = params.place_of("transmittance");
    const auto eta = pane.eta.constant_value();
    if (!eta)
        fail(at, "\"transmittance\" of {} applies to an \"eta\" that does not vary only", params.owner());
    const float most = clear_pane_transmittance(*eta);
    if (!(transmittance > 0 && transmittance <= most)) {
        fail(
            at,
            "\"transmittance\" of {} is {:g}; expected more than 0 and at most {:.3f}, which a pane of index "
            "{:g} has without absorption",
            params.owner(), transmittance, most, *eta);
    }
    pane.transmittance = transmittance;
    return pane;
}

MaterialModel read_diffuse_transmission(Reading& reading, Params& params) {
    DiffuseTransmissionMaterial material;
    material.reflectance = read_color(reading, params, "reflectance", Rgb(0.25F));
    material.transmittance = read_color(reading, params, "transmittance", Rgb(0.25F));
    material.scale = static_cast<float>(params.real_within("scale", 1, 0, 1e6));
    return material;
}

// The coat table is needed only where the components add up to more than 1, which textures may do anywhere.
void add_cover(Reading& reading, UberMaterial& uber) {
    if (const auto eta = uber.eta.constant_value()) uber.table = cover_of(reading, *eta, uber.roughness);
}

MaterialModel read_plastic(Reading& reading, Params& params) {
    UberMaterial plastic;
    plastic.diffuse = read_color(reading, params, "Kd", Rgb(0.25F));
    plastic.gloss = read_color(reading, params, "Ks", Rgb(0.25F));
    plastic.roughness = read_roughness(reading, params, 0.1, old_dialect(reading));
    add_cover(reading, plastic);
    return plastic;
}

// Reads a colour that is usually absent. Returns nothing if it is not given or equals `nothing` everywhere.
std::optional<RgbTexture> read_rare(Reading& reading, Params& params, std::string_view name,
                                    const Rgb& nothing) {
    const Param* param = params.find_any(name);
    if (!param) return std::nullopt;
    const bool varies = param->type == Param::Type::texture;
    const RgbTexture color = read_color(reading, params, name, nothing);
    if (!varies && color.at(V2f(0, 0)) == nothing) return std::nullopt;
    return color;
}

MaterialModel read_uber(Reading& reading, Params& params) {
    UberMaterial uber;
    uber.diffuse = read_color(reading, params, "Kd", Rgb(0.25F));
    uber.gloss = read_color(reading, params, "Ks", Rgb(0.25F));
    uber.reflect = read_rare(reading, params, "Kr", Rgb(0.0F));
    uber.transmit = read_rare(reading, params, "Kt", Rgb(0.0F));
    uber.opacity = read_rare(reading, params, "opacity", Rgb(1.0F));
    uber.eta = read_old_eta(reading, params);
    uber.roughness = read_roughness(reading, params, 0.1, old_dialect(reading));
    add_cover(reading, uber);
    return uber;
}

MaterialModel read_substrate(Reading& reading, Params& params) {
    return SubstrateMaterial{read_color(reading, params, "Kd", Rgb(0.5F)),
                             read_color(reading, params, "Ks", Rgb(0.5F)),
                             read_roughness(reading, params, 0.1, old_dialect(reading))};
}

MaterialModel read_translucent(Reading& reading, Params& params) {
    return TranslucentMaterial{
        read_color(reading, params, "Kd", Rgb(0.25F)), read_color(reading, params, "Ks", Rgb(0.25F)),
        read_color(reading, params, "reflect", Rgb(0.5F)), read_color(reading, params, "transmit", Rgb(0.5F)),
        read_roughness(reading, params, 0.1, old_dialect(reading))};
}

MaterialModel read_shiny_metal(Reading& reading, Params& params) {
    return ShinyMetalMaterial{read_color(reading, params, "Ks", Rgb(1.0F)),
                              read_color(reading, params, "Kr", Rgb(1.0F)),
                              read_roughness(reading, params, 0.1, old_dialect(reading))};
}

std::shared_ptr<const Material> named_part(Reading& reading, const Place& at, const std::string& name) {
    const auto found = reading.materials.find(name);
    if (found == reading.materials.end()) {
        std::vector<std::string_view> names;
        for (const auto& [known, entry] : reading.materials) names.push_back(known);
        reading.warn_or_refuse(at,
                               fmt::format("mix: there is no material \"{}\"; {}{} are defined", shown(name),
                                           did_you_mean(name, names), names.size()),
                               "matte of reflectance 0.5 is used");
        return std::make_shared<const Material>(Material{"default", DiffuseMaterial{}});
    }
    return std::make_shared<const Material>(found->second->material);
}

// Reads a mix. Version 4 names both materials in "materials" and states the share of the second, version 3
// that of the first.
MaterialModel read_mix(Reading& reading, Params& params) {
    MixMaterial mix;
    if (const Param* both = params.find("materials", {Param::Type::string})) {
        if (both->strings.size() != 2)
            fail(both->place, "mix: \"materials\" are {}; expected 2", both->count());
        mix.first = named_part(reading, both->place, both->strings[0]);
        mix.second = named_part(reading, both->place, both->strings[1]);
        mix.share = read_number(reading, params, "amount", 0.5, 0, 1);
    } else {
        for (const std::string_view name : {"namedmaterial1", "namedmaterial2"}) {
            if (!params.find(name, {Param::Type::string})) {
                fail(params.place(), "mix lacks \"string {}\" (or \"string materials\" of 2 names)", name);
            }
        }
        const auto part = [&](std::string_view name) {
            return named_part(reading, params.place_of(name), params.string(name, ""));
        };
        mix.second = part("namedmaterial1");
        mix.first = part("namedmaterial2");
        const Param* amount = params.find_any("amount");
        if (amount && amount->type == Param::Type::real) {
            mix.share = read_number(reading, params, "amount", 0.5, 0, 1);
        } else {
            mix.share = read_color(reading, params, "amount", Rgb(0.5F));
        }
    }
    const std::size_t lobes = most_lobes(*mix.first) + most_lobes(*mix.second);
    if (lobes <= Bsdf::kMaxLobes) return mix;
    const auto* number = std::get_if<FloatTexture>(&mix.share);
    const bool second = number && number->constant_value().value_or(0) > 0.5F;
    params.warn_or_refuse(
        params.place(),
        fmt::format("mix: {} lobes in total; the limit is {}; mix fewer materials", lobes, Bsdf::kMaxLobes),
        fmt::format("only its {} component is used", second ? "second" : "first"));
    return (second ? mix.second : mix.first)->model;
}

MaterialModel read_model(Reading& reading, const std::string& kind, Params& params) {
    if (kind == "diffuse") return DiffuseMaterial{read_color(reading, params, "reflectance", Rgb(0.5F))};
    if (kind == "matte") return read_matte(reading, params);
    if (kind == "mirror") return MirrorMaterial{read_color(reading, params, "Kr", Rgb(0.9F))};
    if (kind == "dielectric") return read_dielectric(reading, params);
    if (kind == "glass") return read_glass(reading, params);
    if (kind == "thindielectric") return read_pane(reading, params);
    if (kind == "conductor") return read_conductor(reading, params);
    if (kind == "metal") return read_metal(reading, params);
    if (kind == "shinymetal") return read_shiny_metal(reading, params);
    if (kind == "coateddiffuse") return read_coated_diffuse(reading, params);
    if (kind == "coatedconductor") return read_coated_conductor(reading, params);
    if (kind == "diffusetransmission") return read_diffuse_transmission(reading, params);
    if (kind == "plastic") return read_plastic(reading, params);
    if (kind == "uber") return read_uber(reading, params);
    if (kind == "substrate") return read_substrate(reading, params);
    if (kind == "translucent") return read_translucent(reading, params);
    if (kind == "mix") return read_mix(reading, params);
    if (kind.empty() || kind == "none" || kind == "interface") return InterfaceMaterial{};
    if (const auto nearest = read_stand_in(reading, kind, params)) return *nearest;
    refuse_kind(params.place(), "Material", kind,
                {"diffuse", "coateddiffuse", "conductor", "coatedconductor", "dielectric", "thindielectric",
                 "diffusetransmission", "mix", "interface", "matte", "plastic", "uber", "glass", "metal",
                 "mirror", "shinymetal", "substrate", "translucent"},
                {});
}

}  // namespace

Material read_material(Reading& reading, const std::string& kind, Params& params) {
    Material material{kind, read_model(reading, kind, params)};
    if (is_interface(material)) {
        // pbrt ignores all parameters of an interface material.
        for (const Param& param : params.all()) params.accept({param.name});
    } else {
        material.relief = read_relief(reading, params);
    }
    return material;
}

}  // namespace lucerna
