#include "engine/image/picture_colours.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/colour/spectrum.h"

namespace lucerna {
namespace {

// --- ICC profiles [ICC.1:2010] ---

// Thrown for a profile that cannot be followed; the text says why.
struct Unfollowed {
    std::string why;
};

constexpr std::size_t kIccHeader = 128;
constexpr std::size_t kCurvePoints = 4097;  // of a curve that is not a power

class IccProfile {
  public:
    explicit IccProfile(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
        if (bytes.size() < kIccHeader + 4) throw Unfollowed{"it is damaged"};
    }

    std::string_view word(std::size_t at) const { return {reinterpret_cast<const char*>(&bytes_[at]), 4}; }
    std::span<const std::uint8_t> tag(std::string_view name) const {
        const std::uint32_t count = whole(bytes_, kIccHeader);
        for (std::size_t i = 0; i < count && kIccHeader + 16 + 12 * i <= bytes_.size(); ++i) {
            const std::size_t at = kIccHeader + 4 + 12 * i;
            if (word(at) != name) continue;
            const std::size_t begin = whole(bytes_, at + 4), size = whole(bytes_, at + 8);
            if (begin > bytes_.size() || size > bytes_.size() - begin) break;
            return bytes_.subspan(begin, size);
        }
        throw Unfollowed{fmt::format("it has no {}, as profiles of tables have none", name)};
    }
    V3d xyz(std::string_view name) const {
        const std::span<const std::uint8_t> bytes = tag(name);
        return {fixed(bytes, 8), fixed(bytes, 12), fixed(bytes, 16)};
    }
    Encoding curve(std::string_view name) const {
        const std::span<const std::uint8_t> bytes = tag(name);
        const std::string_view type(reinterpret_cast<const char*>(bytes.data()),
                                    std::min<std::size_t>(4, bytes.size()));
        if (type == "curv") return table_curve(bytes);
        if (type == "para") return parametric_curve(bytes);
        throw Unfollowed{fmt::format("its {} is of an unknown type", name)};
    }

  private:
    static std::uint32_t whole(std::span<const std::uint8_t> b, std::size_t at, std::size_t count = 4) {
        if (at + count > b.size()) throw Unfollowed{"it is damaged"};
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < count; ++i) value = value << 8 | b[at + i];
        return value;
    }
    static double fixed(std::span<const std::uint8_t> b, std::size_t at) {
        return static_cast<std::int32_t>(whole(b, at)) / 65536.0;
    }

    template <typename Function>
    static Encoding sampled(Function&& function) {
        auto table = std::make_shared<std::vector<float>>(kCurvePoints);
        for (std::size_t i = 0; i < kCurvePoints; ++i) {
            const double value = function(static_cast<double>(i) / (kCurvePoints - 1));
            if (!std::isfinite(value)) throw Unfollowed{"a curve of it is not finite"};
            (*table)[i] = static_cast<float>(std::clamp(value, 0.0, 1.0));
        }
        return {Encoding::Kind::table, 1, std::move(table)};
    }
    static Encoding power(double exponent) {
        if (!(exponent >= 0.01 && exponent <= 100))
            throw Unfollowed{"a curve of it is no power from 0.01 to 100"};
        if (std::fabs(exponent - 1) < 1e-4) return {Encoding::Kind::linear};
        return {Encoding::Kind::power, static_cast<float>(exponent)};
    }

    static Encoding table_curve(std::span<const std::uint8_t> b) {
        const std::size_t count = whole(b, 8);
        if (count == 0) return {Encoding::Kind::linear};
        if (count == 1) return power(whole(b, 12, 2) / 256.0);
        whole(b, 12 + 2 * (count - 1), 2);
        return sampled([&](double x) {
            const double place = x * static_cast<double>(count - 1);
            const auto i = std::min(static_cast<std::size_t>(place), count - 2);
            const double low = whole(b, 12 + 2 * i, 2), high = whole(b, 14 + 2 * i, 2);
            return (low + (high - low) * (place - static_cast<double>(i))) / 65535;
        });
    }
    // The parameters are, in this order [ICC.1:2010, 10.16]: g, a, b, c, d, e, f. Each kind has some of them.
    static Encoding parametric_curve(std::span<const std::uint8_t> b) {
        constexpr std::array<std::size_t, 5> kParameters{1, 3, 4, 5, 7};
        const std::size_t kind = whole(b, 8, 2);
        if (kind >= kParameters.size()) throw Unfollowed{"a curve of it is of an unknown kind"};
        std::array<double, 7> p{1, 1, 0, 0, 0, 0, 0};
        for (std::size_t i = 0; i < kParameters[kind]; ++i) p[i] = fixed(b, 12 + 4 * i);
        const auto [g, a, shift, c, d, e, f] = p;
        if (kind == 0) return power(g);
        return sampled([&, g = g, a = a, shift = shift, c = c, d = d, e = e, f = f](double x) {
            const double raised = pow(std::max(0.0, a * x + shift), g);
            if (kind == 1) return a * x + shift >= 0 ? raised : 0.0;
            if (kind == 2) return a * x + shift >= 0 ? raised + c : c;
            return x >= d ? raised + e : c * x + f;
        });
    }

