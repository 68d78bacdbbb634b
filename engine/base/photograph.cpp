// Photographs come in and go out through OpenImageIO.
#include "engine/base/photograph.h"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/names.h"

namespace lucerna {
namespace {

[[noreturn]] void unreadable(const std::filesystem::path& file, const std::string& why) {
    throw InputError({file.string()}, "not a readable photograph: " + one_line(why));
}

std::unique_ptr<OIIO::ImageInput> open_raw(const std::filesystem::path& file) {
    require_readable(file);
    OIIO::ImageSpec how;
    how.attribute("oiio:UnassociatedAlpha", 1);  // or alpha darkens the counts
    how.attribute("oiio:RawColor", 1);
    auto in = OIIO::ImageInput::open(file.string(), &how);
    if (!in) unreadable(file, OIIO::geterror());
    return in;
}

// The largest count of a whole-number format, 0 for floats.
int most_of(const std::filesystem::path& file, const OIIO::ImageSpec& spec) {
    switch (spec.format.basetype) {
        case OIIO::TypeDesc::UINT8:
        case OIIO::TypeDesc::UINT16:
            break;
        case OIIO::TypeDesc::HALF:
        case OIIO::TypeDesc::FLOAT:
            return 0;
        default:
            throw InputError({file.string()},
                             fmt::format("numbers of kind {}; whole numbers of 8 or 16 bits, half "
                                         "and float are accepted",
                                         spec.format.c_str()));
    }
    const int whole = spec.format.basetype == OIIO::TypeDesc::UINT8 ? 8 : 16;
    // Narrower numbers would have been stretched while reading, and counts must stay what they are.
    const int bits = spec.get_int_attribute("oiio:BitsPerSample", whole);
    if (bits != whole) {
        throw InputError({file.string()}, fmt::format("{} bits for a number; 8 or 16 are accepted", bits));
    }
    return (1 << whole) - 1;
}

// A lying header must not make us allocate what the machine does not have.
void check_size(const std::filesystem::path& file, const OIIO::ImageSpec& spec) {
    constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
    constexpr std::uintmax_t kBestCompression = 1 << 16;  // of any format that we know
    std::error_code unknown;
    const std::uintmax_t bytes = std::filesystem::file_size(file, unknown);
    const bool wide = spec.width <= 0 || spec.height <= 0 || spec.width > kMaxPixels / spec.height;
    if (wide || spec.image_pixels() / kBestCompression > bytes) {
        throw InputError({file.string()},
                         fmt::format("image size {} × {} is not credible", spec.width, spec.height));
    }
    if (spec.deep || spec.depth > 1)
        throw InputError({file.string()}, "a flat image is accepted, not a deep one");
    if (spec.nchannels < 1) throw InputError({file.string()}, "the image has no channels");
}

struct Channels {
    int first, end;  // that are read
    bool luminance;  // of three
};

Channels channels_of(const std::filesystem::path& file, const OIIO::ImageSpec& spec,
                     std::string_view wanted) {
    if (wanted == kLuminanceChannel) {
        const bool colour = spec.nchannels >= 3;
        return {0, colour ? 3 : 1, colour};
    }
    for (int c = 0; c < static_cast<int>(spec.channelnames.size()); ++c) {
        if (std::string_view(spec.channelnames[static_cast<std::size_t>(c)]) == wanted)
            return {c, c + 1, false};
    }
    const std::size_t shown = std::min<std::size_t>(spec.channelnames.size(), 8);
    const std::vector<std::string_view> known(spec.channelnames.begin(),
                                              spec.channelnames.begin() + static_cast<std::ptrdiff_t>(shown));
    throw InputError({file.string()},
                     one_line(fmt::format("no channel \"{}\"; accepted are {} and {}", wanted,
                                          kLuminanceChannel, fmt::join(known, ", "))));
}

void require_finite(const std::filesystem::path& file, const Photograph& photograph) {
    for (std::size_t i = 0; i < photograph.counts.size(); ++i) {
        if (std::isfinite(photograph.counts[i])) continue;
        const auto width = static_cast<std::size_t>(photograph.size.x);
        throw InputError({file.string()}, fmt::format("pixel ({}, {}) holds {}; finite numbers are accepted",
                                                      i % width, i / width, photograph.counts[i]));
    }
}

// Every stored number as `Stored`, one channel or the luminance of three.
template <typename Stored>
void read_counts(OIIO::ImageInput& in, const Channels& channels, const std::filesystem::path& file,
                 OIIO::TypeDesc type, std::vector<float>& counts) {
    const auto count = static_cast<std::size_t>(channels.end - channels.first);
    std::vector<Stored> values(counts.size() * count);
    if (!in.read_image(0, 0, channels.first, channels.end, type, values.data()))
        unreadable(file, in.geterror());
    for (std::size_t i = 0; i < counts.size(); ++i) {
        const Stored* v = &values[i * count];
        const auto number = [&](std::size_t c) { return static_cast<float>(v[c]); };
        counts[i] = channels.luminance ? luminance(Rgb(number(0), number(1), number(2))) : number(0);
    }
}

const char* format_of(const std::filesystem::path& file, bool whole) {
    const std::string suffix = suffix_of(file);
    if (whole && suffix == ".png") return "png";
    if (whole && (suffix == ".tif" || suffix == ".tiff")) return "tiff";
    if (!whole && suffix == ".exr") return "openexr";
    throw InputError({file.string()},
                     fmt::format("a photograph of {} ends in {}", whole ? "whole numbers" : "floats",
                                 whole ? ".png, .tif or .tiff" : ".exr"));
}

void write_values(const std::filesystem::path& file, const char* format, const V2i& size, OIIO::TypeDesc type,
                  const void* values) {
    replace_file(file, [&](const std::filesystem::path& temporary) {
        // The temporary's name does not end in the suffix, so the format is named instead of guessed.
        auto out = OIIO::ImageOutput::create(format);
        if (!out) throw std::runtime_error(OIIO::geterror());
        OIIO::ImageSpec spec(size.x, size.y, 1, type);
        spec.channelnames = {"Y"};
        spec.attribute("compression", "zip");
        spec.attribute("oiio:ColorSpace", "Linear");
        if (!out->open(temporary.string(), spec) || !out->write_image(type, values) || !out->close())
            throw std::runtime_error(out->geterror());
    });
}

template <typename Stored>
std::vector<Stored> rounded(const Photograph& photograph) {
    std::vector<Stored> values;
    values.reserve(photograph.counts.size());
    for (const float c : photograph.counts) {
        const float most = static_cast<float>(photograph.most);
        values.push_back(static_cast<Stored>(c > 0 ? std::min(std::round(c), most) : 0.0F));  // NaN is 0
    }
    return values;
}

}  // namespace

Photograph read_photograph(const std::filesystem::path& file, std::string_view channel) {
    auto in = open_raw(file);
    const OIIO::ImageSpec spec = in->spec();
    check_size(file, spec);
    Photograph photograph;
    photograph.most = most_of(file, spec);
    const Channels channels = channels_of(file, spec, channel);
    photograph.size = {spec.width, spec.height};
    photograph.counts.resize(spec.image_pixels());
    if (photograph.most == 0) {
        read_counts<float>(*in, channels, file, OIIO::TypeDesc::FLOAT, photograph.counts);
    } else if (photograph.most == 255) {
        read_counts<std::uint8_t>(*in, channels, file, OIIO::TypeDesc::UINT8, photograph.counts);
    } else {
        read_counts<std::uint16_t>(*in, channels, file, OIIO::TypeDesc::UINT16, photograph.counts);
    }
    require_finite(file, photograph);
    return photograph;
}

void write_photograph(const std::filesystem::path& file, const Photograph& photograph) {
    const char* format = format_of(file, photograph.most > 0);
    if (photograph.most == 0) {
        write_values(file, format, photograph.size, OIIO::TypeDesc::FLOAT, photograph.counts.data());
    } else if (photograph.most <= 255) {
        write_values(file, format, photograph.size, OIIO::TypeDesc::UINT8,
                     rounded<std::uint8_t>(photograph).data());
    } else {
        write_values(file, format, photograph.size, OIIO::TypeDesc::UINT16,
                     rounded<std::uint16_t>(photograph).data());
    }
}

}  // namespace lucerna
