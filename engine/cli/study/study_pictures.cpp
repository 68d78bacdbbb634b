#include "engine/base/elementary.h"
#include "engine/cli/study/study_page.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/cli/page_parts.h"
#include "engine/colour/tone.h"
#include "engine/evaluation/compare.h"
#include "engine/evaluation/error_pictures.h"
#include "engine/evaluation/flip.h"
#include "engine/image/displayed.h"

namespace lucerna {
namespace {

// Estimates for incompressible noise: three bytes of mantissa, and exponents, of which eight in a row are
// often equal. Base64 uses four bytes for three.
constexpr double kRadianceBytes = 3.6 * 4 / 3, kMapBytes = 2.2 * 4 / 3;
constexpr double kPictureOverhead = 400;  // file headers

constexpr double kLargest = 2048.0 * 2048, kSmallest = 32.0 * 32, kSmallestBest = 64.0 * 64;

double pixels_under(const PictureLoad& scene, double cap) {
    const int factor = shrink_factor(scene.width, scene.height, cap);
    const auto across = [factor](int side) { return std::ceil(static_cast<double>(side) / factor); };
    return across(scene.width) * across(scene.height);
}

// Returns a display-referred picture, so that png_bytes() writes the codes unchanged.
Image coded(const Image& error, const Image& flip_map) {
    constexpr ErrorCode kCode;
    Image picture = Image::rgb(error.width, error.height);
    for (int y = 0; y < error.height; ++y) {
        for (int x = 0; x < error.width; ++x) {
            const float red = static_cast<float>(kCode.of(double{error.value(x, y, 0)})) / 255;
            picture.set_rgb(x, y, {red, std::clamp(flip_map.value(x, y, 0), 0.0F, 1.0F), 0});
        }
    }
    return picture;
}

template <typename Coded>
StudyPicture picture_of(int width, int height, double cap, Coded&& as_picture) {
    if (!(cap > 0)) return {};
    const int factor = shrink_factor(width, height, cap);
    return {data_url(as_picture(factor)), factor};
}

Image fitting(const Image& image, int factor) {
    return factor == 1 ? image : shrunk(image, factor);
}

class ScenePictureWriter {
  public:
    ScenePictureWriter(const StudyScene& scene, const std::filesystem::path& reference,
                       const PictureCaps& caps, const Workers& workers)
        : scene_(scene), caps_(caps), workers_(workers), reference_(read_reference(reference, scene)) {
        const Image shown = comparable_pair(reference_.image, reference_.image, reference_.name,
                                            reference_.name, scene.mask_above)
                                .reference;
        // Rounds to quarters of a stop, the steps of the page's slider.
        pictures_.stops = std::round(4 * log2(double{auto_exposure(shown)})) / 4;
        exposure_ = static_cast<float>(exp2(pictures_.stops));
        pictures_.width = shown.width;
        pictures_.height = shown.height;
        pictures_.reference = radiance_of(shown, caps.best);
    }

    void add(StudyResult& result) {
        const ComparablePair pair =
            comparable_pair(read_exr(result.image), reference_.image, result.image.string(), reference_.name,
                            scene_.mask_above);
        const Image flip_map = flip(displayed(pair.image, {exposure_}),
                                    displayed(pair.reference, {exposure_}), kUsualPixelsPerDegree, workers_);
        result.flip = mean_of(flip_map, pair.compared);
        const Image error = relative_error(pair.image, pair.reference);
        PointPictures both;
        both.radiance = radiance_of(pair.image, result.best ? caps_.best : caps_.rest);
        both.maps = picture_of(error.width, error.height, result.best ? caps_.maps : caps_.rest,
                               [&](int f) { return coded(fitting(error, f), fitting(flip_map, f)); });
        pictures_.points.push_back(std::move(both));
    }
    ScenePictures pictures() { return std::move(pictures_); }

  private:
    static StudyPicture radiance_of(const Image& image, double cap) {
        return picture_of(image.width, image.height, cap,
                          [&](int factor) { return radiance_picture(fitting(image, factor)); });
    }
    static double mean_of(const Image& map, const std::vector<bool>& compared) {
        double sum = 0, pixels = 0;
        for (std::size_t i = 0; i < compared.size(); ++i) {
            if (!compared[i]) continue;
            sum += double{map.data[i]};
            ++pixels;
        }
        return pixels > 0 ? sum / pixels : 0;
    }

