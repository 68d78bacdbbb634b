// Converts glTF's terms to pbrt's. glTF's GGX alpha is the square of its roughness; pbrt takes alpha itself
// with "remaproughness" false.
#include "engine/base/elementary.h"
#include "engine/model/write_pbrt.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

constexpr double kDegrees = 180 / M_PI;
constexpr int kLongSide = 800;  // pixels of the image's longer side

std::string color_text(const Rgb& color) {
    return fmt::format("[ {:.6g} {:.6g} {:.6g} ]", color.x, color.y, color.z);
}

std::string point_text(const V3d& p) {
    return fmt::format("{:.9g} {:.9g} {:.9g}", p.x, p.y, p.z);
}

std::string film_text(double aspect, const std::string& image_name) {
    const double ratio = aspect > 0 ? std::clamp(aspect, 0.01, 100.0) : 4.0 / 3;
    const int width = ratio >= 1 ? kLongSide : std::max(1, static_cast<int>(std::lround(kLongSide * ratio)));
    const int height = ratio >= 1 ? std::max(1, static_cast<int>(std::lround(kLongSide / ratio))) : kLongSide;
    return fmt::format(
        "Film \"rgb\" \"integer xresolution\" {} \"integer yresolution\" {} \"string filename\" \"{}\"\n",
        width, height, image_name);
}

// Mirrors the image of a right-handed world first, as pbrt's cameras are left-handed.
std::string look_at_text(const V3d& eye, const V3d& look, const V3d& up) {
    return fmt::format("Scale -1 1 1\nLookAt {}  {}  {}\n", point_text(eye), point_text(look),
                       point_text(up));
}

std::string texture_mapping(const ModelTexture& texture) {
    std::string text;
    const auto add = [&](const char* name, double value, double usual) {
        if (value != usual) text += fmt::format(" \"float {}\" {:.9g}", name, value);
    };
    add("uscale", texture.scale.x, 1);
    add("vscale", texture.scale.y, 1);
    add("udelta", texture.offset.x, 0);
    add("vdelta", texture.offset.y, 0);
    return text;
}

const ModelMaterial& material_of(const Model& model, int index) {
    static const ModelMaterial usual{};  // glTF's default: white, metallic 1, roughness 1
    return index < 0 ? usual : model.materials[static_cast<std::size_t>(index)];
}

}  // namespace

std::string quotable(const std::string& name) {
    std::string out;
    for (const char c : name) {
        const bool plain = static_cast<unsigned char>(c) >= 0x20 && c != '"' && c != '\\' && c != 0x7f;
        out += plain ? c : '_';
    }
    return out;
}

Extent extent_of(const Model& model) {
    V3d low(1e300), high(-1e300);
    for (const ModelPlacement& placement : model.placements) {
        for (const V3f& p : model.meshes[placement.mesh].p) {
            V3d q;
            placement.world_from_mesh.multVecMatrix(V3d(p), q);
            for (int i = 0; i < 3; ++i) low[i] = std::min(low[i], q[i]), high[i] = std::max(high[i], q[i]);
        }
    }
    Extent extent;
    if (!(low.x <= high.x)) return extent;
    extent.centre = (low + high) / 2;
    const double radius = (high - low).length() / 2;
    if (radius > 0 && std::isfinite(radius)) extent.radius = radius;
    return extent;
}

std::string camera_text(const ModelCamera& camera, const std::string& image_name) {
    const M44d& m = camera.world_from_camera;
    const V3d eye(m[3][0], m[3][1], m[3][2]), back(m[2][0], m[2][1], m[2][2]), up(m[1][0], m[1][1], m[1][2]);
    // Uses only the directions of the node's axes, as a camera is not scaled. A zero axis falls back to
    // glTF's own.
    const V3d to = back.length() > 0 ? -back.normalized() : V3d(0, 0, -1);
    std::string text = fmt::format("# camera \"{}\"\n", quotable(camera.name));
    text += look_at_text(eye, eye + to, up.length() > 0 ? up.normalized() : V3d(0, 1, 0));
    if (camera.perspective) {
        // pbrt's fov is that of the shorter side.
        const double aspect = camera.aspect > 0 ? camera.aspect : 4.0 / 3;
        const double fov = aspect >= 1 ? camera.yfov : 2 * atan(tan(camera.yfov / 2) * aspect);
        text += fmt::format("Camera \"perspective\" \"float fov\" {:.9g}\n", fov * kDegrees);
    } else {
        text +=
            fmt::format("Camera \"orthographic\" \"float screenwindow\" [ {:.9g} {:.9g} {:.9g} {:.9g} ]\n",
                        -camera.xmag, camera.xmag, -camera.ymag, camera.ymag);
    }
    return text + film_text(camera.aspect, image_name);
}

