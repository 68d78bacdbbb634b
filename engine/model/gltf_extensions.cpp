// Checks which extensions are supported, warns of what the others lose, and reads those that change a node's
// contents [EXT_mesh_gpu_instancing, EXT_lights_ies].
#include <Imath/ImathQuat.h>

#include <algorithm>
#include <cmath>

#include "engine/model/gltf_reader.h"

namespace lucerna {
namespace {

constexpr std::string_view kRead[] = {"EXT_lights_ies",        "EXT_mesh_gpu_instancing",
                                      "KHR_lights_punctual",   "KHR_materials_emissive_strength",
                                      "KHR_materials_ior",     "KHR_materials_transmission",
                                      "KHR_materials_unlit",   "KHR_materials_volume",
                                      "KHR_mesh_quantization", "KHR_node_visibility",
                                      "KHR_texture_transform"};

struct Unread {
    std::string_view name, lost;
    bool lights = false;  // it describes lights
};
constexpr Unread kUnread[] = {
    {"EXT_lights_area", "its area lights", true},
    {"EXT_lights_image_based", "its light from the surroundings", true},
    {"EXT_meshopt_compression", "the compressed copies of its meshes"},
    {"EXT_texture_avif", "its AVIF textures"},
    {"EXT_texture_webp", "its WebP textures"},
    {"KHR_animation_pointer", "its animations"},
    {"KHR_draco_mesh_compression", "the compressed copies of its meshes"},
    {"KHR_lights_environment", "its light from the surroundings", true},
    {"KHR_materials_anisotropy", "the anisotropy of its materials"},
    {"KHR_materials_clearcoat", "the clear coats of its materials"},
    {"KHR_materials_diffuse_transmission", "the light that passes diffusely through its materials"},
    {"KHR_materials_dispersion", "the dispersion of its glass"},
    {"KHR_materials_iridescence", "the thin films on its materials"},
    {"KHR_materials_pbrSpecularGlossiness", "its materials by specular colour and gloss"},
    {"KHR_materials_sheen", "the sheen of its materials"},
    {"KHR_materials_specular", "the strength and colour of its specular reflection"},
    {"KHR_materials_variants", "its variants; each mesh has its usual material"},
    {"KHR_meshopt_compression", "the compressed copies of its meshes"},
    {"KHR_texture_basisu", "its KTX textures"},
    {"KHR_xmp", "its metadata, of which the picture shows nothing"},
    {"KHR_xmp_json_ld", "its metadata, of which the picture shows nothing"},
    {"MSFT_lod", "its levels of detail; the finest is used"},
    {"MSFT_texture_dds", "its DDS textures"},
};

bool is_read(std::string_view name) {
    return std::ranges::find(kRead, name) != std::end(kRead);
}

// Reads a JSON number that is a count or an index.
std::optional<int> index_in(const tinygltf::Value& object, const char* key) {
    if (!object.Has(key) || !object.Get(key).IsNumber()) return std::nullopt;
    const double number = object.Get(key).GetNumberAsDouble();
    return number >= 0 && number < 1e9 ? static_cast<int>(number) : -1;
}

const tinygltf::Value* attributes_of(const tinygltf::Node& node) {
    const tinygltf::Value* instancing = object_in(node.extensions, "EXT_mesh_gpu_instancing");
    if (!instancing || !instancing->Has("attributes")) return nullptr;
    const tinygltf::Value& attributes = instancing->Get("attributes");
    return attributes.IsObject() ? &attributes : nullptr;
}

}  // namespace

// Rejects a model that requires an unsupported extension, as its image would be wrong. Warns once of each
// unsupported extension that is merely used, with what is lost.
void GltfReader::check_extensions() {
    for (const std::string& name : in_.extensionsRequired) {
        if (is_read(name)) continue;
        fail("requires the extension \"{}\", which is not supported; supported are {}", name,
             fmt::join(kRead, ", "));
    }
    std::vector<std::string> used = in_.extensionsUsed;
    std::ranges::sort(used);
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (const std::string& name : used) {
        if (is_read(name)) continue;
        const auto* unread = std::ranges::find(kUnread, name, &Unread::name);
        const bool known = unread != std::end(kUnread);
        warn("uses the extension \"{}\", which is not read; lost is {}", name,
             known ? unread->lost : "what it adds to the model");
        out_.other_lights = out_.other_lights || (known && unread->lights);
    }
}

bool GltfReader::has_light(const tinygltf::Node& node) const {
    if (node.extensions.contains("KHR_lights_punctual") || node.extensions.contains("EXT_lights_ies"))
        return true;
    if (node.mesh < 0) return false;
    return std::ranges::any_of(pick(primitives_, node.mesh, "mesh"), [this](std::size_t piece) {
        const int material = out_.meshes[piece].material;
        return material >= 0 && luminance(out_.materials[static_cast<std::size_t>(material)].emission) > 0;
    });
}

std::size_t GltfReader::instance_count(const tinygltf::Node& node) const {
    const tinygltf::Value* attributes = attributes_of(node);
    if (!attributes) return 1;
    for (const char* name : {"TRANSLATION", "ROTATION", "SCALE"}) {
        if (const auto accessor = index_in(*attributes, name))
            return pick(in_.accessors, *accessor, "accessor of instances").count;
    }
    return 1;
}

// Returns the transformations of a node's mesh in the node's frame: one, or those of its instances.
std::vector<M44d> GltfReader::instances(const tinygltf::Node& node) const {
    std::vector<M44d> made(instance_count(node));
    const tinygltf::Value* attributes = attributes_of(node);
    if (!attributes) return made;
    const auto each = [&](const char* name, int components, auto&& apply) {
        const auto accessor = index_in(*attributes, name);
        if (!accessor) return;
        const std::string what = fmt::format("node \"{}\": {} of its instances", node.name, name);
        const std::vector<double> all = numbers(*accessor, components, what);
        const auto width = static_cast<std::size_t>(components);
        if (all.size() / width != made.size()) {
            fail("{}: there are {}; expected {}, as the other attributes have", what, all.size() / width,
                 made.size());
        }
        for (std::size_t i = 0; i < made.size(); ++i) apply(made[i], &all[i * width]);
    };
    each("SCALE", 3, [](M44d& m, const double* v) { m.scale(V3d(v[0], v[1], v[2])); });
    each("ROTATION", 4, [&](M44d& m, const double* v) {
        const Imath::Quatd turn(v[3], v[0], v[1], v[2]);
        if (!(turn.length() > 1e-6))
            fail("node \"{}\": the rotation of an instance is not a unit quaternion", node.name);
        m = m * turn.normalized().toMatrix44();  // the length is checked above
    });
    each("TRANSLATION", 3,
         [](M44d& m, const double* v) { m = m * M44d().setTranslation(V3d(v[0], v[1], v[2])); });
    return made;
}

// Reads the IES files of EXT_lights_ies.
void GltfReader::read_profiles() {
    const tinygltf::Value* extension = object_in(in_.extensions, "EXT_lights_ies");
    if (!extension || !extension->Has("lights") || !extension->Get("lights").IsArray()) return;
    const tinygltf::Value& lights = extension->Get("lights");
    for (std::size_t i = 0; i < lights.ArrayLen(); ++i) {
        const tinygltf::Value& light = lights.Get(static_cast<int>(i));
        ModelFile made;
        made.suffix = ".ies";
        const auto keep = [&made](std::span<const unsigned char> bytes) {
            const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
            made.bytes.assign(first, first + bytes.size());
        };
        const std::string uri = light.IsObject() && light.Has("uri") && light.Get("uri").IsString()
                                    ? light.Get("uri").Get<std::string>()
                                    : std::string();
        const std::size_t data = uri.starts_with("data:") ? uri.find(";base64,") : std::string::npos;
        if (data != std::string::npos) {
            std::vector<unsigned char> bytes;
            std::string type;
            // tinygltf decodes only types that it knows.
            tinygltf::DecodeDataURI(&bytes, type, "data:application/octet-stream" + uri.substr(data), 0,
                                    false);
            keep(bytes);
        } else if (!uri.empty()) {
            made.file = file_.parent_path() / decoded_uri(uri);
            out_.files.push_back(made.file);
        } else if (const auto view = light.IsObject() ? index_in(light, "bufferView") : std::nullopt) {
            keep(view_bytes(*view));
        }
        if (made.file.empty() && made.bytes.empty()) fail("IES light {} has no file and no data", i);
        out_.profiles.push_back(std::move(made));
    }
}

std::optional<ModelLight> GltfReader::profile_light(const tinygltf::Node& node, const M44d& world) const {
    constexpr const char* kExtension = "EXT_lights_ies";
    const tinygltf::Value* here = object_in(node.extensions, kExtension);
    const auto index = here ? index_in(*here, "light") : std::nullopt;
    if (!index) return std::nullopt;
    pick(out_.profiles, *index, "IES light");
    ModelLight made;
    made.kind = ModelLight::Kind::ies;
    made.name = node.name;
    made.world_from_light = world;
    made.profile = static_cast<std::size_t>(*index);
    const double multiplier = number_in(node.extensions, kExtension, "multiplier").value_or(1);
    if (!(multiplier >= 0 && std::isfinite(multiplier)))
        fail("node \"{}\": the multiplier {} of its light is not accepted", node.name, multiplier);
    std::vector<double> color(3, 1.0);
    if (here->Has("color") && here->Get("color").IsArray() && here->Get("color").ArrayLen() == 3) {
        for (int c = 0; c < 3; ++c) {
            const tinygltf::Value& value = here->Get("color").Get(c);
            if (value.IsNumber())
                color[static_cast<std::size_t>(c)] = std::min(value.GetNumberAsDouble(), 1.0);
        }
    }
    made.intensity = color_of(color, multiplier);
    if (luminance(made.intensity) > 0) return made;
    warn("node \"{}\": its light is black; left out", node.name);
    return std::nullopt;
}

}  // namespace lucerna
