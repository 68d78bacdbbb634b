// Changes that a program makes between the text and the scene.
#include <gtest/gtest.h>

#include <string>

#include "engine/render/render.h"
#include "lights/analytic.h"
#include "lights/scaled.h"
#include "tests/support/scene_text.h"

namespace lucerna {
namespace edit_test {

std::string room(const char* intensity) {
    return std::string(R"(LookAt 0 1 -3  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 12 "integer yresolution" 8
Sampler "independent" "integer pixelsamples" 2
Integrator "path"
WorldBegin
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -2  -2 0 2  2 0 2  2 0 -2 ]
LightSource "point" "point3 from" [ 0.5 1.5 0 ] "rgb I" )") +
           intensity;
}

Image image_of(const char* intensity, const SceneOverrides& overrides) {
    Monitor monitor;
    return render(read_scene_text(room(intensity), "scene.pbrt", overrides, {}, monitor), {}, monitor).image;
}

TEST(Edit, ScaledLamp_MakesTheImageOfABrighterOne) {
    SceneOverrides overrides;
    overrides.edit = [](SceneParts& parts) {
        parts.lights.at(0) = make_scaled_light(std::move(parts.lights[0]), Rgb(2));
    };
    const Image edited = image_of("[ 3 2 1 ]", overrides);
    EXPECT_EQ(edited.data, image_of("[ 6 4 2 ]", {}).data);
    EXPECT_NE(edited.data, image_of("[ 3 2 1 ]", {}).data);
}

TEST(Edit, AnotherLamp_StandsWhereItIsPut) {
    SceneOverrides overrides;
    overrides.edit = [](SceneParts& parts) {
        const V3f place(V3d(0.5, 1.5, 0) - parts.origin);
        parts.lights.at(0) = make_point_light(place, Rgb(6, 4, 2));
    };
    EXPECT_EQ(image_of("[ 3 2 1 ]", overrides).data, image_of("[ 6 4 2 ]", {}).data);
}

TEST(Edit, EveryFrame_IsChanged) {
    int frames = 0;
    SceneOverrides overrides;
    overrides.edit = [&frames](SceneParts& parts) { frames += parts.lights.size() == 1 ? 1 : 0; };
    Monitor monitor;
    const Workers workers;
    const std::string world = room("[ 3 2 1 ]") + " WorldEnd\n";
    SceneFrames scene(world + "WorldBegin LightSource \"point\" WorldEnd", "scene.pbrt", overrides, workers,
                      monitor);
    while (scene.next()) continue;
    EXPECT_EQ(frames, 2);
}

}  // namespace edit_test
}  // namespace lucerna
