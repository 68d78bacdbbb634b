#include "engine/evaluation/shared_channels.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"

namespace lucerna {
namespace {

const std::string kVariance = "variance.";

bool is_compared(const std::string& channel) {
    return !channel.starts_with(kVariance) && channel != "A";
}

const SharedChannel& named(const std::vector<SharedChannel>& channels, const std::string& name) {
    const auto found = std::find_if(channels.begin(), channels.end(),
                                    [&](const SharedChannel& channel) { return channel.name == name; });
    return found == channels.end() ? channels.front() : *found;
}

bool all_named(const std::vector<SharedChannel>& channels) {
    constexpr std::array<const char*, 3> kNames{"R", "G", "B"};
    return std::all_of(kNames.begin(), kNames.end(),
                       [&](const char* name) { return named(channels, name).name == name; });
}

}  // namespace

std::optional<std::size_t> find_channel(const Image& image, const std::string& name) {
    const auto found = std::find(image.channels.begin(), image.channels.end(), name);
    if (found == image.channels.end()) return std::nullopt;
    return static_cast<std::size_t>(found - image.channels.begin());
}

std::vector<SharedChannel> shared_channels(const Image& image, const Image& reference,
                                           const std::string& name, const std::string& reference_name) {
    if (image.width != reference.width || image.height != reference.height) {
        throw InputError(
            {name},
            fmt::format("{} x {} pixels, but {} has {} x {}; only images of one size compare", image.width,
                        image.height, reference_name, reference.width, reference.height));
    }
    std::vector<SharedChannel> shared;
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        const std::string& channel = image.channels[c];
        if (!is_compared(channel)) continue;
        if (const auto r = find_channel(reference, channel)) {
            shared.push_back({channel, c, *r, find_channel(image, kVariance + channel),
                              find_channel(reference, kVariance + channel)});
        }
    }
    if (shared.empty()) throw InputError({name}, "no colour channel in common with " + reference_name);
    return shared;
}

std::vector<std::string> channels_of_one(const Image& image, const Image& reference) {
    std::vector<std::string> names;
    for (const std::string& name : image.channels) {
        if (is_compared(name) && !find_channel(reference, name)) names.push_back(name);
    }
    for (const std::string& name : reference.channels) {
        if (is_compared(name) && !find_channel(image, name)) names.push_back(name);
    }
    return names;
}

PixelState pixel_state(const float* image, const float* reference, const std::vector<SharedChannel>& channels,
                       double mask_above) {
    PixelState state;
    for (const SharedChannel& c : channels) {
        const float r = reference[c.reference_at];
        state.bad |= !std::isfinite(image[c.at]);
        state.bad_reference |= !std::isfinite(r);
        state.masked |= std::isfinite(r) && double{r} > mask_above;
    }
    return state;
}

LookedAt looked_at(const Image& image, const Image& reference, const std::string& name,
                   const std::string& reference_name, double mask_above) {
    const std::vector<SharedChannel> channels = shared_channels(image, reference, name, reference_name);
    const bool colour = all_named(channels);
    const SharedChannel& first = colour ? named(channels, "R") : named(channels, "Y");
    const std::array<SharedChannel, 3> shown{first, colour ? named(channels, "G") : first,
                                             colour ? named(channels, "B") : first};
    LookedAt pair{Image::rgb(image.width, image.height), Image::rgb(image.width, image.height), {}};
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const float* t = &image.data[image.index(x, y)];
            const float* r = &reference.data[reference.index(x, y)];
            const PixelState state = pixel_state(t, r, channels, mask_above);
            Rgb a(t[shown[0].at], t[shown[1].at], t[shown[2].at]);
            Rgb b(r[shown[0].reference_at], r[shown[1].reference_at], r[shown[2].reference_at]);
            if (!is_finite(b)) b = is_finite(a) ? a : Rgb(0);
            if (!state.compared()) a = b;
            pair.image.set_rgb(x, y, a);
            pair.reference.set_rgb(x, y, b);
            pair.compared.push_back(state.compared());
        }
    }
    return pair;
}

}  // namespace lucerna
