// Everything a scene file asks for: what the reader makes and the renderer takes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/colour/working_space.h"
#include "engine/integrators/settings.h"
#include "engine/scene/calculation_surface.h"
#include "engine/scene/camera.h"
#include "engine/scene/render_context.h"
#include "engine/scene/scene.h"
#include "engine/system/hash.h"
#include "engine/text/facts.h"

namespace lucerna {

struct FilterSettings {
    enum class Kind : std::uint8_t { box, triangle, gaussian, mitchell, sinc } kind = Kind::box;
    V2f radius{0.5F, 0.5F};          // pixels
    float sigma = 0.5F;              // gaussian, pixels
    float b = 1.F / 3, c = 1.F / 3;  // mitchell
    float tau = 3;                   // sinc: lobes of its window
};

struct FilmSettings {
    int width = 640, height = 480;  // pixels
    std::filesystem::path filename = "lucerna.exr";
    FilterSettings filter;
    float scale = 1;       // multiplies the stored radiance
    WorkingSpace colours;  // of the render, and so of the image
    // The part that is rendered, pixels, `crop_end` exclusive; (0,0): the whole picture.
    V2i crop_begin{0, 0}, crop_end{0, 0};
    // Where the rest of a picture is rendered elsewhere: what of it all parts together show, pixels,
    // `view_end` exclusive. Methods prepare for that. (0,0): for what is rendered.
    V2i view_begin{0, 0}, view_end{0, 0};

    // Samples are of two halves that do not depend on each other: what a denoiser needs to know its error.
    // Each half is stratified on its own, and the image of both a little less: in Cornell's box its squared
    // error is a tenth larger at 64 samples.
    bool two_halves = false;
    // For a film of two halves and a method that does not work in passes, samples are allocated to where they
    // are needed (allocation.h); `spp` is then their mean over the pixels.
    bool adaptive = false;
    // Beside the image its parts and the scene's light groups are made (engine/scene/path_account.h).
    bool parts = false;
    // Beside the image its light that only chance finds is told (SampleAccount::by_chance).
    bool chance = false;

    // Whether more of the picture is rendered elsewhere.
    bool is_part() const { return view_end != V2i(0, 0); }
    V2i rendered_size() const { return crop_end == V2i(0, 0) ? V2i(width, height) : crop_end - crop_begin; }
};

// Points whose illuminance is measured, in the place of what a camera sees: each by several pixels that do
// not depend on each other, so that how far they differ tells the error of their mean. Pixel (x, y) of the
// film is head y width + x of all; so many in a row are of one point.
struct Receivers {
    std::vector<Receiver> points;
    int sensors = 1;  // of each point, >= 1

    bool empty() const { return points.empty(); }
    // Pixels beyond the last point's measure that one once more.
    const Receiver& of(std::int64_t pixel) const {
        const auto last = static_cast<std::int64_t>(points.size()) - 1;
        return points[static_cast<std::size_t>(std::min(pixel / sensors, last))];
    }
};

// A part of what the scene's text says: its directives, hashed in their order by names and values, and the
// files of their parameters. Spaces and comments are no part of it, nor are names of text files.
struct SceneText {
    WordHash directives;
    std::vector<std::filesystem::path> files;  // some more than once

    // Returns a hash of the directives and of the contents of the files, which it reads. Throws InputError.
    std::uint64_t hash() const;
};

struct Job {
    Scene scene;
    Camera camera;
    FilmSettings film;
    IntegratorSettings integrator;
    int spp = 16;  // camera samples per pixel
    // If there are any, the image is theirs, and its quantity illuminance. They have no denoiser and no parts
    // of a picture, and stand in an image of film.width x film.height pixels.
    Receivers receivers = {};
    // Calculation surfaces that the scene names; `receivers` may measure on them.
    std::vector<CalculationSurface> surfaces = {};
    // The files that the scene was read from, the scene file first; empty for a scene made in memory.
    std::vector<std::filesystem::path> files = {};
    // Files that are stored beside those for the next time: lamps' cell tables. They change no image.
    std::vector<std::filesystem::path> caches = {};
    // The text of geometry, materials, lights and media, with the colours and the unit of the render; and the
    // text of the camera, the film and the calculation surfaces. SceneOverrides::edit is not part of them.
    SceneText world = {}, view = {};
    // That the scene asks of a method that works in passes, by which `spp` was set; 0: it does not say.
    int passes = 0;
    // The medium around `camera`, where that is not the scene's own camera; only the path
    // tracer looks at it.
    std::optional<std::int32_t> camera_medium = {};
};

// Returns by name all that the light in the scene depends on: program, arithmetic and Job::world, whose files
// it reads. Throws InputError.
Facts scene_facts(const Job& job);

// Returns the part of the film that the job's image shows, with the camera.
inline View view_of(const Job& job) {
    const FilmSettings& film = job.film;
    if (film.is_part()) return {&job.camera, V2f(film.view_begin), V2f(film.view_end)};
    return {&job.camera, V2f(film.crop_begin), V2f(film.crop_begin + film.rendered_size())};
}

}  // namespace lucerna
