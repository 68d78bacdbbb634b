// `lucerna import`: models made here are imported and read back by our own reader.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "engine/image/image.h"
#include "engine/model/model.h"
#include "engine/pbrt/read_scene.h"
#include "engine/system/files.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace import_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::lucerna_run;
using ::testing::Not;
using testing::Outcome;
using Json = nlohmann::json;

std::string base64(const std::string& bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            word = word << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            out += i + k <= bytes.size() ? digits[word >> (18 - 6 * k) & 63U] : '=';
        }
    }
    return out;
}

template <typename T>
void put(std::string& bytes, std::initializer_list<T> values) {
    for (const T value : values) {
        char raw[sizeof(T)];
        std::memcpy(raw, &value, sizeof(T));
        bytes.append(raw, sizeof(T));
    }
}

// Returns two triangles in the plane y = 0, x and z from -1 to 1, normals up: positions (48 bytes), normals
// (48), texture coordinates (32), 16-bit indices (12).
std::string square_bytes() {
    std::string bytes;
    put<float>(bytes, {-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1});
    put<float>(bytes, {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0});
    put<float>(bytes, {0, 0, 0, 1, 1, 1, 1, 0});
    put<std::uint16_t>(bytes, {0, 1, 2, 0, 2, 3});
    return bytes;
}

Json view(int offset, int length) {
    return {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}};
}

// Returns a grey, rough, non-metallic square without a camera or a light.
Json model() {
    const std::string bytes = square_bytes();
    Json m;
    m["asset"] = {{"version", "2.0"}};
    m["scene"] = 0;
    m["scenes"] = Json::array({{{"nodes", {0}}}});
    m["nodes"] = Json::array({{{"mesh", 0}}});
    m["meshes"] = Json::array(
        {{{"primitives", Json::array({{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}}},
                                       {"indices", 3},
                                       {"material", 0}}})}}});
    m["materials"] = Json::array(
        {{{"name", "clay"},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {0.25, 0.5, 0.75, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 1}}}}});
    m["accessors"] =
        Json::array({{{"bufferView", 0},
                      {"componentType", 5126},
                      {"count", 4},
                      {"type", "VEC3"},
                      {"min", {-1, 0, -1}},
                      {"max", {1, 0, 1}}},
                     {{"bufferView", 1}, {"componentType", 5126}, {"count", 4}, {"type", "VEC3"}},
                     {{"bufferView", 2}, {"componentType", 5126}, {"count", 4}, {"type", "VEC2"}},
                     {{"bufferView", 3}, {"componentType", 5123}, {"count", 6}, {"type", "SCALAR"}}});
    m["bufferViews"] = Json::array({view(0, 48), view(48, 48), view(96, 32), view(128, 12)});
    m["buffers"] = Json::array(
        {{{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes)}}});
    return m;
}

Json point_light() {
    return {
        {"lights",
         Json::array({{{"type", "point"}, {"name", "bulb"}, {"intensity", 40}, {"color", {1, 0.5, 0.25}}}})}};
}

// Returns the model as one file: the JSON, then the buffer.
std::string glb(Json m) {
    std::string bytes = square_bytes();
    m["buffers"] = Json::array({{{"byteLength", bytes.size()}}});
    std::string text = m.dump();
    while (text.size() % 4 != 0) text += ' ';
    while (bytes.size() % 4 != 0) bytes += '\0';
    std::string out = "glTF";
    put<std::uint32_t>(out, {2, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + bytes.size()),
                             static_cast<std::uint32_t>(text.size())});
    out += "JSON" + text;
    put<std::uint32_t>(out, {static_cast<std::uint32_t>(bytes.size())});
    return out + std::string("BIN\0", 4) + bytes;
}

class RunImport : public testing::RunTest {
  protected:
    Job import(const Json& m) {
        write("m.gltf", m.dump());
        const Outcome outcome = lucerna_run({"import", "m.gltf", "-o", "m.pbrt", "--overwrite"});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        said_ = outcome.out + outcome.err;
        Monitor silent;
        return read_scene("m.pbrt", {}, {1}, silent);
    }
    std::string scene() const { return read_text("m.pbrt"); }
    std::string said_;
};

std::optional<Hit> down(const Job& job, double x, double z) {
    return job.scene.intersect({V3f(V3d(x, 10, z) - job.scene.origin()), V3f(0, -1, 0)});
}

