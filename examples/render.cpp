// Renders a scene with brighter or dimmer lamps: reads it, scales their flux, writes an OpenEXR image. usage:
// render SCENE.pbrt FACTOR IMAGE.exr
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <utility>

#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "lights/scaled.h"

int main(int argc, char** argv) try {
    if (argc != 4) {
        std::fputs("usage: render SCENE.pbrt FACTOR IMAGE.exr\n", stderr);
        return EXIT_FAILURE;
    }
    char* end = nullptr;
    const float factor = std::strtof(argv[2], &end);
    if (end == argv[2] || *end != '\0' || !(factor >= 0 && factor < 1e6F)) {
        std::fputs("render: FACTOR must be a number from 0 to 1000000\n", stderr);
        return EXIT_FAILURE;
    }
    lucerna::Monitor monitor;        // prints nothing; a derived class shows progress and warnings
    const lucerna::Workers workers;  // as many threads as there are processors

    // Reads the scene with other lamps. SceneOverrides can replace everything that the command line can.
    lucerna::SceneOverrides overrides;
    overrides.edit = [factor](lucerna::SceneParts& parts) {
        for (auto& light : parts.lights)
            light = lucerna::make_scaled_light(std::move(light), lucerna::Rgb(factor));
    };
    const lucerna::Job job = lucerna::read_scene(argv[1], overrides, workers, monitor);

    // Renders with the scene's own method and number of samples.
    lucerna::RenderOptions options;
    options.workers = workers;
    const lucerna::RenderResult result = lucerna::render(job, options, monitor);
    lucerna::write_exr(argv[3], result.image);
    std::printf("%s: %d x %d pixels, %d samples each\n", argv[3], result.image.width, result.image.height,
                job.spp);
    return EXIT_SUCCESS;
} catch (const std::exception& error) {  // lucerna::InputError: file, line and what is accepted, in one line
    std::fprintf(stderr, "render: %s\n", error.what());
    return EXIT_FAILURE;
}