    std::span<const std::uint8_t> bytes_;
};

// Returns the largest difference of decoded values.
float difference(const Encoding& a, const Encoding& b) {
    float most = 0;
    for (int i = 0; i <= 256; ++i) {
        const float x = static_cast<float>(i) / 256;
        most = std::max(most, std::fabs(a.decode(x) - b.decode(x)));
    }
    return most;
}

// Returns sRGB's curve, or the identity, for a table that differs from it by no more than rounding, so that a
// picture is read alike with such a profile and without.
Encoding named(const Encoding& encoding) {
    constexpr float kRounding = 1e-3F;
    const Encoding srgb{Encoding::Kind::srgb}, linear{Encoding::Kind::linear};
    if (difference(encoding, srgb) < kRounding) return srgb;
    if (difference(encoding, linear) < kRounding) return linear;
    return encoding;
}

// Returns the space of a profile's colorants, which are adapted to D50, by their chromaticities under D65.
std::optional<ColourSpace> space_of_colorants(const std::array<V3d, 3>& colorants) {
    const V3d white = colorants[0] + colorants[1] + colorants[2];
    if (!(white.y > 0)) return std::nullopt;
    Chromaticities c{};
    for (std::size_t i = 0; i < 3; ++i) {
        const V3d xyz = adapted_to_d65(colorants[i] / white.y, white / white.y);
        const double sum = xyz.x + xyz.y + xyz.z;
        c[2 * i] = static_cast<float>(xyz.x / sum);
        c[2 * i + 1] = static_cast<float>(xyz.y / sum);
    }
    c[6] = colour_spaces().front().chromaticities[6];
    c[7] = colour_spaces().front().chromaticities[7];
    return colour_space_of(c);
}

StatedColours colours_of_profile(std::span<const std::uint8_t> bytes, int channels) {
    const IccProfile profile(bytes);
    const std::string_view space = profile.word(16);
    if (space != (channels == 3 ? "RGB " : "GRAY"))
        throw Unfollowed{fmt::format("it is for the colours \"{}\"", space)};
    StatedColours colours;
    if (channels == 1) {
        colours.encoding = named(profile.curve("kTRC"));
        return colours;
    }
    colours.encoding = named(profile.curve("rTRC"));
    constexpr float kAlike = 1e-3F;
    for (const std::string_view other : {"gTRC", "bTRC"}) {
        if (difference(colours.encoding, named(profile.curve(other))) > kAlike)
            throw Unfollowed{"its curves differ between red, green and blue"};
    }
    colours.space = space_of_colorants({profile.xyz("rXYZ"), profile.xyz("gXYZ"), profile.xyz("bXYZ")});
    if (!colours.space) throw Unfollowed{"its primaries span no colour space"};
    return colours;
}

// --- PNG's chunks ---

// gAMA is the exponent by which the numbers were encoded. 1/2.2 stands for sRGB's curve [PNG 13.13]; libpng
// uses the same tolerance.
Encoding encoding_of_gamma(double gamma) {
    constexpr double kSame = 0.05;
    if (std::fabs(gamma * 2.2 - 1) < kSame) return {Encoding::Kind::srgb};
    if (std::fabs(gamma - 1) < 1e-3) return {Encoding::Kind::linear};
    return {Encoding::Kind::power, static_cast<float>(1 / gamma)};
}

StatedColours colours_of_chunks(const PngColours& png, int channels) {
    StatedColours colours;
    if (png.srgb) return colours;
    if (png.gamma) {
        if (*png.gamma >= 0.01 && *png.gamma <= 100) {
            colours.encoding = encoding_of_gamma(*png.gamma);
        } else {
            colours.ignored = fmt::format("its gAMA of {:g} is ignored; sRGB's curve is used", *png.gamma);
        }
    }
    if (png.chromaticities && channels == 3) {
        colours.space = colour_space_of(*png.chromaticities);
        if (!colours.space)
            colours.ignored = "its cHRM spans no colour space and is ignored; sRGB's primaries are used";
    }
    return colours;
}

StatedColours colours_of_whole_numbers(const PictureHeader& header, int channels) {
    std::string ignored;
    if (header.png.coding_points)
        ignored = "its cICP is not followed; what it says of its colours besides is used";
    if (!header.icc_profile.empty()) {
        try {
            StatedColours colours = colours_of_profile(header.icc_profile, channels);
            colours.ignored = ignored;
            return colours;
        } catch (const Unfollowed& unfollowed) {
            ignored = fmt::format("its ICC profile is not followed, as {}; its colours are read without",
                                  unfollowed.why);
        }
    }
    StatedColours colours = colours_of_chunks(header.png, channels);
    if (colours.ignored.empty()) colours.ignored = ignored;
    return colours;
}

}  // namespace