std::string default_camera_text(const Extent& extent, const std::string& image_name) {
    constexpr double kFov = 40;
    const V3d from = V3d(0.55, 0.35, 1).normalized();
    // A sphere of the model's radius fills the fov of the shorter side.
    const V3d eye = extent.centre + from * (extent.radius / sin(kFov / 2 / kDegrees));
    return look_at_text(eye, extent.centre, V3d(0, 1, 0)) +
           fmt::format("Camera \"perspective\" \"float fov\" {}\n", kFov) + film_text(0, image_name);
}

std::string material_name(const Model& model, int index) {
    if (index < 0) return "default";
    const std::string name = quotable(model.materials[static_cast<std::size_t>(index)].name);
    return name.empty() ? fmt::format("{}", index) : fmt::format("{} {}", index, name);
}

std::string material_text(const Model& model, int index,
                          const std::function<std::string(int image)>& image_file) {
    const ModelMaterial& material = material_of(model, index);
    const std::string name = material_name(model, index);
    std::string before, color = fmt::format("\"rgb reflectance\" {}", color_text(material.base));
    if (material.base_texture.image >= 0) {
        const bool grey = material.base.x == material.base.y && material.base.y == material.base.z;
        before += fmt::format(
            "Texture \"{} base\" \"spectrum\" \"imagemap\" \"string filename\" \"{}\" "
            "\"string encoding\" \"sRGB\"{}{}\n",
            name, image_file(material.base_texture.image), texture_mapping(material.base_texture),
            grey && material.base.x != 1 ? fmt::format(" \"float scale\" {:.6g}", material.base.x)
                                         : std::string());
        if (!grey) {
            before += fmt::format(
                "Texture \"{0} tinted\" \"spectrum\" \"scale\" \"texture tex\" \"{0} base\" \"rgb scale\" "
                "{1}\n",
                name, color_text(material.base));
        }
        color = fmt::format("\"texture reflectance\" \"{} {}\"", name, grey ? "base" : "tinted");
    }
    const std::string rough = fmt::format(" \"float roughness\" {:.6g} \"bool remaproughness\" false",
                                          material.roughness * material.roughness);
    std::string kind;
    if (is_glass(material)) {
        kind = fmt::format("\"{}\" \"float eta\" {:.6g}{}", material.thin ? "thindielectric" : "dielectric",
                           material.ior, material.thin ? std::string() : rough);
    } else if (material.metallic >= 0.5 && !material.unlit) {
        kind = "\"conductor\" " + color + rough;
    } else if (material.unlit || material.roughness >= 0.95 || material.ior == 1) {
        // A coat that is very rough, or of index 1, is invisible.
        kind = "\"diffuse\" " + color;
    } else {
        kind = fmt::format("\"coateddiffuse\" {}{} \"float eta\" {:.6g}", color, rough, material.ior);
    }
    if (material.normal.image >= 0)
        kind += fmt::format(" \"string normalmap\" \"{}\"", image_file(material.normal.image));
    return before + fmt::format("MakeNamedMaterial \"{}\" \"string type\" {}\n", name, kind);
}

std::string cutout_texture_text(const Model& model, int index, const std::string& cutout_file) {
    return fmt::format("Texture \"{} cutout\" \"float\" \"imagemap\" \"string filename\" \"{}\"{}\n",
                       material_name(model, index), cutout_file,
                       texture_mapping(material_of(model, index).cutout_texture));
}

