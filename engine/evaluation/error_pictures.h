// Shows errors as colours: signed relative errors, FLIP and noise.
#pragma once

#include <functional>
#include <string>

#include "engine/image/image.h"

namespace lucerna {

// Returns relative errors of luminance, (t - r) / (|r| + a tenth of the mean |r|), in one channel. The floor
// keeps dark pixels from dominating; it scales with the image, so the map does not depend on the exposure.
// Both images must be finite and have R G B.
Image relative_error(const Image& image, const Image& reference);
// Returns value / (|r| + a tenth of the mean |r|), of luminance.
Image relative_to(const Image& value, const Image& reference);

// Returns the 98 % quantile of |value|, rounded up to 1, 2 or 5 times a power of ten, or 1 if that is 0.
double error_scale(const Image& one_channel);

// Map the channel's values over `scale` to colours (colour_maps.h).
Image diverging_picture(const Image& one_channel, double scale);
Image magma_picture(const Image& one_channel, double scale);

// Encodes radiance for a page that shows it at any exposure: 24 bits of mantissa in the upper half and the
// exponent in the lower half of the picture (as in Ward's RGBE, but each in an 8-bit picture). Values that
// are not finite have exponent 255, which radiance below 2^126 never has; negative values are 0. Encode the
// result with png_bytes().
Image radiance_picture(const Image& image);

// The functions below combine pictures.

// Lays out `count` pictures of one size in rows of `columns`, from the top left, with dark grey lines of
// `gap` pixels in between. paint(i, image, x, y) draws picture i with its top left corner at (x, y).
Image contact_sheet(int count, int columns, const V2i& size, int gap,
                    const std::function<void(int i, Image& sheet, int x, int y)>& paint);

// Averages blocks of `factor` x `factor` pixels; partial blocks at the right and the bottom are averaged,
// too.
Image shrunk(const Image& image, int factor);

// Returns the quantile of the values at `share`; 0 if there are none.
double level(std::vector<double> values, double share);

}  // namespace lucerna
