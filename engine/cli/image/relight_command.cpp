// lucerna relight: dims and colours an image's light groups without rendering again.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include "engine/base/error.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/image/image_layers.h"
#include "engine/colour/colour_space.h"
#include "engine/denoise/denoise.h"
#include "engine/image/image.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr const char* kRelightFooter =
    R"(IMAGE is an image written by lucerna render --layers of a scene whose lights name groups ("string lightgroup" of LightSource
and AreaLightSource). Light is additive, so a weighted sum of the groups is the image that a render with the lamps dimmed
and coloured in that way would give.

--group NAME=CHANGE multiplies a group; groups that are not named do not change. CHANGE is a factor, a colour, or both
separated by a comma. A colour is #rrggbb, sRGB as in a picture, or three factors for linear red, green and blue, r:g:b; it
filters the existing light like a gel in front of the lamp: #ffffff changes nothing.

The result has R, G and B, their variance as far as it is known, and the changed groups, so it can be relit again. If IMAGE
has denoised groups (denoised.lightgroup.NAME, as --layers writes them), the result has them, too, and their sum as denoised
image, which the picture shows. If IMAGE has the halves of the groups, the result has halves and features, so that lucerna
denoise can denoise it as a whole. Parts of the light are no longer valid and are left out. Without --exposure the picture
has the exposure of IMAGE, so dimmed light is darker.

Examples:
  lucerna render room.pbrt --spp 64 --layers -o room.exr
  lucerna relight room.exr --group spot=0.5 --group window=0 -o evening.exr --png
  lucerna relight room.exr --group spot=0.5,#ffd080 -o warm.exr --png
  lucerna relight room.exr --group spot=1.2:1:0.6 -o warmer.exr)";

const Location kOption{"--group"};

// Parses linear sRGB factors.
Rgb parse_colour_change(const std::string& word) {
    if (word.starts_with('#')) {
        Rgb colour;
        const bool whole =
            word.size() == 7 && word.find_first_not_of("0123456789abcdefABCDEF", 1) == word.npos;
        if (!whole)
            throw InputError(kOption,
                             fmt::format("colour \"{}\": expected # and six hexadecimal digits", word));
        for (int c = 0; c < 3; ++c) {
            const auto level = std::stoul(word.substr(static_cast<std::size_t>(1 + 2 * c), 2), nullptr, 16);
            colour[c] = srgb_decoded(static_cast<float>(level) / 255);
        }
        return colour;
    }
    const std::size_t first = word.find(':'), second = first == word.npos ? first : word.find(':', first + 1);
    if (second == word.npos)
        throw InputError(kOption,
                         fmt::format("colour \"{}\": expected #rrggbb, or r:g:b such as 1:0.8:0.6", word));
    const auto component = [](const std::string& text) {
        return static_cast<float>(parse_number(kOption, text, 0, 1e6));
    };
    return {component(word.substr(0, first)), component(word.substr(first + 1, second - first - 1)),
            component(word.substr(second + 1))};
}

struct Change {
    float factor = 1;
    Rgb colour{1.0F};  // linear sRGB
};

struct NamedChange {
    std::string group;
    Change change;
};

NamedChange parse_change(const std::string& word) {
    const std::size_t equals = word.find('=');
    if (equals == word.npos || equals == 0 || equals + 1 == word.size()) {
        throw InputError(
            kOption,
            fmt::format("\"{}\": expected NAME=CHANGE, for example spot=0.5 or spot=0.5,#ffd080", word));
    }
    NamedChange result{word.substr(0, equals), {}};
    const std::string change = word.substr(equals + 1);
    const std::size_t comma = change.find(',');
    const auto is_colour = [](const std::string& text) { return text.find_first_of("#:") != text.npos; };
    if (comma == change.npos && is_colour(change)) {
        result.change.colour = parse_colour_change(change);
        return result;
    }
    result.change.factor = static_cast<float>(parse_number(kOption, change.substr(0, comma), 0, 1e6));
    if (comma != change.npos) result.change.colour = parse_colour_change(change.substr(comma + 1));
    return result;
}

