#include "engine/evaluation/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/base/elementary.h"
#include "engine/colour/tone.h"
#include "engine/evaluation/compare.h"
#include "engine/evaluation/error_pictures.h"
#include "engine/image/displayed.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

std::string unit_of(const Image& image) {
    const auto found = image.attributes.find("lucerna.unit");
    return found == image.attributes.end() ? std::string() : one_line(found->second);
}

// Adds the FLIP map of one of `count` images.
void add_map(std::optional<FlipNumbers>& numbers, const Image& map, const std::vector<bool>& compared,
             std::size_t count) {
    if (!numbers) numbers = FlipNumbers{0, 0, {}, Image(map.width, map.height, map.channels)};
    double sum = 0;
    std::size_t pixels = 0;
    for (std::size_t i = 0; i < map.data.size(); ++i) {
        numbers->map.data[i] += map.data[i] / static_cast<float>(count);
        if (!compared[i]) continue;
        sum += double{map.data[i]};
        ++pixels;
        numbers->largest = std::max(numbers->largest, double{map.data[i]});
    }
    const double mean = pixels > 0 ? sum / static_cast<double>(pixels) : 0;
    numbers->each.push_back(mean);
    numbers->mean += mean / static_cast<double>(count);
}

class Comparing {
  public:
    Comparing(const std::vector<NamedImage>& images, const NamedImage& reference,
              const ComparisonSettings& settings, Monitor& monitor)
        : images_(images), reference_(reference), settings_(settings), monitor_(monitor) {}

    ComparisonReport run() {
        compare_numbers();
        find_pictures();
        if (settings_.flip && !too_large_for_flip()) find_flip();
        return std::move(report_);
    }

  private:
    void compare_numbers() {
        report_.reference = reference_.name;
        report_.unit = unit_of(images_[0].image);
        report_.reference_unit = unit_of(reference_.image);
        double mse = 0, relative = 0, mape = 0, error2 = 0;
        for (const NamedImage& one : images_) {
            report_.numbers = compare(one.image, reference_.image, one.name, reference_.name,
                                      settings_.mask_above, settings_.z_cell);
            const Comparison& c = report_.numbers;
            report_.images.push_back({one.name, c.mse, c.relative_mse, c.mape, c.error});
            mse += c.mse, relative += c.relative_mse, mape += c.mape, error2 += sqr(c.error);
        }
        if (images_.size() == 1) return;
        report_.seeds = bias_and_noise(images_, reference_, settings_.mask_above);
        report_.numbers = compare(mean_image(images_), reference_.image, "the mean of the images",
                                  reference_.name, settings_.mask_above, settings_.z_cell);
        const double n = static_cast<double>(images_.size());
        report_.numbers.mse = mse / n;
        report_.numbers.relative_mse = relative / n;
        report_.numbers.mape = mape / n;
        report_.numbers.error = std::sqrt(error2 / n);
    }

    ComparablePair pair_of(const NamedImage& one) const {
        return comparable_pair(one.image, reference_.image, one.name, reference_.name, settings_.mask_above);
    }

    void find_pictures() {
        ComparedPictures& pictures = report_.pictures;
        ComparablePair first = pair_of(images_[0]);
        pictures.first = std::move(first.image);
        pictures.reference = std::move(first.reference);
        pictures.mean = images_.size() == 1 ? pictures.first : pair_of({"mean", mean_image(images_)}).image;
        pictures.error = relative_error(pictures.mean, pictures.reference);
        if (images_.size() > 1) pictures.noise = noise_picture(first.compared);
        report_.exposure =
            settings_.exposure ? exp2(*settings_.exposure) : double{auto_exposure(pictures.reference)};
    }

    // Returns the noise as a picture; pixels that are not compared in the first image stay black.
    Image noise_picture(const std::vector<bool>& compared) const {
        Image noise = noise_image(images_);
        for (std::size_t i = 0; i < compared.size(); ++i) {
            if (compared[i]) continue;
            for (std::size_t c = 0; c < noise.channels.size(); ++c)
                noise.data[i * noise.channels.size() + c] = 0;
        }
        const ComparablePair shown = comparable_pair(noise, reference_.image, "noise", reference_.name,
                                                     std::numeric_limits<double>::infinity());
        return relative_to(shown.image, report_.pictures.reference);
    }

    Image display(const Image& radiance) const {
        return displayed(radiance, {static_cast<float>(report_.exposure)});
    }

    // Tells whether FLIP, which needs some 150 bytes per pixel, would need too much memory.
    bool too_large_for_flip() {
        constexpr std::int64_t kMostPixels = std::int64_t{1} << 25;
        const Image& shown = report_.pictures.reference;
        if (std::int64_t{shown.width} * shown.height <= kMostPixels) return false;
        monitor_.warn(fmt::format("FLIP is left out: {} x {} pixels are more than the limit of {}",
                                  shown.width, shown.height, kMostPixels));
        return true;
    }

    void find_flip() {
        report_.pixels_per_degree = settings_.pixels_per_degree;
        report_.exposures = flip_exposures(report_.pictures.reference);
        const Image reference = display(report_.pictures.reference);
        for (const NamedImage& one : images_) {
            const ComparablePair pair = pair_of(one);
            add_map(
                report_.flip,
                lucerna::flip(display(pair.image), reference, settings_.pixels_per_degree, settings_.workers),
                pair.compared, images_.size());
            if (!report_.exposures) continue;
            add_map(report_.hdr_flip,
                    lucerna::hdr_flip(pair.image, pair.reference, *report_.exposures,
                                      settings_.pixels_per_degree, settings_.workers, monitor_)
                        .map,
                    pair.compared, images_.size());
        }
    }

    const std::vector<NamedImage>& images_;
    const NamedImage& reference_;
    const ComparisonSettings& settings_;
    Monitor& monitor_;
    ComparisonReport report_;
};

}  // namespace

ComparisonReport compare_images(const std::vector<NamedImage>& images, const NamedImage& reference,
                                const ComparisonSettings& settings, Monitor& monitor) {
    return Comparing(images, reference, settings, monitor).run();
}

}  // namespace lucerna
