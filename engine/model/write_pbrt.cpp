#include "engine/model/write_pbrt.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <set>
#include <span>

#include "engine/base/error.h"
#include "engine/colour/colour_space.h"
#include "engine/image/image.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

namespace fs = std::filesystem;

void write_bytes(const fs::path& file, std::string_view text) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    replace_file(file, std::span(&bytes, 1));
}

template <typename T>
void append(std::string& out, const T& value) {  // little-endian, like this machine
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out.append(bytes, sizeof value);
}

std::string ply_of(const ModelMesh& mesh) {
    std::string out = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
        "property float x\nproperty float y\nproperty float z\n",
        mesh.p.size());
    if (!mesh.n.empty()) out += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!mesh.uv.empty()) out += "property float u\nproperty float v\n";
    out += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                       mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.p.size(); ++i) {
        append(out, mesh.p[i]);
        if (!mesh.n.empty()) append(out, mesh.n[i]);
        if (!mesh.uv.empty()) append(out, mesh.uv[i]);
    }
    for (const V3i& triangle : mesh.triangles) {
        append(out, std::uint8_t{3});
        append(out, triangle);
    }
    return out;
}

// Writes alpha as grey levels encoded by sRGB, because a reader decodes them like any picture.
void write_cutout(const fs::path& file, const ModelCutout& cutout) {
    Image image = Image::rgb(cutout.width, cutout.height);
    for (std::size_t i = 0; i < cutout.alpha.size(); ++i) {
        const float code = srgb_encoded(cutout.alpha[i]);
        for (std::size_t c = 0; c < 3; ++c) image.data[3 * i + c] = code;
    }
    write_png_display(file, image);
}

class Writer {
  public:
    Writer(const Model& model, const fs::path& scene) : model_(model), scene_(scene) {}

    WrittenScene write(const std::string& source, Monitor& monitor) {
        fs::create_directories(parts_folder(scene_));
        std::set<int> used;
        for (const ModelPlacement& placement : model_.placements) used.insert(mesh_of(placement).material);
        std::string world;
        for (const int index : used) world += material(index);
        world += fmt::format("\n{}\n", lights());
        monitor.begin("meshes", model_.meshes.size());
        for (std::size_t i = 0; i < model_.meshes.size(); ++i) {
            put(fmt::format("mesh-{}.ply", i), ply_of(model_.meshes[i]));
            monitor.advance(1);
        }
        monitor.end();
        for (const ModelPlacement& placement : model_.placements) world += shape(placement);
        const std::string view = camera();
        write_bytes(scene_, header(source) + view + "\nWorldBegin\n\n" + world);
        ++written_.files;
        return written_;
    }

  private:
    const ModelMesh& mesh_of(const ModelPlacement& placement) const { return model_.meshes[placement.mesh]; }

    // Returns the name of a file in the parts folder relative to the scene.
    std::string part(const std::string& name) const {
        return quotable((parts_folder(scene_).filename() / name).generic_string());
    }
    void put(const std::string& name, std::string_view bytes) {
        write_bytes(parts_folder(scene_) / name, bytes);
        ++written_.files;
    }

    // Returns a file's name for the scene; writes an embedded file at its first use.
    std::string file_of(const ModelFile& file, const std::string& stem) {
        if (!file.file.empty()) {
            const fs::path folder = scene_.has_parent_path() ? scene_.parent_path() : fs::path(".");
            return quotable(fs::proximate(file.file, folder).generic_string());
        }
        const std::string name = stem + file.suffix;
        if (embedded_.insert(name).second) {
            put(name, {reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()});
        }
        return part(name);
    }
    std::string image_file(int index) {
        return file_of(model_.images[static_cast<std::size_t>(index)], fmt::format("image-{}", index));
    }

