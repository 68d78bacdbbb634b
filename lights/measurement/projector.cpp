#include "lights/measurement/projector.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/units.h"

namespace lucerna {
namespace {

// The slide with a dark frame one texel wide, so that four neighbours always exist. Rows run down.
class Slide {
  public:
    Slide(const Image& picture, bool inverted)
        : width_(picture.width),
          height_(picture.height),
          stride_(static_cast<std::size_t>(picture.width) + 2),
          texels_(stride_ * (static_cast<std::size_t>(picture.height) + 2)) {
        for (int y = 0; y < height_; ++y) {
            for (int x = 0; x < width_; ++x) {
                const float value = luminance(picture.rgb_at(x, y));
                if (!(value >= 0 && value <= 1.0001F)) {
                    throw InputError(fmt::format(
                        "slide: a value of {} in column {}, row {}; 0 to 1 are accepted", value, x, y));
                }
                texels_[at(x, y)] = inverted ? std::max(0.0F, 1 - value) : value;
            }
        }
    }
    int width() const { return width_; }
    int height() const { return height_; }
    double texel(int x, int y) const { return double{texels_[at(x, y)]}; }

    // Bilinear between texel centres; x and y in texels from the upper left corner.
    double value(double x, double y) const {
        x -= 0.5;
        y -= 0.5;
        if (!(x > -1 && x < width_ && y > -1 && y < height_)) return 0;  // also NaN
        const double column = std::floor(x), row = std::floor(y);
        const double fx = x - column, fy = y - row;
        const float* t = &texels_[at(static_cast<int>(column), static_cast<int>(row))];
        const double upper = double{t[0]} + fx * (double{t[1]} - double{t[0]});
        const double lower = double{t[stride_]} + fx * (double{t[stride_ + 1]} - double{t[stride_]});
        return upper + fy * (lower - upper);
    }

  private:
    std::size_t at(int x, int y) const {  // from -1
        return static_cast<std::size_t>(y + 1) * stride_ + static_cast<std::size_t>(x + 1);
    }
    int width_, height_;
    std::size_t stride_;
    std::vector<float> texels_;
};

void check(const Projector& projector, const Image& picture) {
    const auto length = [](double x) { return std::isfinite(x) && x > 0; };
    if (!length(projector.aperture) || !length(projector.focal_length) || !length(projector.focus) ||
        !length(projector.slide_size.x) || !length(projector.slide_size.y) || !length(projector.flux) ||
        !std::isfinite(projector.setback) || projector.setback < 0) {
        throw InputError("projector: lengths and flux must be positive and finite");
    }
    if (!(projector.focus > projector.focal_length)) {
        throw InputError(fmt::format("projector: sharp at {}; more than its focal length of {} is accepted",
                                     length_text(projector.focus), length_text(projector.focal_length)));
    }
    if (picture.width < 1 || picture.height < 1) throw InputError("slide: it has no pixels");
}

// ∫ b²/R⁴ over the lens, from a point of the sharp plane at `off` from the axis: the irradiance there for a
// radiance of 1. The form factor of a disc seen from a parallel plane; the root is > 0 as b > 0.
double lens_seen_from(const Projector& projector, double off2) {
    const double b2 = projector.focus * projector.focus, r2 = projector.aperture * projector.aperture;
    const double sum = off2 + b2 + r2;
    return 0.5 * kPiD * (1 - (off2 + b2 - r2) / std::sqrt(sum * sum - 4 * r2 * off2));
}

}  // namespace

EmitterModel projector_emitter(const Projector& projector, const Image& picture) {
    check(projector, picture);
    const auto slide = std::make_shared<const Slide>(picture, projector.inverted);
    // Texels per metre on the sharp plane, and a texel's area there.
    const V2d per_metre(slide->width() / (projector.slide_size.x * projector.magnification()),
                        slide->height() / (projector.slide_size.y * projector.magnification()));
    const V2d middle(0.5 * slide->width(), 0.5 * slide->height());
    double flux = 0;  // for a radiance of 1 behind a clear slide
    for (int y = 0; y < slide->height(); ++y) {
        for (int x = 0; x < slide->width(); ++x) {
            const V2d q((x + 0.5 - middle.x) / per_metre.x, (y + 0.5 - middle.y) / per_metre.y);
            flux += slide->texel(x, y) * lens_seen_from(projector, q.length2());
        }
    }
    flux /= per_metre.x * per_metre.y;
    if (!(flux > 0) || !std::isfinite(flux)) throw InputError("slide: it lets no light through");

    EmitterModel emitter;
    emitter.outline = EmitterModel::Outline::disc;
    emitter.half_size = {projector.aperture, projector.aperture};
    emitter.setback = projector.setback;
    emitter.flux = projector.flux;
    emitter.radiance = [=, clear = projector.flux / flux, b = projector.focus](const V2d& p, const V3d& d) {
        const double way = b / d.z;  // d.z > 0
        return clear * slide->value(middle.x + (p.x + d.x * way) * per_metre.x,
                                    middle.y - (p.y + d.y * way) * per_metre.y);
    };
    emitter.info.provenance =
        fmt::format("virtual acquisition of a slide projector: aperture {}, focal length {}, sharp at {}",
                    length_text(2 * projector.aperture), length_text(projector.focal_length),
                    length_text(projector.focus));
    return emitter;
}

}  // namespace lucerna
