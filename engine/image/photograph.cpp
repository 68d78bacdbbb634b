#include "engine/image/photograph.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include "engine/base/error.h"
#include "engine/image/picture_colours.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

[[noreturn]] void unreadable(const std::filesystem::path& file, const std::string& why) {
    throw InputError({file.string()}, "not a readable photograph: " + one_line(why));
}

// Returns the largest count of a whole-number format, or 0 for floats.
int most_of(const std::filesystem::path& file, const PictureHeader& header) {
    if (header.numbers == PictureNumbers::floats) return 0;
    if (header.numbers != PictureNumbers::bytes && header.numbers != PictureNumbers::words) {
        throw InputError(
            {file.string()},
            fmt::format("pixel type {}; expected 8- or 16-bit integers, half or float", header.kind));
    }
    const int whole = header.numbers == PictureNumbers::bytes ? 8 : 16;
    // The library stretches narrower numbers, but counts must not change.
    if (header.bits != whole) {
        throw InputError({file.string()}, fmt::format("{} bits per value; expected 8 or 16", header.bits));
    }
    return (1 << whole) - 1;
}

std::size_t pixels_of(const PictureHeader& header) {
    return static_cast<std::size_t>(header.width) * static_cast<std::size_t>(header.height);
}

void check_size(const std::filesystem::path& file, const PictureHeader& header) {
    if (!is_credible(file, header)) {
        throw InputError({file.string()},
                         fmt::format("image size {} × {} is not plausible", header.width, header.height));
    }
    if (!header.flat) throw InputError({file.string()}, "is a deep image; expected a flat one");
    if (header.channels < 1) throw InputError({file.string()}, "the image has no channels");
}

struct Channels {
    ChannelRange read;
    bool luminance;  // of three
    int given = 1;
};

Channels channels_of(const std::filesystem::path& file, const PictureHeader& header,
                     std::string_view wanted) {
    const PictureChannels colours = colour_channels(header);
    if (wanted == kLuminanceChannel && colours.xyz) {
        const int y = colours.range.first + colours.place[1];
        return {{y, y + 1}, false};
    }
    if (wanted == kLuminanceChannel) {
        const bool colour = header.channels >= 3;
        return {{0, colour ? 3 : 1}, colour};
    }
    if (wanted == kColourChannels) {
        if (colours.xyz) {
            input_error({file.string()}, "channels X, Y and Z, but \"{}\" needs R, G and B; {} is Y",
                        kColourChannels, kLuminanceChannel);
        }
        if (header.channels >= 3) return {{0, 3}, false, 3};
        throw InputError({file.string()},
                         fmt::format("{} channels, but \"{}\" needs 3", header.channels, kColourChannels));
    }
    const std::vector<std::string>& names = header.channel_names;
    for (int c = 0; c < static_cast<int>(names.size()); ++c) {
        if (std::string_view(names[static_cast<std::size_t>(c)]) == wanted) return {{c, c + 1}, false};
    }
    const std::size_t shown = std::min<std::size_t>(names.size(), 8);
    const std::vector<std::string_view> known(names.begin(),
                                              names.begin() + static_cast<std::ptrdiff_t>(shown));
    throw InputError({file.string()},
                     one_line(fmt::format("no channel \"{}\"; expected {}, {} or {}", wanted,
                                          kLuminanceChannel, kColourChannels, fmt::join(known, ", "))));
}

void require_finite(const std::filesystem::path& file, const Photograph& photograph) {
    for (std::size_t i = 0; i < photograph.counts.size(); ++i) {
        if (std::isfinite(photograph.counts[i])) continue;
        const auto width = static_cast<std::size_t>(photograph.size.x);
        const std::size_t pixel = i % photograph.pixels();
        throw InputError({file.string()}, fmt::format("pixel ({}, {}) holds {}; expected finite numbers",
                                                      pixel % width, pixel / width, photograph.counts[i]));
    }
}

