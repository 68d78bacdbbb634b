#include "engine/cli/image/image_layers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

#include "engine/denoise/denoise.h"
#include "engine/scene/path_account.h"

namespace lucerna {

std::string layer_of_group(const std::string& group) {
    return kLightGroupPrefix + group;
}

std::vector<std::string> light_groups_of(const Image& image) {
    const std::string prefix = kLightGroupPrefix;
    std::vector<std::string> groups;
    for (const std::string& channel : image.channels) {
        if (!channel.starts_with(prefix) || !channel.ends_with(".R")) continue;
        const std::string name = channel.substr(prefix.size(), channel.size() - prefix.size() - 2);
        if (name.find('.') == name.npos) groups.push_back(name);
    }
    return groups;
}

std::optional<Image> colours_of_layer(const Image& image, const std::string& layer) {
    std::vector<std::size_t> from;
    for (const char* colour : {".R", ".G", ".B"}) {
        const auto channel = find_channel(image, layer + colour);
        if (!channel) return std::nullopt;
        from.push_back(*channel);
    }
    Image colours = Image::rgb(image.width, image.height);
    describe_alike(colours, image);
    colours.space = image.space;
    const std::size_t width = image.channels.size(), pixels = image.data.size() / width;
    for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t c = 0; c < 3; ++c) colours.data[3 * p + c] = image.data[width * p + from[c]];
    }
    return colours;
}

void add_denoised_groups(Image& image, const LayerNames& chosen, const std::string& file,
                         const Workers& workers) {
    const std::string prefix = std::string("denoised.") + kLightGroupPrefix;
    const bool wanted = chosen.empty() || std::ranges::any_of(chosen, [&](const std::string& layer) {
                            return layer == "denoised" || layer.starts_with(prefix);
                        });
    if (!wanted) return;
    for (const std::string& group : light_groups_of(image)) {
        const std::string layer = layer_of_group(group) + ".";
        if (!find_channel(image, kHalfNames[0] + layer + "R")) continue;
        add_channels(image, denoise(denoiser_input_of(image, file, layer), workers).image,
                     "denoised." + layer);
    }
}

LayerNames parse_layers(const std::string& words) {
    LayerNames names;
    for (std::size_t begin = 0; begin < words.size();) {
        const std::size_t end = std::min(words.find_first_of(",\n", begin), words.size());
        std::string name = words.substr(begin, end - begin);
        if (!name.empty() && name != "true") names.push_back(std::move(name));
        begin = end + 1;
    }
    return names;
}

std::vector<std::string> layers_of_job(const Job& job) {
    std::vector<std::string> names{"denoised", "first", "second"};
    for (std::size_t part = 0; part < kLayers; ++part)
        names.emplace_back(layer_name(static_cast<Layer>(part)));
    const std::vector<std::string>& groups = job.scene.light_groups().names;
    if (!groups.empty()) names.emplace_back("lightgroup");
    for (const std::string& group : groups) {
        names.push_back(layer_of_group(group));
        names.push_back("denoised." + layer_of_group(group));
    }
    for (const std::string& channel : feature_channels()) {
        const std::string layer = channel.substr(0, channel.find('.'));
        if (std::ranges::find(names, layer) == names.end()) names.push_back(layer);
    }
    names.insert(names.end(), {"Nc", "id"});
    return names;
}

void require_layers(const Location& at, const LayerNames& chosen, const Job& job) {
    const std::vector<std::string> names = layers_of_job(job);
    for (const std::string& name : chosen) {
        if (std::ranges::find(names, name) != names.end()) continue;
        const std::vector<std::string_view> known(names.begin(), names.end());
        input_error(at, "there is no layer \"{}\"; {}the layers are {}", one_line(name),
                    did_you_mean(name, known), fmt::join(names, ", "));
    }
}

void keep_layers(Image& image, const LayerNames& chosen) {
    if (chosen.empty()) return;
    const auto is_of = [](const std::string& channel, const std::string& layer) {
        return channel == layer || channel == "variance." + layer || channel.starts_with(layer + ".");
    };
    image = with_channels(image, [&](const std::string& channel) {
        for (const char* colour : {"R", "G", "B"}) {
            if (is_of(channel, colour)) return true;
        }
        return std::ranges::any_of(chosen, [&](const std::string& layer) { return is_of(channel, layer); });
    });
}

}  // namespace lucerna
