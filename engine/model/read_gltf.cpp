// Reads the file, its nodes, cameras and lights [glTF 2.0, KHR_lights_punctual].
#include <Imath/ImathQuat.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/model/gltf_reader.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

std::uint32_t word_at(const std::vector<std::byte>& bytes, std::size_t at) {
    std::uint32_t word = 0;  // little-endian, like this machine
    std::memcpy(&word, bytes.data() + at, 4);
    return word;
}

// Checks the version and the length of a .glb's JSON. tinygltf checks the rest of its header. Throws
// InputError.
void check_glb(const std::string& file, const std::vector<std::byte>& bytes) {
    if (bytes.size() < 20 || word_at(bytes, 12) > bytes.size() - 20)
        input_error({file}, "is truncated: its JSON chunk does not fit into {} bytes", bytes.size());
    if (word_at(bytes, 4) != 2)
        input_error({file}, "glTF version {} is not supported; expected 2", word_at(bytes, 4));
}

constexpr int kMostNested = 128;  // depth of nested arrays and objects
// Memory of the JSON library and tinygltf per value, even for a single digit.
constexpr std::uint64_t kBytesOfValue = 250;

// Checks the JSON before tinygltf parses it recursively and keeps even unused values. Outside strings,
// brackets and commas give the depth and the number of values.
void check_json(const std::string& file, std::span<const std::byte> text) {
    std::uint64_t values = 1;
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = static_cast<char>(text[i]);
        if (in_string) {
            if (c == '\\') ++i;
            in_string = c != '"';
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            ++values;
            if (++depth > kMostNested)
                input_error({file}, "its JSON is nested more than {} deep at byte {}", kMostNested, i);
        } else if (c == ']' || c == '}') {
            --depth;
        } else if (c == ',') {
            ++values;
        }
    }
    require_memory(values * kBytesOfValue, file, "use a model with fewer parts");
}

// Keeps images undecoded. Those in a buffer are taken from it later, when its length is known.
bool keep_image(tinygltf::Image* image, const int, std::string*, std::string*, int, int,
                const unsigned char* bytes, int size, void*) {
    image->as_is = true;
    if (image->bufferView < 0 && size > 0) image->image.assign(bytes, bytes + size);
    return true;
}

// Gives tinygltf access to files without expanding names or throwing. Adds the names of read files to
// `files`.
tinygltf::FsCallbacks file_access(std::vector<std::filesystem::path>& files) {
    tinygltf::FsCallbacks access{};
    access.FileExists = [](const std::string& name, void*) {
        std::error_code status;
        return std::filesystem::is_regular_file(name, status);
    };
    access.ExpandFilePath = [](const std::string& name, void*) { return name; };
    access.user_data = &files;
    access.ReadWholeFile = [](std::vector<unsigned char>* out, std::string* error, const std::string& name,
                              void* read_files) {
        static_cast<std::vector<std::filesystem::path>*>(read_files)->push_back(name);
        try {
            const std::vector<std::byte> bytes = read_bytes(name);
            const auto* first = reinterpret_cast<const unsigned char*>(bytes.data());
            out->assign(first, first + bytes.size());
            return true;
        } catch (const InputError& cause) {
            if (error) *error += cause.what();
            return false;
        }
    };
    access.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
        return false;
    };
    return access;
}

}  // namespace

void GltfReader::parse() {
    const std::vector<std::byte> bytes = read_bytes(file_);
    if (bytes.size() > kMostCount) fail("is {} bytes long; the limit is 2 GiB", bytes.size());
    const bool binary = bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
    if (binary) check_glb(file_.string(), bytes);
    const std::span<const std::byte> all(bytes);
    check_json(file_.string(), binary ? all.subspan(20, word_at(bytes, 12)) : all);
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(keep_image, nullptr);
    loader.SetFsCallbacks(file_access(out_.files));
    const std::string folder = file_.has_parent_path() ? file_.parent_path().string() : ".";
    const auto size = static_cast<unsigned int>(bytes.size());
    std::string error, warning;
    bool good = false;
    try {
        good = binary ? loader.LoadBinaryFromMemory(&in_, &error, &warning,
                                                    reinterpret_cast<const unsigned char*>(bytes.data()),
                                                    size, folder)
                      : loader.LoadASCIIFromString(&in_, &error, &warning,
                                                   reinterpret_cast<const char*>(bytes.data()), size, folder);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& cause) {  // thrown by the JSON library on unexpected types
        error += cause.what();
    }
    if (!good) fail("is not a glTF 2.0 model: {}", error.empty() ? "it cannot be parsed" : error);
    if (!warning.empty()) warn("{}", warning);
}