float Encoding::decode(float x) const {
    switch (kind) {
        case Kind::srgb:
            return srgb_decoded(x);
        case Kind::power:
            return pow(x, exponent);
        case Kind::table: {
            const float place = std::clamp(x, 0.0F, 1.0F) * static_cast<float>(table->size() - 1);
            const auto i = std::min(static_cast<std::size_t>(place), table->size() - 2);
            return (*table)[i] + ((*table)[i + 1] - (*table)[i]) * (place - static_cast<float>(i));
        }
        case Kind::linear:
            return x;
        case Kind::of_file:
            break;
    }
    assert(false);
    return x;
}

const ColourSpace& cie_xyz_space() {
    static const ColourSpace space{
        "cie-xyz", {1, 0, 0, 1, 0, 0, 0.3127F, 0.3290F}, {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)}, {}};
    return space;
}

PictureChannels colour_channels(const PictureHeader& header) {
    assert(header.channels > 0);
    PictureChannels channels;
    if (header.channels < 3) return channels;
    channels.range = {0, 3};
    channels.count = 3;
    std::array<int, 3> xyz{-1, -1, -1};
    bool rgb = false;
    for (int c = 0; c < static_cast<int>(header.channel_names.size()); ++c) {
        const std::string& name = header.channel_names[static_cast<std::size_t>(c)];
        for (std::size_t i = 0; i < 3; ++i) {
            if (name == std::string_view("XYZ").substr(i, 1)) xyz[i] = c;
        }
        rgb = rgb || name == "R" || name == "G" || name == "B";
    }
    const auto [first, last] = std::ranges::minmax(xyz);
    channels.xyz = !rgb && first >= 0;
    if (channels.xyz) channels.range = {first, last + 1};
    for (int i = 0; i < 3; ++i)
        channels.place[i] = channels.xyz ? xyz[static_cast<std::size_t>(i)] - first : i;
    return channels;
}

StatedColours stated_colours(const PictureHeader& header) {
    const PictureChannels channels = colour_channels(header);
    if (are_whole(header.numbers)) return colours_of_whole_numbers(header, channels.count);
    StatedColours colours;
    colours.encoding = {Encoding::Kind::linear};
    if (channels.count < 3) return colours;
    if (channels.xyz) {
        colours.space = cie_xyz_space();
    } else if (header.chromaticities) {
        colours.space = colour_space_of(*header.chromaticities);
        if (!colours.space) {
            throw InputError(fmt::format("its chromaticities ({:g}) do not span a colour space",
                                         fmt::join(*header.chromaticities, " ")));
        }
    } else if (!header.icc_profile.empty()) {
        try {
            colours.space = colours_of_profile(header.icc_profile, channels.count).space;
        } catch (const Unfollowed& unfollowed) {
            colours.ignored = fmt::format("its ICC profile is not followed, as {}", unfollowed.why);
        }
    }
    return colours;
}

}  // namespace lucerna
