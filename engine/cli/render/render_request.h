// The requests of a command, or a program, for a scene's job, and the layers of the image's file.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "engine/cli/image/image_layers.h"
#include "engine/cli/render/run_report.h"
#include "engine/render/image_part.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "engine/render/stop_rule.h"

namespace lucerna {

bool has_limit(const Limits& limits);

struct RenderRequest {
    int passes = 0;  // of an integrator that works in passes; 0: not given
    int spp = 0;     // samples that the job already has; 0: not given
    std::optional<PixelBox> crop;
    bool denoise = false;  // samples form two halves
    bool adaptive = true;  // with two halves: more samples where there is more noise
    bool layers = false;
};

// Applies the request to the job. With a limit and neither samples nor passes, only the limit ends the
// render. Throws InputError for passes of an integrator without them, and for a crop beyond the image.
void apply(const RenderRequest& request, const Limits& limits, Job& job);

// The layers written beside R, G, B, their variances and the denoised image.
struct FileLayers {
    bool halves = false;     // layers from which the denoised image is made
    bool parts = false;      // all other layers
    LayerNames chosen = {};  // of all these and the denoised image
};
// Adds the layers to the image, and the facts of the render as attributes.
void complete_image(const RunFacts& facts, const Job& job, const FileLayers& layers, const Workers& workers,
                    RenderResult& result);

}  // namespace lucerna
