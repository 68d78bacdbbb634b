#include "engine/evaluation/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/base/error.h"
#include "engine/base/version.h"
#include "engine/evaluation/compare.h"
#include "engine/image/image.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> scenes_of(const std::vector<StudyResult>& results) {
    std::vector<std::string> names;
    for (const StudyResult& result : results) {
        if (std::find(names.begin(), names.end(), result.scene) == names.end()) names.push_back(result.scene);
    }
    return names;
}

const StudyResult* fastest(const std::vector<StudyResult>& results, const std::string& scene, double error) {
    const StudyResult* best = nullptr;
    for (const StudyResult& result : results) {
        if (result.scene != scene || !(result.error() <= error)) continue;
        if (!best || result.seconds < best->seconds) best = &result;
    }
    return best;
}

}  // namespace

double StudyResult::error() const {
    return std::sqrt(error2);
}

void mark_best(std::vector<StudyResult>& results) {
    for (StudyResult& result : results) {
        result.best = std::none_of(results.begin(), results.end(), [&](const StudyResult& other) {
            const bool no_worse = other.seconds <= result.seconds && other.error2 <= result.error2;
            return other.scene == result.scene && no_worse &&
                   (other.seconds < result.seconds || other.error2 < result.error2);
        });
    }
}

std::vector<std::string> advice(const std::vector<StudyResult>& results) {
    constexpr double kErrors[] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.5};
    std::vector<std::string> lines;
    for (const std::string& scene : scenes_of(results)) {
        const StudyResult* last = nullptr;
        for (const double error : kErrors) {
            const StudyResult* best = fastest(results, scene, error);
            if (!best || best == last) continue;  // already the fastest for a smaller error
            last = best;
            lines.push_back(fmt::format("for {:g} % error on {} the fastest is {}, {} ({})", 100 * error,
                                        scene, best->method, best->settings, duration_text(best->seconds)));
        }
        if (!last) lines.push_back(fmt::format("on {} no point is within {:g} %", scene, 100 * kErrors[5]));
    }
    return lines;
}

std::vector<std::string> doubts(const std::vector<StudyResult>& results) {
    std::vector<std::string> lines;
    for (const std::string& scene : scenes_of(results)) {
        const StudyResult* least = nullptr;
        for (const StudyResult& result : results) {
            if (result.scene == scene && (!least || result.error2 < least->error2)) least = &result;
        }
        if (!(least->reference_noise2 > 0.25 * least->error2)) continue;
        lines.push_back(
            fmt::format("the reference of {} has {:.2g} % noise, which is included in every error; the "
                        "lowest error is {:.2g} %. Use more samples for the reference",
                        scene, 100 * std::sqrt(least->reference_noise2), 100 * least->error()));
    }
    return lines;
}

std::string study_csv(const std::vector<StudyResult>& results) {
    std::string text =
        "scene,method,settings,seconds,error2,bias2,bias2_error,noise2,noise2_error,reference_noise2,mean_"
        "ratio,flip,best\n";
    const auto number = [](const std::optional<double>& x) { return x ? fmt::format("{:.6g}", *x) : ""; };
    for (const StudyResult& r : results) {
        const Estimate bias2 = r.bias2.value_or(Estimate{}), noise2 = r.noise2.value_or(Estimate{});
        fmt::format_to(std::back_inserter(text), "{},{},{},{:.6g},{:.6g},{},{},{},{},{:.6g},{:.6g},{},{:d}\n",
                       csv_field(r.scene), csv_field(r.method), csv_field(r.settings), r.seconds, r.error2,
                       number(r.bias2 ? std::optional(bias2.value) : std::nullopt), number(bias2.error),
                       number(r.noise2 ? std::optional(noise2.value) : std::nullopt), number(noise2.error),
                       r.reference_noise2, r.mean_ratio, number(r.flip), r.best);
    }
    return text;
}

std::string study_json(const StudyDescription& description, const std::vector<StudyResult>& results,
                       const StudyOrigin& origin) {
    const auto estimate = [](const std::optional<Estimate>& e) {
        if (!e) return Json(nullptr);
        return Json{{"value", e->value}, {"error", e->error ? Json(*e->error) : Json(nullptr)}};
    };
    Json json{{"program", "lucerna"},
              {"version", program_version()},
              {"title", description.title},
              {"seeds", description.seeds},
              {"machines", origin.machines},
              {"threads", origin.threads},
              {"dates", origin.dates},
              {"reference",
               {{"integrator", description.reference.overrides.integrator},
                {"settings", description.reference.settings}}}};
    if (!origin.hosts.empty()) json["hosts"] = origin.hosts;
    json["advice"] = advice(results);
    json["points"] = Json::array();
    for (const StudyResult& r : results) {
        json["points"].push_back({{"scene", r.scene},
                                  {"method", r.method},
                                  {"settings", r.settings},
                                  {"image", r.image.filename().string()},
                                  {"seconds", r.seconds},
                                  {"error", r.error()},
                                  {"error2", r.error2},
                                  {"bias2", estimate(r.bias2)},
                                  {"noise2", estimate(r.noise2)},
                                  {"reference_noise2", r.reference_noise2},
                                  {"mean_ratio", r.mean_ratio},
                                  {"flip", r.flip ? Json(*r.flip) : Json(nullptr)},
                                  {"best", r.best}});
        if (!r.hosts.empty()) json["points"].back()["hosts"] = r.hosts;
    }
    // File names need not be UTF-8.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

namespace {

constexpr std::array<const char*, 3> kVariances{"variance.R", "variance.G", "variance.B"};

bool states_variances(const Image& image) {
    return std::all_of(kVariances.begin(), kVariances.end(),
                       [&](const char* name) { return find_channel(image, name).has_value(); });
}

// Returns luminance and any variance that the image states. As in Film, channels are fully correlated.
Image luminance_image(const Image& image) {
    const bool variances = states_variances(image);
    Image result(image.width, image.height,
                 variances ? std::vector<std::string>{"Y", "variance.Y"} : std::vector<std::string>{"Y"});
    std::array<int, 3> at{};
    for (std::size_t c = 0; variances && c < 3; ++c)
        at[c] = static_cast<int>(*find_channel(image, kVariances[c]));
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            result.value(x, y, 0) = luminance(image.rgb_at(x, y));
            if (!variances) continue;
            const auto sigma = [&](std::size_t c) { return std::sqrt(image.value(x, y, at[c])); };
            const float whole = luminance(Rgb(sigma(0), sigma(1), sigma(2)));
            result.value(x, y, 1) = whole * whole;
        }
    }
    return result;
}

