#include "engine/render/compare.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace lucerna {
namespace {

const std::string kVariance = "variance.";

std::optional<std::size_t> find_channel(const Image& image, const std::string& name) {
    const auto found = std::find(image.channels.begin(), image.channels.end(), name);
    if (found == image.channels.end()) return std::nullopt;
    return static_cast<std::size_t>(found - image.channels.begin());
}

bool is_compared(const std::string& channel) {
    return !channel.starts_with(kVariance) && channel != "A";
}

// One channel that both images have: where it is in each.
struct Shared {
    std::string name;
    std::size_t at, reference_at;
    std::optional<std::size_t> variance_at, reference_variance_at;
};

std::vector<Shared> shared_channels(const Image& image, const Image& reference) {
    std::vector<Shared> shared;
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        const std::string& name = image.channels[c];
        if (!is_compared(name)) continue;
        if (const auto r = find_channel(reference, name)) {
            shared.push_back({name, c, *r, find_channel(image, kVariance + name),
                              find_channel(reference, kVariance + name)});
        }
    }
    return shared;
}

std::vector<std::string> only_in_one(const Image& image, const Image& reference) {
    std::vector<std::string> names;
    for (const std::string& name : image.channels) {
        if (is_compared(name) && !find_channel(reference, name)) names.push_back(name);
    }
    for (const std::string& name : reference.channels) {
        if (is_compared(name) && !find_channel(image, name)) names.push_back(name);
    }
    return names;
}

// The sums of one pass over the pixels.
struct Sums {
    double square = 0, relative = 0, absolute = 0;
    std::vector<double> value, reference_value;
};

class Comparer {
  public:
    Comparer(const Image& image, const Image& reference, std::vector<Shared> shared, double mask_above)
        : image_(image), reference_(reference), shared_(std::move(shared)), mask_above_(mask_above) {
        sums_.value.resize(shared_.size());
        sums_.reference_value.resize(shared_.size());
        const bool variances = std::all_of(shared_.begin(), shared_.end(), [](const Shared& c) {
            return c.variance_at && c.reference_variance_at;
        });
        if (variances) result_.z_test.emplace();
    }

    Comparison run() {
        for (int y = 0; y < image_.height; ++y) {
            for (int x = 0; x < image_.width; ++x) pixel(x, y);
        }
        finish_means();
        if (result_.z_test) finish_z_test();
        return std::move(result_);
    }

  private:
    void pixel(int x, int y) {
        const float* t = &image_.data[image_.index(x, y)];
        const float* r = &reference_.data[reference_.index(x, y)];
        bool bad = false;
        bool bad_reference = false;
        bool masked = false;
        for (const Shared& c : shared_) {
            bad |= !std::isfinite(t[c.at]);
            bad_reference |= !std::isfinite(r[c.reference_at]);
            masked |= std::isfinite(r[c.reference_at]) && double{r[c.reference_at]} > mask_above_;
        }
        result_.bad_pixels += bad;
        result_.bad_reference_pixels += bad_reference;
        if (bad || bad_reference) return;
        result_.masked_pixels += masked;
        if (masked) return;
        ++result_.pixels;
        for (std::size_t c = 0; c < shared_.size(); ++c) value(x, y, c, t, r);
    }

    void value(int x, int y, std::size_t c, const float* t_pixel, const float* r_pixel) {
        const Shared& channel = shared_[c];
        const double t = double{t_pixel[channel.at]};
        const double r = double{r_pixel[channel.reference_at]};
        const double difference = std::fabs(t - r);
        sums_.square += difference * difference;
        sums_.relative += difference * difference / (r * r + kRelativeMseFloor);  // the floors keep both
        sums_.absolute += difference / (std::fabs(r) + kMapeFloor);               // denominators above 0
        sums_.value[c] += t;
        sums_.reference_value[c] += r;
        if (difference > result_.largest.value) result_.largest = {difference, x, y, channel.name};
        if (result_.z_test) {
            z_value(x, y, channel, difference,
                    double{t_pixel[*channel.variance_at]} + double{r_pixel[*channel.reference_variance_at]});
        }
    }

    void z_value(int x, int y, const Shared& channel, double difference, double variance) {
        ZTest& test = *result_.z_test;
        if (!(variance > 0) || !std::isfinite(variance)) {
            // Two equal constants agree whatever their noise; different ones cannot be judged without it.
            test.untestable += difference > 0;
            return;
        }
        const double p = std::erfc(difference / std::sqrt(2 * variance));  // variance > 0
        ++test.tests;
        p_values_.push_back(p);
        if (p < test.smallest_p) {
            test.smallest_p = p;
            test.x = x;
            test.y = y;
            test.channel = channel.name;
        }
    }

    void finish_means() {
        if (result_.pixels == 0) return;
        const double pixels = static_cast<double>(result_.pixels);
        const double values = pixels * static_cast<double>(shared_.size());  // at least one channel is shared
        result_.mse = sums_.square / values;
        result_.relative_mse = sums_.relative / values;
        result_.mape = sums_.absolute / values;
        for (std::size_t c = 0; c < shared_.size(); ++c) {
            ChannelComparison channel{
                shared_[c].name, sums_.value[c] / pixels, sums_.reference_value[c] / pixels, {}};
            if (channel.reference_mean != 0) channel.ratio = channel.mean / channel.reference_mean;
            result_.channels.push_back(std::move(channel));
        }
    }

    void finish_z_test() {
        ZTest& test = *result_.z_test;
        test.corrected_level = sidak_level(test.level, test.tests);
        test.rejected = static_cast<std::uint64_t>(std::count_if(
            p_values_.begin(), p_values_.end(), [&](double p) { return p < test.corrected_level; }));
        test.p_value = sidak_p_value(test.smallest_p, test.tests);
    }

    const Image& image_;
    const Image& reference_;
    std::vector<Shared> shared_;
    double mask_above_;
    Sums sums_;
    std::vector<double> p_values_;
    Comparison result_;
};

}  // namespace

double sidak_level(double level, std::uint64_t tests) {
    if (tests == 0) return level;
    return -std::expm1(std::log1p(-level) / static_cast<double>(tests));
}

double sidak_p_value(double smallest_p, std::uint64_t tests) {
    if (tests == 0) return 1;
    if (smallest_p >= 1) return 1;
    return -std::expm1(static_cast<double>(tests) * std::log1p(-smallest_p));
}

Comparison compare(const Image& image, const Image& reference, const std::string& name,
                   const std::string& reference_name, double mask_above) {
    if (image.width != reference.width || image.height != reference.height) {
        throw InputError(
            {name},
            fmt::format("{} x {} pixels, but {} has {} x {}; only images of one size compare", image.width,
                        image.height, reference_name, reference.width, reference.height));
    }
    std::vector<Shared> shared = shared_channels(image, reference);
    if (shared.empty()) {
        throw InputError({name}, "no colour channel in common with " + reference_name);
    }
    Comparison result = Comparer(image, reference, std::move(shared), mask_above).run();
    result.left_out = only_in_one(image, reference);
    return result;
}

}  // namespace lucerna
