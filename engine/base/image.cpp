#include "engine/base/image.h"

#include <algorithm>
#include <array>
#include <optional>

#include "engine/base/colour_space.h"

namespace lucerna {
namespace {

// Without the channels of these names.
Image without(const Image& image, const std::array<std::string, 3>& names) {
    std::vector<std::size_t> kept;
    Image result;
    result.width = image.width, result.height = image.height;
    result.attributes = image.attributes;
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        if (std::ranges::count(names, image.channels[c]) > 0) continue;
        kept.push_back(c);
        result.channels.push_back(image.channels[c]);
    }
    result.data.reserve(image.data.size() / image.channels.size() * kept.size());
    for (std::size_t at = 0; at < image.data.size(); at += image.channels.size()) {
        for (const std::size_t c : kept) result.data.push_back(image.data[at + c]);
    }
    return result;
}

}  // namespace

std::optional<std::size_t> find_channel(const Image& image, const std::string& name) {
    const auto found = std::ranges::find(image.channels, name);
    if (found == image.channels.end()) return std::nullopt;
    return static_cast<std::size_t>(found - image.channels.begin());
}

void add_channels(Image& image, const Image& more, const std::string& prefix) {
    const std::size_t had = image.channels.size(), has = more.channels.size();
    std::vector<float> data(image.data.size() + more.data.size());
    for (std::size_t i = 0; i * had < image.data.size(); ++i) {
        float* const to = &data[i * (had + has)];
        std::copy_n(&image.data[i * had], had, to);
        std::copy_n(&more.data[i * has], has, to + had);
    }
    image.data = std::move(data);
    for (const std::string& name : more.channels) image.channels.push_back(prefix + name);
}

Image brought_to_srgb(Image image, bool held) {
    const ColourSpace& srgb = colour_spaces().front();
    if (!image.space || image.space == &srgb) {
        image.space = nullptr;
        return image;
    }
    const RgbMatrix matrix = conversion(*image.space, srgb);
    const V3d weights(srgb.primaries[0].y, srgb.primaries[1].y, srgb.primaries[2].y);
    image.space = nullptr;
    const auto r = find_channel(image, "R"), g = find_channel(image, "G"), b = find_channel(image, "B");
    if (!r || !g || !b) return image;
    for (std::size_t at = 0; at < image.data.size(); at += image.channels.size()) {
        float *const red = &image.data[at + *r], *const green = &image.data[at + *g],
                     *const blue = &image.data[at + *b];
        if (*red == *green && *green == *blue) continue;  // grey is grey in every space
        V3d c = matrix * V3d(double{*red}, double{*green}, double{*blue});
        if (held) c = held_in_gamut(c, weights);
        *red = static_cast<float>(c.x), *green = static_cast<float>(c.y), *blue = static_cast<float>(c.z);
    }
    const std::array<std::string, 3> variances{"variance.R", "variance.G", "variance.B"};
    const bool any = std::ranges::any_of(
        variances, [&](const std::string& name) { return find_channel(image, name).has_value(); });
    return any ? without(image, variances) : image;
}

}  // namespace lucerna
