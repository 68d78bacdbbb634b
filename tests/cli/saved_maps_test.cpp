// Saved photon maps: which changes invalidate them, which do not, and what `lucerna info` prints of them.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/image/image.h"
#include "photon/build_maps.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace saved_maps_test {

using ::testing::HasSubstr;
using testing::lucerna_run;
using testing::Outcome;

// A scene with everything that a scene can contain, in files and in the text.
constexpr const char* kRoom = R"(
Film "rgb" "integer xresolution" 6 "integer yresolution" 4 "string filename" "room.exr"
Sampler "independent" "integer pixelsamples" 1
PixelFilter "box"
LookAt 0 1 -3  0 0.5 0  0 1 0
MakeNamedMedium "haze" "string type" "homogeneous" "rgb sigma_s" [ 0.01 0.01 0.01 ] "rgb sigma_a" [ 0 0 0 ]
Camera "perspective" "float fov" 40
WorldBegin
MakeNamedMedium "cloud" "string type" "uniformgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1
    "float density" [ 1 2 ] "rgb sigma_s" [ 0.1 0.1 0.1 ] "rgb sigma_a" [ 0 0 0 ]
Texture "wood" "spectrum" "imagemap" "string filename" "wood.exr"
Material "diffuse" "texture reflectance" "wood"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -2  -2 0 2  2 0 2  2 0 -2 ]
    "point2 uv" [ 0 0  0 1  1 1  1 0 ]
AttributeBegin
  Translate 0.5 0.3 0
  Material "dielectric" "float eta" 1.5
  Shape "sphere" "float radius" 0.2
AttributeEnd
Material "diffuse" "rgb reflectance" [ 0.5 0.4 0.3 ]
Shape "plymesh" "string filename" "wall.ply"
ObjectBegin "thing"
Shape "disk" "float radius" 0.1
ObjectEnd
AttributeBegin
Translate 0 0.4 0
ObjectInstance "thing"
AttributeEnd
AttributeBegin
MediumInterface "cloud" ""
Material "interface"
Translate -0.5 0.5 0
Shape "sphere" "float radius" 0.3
AttributeEnd
AttributeBegin
Translate 0 1.5 0
Rotate 90 1 0 0
LightSource "ies" "string filename" "lamp.ies"
AttributeEnd
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 3 3 3 ]
Shape "disk" "float height" 1.8 "float radius" 0.1
AttributeEnd
)";

constexpr const char* kWall = R"(ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
-2 0 2
-2 2 2
2 2 2
3 0 1 2
)";

std::string lamp_of(int candela) {
    return "IESNA:LM-63-2002\n[TEST] none\n[MANUFAC] none\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 "
           "90\n0\n" +
           std::to_string(candela) + " 10\n";
}

class SavedMaps : public testing::RunTest {
  protected:
    void SetUp() override {
        RunTest::SetUp();
        write("room.pbrt", kRoom);
        write("wall.ply", kWall);
        write("lamp.ies", lamp_of(100));
        write_wood(0.5F);
        const Outcome saved = render({"--save-maps", "room.photons"});
        ASSERT_EQ(saved.code, 0) << saved.err;
    }
    static void write_wood(float last) {
        Image wood = Image::rgb(2, 2);
        for (float& value : wood.data) value = 0.5F;
        wood.data.back() = last;
        write_exr("wood.exr", wood);
    }
    static Outcome render(std::vector<std::string> more, const std::string& scene = "room.pbrt") {
        std::vector<std::string> words{"render",    scene,   "-o",          "a.exr", "--integrator",
                                       "photonmap", "--set", "photons=300", "--set", "gatherrays=2"};
        words.insert(words.end(), more.begin(), more.end());
        return lucerna_run(words);
    }
    static Outcome load(std::vector<std::string> more = {}, const std::string& scene = "room.pbrt") {
        more.insert(more.end(), {"--load-maps", "room.photons"});
        return render(std::move(more), scene);
    }
    // Returns the room with the first `from` replaced.
    static std::string with(const std::string& from, const std::string& to) {
        std::string text = kRoom;
        const std::size_t at = text.find(from);
        EXPECT_NE(at, text.npos) << from;
        return text.replace(at, from.size(), to);
    }
    static void expect_other(const Outcome& outcome, const std::string& fact) {
        EXPECT_EQ(outcome.code, 1);
        EXPECT_THAT(outcome.err, HasSubstr("room.photons: these maps were made for another scene or by other "
                                           "settings: their " +
                                           fact));
    }
};

