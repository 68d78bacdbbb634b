// Declares images, which are named float channels over a rectangle, and reads and writes their files.
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

#include "engine/base/huge_pages.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"

namespace lucerna {

struct ColourSpace;
struct PictureLook;  // tone.h

// Pixels are stored row by row from the top, channels interleaved:
// value(x, y, c) = data[(y * width + x) * channels.size() + c].
struct Image {
    int width = 0;
    int height = 0;
    std::vector<std::string> channels;
    ZeroedVector<float> data;
    std::map<std::string, std::string> attributes;  // text carried in the file's header
    const ColourSpace* space = nullptr;             // of R, G and B (colour_space.h); null: linear sRGB
    // For a crop: where its first pixel lies in the whole image, and the whole image's size. A size of (0, 0)
    // means that this is the whole image.
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

    // Returns the first three channels, or the first one three times if there are fewer.
    Rgb rgb_at(int x, int y) const {
        const float* p = &data[index(x, y)];
        return channels.size() < 3 ? Rgb(p[0]) : Rgb(p[0], p[1], p[2]);
    }
    void set_rgb(int x, int y, const Rgb& c) {
        float* p = &data[index(x, y)];
        p[0] = c.x, p[1] = c.y, p[2] = c.z;
    }
};

// Returns the index of a channel, or none if the image has no such channel.
std::optional<std::size_t> find_channel(const Image& image, const std::string& name);

// Appends the channels of another image of the same size, with `prefix` before their names.
void add_channels(Image& image, const Image& more, const std::string& prefix);

// Copies the attributes and the place of another image.
void describe_alike(Image& image, const Image& other);

// Returns the image with only those channels for whose name kept() is true.
Image with_channels(const Image& image, const std::function<bool(const std::string& name)>& kept);

// Converts R, G and B to linear sRGB. Colours outside its gamut have components below 0 or, if `held`, are
// mixed with grey of the same luminance until none is. Where colours change, variance.R, .G and .B are
// removed, because their covariance is unknown.
Image brought_to_srgb(Image image, bool held = false);

// Reads an OpenEXR image. R, G and B come first, whatever the file's order. Colours with other chromaticities
// than Rec. 709's are converted to linear sRGB, so that all images are in one space; the attribute
// "lucerna.broughtfrom" then names the file's space. Throws InputError naming file and cause.
Image read_exr(const std::filesystem::path& file);
// Reads it in the space that the file states, which must have a name (colour_space.h).
Image read_exr_as_stated(const std::filesystem::path& file);
// Returns the colour space of the layers besides R, G and B of an image that read_exr() returned: it converts
// only these three. Null means linear sRGB.
const ColourSpace* space_of_layers(const Image& image);
// Writes 32-bit floats, packed by run lengths, to a temporary file and renames it, so that a reader sees the
// old file or the new one. An image with R, G and B states the chromaticities of its space. The bytes are the
// same for any number of threads; OpenEXR keeps as many until the process ends.
void write_exr(const std::filesystem::path& file, const Image& image, int threads = 1);
// Returns the bytes of such a file.
std::vector<std::byte> exr_bytes(const Image& image);

// Writes the first three channels under that look as 8-bit sRGB.
void write_png(const std::filesystem::path& file, const Image& image, const PictureLook& look,
               const Workers& workers = Workers{1});
// Writes values that are already display-referred sRGB in [0, 1].
void write_png_display(const std::filesystem::path& file, const Image& image);
// Returns the bytes of such a file, for pages that embed their pictures.
std::vector<unsigned char> png_bytes(const Image& image);

// Returns the variance of luminance, given the variances of linear red, green and blue. It takes the channels
// for fully correlated, which they nearly are and which overestimates rather than underestimates.
inline double luminance_variance(const V3d& variance) {
    const V3d deviation(std::sqrt(variance.x), std::sqrt(variance.y), std::sqrt(variance.z));
    return sqr(double{luminance(Rgb(V3f(deviation)))});
}

// Relative errors of luminance are relative to the luminance of the pixel and, so that invisible errors of
// black pixels do not dominate, to this share of the image's mean luminance.
inline constexpr double kErrorFloorShare = 0.1;

// Returns the square of what an error is relative to: the sum of both squares. It is above 0 in any image
// that is not black.
inline double error_scale2(double luminance, double mean) {
    return sqr(luminance) + sqr(kErrorFloorShare * mean);
}

}  // namespace lucerna
