#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <stdexcept>

#include "tests/bombs/bomb.h"
#include "tests/bombs/bomb_text.h"

namespace lucerna::testing {
namespace {

// --- gzip ---

// Returns a deflated block of blanks that can be repeated any number of times; `last` ends the data.
std::string deflated(std::size_t blanks, bool last) {
    z_stream stream{};
    if (deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::runtime_error("no deflate");
    std::string in(blanks, ' '), out(blanks / 100 + 1000, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(in.data());
    stream.avail_in = static_cast<uInt>(in.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    deflate(&stream, last ? Z_FINISH : Z_FULL_FLUSH);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

constexpr std::size_t kStretch = std::size_t{10} << 20;

// Appends `empty` deflate blocks of five bytes to each run of blanks, which lowers the compression ratio.
std::string gzip_of_blanks(std::size_t stretches, std::size_t empty = 0) {
    const std::string blanks(kStretch, ' ');
    const auto once = crc32(0, reinterpret_cast<const Bytef*>(blanks.data()), kStretch);
    uLong check = 0;
    for (std::size_t i = 0; i < stretches; ++i) check = crc32_combine(check, once, kStretch);
    std::string file("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10);
    const std::string blocks = repeated(std::string("\0\0\0\xff\xff", 5), empty);
    file += repeated(deflated(kStretch, false) + blocks, stretches - 1) + deflated(kStretch, true);
    append(file, static_cast<std::uint32_t>(check));
    append(file, static_cast<std::uint32_t>(stretches * kStretch));
    return file;
}

// --- OpenEXR ---

void attribute(std::string& file, std::string_view name, std::string_view type, const std::string& value) {
    file.append(name).push_back('\0');
    file.append(type).push_back('\0');
    append(file, static_cast<std::int32_t>(value.size()));
    file += value;
}

template <typename... Numbers>
std::string packed(Numbers... numbers) {
    std::string bytes;
    (append(bytes, numbers), ...);
    return bytes;
}

// Returns a header with the given size, followed only by zeros.
std::string exr(int width, int height, const std::vector<std::string>& channels, std::size_t bytes,
                const std::string& more_attributes = {}) {
    std::string file = packed(std::uint32_t{20000630}, std::uint32_t{2}), list;
    for (const std::string& channel : channels) {
        list.append(channel).push_back('\0');
        list += packed(std::int32_t{channels.size() == 1 ? 1 : 2}, std::int32_t{0}, std::int32_t{1},
                       std::int32_t{1});
    }
    list.push_back('\0');
    const std::string window = packed(0, 0, width - 1, height - 1);
    attribute(file, "channels", "chlist", list);
    attribute(file, "compression", "compression", std::string(1, channels.size() == 1 ? '\3' : '\x9'));
    attribute(file, "dataWindow", "box2i", window);
    attribute(file, "displayWindow", "box2i", window);
    attribute(file, "lineOrder", "lineOrder", std::string(1, '\0'));
    attribute(file, "pixelAspectRatio", "float", packed(1.0F));
    attribute(file, "screenWindowCenter", "v2f", packed(0.0F, 0.0F));
    attribute(file, "screenWindowWidth", "float", packed(1.0F));
    file += more_attributes;
    file.push_back('\0');
    file.resize(std::max(bytes, file.size()), '\0');
    return file;
}

std::string light_field(int views, int pixels, std::size_t bytes) {
    std::string more;
    attribute(more, "lightfieldVersion", "int", packed(1));
    attribute(more, "lightfieldViews", "v2i", packed(views, views));
    attribute(more, "lightfieldPixels", "v2i", packed(pixels, pixels));
    attribute(more, "lightfieldShift", "v2i", packed(0, 0));
    attribute(more, "lightfieldSpacing", "v2d", packed(0.001, 0.001));
    attribute(more, "lightfieldPixelSize", "v2d", packed(0.001, 0.001));
    attribute(more, "lightfieldDistance", "double", packed(1.0));
    attribute(more, "lightfieldCentre", "v3d", packed(0.0, 0.0, 0.0));
    attribute(more, "lightfieldLengthUnit", "string", "m");
    attribute(more, "lightfieldFluxUnit", "string", "W");
    attribute(more, "lightfieldScale", "double", packed(1.0));
    attribute(more, "lightfieldColour", "v3f", packed(1.0F, 1.0F, 1.0F));
    attribute(more, "lightfieldBasis", "string", "piecewise quadratic bell on S, pixel box on M");
    attribute(more, "lightfieldProvenance", "string", "nothing");
    attribute(more, "lightfieldCapturedFlux", "double", packed(1.0));
    attribute(more, "lightfieldMissedFlux", "double", packed(0.0));
    return exr(views * pixels, views * pixels, {"Y"}, bytes, more);
}

// --- pictures ---

std::string big_endian(std::uint32_t number) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 0xFF);
    return bytes;
}

std::string chunk(std::string_view name, const std::string& data) {
    const std::string body = std::string(name) + data;
    const auto check = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    return big_endian(static_cast<std::uint32_t>(data.size())) + body +
           big_endian(static_cast<std::uint32_t>(check));
}

// Returns a PNG of 16 bits per channel that ends before its pixels begin.
std::string png(std::uint32_t side, std::size_t bytes) {
    return "\x89PNG\r\n\x1a\n" +
           chunk("IHDR", big_endian(side) + big_endian(side) + std::string("\x10\x02\0\0\0", 5)) +
           chunk("IDAT", std::string("\x78\xda", 2) + std::string(bytes, '\0')) + chunk("IEND", "");
}

// --- glTF ---

std::string zeros_of_gltf(std::size_t count) {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
           R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":0}}]}],)" +
           fmt::format(R"("accessors":[{{"componentType":5126,"count":{},"type":"VEC3"}}]}})", count);
}

// --- text ---

std::string many_triangles(int count, int levels) {
    std::string indices, points;
    for (int i = 0; i < count; ++i) {
        indices += fmt::format("{} {} {} ", 3 * i, 3 * i + 1, 3 * i + 2);
        points += fmt::format("{0} 0 0 {0} 1 0 {0} 0 1 ", i);
    }
    return scene(
        fmt::format("Shape \"loopsubdiv\" \"integer levels\" {} \"integer indices\" [ {}] \"point3 P\" [ {}]",
                    levels, indices, points));
}

std::string tm25(std::uint64_t rays) {
    std::string file = "TM25" + packed(std::int32_t{2013}, std::int32_t{0}, 1.0F, 1.0F, rays);
    file.resize(36288, '\0');
    for (const int flag : {0, 1, 2}) file[static_cast<std::size_t>(256 + 4 * flag)] = '\1';
    return file + std::string(1000, '\0');
}

Bomb of_file(std::string name, std::string file, std::function<std::string()> bytes,
             std::vector<std::string> words, std::vector<std::string> mentions) {
    return {std::move(name),
            [file = std::move(file), bytes = std::move(bytes)](const std::filesystem::path& folder) {
                write(folder / file, bytes());
            },
            std::move(words), std::move(mentions)};
}

// Returns a bomb of the file and a scene that names it.
Bomb of_named_file(std::string name, std::string file, std::function<std::string()> bytes, std::string world,
                   std::vector<std::string> mentions) {
    mentions.emplace_back("scene.pbrt:");
    return {std::move(name),
            [file = std::move(file), bytes = std::move(bytes), world](const std::filesystem::path& folder) {
                write(folder / file, bytes());
                write(folder / "scene.pbrt", scene(world));
            },
            kRender, std::move(mentions)};
}

}  // namespace

std::vector<Bomb> lying_bombs() {
    const auto image = [] { return exr(20'000, 20'000, {"B", "G", "R"}, 170'000); };
    const auto sky = [] { return exr(16'000, 16'000, {"B", "G", "R"}, 170'000); };
    const auto lamp = [] { return light_field(200, 100, 170'000); };
    const auto picture = [] { return png(16'384, 1'700'000); };
    const std::vector<std::string> lamp_info{"light", "info", "lamp.exr"};
    return {
        of_file("GzipOfASceneInOnePiece", "scene.pbrt", [] { return gzip_of_blanks(300); }, kRender,
                {"scene.pbrt", "400 times"}),
        of_file("GzipOfASceneInManyPieces", "scene.pbrt", [] { return repeated(gzip_of_blanks(1), 40); },
                kRender, {"scene.pbrt", "400 times"}),
        of_named_file("GzipOfAMesh", "mesh.ply", [] { return gzip_of_blanks(300, 10'000); },
                      R"(Shape "plymesh" "string filename" "mesh.ply")", {"mesh.ply", "memory"}),
        of_file("ImageToCompare", "image.exr", image, {"compare", "image.exr", "image.exr"},
                {"image.exr", "20000 x 20000", "needs 4.8 GB"}),
        of_named_file("ImageOfATexture", "image.exr", image,
                      R"(Texture "t" "spectrum" "imagemap" "string filename" "image.exr")", {"image.exr"}),
        of_named_file("ImageOfASky", "image.exr", sky,
                      R"(LightSource "infinite" "string filename" "image.exr")", {"image.exr", "memory"}),
        of_named_file("PictureOfASky", "image.png", picture,
                      R"(LightSource "infinite" "string filename" "image.png")", {"image.png", "memory"}),
        of_file("LightField", "lamp.exr", lamp, lamp_info, {"lamp.exr", "memory"}),
        of_named_file("LightFieldOfAScene", "lamp.exr", lamp,
                      R"(LightSource "lightfield" "string filename" "lamp.exr")", {"lamp.exr"}),
        of_file("ZerosOfAModel", "model.gltf", [] { return zeros_of_gltf(99'000'000); },
                {"import", "model.gltf", "-o", "model.pbrt", "--quiet"}, {"model.gltf", "memory"}),
        of_file("MeshOfManyTriangles", "scene.pbrt", [] { return many_triangles(190, 10); }, kRender,
                {"scene.pbrt:", "memory"}),
        of_named_file(
            "MeshOfManyVertices", "mesh.ply",
            [] {
                return std::string(
                    "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
                    "property float z\nelement face 4000000000\nproperty list uchar int vertex_indices\n"
                    "end_header\n0 0 0\n");
            },
            R"(Shape "plymesh" "string filename" "mesh.ply")", {"mesh.ply", "4000000000"}),
        of_file("RaysOfALamp", "lamp.tm25ray", [] { return tm25(std::uint64_t{1} << 60); },
                {"light", "info", "lamp.tm25ray"}, {"lamp.tm25ray"}),
        {"RaysOfHoles",
         [](const std::filesystem::path& folder) {
             const std::uint64_t rays = std::uint64_t{1} << 36;
             write(folder / "lamp.tm25ray", tm25(rays));
             std::filesystem::resize_file(folder / "lamp.tm25ray", 36288 + 28 * rays);
         },
         {"light", "info", "lamp.tm25ray"},
         {"lamp.tm25ray", "memory"}},
        {"FileOfHoles",
         [](const std::filesystem::path& folder) {
             write(folder / "scene.pbrt", "#");
             std::filesystem::resize_file(folder / "scene.pbrt", std::uintmax_t{1} << 42);
         },
         kRender,
         {"scene.pbrt", "needs 4.4 TB"}},
        {"ViewsOfARig",
         [](const std::filesystem::path&) {},
         {"light", "acquire", "--views", "4096x4096", "--pixels", "4096x4096", "-o", "lamp.exr"},
         {"memory"}},
        of_file(
            "FilmOfAScene", "scene.pbrt", [] { return scene("Shape \"sphere\""); },
            [] {
                auto words = kRender;
                words.insert(words.end(), {"--resolution", "65536x65536"});
                return words;
            }(),
            {"65536 x 65536", "memory"}),
    };
}

}  // namespace lucerna::testing
