#include "engine/image/image.h"

#include <algorithm>
#include <functional>
#include <optional>

#include "engine/colour/colour_space.h"

namespace lucerna {
std::optional<std::size_t> find_channel(const Image& image, const std::string& name) {
    const auto found = std::ranges::find(image.channels, name);
    if (found == image.channels.end()) return std::nullopt;
    return static_cast<std::size_t>(found - image.channels.begin());
}

void add_channels(Image& image, const Image& more, const std::string& prefix) {
    const std::size_t had = image.channels.size(), has = more.channels.size();
    ZeroedVector<float> data(image.data.size() + more.data.size());
    for (std::size_t i = 0; i * had < image.data.size(); ++i) {
        float* const to = &data[i * (had + has)];
        std::copy_n(&image.data[i * had], had, to);
        std::copy_n(&more.data[i * has], has, to + had);
    }
    image.data = std::move(data);
    for (const std::string& name : more.channels) image.channels.push_back(prefix + name);
}

void describe_alike(Image& image, const Image& other) {
    image.attributes = other.attributes;
    image.corner = other.corner, image.picture = other.picture;
}

Image with_channels(const Image& image, const std::function<bool(const std::string& name)>& kept) {
    std::vector<std::size_t> places;
    Image result;
    result.width = image.width, result.height = image.height;
    result.space = image.space;
    describe_alike(result, image);
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        if (!kept(image.channels[c])) continue;
        places.push_back(c);
        result.channels.push_back(image.channels[c]);
    }
    result.data.reserve(image.data.size() / std::max<std::size_t>(1, image.channels.size()) * places.size());
    for (std::size_t at = 0; at < image.data.size(); at += image.channels.size()) {
        for (const std::size_t c : places) result.data.push_back(image.data[at + c]);
    }
    return result;
}

Image brought_to_srgb(Image image, bool held) {
    const ColourSpace& srgb = colour_spaces().front();
    if (!image.space || image.space == &srgb) {
        image.space = nullptr;
        return image;
    }
    const RgbMatrix matrix = conversion(*image.space, srgb);
    // Grey is grey in every space but CIE XYZ.
    const bool keeps_grey = (matrix * V3d(1, 1, 1) - V3d(1, 1, 1)).length() < 1e-4;
    const V3d weights(srgb.primaries[0].y, srgb.primaries[1].y, srgb.primaries[2].y);
    image.space = nullptr;
    const auto r = find_channel(image, "R"), g = find_channel(image, "G"), b = find_channel(image, "B");
    if (!r || !g || !b) return image;
    for (std::size_t at = 0; at < image.data.size(); at += image.channels.size()) {
        float *const red = &image.data[at + *r], *const green = &image.data[at + *g],
                     *const blue = &image.data[at + *b];
        if (keeps_grey && *red == *green && *green == *blue) continue;
        V3d c = matrix * V3d(double{*red}, double{*green}, double{*blue});
        if (held) c = held_in_gamut(c, weights);
        *red = static_cast<float>(c.x), *green = static_cast<float>(c.y), *blue = static_cast<float>(c.z);
    }
    const auto is_variance = [](const std::string& name) {
        return name == "variance.R" || name == "variance.G" || name == "variance.B";
    };
    if (!std::ranges::any_of(image.channels, is_variance)) return image;
    return with_channels(image, std::not_fn(is_variance));
}

}  // namespace lucerna
