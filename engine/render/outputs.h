// The outputs of a render: its result, and on the way images and checkpoints.
#pragma once

#include <cstdint>
#include <functional>

#include "engine/render/finishing.h"
#include "engine/render/image_in_progress.h"
#include "engine/render/progress.h"
#include "engine/render/render.h"

namespace lucerna {

// Develops the image under way, at rank 0 after ImageInProgress::gather(). Pixels without a sample are filled
// from those that have one. With a film of two halves the result is denoised on demand; null: not.
RenderResult develop(const Job& job, const ImageInProgress& image, const RenderReport& report,
                     const Finishing* denoising, const Workers& workers);

// Warns of samples and rays that were left out, and of an image of a lower resolution; after
// ImageInProgress::gather().
void warn_of_losses(const ImageInProgress& image, const RenderReport& report, Monitor& monitor);

// Shows the image and keeps checkpoints at the intervals that RenderOptions ask for. The ranks of a parallel
// job call the same functions: rank 0 says what is due, all gather the image, and rank 0 hands it out.
class Outputs {
  public:
    // All of these outlive the outputs.
    Outputs(const Job& job, const RenderOptions& options, const RenderClock& clock, ImageInProgress& image,
            const RenderReport& report, const Finishing& finishing, bool in_passes);

    // Whether a display or a checkpoint waits for a pause between two tiles; at rank 0, from any thread.
    bool is_pause_due() const;
    // Hands out what is due; nothing works on the image meanwhile. After a whole round or pass that may be an
    // image to show, too. Collective.
    void pause(bool after_round);
    // Keeps a checkpoint; collective.
    void keep();
    // Keeps the image as it is and no later one: what follows cannot be continued. Collective.
    void keep_the_last();

  private:
    void present(const std::function<void(const RenderResult&)>& to, Recurring& when, bool denoised);
    bool leads() const { return !options_.workers.ranks || options_.workers.ranks->leads(); }

    const Job& job_;
    const RenderOptions& options_;
    const RenderClock& clock_;
    ImageInProgress& image_;
    const RenderReport& report_;
    const Finishing& finishing_;
    bool in_passes_;
    Recurring show_timer_, watch_timer_, checkpoint_timer_;
    bool can_keep_ = true;
};

}  // namespace lucerna
