// These types hold what a picture file states about its numbers: the curve by which integers encode light,
// and the colour space of that light.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/colour/colour_space.h"
#include "engine/image/pictures.h"

namespace lucerna {

// Describes the curve by which integer formats store light. Half and float are linear.
struct Encoding {
    enum class Kind : std::uint8_t {
        of_file,  // as the file states, and sRGB if it states nothing
        srgb,
        linear,
        power,  // value^exponent
        table   // equally spaced from 0 to 1, linear in between
    };
    Kind kind = Kind::of_file;
    float exponent = 1;
    std::shared_ptr<const std::vector<float>> table = {};

    float decode(float stored) const;  // [0,1] to [0,1]; not of_file
};

// Returns CIE XYZ as a colour space: the numbers are X, Y and Z of the light itself, without any adaptation,
// and white is D65 as in every space.
const ColourSpace& cie_xyz_space();

// Holds the encoding and the colour space by which a file's numbers are read as colours.
struct StatedColours {
    Encoding encoding{Encoding::Kind::srgb};
    std::optional<ColourSpace> space = {};  // of the decoded numbers; none means linear sRGB
    std::string ignored = {};               // says what is not followed; empty if all is
};

// Integers follow an ICC profile of curves and primaries, or else a PNG's chunks sRGB, gAMA and cHRM, in this
// order [PNG 4.3]; floats follow OpenEXR's chromaticities, Radiance's PRIMARIES, and the channels X, Y and Z.
// Throws InputError (without the file's name) for chromaticities of floats that span no space.
StatedColours stated_colours(const PictureHeader& header);

// Names the channels that hold a picture's colours: X, Y and Z if it has these and not R, G and B, otherwise
// the first three, or the first one.
struct PictureChannels {
    ChannelRange range{0, 1};
    int count = 1;             // 1 or 3
    int place[3] = {0, 0, 0};  // of each channel, within the range
    bool xyz = false;
    bool in_order() const {
        return range.end - range.first == count && place[0] == 0 &&
               (count == 1 || (place[1] == 1 && place[2] == 2));
    }
};
// The picture must have a channel.
PictureChannels colour_channels(const PictureHeader& header);

}  // namespace lucerna
