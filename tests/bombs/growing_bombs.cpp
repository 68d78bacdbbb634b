#include <fmt/format.h>

#include "tests/bombs/bomb.h"
#include "tests/bombs/bomb_text.h"

namespace lucerna::testing {
namespace {

// Returns objects each of which instances the previous one twice.
std::string doubled_objects(std::string_view first, int times) {
    std::string world = fmt::format("ObjectBegin \"o0\" {} ObjectEnd\n", first);
    for (int i = 1; i <= times; ++i) {
        world += fmt::format(
            "ObjectBegin \"o{0}\" ObjectInstance \"o{1}\" ObjectInstance \"o{1}\" ObjectEnd\n", i, i - 1);
    }
    return scene(world + fmt::format("ObjectInstance \"o{}\"\n", times));
}

// Returns textures each of which uses the previous one twice.
std::string doubled_textures(std::string_view type, std::string_view kind, int times) {
    std::string world = fmt::format("Texture \"t0\" \"{}\" \"checkerboard\"\n", type);
    for (int i = 1; i <= times; ++i) {
        const std::string before = fmt::format("t{}", i - 1);
        world += fmt::format("Texture \"t{}\" \"{}\" {}\n", i, type, fmt::format(fmt::runtime(kind), before));
    }
    world += type == "float" ? fmt::format("Material \"matte\" \"texture sigma\" \"t{}\"\n", times)
                             : fmt::format("Material \"diffuse\" \"texture reflectance\" \"t{}\"\n", times);
    return scene(world + "Shape \"sphere\"");
}

// Writes files each of which includes the next one `times` times.
void files_of_files(const std::filesystem::path& folder, int depth, int times, std::string_view last) {
    for (int i = 0; i < depth; ++i) {
        write(folder / fmt::format("f{}.pbrt", i),
              repeated(fmt::format("Include \"f{}.pbrt\"\n", i + 1), static_cast<std::size_t>(times)));
    }
    write(folder / fmt::format("f{}.pbrt", depth), last);
    write(folder / "scene.pbrt", scene("Include \"f0.pbrt\""));
}

std::string long_word(char c) {
    return std::string(100'000, c);
}

// Returns a scene with defaults that each block inherits.
std::string inherited_defaults(int defaults, int blocks) {
    std::string world;
    for (int i = 0; i < defaults; ++i) world += fmt::format("Attribute \"shape\" \"float a{}\" 1\n", i);
    return scene(world + repeated("AttributeBegin\n", static_cast<std::size_t>(blocks)) +
                 "Shape \"sphere\"\n" + repeated("AttributeEnd\n", static_cast<std::size_t>(blocks)));
}

// Returns a scene with a long list as a default of every shape.
std::string long_default(int numbers, int shapes) {
    return scene("Attribute \"shape\" \"float unused\" [ " +
                 repeated("1 ", static_cast<std::size_t>(numbers)) + "]\n" +
                 repeated("Shape \"sphere\"\n", static_cast<std::size_t>(shapes)));
}

// Returns a model of many primitives that share the same vertices.
std::string shared_accessor(int primitives, std::size_t vertices) {
    std::string all;
    for (int i = 0; i < primitives; ++i) {
        all += i == 0 ? "" : ",";
        all += R"({"attributes":{"POSITION":0}})";
    }
    std::string zeros = repeated("AAAA", vertices * 4);
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)" +
           all +
           fmt::format(
               R"(]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{0},"type":"VEC3"}}],)"
               R"("bufferViews":[{{"buffer":0,"byteLength":{1}}}],"buffers":[{{"byteLength":{1},"uri":)"
               R"("data:application/octet-stream;base64,)",
               vertices, 12 * vertices) +
           zeros + R"("}]})";
}

}  // namespace

