// Renders the features of an image, the properties of visible surfaces besides light
// (engine/denoise/denoise.h). They have almost no noise, and tell a denoiser where the image has edges
// [Rousselle et al. 2013, section 4].
#pragma once

#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/image/image.h"
#include "engine/render/job.h"

namespace lucerna {

struct Features {
    Image image;  // feature_channels() of engine/denoise/denoise.h
    // Channels that a denoiser does not use; without layers (FilmSettings::parts) the ids alone: the
    // variances of these means, under their names with "variance" before the last part (albedo.variance.R,
    // variance.Z); and
    //   Nc.X .Y .Z   N in the camera's axes, right, up and towards the viewer, also with variances
    //   id.object    Scene::object_of() of the object that most samples of the pixel see; 0: the sky
    //   id.material  likewise the number of its material, from 1, in the order of the scene's text
    Image more;
};

// Uses the positions of the render's own first samples: four of each pixel, and `most_samples` > 0, if these
// are more, where the four disagree, at edges and fine textures, or where neighbouring pixels differ. If the
// monitor stops it, missing values are 0.
Features render_features(const Job& job, std::uint64_t seed, int most_samples, const Workers& workers,
                         Monitor& monitor);

// Takes about `samples` samples, but no more than kMostFeatureSamples of a pixel, at the pixels of
// `features`, which have one sample each, that differ from their neighbours. Two or more of a pixel show
// which part of it lies on which side of an edge.
void refine_features(const Job& job, std::uint64_t seed, double samples, Features& features,
                     const Workers& workers, Monitor& monitor);

}  // namespace lucerna
