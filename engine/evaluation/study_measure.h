// How far a point's images are from the reference, by one measure throughout the program: the root mean
// square over the pixels of the difference of luminance over the reference's luminance, plus a tenth of its
// mean (both squared). What `render --error` estimates of its noise is this, so "2 %" means the same wherever
// it is said, and whatever the scene's unit of radiance.
#pragma once

#include <vector>

#include "engine/base/monitor.h"
#include "engine/evaluation/seeds.h"
#include "engine/evaluation/study_trade.h"

namespace lucerna {

class StudyMeasure {
  public:
    // Pixels of which a channel of the reference is above `mask_above` are left out, and so are those that
    // are not finite. Throws InputError if the reference is black in all others: nothing is relative to that.
    StudyMeasure(const NamedImage& reference, double mask_above);

    // Fills in errors and mean ratio, from one image per seed. Warns of pixels that are not finite. Throws
    // InputError, naming the image, if it does not compare.
    void measure(const std::vector<NamedImage>& images, StudyResult& result, Monitor& monitor) const;

  private:
    NamedImage scaled(const NamedImage& image) const;

    NamedImage reference_;  // luminance, scaled, and its variance; NaN where nothing is compared
    double scale_ = 1;
    double noise2_ = 0;  // of the reference, as errors are
};

}  // namespace lucerna