    std::string material(int index) {
        std::string text = material_text(model_, index, [this](int image) { return image_file(image); });
        ++written_.materials;
        if (index < 0 || !model_.materials[static_cast<std::size_t>(index)].cutout) return text;
        const std::string name = fmt::format("cutout-{}.png", index);
        write_cutout(parts_folder(scene_) / name, *model_.materials[static_cast<std::size_t>(index)].cutout);
        ++written_.files;
        return text + cutout_texture_text(model_, index, part(name));
    }

    std::string camera() {
        const std::string image_name = fmt::format("{}.exr", quotable(scene_.stem().string()));
        std::string text;
        if (model_.cameras.empty()) {
            written_.notes.push_back("The model has no camera: this one shows all of it.");
            text = default_camera_text(extent_of(model_), image_name);
        } else {
            text = camera_text(model_.cameras.front(), image_name);
            if (model_.cameras.size() > 1) {
                written_.notes.push_back(
                    fmt::format("The model has {} cameras; the first is used.", model_.cameras.size()));
            }
        }
        return text +
               "PixelFilter \"gaussian\" \"float xradius\" 1.5 \"float yradius\" 1.5\n"
               "Sampler \"independent\" \"integer pixelsamples\" 64\nIntegrator \"path\"\n";
    }

    bool shines() const {
        for (const ModelPlacement& placement : model_.placements) {
            const int index = mesh_of(placement).material;
            if (index >= 0 && luminance(model_.materials[static_cast<std::size_t>(index)].emission) > 0)
                return true;
        }
        return false;
    }

    std::string lights() {
        std::string text;
        for (const ModelLight& light : model_.lights) {
            const bool profile = light.kind == ModelLight::Kind::ies;
            text += light_text(light, profile ? file_of(model_.profiles[light.profile],
                                                        fmt::format("profile-{}", light.profile))
                                              : std::string());
        }
        written_.lights = model_.lights.size();
        if (text.empty() && !shines()) {
            written_.notes.push_back(
                fmt::format("The model has no light{}: a sky and a sun are added.",
                            model_.other_lights ? " that is visible and can be read" : ""));
            text = default_light_text();
        }
        return text;
    }

    std::string shape(const ModelPlacement& placement) {
        const ModelMesh& mesh = mesh_of(placement);
        ++written_.shapes;
        written_.triangles += mesh.triangles.size();
        const std::string emission =
            mesh.material < 0 ? std::string()
                              : emission_text(model_.materials[static_cast<std::size_t>(mesh.material)]);
        if (!emission.empty()) ++written_.lights;
        return fmt::format(
            "AttributeBegin  # {}\n    {}\n    NamedMaterial \"{}\"\n{}    Shape \"plymesh\" \"string "
            "filename\" \"{}\"{}\nAttributeEnd\n",
            quotable(mesh.name), transform_text(placement.world_from_mesh),
            material_name(model_, mesh.material), emission, part(fmt::format("mesh-{}.ply", placement.mesh)),
            alpha_text(model_, mesh.material));
    }

    std::string header(const std::string& source) const {
        std::string text = fmt::format(
            "# {}, converted by lucerna import.\n# Metres, y up, right-handed: the camera mirrors the "
            "picture. Lights have the values of the model, in candela, lux and cd/m².\n",
            quotable(source));
        for (const std::string& note : written_.notes) text += fmt::format("# {}\n", note);
        // Units follow [glTF 2.0, 3.9.3 and KHR_lights_punctual].
        return text + "\nOption \"string unit\" \"photometric\"\n";
    }

    const Model& model_;
    fs::path scene_;
    WrittenScene written_;
    std::set<std::string> embedded_;
};

}  // namespace

fs::path parts_folder(const fs::path& scene) {
    fs::path folder = scene;
    folder.replace_extension();
    folder += "-parts";
    return folder;
}

bool is_part_name(const std::string& file) {
    return file.starts_with("mesh-") || file.starts_with("image-") || file.starts_with("cutout-") ||
           file.starts_with("profile-");
}

WrittenScene write_pbrt(const Model& model, const fs::path& scene, const std::string& source,
                        Monitor& monitor) {
    return Writer(model, scene).write(source, monitor);
}

}  // namespace lucerna