TEST_F(RunImport, Square_IsReadBackWhereItWas) {
    const Job job = import(model());
    EXPECT_EQ(job.scene.counts().triangles, 2U);
    const auto hit = down(job, 0.5, -0.25);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->t, 10, 1e-5);
    EXPECT_GT(hit->at.n.y, 0.999F);
    EXPECT_FALSE(down(job, 1.1, 0));
    EXPECT_THAT(scene(), AllOf(HasSubstr("\"0 clay\""),
                               HasSubstr("\"diffuse\" \"rgb reflectance\" [ 0.25 0.5 0.75 ]")));
    EXPECT_EQ(files(),
              (std::vector<std::string>{"m-parts", "m-parts/mesh-0.ply", "m.gltf", "m.pbrt", "scene.pbrt"}));
}

TEST_F(RunImport, NoCameraAndNoLight_GetsBothAndSaysSo) {
    const Job job = import(model());
    EXPECT_THAT(said_, AllOf(HasSubstr("no camera"), HasSubstr("no light")));
    EXPECT_THAT(scene(),
                AllOf(HasSubstr("# The model has no camera"), HasSubstr("# The model has no light")));
    EXPECT_EQ(job.scene.lights().size(), 2U);
    // The default view contains the whole square.
    ASSERT_EQ(lucerna_run({"render", "m.pbrt", "--spp", "2", "--resolution", "16x12", "--quiet"}).code, 0);
    EXPECT_EQ(read_exr("m.exr").width, 16);
}

// A node scales, then rotates, then translates, and its parent's transformation follows.
TEST_F(RunImport, Nodes_ComposeAsTheStandardSays) {
    Json m = model();
    m["nodes"] = Json::array({{{"children", {1}}, {"translation", {10, 0, 0}}, {"scale", {2, 2, 2}}},
                              {{"mesh", 0},
                               {"translation", {0, 1, 3}},
                               {"scale", {1, 1, 3}},
                               {"rotation", {0, std::sqrt(0.5), 0, std::sqrt(0.5)}}}});
    const Job job = import(m);
    // The square becomes 2 x 6, after a quarter turn about y 6 x 2, doubled 12 x 4, around (10, 2, 6).
    for (const auto& [x, z, inside] : {std::tuple{10.0, 6.0, true},
                                       {4.1, 4.1, true},
                                       {15.9, 7.9, true},
                                       {3.9, 6.0, false},
                                       {10.0, 3.9, false},
                                       {16.1, 6.0, false},
                                       {10.0, 8.1, false}}) {
        const auto hit = down(job, x, z);
        ASSERT_EQ(hit.has_value(), inside) << x << " " << z;
        if (hit) {
            EXPECT_NEAR(hit->t, 8, 1e-4);
        }
    }
    // The same transformation is given as one matrix, which glTF writes by columns.
    m["nodes"] = Json::array({{{"mesh", 0}, {"matrix", {0, 0, -2, 0, 0, 2, 0, 0, 6, 0, 0, 0, 10, 2, 6, 1}}}});
    const Job same = import(m);
    EXPECT_TRUE(down(same, 15.9, 7.9));
    EXPECT_FALSE(down(same, 10, 8.1));
}

