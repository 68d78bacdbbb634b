// The reader, which wraps tinygltf. tinygltf parses the file and returns unchecked claims; every index,
// offset and count is checked here before use.
#pragma once

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/model/model.h"
#include "engine/text/plain_text.h"

namespace lucerna {

inline constexpr std::size_t kMostCount = std::numeric_limits<std::int32_t>::max();

// Returns a number in an extension's object.
std::optional<double> number_in(const tinygltf::ExtensionMap& extensions, const char* extension,
                                const char* key);
// Returns an extension's object; null if there is none.
const tinygltf::Value* object_in(const tinygltf::ExtensionMap& extensions, const char* extension);
// Returns the file name of a URI, with "%20" and the like decoded.
std::string decoded_uri(const std::string& uri);
// Returns three numbers times a factor; missing, negative or non-finite ones are 0.
Rgb color_of(const std::vector<double>& numbers, double factor = 1);

// Call read() once. The parts are in read_gltf.cpp (the file, the nodes) and in gltf_extensions.cpp,
// gltf_accessors.cpp, gltf_materials.cpp and gltf_meshes.cpp.
class GltfReader {
  public:
    GltfReader(const std::filesystem::path& file, Monitor& monitor) : file_(file), monitor_(monitor) {}

    Model read();

  private:
    template <typename... Args>
    [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
        input_error({file_.string()}, "{}", one_line(fmt::format(format, std::forward<Args>(args)...)));
    }
    template <typename... Args>
    void warn(fmt::format_string<Args...> format, Args&&... args) const {
        monitor_.warn(fmt::format("{}: {}", file_.string(),
                                  one_line(fmt::format(format, std::forward<Args>(args)...))));
    }
    template <typename T>
    const T& pick(const std::vector<T>& all, int index, std::string_view what) const {
        if (index < 0 || static_cast<std::size_t>(index) >= all.size()) {
            fail("{} {} does not exist; there are {}", what, index, all.size());
        }
        return all[static_cast<std::size_t>(index)];
    }

    void parse();
    void check_extensions();
    std::span<const unsigned char> view_bytes(int view) const;
    std::vector<double> numbers(int accessor, int components, std::string_view what) const;
    void read_elements(std::vector<double>& out, const tinygltf::Accessor& accessor, int components,
                       std::string_view what) const;
    void apply_sparse(std::vector<double>& out, const tinygltf::Accessor& accessor, int components) const;

    void read_images();
    std::span<const std::byte> image_bytes(int image) const;
    ModelTexture texture(int index, int tex_coord, const tinygltf::ExtensionMap& extensions,
                         const std::string& material) const;
    std::optional<Pixels> pixels(const ModelTexture& texture) const;
    ModelMaterial material(const tinygltf::Material& from) const;
    void read_transmission(ModelMaterial& made, const tinygltf::Material& from) const;
    void read_alpha(ModelMaterial& made, const tinygltf::Material& from) const;

    void read_meshes();
    void require_room_for_meshes() const;
    ModelMesh primitive(const tinygltf::Primitive& from, const std::string& name) const;
    std::vector<std::uint32_t> corners(const tinygltf::Primitive& from, std::size_t vertices,
                                       const std::string& name) const;

    void require_room_for_placements() const;
    void visit_nodes();
    void visit(int node, const M44d& parent, bool visible, int depth);
    void attach(const tinygltf::Node& node, const M44d& world, bool visible);
    bool has_light(const tinygltf::Node& node) const;
    std::size_t instance_count(const tinygltf::Node& node) const;
    std::vector<M44d> instances(const tinygltf::Node& node) const;
    void read_profiles();
    std::optional<ModelLight> profile_light(const tinygltf::Node& node, const M44d& world) const;
    M44d local_matrix(const tinygltf::Node& node) const;
    ModelCamera camera(const tinygltf::Camera& from, const M44d& world) const;
    ModelLight light(const tinygltf::Light& from, const M44d& world) const;

    std::filesystem::path file_;
    Monitor& monitor_;
    tinygltf::Model in_;
    Model out_;
    std::vector<std::vector<std::size_t>> primitives_;  // indices in out_.meshes, by glTF mesh
    std::vector<bool> visited_;
};

}  // namespace lucerna