// Reads numbers stored as `Stored`: one channel, the luminance of three channels, or three channels.
template <typename Stored>
void read_counts(PictureReader& in, const Channels& channels, const std::filesystem::path& file,
                 std::vector<float>& counts) {
    const auto count = static_cast<std::size_t>(channels.read.end - channels.read.first);
    const std::size_t pixels = counts.size() / static_cast<std::size_t>(channels.given);
    std::vector<Stored> values(pixels * count);
    try {
        in.read(channels.read, std::span(values));
    } catch (const std::runtime_error& error) {
        unreadable(file, error.what());
    }
    for (std::size_t i = 0; i < pixels; ++i) {
        const Stored* v = &values[i * count];
        const auto number = [&](std::size_t c) { return static_cast<float>(v[c]); };
        counts[i] = channels.luminance ? luminance(Rgb(number(0), number(1), number(2))) : number(0);
        for (std::size_t c = 1; c < static_cast<std::size_t>(channels.given); ++c)
            counts[c * pixels + i] = number(c);
    }
}

PictureFormat format_of(const std::filesystem::path& file, bool whole) {
    const std::string suffix = suffix_of(file);
    if (whole && suffix == ".png") return PictureFormat::png;
    if (whole && (suffix == ".tif" || suffix == ".tiff")) return PictureFormat::tiff;
    if (!whole && suffix == ".exr") return PictureFormat::exr;
    throw InputError({file.string()},
                     fmt::format("a photograph of {} must end in {}", whole ? "whole numbers" : "floats",
                                 whole ? ".png, .tif or .tiff" : ".exr"));
}

template <typename Stored>
void write_values(const std::filesystem::path& file, PictureFormat format, const Photograph& photograph,
                  std::vector<Stored> values) {
    const V2i& size = photograph.size;
    if (photograph.channels == 3) {  // of each pixel, interleaved
        std::vector<Stored> mixed(values.size());
        const std::size_t pixels = photograph.pixels();
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t i = 0; i < pixels; ++i) mixed[3 * i + c] = values[c * pixels + i];
        values = std::move(mixed);
    }
    const Pictures* const formats = &pictures(file);
    replace_file(file, [&](const std::filesystem::path& temporary) {
        formats->write(temporary,
                       {format, size.x, size.y, photograph.channels, std::span<const Stored>(values)});
    });
}

template <typename Stored>
std::vector<Stored> rounded(const Photograph& photograph) {
    std::vector<Stored> values;
    values.reserve(photograph.counts.size());
    for (const float c : photograph.counts) {
        const float most = static_cast<float>(photograph.most);
        values.push_back(static_cast<Stored>(c > 0 ? std::min(std::round(c), most) : 0.0F));  // NaN becomes 0
    }
    return values;
}

}  // namespace

Photograph read_photograph(const std::filesystem::path& file, std::string_view channel) {
    const OpenedPicture opened = open_picture(file, PictureUse::measurement);
    const PictureHeader& header = opened.header;
    PictureReader& in = *opened.reader;
    check_size(file, header);
    Photograph photograph;
    photograph.most = most_of(file, header);
    const Channels channels = channels_of(file, header, channel);
    for (int c = channels.read.first; photograph.most == 0 && c < channels.read.end; ++c) {
        if (header.integer_channels[static_cast<std::size_t>(c)])
            input_error({file.string()}, "channel \"{}\" holds integers; expected half or float",
                        header.channel_names[static_cast<std::size_t>(c)]);
    }
    photograph.size = {header.width, header.height};
    const auto read = static_cast<std::uint64_t>(channels.read.end - channels.read.first);
    require_memory(
        pixels_of(header) * (static_cast<std::uint64_t>(channels.given) + read) * sizeof(float),
        fmt::format("{}: a photograph of {} x {} pixels", file.string(), header.width, header.height),
        "use fewer pixels");
    photograph.channels = channels.given;
    photograph.counts.resize(pixels_of(header) * static_cast<std::size_t>(channels.given));
    if (photograph.most == 0) {
        read_counts<float>(in, channels, file, photograph.counts);
    } else if (photograph.most == 255) {
        read_counts<std::uint8_t>(in, channels, file, photograph.counts);
    } else {
        read_counts<std::uint16_t>(in, channels, file, photograph.counts);
    }
    require_finite(file, photograph);
    return photograph;
}

void write_photograph(const std::filesystem::path& file, const Photograph& photograph) {
    const PictureFormat format = format_of(file, photograph.most > 0);
    if (photograph.most == 0) {
        write_values(file, format, photograph, photograph.counts);
    } else if (photograph.most <= 255) {
        write_values(file, format, photograph, rounded<std::uint8_t>(photograph));
    } else {
        write_values(file, format, photograph, rounded<std::uint16_t>(photograph));
    }
}

}  // namespace lucerna
