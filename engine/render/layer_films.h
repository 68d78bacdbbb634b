// The films of an image's layers and light groups (engine/scene/path_account.h): one for each, with the same
// samples and weights as the image's own. A film is linear in its samples, so the layers sum to the image,
// and so do the groups. Groups have two halves if the image has, so that each group, and any relit sum of
// groups, can be denoised.
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
    // Selects films: layers and groups (`parts`), light met by chance, or both.
    struct Wanted {
        bool parts = false, chance = false;
        bool any() const { return parts || chance; }
    };
    // `kind` is that of the image's own film. `groups` must outlive the films. At least one kind of film must
    // be wanted.
    LayerFilms(int width, int height, const Film::Kind& kind, const LightGroups& groups, Wanted wanted);

    // Adds a sample, like Film::add().
    void add(int x, int y, const SampleAccount& sample, float weight, int half = 0);
    // Adds the samples of one pass through a pixel, like Film::add_pass().
    void add_pass(int x, int y, std::span<const SampleAccount> samples, std::span<const float> weights,
                  int half = 0);

    // Makes channels NAME.R .G .B and NAME.variance.R .G .B of each film, like Film::develop(): layers by
    // layer_name(), groups as lightgroup.NAME, and groups in two halves also as first.lightgroup.NAME and
    // second.lightgroup.NAME, like Film::develop_half().
    Image develop(float scale, const WorkingSpace& colours, const Workers& workers) const;
    // Develops SampleAccount::by_chance, if wanted: channels R .G .B, variance.R .G .B, and if layers are
    // wanted, too, those of each group behind lightgroup.NAME.
    std::optional<Image> develop_chance(float scale, const WorkingSpace& colours,
                                        const Workers& workers) const;

    // Do what those of Film do, for all films.
    std::vector<std::byte> sums() const;
    std::size_t bytes_of_sums() const;
    void restore(std::span<const std::byte> sums);
    template <typename Archive>
    void fields_of(const V2i& begin, const V2i& end, Archive& archive) {
        for (Film& film : films_) film.fields_of(begin, end, archive);
    }

    // Returns the bytes per pixel of the films and of the image of develop().
    static std::size_t bytes_per_pixel(const Film::Kind& kind, const LightGroups& groups, Wanted wanted);

  private:
    // Only the image and its groups need halves, unless the image is the mean of its halves.
    static Film::Kind alone(Film::Kind kind) {
        kind.two_halves = kind.allocated;
        return of_group(kind);
    }
    // Only the image's own film measures blur.
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

    // Makes channels R, G, B and their variances of the films [first, first + names), each prefixed by its
    // name.
    Image develop_films(std::size_t first, std::span<const std::string> names, float scale,
                        const WorkingSpace& colours, const Workers& workers) const;
    static std::size_t films_of(const LightGroups& groups, Wanted wanted);

    std::vector<std::string> names_;   // of layers, then of groups
    std::vector<std::string> chance_;  // of light met by chance: in total, then by group
    std::vector<Film> films_;          // of names_, then of chance_
};

}  // namespace lucerna
