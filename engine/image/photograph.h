// Photographs as measurements: the numbers that a camera wrote, untouched.
//
// A picture for people goes through gamma curves and colour profiles; a measurement must not. Whole numbers
// come out as the file holds them (0 to 255 or 0 to 65535), floats as they are, whatever the file says about
// colours.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

// The channel name that stands for Rec. 709 luminance of R, G and B; the only channel of a grey photograph.
inline constexpr std::string_view kLuminanceChannel = "luminance";
// The one that stands for R, G and B, the first three channels.
inline constexpr std::string_view kColourChannels = "rgb";

// One channel of a photograph, or three. Row-major, top row first.
struct Photograph {
    V2i size{0, 0};
    std::vector<float> counts;  // finite; of one channel after the other
    int most = 0;               // the largest count that the format holds, 255 or 65535; 0: floats
    int channels = 1;           // or 3

    std::size_t pixels() const { return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y); }
    std::span<const float> channel(int c) const {
        return std::span(counts).subspan(static_cast<std::size_t>(c) * pixels(), pixels());
    }
};

// PNG, TIFF, OpenEXR and whatever else pictures.h reads, of 8 or 16 bits, half or float. Alpha is ignored.
// Throws InputError naming file and cause: not readable, another kind of number, no such channel, not
// credible in size, or a number that is not finite.
Photograph read_photograph(const std::filesystem::path& file, std::string_view channel = kLuminanceChannel);

// One grey channel or R, G and B; the format by the suffix: .png, .tif, .tiff (whole numbers, of the bytes
// that `most` needs; counts are rounded and clamped to [0, most]) or .exr (floats, `most` = 0). Replaces the
// file atomically. Throws InputError.
void write_photograph(const std::filesystem::path& file, const Photograph& photograph);

}  // namespace lucerna
