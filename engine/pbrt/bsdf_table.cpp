#include "engine/base/elementary.h"
#include "engine/pbrt/material_parts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "engine/system/files.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little, "both formats are little-endian");

// Reads values from bytes in order and reports whether they were there.
class Bytes {
  public:
    explicit Bytes(const std::vector<std::byte>& all) : all_(all) {}

    template <typename Value>
    bool read(Value* values, std::size_t count) {
        if (count > (all_.size() - at_) / sizeof(Value)) return false;
        std::memcpy(values, all_.data() + at_, count * sizeof(Value));
        at_ += count * sizeof(Value);
        return true;
    }
    template <typename Value>
    bool read(std::vector<Value>& values, std::size_t count) {
        if (count > (all_.size() - at_) / sizeof(Value)) return false;
        values.resize(count);
        return read(values.data(), count);
    }
    std::size_t left() const { return all_.size() - at_; }

  private:
    const std::vector<std::byte>& all_;
    std::size_t at_ = 0;
};

// Sums over one outgoing direction: reflected and transmitted light, diffuse level and highest value.
struct Sums {
    V3d reflected{0.0}, transmitted{0.0}, diffuse{0.0};
    double highest = 0;  // luminance of the BSDF, 1/sr
    double cos_o = 1;
};

double held(double x) {
    return std::isfinite(x) ? std::clamp(x, 0.0, 1.0) : 0;
}
Rgb held(const V3d& c) {
    return Rgb(V3d(held(c.x), held(c.y), held(c.z)));
}

// Fits a GGX lobe by its value at the mirror direction, S / (4 π α² cos²) for albedo S.
TableFit fit_of(const Sums& sums, double eta) {
    TableFit fit;
    fit.diffuse = held(sums.diffuse);
    const V3d rest = sums.reflected - sums.diffuse;
    fit.gloss = held(rest);
    fit.transmitted = held(sums.transmitted);
    const double gloss = static_cast<double>(luminance(fit.gloss));
    const double above = sums.highest - static_cast<double>(luminance(fit.diffuse)) / M_PI;
    if (above > 0 && gloss > 0) {
        const double alpha = std::sqrt(gloss / (4 * M_PI * sums.cos_o * sums.cos_o * above));
        fit.alpha = static_cast<float>(std::clamp(alpha, 0.02, 1.0));
    }
    if (eta > 1.01 && eta < 10) fit.eta = static_cast<float>(eta);
    return fit;
}

// ---- Fourier tables of version 3: for each pair of cosines a cosine series in the azimuth difference of the
// BSDF times |cos θi|. μi is the cosine of the direction that light travels, so μi μo < 0 reflects.

struct FourierTable {
    std::vector<float> mu, coefficients;
    std::vector<std::int32_t> offset_and_length;
    int channels = 1;
    double eta = 1;

    // Channel 0 is luminance, 1 red, 2 blue.
    double value(std::size_t i, std::size_t o, int channel, double phi) const {
        const std::int64_t offset = offset_and_length[2 * (o * mu.size() + i)],
                           length = offset_and_length[2 * (o * mu.size() + i) + 1];
        double sum = 0;
        for (std::int64_t k = 0; k < length; ++k) {
            sum +=
                static_cast<double>(coefficients[static_cast<std::size_t>(offset + channel * length + k)]) *
                cos(static_cast<double>(k) * phi);
        }
        return sum;
    }
    V3d color(std::size_t i, std::size_t o, double phi) const {
        const double y = value(i, o, 0, phi);
        if (channels == 1) return V3d(y);
        const double r = value(i, o, 1, phi), b = value(i, o, 2, phi);
        // Green follows from luminance by the weights of sRGB.
        return {r, (y - 0.212671 * r - 0.072169 * b) / 0.715160, b};
    }
    // The mean over the azimuth is the series' first coefficient.
    V3d mean(std::size_t i, std::size_t o) const {
        const std::int64_t offset = offset_and_length[2 * (o * mu.size() + i)],
                           length = offset_and_length[2 * (o * mu.size() + i) + 1];
        if (length < 1) return V3d(0);
        const auto at = [&](int channel) {
            return static_cast<double>(coefficients[static_cast<std::size_t>(offset + channel * length)]);
        };
        if (channels == 1) return V3d(at(0));
        return {at(1), (at(0) - 0.212671 * at(1) - 0.072169 * at(2)) / 0.715160, at(2)};
    }
};

std::optional<FourierTable> read_fourier(Bytes bytes) {
    char magic[8];
    std::int32_t head[9];  // flags, cosines, coefficients, longest series, channels, bases, unused
    float eta[1];
    std::int32_t unused[4];
    const bool begins = bytes.read(magic, 8) && std::memcmp(magic, "SCATFUN\x01", 8) == 0 &&
                        bytes.read(head, 9) && bytes.read(eta, 1) && bytes.read(unused, 4);
    if (!begins || head[0] != 1 || head[1] < 2 || head[1] > 1 << 14 || head[2] < 0 ||
        (head[4] != 1 && head[4] != 3) || head[5] != 1)
        return std::nullopt;
    FourierTable table;
    table.channels = head[4];
    table.eta = static_cast<double>(eta[0]);
    const auto cosines = static_cast<std::size_t>(head[1]);
    std::vector<float> cumulative;
    if (!bytes.read(table.mu, cosines) || !bytes.read(cumulative, cosines * cosines) ||
        !bytes.read(table.offset_and_length, 2 * cosines * cosines) ||
        !bytes.read(table.coefficients, static_cast<std::size_t>(head[2])))
        return std::nullopt;
    for (std::size_t i = 0; i < table.offset_and_length.size(); i += 2) {
        const std::int64_t offset = table.offset_and_length[i], length = table.offset_and_length[i + 1];
        if (offset < 0 || length < 0 || offset + length * table.channels > head[2]) return std::nullopt;
    }
    return table;
}

