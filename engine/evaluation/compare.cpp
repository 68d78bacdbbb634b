#include "engine/evaluation/compare.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "engine/image/image.h"

namespace lucerna {
namespace {

// Sums over all pixels.
struct Sums {
    double square = 0, relative = 0, absolute = 0;
    double reference_luminance = 0;
    std::vector<double> value, reference_value;
};

class Comparer {
  public:
    Comparer(const Image& image, const Image& reference, std::vector<SharedChannel> shared, double mask_above,
             int z_cell)
        : image_(image), reference_(reference), shared_(std::move(shared)), mask_above_(mask_above) {
        sums_.value.resize(shared_.size());
        sums_.reference_value.resize(shared_.size());
        const bool variances = std::all_of(shared_.begin(), shared_.end(), [](const SharedChannel& c) {
            return c.variance_at && c.reference_variance_at;
        });
        if (!variances) return;
        std::vector<std::string> names;
        for (const SharedChannel& channel : shared_) names.push_back(channel.name);
        z_tester_.emplace(std::move(names), image.width, z_cell);
    }

    Comparison run() {
        for (int y = 0; y < image_.height; ++y) {
            for (int x = 0; x < image_.width; ++x) pixel(x, y);
        }
        finish_means();
        find_error();
        if (z_tester_) result_.z_test = z_tester_->finish();
        return std::move(result_);
    }

  private:
    void pixel(int x, int y) {
        const float* t = &image_.data[image_.index(x, y)];
        const float* r = &reference_.data[reference_.index(x, y)];
        const PixelState state = pixel_state(t, r, shared_, mask_above_);
        result_.bad_pixels += state.bad;
        result_.bad_reference_pixels += state.bad_reference;
        if (state.bad || state.bad_reference) return;
        result_.masked_pixels += state.masked;
        if (state.masked) return;
        ++result_.pixels;
        sums_.reference_luminance += luminances(t, r).r;
        for (std::size_t c = 0; c < shared_.size(); ++c) value(x, y, c, t, r);
    }

