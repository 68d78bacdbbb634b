// lucerna relight: an image's light groups, dimmed and coloured, into an image, without rendering again.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "engine/base/colour_space.h"
#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/scene/light_parts.h"

namespace lucerna {
namespace {

constexpr const char* kRelightFooter =
    R"(IMAGE is an image written by lucerna render --layers of a scene whose lights name groups ("string lightgroup" of LightSource
and AreaLightSource). Light is additive, so a weighted sum of the groups is the image that a render with the lamps dimmed
and coloured in that way would give.

--group NAME=CHANGE multiplies a group; groups that are not named do not change. CHANGE is a factor, a colour, or both
separated by a comma. A colour is #rrggbb, sRGB as in a picture, or three factors for linear red, green and blue, r:g:b; it
filters the existing light like a gel in front of the lamp: #ffffff changes nothing.

The result has R, G and B, their variance as far as it is known, and the changed groups, so it can be relit again. Layers
that are no longer valid are left out: parts, halves and the denoised image. Without --exposure the picture has the exposure
of IMAGE, so dimmed light is darker.

Examples:
  lucerna render room.pbrt --spp 64 --layers -o room.exr
  lucerna relight room.exr --group spot=0.5 --group window=0 -o evening.exr --png
  lucerna relight room.exr --group spot=0.5,#ffd080 -o warm.exr --png
  lucerna relight room.exr --group spot=1.2:1:0.6 -o warmer.exr)";

const Location kOption{"--group"};

// Linear sRGB factors.
Rgb parse_colour(const std::string& word) {
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
        result.change.colour = parse_colour(change);
        return result;
    }
    result.change.factor = static_cast<float>(parse_number(kOption, change.substr(0, comma), 0, 1e6));
    if (comma != change.npos) result.change.colour = parse_colour(change.substr(comma + 1));
    return result;
}

struct RelightCommand {
    std::string image;
    ImageOutput output;
    std::vector<NamedChange> changes;
};

std::string layer_of(const std::string& group) {
    return kLightGroupPrefix + group;
}

// In the order of their channels.
std::vector<std::string> groups_of(const Image& image) {
    const std::string prefix = kLightGroupPrefix;
    std::vector<std::string> groups;
    for (const std::string& channel : image.channels) {
        if (!channel.starts_with(prefix) || !channel.ends_with(".R")) continue;
        const std::string name = channel.substr(prefix.size(), channel.size() - prefix.size() - 2);
        if (name.find('.') == name.npos) groups.push_back(name);
    }
    return groups;
}

// By group: what each is multiplied by, in the space of the layers.
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

// Variances of sums. Groups share their samples, so that their errors may go together in any way: the most
// that the sum's deviation can be is the sum of theirs. Where all are multiplied alike it is what the image
// knew.
Image relit(const Image& image, const std::vector<std::string>& groups, const std::vector<Rgb>& factors,
            const std::string& file) {
    constexpr const char* kColours[] = {"R", "G", "B"};
    std::vector<std::string> names{"R", "G", "B", "variance.R", "variance.G", "variance.B"};
    for (const std::string& group : groups) {
        for (const char* part : {".", ".variance."}) {
            for (const char* colour : kColours) names.push_back(layer_of(group) + part + colour);
        }
    }
    Image result(image.width, image.height, names);
    for (std::size_t c = 0; c < 3; ++c) {
        std::vector<std::size_t> values, variances;
        for (const std::string& group : groups) {
            values.push_back(channel_of(image, layer_of(group) + "." + kColours[c], file));
            variances.push_back(channel_of(image, layer_of(group) + ".variance." + kColours[c], file));
        }
        const auto factor = [&](std::size_t group) { return factors[group][static_cast<int>(c)]; };
        bool alike = true;
        for (std::size_t g = 1; g < groups.size(); ++g) alike = alike && factor(g) == factor(0);
        const auto known = alike ? find_channel(image, std::string("variance.") + kColours[c]) : std::nullopt;
        const std::size_t width = image.channels.size(), pixels = image.data.size() / width;
        for (std::size_t p = 0; p < pixels; ++p) {
            const float* const from = &image.data[width * p];
            float* const to = &result.data[names.size() * p];
            double sum = 0, deviation = 0;
            for (std::size_t g = 0; g < groups.size(); ++g) {
                const double k{factor(g)};
                const double value = k * double{from[values[g]]},
                             variance = k * k * double{from[variances[g]]};
                sum += value;
                deviation += std::sqrt(variance);
                to[6 + 6 * g + c] = static_cast<float>(value);
                to[6 + 6 * g + 3 + c] = static_cast<float>(variance);
            }
            to[c] = static_cast<float>(sum);
            to[3 + c] = known ? factor(0) * factor(0) * from[*known] : static_cast<float>(sqr(deviation));
        }
    }
    return result;
}

void act(const RelightCommand& command, const CommandContext& context) {
    require_readable(command.image);
    CommandFiles files;
    files.reads(command.image);
    declare(command.output, files);

    const Image image = read_exr(command.image);
    const ColourSpace* const space = space_of_layers(image);
    const std::vector<std::string> groups = groups_of(image);
    Image result = relit(image, groups, factors_of(groups, command, space), command.image);
    describe_alike(result, image);
    result.space = space;
    result.attributes.erase("lucerna.broughtfrom");
    // Exposed as the image was, so that what is dimmed is darker.
    command.output.write(result, fmt::format("light groups {}", fmt::join(groups, ", ")), result, image,
                         context);
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
