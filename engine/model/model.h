// A model, read from glTF 2.0 or OBJ, as plain numbers: its meshes, materials, cameras and lights, checked
// and independent of the file's encoding.
//
// Placed coordinates are glTF's: metres, right-handed, y up, cameras and lights look along their -z. Matrices
// are Imath's (row vectors). Texture coordinates are pbrt's: (0,0) is an image's lower left corner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/vec.h"

namespace lucerna {

using Imath::V2d;

// A picture (PNG or JPEG) or a photometric file (IES) that the model refers to or contains.
struct ModelFile {
    std::filesystem::path file;    // its path; empty: embedded
    std::vector<std::byte> bytes;  // content, if embedded
    std::string suffix;            // ".png", ".jpg" or ".ies"
};

// One use of an image, with uv scaled, then offset.
struct ModelTexture {
    int image = -1;  // -1: none
    V2d scale{1, 1}, offset{0, 0};
};

// The opacity of a surface, from 0 to 1, top row first.
struct ModelCutout {
    int width = 0, height = 0;
    std::vector<float> alpha;
};

struct ModelMaterial {
    std::string name;
    Rgb base{1.0F};  // linear; multiplies the texture
    ModelTexture base_texture;
    // Textures give their means, because a parameter of pbrt cannot be one channel of an image.
    double metallic = 1;
    double roughness = 1;  // its square is GGX's alpha
    ModelTexture normal;
    Rgb emission{0.0F};  // cd/m², including the mean of the texture
    double alpha = 1;
    std::optional<ModelCutout> cutout;
    ModelTexture cutout_texture;  // its uv applies to the cutout
    double transmission = 0;
    bool thin = true;  // transmits without volume, like a pane
    double ior = 1.5;
    bool two_sided = false;
    bool unlit = false;
};

// pbrt's glass transmits either all or nothing.
inline bool is_glass(const ModelMaterial& material) {
    return material.transmission >= 0.5;
}

// One primitive of a mesh: triangles of one material.
struct ModelMesh {
    std::string name;
    int material = -1;   // -1: glTF's default
    std::vector<V3f> p;  // finite
    std::vector<V3f> n;  // as many as p, or empty
    std::vector<V2f> uv;
    std::vector<V3i> triangles;  // all indices are valid
};

struct ModelPlacement {
    std::size_t mesh = 0;
    M44d world_from_mesh;
};

struct ModelCamera {
    std::string name;
    bool perspective = true;
    double yfov = 0.8;          // radians
    double aspect = 0;          // width over height; 0: not given
    double xmag = 1, ymag = 1;  // half width and half height of an orthographic view, metres
    M44d world_from_camera;
};

struct ModelLight {
    enum class Kind : std::uint8_t { point, spot, directional, ies } kind = Kind::point;
    std::string name;
    Rgb intensity{1.0F};          // candela; lux if directional; a factor of an IES file's candela
    std::size_t profile = 0;      // index in Model::profiles, for an IES file
    double inner = 0, outer = 0;  // radians from the axis, for a spot
    M44d world_from_light;
};

struct Model {
    std::vector<ModelFile> images, profiles;
    std::vector<ModelMaterial> materials;
    std::vector<ModelMesh> meshes;
    std::vector<ModelPlacement> placements;
    std::vector<ModelCamera> cameras;
    std::vector<ModelLight> lights;
    bool other_lights = false;                      // has hidden lights or lights of an unsupported extension
    std::vector<std::filesystem::path> files = {};  // files that it refers to
};

// Reads a .gltf or .glb file and the files that it refers to. Warns of features that cannot be converted
// (animations, skins, points and lines, ...). Throws InputError naming file, place and cause; counts and
// offsets are checked against their buffers.
Model read_gltf(const std::filesystem::path& file, Monitor& monitor);

// The frame of an OBJ file, which does not state it.
struct ObjFrame {
    double unit = 1;  // metres, from 1e-6 to 1e6
    bool z_up = false;
};

// Reads an .obj file and the .mtl files that it names. Meshes keep the file's unit and axes; their placements
// turn and scale them. Warns once of each kind of statement that is not converted. Throws InputError naming
// file, line and cause, also for a material or an index that does not exist.
Model read_obj(const std::filesystem::path& file, const ObjFrame& frame, Monitor& monitor);

// Cuts a polygon into triangles of its corners' numbers, all of which face its side. It may be concave, and
// may run back along an edge to reach a hole. One that crosses itself, or is not plane, is covered
// approximately. Triangles without area are dropped.
std::vector<V3i> triangles_of_polygon(std::span<const V3d> corners);

// Returns the triangles of glTF's modes: 4 triangles, 5 strip, 6 fan. Every other triangle of a strip is
// reversed so that all face one side. Drops triangles that use a vertex twice and left-over corners.
std::vector<V3i> triangles_of(int mode, const std::vector<std::uint32_t>& corners);

// The functions below evaluate a texture's pixels while a model is read: means, and the opacity from alpha.

// R, G, B, A, 8 bits each, top row first; not empty.
struct Pixels {
    int width = 0, height = 0;
    std::vector<unsigned char> rgba;
};

// Decodes a PNG or JPEG file. Returns nothing for one of 16 bits. Throws InputError "NAME cannot be decoded;
// expected PNG or JPEG", or if it needs more memory than there is.
std::optional<Pixels> decoded_picture(std::span<const std::byte> bytes, const std::string& name);

Rgb mean_linear(const Pixels& pixels);  // of the stored numbers
Rgb mean_srgb(const Pixels& pixels);    // of the colours that they encode
// Returns alpha times `factor`, or with a cutoff 1 from there on and 0 below. Returns nothing if all is
// opaque.
std::optional<ModelCutout> cutout_of(const Pixels& pixels, double factor, std::optional<double> cutoff);

// Returns width and height from the header of a PNG or JPEG file; nothing if it is neither.
std::optional<std::pair<std::uint32_t, std::uint32_t>> picture_size(std::span<const std::byte> bytes);

}  // namespace lucerna
