// The films of an image's layers and light groups (engine/scene/path_account.h): one each, with the same
// samples and weights as the image's own. A film is linear in what its samples bring, so that layers add up
// to the image, and so do groups. Groups are of two halves where the image is, so that each can be denoised,
// and so can whatever is relit of them.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/image/image.h"
#include "engine/render/film.h"
#include "engine/scene/path_account.h"

namespace lucerna {

class LayerFilms {
  public:
    // Which are wanted: parts and groups, what chance finds, or both.
    struct Wanted {
        bool parts = false, chance = false;
        bool any() const { return parts || chance; }
    };
    // `kind`: the image's own film's. `groups` outlive the films. At least one is wanted.
    LayerFilms(int width, int height, const Film::Kind& kind, const LightGroups& groups, Wanted wanted);

    // A sample, as Film::add() has it.
    void add(int x, int y, const SampleAccount& sample, float weight, int half = 0);
    // Adds the samples of one pass through a pixel, like Film::add_pass().
    void add_pass(int x, int y, std::span<const SampleAccount> samples, std::span<const float> weights,
                  int half = 0);

    // Channels NAME.R .G .B and NAME.variance.R .G .B of each, as Film::develop() makes them: the parts by
    // layer_name(), the groups as lightgroup.NAME, and groups in two halves also as first.lightgroup.NAME
    // and second.lightgroup.NAME, as Film::develop_half() makes them.
    Image develop(float scale, const WorkingSpace& colours) const;
    // SampleAccount::by_chance, if wanted: channels R .G .B, variance.R .G .B; and where parts are wanted,
    // too, the same for each group behind lightgroup.NAME.
    std::optional<Image> develop_chance(float scale, const WorkingSpace& colours) const;

    // As Film's, of all of them.
    std::vector<std::byte> sums() const;
    std::size_t bytes_of_sums() const;
    void restore(std::span<const std::byte> sums);
    template <typename Archive>
    void fields_of(const V2i& begin, const V2i& end, Archive& archive) {
        for (Film& film : films_) film.fields_of(begin, end, archive);
    }

    // With their share of what develop() makes.
    static std::size_t bytes_per_pixel(const Film::Kind& kind, const LightGroups& groups, Wanted wanted);

  private:
    // Halves of all but groups are the image's own concern, unless it is their mean.
    static Film::Kind alone(Film::Kind kind) {
        kind.two_halves = kind.allocated;
        return of_group(kind);
    }
    // The image alone states the blur.
    static Film::Kind of_group(Film::Kind kind) {
        kind.tells_blur = false;
        return kind;
    }
    bool is_group(std::size_t film) const { return film >= kLayers && film < names_.size(); }
    const Rgb& value(const SampleAccount& sample, std::size_t film) const {
        if (film == names_.size()) return sample.by_chance;
        if (film > names_.size()) return sample.groups_by_chance[film - names_.size() - 1];
        return film < kLayers ? sample.layers[film] : sample.groups[film - kLayers];
    }

    // Channels R, G, B and their variances of the films [first, first + names), each behind its name.
    Image develop_films(std::size_t first, std::span<const std::string> names, float scale,
                        const WorkingSpace& colours) const;
    static std::size_t films_of(const LightGroups& groups, Wanted wanted);

    std::vector<std::string> names_;   // of parts, then of groups
    std::vector<std::string> chance_;  // of what chance finds: of all, then of groups
    std::vector<Film> films_;          // of names_, then of chance_
};

}  // namespace lucerna