// --- nodes ---

M44d GltfReader::local_matrix(const tinygltf::Node& node) const {
    const auto count = [&](const std::vector<double>& numbers, std::size_t wanted, const char* what) {
        if (numbers.empty()) return false;
        if (numbers.size() != wanted) {
            fail("node \"{}\": {} has {} numbers; expected {}", node.name, what, numbers.size(), wanted);
        }
        for (const double number : numbers) {
            if (!std::isfinite(number)) fail("node \"{}\": {} holds {}", node.name, what, number);
        }
        return true;
    };
    M44d matrix;
    if (count(node.matrix, 16, "matrix")) {
        // The columns in order are the rows of the transpose, which suits row vectors.
        for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
        return matrix;
    }
    if (count(node.scale, 3, "scale")) matrix.scale(V3d(node.scale[0], node.scale[1], node.scale[2]));
    if (count(node.rotation, 4, "rotation")) {
        const Imath::Quatd turn(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
        if (!(turn.length() > 1e-6)) fail("node \"{}\": its rotation is not a unit quaternion", node.name);
        matrix = matrix * turn.normalized().toMatrix44();  // the length is checked above
    }
    if (count(node.translation, 3, "translation")) {
        matrix = matrix *
                 M44d().setTranslation(V3d(node.translation[0], node.translation[1], node.translation[2]));
    }
    return matrix;
}

ModelCamera GltfReader::camera(const tinygltf::Camera& from, const M44d& world) const {
    ModelCamera made;
    made.name = from.name;
    made.world_from_camera = world;
    made.perspective = from.type != "orthographic";
    if (made.perspective) {
        made.yfov = from.perspective.yfov;
        made.aspect = from.perspective.aspectRatio;
        if (!(made.yfov > 1e-4 && made.yfov < 3.14)) {
            fail("camera \"{}\": yfov {} is not accepted; expected radians between 0 and pi", from.name,
                 made.yfov);
        }
        if (!(made.aspect > 1e-3 && made.aspect < 1e3)) made.aspect = 0;
    } else {
        made.xmag = std::fabs(from.orthographic.xmag), made.ymag = std::fabs(from.orthographic.ymag);
        if (!(made.xmag > 0 && made.ymag > 0 && std::isfinite(made.xmag) && std::isfinite(made.ymag))) {
            fail("camera \"{}\": xmag {} and ymag {} are not accepted; expected more than 0", from.name,
                 made.xmag, made.ymag);
        }
        made.aspect = made.xmag / made.ymag;
    }
    return made;
}

ModelLight GltfReader::light(const tinygltf::Light& from, const M44d& world) const {
    ModelLight made;
    made.name = from.name;
    made.world_from_light = world;
    if (from.type == "directional") {
        made.kind = ModelLight::Kind::directional;
    } else if (from.type == "spot") {
        made.kind = ModelLight::Kind::spot;
        made.inner = from.spot.innerConeAngle, made.outer = from.spot.outerConeAngle;
        if (!(made.inner >= 0 && made.inner <= made.outer && made.outer > 0 && made.outer <= 1.5708)) {
            fail("light \"{}\": cone angles {} and {} are not accepted; expected 0 <= inner <= outer <= pi/2",
                 from.name, made.inner, made.outer);
        }
    } else if (from.type != "point") {
        fail("light \"{}\": type \"{}\" is unknown; expected point, spot or directional", from.name,
             from.type);
    }
    if (!(from.intensity >= 0 && std::isfinite(from.intensity))) {
        fail("light \"{}\": intensity {} is not accepted", from.name, from.intensity);
    }
    if (from.range > 0) {
        warn("light \"{}\": its range of {} m is ignored; its light falls off by the inverse square alone",
             from.name, from.range);
    }
    made.intensity =
        from.color.empty() ? Rgb(static_cast<float>(from.intensity)) : color_of(from.color, from.intensity);
    return made;
}

// Adds a node's camera, mesh and lights at the node's place.
void GltfReader::attach(const tinygltf::Node& node, const M44d& world, bool visible) {
    if (node.camera >= 0) out_.cameras.push_back(camera(pick(in_.cameras, node.camera, "camera"), world));
    if (!visible) {
        out_.other_lights = out_.other_lights || has_light(node);
        return;
    }
    if (node.mesh >= 0) {
        const std::vector<std::size_t>& pieces = pick(primitives_, node.mesh, "mesh");
        for (const M44d& instance : instances(node)) {
            for (const std::size_t piece : pieces) out_.placements.push_back({piece, instance * world});
        }
        if (node.skin >= 0) warn("node \"{}\": its skin is not applied", node.name);
    }
    if (const auto light = profile_light(node, world)) out_.lights.push_back(*light);
    if (const auto index = number_in(node.extensions, "KHR_lights_punctual", "light")) {
        if (!(*index >= 0 && *index < 1e9)) fail("node \"{}\": light {} does not exist", node.name, *index);
        out_.lights.push_back(light(pick(in_.lights, static_cast<int>(*index), "light"), world));
    }
}

void GltfReader::visit(int index, const M44d& parent, bool visible, int depth) {
    const tinygltf::Node& node = pick(in_.nodes, index, "node");
    // glTF requires trees: a second visit means a loop or a node with two parents. The depth is bounded to
    // protect the stack.
    if (visited_[static_cast<std::size_t>(index)])
        fail("node {} is reached twice; nodes must form trees", index);
    if (depth > 1000) fail("nodes are nested more than 1000 deep");
    visited_[static_cast<std::size_t>(index)] = true;
    const M44d world = local_matrix(node) * parent;
    // [KHR_node_visibility]: a hidden node hides its whole subtree, except cameras.
    const tinygltf::Value* visibility = object_in(node.extensions, "KHR_node_visibility");
    if (visibility && visibility->Has("visible") && visibility->Get("visible").IsBool())
        visible = visible && visibility->Get("visible").Get<bool>();
    attach(node, world, visible);
    for (const int child : node.children) visit(child, world, visible, depth + 1);
}

// Checks memory, because many nodes may show one mesh of many primitives.
void GltfReader::require_room_for_placements() const {
    constexpr std::uint64_t kText = 512;  // of the scene, for each placement
    std::uint64_t placements = 0;
    for (const tinygltf::Node& node : in_.nodes) {
        if (node.mesh >= 0) placements += pick(primitives_, node.mesh, "mesh").size() * instance_count(node);
    }
    require_memory(bytes_of(placements, sizeof(ModelPlacement) + kText),
                   fmt::format("{}: {} mesh instances", file_.string(), placements), "use fewer nodes");
}

void GltfReader::visit_nodes() {
    require_room_for_placements();
    visited_.assign(in_.nodes.size(), false);
    if (!in_.scenes.empty()) {
        const int scene = in_.defaultScene >= 0 ? in_.defaultScene : 0;
        for (const int root : pick(in_.scenes, scene, "scene").nodes) visit(root, M44d(), true, 0);
        return;
    }
    // Without a scene, every node that is no child is a root.
    std::vector<bool> child(in_.nodes.size(), false);
    for (const tinygltf::Node& node : in_.nodes) {
        for (const int index : node.children) {
            pick(in_.nodes, index, "node");
            child[static_cast<std::size_t>(index)] = true;
        }
    }
    for (std::size_t i = 0; i < in_.nodes.size(); ++i) {
        if (!child[i]) visit(static_cast<int>(i), M44d(), true, 0);
    }
}

Model GltfReader::read() {
    monitor_.begin("glTF", 3);
    parse();
    check_extensions();
    monitor_.advance(1);
    read_images();
    for (const tinygltf::Material& each : in_.materials) out_.materials.push_back(material(each));
    monitor_.advance(1);
    read_meshes();
    read_profiles();
    visit_nodes();
    monitor_.advance(1);
    monitor_.end();
    if (!in_.animations.empty()) warn("{} animations are left out", in_.animations.size());
    if (out_.placements.empty()) fail("has no mesh that is visible in its scene");
    return std::move(out_);
}

Model read_gltf(const std::filesystem::path& file, Monitor& monitor) {
    return GltfReader(file, monitor).read();
}

}  // namespace lucerna