std::string alpha_text(const Model& model, int index) {
    const ModelMaterial& material = material_of(model, index);
    if (material.cutout) return fmt::format(" \"texture alpha\" \"{} cutout\"", material_name(model, index));
    return material.alpha < 1 ? fmt::format(" \"float alpha\" {:.6g}", material.alpha) : std::string();
}

std::string emission_text(const ModelMaterial& material) {
    if (!(luminance(material.emission) > 0)) return {};
    return fmt::format("    AreaLightSource \"diffuse\" \"rgb L\" {}{}\n", color_text(material.emission),
                       material.two_sided ? " \"bool twosided\" true" : "");
}

namespace {

// A lamp's frame has its nadir along +z, the half-plane C0 along +x and C90 along -y; EXT_lights_ies has
// these along the node's -z, +x and +y. Uses only directions of a node that scales or shears, as a light is
// not scaled.
std::string profile_text(const ModelLight& light, const std::string& profile_file) {
    const M44d& m = light.world_from_light;
    const auto axis = [&m](int row, const V3d& otherwise) {
        const V3d v(m[row][0], m[row][1], m[row][2]);
        return v.length() > 0 ? v.normalized() : otherwise;
    };
    const V3d z = -axis(2, V3d(0, 0, 1));
    V3d x = axis(0, V3d(1, 0, 0));
    x -= x.dot(z) * z;
    if (!(x.length() > 1e-6)) x = z.cross(std::fabs(z.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0));
    x.normalize();
    V3d y = z.cross(x);
    if (y.dot(axis(1, -y)) > 0) y.negate();
    const V3d from(m[3][0], m[3][1], m[3][2]);
    const float strength = luminance(light.intensity);
    return fmt::format(
        "AttributeBegin  # light \"{}\"\n    {}\n    LightSource \"ies\" \"string filename\" \"{}\" \"float "
        "scale\" {:.9g} \"rgb color\" {}\nAttributeEnd\n",
        quotable(light.name),
        transform_text(M44d(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, from.x, from.y, from.z, 1)),
        profile_file, strength, color_text(light.intensity / strength));
}

}  // namespace

std::string light_text(const ModelLight& light, const std::string& profile_file) {
    if (light.kind == ModelLight::Kind::ies) return profile_text(light, profile_file);
    const M44d& m = light.world_from_light;
    const V3d from(m[3][0], m[3][1], m[3][2]), back(m[2][0], m[2][1], m[2][2]);
    const V3d to = back.length() > 0 ? -back.normalized() : V3d(0, 0, -1);
    const std::string comment = fmt::format("# light \"{}\"\n", quotable(light.name));
    const std::string color = color_text(light.intensity);
    if (light.kind == ModelLight::Kind::point) {
        return comment + fmt::format("LightSource \"point\" \"rgb I\" {} \"point3 from\" [ {} ]\n", color,
                                     point_text(from));
    }
    if (light.kind == ModelLight::Kind::directional) {
        return comment +
               fmt::format(
                   "LightSource \"distant\" \"rgb L\" {} \"point3 from\" [ 0 0 0 ] \"point3 to\" [ {} ]\n",
                   color, point_text(to));
    }
    return comment + fmt::format(
                         "LightSource \"spot\" \"rgb I\" {} \"point3 from\" [ {} ] \"point3 to\" [ {} ]\n"
                         "    \"float coneangle\" {:.9g} \"float conedeltaangle\" {:.9g} \"string falloff\" "
                         "\"quadratic\"\n",
                         color, point_text(from), point_text(from + to), light.outer * kDegrees,
                         (light.outer - light.inner) * kDegrees);
}

// Returns the light of a hazy day: a sky of 5,000 cd/m² and a sun of 24 klx.
std::string default_light_text() {
    return "LightSource \"infinite\" \"rgb L\" [ 5000 5000 5000 ]\n"
           "LightSource \"distant\" \"rgb L\" [ 25000 24000 22000 ] \"point3 from\" [ 0.6 1 0.8 ] \"point3 "
           "to\" [ "
           "0 0 0 ]\n";
}

std::string transform_text(const M44d& matrix) {
    std::string text = "Transform [";
    for (int i = 0; i < 16; ++i) text += fmt::format(" {:.17g}", matrix[i / 4][i % 4]);
    return text + " ]";
}

}  // namespace lucerna