TableFit fit_fourier(const FourierTable& table) {
    const std::vector<float>& mu = table.mu;
    std::size_t o = 0;  // the direction nearest to 45 degrees
    for (std::size_t i = 0; i < mu.size(); ++i) {
        if (std::fabs(mu[i] - 0.7071F) < std::fabs(mu[o] - 0.7071F)) o = i;
    }
    Sums sums;
    sums.cos_o = static_cast<double>(mu[o]);
    // Integrates by the trapezoidal rule over the cosine, times 2 π times the mean over the azimuth.
    for (std::size_t i = 0; i + 1 < mu.size(); ++i) {
        const V3d strip =
            (table.mean(i, o) + table.mean(i + 1, o)) * M_PI * static_cast<double>(mu[i + 1] - mu[i]);
        (mu[i] + mu[i + 1] < 0 ? sums.reflected : sums.transmitted) += strip;
    }
    // Evaluates the BSDF on a grid; the lower quartile is the diffuse level.
    std::vector<V3d> values;
    constexpr int kAzimuths = 32;
    for (std::size_t i = 0; i < mu.size(); ++i) {
        if (mu[i] > -0.2F) continue;
        for (int k = 0; k <= kAzimuths; ++k) {
            const V3d f = table.color(i, o, M_PI * k / kAzimuths) / std::fabs(static_cast<double>(mu[i]));
            values.push_back(f);
            sums.highest = std::max(sums.highest, 0.2126 * f.x + 0.7152 * f.y + 0.0722 * f.z);
        }
    }
    if (values.empty()) return fit_of(sums, table.eta);
    std::sort(values.begin(), values.end(),
              [](const V3d& a, const V3d& b) { return a.x + a.y + a.z < b.x + b.y + b.z; });
    sums.diffuse = values[values.size() / 4] * M_PI;
    for (int k = 0; k < 3; ++k)
        sums.diffuse[k] = std::clamp(sums.diffuse[k], 0.0, std::max(0.0, sums.reflected[k]));
    return fit_of(sums, table.eta);
}

// ---- Tables of MERL [Matusik 2003] with 90 half angles, 90 difference angles and 180 azimuths of the
// difference. Half angles are denser near the mirror direction.

std::optional<TableFit> fit_merl(Bytes bytes) {
    constexpr std::size_t kHalf = 90, kDifference = 90, kAzimuth = 180;
    constexpr std::size_t kCells = kHalf * kDifference * kAzimuth;
    std::int32_t size[3];
    std::vector<double> cells;
    if (!bytes.read(size, 3) || size[0] != kHalf || size[1] != kDifference || size[2] != kAzimuth ||
        !bytes.read(cells, 3 * kCells))
        return std::nullopt;
    const V3d scale(1.0 / 1500, 1.15 / 1500, 1.66 / 1500);
    // For light from the front, both angles are half of the other direction's angle.
    const auto value = [&](double theta) {
        const double half = theta / 2;
        const auto h = static_cast<std::size_t>(
            std::clamp(std::sqrt(half / (M_PI / 2)) * kHalf, 0.0, double(kHalf - 1)));
        const auto d = static_cast<std::size_t>(
            std::clamp(half / (M_PI / 2) * kDifference, 0.0, double(kDifference - 1)));
        const std::size_t cell = kAzimuth / 2 + d * kAzimuth + h * kAzimuth * kDifference;
        V3d f;
        for (std::size_t k = 0; k < 3; ++k) {
            const double sample = cells[k * kCells + cell] * scale[static_cast<int>(k)];
            f[static_cast<int>(k)] = std::isfinite(sample) ? std::max(0.0, sample) : 0;
        }
        return f;
    };
    Sums sums;
    V3d lowest(1e30);
    constexpr int kSteps = 512;
    for (int i = 0; i < kSteps; ++i) {
        const double theta = (i + 0.5) / kSteps * M_PI / 2;
        const V3d f = value(theta);
        sums.reflected += f * (2 * M_PI * cos(theta) * sin(theta) * M_PI / 2 / kSteps);
        sums.highest = std::max(sums.highest, 0.2126 * f.x + 0.7152 * f.y + 0.0722 * f.z);
        if (theta > 0.5 && theta < 1.2) {
            for (int k = 0; k < 3; ++k) lowest[k] = std::min(lowest[k], f[k]);
        }
    }
    for (int k = 0; k < 3; ++k) sums.diffuse[k] = std::min(lowest[k] * M_PI, sums.reflected[k]);
    return fit_of(sums, 1);
}

}  // namespace

std::optional<TableFit> fit_bsdf_table(const std::filesystem::path& file) {
    const std::vector<std::byte> bytes = read_bytes(file);
    if (const auto fourier = read_fourier(Bytes(bytes))) return fit_fourier(*fourier);
    return fit_merl(Bytes(bytes));
}

}  // namespace lucerna
