// Images: named float channels over a rectangle, and the files they live in.
#pragma once

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

struct ColourSpace;
struct PictureLook;  // tone.h

// Row-major, top row first, channels interleaved: value(x, y, c) = data[(y * width + x) * channels.size() +
// c].
struct Image {
    int width = 0;
    int height = 0;
    std::vector<std::string> channels;
    std::vector<float> data;
    std::map<std::string, std::string> attributes;  // text carried in the file's header
    const ColourSpace* space = nullptr;             // of R, G and B (colour_space.h); null: linear sRGB
    // Of a part of a picture: where its first pixel lies there, and the picture's size. (0, 0): it is the
    // whole.
    V2i corner{0, 0}, picture{0, 0};

    Image() = default;
    Image(int w, int h, std::vector<std::string> names)
        : width(w),
          height(h),
          channels(std::move(names)),
          data(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * channels.size()) {}

    static Image rgb(int w, int h) { return {w, h, {"R", "G", "B"}}; }

    std::size_t index(int x, int y) const {
        return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
               channels.size();
    }
    float& value(int x, int y, int c) { return data[index(x, y) + static_cast<std::size_t>(c)]; }
    float value(int x, int y, int c) const { return data[index(x, y) + static_cast<std::size_t>(c)]; }

    // The first three channels, or the first one three times.
    Rgb rgb_at(int x, int y) const {
        const float* p = &data[index(x, y)];
        return channels.size() < 3 ? Rgb(p[0]) : Rgb(p[0], p[1], p[2]);
    }
    void set_rgb(int x, int y, const Rgb& c) {
        float* p = &data[index(x, y)];
        p[0] = c.x, p[1] = c.y, p[2] = c.z;
    }
};

// The place of a channel among an image's; none if it has no such channel.
std::optional<std::size_t> find_channel(const Image& image, const std::string& name);

// The channels of another image of the same size behind an image's own, under names that begin so.
void add_channels(Image& image, const Image& more, const std::string& prefix);

// Header texts and place of another image.
void describe_alike(Image& image, const Image& other);

// The image without the other channels.
Image with_channels(const Image& image, const std::function<bool(const std::string& name)>& kept);

// R, G and B brought to linear sRGB: below 0 outside its gamut or, `held`, mixed with grey of the same
// luminance until none is. variance.R, .G and .B are left out where colours change, as nothing says how they
// vary together.
Image brought_to_srgb(Image image, bool held = false);

// OpenEXR, 32-bit float, ZIP. R, G, B come first whatever the file's order. What the file states in other
// chromaticities than Rec. 709's is brought to linear sRGB, so that all images read are in one space; the
// attribute "lucerna.broughtfrom" then tells of it. Throws InputError naming file and cause.
Image read_exr(const std::filesystem::path& file);
// The same in the space that the file states, which must have a name (colour_space.h).
Image read_exr_as_stated(const std::filesystem::path& file);
// Of the layers beside R, G and B of an image that was read: only those three are brought to linear sRGB.
// Null: linear sRGB.
const ColourSpace* space_of_layers(const Image& image);
// Writes beside the target and renames, so that a reader sees the old file or the new one, never half of one.
// An image with R, G and B states the chromaticities of its space.
void write_exr(const std::filesystem::path& file, const Image& image);
// The same as the bytes of such a file.
std::vector<std::byte> exr_bytes(const Image& image);

// 8-bit sRGB of the first three channels under that look.
void write_png(const std::filesystem::path& file, const Image& image, const PictureLook& look);
// A plain picture: values are already display-referred sRGB in [0,1].
void write_png_display(const std::filesystem::path& file, const Image& image);
// The same as the bytes of such a file, for a page that carries its pictures in itself.
std::vector<unsigned char> png_bytes(const Image& image);

// The variance of luminance, of the variances of linear red, green and blue. Channels vary together, near
// enough; it makes it rather too large than too small.
inline double luminance_variance(const V3d& variance) {
    const V3d deviation(std::sqrt(variance.x), std::sqrt(variance.y), std::sqrt(variance.z));
    return sqr(double{luminance(Rgb(V3f(deviation)))});
}

// What an error of luminance is relative to, wherever it is told as a share.

// Of the image's mean luminance, so that the errors of black pixels do not count for more than they show.
inline constexpr double kErrorFloorShare = 0.1;

// The square of it: of the luminance there, and of that share of the image's mean. Above 0 in any image that
// is not black.
inline double error_scale2(double luminance, double mean) {
    return sqr(luminance) + sqr(kErrorFloorShare * mean);
}

}  // namespace lucerna
