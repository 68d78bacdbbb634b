#include "engine/render/finishing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/colour/tone.h"
#include "engine/denoise/denoise.h"
#include "engine/image/displayed.h"
#include "engine/image/image.h"
#include "engine/render/feature_filter.h"
#include "engine/render/film.h"

namespace lucerna {
namespace {

constexpr int kMostSpacing = 4;

// Returns the processor seconds of developing a film of two halves, and of its error.
double seconds_to_develop(int side, const Workers& workers) {
    Film film(side, side, {.two_halves = true, .tells_blur = true});
    std::uint32_t noise = 1;
    for (int i = 0; i < Film::kLeastForError * side * side; ++i) {
        noise = 1664525 * noise + 1013904223;
        film.add(i % side, i / side % side, Rgb(static_cast<float>(noise >> 8) * 0x1p-24F), 1,
                 i / (side * side) % 2);
    }
    const ProcessorStopwatch clock;
    film.develop(1, {}, workers);
    for (const int half : {0, 1}) film.develop_half(half, 1, {}, workers);
    film.error(workers);
    return clock.seconds();
}

}  // namespace

FinishingRates measured_rates(double pixels, const Workers& workers) {
    // Small images cost more per pixel, by their rims.
    constexpr double kLeast = 32, kMost = 128;
    const auto side = static_cast<int>(std::clamp(std::sqrt(pixels), kLeast, kMost));
    // Features are the same everywhere, so that no pixel is left out of the filters.
    DenoiserInput input{{Image(side, side, half_channels()), Image(side, side, half_channels())},
                        Image(side, side, feature_channels())};
    std::uint32_t noise = 1;
    for (Image& half : input.halves) {
        for (std::size_t i = 0; i < half.data.size(); i += kHalfChannels) {
            for (std::size_t c = 0; c < kHalfChannels; ++c) {
                noise = 1664525 * noise + 1013904223;
                half.data[i + c] = 1 + static_cast<float>(noise >> 8) * 0x1p-24F;
            }
            half.data[i + kSamples] = 1;
        }
    }
    std::fill(input.features.data.begin(), input.features.data.end(), 1.0F);
    constexpr int kSpacing = 4;
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            const bool has_none = Film::step_of({x, y}) > 0;
            input.halves[1].value(x, y, kSamples) = 0;
            if (has_none) input.halves[0].value(x, y, kSamples) = 0;
        }
    }
    // One thread does not wait for others, which would count as processor time.
    const Workers one{1};
    FinishingRates rates;
    rates.threads = workers.threads;
    const ProcessorStopwatch filling;
    complete_halves(input.halves, kSpacing, input.features, one);
    // The image and the picture are filled, which have about as many channels as the halves.
    rates.filling = filling.seconds() / (side * side);
    const ProcessorStopwatch denoising;
    const Denoised denoised = denoise(input, one);
    rates.denoiser = denoising.seconds() / (side * side);
    rates.developing = seconds_to_develop(side, one) / (side * side);
    const ProcessorStopwatch writing;
    exr_bytes(denoised.image);
    rates.writing = writing.seconds() / (3 * side * side);
    const ProcessorStopwatch mapping;
    const Image picture = displayed(denoised.image, {});
    rates.mapping = mapping.seconds() / (side * side);
    const ProcessorStopwatch packing;
    auto_exposure(denoised.image);
    png_bytes(picture);
    rates.packing = packing.seconds() / (side * side);
    return rates;
}

void Finishing::denoise_within(double left, double whole) {
    constexpr double kMuch = 1.5, kLate = 0.02;
    const double most = kMuch * std::max(0.0, left) + kLate * whole;
    while (spacing < kMostSpacing && denoise_seconds() > most) spacing *= 2;
}

Finishing plan_finishing(double pixels, double seconds, const FinishingRates& rates, bool denoises,
                         const LaterWork& later) {
    // Shares of the time. Denoising leaves a tenth of the squared error, which would take ten times as many
    // samples: it may take as long as these.
    constexpr double kFeatures = 0.08, kDenoising = 0.5;
    // Features of kMostFeatureSamples take more samples at edges alone: some six for each pixel on average.
    constexpr double kSamplesWithEdges = 6;
    Finishing plan;
    const double first_features = rates.features;
    if (first_features > 0) {
        const double most = kFeatures * seconds, all = kSamplesWithEdges * first_features;
        plan.feature_samples = most >= all ? kMostFeatureSamples : 1;
        if (plan.feature_samples == 1) plan.edge_samples = most / first_features * pixels;
    }
    // Rates are measured on a small image, whose memory is in use already. Memory that a large image uses for
    // the first time costs a quarter more (six scenes of 1280 x 720 pixels: 1.1 to 1.35 times the plan).
    constexpr double kFirstUse = 1.25;
    const double all_pixels = kFirstUse * pixels * rates.slowdown / rates.threads;
    // Filters are many short loops. At the end of each, threads wait for one whose processor another program
    // has: beside two such programs (slowdown 1.85) this takes 1.3 times as long (median of nine renders).
    const double in_loops = all_pixels * std::sqrt(rates.slowdown);
    plan.fill_seconds = in_loops * rates.filling;
    const double denoising = in_loops * rates.denoiser;
    plan.develop_seconds = in_loops * rates.developing;
    plan.denoises = denoises;
    if (denoises) plan.all_denoise_seconds = denoising;
    while (plan.spacing < kMostSpacing && plan.denoise_seconds() > kDenoising * seconds) plan.spacing *= 2;
    plan.least_spacing = plan.spacing;
    plan.later_seconds = later.denoised * denoising + later.channels * all_pixels * rates.writing +
                         later.pictures * all_pixels * (rates.mapping + rates.threads * rates.packing);
    return plan;
}

}  // namespace lucerna