TEST_F(SavedMaps, OfAChangedScene_AreRefused) {
    EXPECT_EQ(load().code, 0);
    struct Change {
        const char *from, *to;
    };
    for (const auto& [from, to] : {
             Change{"2 0 2  2 0 -2", "2 0 2  2 0.001 -2"},  // a vertex
             Change{"1 1  1 0 ]", "1 1  1 0.999 ]"},        // the position of a texture
             Change{"Translate 0.5 0.3 0", "Translate 0.5 0.301 0"},
             Change{"\"float radius\" 0.2", "\"float radius\" 0.201"},
             Change{"\"float eta\" 1.5", "\"float eta\" 1.501"},
             Change{"[ 0.5 0.4 0.3 ]", "[ 0.5 0.4 0.301 ]"},
             Change{"Translate 0 0.4 0", "Translate 0 0.401 0"},  // an instance
             Change{"\"float radius\" 0.1\nObject", "\"float radius\" 0.101\nObject"},
             Change{"ObjectInstance \"thing\"\n", ""},
             Change{"\"float density\" [ 1 2 ]", "\"float density\" [ 1 2.001 ]"},
             Change{"[ 0.1 0.1 0.1 ]", "[ 0.1 0.1 0.101 ]"},
             Change{"[ 0.01 0.01 0.01 ]", "[ 0.01 0.01 0.011 ]"},  // a medium before WorldBegin
             Change{"Translate -0.5 0.5 0", "Translate -0.5 0.501 0"},
             Change{"Translate 0 1.5 0", "Translate 0 1.501 0"},
             Change{"Rotate 90 1 0 0", "Rotate 90.1 1 0 0"},
             Change{"\"rgb L\" [ 3 3 3 ]", "\"rgb L\" [ 3 3 3.001 ]"},
             Change{"\"string filename\" \"lamp.ies\"",
                    "\"string filename\" \"lamp.ies\" \"float scale\" 1.001"},
             Change{"AreaLightSource", "ReverseOrientation AreaLightSource"},
             Change{"WorldBegin", "WorldBegin\nAttribute \"shape\" \"float alpha\" 0.999"},
             Change{"WorldBegin", "WorldBegin\nColorSpace \"rec2020\""},
             Change{"WorldBegin", "WorldBegin\nLightSource \"distant\""},
             Change{"WorldBegin", "WorldBegin\nMakeNamedMedium \"cloud2\" \"string type\" \"homogeneous\""},
         }) {
        SCOPED_TRACE(to);
        write("room.pbrt", with(from, to));
        expect_other(load(), "scene (hash of geometry, materials, lights and media)");
    }
    write("room.pbrt", kRoom);
    EXPECT_EQ(load().code, 0);
}

TEST_F(SavedMaps, OfAChangedFileOfTheScene_AreRefused) {
    const std::string scene = "scene (hash of geometry, materials, lights and media)";
    write_wood(0.5001F);
    expect_other(load(), scene);
    write_wood(0.5F);
    EXPECT_EQ(load().code, 0);
    write("lamp.ies", lamp_of(101));
    expect_other(load(), scene);
    write("lamp.ies", lamp_of(100));
    std::string wall = kWall;
    write("wall.ply", wall.replace(wall.rfind("2 2 2"), 5, "2 2 2.001"));
    expect_other(load(), scene);
    write("wall.ply", kWall);
    EXPECT_EQ(load().code, 0);
}

TEST_F(SavedMaps, OfOtherOptionsOfLight_AreRefused) {
    expect_other(load({"--seed", "1"}), "seed is 0, here it is 1");
    expect_other(load({"--set", "photons=301"}), "number of light paths is 300, here it is 301");
    expect_other(load({"--set", "maxdepth=3"}), "longest path before a photon");
    expect_other(load({"--set", "specularbelow=0.1"}), "largest alpha that counts as specular");
    expect_other(load({"--set", "direct=map"}), "list of maps");
    expect_other(load({"--set", "causticphotons=50"}), "target of the caustic map is nothing, here it is 50");
    expect_other(load({"--unit", "photometric"}),
                 "unit of light is that of each light, here it is photometric");
    expect_other(load({"--colour-space", "rec2020"}), "colour space is srgb, here it is rec2020");
}

