// The small valid files that tests of the command's readers and outputs start from.
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/image/image.h"
#include "tests/process/command.h"

namespace lucerna::testing {

// A mesh of two triangles.
inline constexpr const char* kMesh =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 1\n1 0 1\n1 1 1\n0 1 1\n3 0 1 2\n3 0 2 3\n";

// One triangle, whose corners are in model.bin.
inline constexpr const char* kModel =
    R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
"bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "model.bin", "byteLength": 36}]})";

// One triangle, whose material is in room.mtl.
inline constexpr const char* kRoom = "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl white\nf 1 2 3\n";

// A rig up to its emitter, and an emitter that suits it.
inline constexpr const char* kPlanes =
    "[rig]\nsetup = 'A'\nviews = 6\nspacing = '4mm'\npixels = [12, 10]\npixel = '2mm'\ndistance = "
    "'40mm'\n[emitter]\n";
inline constexpr const char* kDisc =
    "kind = 'disc'\nradius = '6mm'\nexponent = 20\nflux = 7\nunit = 'W'\nsetback = '2mm'\n";

// A folder of files written directly and by the command itself.
class GoodFiles {
  public:
    explicit GoodFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }
    // Runs the command in the folder; throws if it fails.
    void make(const std::vector<std::string>& words) const {
        constexpr double kPatience = 120;  // seconds, while other tests run
        const Finished made = run_command(words, {folder_, kPatience});
        if (made.code != 0) throw std::runtime_error(words[1] + ": " + made.err);
    }
    // Writes mesh.ply, paint.spd, rig.toml, model.gltf and model.bin, room.obj and room.mtl, and the
    // identical picture.exr and reference.exr.
    void write_parts() const {
        write("mesh.ply", kMesh);
        write("paint.spd", "400 0.2\n500 0.4\n700 0.5\n");
        write("rig.toml", std::string(kPlanes) + kDisc);
        write("model.gltf", kModel);
        write("room.obj", kRoom);
        write("room.mtl", "newmtl white\nKd 0.8 0.8 0.8\n");
        const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        write("model.bin", std::string(reinterpret_cast<const char*>(corners), sizeof corners));
        for (const char* name : {"picture.exr", "reference.exr"}) write_exr(folder_ / name, picture());
    }
    // Makes lamp.exr from rig.toml, its photographs in shots, and its far field in `far_field`.
    void make_lamp(const std::string& far_field) const {
        make({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--photographs", "shots"});
        make({"light", "farfield", "lamp.exr", "--step", "15", "--plane-step", "90", "--efficacy", "100",
              "-o", far_field});
    }
    // Writes 2000 rays of lamp.exr, in the format given by the name's suffix.
    void make_rays(const std::string& name) const {
        make({"light", "emit", "lamp.exr", "--rays", "2000", "-o", name});
    }
    // Returns an image of numbers that do not compress.
    static Image picture() {
        Image image = Image::rgb(16, 16);
        for (std::size_t i = 0; i < image.data.size(); ++i)
            image.data[i] = static_cast<float>(i * 7919 % 101) / 101;
        return image;
    }

  private:
    std::filesystem::path folder_;
};

}  // namespace lucerna::testing
