#include "engine/render/finishing.h"

#include <algorithm>
#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/denoise/denoise.h"

namespace lucerna {

double measured_denoiser_seconds(const Workers& workers) {
    constexpr int kSide = 64;  // pixels
    // Features are the same everywhere, so that no pixel is left out of the filters.
    DenoiserInput input{{Image(kSide, kSide, half_channels()), Image(kSide, kSide, half_channels())},
                        Image(kSide, kSide, feature_channels())};
    std::uint32_t noise = 1;
    for (Image& half : input.halves) {
        for (std::size_t i = 0; i < half.data.size(); i += kHalfChannels) {
            for (std::size_t c = 0; c < kHalfChannels; ++c) {
                noise = 1664525 * noise + 1013904223;
                half.data[i + c] = 1 + static_cast<float>(noise >> 8) * 0x1p-24F;
            }
            half.data[i + kSamples] = 4;
        }
    }
    std::fill(input.features.data.begin(), input.features.data.end(), 1.0F);
    const Stopwatch clock;
    denoise(input, workers);
    return clock.seconds() / (kSide * kSide);
}

Finishing plan_finishing(double pixels, double seconds, double first_features, double per_pixel) {
    // Shares of the time. Denoising leaves a tenth of the squared error, which would take ten times as many
    // samples: it may take as long as these.
    constexpr double kFeatures = 0.08, kDenoising = 0.5;
    // Features of kMostFeatureSamples take more samples at edges alone: some six for each pixel on average.
    constexpr double kSamplesWithEdges = 6;
    Finishing plan;
    if (first_features > 0) {
        const double fit = kFeatures * seconds / first_features;
        plan.feature_samples = fit >= kSamplesWithEdges ? kMostFeatureSamples
                               : fit >= 4               ? 4
                               : fit >= 2               ? 2
                                                        : 1;
        if (plan.feature_samples > 1)
            plan.feature_seconds = first_features * std::min<double>(plan.feature_samples, kSamplesWithEdges);
    }
    plan.denoises = per_pixel * pixels <= kDenoising * seconds;
    if (plan.denoises) plan.denoise_seconds = pixels * per_pixel;
    return plan;
}

}  // namespace lucerna
