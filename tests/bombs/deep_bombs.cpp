#include <fmt/format.h>

#include "tests/bombs/bomb.h"
#include "tests/bombs/bomb_text.h"

namespace lucerna::testing {
namespace {

// Returns objects each of which instances the previous one; the first has a shape, and the world instances
// the last.
std::string instances_of_instances(int depth) {
    std::string world = "ObjectBegin \"o0\" Shape \"sphere\" ObjectEnd\n";
    for (int i = 1; i < depth; ++i)
        world += fmt::format("ObjectBegin \"o{}\" ObjectInstance \"o{}\" ObjectEnd\n", i, i - 1);
    return scene(world + fmt::format("ObjectInstance \"o{}\"\n", depth - 1));
}

// Returns textures of colours or floats, each of `kind` (a format that takes the previous one's name), and a
// material that uses the last.
std::string textures_of_textures(std::string_view type, std::string_view kind, int depth) {
    std::string world = fmt::format("Texture \"t0\" \"{}\" \"checkerboard\"\n", type);
    for (int i = 1; i < depth; ++i) {
        const std::string before = fmt::format("t{}", i - 1);
        world += fmt::format("Texture \"t{}\" \"{}\" {}\n", i, type, fmt::format(fmt::runtime(kind), before));
    }
    const std::string last = fmt::format("t{}", depth - 1);
    world += type == "float" ? fmt::format("Material \"matte\" \"texture sigma\" \"{}\"\n", last)
                             : fmt::format("Material \"diffuse\" \"texture reflectance\" \"{}\"\n", last);
    return scene(world + "Shape \"sphere\"");
}

std::string materials_of_materials(int depth) {
    std::string world = "MakeNamedMaterial \"m0\" \"string type\" \"interface\"\n";
    for (int i = 1; i < depth; ++i) {
        world += fmt::format(
            "MakeNamedMaterial \"m{}\" \"string type\" \"mix\" \"string materials\" [ \"m{}\" \"m0\" ]\n", i,
            i - 1);
    }
    return scene(world + fmt::format("NamedMaterial \"m{}\" Shape \"sphere\"", depth - 1));
}

std::string nested_json(std::string_view open, std::string_view close, std::size_t depth) {
    return R"({"asset":{"version":"2.0"},"extras":)" + repeated(open, depth) + "1" + repeated(close, depth) +
           "}";
}

// Returns a binary model whose only chunk is the text.
std::string glb_of(std::string json) {
    while (json.size() % 4 != 0) json += ' ';
    std::string bytes = "glTF";
    append(bytes, std::uint32_t{2});
    append(bytes, static_cast<std::uint32_t>(20 + json.size()));
    append(bytes, static_cast<std::uint32_t>(json.size()));
    append(bytes, std::uint32_t{0x4E4F534A});
    return bytes + json;
}

std::string chain_of_nodes(int depth) {
    std::string nodes = R"({"children":[1]})";
    for (int i = 1; i + 1 < depth; ++i) nodes += fmt::format(R"(,{{"children":[{}]}})", i + 1);
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + nodes + ",{}]}";
}

Bomb of_model(std::string name, std::string text, std::vector<std::string> mentions) {
    const std::string file = text.starts_with("glTF") ? "model.glb" : "model.gltf";
    mentions.insert(mentions.begin(), file);
    return {
        std::move(name),
        [text = std::move(text), file](const std::filesystem::path& folder) { write(folder / file, text); },
        {"import", file, "-o", "model.pbrt", "--quiet"},
        std::move(mentions)};
}

Bomb of_toml(std::string name, std::string text, std::vector<std::string> mentions) {
    mentions.insert(mentions.begin(), "study.toml");
    return {
        std::move(name),
        [text = std::move(text)](const std::filesystem::path& folder) { write(folder / "study.toml", text); },
        {"study", "study.toml", "-o", "out"},
        std::move(mentions)};
}

}  // namespace

std::vector<Bomb> deep_bombs() {
    return {
        of_scene("InstancesOfInstances", instances_of_instances(20'000),
                 {"scene.pbrt:", "ObjectInstance", "64"}),
        of_scene("ColoursScaledByColours",
                 textures_of_textures("spectrum", R"("scale" "texture tex" "{}" "float scale" 0.5)", 200'000),
                 {"scene.pbrt:", "Texture", "512"}),
        of_scene("FloatsScaledByFloats",
                 textures_of_textures("float", R"("scale" "texture tex" "{}" "float scale" 0.5)", 200'000),
                 {"scene.pbrt:", "Texture", "512"}),
        of_scene("DotsInDots", textures_of_textures("float", R"("dots" "texture inside" "{}")", 200'000),
                 {"scene.pbrt:", "Texture", "512"}),
        of_scene("CheckerboardsInCheckerboards",
                 textures_of_textures("spectrum", R"("checkerboard" "texture tex2" "{}")", 200'000),
                 {"scene.pbrt:", "Texture", "512"}),
        of_scene("ConstantsOfConstants",
                 textures_of_textures("spectrum", R"("constant" "texture value" "{}")", 20'000), {},
                 Bomb::End::rendered),
        of_scene("MixesOfMixes", materials_of_materials(100'000), {"scene.pbrt:", "mix"},
                 Bomb::End::rendered),
        of_model("ArraysInExtras", nested_json("[", "]", 200'000), {"nested more than", "128"}),
        of_model("ObjectsInExtras", nested_json(R"({"a":)", "}", 200'000), {"nested more than", "128"}),
        of_model("ArraysInExtrasThatNeverEnd",
                 R"({"asset":{"version":"2.0"},"extras":)" + repeated("[", 1'000'000),
                 {"nested more than", "128"}),
        of_model("ArraysInExtrasOfABinaryModel", glb_of(nested_json("[", "]", 200'000)),
                 {"nested more than"}),
        of_model("NodesInNodes", chain_of_nodes(100'000), {"nested more than 1000"}),
        of_toml("DottedKey", repeated("a.", 300'000) + "a = 1\n", {"study.toml:1:", "more than 32"}),
        of_toml("DottedTableName", "[" + repeated("a.", 300'000) + "a]\n", {"study.toml:1:", "more than 32"}),
        of_toml("DottedKeyOfQuotedParts", repeated("\"a b\" . ", 300'000) + "a = 1\n",
                {"study.toml:1:", "more than 32"}),
        of_toml("ArraysInArrays", "a = " + repeated("[", 300'000) + repeated("]", 300'000) + "\n", {}),
        of_toml("TablesInTables", "a = " + repeated("{a=", 300'000) + "1" + repeated("}", 300'000) + "\n",
                {}),
        of_toml("TablesOfDottedKeys",
                "a = " + repeated("{a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a=", 250) + "1" + repeated("}", 250) + "\n",
                {}),
        of_scene("AttributesInAttributes", scene(repeated("AttributeBegin\n", 300'000)),
                 {"scene.pbrt:", "is not ended"}, Bomb::End::rendered),
    };
}

}  // namespace lucerna::testing
