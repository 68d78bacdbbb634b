// Images and materials [glTF 2.0, 3.8, 3.9].
#include <algorithm>
#include <cctype>
#include <cmath>

#include "engine/model/gltf_reader.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"

namespace lucerna {

std::string decoded_uri(const std::string& uri) {
    std::string out;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const auto hex = [&](std::size_t at) {
            return at < uri.size()
                       ? std::string_view("0123456789abcdef")
                             .find(static_cast<char>(std::tolower(static_cast<unsigned char>(uri[at]))))
                       : std::string_view::npos;
        };
        if (uri[i] == '%' && hex(i + 1) != std::string_view::npos && hex(i + 2) != std::string_view::npos) {
            out += static_cast<char>(16 * hex(i + 1) + hex(i + 2));
            i += 2;
        } else {
            out += uri[i];
        }
    }
    return out;
}

void GltfReader::read_images() {
    for (const tinygltf::Image& image : in_.images) {
        ModelFile made;
        if (!image.uri.empty()) {
            made.file = file_.parent_path() / decoded_uri(image.uri);
            out_.files.push_back(made.file);
        } else {
            const std::span<const unsigned char> bytes =
                image.bufferView >= 0 ? view_bytes(image.bufferView) : std::span(image.image);
            const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
            made.bytes.assign(first, first + bytes.size());
            made.suffix = image.mimeType == "image/jpeg" ? ".jpg" : ".png";
            if (made.bytes.empty()) fail("image {} is empty", out_.images.size());
        }
        out_.images.push_back(std::move(made));
    }
}

std::optional<Pixels> decoded_picture(std::span<const std::byte> bytes, const std::string& name) {
    if (const auto size = picture_size(bytes)) {
        constexpr std::uint64_t kDecoding = 4 * 4;  // bytes per pixel: rows, planes, RGBA and its copy
        const auto [width, height] = *size;
        require_memory(std::uint64_t{width} * height * kDecoding,
                       fmt::format("{} of {} x {} pixels", name, width, height), "use fewer pixels");
    }
    tinygltf::Image decoded;
    std::string error, warning;
    const bool good = bytes.size() <= kMostCount &&
                      tinygltf::LoadImageData(&decoded, 0, &error, &warning, 0, 0,
                                              reinterpret_cast<const unsigned char*>(bytes.data()),
                                              static_cast<int>(bytes.size()), nullptr);
    if (good && decoded.bits == 16) return std::nullopt;
    if (!good || decoded.width < 1 || decoded.height < 1 || decoded.component != 4 || decoded.bits != 8) {
        throw InputError(fmt::format("{} cannot be decoded; expected PNG or JPEG", name));
    }
    return Pixels{decoded.width, decoded.height, std::move(decoded.image)};
}

std::optional<Pixels> GltfReader::pixels(const ModelTexture& texture) const {
    if (texture.image < 0) return std::nullopt;
    const ModelFile& image = out_.images[static_cast<std::size_t>(texture.image)];
    auto made = decoded_picture(image.file.empty() ? image.bytes : read_bytes(image.file),
                                fmt::format("{}: image {}", file_.string(), texture.image));
    if (!made) warn("image {}: 16-bit values are not read; only its factor is used", texture.image);
    return made;
}

const tinygltf::Value* object_in(const tinygltf::ExtensionMap& extensions, const char* extension) {
    const auto found = extensions.find(extension);
    return found != extensions.end() && found->second.IsObject() ? &found->second : nullptr;
}

std::optional<double> number_in(const tinygltf::ExtensionMap& extensions, const char* extension,
                                const char* key) {
    const tinygltf::Value* object = object_in(extensions, extension);
    if (!object || !object->Has(key)) return std::nullopt;
    const tinygltf::Value& value = object->Get(key);
    if (!value.IsNumber()) return std::nullopt;
    return value.GetNumberAsDouble();
}

ModelTexture GltfReader::texture(int index, int tex_coord, const tinygltf::ExtensionMap& extensions,
                                 const std::string& material) const {
    ModelTexture made;
    if (index < 0) return made;
    made.image = pick(in_.textures, index, "texture").source;
    if (made.image < 0) {
        warn("material \"{}\": texture {} has no image that is PNG or JPEG; left out", material, index);
        return made;
    }
    pick(out_.images, made.image, "image");
    if (tex_coord != 0)
        warn("material \"{}\": texture coordinates {} are not supported; set 0 is used", material, tex_coord);
    const auto found = extensions.find("KHR_texture_transform");
    if (found == extensions.end() || !found->second.IsObject()) return made;
    const auto pair = [&](const char* key, V2d& into) {
        if (!found->second.Has(key)) return;
        const tinygltf::Value& value = found->second.Get(key);
        for (int i = 0; i < 2 && value.IsArray() && value.ArrayLen() == 2; ++i) {
            if (value.Get(i).IsNumber()) into[i] = value.Get(i).GetNumberAsDouble();
        }
    };
    V2d offset(0, 0);
    pair("scale", made.scale);
    pair("offset", offset);
    if (number_in(extensions, "KHR_texture_transform", "rotation").value_or(0) != 0) {
        warn("material \"{}\": rotated textures are not supported; the rotation is ignored", material);
    }
    // glTF's v runs down from the top, pbrt's up from below: 1 - (s (1 - v) + o) = s v + (1 - s - o).
    made.offset = V2d(offset.x, 1 - made.scale.y - offset.y);
    return made;
}

