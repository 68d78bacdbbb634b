// What a command, or a program, asks of a scene's job, and what it gets in the image's file.
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
    int spp = 0;     // which the job has already; 0: not given
    std::optional<PixelBox> crop;
    bool denoise = false;  // samples are of two halves
    bool adaptive = true;  // of two halves: more samples where there is more noise
    bool layers = false;
};

// Changes what the job asks for. Given a limit and neither samples nor passes, the limit alone ends the
// render. Throws InputError for passes of an integrator that has none, and for a box beyond the picture.
void apply(const RenderRequest& request, const Limits& limits, Job& job);

// These layers are written beside R, G, B, their variances and the denoised light.
struct FileLayers {
    bool halves = false;     // the layers of which the denoised light is made
    bool parts = false;      // all other layers
    LayerNames chosen = {};  // of all these and the denoised light
};
// Puts them into the image, and as attributes what was rendered, and how.
void complete_image(const RunFacts& facts, const Job& job, const FileLayers& layers, const Workers& workers,
                    RenderResult& result);

}  // namespace lucerna