TEST_F(RunImport, Camera_LooksAlongMinusZAndIsNotMirrored) {
    Json m = model();
    m["cameras"] = Json::array(
        {{{"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"aspectRatio", 2}, {"znear", 0.1}}}}});
    m["nodes"] = Json::array(
        {{{"mesh", 0}, {"translation", {2, 0, -10}}, {"rotation", {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}},
         {{"camera", 0}}});
    m["scenes"][0]["nodes"] = {0, 1};
    const Job job = import(m);
    EXPECT_THAT(scene(), AllOf(HasSubstr("xresolution\" 800"), HasSubstr("yresolution\" 400"),
                               HasSubstr("fov\" 34.37746")));
    ASSERT_EQ(lucerna_run({"render", "m.pbrt", "--spp", "4", "--resolution", "40x20", "--quiet",
                           "--integrator", "direct"})
                  .code,
              0);
    // It stands 2 m to the right at 10 m: tan 0.3 is half the height, so 2/10/0.309 · 10 = 6.5 pixels right
    // of 20. Everything beside it is sky of 5000 cd/m².
    const Image image = read_exr("m.exr");
    const auto different = [&](int x) { return std::fabs(image.rgb_at(x, 10).x - 5000) > 500; };
    EXPECT_TRUE(different(26));
    EXPECT_FALSE(different(14));
    EXPECT_EQ(image.attributes.at("lucerna.unit"), "cd/m^2");
}

TEST_F(RunImport, Lights_AreWrittenAsTheyStand) {
    Json m = model();
    m["extensionsUsed"] = {"KHR_lights_punctual"};
    Json lights = point_light();
    lights["lights"].push_back(
        {{"type", "spot"}, {"intensity", 100}, {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.5}}}});
    lights["lights"].push_back({{"type", "directional"}, {"intensity", 1000}});
    m["extensions"]["KHR_lights_punctual"] = lights;
    const auto light = [](int index) { return Json{{"KHR_lights_punctual", {{"light", index}}}}; };
    m["nodes"] = Json::array({{{"mesh", 0}},
                              {{"translation", {1, 2, 3}}, {"extensions", light(0)}},
                              {{"translation", {0, 4, 0}},
                               {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}},
                               {"extensions", light(1)}},
                              {{"extensions", light(2)}}});
    m["scenes"][0]["nodes"] = {0, 1, 2, 3};
    const Job job = import(m);
    ASSERT_EQ(job.scene.lights().size(), 3U);
    EXPECT_EQ(job.scene.stated_unit(), FluxUnit::lumen) << "cd and lux, as the extension has them";
    EXPECT_NEAR(job.scene.lights()[0]->power(), 4 * M_PI * static_cast<double>(luminance(Rgb(40, 20, 10))),
                1e-2);
    // The extension's formula is the square of a ramp from 1 at the inner to 0 at the outer cosine.
    for (const double angle : {0.1, 0.25, 0.35, 0.45, 0.6}) {
        const double t =
            std::clamp((std::cos(angle) - std::cos(0.5)) / (std::cos(0.2) - std::cos(0.5)), 0.0, 1.0);
        const V3d at = V3d(std::sin(angle), 4 - std::cos(angle), 0) - job.scene.origin();
        const auto seen = job.scene.lights()[1]->sample_Li(V3f(at), {}, {});
        EXPECT_NEAR(seen ? static_cast<double>(seen->weight.x) : 0.0, 100 * t * t, 1e-2) << angle;
    }
    EXPECT_THAT(
        scene(),
        AllOf(HasSubstr("\"rgb I\" [ 40 20 10 ] \"point3 from\" [ 1 2 3 ]"),
              HasSubstr("\"spot\" \"rgb I\" [ 100 100 100 ] \"point3 from\" [ 0 4 0 ]"),
              HasSubstr("\"float coneangle\" 28.64788"), HasSubstr("\"float conedeltaangle\" 17.18873"),
              HasSubstr("\"string falloff\" \"quadratic\""),
              HasSubstr("\"distant\" \"rgb L\" [ 1000 1000 1000 ]"), Not(HasSubstr("no light"))));
}

// Returns the intensity of a light in cd in a direction, at a distance of 2 m.
double candela(const Job& job, const V3d& from, const V3d& towards) {
    const auto seen =
        job.scene.lights()[0]->sample_Li(V3f(from + 2.0 * towards - job.scene.origin()), {}, {});
    return seen ? 4 * static_cast<double>(luminance(seen->weight)) : 0;
}

// EXT_lights_ies has the nadir along -z, C0 along +x, C90 along +y of the node. The profile comes from a
// file, a data URI and a buffer.
TEST_F(RunImport, IesLights_ShineAsTheNodeStands) {
    const std::string web =
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 5 1 2 0 0 0\n1 1 9\n0 90 180\n0 90 180 270 360\n"
        "100 10 0\n100 20 0\n100 30 0\n100 40 0\n100 10 0\n";
    write("a lamp.ies", web);
    Json m = model();
    m["extensionsUsed"] = {"EXT_lights_ies"};
    m["scenes"][0]["nodes"] = {0, 1};
    m["nodes"].push_back({{"translation", {1, 2, 3}},
                          {"scale", {5, 5, 5}},
                          {"extensions", {{"EXT_lights_ies", {{"light", 0}}}}}});
    const std::string bytes = square_bytes();
    m["buffers"].push_back(
        {{"byteLength", web.size()}, {"uri", "data:application/octet-stream;base64," + base64(web)}});
    m["bufferViews"].push_back({{"buffer", 1}, {"byteOffset", 0}, {"byteLength", web.size()}});
    for (const Json& light :
         {Json{{"uri", "a%20lamp.ies"}}, Json{{"uri", "data:application/x-ies-lm-63;base64," + base64(web)}},
          Json{{"bufferView", 4}, {"mimeType", "application/x-ies-lm-63"}}}) {
        SCOPED_TRACE(light.dump());
        m["extensions"]["EXT_lights_ies"]["lights"] = Json::array({light});
        const Job job = import(m);
        EXPECT_THAT(said_, AllOf(Not(HasSubstr("no light")), Not(HasSubstr("not read"))));
        ASSERT_EQ(job.scene.lights().size(), 1U);
        const V3d at(1, 2, 3);
        EXPECT_NEAR(candela(job, at, {0, 0, -1}), 100, 1e-2);
        EXPECT_NEAR(candela(job, at, {1, 0, 0}), 10, 1e-2);
        EXPECT_NEAR(candela(job, at, {0, 1, 0}), 20, 1e-2);
        EXPECT_NEAR(candela(job, at, {-1, 0, 0}), 30, 1e-2);
        EXPECT_NEAR(candela(job, at, {0, -1, 0}), 40, 1e-2);
    }
    // A quarter turn about x makes the lamp point down; it is brighter and coloured, each channel by its
    // factor.
    m["nodes"][1]["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
    m["nodes"][1]["extensions"]["EXT_lights_ies"] = {
        {"light", 0}, {"multiplier", 3}, {"color", {1, 0.5, 0.25}}};
    const Job turned = import(m);
    EXPECT_NEAR(candela(turned, {1, 2, 3}, {0, -1, 0}),
                300 * static_cast<double>(luminance(Rgb(1, 0.5F, 0.25F))), 0.05);
    const auto seen = turned.scene.lights()[0]->sample_Li(V3f(V3d(1, 1, 3) - turned.scene.origin()), {}, {});
    ASSERT_TRUE(seen);
    EXPECT_NEAR(seen->weight.x / seen->weight.z, 4, 1e-3F);
    m["nodes"][1]["extensions"]["EXT_lights_ies"]["light"] = 7;
    write("m.gltf", m.dump());
    std::filesystem::remove_all("m-parts");
    std::filesystem::remove("m.pbrt");
    expect_refused({"import", "m.gltf", "-o", "m.pbrt", "--quiet"},
                   {"IES light 7 does not exist; there are 1"});
}

TEST_F(RunImport, GpuInstances_AreShownEach) {
    Json m = model();
    std::string bytes;
    put<float>(bytes, {0, 0, 0, 5, 0, 0, 0, 2, 9});                                       // translations
    put<float>(bytes, {0, 0, 0, 1, 0, 0, 0, 1, 0, std::sqrt(0.5F), 0, std::sqrt(0.5F)});  // rotations
    put<float>(bytes, {1, 1, 1, 1, 1, 1, 1, 1, 3});                                       // scales
    m["buffers"].push_back(
        {{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes)}});
    for (const auto& [offset, length] : {std::pair{0, 36}, {36, 48}, {84, 36}})
        m["bufferViews"].push_back({{"buffer", 1}, {"byteOffset", offset}, {"byteLength", length}});
    for (const auto& [view, type] : {std::pair{4, "VEC3"}, {5, "VEC4"}, {6, "VEC3"}})
        m["accessors"].push_back(
            {{"bufferView", view}, {"componentType", 5126}, {"count", 3}, {"type", type}});
    m["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
    m["nodes"][0]["translation"] = {100, 0, 0};
    m["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
        {"TRANSLATION", 4}, {"ROTATION", 5}, {"SCALE", 6}};
    const Job job = import(m);
    EXPECT_EQ(job.scene.counts().triangles, 6U);
    EXPECT_TRUE(down(job, 100, 0.5));
    EXPECT_TRUE(down(job, 105, 0.5));
    const auto turned = down(job, 102.9, 9.9);  // length 3, rotated to lie along x
    ASSERT_TRUE(turned);
    EXPECT_NEAR(turned->t, 8, 1e-4);
    EXPECT_FALSE(down(job, 100, 11));
    m["accessors"][6]["count"] = 2;
    write("m.gltf", m.dump());
    std::filesystem::remove_all("m-parts");
    std::filesystem::remove("m.pbrt");
    expect_refused({"import", "m.gltf", "-o", "m.pbrt", "--quiet"},
                   {"SCALE of its instances", "2; expected 3"});
}

TEST_F(RunImport, HiddenNodes_HideMeshesAndLightsBelowButNotCameras) {
    Json m = model();
    m["extensionsUsed"] = {"KHR_node_visibility", "KHR_lights_punctual"};
    m["extensions"]["KHR_lights_punctual"] = point_light();
    m["cameras"] = Json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"znear", 0.1}}}}});
    const auto visible = [](bool is) { return Json{{"KHR_node_visibility", {{"visible", is}}}}; };
    m["nodes"] =
        Json::array({{{"mesh", 0}},
                     {{"children", {2, 3}}, {"translation", {5, 0, 0}}, {"extensions", visible(false)}},
                     {{"mesh", 0}, {"extensions", visible(true)}},
                     {{"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}}});
    m["scenes"][0]["nodes"] = {0, 1};
    const Job job = import(m);
    EXPECT_TRUE(down(job, 0.5, 0));
    EXPECT_FALSE(down(job, 5, 0.5));
    EXPECT_THAT(scene(), Not(HasSubstr("\"point\"")));
    EXPECT_THAT(said_, AllOf(Not(HasSubstr("no camera")),
                             HasSubstr("The model has no light that is visible and can be read")));
}

TEST_F(RunImport, ExtensionsThatAreNotRead_AreSaidOnceWithWhatIsLost) {
    Json m = model();
    m["extensionsUsed"] = {"KHR_materials_clearcoat", "EXT_lights_image_based", "KHR_materials_clearcoat",
                           "ACME_anything", "KHR_texture_transform"};
    import(m);
    const auto times = [this](const std::string& part) {
        int count = 0;
        for (std::size_t at = said_.find(part); at != std::string::npos; at = said_.find(part, at + 1))
            ++count;
        return count;
    };
    EXPECT_EQ(times("extension \"KHR_materials_clearcoat\", which is not read; lost is the clear coats"), 1);
    EXPECT_EQ(times("extension \"EXT_lights_image_based\", which is not read; lost is its light"), 1);
    EXPECT_EQ(times("extension \"ACME_anything\", which is not read; lost is what it adds"), 1);
    EXPECT_EQ(times("KHR_texture_transform"), 0);
    EXPECT_THAT(said_, HasSubstr("The model has no light that is visible and can be read"));
}

TEST_F(RunImport, RangeOfALight_IsSaidToBeIgnored) {
    Json m = model();
    Json lights = point_light();
    lights["lights"][0]["range"] = 5;
    m["extensions"]["KHR_lights_punctual"] = lights;
    m["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    import(m);
    EXPECT_THAT(said_, HasSubstr("light \"bulb\": its range of 5 m is ignored"));
}

TEST_F(RunImport, Materials_AreMetalGlassOrCoated) {
    Json m = model();
    Json& material = m["materials"][0];
    material["pbrMetallicRoughness"] = {{"baseColorFactor", {0.9, 0.6, 0.3, 1}}, {"roughnessFactor", 0.5}};
    import(m);
    EXPECT_THAT(scene(),
                HasSubstr("\"conductor\" \"rgb reflectance\" [ 0.9 0.6 0.3 ] \"float roughness\" 0.25 "
                          "\"bool remaproughness\" false"));
    material["extensions"] = {{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                              {"KHR_materials_ior", {{"ior", 1.33}}}};
    material["pbrMetallicRoughness"]["roughnessFactor"] = 0;
    import(m);
    EXPECT_THAT(scene(), HasSubstr("\"thindielectric\" \"float eta\" 1.33"));
    EXPECT_THAT(said_, HasSubstr("its base colour is ignored"));
    material["extensions"]["KHR_materials_volume"] = {{"thicknessFactor", 0}};
    import(m);
    EXPECT_THAT(scene(), HasSubstr("\"thindielectric\""));
    material["extensions"]["KHR_materials_volume"] = {{"thicknessFactor", 0.1}, {"attenuationDistance", 0.5}};
    import(m);
    EXPECT_THAT(scene(), HasSubstr("\"dielectric\" \"float eta\" 1.33 \"float roughness\" 0"));
    EXPECT_THAT(said_, HasSubstr("the attenuation in its volume is ignored"));
    material.erase("extensions");
    material["emissiveFactor"] = {1, 0.5, 0};
    material["pbrMetallicRoughness"] = {{"metallicFactor", 0}};
    material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 8;
    const Job job = import(m);
    ASSERT_EQ(job.scene.lights().size(), 1U);
    EXPECT_THAT(scene(), HasSubstr("AreaLightSource \"diffuse\" \"rgb L\" [ 8 4 0 ]"));
}

TEST_F(RunImport, Plastic_IsDiffuseUnderACoat) {
    Json m = model();
    m["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = 0.5;
    import(m);
    EXPECT_THAT(scene(),
                HasSubstr("\"coateddiffuse\" \"rgb reflectance\" [ 0.25 0.5 0.75 ] \"float roughness\" 0.25 "
                          "\"bool remaproughness\" false \"float eta\" 1.5"));
}

// One embedded picture serves as base colour and as normals; another lies in a file.
TEST_F(RunImport, Pictures_AreWrittenOutOrNamed) {
    Image picture = Image::rgb(2, 2);
    picture.data = {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
    write_png_display("p q.png", picture);
    const std::string bytes = read_text("p q.png");
    Json m = model();
    m["images"] = Json::array({{{"uri", "data:image/png;base64," + base64(bytes)}}, {{"uri", "p%20q.png"}}});
    m["textures"] = Json::array({{{"source", 0}}, {{"source", 1}}});
    Json& material = m["materials"][0];
    material["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
    material["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 0.5, 0.5, 1};
    const Job job = import(m);
    EXPECT_EQ(read_text("m-parts/image-0.png"), bytes);
    EXPECT_THAT(scene(),
                AllOf(HasSubstr("\"string filename\" \"m-parts/image-0.png\" \"string encoding\" \"sRGB\" "
                                "\"float scale\" 0.5"),
                      HasSubstr("\"texture reflectance\" \"0 clay base\"")));
    // glTF's (0, 0) is the upper left corner, the red quarter, at (-1, 0, -1) here. Our origin is the lower
    // left corner.
    const auto hit = down(job, -0.5, -0.5);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->uv.x, 0.25, 1e-5);
    EXPECT_NEAR(hit->uv.y, 0.75, 1e-5);

    material["pbrMetallicRoughness"]["baseColorTexture"] = {
        {"index", 1}, {"extensions", {{"KHR_texture_transform", {{"scale", {2, 4}}}}}}};
    std::filesystem::create_directory("to");
    write("m.gltf", m.dump());
    ASSERT_EQ(lucerna_run({"import", "m.gltf", "-o", "to/n.pbrt", "--quiet"}).code, 0);
    EXPECT_THAT(read_text("to/n.pbrt"), AllOf(HasSubstr("\"../p q.png\""), HasSubstr("\"float uscale\" 2"),
                                              HasSubstr("\"float vscale\" 4")));
}

TEST_F(RunImport, MetallicRoughnessAndEmission_OfATexture_AreItsMeans) {
    Image picture = Image::rgb(2, 1);
    picture.data = {0, 0.4F, 1, 0, 0.8F, 1};
    write_png_display("mr.png", picture);
    Json m = model();
    m["images"] = Json::array({{{"uri", "mr.png"}}});
    m["textures"] = Json::array({{{"source", 0}}});
    Json& material = m["materials"][0];
    material["pbrMetallicRoughness"] = {{"metallicRoughnessTexture", {{"index", 0}}}};
    material["emissiveFactor"] = {0, 0, 1};
    material["emissiveTexture"]["index"] = 0;
    import(m);
    EXPECT_THAT(said_, AllOf(HasSubstr("metallic-roughness"), HasSubstr("emissive")));
    EXPECT_THAT(scene(), AllOf(HasSubstr("\"conductor\""), HasSubstr("\"float roughness\" 0.36"),
                               HasSubstr("\"rgb L\" [ 0 0 1 ]")));
}

TEST_F(RunImport, Alpha_IsWrittenAsACutoutOrANumber) {
    Json m = model();
    Json& material = m["materials"][0];
    material["alphaMode"] = "BLEND";
    material["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.25};
    write("m.gltf", m.dump());
    ASSERT_EQ(lucerna_run({"import", "m.gltf", "-o", "m.pbrt", "--quiet"}).code, 0);
    EXPECT_THAT(scene(), HasSubstr("\"float alpha\" 0.25"));
    material["alphaMode"] = "MASK";  // 0.25 is below the cutoff of 0.5
    write("m.gltf", m.dump());
    ASSERT_EQ(lucerna_run({"import", "m.gltf", "-o", "m.pbrt", "--quiet", "--overwrite"}).code, 0);
    EXPECT_THAT(scene(), HasSubstr("\"float alpha\" 0\n"));
    material["alphaMode"] = "OPAQUE";
    import(m);
    EXPECT_THAT(scene(), Not(HasSubstr("alpha")));
}

TEST(CutoutOf, Alpha_IsScaledOrCutOff) {
    const Pixels pixels{2, 1, {0, 0, 0, 51, 0, 0, 0, 255}};
    EXPECT_EQ(cutout_of(pixels, 0.5, std::nullopt)->alpha, (std::vector<float>{0.1F, 0.5F}));
    EXPECT_EQ(cutout_of(pixels, 1, 0.5)->alpha, (std::vector<float>{0, 1}));
    EXPECT_FALSE(cutout_of(pixels, 1, 0.1));
}

TEST_F(RunImport, Glb_GivesTheSameScene) {
    import(model());
    const std::string text = scene(), mesh = read_text("m-parts/mesh-0.ply");
    write("m.glb", glb(model()));
    const Outcome outcome = lucerna_run({"import", "m.glb", "-o", "m.pbrt", "--overwrite", "--quiet"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(scene().substr(scene().find('\n')),
              text.substr(text.find('\n')));  // identical except for the model's name
    EXPECT_EQ(read_text("m-parts/mesh-0.ply"), mesh);
}

TEST_F(RunImport, IndicesOfEverySize_AndNone_GiveTheSameTriangles) {
    for (const int type : {5121, 5123, 5125}) {
        Json m = model();
        std::string bytes = square_bytes().substr(0, 128);
        for (const std::uint8_t i : std::vector<std::uint8_t>{0, 1, 2, 0, 2, 3}) {
            if (type == 5121) put<std::uint8_t>(bytes, {i});
            if (type == 5123) put<std::uint16_t>(bytes, {i});
            if (type == 5125) put<std::uint32_t>(bytes, {i});
        }
        m["accessors"][3]["componentType"] = type;
        m["bufferViews"][3]["byteLength"] = bytes.size() - 128;
        m["buffers"] = Json::array({{{"byteLength", bytes.size()},
                                     {"uri", "data:application/octet-stream;base64," + base64(bytes)}}});
        EXPECT_TRUE(down(import(m), 0.5, -0.25)) << type;
    }
    Json m = model();
    m["meshes"][0]["primitives"][0].erase("indices");
    m["meshes"][0]["primitives"][0]["mode"] = 6;  // a fan of the four corners
    const Job job = import(m);
    EXPECT_EQ(job.scene.counts().triangles, 2U);
    EXPECT_TRUE(down(job, 0.5, -0.25));
    EXPECT_TRUE(down(job, -0.5, 0.25));
}

TEST(TrianglesOf, StripsAndFans_KeepTheirSide) {
    const std::vector<std::uint32_t> corners{0, 1, 2, 3, 4};
    EXPECT_EQ(triangles_of(4, corners), (std::vector<V3i>{{0, 1, 2}}));
    EXPECT_EQ(triangles_of(5, corners), (std::vector<V3i>{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
    EXPECT_EQ(triangles_of(6, corners), (std::vector<V3i>{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}));
    EXPECT_TRUE(triangles_of(5, {0, 0, 1, 1}).empty());
    EXPECT_TRUE(triangles_of(4, {}).empty());
}

TEST_F(RunImport, WhatIsThere_IsNotOverwrittenUnasked) {
    import(model());
    write("m.pbrt", "mine");
    expect_refused({"import", "m.gltf", "-o", "m.pbrt"}, {"m.pbrt", "exists", "--overwrite"});
    EXPECT_EQ(read_text("m.pbrt"), "mine");
    std::filesystem::remove("m.pbrt");
    expect_refused({"import", "m.gltf", "-o", "m.pbrt"}, {"m-parts", "exists"});
}

TEST_F(RunImport, WrongWords_AreRefused) {
    write("m.gltf", model().dump());
    expect_refused({"import", "m.gltf"}, {"--output"});
    expect_refused({"import", "none.gltf", "-o", "n.pbrt"}, {"none.gltf", "no such file"});
    expect_refused({"import", "m.gltf", "-o", "n.exr"}, {"n.exr", ".pbrt"});
    expect_refused({"import", "scene.pbrt", "-o", "n.pbrt"}, {"scene.pbrt", ".gltf, .glb or .obj"});
    expect_refused({"import", "m.gltf", "-o", "nowhere/n.pbrt"}, {"the folder nowhere does not exist"});
}

TEST_F(RunImport, Lies_AreRefusedWithTheirPlace) {
    struct Lie {
        const char* pointer;
        Json value;
        const char* named;
    };
    const Lie lies[] = {
        {"/accessors/3/count", 1'000'000'000, "do not fit into a view of 12"},
        {"/accessors/0/byteOffset", 44, "do not fit"},
        {"/accessors/0/count", 5, "do not fit"},
        {"/accessors/1/count", 3, "3 normals for 4 vertices"},
        {"/accessors/0/type", "VEC2", "3 numbers"},
        {"/accessors/3/componentType", 5126, "unsigned whole numbers"},
        {"/bufferViews/0/byteLength", 4000, "of a buffer of 140"},
        {"/bufferViews/3/byteOffset", 4'000'000, "of a buffer of 140"},
        {"/bufferViews/0/buffer", 7, "buffer 7 does not exist; there are 1"},
        {"/bufferViews/0/byteStride", 4, "stride"},
        {"/accessors/0/bufferView", 99, "buffer view 99"},
        {"/meshes/0/primitives/0/indices", 42, "out of bounds"},
        {"/meshes/0/primitives/0/material", 3, "material 3 does not exist; there are 1"},
        {"/nodes/0/mesh", 5, "mesh 5 does not exist; there are 1"},
        {"/nodes/0/children", Json::array({0}), "node 0 is reached twice"},
        {"/nodes/0/rotation", Json::array({0, 0, 0, 0}), "not a unit quaternion"},
        {"/nodes/0/scale", Json::array({1, 2}), "2 numbers"},
        {"/scenes/0/nodes", Json::array({9}), "node 9 does not exist; there are 1"},
        {"/scenes/0/nodes", Json::array(), "no mesh"},
        {"/scene", 4, "scene 4 does not exist; there are 1"},
        {"/extensionsRequired", Json::array({"KHR_draco_mesh_compression"}), "KHR_draco_mesh_compression"},
        {"/asset", 7, "asset"},
    };
    for (const Lie& lie : lies) {
        SCOPED_TRACE(lie.pointer);
        Json m = model();
        m[Json::json_pointer(lie.pointer)] = lie.value;
        write("m.gltf", m.dump());
        expect_refused({"import", "m.gltf", "-o", "m.pbrt", "--quiet"}, {"m.gltf", lie.named});
    }
    // An index in the buffer exceeds the number of vertices.
    std::string bytes = square_bytes();
    bytes[128] = 4;
    Json m = model();
    m["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(bytes);
    write("m.gltf", m.dump());
    expect_refused({"import", "m.gltf", "-o", "m.pbrt", "--quiet"}, {"index 4 of 4 vertices"});
    // A position is NaN.
    bytes = square_bytes();
    bytes[3] = '\x7f', bytes[2] = '\xc0';
    m["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(bytes);
    write("m.gltf", m.dump());
    expect_refused({"import", "m.gltf", "-o", "m.pbrt", "--quiet"}, {"POSITION", "nan"});
}

// Every prefix of a good file, and every good file with a byte changed, is read or refused in one line
// without a crash.
TEST_F(RunImport, GarbageAndTruncation_AreRefusedOrRead) {
    const std::string good = glb(model()), text = model().dump();
    for (std::size_t size = 0; size < good.size(); size += 37) {
        write("m.glb", good.substr(0, size));
        expect_refused({"import", "m.glb", "-o", "m.pbrt", "--quiet"}, {"m.glb"});
    }
    for (std::size_t size = 0; size + 1 < text.size(); size += 61) {
        write("m.gltf", text.substr(0, size));
        expect_refused({"import", "m.gltf", "-o", "m.pbrt", "--quiet"}, {"m.gltf"});
    }
    std::uint32_t dice = 1;
    for (int i = 0; i < 300; ++i) {
        std::string bad = i % 2 != 0 ? good : text;
        for (int k = 0; k < 3; ++k) {
            dice = dice * 1664525U + 1013904223U;
            bad[dice / 7 % bad.size()] = static_cast<char>(dice >> 24U);
        }
        const std::string name = i % 2 != 0 ? "m.glb" : "m.gltf";
        write(name, bad);
        const Outcome outcome = lucerna_run({"import", name, "-o", "m.pbrt", "--quiet", "--overwrite"});
        EXPECT_LE(outcome.code, 1) << outcome.err;
    }
}

TEST_F(RunImport, Help_Teaches) {
    const Outcome outcome = lucerna_run({"import", "--help"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_THAT(outcome.out,
                AllOf(HasSubstr("Examples:"), HasSubstr("--overwrite"), HasSubstr("room-parts")));
}

}  // namespace import_test
}  // namespace lucerna