    void value(int x, int y, std::size_t c, const float* t_pixel, const float* r_pixel) {
        const SharedChannel& channel = shared_[c];
        const double t = double{t_pixel[channel.at]};
        const double r = double{r_pixel[channel.reference_at]};
        const double difference = std::fabs(t - r);
        sums_.square += difference * difference;
        sums_.relative += difference * difference / (r * r + kRelativeMseFloor);  // the floors keep both
        sums_.absolute += difference / (std::fabs(r) + kMapeFloor);               // denominators above 0
        sums_.value[c] += t;
        sums_.reference_value[c] += r;
        if (difference > result_.largest.value) result_.largest = {difference, x, y, channel.name};
        if (z_tester_) {
            z_tester_->add(
                x, y, c, t - r,
                double{t_pixel[*channel.variance_at]} + double{r_pixel[*channel.reference_variance_at]});
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

    // A pixel's luminance in the image (t) and the reference (r).
    struct Pair {
        double t = 0, r = 0;
    };
    Pair luminances(const float* t, const float* r) const {
        Rgb t_rgb(0), r_rgb(0);
        int found = 0;
        for (const SharedChannel& channel : shared_) {
            const int c = channel.name == "R" ? 0 : channel.name == "G" ? 1 : channel.name == "B" ? 2 : -1;
            if (c < 0) continue;
            t_rgb[c] = t[channel.at];
            r_rgb[c] = r[channel.reference_at];
            ++found;
        }
        if (found == 3) return {double{luminance(t_rgb)}, double{luminance(r_rgb)}};
        return {double{t[shared_[0].at]}, double{r[shared_[0].reference_at]}};
    }

    // Sums errors relative to the mean luminance, which is known after the first pass.
    void find_error() {
        if (result_.pixels == 0) return;
        const double pixels = static_cast<double>(result_.pixels), mean = sums_.reference_luminance / pixels;
        double sum = 0;
        for (int y = 0; y < image_.height; ++y) {
            for (int x = 0; x < image_.width; ++x) {
                const float* t = &image_.data[image_.index(x, y)];
                const float* r = &reference_.data[reference_.index(x, y)];
                if (!pixel_state(t, r, shared_, mask_above_).compared()) continue;
                const Pair pair = luminances(t, r);
                // The error is infinite where the reference is black everywhere.
                if (pair.t != pair.r) sum += sqr(pair.t - pair.r) / error_scale2(pair.r, mean);
            }
        }
        result_.error = std::sqrt(sum / pixels);
    }

    const Image& image_;
    const Image& reference_;
    std::vector<SharedChannel> shared_;
    double mask_above_;
    Sums sums_;
    std::optional<ZTester> z_tester_;
    Comparison result_;
};

}  // namespace

Comparison compare(const Image& image, const Image& reference, const std::string& name,
                   const std::string& reference_name, double mask_above, int z_cell) {
    Comparison result = Comparer(image, reference, shared_channels(image, reference, name, reference_name),
                                 mask_above, z_cell)
                            .run();
    result.left_out = channels_of_one(image, reference);
    return result;
}

namespace {

const std::string kVariance = "variance.";
constexpr std::array<std::string_view, 3> kColours{"R", "G", "B"};

// Excludes alpha and variances, and where there are R, G and B also OpenEXR's depth and layers (halves,
// features, the denoised image), which are no colours.
bool is_compared(const Image& image, const std::string& channel) {
    const bool beside = std::ranges::all_of(
        kColours, [&](std::string_view c) { return find_channel(image, std::string(c)).has_value(); });
    if (beside && (channel == "Z" || channel.find('.') != channel.npos)) return false;
    return !channel.starts_with(kVariance) && channel != "A";
}

const SharedChannel& named(const std::vector<SharedChannel>& channels, std::string_view name) {
    const auto found = std::find_if(channels.begin(), channels.end(),
                                    [&](const SharedChannel& channel) { return channel.name == name; });
    return found == channels.end() ? channels.front() : *found;
}

bool all_named(const std::vector<SharedChannel>& channels) {
    return std::all_of(kColours.begin(), kColours.end(),
                       [&](std::string_view name) { return named(channels, name).name == name; });
}

}  // namespace

std::vector<SharedChannel> shared_channels(const Image& image, const Image& reference,
                                           const std::string& name, const std::string& reference_name) {
    if (image.width != reference.width || image.height != reference.height) {
        throw InputError(
            {name},
            fmt::format("{} x {} pixels, but {} has {} x {}; only images of the same size can be compared",
                        image.width, image.height, reference_name, reference.width, reference.height));
    }
    std::vector<SharedChannel> shared;
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        const std::string& channel = image.channels[c];
        if (!is_compared(image, channel)) continue;
        if (const auto r = find_channel(reference, channel)) {
            shared.push_back({channel, c, *r, find_channel(image, kVariance + channel),
                              find_channel(reference, kVariance + channel)});
        }
    }
    if (shared.empty()) throw InputError({name}, "no colour channel in common with " + reference_name);
    return shared;
}

std::vector<std::string> channels_of_one(const Image& image, const Image& reference) {
    std::vector<std::string> names;
    for (const std::string& name : image.channels) {
        if (is_compared(image, name) && !find_channel(reference, name)) names.push_back(name);
    }
    for (const std::string& name : reference.channels) {
        if (is_compared(reference, name) && !find_channel(image, name)) names.push_back(name);
    }
    return names;
}

PixelState pixel_state(const float* image, const float* reference, const std::vector<SharedChannel>& channels,
                       double mask_above) {
    PixelState state;
    for (const SharedChannel& c : channels) {
        const float r = reference[c.reference_at];
        state.bad |= !std::isfinite(image[c.at]);
        state.bad_reference |= !std::isfinite(r);
        state.masked |= std::isfinite(r) && double{r} > mask_above;
    }
    return state;
}

ComparablePair comparable_pair(const Image& image, const Image& reference, const std::string& name,
                               const std::string& reference_name, double mask_above) {
    const std::vector<SharedChannel> channels = shared_channels(image, reference, name, reference_name);
    const bool colour = all_named(channels);
    const SharedChannel& first = colour ? named(channels, "R") : named(channels, "Y");
    const std::array<SharedChannel, 3> shown{first, colour ? named(channels, "G") : first,
                                             colour ? named(channels, "B") : first};
    ComparablePair pair{Image::rgb(image.width, image.height), Image::rgb(image.width, image.height), {}};
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const float* t = &image.data[image.index(x, y)];
            const float* r = &reference.data[reference.index(x, y)];
            const PixelState state = pixel_state(t, r, channels, mask_above);
            Rgb a(t[shown[0].at], t[shown[1].at], t[shown[2].at]);
            Rgb b(r[shown[0].reference_at], r[shown[1].reference_at], r[shown[2].reference_at]);
            if (!is_finite(b)) b = is_finite(a) ? a : Rgb(0);
            if (!state.compared()) a = b;
            pair.image.set_rgb(x, y, a);
            pair.reference.set_rgb(x, y, b);
            pair.compared.push_back(state.compared());
        }
    }
    return pair;
}

}  // namespace lucerna