    const StudyScene& scene_;
    const PictureCaps& caps_;
    const Workers& workers_;
    NamedImage reference_;
    float exposure_ = 1;
    ScenePictures pictures_;
};

std::vector<PictureLoad> loads_of(const StudyDescription& description,
                                  const std::vector<std::filesystem::path>& references,
                                  const std::vector<StudyResult>& results) {
    std::vector<PictureLoad> loads;
    for (std::size_t i = 0; i < references.size(); ++i) {
        const Image reference = read_exr(references[i]);
        PictureLoad load{reference.width, reference.height, 0, 0};
        for (const StudyResult& result : results) {
            if (result.scene == description.scenes[i].name) ++(result.best ? load.best : load.rest);
        }
        loads.push_back(load);
    }
    return loads;
}

}  // namespace

int shrink_factor(int width, int height, double cap) {
    const double pixels = static_cast<double>(width) * height;
    int factor = std::max(1, static_cast<int>(std::sqrt(pixels / cap)));
    const auto across = [&](int side) { return std::ceil(static_cast<double>(side) / factor); };
    while (factor < std::max(width, height) && across(width) * across(height) > cap) ++factor;
    return factor;
}

double most_bytes(const std::vector<PictureLoad>& scenes, const PictureCaps& caps) {
    double bytes = 0;
    for (const PictureLoad& scene : scenes) {
        const double best = static_cast<double>(scene.best), rest = static_cast<double>(scene.rest);
        bytes += (best + 1) * (kRadianceBytes * pixels_under(scene, caps.best) + kPictureOverhead);
        bytes += best * (kMapBytes * pixels_under(scene, caps.maps) + kPictureOverhead);
        if (caps.rest > 0) {
            const double each = (kRadianceBytes + kMapBytes) * pixels_under(scene, caps.rest);
            bytes += rest * (each + 2 * kPictureOverhead);
        }
    }
    return bytes;
}

PictureCaps picture_caps(const std::vector<PictureLoad>& scenes, double budget) {
    double largest = kSmallestBest;
    for (const PictureLoad& scene : scenes)
        largest = std::max(largest, static_cast<double>(scene.width) * scene.height);
    PictureCaps caps;
    for (double best = std::min(kLargest, largest); best >= kSmallestBest; best /= 2) {
        // Points that are not Pareto-optimal are viewed seldom and maps are coarse, so both shrink first.
        for (double rest = best; rest >= kSmallest; rest /= 2) {
            for (const double share : {1.0, 0.25}) {
                caps = {best, share * best, rest};
                if (most_bytes(scenes, caps) <= budget) return caps;
            }
        }
    }
    // Only studies of thousands of points get here.
    for (caps.rest = 0; caps.best > 1 && most_bytes(scenes, caps) > budget; caps.best /= 2)
        caps.maps = caps.best / 2;
    return caps;
}

int ErrorCode::of(double error) const {
    if (std::isnan(error)) return 128;
    const double size = std::min(std::fabs(error), most);
    const double step = std::round(127 * log1p(size / least) / log1p(most / least));
    return 128 + static_cast<int>(std::copysign(step, error));
}

std::vector<ScenePictures> study_pictures(const StudyDescription& description,
                                          const std::vector<std::filesystem::path>& references,
                                          std::vector<StudyResult>& results, const Workers& workers,
                                          Monitor& monitor) {
    const PictureCaps caps = picture_caps(loads_of(description, references, results), kPicturesBudget);
    std::vector<ScenePictures> all;
    Phase phase(monitor, "page", results.size());
    for (std::size_t i = 0; i < references.size(); ++i) {
        ScenePictureWriter writer(description.scenes[i], references[i], caps, workers);
        for (StudyResult& result : results) {
            if (result.scene != description.scenes[i].name) continue;
            writer.add(result);
            phase.advance(1);
        }
        all.push_back(writer.pictures());
    }
    return all;
}

}  // namespace lucerna
