#include "engine/render/part_films.h"

#include <algorithm>
#include <cassert>

namespace lucerna {

PartFilms::PartFilms(int width, int height, const Film::Kind& kind, const LightGroups& groups,
                     Wanted wanted) {
    assert(wanted.any());
    if (wanted.parts) {
        for (std::size_t part = 0; part < kLightParts; ++part)
            names_.emplace_back(light_part_name(static_cast<LightPart>(part)));
        for (const std::string& name : groups.names) names_.push_back(kLightGroupPrefix + name);
    }
    films_.assign(names_.size() + (wanted.chance ? 1 : 0), Film(width, height, alone(kind)));
}

void PartFilms::add(int x, int y, const LightParts& sample, float weight, int half) {
    for (std::size_t i = 0; i < films_.size(); ++i) films_[i].add(x, y, value(sample, i), weight, half);
}

void PartFilms::add_pass(int x, int y, std::span<const LightParts> samples, std::span<const float> weights) {
    assert(samples.size() == weights.size());
    std::vector<Film::Sample> own(samples.size());
    for (std::size_t i = 0; i < films_.size(); ++i) {
        for (std::size_t s = 0; s < own.size(); ++s) own[s] = {value(samples[s], i), weights[s]};
        films_[i].add_pass(x, y, own);
    }
}

Image PartFilms::develop(float scale, const WorkingSpace& colours) const {
    std::vector<std::string> channels;
    for (const std::string& name : names_) {
        for (const char* channel : {".R", ".G", ".B", ".variance.R", ".variance.G", ".variance.B"})
            channels.push_back(name + channel);
    }
    Image all(films_.front().width(), films_.front().height(), channels);
    if (!colours.is_srgb()) all.space = &colours.space();
    for (std::size_t i = 0; i < names_.size(); ++i) {
        const Image one = films_[i].develop(scale, colours);
        const std::size_t width = one.channels.size(), pixels = one.data.size() / width;
        for (std::size_t p = 0; p < pixels; ++p) {
            std::copy_n(&one.data[width * p], width, &all.data[channels.size() * p + width * i]);
        }
    }
    return all;
}

std::optional<Image> PartFilms::develop_chance(float scale, const WorkingSpace& colours) const {
    if (films_.size() == names_.size()) return std::nullopt;
    return films_.back().develop(scale, colours);
}

std::size_t PartFilms::bytes_of_sums() const {
    return films_.size() * films_.front().bytes_of_sums();
}

std::vector<std::byte> PartFilms::sums() const {
    std::vector<std::byte> sums;
    sums.reserve(bytes_of_sums());
    for (const Film& film : films_) {
        const std::vector<std::byte> own = film.sums();
        sums.insert(sums.end(), own.begin(), own.end());
    }
    return sums;
}

void PartFilms::restore(std::span<const std::byte> sums) {
    assert(sums.size() == bytes_of_sums());
    for (Film& film : films_) {
        film.restore(sums.first(film.bytes_of_sums()));
        sums = sums.subspan(film.bytes_of_sums());
    }
}

std::size_t PartFilms::bytes_per_pixel(const Film::Kind& kind, const LightGroups& groups, Wanted wanted) {
    // Channels: of the developed image, and as they are added to the one that is written.
    constexpr std::size_t kChannels = 2 * 6 * sizeof(float);
    const std::size_t films =
        (wanted.parts ? kLightParts + groups.names.size() : 0) + (wanted.chance ? 1 : 0);
    return films * (Film::bytes_per_pixel(alone(kind)) + kChannels);
}

}  // namespace lucerna
