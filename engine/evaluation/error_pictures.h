// Errors as colours: what is too bright and too dark, and what FLIP and noise say.
#pragma once

#include <functional>
#include <string>

#include "engine/image/image.h"

namespace lucerna {

// Errors relative to what is there: (t - r) / (|r| + a tenth of the mean |r|), of luminance. The tenth keeps
// dark pixels from shouting; it goes with the image, so a scene lit a thousand times as brightly has the same
// map. One channel. Both images finite, R G B.
Image relative_error(const Image& image, const Image& reference);
// value / (|r| + a tenth of the mean |r|), of luminance.
Image relative_to(const Image& value, const Image& reference);

// The level that 98 % of all |values| stay below, rounded up to 1, 2 or 5 times a power of ten; 1 if that is
// 0.
double error_scale(const Image& one_channel);

// The channel's values over `scale` in the colours of those maps (colour_maps.h).
Image diverging_picture(const Image& one_channel, double scale);
Image magma_picture(const Image& one_channel, double scale);

// Radiance for a page that shows it at any exposure: 24 bits of mantissa above, the exponent below (as Ward's
// RGBE, each an 8-bit picture of its own, one on top of the other). What is not finite has exponent 255,
// which no radiance below 2^126 has; negative values are 0. As a picture for png_bytes().
Image radiance_picture(const Image& image);

// Many small pictures as one.

// Lays `count` pictures of one size out in rows of `columns`, the first at the top left, with lines of `gap`
// dark grey pixels between them. paint(i, image, x, y) draws picture i with its top left corner at (x, y).
Image contact_sheet(int count, int columns, const V2i& size, int gap,
                    const std::function<void(int i, Image& sheet, int x, int y)>& paint);

// The mean of `factor` x `factor` pixels each; what is left over at the right and the bottom counts as it is.
Image shrunk(const Image& image, int factor);

// The level below which `share` of the values lies; 0 of none.
double level(std::vector<double> values, double share);

}  // namespace lucerna