// Returns the mean of variance / (r² + kRelativeMseFloor) over finite pixels; 0 without a variance.
double relative_variance(const Image& reference) {
    if (reference.channels.size() < 2) return 0;
    double sum = 0, pixels = 0;
    for (std::size_t i = 0; i < reference.data.size(); i += 2) {
        const double r = double{reference.data[i]}, variance = double{reference.data[i + 1]};
        if (!std::isfinite(r) || !std::isfinite(variance)) continue;
        sum += variance / (r * r + kRelativeMseFloor);
        ++pixels;
    }
    return pixels > 0 ? sum / pixels : 0;
}

}  // namespace

NamedImage read_reference(const std::filesystem::path& file, const StudyScene& scene) {
    NamedImage reference{file.string(), read_exr(file)};
    if (!scene.mask_lamps) return reference;
    Image& image = reference.image;
    std::vector<std::size_t> lamps;
    for (const std::string_view name : kLampChannels) {
        const auto channel = find_channel(image, std::string(name));
        if (!channel) throw InputError({file.string()}, fmt::format("has no channel {}", name));
        lamps.push_back(*channel);
    }
    for (std::size_t at = 0; at < image.data.size(); at += image.channels.size()) {
        if (std::ranges::none_of(lamps, [&](std::size_t c) { return image.data[at + c] > 0; })) continue;
        std::fill_n(&image.data[at], image.channels.size(), std::numeric_limits<float>::quiet_NaN());
    }
    image = with_channels(image, [](const std::string& name) {
        return std::ranges::find(kLampChannels, name) == std::ranges::end(kLampChannels);
    });
    return reference;
}

StudyMeasure::StudyMeasure(const NamedImage& reference, double mask_above)
    : reference_{reference.name, luminance_image(reference.image)} {
    const auto channels = shared_channels(reference.image, reference.image, reference.name, reference.name);
    Image& seen = reference_.image;
    double sum = 0, pixels = 0;
    for (int y = 0; y < seen.height; ++y) {
        for (int x = 0; x < seen.width; ++x) {
            const float* values = &reference.image.data[reference.image.index(x, y)];
            if (pixel_state(values, values, channels, mask_above).compared()) {
                sum += std::fabs(double{seen.value(x, y, 0)});
                ++pixels;
            } else {
                seen.value(x, y, 0) = std::numeric_limits<float>::quiet_NaN();
            }
        }
    }
    const double mean = pixels > 0 ? sum / pixels : 0;
    // compare() adds a constant to r². This scale makes the constant the squared share of the mean.
    scale_ = std::sqrt(kRelativeMseFloor) / (kErrorFloorShare * mean);
    if (!(mean > 0) || !std::isfinite(scale_)) {
        throw InputError(
            {reference.name},
            fmt::format(
                "the reference is black in all {} pixels that are compared, so no relative error is defined",
                pixels));
    }
    reference_ = scaled(reference_);
    noise2_ = relative_variance(seen);
}

// Scales a luminance image in double, as the scale of a very dim or bright scene exceeds float32.
NamedImage StudyMeasure::scaled(const NamedImage& image) const {
    NamedImage result = image;
    for (std::size_t i = 0; i < result.image.data.size(); ++i) {
        const bool variance = result.image.channels.size() == 2 && i % 2 == 1;
        result.image.data[i] =
            static_cast<float>(double{result.image.data[i]} * (variance ? scale_ * scale_ : scale_));
    }
    return result;
}

void StudyMeasure::measure(const std::vector<NamedImage>& images, StudyResult& result,
                           Monitor& monitor) const {
    std::vector<NamedImage> seen;
    for (const NamedImage& one : images) seen.push_back(scaled({one.name, luminance_image(one.image)}));

    result.reference_noise2 = noise2_;
    double squares = 0;
    for (const NamedImage& one : seen) {
        const Comparison numbers = compare(one.image, reference_.image, one.name, reference_.name);
        squares += numbers.relative_mse / static_cast<double>(seen.size());
        if (numbers.bad_pixels > 0) {
            monitor.warn(fmt::format("{}: {} pixels are not finite and are left out of every error", one.name,
                                     numbers.bad_pixels));
        }
        if (seen.size() == 1) result.mean_ratio = numbers.channels.at(0).ratio.value_or(1);
    }
    result.error2 = squares;
    if (seen.size() == 1) return;
    const BiasAndNoise parts = bias_and_noise(seen, reference_);
    result.error2 = parts.relative.mse.value;
    result.error2_error = parts.relative.mse.error;
    result.bias2 = parts.relative.bias2;
    result.noise2 = parts.relative.noise2;
    const auto& ratio = parts.channels.at(0).ratio;
    result.mean_ratio = ratio ? ratio->value : 1;
}

}  // namespace lucerna