struct RelightCommand {
    std::string image;
    ImageOutput output;
    std::vector<NamedChange> changes;
};

// Returns the factor of each group, in the colour space of the layers.
std::vector<Rgb> factors_of(const std::vector<std::string>& groups, const RelightCommand& command,
                            const ColourSpace* space) {
    if (groups.empty()) {
        throw InputError({command.image},
                         "has no light groups; expected an image that lucerna render --layers wrote of a "
                         "scene whose lights have \"string lightgroup\"");
    }
    std::vector<Rgb> factors(groups.size(), Rgb(1));
    std::set<std::string> changed;
    for (const auto& [name, change] : command.changes) {
        const auto found = std::ranges::find(groups, name);
        if (found == groups.end()) {
            throw InputError({command.image}, fmt::format("has no light group \"{}\"; its groups are {}",
                                                          name, fmt::join(groups, ", ")));
        }
        if (!changed.insert(name).second)
            throw InputError(kOption, fmt::format("group \"{}\" is given twice", name));
        Rgb colour = change.colour;
        if (space) {
            const V3d in_space = conversion(colour_spaces()[0], *space) * V3d(colour);
            for (int c = 0; c < 3; ++c) colour[c] = std::max(0.0F, static_cast<float>(in_space[c]));
        }
        factors[static_cast<std::size_t>(found - groups.begin())] = change.factor * colour;
    }
    return factors;
}

std::size_t channel_of(const Image& image, const std::string& name, const std::string& file) {
    const auto channel = find_channel(image, name);
    if (!channel) throw InputError({file}, "has no channel " + name + ", which belongs to its light groups");
    return *channel;
}

// A sum over the groups, with channels under `prefix`, and those of each group under prefix and layer.
struct Summed {
    std::string prefix;
    bool has_variance;
};

// Returns the name of a channel of the sum, or of its variance.
std::string channel_name(const Summed& summed, const std::string& layer, bool variance, int colour) {
    return summed.prefix + layer + (variance ? "variance." : "") + "RGB"[colour];
}

// Adds the sums over the groups and the groups themselves, each multiplied by its factor.
//
// Groups share their samples, so their errors may be correlated in any way, and the standard deviation of the
// sum is at most the sum of theirs. If all factors are equal, the image has the exact sum.
void add_sums(const Image& image, const std::vector<std::string>& groups, const std::vector<Rgb>& factors,
              const Summed& summed, const std::string& file, Image& result) {
    std::vector<std::string> names;
    for (const bool variance : {false, true}) {
        for (int c = 0; c < 3 && (!variance || summed.has_variance); ++c)
            names.push_back(channel_name(summed, "", variance, c));
    }
    const std::size_t of_one = names.size();
    for (const std::string& group : groups) {
        for (std::size_t i = 0; i < of_one; ++i)
            names.push_back(
                channel_name(summed, layer_of_group(group) + ".", i >= 3, static_cast<int>(i % 3)));
    }
    Image sums(image.width, image.height, names);
    for (std::size_t c = 0; c < 3; ++c) {
        std::vector<std::size_t> values, variances;
        bool alike = true;
        for (std::size_t g = 0; g < groups.size(); ++g) {
            values.push_back(channel_of(image, names[of_one * (g + 1) + c], file));
            if (summed.has_variance)
                variances.push_back(channel_of(image, names[of_one * (g + 1) + 3 + c], file));
            alike = alike && factors[g][static_cast<int>(c)] == factors[0][static_cast<int>(c)];
        }
        const float common = factors[0][static_cast<int>(c)];
        // The denoised image is denoised as a whole and differs from the sum of the denoised groups.
        const auto known_sum = alike && !summed.has_variance ? find_channel(image, names[c]) : std::nullopt;
        const auto known_variance =
            alike && summed.has_variance ? find_channel(image, names[3 + c]) : std::nullopt;
        const std::size_t width = image.channels.size(), pixels = image.data.size() / width;
        for (std::size_t p = 0; p < pixels; ++p) {
            const float* const from = &image.data[width * p];
            float* const to = &sums.data[names.size() * p];
            double sum = 0, deviation = 0;
            for (std::size_t g = 0; g < groups.size(); ++g) {
                const double k{factors[g][static_cast<int>(c)]};
                const double value = k * double{from[values[g]]};
                sum += value;
                to[of_one * (g + 1) + c] = static_cast<float>(value);
                if (!summed.has_variance) continue;
                const double variance = k * k * double{from[variances[g]]};
                deviation += std::sqrt(variance);
                to[of_one * (g + 1) + 3 + c] = static_cast<float>(variance);
            }
            to[c] = known_sum ? common * from[*known_sum] : static_cast<float>(sum);
            if (summed.has_variance)
                to[3 + c] = known_variance ? common * common * from[*known_variance]
                                           : static_cast<float>(sqr(deviation));
        }
    }
    if (result.channels.empty()) {
        result = std::move(sums);
    } else {
        add_channels(result, sums, "");
    }
}

