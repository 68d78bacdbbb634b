// A glTF 2.0 model as plain numbers: what the file says about meshes, materials, cameras and lights, checked,
// and nothing of how it says it.
//
// Coordinates are glTF's: metres, right-handed, y up, cameras and lights look along their -z. Matrices are
// Imath's (row vectors). Texture coordinates are pbrt's: (0,0) is an image's lower left corner.
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

// A picture (PNG or JPEG) or a photometric file (IES) that the model refers to or holds.
struct GltfFile {
    std::filesystem::path file;    // where it lies; empty: it was embedded, and here it is
    std::vector<std::byte> bytes;  // its content, if it was embedded
    std::string suffix;            // ".png", ".jpg" or ".ies"
};

// One use of an image: uv scaled, then moved.
struct GltfTexture {
    int image = -1;  // -1: none
    V2d scale{1, 1}, offset{0, 0};
};

// What of a surface is there, from 0 to 1, top row first.
struct GltfCutout {
    int width = 0, height = 0;
    std::vector<float> alpha;
};

struct GltfMaterial {
    std::string name;
    Rgb base{1.0F};  // linear; multiplies the texture
    GltfTexture base_texture;
    // Of a texture the means are taken: pbrt has no channel of an image as a parameter.
    double metallic = 1;
    double roughness = 1;  // GGX's alpha is its square
    GltfTexture normal;
    Rgb emission{0.0F};  // cd/m², the texture's mean in it
    double alpha = 1;
    std::optional<GltfCutout> cutout;
    GltfTexture cutout_texture;  // whose uv the cutout takes
    double transmission = 0;
    bool thin = true;  // what transmits has no volume: a pane
    double ior = 1.5;
    bool two_sided = false;
    bool unlit = false;
};

// pbrt's glass transmits all or nothing.
inline bool is_glass(const GltfMaterial& material) {
    return material.transmission >= 0.5;
}

// One primitive of a mesh: triangles of one material.
struct GltfMesh {
    std::string name;
    int material = -1;   // -1: glTF's default
    std::vector<V3f> p;  // finite
    std::vector<V3f> n;  // as p, or empty
    std::vector<V2f> uv;
    std::vector<V3i> triangles;  // every index is one of a vertex
};

struct GltfPlacement {
    std::size_t mesh = 0;
    M44d world_from_mesh;
};

struct GltfCamera {
    std::string name;
    bool perspective = true;
    double yfov = 0.8;          // radians
    double aspect = 0;          // width over height; 0: not said
    double xmag = 1, ymag = 1;  // half width and half height of an orthographic view, metres
    M44d world_from_camera;
};

struct GltfLight {
    enum class Kind : std::uint8_t { point, spot, directional, ies } kind = Kind::point;
    std::string name;
    Rgb intensity{1.0F};          // candela; lux if directional; a factor of an IES file's candela
    std::size_t profile = 0;      // in GltfModel::profiles, of an IES file
    double inner = 0, outer = 0;  // radians from the axis, for a spot
    M44d world_from_light;
};

struct GltfModel {
    std::vector<GltfFile> images, profiles;
    std::vector<GltfMaterial> materials;
    std::vector<GltfMesh> meshes;
    std::vector<GltfPlacement> placements;
    std::vector<GltfCamera> cameras;
    std::vector<GltfLight> lights;
    bool other_lights = false;  // it has lights that are hidden, or of an extension that is not read
    std::vector<std::filesystem::path> files = {};  // that it refers to
};

// A .gltf or .glb file with what it refers to. What cannot be carried over (animations, skins, points and
// lines, ...) is a warning on the monitor. Throws InputError naming file, place and cause: a count or offset
// is believed only as far as its buffer is long.
GltfModel read_gltf(const std::filesystem::path& file, Monitor& monitor);

// Corners of triangles from glTF's modes: 4 triangles, 5 strip, 6 fan. Every other corner of a strip is
// turned so that all face one side; triangles that use a vertex twice are left out. `vertices` corners 0, 1,
// 2, ... if there are no indices; left-over corners are dropped.
std::vector<V3i> triangles_of(int mode, const std::vector<std::uint32_t>& corners);

// What is asked of a texture's pixels while a model is read: means, and what its alpha leaves of a surface.

// R, G, B, A, 8 bits each, top row first; not empty.
struct Pixels {
    int width = 0, height = 0;
    std::vector<unsigned char> rgba;
};

Rgb mean_linear(const Pixels& pixels);  // of the numbers as they stand
Rgb mean_srgb(const Pixels& pixels);    // of the colours that they encode
// Alpha times `factor`; with a cutoff 1 from there on and 0 below. None if everything is there.
std::optional<GltfCutout> cutout_of(const Pixels& pixels, double factor, std::optional<double> cutoff);

// Width and height that a PNG or JPEG file says it has, without a look at its pixels; none if it is neither.
std::optional<std::pair<std::uint32_t, std::uint32_t>> picture_size(std::span<const std::byte> bytes);

}  // namespace lucerna
