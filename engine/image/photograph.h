// Reads and writes photographs as measurements: the numbers that a camera wrote, unchanged.
//
// A picture for people goes through gamma curves and colour profiles; a measurement must not. Integers are
// read as the file holds them (0 to 255 or 0 to 65535), floats as they are, whatever the file states about
// colours.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

// This channel name stands for the Rec. 709 luminance of R, G and B, or for the only channel of a grey
// photograph.
inline constexpr std::string_view kLuminanceChannel = "luminance";
// This one stands for R, G and B, the first three channels.
inline constexpr std::string_view kColourChannels = "rgb";

// Holds one channel of a photograph, or three, row by row from the top.
struct Photograph {
    V2i size{0, 0};
    std::vector<float> counts;  // finite; one channel after the other
    int most = 0;               // the largest count that the format holds, 255 or 65535; 0 for floats
    int channels = 1;           // or 3

    std::size_t pixels() const { return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y); }
    std::span<const float> channel(int c) const {
        return std::span(counts).subspan(static_cast<std::size_t>(c) * pixels(), pixels());
    }
};

// Reads PNG, TIFF, OpenEXR and the other formats of pictures.h, of 8 or 16 bits, half or float. Alpha is
// ignored. Throws InputError naming file and cause: not readable, another kind of number, no such channel, a
// size that is not credible, or a number that is not finite.
Photograph read_photograph(const std::filesystem::path& file, std::string_view channel = kLuminanceChannel);

// Writes one grey channel or R, G and B. The suffix chooses the format: .png, .tif or .tiff (integers of as
// many bytes as `most` needs; counts are rounded and clamped to [0, most]) or .exr (floats, `most` = 0).
// Replaces the file atomically. Throws InputError.
void write_photograph(const std::filesystem::path& file, const Photograph& photograph);

}  // namespace lucerna