namespace {

double in_unit(double value) {
    return std::isfinite(value) ? std::clamp(value, 0.0, 1.0) : 0.0;
}

}  // namespace

Rgb color_of(const std::vector<double>& numbers, double factor) {
    Rgb color(0.0F);
    for (int c = 0; c < 3 && static_cast<std::size_t>(c) < numbers.size(); ++c) {
        const double value = numbers[static_cast<std::size_t>(c)] * factor;
        color[c] = std::isfinite(value) ? static_cast<float>(std::clamp(value, 0.0, 1e30)) : 0.0F;
    }
    return color;
}

void GltfReader::read_alpha(ModelMaterial& made, const tinygltf::Material& from) const {
    if (from.alphaMode != "MASK" && from.alphaMode != "BLEND") return;
    const std::vector<double>& base = from.pbrMetallicRoughness.baseColorFactor;
    made.alpha = base.size() > 3 ? in_unit(base[3]) : 1;
    const std::optional<double> cutoff =
        from.alphaMode == "MASK" ? std::optional(from.alphaCutoff) : std::nullopt;
    if (const std::optional<Pixels> image = pixels(made.base_texture)) {
        // Each material has its own cutout, even where several share an image.
        require_memory(image->rgba.size() / 4 * sizeof(float),
                       fmt::format("{}: the cutout of material \"{}\"", file_.string(), one_line(from.name)),
                       "use fewer pixels");
        made.cutout = cutout_of(*image, made.alpha, cutoff);
        made.cutout_texture = made.base_texture;
        made.alpha = 1;
    } else if (cutoff) {
        made.alpha = made.alpha >= *cutoff ? 1 : 0;
    }
}

// Reads transmission [KHR_materials_transmission, KHR_materials_volume]. Without a thickness the surface is a
// thin pane.
void GltfReader::read_transmission(ModelMaterial& made, const tinygltf::Material& from) const {
    constexpr const char* kExtension = "KHR_materials_transmission";
    made.transmission = in_unit(number_in(from.extensions, kExtension, "transmissionFactor").value_or(0));
    if (!(made.transmission > 0)) return;
    made.thin = !(number_in(from.extensions, "KHR_materials_volume", "thicknessFactor").value_or(0) > 0);
    const tinygltf::Value* transmission = object_in(from.extensions, kExtension);
    if (transmission && transmission->Has("transmissionTexture"))
        warn("material \"{}\": its transmission texture is not read; its factor alone is used", from.name);
    if (made.transmission < 1) {
        warn("material \"{}\": its transmission of {} is read as {}", from.name, made.transmission,
             is_glass(made) ? "1; its base is lost" : "0; what passes through it is lost");
    }
    if (!is_glass(made)) return;
    if (made.thin && made.roughness > 0)
        warn("material \"{}\": it is a thin pane; its roughness is ignored", from.name);
    if (made.base != Rgb(1.0F) || made.base_texture.image >= 0)
        warn("material \"{}\": it is glass; its base colour is ignored", from.name);
    const auto distance = number_in(from.extensions, "KHR_materials_volume", "attenuationDistance");
    if (!made.thin && distance && std::isfinite(*distance))
        warn("material \"{}\": it is clear glass; the attenuation in its volume is ignored", from.name);
}

ModelMaterial GltfReader::material(const tinygltf::Material& from) const {
    ModelMaterial made;
    made.name = from.name;
    const tinygltf::PbrMetallicRoughness& pbr = from.pbrMetallicRoughness;
    made.base = color_of(pbr.baseColorFactor);
    const auto named = [&](const auto& info) {
        return texture(info.index, info.texCoord, info.extensions, from.name);
    };
    made.base_texture = named(pbr.baseColorTexture);
    made.metallic = in_unit(pbr.metallicFactor);
    made.roughness = in_unit(pbr.roughnessFactor);
    if (const auto image = pixels(named(pbr.metallicRoughnessTexture))) {
        const Rgb mean = mean_linear(*image);  // roughness in green, metalness in blue
        made.roughness *= static_cast<double>(mean.y);
        made.metallic *= static_cast<double>(mean.z);
        warn("material \"{}\": the means of its metallic-roughness texture are used, {:.2f} and {:.2f}",
             from.name, made.metallic, made.roughness);
    }
    made.normal = named(from.normalTexture);
    const double strength =
        number_in(from.extensions, "KHR_materials_emissive_strength", "emissiveStrength").value_or(1);
    made.emission = color_of(from.emissiveFactor, strength);
    if (luminance(made.emission) > 0) {
        if (const auto image = pixels(named(from.emissiveTexture))) {
            made.emission *= mean_srgb(*image);
            warn("material \"{}\": the mean of its emissive texture is used", from.name);
        }
    }
    read_transmission(made, from);
    made.ior = std::clamp(number_in(from.extensions, "KHR_materials_ior", "ior").value_or(1.5), 1.0, 100.0);
    made.two_sided = from.doubleSided;
    made.unlit = from.extensions.contains("KHR_materials_unlit");
    read_alpha(made, from);
    return made;
}

}  // namespace lucerna