std::vector<Bomb> growing_bombs() {
    using enum Bomb::End;
    return {
        of_scene("EmptyObjectsDoubled", doubled_objects("", 40), {}, rendered),
        of_scene("ObjectsDoubled", doubled_objects("Shape \"sphere\"", 40),
                 {"scene.pbrt:", "instances", "100000000"}),
        of_scene("ObjectsDoubledPastAnyCount", doubled_objects("Shape \"sphere\"", 63),
                 {"scene.pbrt:", "instances"}),
        of_scene("ObjectsDoubledPastMemory", doubled_objects("Shape \"sphere\"", 26),
                 {"instances", "needs", "memory"}),
        of_scene("ObjectsDoubledAndNeverShown",
                 doubled_objects("Shape \"sphere\"", 40)
                     .replace(doubled_objects("Shape \"sphere\"", 40).rfind("ObjectInstance"), 14, "# "),
                 {}, rendered),
        {"IncludedFourTimesEach",
         [](const std::filesystem::path& folder) { files_of_files(folder, 40, 4, "# nothing\n"); },
         kRender,
         {"f", ".pbrt:", "Include", "65536"}},
        {"IncludedFourTimesEach_OfMuchText",
         [](const std::filesystem::path& folder) {
             files_of_files(folder, 6, 6, repeated("# nothing here\n", 100'000));
         },
         kRender,
         {".pbrt:", "Include"}},
        of_scene("MixesOfThemselves",
                 doubled_textures("spectrum", R"("mix" "texture tex1" "{0}" "texture tex2" "{0}")", 40),
                 {"scene.pbrt:", "Texture", "512"}),
        of_scene(
            "FloatMixesOfThemselves",
            doubled_textures("float",
                             R"("mix" "texture tex1" "{0}" "texture tex2" "{0}" "texture amount" "{0}")", 40),
            {"scene.pbrt:", "Texture", "512"}),
        of_scene("ProductsOfThemselves",
                 doubled_textures("spectrum", R"("scale" "texture tex1" "{0}" "texture tex2" "{0}")", 40),
                 {"scene.pbrt:", "Texture", "512"}),
        of_scene("LongWordForALongName",
                 scene("ObjectBegin \"" + long_word('a') + "\" ObjectEnd ObjectInstance \"" + long_word('b') +
                       "\""),
                 {"scene.pbrt:", "no object"}, rendered),
        of_scene("LongWordForATexture",
                 scene("Texture \"" + long_word('a') +
                       "\" \"spectrum\" \"uv\" Material \"diffuse\" \"texture reflectance\" \"" +
                       long_word('b') + "\""),
                 {"scene.pbrt:"}, rendered),
        of_scene("LongDirective", long_word('a') + "\n", {"scene.pbrt:1:1", "unknown directive"}),
        of_scene(
            "ManyNamesAndManyWarnings",
            [] {
                std::string world;
                for (int i = 0; i < 3000; ++i)
                    world += fmt::format("ObjectBegin \"object-number-{}\" ObjectEnd\n", i);
                return scene(world + "ObjectInstance \"object-numbre\"");
            }(),
            {"scene.pbrt:", "no object"}, rendered),
        of_scene("DefaultsForEveryBlock", inherited_defaults(17'000, 30'000),
                 {"scene.pbrt:", "Attribute", "64"}),
        of_scene("FewDefaultsForEveryBlock", inherited_defaults(60, 300'000), {}, rendered),
        of_scene("LongDefaultForEveryShape", long_default(250'000, 20'000), {}, rendered),
        of_scene("DefaultsGivenAnew",
                 scene(repeated("AttributeBegin Attribute \"shape\" \"float a\" 1\n", 100'000)),
                 {"scene.pbrt:", "is not ended"}, rendered),
        of_scene("ParametersOfOneDirective",
                 [] {
                     std::string all;
                     for (int i = 0; i < 50'000; ++i) all += fmt::format("\"float p{}\" 1 ", i);
                     return scene("Shape \"sphere\" " + all);
                 }(),
                 {"scene.pbrt:4:", "more than 256"}),
        of_scene(
            "TubesThatEmit",
            scene("AreaLightSource \"diffuse\" Shape \"curve\" \"string basis\" \"bspline\" \"point3 P\" [ " +
                  repeated("0 0 0 1 1 1 ", 150'000) + "]"),
            {"scene.pbrt:4:", "memory"}),
        of_scene(
            "PatchesThatEmit",
            scene(
                "AreaLightSource \"diffuse\" Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 0 0 1 0 1 0 1 1 1 ] "
                "\"integer indices\" [ " +
                repeated("0 1 2 3 ", 60'000) + "]"),
            {"scene.pbrt:4:", "memory"}),
        of_scene(
            "CoordinateSystems",
            [] {
                std::string all;
                for (int i = 0; i < 20'000; ++i) all += fmt::format("CoordinateSystem \"system-{}\"\n", i);
                return scene(all + "CoordSysTransform \"system\"");
            }(),
            {"scene.pbrt:", "no coordinate system"}, rendered),
        {"NodesOfOneMesh",
         [](const std::filesystem::path& folder) {
             std::string nodes, primitives, roots;
             for (int i = 0; i < 5000; ++i) {
                 const char* comma = i == 0 ? "" : ",";
                 nodes += fmt::format(R"({}{{"mesh":0}})", comma);
                 roots += fmt::format("{}{}", comma, i);
                 primitives += fmt::format(R"({}{{"attributes":{{"POSITION":0}}}})", comma);
             }
             write(folder / "model.gltf",
                   fmt::format(
                       R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],)"
                       R"("meshes":[{{"primitives":[{}]}}],)"
                       R"("accessors":[{{"componentType":5126,"count":3,"type":"VEC3"}}]}})",
                       roots, nodes, primitives));
         },
         {"import", "model.gltf", "-o", "model.pbrt", "--quiet"},
         {"model.gltf", "25000000 mesh instances", "memory"}},
        {"VerticesOfEveryPrimitive",
         [](const std::filesystem::path& folder) {
             write(folder / "model.gltf", shared_accessor(20'000, 60'000));
         },
         {"import", "model.gltf", "-o", "model.pbrt", "--quiet"},
         {"model.gltf", "memory"}},
        {"MaterialsOfAnObjModel",
         [](const std::filesystem::path& folder) {
             std::string materials;
             for (int i = 0; i < 300'000; ++i) materials += fmt::format("newmtl {}\n", i);
             write(folder / "model.mtl", materials);
             write(folder / "model.obj", "mtllib model.mtl\n");
         },
         {"import", "model.obj", "-o", "model.pbrt", "--quiet"},
         {"model.mtl", "memory"}},
    };
}

}  // namespace lucerna::testing