// Changes that do not affect the maps.
TEST_F(SavedMaps, OfAnotherView_AreTaken) {
    struct Change {
        const char *from, *to;
    };
    for (const auto& [from, to] : {
             Change{"LookAt 0 1 -3", "LookAt 0.5 1.5 -3"},
             Change{"LookAt 0 1 -3  0 0.5 0  0 1 0", "Rotate 3 0 1 0 Translate 0 0 3"},
             Change{"\"float fov\" 40", "\"float fov\" 60"},
             Change{"\"perspective\" \"float fov\" 40", "\"spherical\""},
             Change{"\"integer xresolution\" 6", "\"integer xresolution\" 9"},
             Change{"\"string filename\" \"room.exr\"", "\"string filename\" \"other.exr\""},
             Change{"\"independent\" \"integer pixelsamples\" 1", "\"halton\" \"integer pixelsamples\" 3"},
             Change{"PixelFilter \"box\"", "PixelFilter \"gaussian\""},
             Change{"WorldBegin", "WorldBegin # the world begins\n\n"},
             Change{"[ 0.5 0.4 0.3 ]", "[0.50 4e-1 0.3]"},  // the same numbers
             Change{"WorldBegin", "Integrator \"path\"\nWorldBegin"},
         }) {
        SCOPED_TRACE(to);
        write("room.pbrt", with(from, to));
        const Outcome outcome = load();
        EXPECT_EQ(outcome.code, 0) << outcome.err;
    }
    write("room.pbrt", kRoom);
    for (const std::vector<std::string>& options : {std::vector<std::string>{"--spp", "3"},
                                                    {"--resolution", "9x5"},
                                                    {"--crop", "1,1,3,3"},
                                                    {"--set", "k=20"},
                                                    {"--set", "gatherk=20"},
                                                    {"--set", "boundary=none"},
                                                    {"--threads", "1"},
                                                    {"--denoise"}}) {
        SCOPED_TRACE(::testing::PrintToString(options));
        const Outcome outcome = load(options);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
    }
    // The scene is split into several files, in another folder.
    std::filesystem::create_directory("moved");
    for (const char* file : {"wall.ply", "lamp.ies", "wood.exr"})
        std::filesystem::copy_file(file, std::string("moved/") + file);
    const std::string text = kRoom;
    const std::size_t half = text.find("Material \"dielectric\"");
    write("moved/rest.pbrt", text.substr(half));
    write("moved/main.pbrt", text.substr(0, half) + "Include \"rest.pbrt\"\n");
    const Outcome moved = load({}, "moved/main.pbrt");
    EXPECT_EQ(moved.code, 0) << moved.err;
}

TEST_F(SavedMaps, Info_TellsMapsFluxBoundsAndWhatTheyWereMadeFor) {
    const Outcome outcome = lucerna_run({"info", "room.photons"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const lucerna::SavedMaps saved = read_maps("room.photons");
    const Photons& global = *saved.maps[static_cast<std::size_t>(MapKind::global)];
    V3d flux(0);
    Box3d box;
    for (std::size_t i = 0; i < global.size(); ++i) {
        flux += V3d(global.photons[i].power);
        box.extendBy(V3d(global.positions[i]) + saved.origin.place);
    }
    EXPECT_THAT(outcome.out, HasSubstr("photon maps  of room.pbrt\n"));
    EXPECT_THAT(outcome.out, HasSubstr("light paths  300, which emit "));
    EXPECT_THAT(outcome.out, HasSubstr("direct map   not built\n"));
    EXPECT_THAT(outcome.out, HasSubstr(fmt::format("global map   {} photons of ", global.size())));
    EXPECT_THAT(outcome.out,
                HasSubstr(fmt::format("{:.6g} {} (", double{luminance(Rgb(flux))}, saved.origin.unit)));
    EXPECT_THAT(outcome.out,
                HasSubstr(fmt::format("bounds     ({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g})\n", box.min.x,
                                      box.min.y, box.min.z, box.max.x, box.max.y, box.max.z)));
    EXPECT_NEAR(box.min.y, 0, 0.5);  // in world coordinates, not relative to the scene's centre
    EXPECT_THAT(outcome.out, HasSubstr("made for\n"));
    EXPECT_THAT(outcome.out, HasSubstr("  scene (hash of geometry, materials, lights and media): "));
    EXPECT_THAT(outcome.out, HasSubstr("  seed: 0\n"));
    write("broken.photons", "no maps");
    expect_refused({"info", "broken.photons"}, {"broken.photons: not a file of photon maps"});
}

}  // namespace saved_maps_test
}  // namespace lucerna
