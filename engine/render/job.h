// Everything a scene file asks for: what the reader makes and the renderer takes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/render/settings.h"
#include "engine/world/camera.h"
#include "engine/world/scene.h"

namespace lucerna {

struct FilterSettings {
    enum class Kind : std::uint8_t { box, triangle, gaussian } kind = Kind::box;
    V2f radius{0.5F, 0.5F};  // pixels
    float sigma = 0.5F;      // gaussian, pixels
};

struct FilmSettings {
    int width = 640, height = 480;  // pixels
    std::filesystem::path filename = "lucerna.exr";
    FilterSettings filter;
    float scale = 1;  // multiplies the stored radiance
};

struct Job {
    Scene scene;
    Camera camera;
    FilmSettings film;
    IntegratorSettings integrator;
    int spp = 16;  // camera samples per pixel
};

}  // namespace lucerna
