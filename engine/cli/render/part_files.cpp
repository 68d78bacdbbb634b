#include "engine/cli/render/part_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <span>
#include <sstream>

#include "engine/base/error.h"
#include "engine/cli/render/checkpointing.h"
#include "engine/system/memory.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr const char *kPart = "lucerna.part", *kOf = "lucerna.parts", *kView = "lucerna.view",
                     *kFacts = "lucerna.picture", *kLayerList = "lucerna.layers";

std::string text_of(const Facts& facts) {
    std::string text;
    for (const auto& [name, value] : facts) text += plain_line(name) + '\t' + plain_line(value) + '\n';
    return text;
}

Facts facts_in(const std::string& text) {
    Facts facts;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) {
        const std::size_t tab = std::min(line.find('\t'), line.size());
        facts.emplace_back(line.substr(0, tab), line.substr(std::min(tab + 1, line.size())));
    }
    return facts;
}

struct Part {
    std::filesystem::path file;
    ImagePart which;
    PixelBox view;  // the region of the whole image that all parts cover together
    Facts facts;
    Image image;
};

const std::string& attribute(const Image& image, const char* name, const Location& at) {
    const auto found = image.attributes.find(name);
    if (found == image.attributes.end())
        throw InputError(at, "is not part of a picture; expected an image written by lucerna render --part");
    return found->second;
}

Part read_part(const std::filesystem::path& file) {
    const Location at{file.string()};
    Part part{file, {}, {}, {}, read_exr_as_stated(file)};
    const auto number = [&](const char* name, std::int64_t least, std::int64_t most) {
        return static_cast<int>(parse_whole(at, attribute(part.image, name, at), least, most));
    };
    part.which.of = number(kOf, 1, 1 << 20);
    part.which.number = number(kPart, 1, part.which.of);
    std::istringstream view(attribute(part.image, kView, at));
    view >> part.view.begin.x >> part.view.begin.y >> part.view.end.x >> part.view.end.y;
    part.facts = facts_in(attribute(part.image, kFacts, at));
    const bool there = view && part.view.begin.x >= 0 && part.view.begin.y >= 0 &&
                       part.view.begin.x < part.view.end.x && part.view.begin.y < part.view.end.y;
    const V2i size(part.image.width, part.image.height);
    if (!there || box_of(part.which, part.view) != PixelBox{part.image.corner, part.image.corner + size}) {
        input_error(at, "the part is damaged: {} x {} pixels at ({}, {}) are not part {} of {}", size.x,
                    size.y, part.image.corner.x, part.image.corner.y, part.which.number, part.which.of);
    }
    if (const auto stopped = part.image.attributes.find("lucerna.stopped");
        stopped != part.image.attributes.end())
        input_error(at, "the part is incomplete: it was stopped after {}", stopped->second);
    return part;
}

// Throws InputError if parts differ in layers; it names the command's options, which say more than the fact.
void require_same_layers(const Part& first, const Part& other, const FactDifference& difference,
                         std::string_view fact, std::string_view options) {
    if (difference.name != fact) return;
    const bool other_has = difference.of_first != kNoLayers;
    const Part& with = other_has ? other : first;
    const Part& without = other_has ? first : other;
    throw InputError(fmt::format("{} was rendered with {}, {} was not", with.file.string(), options,
                                 without.file.string()));
}

void require_same_picture(const Part& first, const Part& other) {
    const Location at{other.file.string()};
    if (const auto difference = first_difference(other.facts, first.facts)) {
        require_same_layers(first, other, *difference, kHalvesFact, "--denoise or --layers");
        require_same_layers(first, other, *difference, kPartsFact, "--layers");
        input_error(at, "is part of a different picture: its {} is {}, in {} it is {}", difference->name,
                    difference->of_first, first.file.string(), difference->of_second);
    }
    if (other.which.of != first.which.of) {
        input_error(at, "is one of {} parts, {} is one of {}", other.which.of, first.file.string(),
                    first.which.of);
    }
    if (other.view != first.view || other.image.channels != first.image.channels ||
        other.image.space != first.image.space) {
        input_error(at, "the part is damaged: its channels or its view differ from those of {}",
                    first.file.string());
    }
}

// Lists the first of the numbers.
std::string listed(std::span<const int> numbers) {
    constexpr std::size_t kShown = 20;
    const auto shown = numbers.first(std::min(numbers.size(), kShown));
    return fmt::format("{}{}", fmt::join(shown, ", "), numbers.size() > kShown ? ", ..." : "");
}

}  // namespace

std::map<std::string, std::string> part_attributes(const ImagePart& part, const Job& job, std::uint64_t seed,
                                                   bool layers, const LayerNames& chosen) {
    const FilmSettings& film = job.film;
    Facts facts = whole_picture_facts(job, seed);
    facts.emplace_back("number of samples", fmt::format("{}", job.spp));
    return {{kPart, fmt::format("{}", part.number)},
            {kOf, fmt::format("{}", part.of)},
            {kView, fmt::format("{} {} {} {}", film.view_begin.x, film.view_begin.y, film.view_end.x,
                                film.view_end.y)},
            {kFacts, text_of(facts)},
            {kLayerList, layers ? fmt::format("kept {}", fmt::join(chosen, ",")) : ""}};
}

MergedParts merge_parts(const std::vector<std::filesystem::path>& files) {
    MergedParts merged;
    std::optional<Part> first;
    std::map<int, std::filesystem::path> there;
    for (const std::filesystem::path& file : files) {
        Part part = read_part(file);
        Image& to = merged.image;
        if (!first) {
            const V2i size = part.view.size();
            require_memory(bytes_of(static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y),
                                    part.image.channels.size() * sizeof(float)),
                           fmt::format("a picture of {} x {} pixels", size.x, size.y), "use fewer pixels");
            to = Image(size.x, size.y, part.image.channels);
            to.space = part.image.space;
            to.attributes = part.image.attributes;
            constexpr std::string_view kept = "kept ";
            const std::string& names = to.attributes[kLayerList];
            merged.keeps_layers = names.starts_with(kept);
            if (merged.keeps_layers) merged.chosen = parse_layers(names.substr(kept.size()));
            for (const char* name : {kPart, kOf, kView, kFacts, kLayerList}) to.attributes.erase(name);
            if (size != part.image.picture) to.corner = part.view.begin, to.picture = part.image.picture;
        } else {
            require_same_picture(*first, part);
        }
        const auto [before, is_new] = there.emplace(part.which.number, file);
        if (!is_new) {
            throw InputError(fmt::format("part {} of {} is given twice: {} and {}", part.which.number,
                                         part.which.of, before->second.string(), file.string()));
        }
        const V2i at = part.image.corner - part.view.begin;
        const std::size_t row = static_cast<std::size_t>(part.image.width) * to.channels.size();
        for (int y = 0; y < part.image.height; ++y)
            std::copy_n(&part.image.data[part.image.index(0, y)], row, &to.data[to.index(at.x, at.y + y)]);
        if (!first) first = std::move(part);
    }
    std::vector<int> missing;
    for (int number = 1; number <= first->which.of; ++number) {
        if (!there.contains(number)) missing.push_back(number);
    }
    if (!missing.empty()) {
        throw InputError(
            fmt::format("{} of {} parts are missing: {}", missing.size(), first->which.of, listed(missing)));
    }
    return merged;
}

}  // namespace lucerna
