#include "engine/render/layer_films.h"

#include <algorithm>
#include <cassert>

#include "engine/denoise/denoise.h"

namespace lucerna {

LayerFilms::LayerFilms(int width, int height, const Film::Kind& kind, const LightGroups& groups,
                       Wanted wanted) {
    assert(wanted.any());
    const auto name_groups = [&groups](std::vector<std::string>& names) {
        for (const std::string& name : groups.names) names.push_back(kLightGroupPrefix + name + '.');
    };
    if (wanted.parts) {
        for (std::size_t part = 0; part < kLayers; ++part)
            names_.push_back(std::string(layer_name(static_cast<Layer>(part))) + '.');
        name_groups(names_);
    }
    if (wanted.chance) chance_.emplace_back();
    if (wanted.chance && wanted.parts) name_groups(chance_);
    const std::size_t count = films_of(groups, wanted);
    films_.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
        films_.emplace_back(width, height, is_group(i) ? of_group(kind) : alone(kind));
}

std::size_t LayerFilms::films_of(const LightGroups& groups, Wanted wanted) {
    const std::size_t by_group = groups.names.size();
    return (wanted.parts ? kLayers + by_group : 0) + (wanted.chance ? 1 + (wanted.parts ? by_group : 0) : 0);
}

void LayerFilms::add(int x, int y, const SampleAccount& sample, float weight, int half) {
    for (std::size_t i = 0; i < films_.size(); ++i)
        films_[i].add(x, y, value(sample, i), weight, films_[i].has_two_halves() ? half : 0);
}

void LayerFilms::add_pass(int x, int y, std::span<const SampleAccount> samples,
                          std::span<const float> weights, int half) {
    assert(samples.size() == weights.size());
    std::vector<Film::Sample> own(samples.size());
    for (std::size_t i = 0; i < films_.size(); ++i) {
        for (std::size_t s = 0; s < own.size(); ++s) own[s] = {value(samples[s], i), weights[s]};
        films_[i].add_pass(x, y, own, films_[i].has_two_halves() ? half : 0);
    }
}

Image LayerFilms::develop_films(std::size_t first, std::span<const std::string> names, float scale,
                                const WorkingSpace& colours, const Workers& workers) const {
    std::vector<std::string> channels;
    for (const std::string& name : names) {
        for (const char* channel : {"R", "G", "B", "variance.R", "variance.G", "variance.B"})
            channels.push_back(name + channel);
    }
    Image all(films_.front().width(), films_.front().height(), channels);
    if (!colours.is_srgb()) all.space = &colours.space();
    for (std::size_t i = 0; i < names.size(); ++i) {
        const Image one = films_[first + i].develop(scale, colours, workers);
        const std::size_t width = one.channels.size();
        parallel_chunks(workers.alone(), all.height, [&](std::int64_t row) {
            const auto y = static_cast<int>(row);
            const float* from = &one.data[one.index(0, y)];
            float* to = &all.data[all.index(0, y) + width * i];
            for (int x = 0; x < all.width; ++x, from += width, to += channels.size())
                std::copy_n(from, width, to);
        });
    }
    return all;
}

Image LayerFilms::develop(float scale, const WorkingSpace& colours, const Workers& workers) const {
    Image all = develop_films(0, names_, scale, colours, workers);
    for (std::size_t i = 0; i < names_.size(); ++i) {
        if (!is_group(i) || !films_[i].has_two_halves()) continue;
        for (std::size_t half = 0; half < 2; ++half) {
            add_channels(all, films_[i].develop_half(static_cast<int>(half), scale, colours, workers),
                         kHalfNames[half] + names_[i]);
        }
    }
    return all;
}

std::optional<Image> LayerFilms::develop_chance(float scale, const WorkingSpace& colours,
                                                const Workers& workers) const {
    if (chance_.empty()) return std::nullopt;
    return develop_films(names_.size(), chance_, scale, colours, workers);
}

std::size_t LayerFilms::bytes_of_sums() const {
    std::size_t sum = 0;
    for (const Film& film : films_) sum += film.bytes_of_sums();
    return sum;
}

std::vector<std::byte> LayerFilms::sums() const {
    std::vector<std::byte> sums;
    sums.reserve(bytes_of_sums());
    for (const Film& film : films_) {
        const std::vector<std::byte> own = film.sums();
        sums.insert(sums.end(), own.begin(), own.end());
    }
    return sums;
}

void LayerFilms::restore(std::span<const std::byte> sums) {
    assert(sums.size() == bytes_of_sums());
    for (Film& film : films_) {
        film.restore(sums.first(film.bytes_of_sums()));
        sums = sums.subspan(film.bytes_of_sums());
    }
}

std::size_t LayerFilms::bytes_per_pixel(const Film::Kind& kind, const LightGroups& groups, Wanted wanted) {
    // Channels of the developed image, and their copies in the image that is written. A group in halves also
    // has the channels of both halves and of the denoised light.
    constexpr std::size_t kChannels = 2 * 6 * sizeof(float);
    const std::size_t by_group = wanted.parts ? groups.names.size() : 0;
    const std::size_t halves = kind.two_halves ? 2 * (2 * kHalfChannels + 3) * sizeof(float) : 0;
    return (films_of(groups, wanted) - by_group) * (Film::bytes_per_pixel(alone(kind)) + kChannels) +
           by_group * (Film::bytes_per_pixel(of_group(kind)) + kChannels + halves);
}

}  // namespace lucerna
