// Small scenes built in memory, for tests that need light transport but no files.
#pragma once

#include <array>
#include <memory>
#include <utility>

#include "engine/base/stats.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "engine/scene/scene.h"
#include "lights/analytic.h"

namespace lucerna::testing {

class SceneMaker {
  public:
    std::uint32_t material(MaterialModel model, Relief relief = {}) {
        parts_.materials.push_back({"", std::move(model), std::move(relief)});
        return static_cast<std::uint32_t>(parts_.materials.size() - 1);
    }
    std::uint32_t diffuse(const Rgb& albedo) {
        return material(DiffuseMaterial{RgbTexture::constant(albedo)});
    }

    std::int32_t light(std::unique_ptr<Light> light) {
        parts_.lights.push_back(std::move(light));
        return static_cast<std::int32_t>(parts_.lights.size() - 1);
    }

    // Sets the names of the groups, and for each light so far the number of its group.
    void light_groups(std::vector<std::string> names, std::vector<std::uint32_t> of_light) {
        parts_.light_groups = {std::move(names), std::move(of_light)};
    }

    // Adds a parallelogram; its normal is a × b.
    void quad(const V3f& corner, const V3f& a, const V3f& b, std::uint32_t material) {
        Mesh mesh;
        mesh.p = {corner, corner + a, corner + a + b, corner + b};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        mesh.traits.material = material;
        parts_.meshes.push_back(std::move(mesh));
    }

    // Adds a parallelogram that emits along a × b.
    void quad_light(const V3f& corner, const V3f& a, const V3f& b, std::uint32_t material,
                    const Rgb& radiance) {
        quad(corner, a, b, material);
        Mesh& mesh = parts_.meshes.back();
        mesh.traits.light = light(make_area_light(TriangleEmitter{mesh.p, mesh.triangles}, radiance, false));
    }

    // Adds the inside of a box from (0,0,0) to `size`; normals point inwards.
    void room(const V3f& size, std::uint32_t material) {
        const V3f x(size.x, 0, 0), y(0, size.y, 0), z(0, 0, size.z);
        quad({0, 0, 0}, x, y, material);
        quad(z, y, x, material);
        quad({0, 0, 0}, y, z, material);
        quad(x, z, y, material);
        quad({0, 0, 0}, z, x, material);
        quad(y, x, z, material);
    }

    // Adds the same room with every corner mapped by `moved`.
    template <typename Moved>
    void room(const V3f& size, std::uint32_t material, Moved&& moved) {
        const std::size_t first = parts_.meshes.size();
        room(size, material);
        for (std::size_t i = first; i < parts_.meshes.size(); ++i) {
            for (V3f& p : parts_.meshes[i].p) p = moved(p);
        }
    }

    Quadric& sphere(const V3f& centre, float radius, std::uint32_t material) {
        Quadric sphere;
        sphere.radius = radius;
        sphere.world_from_object.setTranslation(V3d(centre));
        sphere.traits.material = material;
        parts_.quadrics.push_back(sphere);
        return parts_.quadrics.back();
    }

    Mesh& last_mesh() { return parts_.meshes.back(); }

    // Adds a medium for medium interfaces and returns its index.
    std::int32_t medium(Medium medium) {
        parts_.media.all.push_back(std::move(medium));
        return static_cast<std::int32_t>(parts_.media.all.size() - 1);
    }
    void region(Medium made) {
        parts_.media.regions.push_back(static_cast<std::uint32_t>(medium(std::move(made))));
    }
    void camera_in(std::int32_t medium) { parts_.media.camera = medium; }
    // Adds a sphere that is only a medium interface.
    Quadric& ball_of(std::int32_t medium, const V3f& centre, float radius) {
        Quadric& ball = sphere(centre, radius, material(InterfaceMaterial{}));
        ball.traits.media = {true, medium, kNoMedium};
        return ball;
    }

    Scene build() { return Scene(std::move(parts_), Workers{2}); }

  private:
    SceneParts parts_;
};

// Returns a camera that looks from `eye` to `target`; y is up.
inline Camera camera(const V3f& eye, const V3f& target, int width, int height, float fov_degrees) {
    const V3d z = V3d(target - eye).normalized();
    const V3d up = std::fabs(z.y) < 0.99 ? V3d(0, 1, 0) : V3d(1, 0, 0);
    const V3d x = up.cross(z).normalized();
    const V3d y = z.cross(x);
    Camera::Settings settings;
    settings.world_from_camera = M44d(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0,  //
                                      eye.x, eye.y, eye.z, 1);
    settings.fov_degrees = fov_degrees;
    settings.width = width;
    settings.height = height;
    return Camera(settings);
}

inline Job make_job(Scene scene, const Camera& camera, IntegratorSettings integrator, int spp) {
    FilmSettings film;
    film.width = camera.settings().width;
    film.height = camera.settings().height;
    return {std::move(scene), camera, film, std::move(integrator), spp};
}

// Returns a point light of `flux` at the centre of a sphere of radius 1: direct irradiance flux/(4π), total
// flux/(4π)/(1-ρ).
inline Scene integrating_sphere(float albedo, float flux) {
    SceneMaker make;
    make.sphere(V3f(0.0F), 1.0F, make.diffuse(Rgb(albedo)));
    make.light(make_point_light(V3f(0.0F), Rgb(flux / (4 * kPi))));
    return make.build();
}

// Returns a scene with roughly the proportions of the measured Cornell box, 1 m high: a white room with red
// and green walls, a block and a lamp. `add` may add more.
inline Scene small_cornell_with(void (*add)(SceneMaker&)) {
    SceneMaker make;
    add(make);
    const auto white = make.diffuse(Rgb(0.725F, 0.71F, 0.68F));
    const auto red = make.diffuse(Rgb(0.63F, 0.065F, 0.05F));
    const auto green = make.diffuse(Rgb(0.14F, 0.45F, 0.091F));
    make.quad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, white);
    make.quad({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, white);
    make.quad({0, 0, 1}, {0, 1, 0}, {1, 0, 0}, white);
    make.quad({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, green);
    make.quad({1, 0, 0}, {0, 0, 1}, {0, 1, 0}, red);
    // A block.
    const float s = 0.3F;
    make.quad({0.5F, s, 0.4F}, {0, 0, s}, {s, 0, 0}, white);
    make.quad({0.5F, 0, 0.4F}, {0, s, 0}, {s, 0, 0}, white);
    make.quad({0.5F, 0, 0.4F}, {0, 0, s}, {0, s, 0}, white);
    make.quad({0.5F + s, 0, 0.4F}, {0, s, 0}, {0, 0, s}, white);
    make.quad_light({0.35F, 0.998F, 0.35F}, {0.3F, 0, 0}, {0, 0, 0.3F}, make.diffuse(Rgb(0)), Rgb(17, 12, 4));
    return make.build();
}
inline Scene small_cornell() {
    return small_cornell_with([](SceneMaker&) {});
}
inline Camera small_cornell_camera(int size) {
    return camera({0.5F, 0.5F, -1.4F}, {0.5F, 0.5F, 0}, size, size, 39.3F);
}

inline RunningStats luminance_stats(const Image& image) {
    RunningStats stats;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) stats.add(luminance(image.rgb_at(x, y)));
    }
    return stats;
}

inline Rgb mean_rgb(const Image& image) {
    V3d sum(0.0);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) sum += V3d(image.rgb_at(x, y));
    }
    return Rgb(V3f(sum / (static_cast<double>(image.width) * image.height)));
}

}  // namespace lucerna::testing