// Tells whether the image has the sum's .R channels for all groups.
bool has_all(const Image& image, const std::vector<std::string>& groups, const std::string& prefix) {
    return std::ranges::all_of(groups, [&](const std::string& group) {
        return find_channel(image, prefix + layer_of_group(group) + ".R").has_value();
    });
}

Image relit(const Image& image, const std::vector<std::string>& groups, const std::vector<Rgb>& factors,
            const std::string& file) {
    Image result;
    add_sums(image, groups, factors, {"", true}, file, result);
    if (has_all(image, groups, "denoised."))
        add_sums(image, groups, factors, {"denoised.", false}, file, result);
    if (!has_all(image, groups, kHalfNames[0]) || !find_channel(image, feature_channels().front()))
        return result;
    // lucerna denoise needs halves, their sample counts and features, which light does not change.
    for (const char* half : kHalfNames) add_sums(image, groups, factors, {half, true}, file, result);
    add_channels(result,
                 with_channels(image,
                               [](const std::string& channel) {
                                   return channel.ends_with(".samples") ||
                                          std::ranges::find(feature_channels(), channel) !=
                                              feature_channels().end();
                               }),
                 "");
    return result;
}

void act(const RelightCommand& command, const CommandContext& context) {
    require_readable(command.image);
    CommandFiles files;
    files.reads(command.image);
    declare(command.output, files);

    const Image image = read_exr(command.image);
    const ColourSpace* const space = space_of_layers(image);
    const std::vector<std::string> groups = light_groups_of(image);
    Image result = relit(image, groups, factors_of(groups, command, space), command.image);
    describe_alike(result, image);
    result.space = space;
    result.attributes.erase("lucerna.broughtfrom");
    // Keeps the exposure of the original image, so that dimmed light is darker.
    const std::optional<Image> denoised = colours_of_layer(result, "denoised"),
                               before = colours_of_layer(image, "denoised");
    command.output.write(
        result, fmt::format("light groups {}{}", fmt::join(groups, ", "), denoised ? ", denoised" : ""),
        denoised ? *denoised : result, denoised && before ? *before : image, context);
}

}  // namespace

void add_relight_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<RelightCommand>();
    CLI::App& app =
        *program.add_subcommand("relight", "Dim and colour an image's light groups, without rendering again");
    app.footer(kRelightFooter);
    app.add_option("IMAGE", command->image, "OpenEXR image with light groups")
        ->required()
        ->type_name("IMAGE.exr");
    app.add_option_function<std::vector<std::string>>(
           "--group",
           [command](const std::vector<std::string>& words) {
               for (const std::string& word : words) command->changes.push_back(parse_change(word));
           },
           "multiply a group by a factor, a colour, or both; may be repeated")
        ->type_name("NAME=CHANGE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_image_output(app, command->output, "the relit OpenEXR image");
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
