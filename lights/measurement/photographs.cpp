#include "lights/measurement/photographs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/colour/spectrum.h"
#include "engine/ranks/shared_work.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"
#include "lights/measurement/exposure.h"

namespace lucerna {
namespace {

constexpr double kSameTime = 1e-6;      // relative
constexpr double kMuchNoise = 0.1;      // relative to the signal's root mean square
constexpr double kLeastDensity = 0.25;  // photograph pixels per pixel of M
constexpr std::size_t kNamedMissing = 3;

std::string seconds_text(double seconds) {
    return fmt::format("{:g} s", seconds);
}

std::string view_text(int m, int n, FilterSign sign) {
    return fmt::format("view [{}, {}] {}", m, n, sign_name(sign));
}

template <typename Visit>
void for_each_view(const V2i& views, Visit&& visit) {
    for (int m = 0; m < views.x; ++m) {
        for (int n = 0; n < views.y; ++n) {
            for (const FilterSign sign : kFilterSigns) visit(m, n, sign);
        }
    }
}

// Checks that all files exist before hours of work.
void require_photographs(const Manifest& manifest) {
    std::size_t missing = 0;
    std::vector<std::string> named;
    const auto ask = [&](const std::filesystem::path& file, const std::string& what) {
        std::error_code unknown;
        if (std::filesystem::is_regular_file(file, unknown)) return;
        if (missing++ < kNamedMissing) named.push_back(fmt::format("{} ({})", one_line(file.string()), what));
    };
    for (const Shot& dark : manifest.darks) ask(dark.file, "dark, " + seconds_text(dark.seconds));
    for_each_view(manifest.rig.views, [&](int m, int n, FilterSign sign) {
        if (missing > 1'000'000) return;  // the manifest describes other views than were taken
        for (const Shot& shot : manifest.shots(m, n, sign))
            ask(shot.file, view_text(m, n, sign) + ", " + seconds_text(shot.seconds));
    });
    if (missing == 0) return;
    input_error(manifest.place, "{}{} of {} photographs are missing: {}{}",
                missing > 1'000'000 ? "over " : "", missing, manifest.shot_count() + manifest.darks.size(),
                fmt::join(named, "; "), missing > named.size() ? "; ..." : "");
}

// Holds what all views share: the photographs' format, the dark frames, and the map to M.
class Bench {
  public:
    Bench(const Manifest& manifest, const PhotographReader& reader, const Workers& workers)
        : manifest_(manifest),
          reader_(reader),
          first_(reader(manifest.shots(0, 0, FilterSign::positive).front(), {})) {
        const CameraCalibration& camera = manifest.camera;
        const bool whole = first_.most > 0;
        noise_.gain = camera.gain;
        noise_.read_noise = camera.read_noise;
        noise_.step = whole ? 1 : 0;
        if (whole) noise_.saturated = first_.most, noise_.black = 0;
        if (camera.saturated) noise_.saturated = *camera.saturated;
        if (camera.black) noise_.black = *camera.black;
        add_darks(workers);
    }

    const V2i& size() const { return first_.size; }
    int channels() const { return first_.channels; }
    const CountNoise& noise() const { return noise_; }

    AreaMap to_plane() const {
        const V2i& plane = manifest_.rig.pixels;
        const Corners corners =
            manifest_.corners.value_or(corners_of_crop({0, 0}, V2d(first_.size.x, first_.size.y)));
        try {
            // The size of the photographs limits what a manifest can make us allocate.
            const double there = area(corners), wanted = static_cast<double>(plane.x) * plane.y;
            if (there < kLeastDensity * wanted) {
                throw InputError(fmt::format(
                    "M's {} x {} pixels cover {:.0f} pixels of the photographs; expected at least {:.0f}",
                    plane.x, plane.y, there, std::ceil(kLeastDensity * wanted)));
            }
            return photograph_to_plane(first_.size, plane, corners);
        } catch (const InputError& error) {
            throw InputError(manifest_.corners_place, error.what());
        }
    }

    // Reads a photograph and checks that it has the size and kind of the others.
    Photograph read(const Shot& shot, const ShotId& which) const {
        Photograph photograph = reader_(shot, which);
        if (photograph.size != first_.size || photograph.most != first_.most ||
            photograph.channels != first_.channels) {
            const auto kind = [](const Photograph& p) {
                return fmt::format("{} x {} pixels of {}", p.size.x, p.size.y,
                                   p.most == 0     ? "floats"
                                   : p.most == 255 ? "8 bits"
                                                   : "16 bits");
            };
            throw InputError({shot.file.string()},
                             fmt::format("{}, but the others have {}", kind(photograph), kind(first_)));
        }
        return photograph;
    }

    // Returns the dark frame for one channel of such a photograph.
    const DarkFrame& dark(const Shot& shot, int channel) const {
        if (darks_.empty()) return flat_;
        for (const auto& [seconds, frames] : darks_) {
            if (same(seconds, shot.seconds)) return frames[static_cast<std::size_t>(channel)];
        }
        std::vector<std::string> times;
        for (const auto& [seconds, frames] : darks_) times.push_back(seconds_text(seconds));
        throw InputError({shot.file.string()},
                         fmt::format("no dark frame of {}; there are those of {}", seconds_text(shot.seconds),
                                     fmt::join(times, ", ")));
    }

    std::uint64_t hot_pixels() const {
        std::uint64_t count = 0;
        for (const auto& [seconds, frames] : darks_)
            for (const DarkFrame& frame : frames) count += frame.hot.size();
        return count;
    }

    static double area(const Corners& c) {
        const V2d a = c[2] - c[0], b = c[3] - c[1];
        return 0.5 * std::fabs(a.x * b.y - a.y * b.x);
    }

  private:
    static bool same(double a, double b) { return std::fabs(a - b) <= kSameTime * std::max(a, b); }
    void add_darks(const Workers& workers) {
        if (manifest_.darks.empty())
            flat_ = flat_dark(first_.size, static_cast<float>(manifest_.camera.pedestal));
        for (const Shot& shot : manifest_.darks) {
            const bool done = std::any_of(darks_.begin(), darks_.end(),
                                          [&](const auto& dark) { return same(dark.first, shot.seconds); });
            if (done) continue;
            std::vector<Photograph> taken;
            for (std::size_t i = 0; i < manifest_.darks.size(); ++i) {
                const Shot& other = manifest_.darks[i];
                if (same(other.seconds, shot.seconds))
                    taken.push_back(read(other, {true, static_cast<int>(i)}));
            }
            std::vector<DarkFrame> dark;
            for (int c = 0; c < channels(); ++c) {
                std::vector<std::vector<float>> frames;
                for (const Photograph& photograph : taken) {
                    const std::span<const float> counts = photograph.channel(c);
                    frames.emplace_back(counts.begin(), counts.end());
                }
                dark.push_back(dark_frame(frames, first_.size, noise_, manifest_.camera.pedestal, workers));
            }
            darks_.emplace_back(shot.seconds, std::move(dark));
        }
    }

    const Manifest& manifest_;
    const PhotographReader& reader_;
    Photograph first_;
    CountNoise noise_;
    std::vector<std::pair<double, std::vector<DarkFrame>>> darks_;  // by time, one per channel
    DarkFrame flat_;
};

// Returns the matrix [row][column] from R, G and B to X, Y and Z.
Imath::M33d srgb_to_xyz() {
    Imath::M33d m;
    for (int c = 0; c < 3; ++c) {
        Rgb one(0.0F);
        one[c] = 1;
        const V3d xyz = rgb_to_xyz(one);
        for (int row = 0; row < 3; ++row) m[row][c] = xyz[row];
    }
    return m;
}

// The findings of a view, joined in order.
struct Findings {
    std::uint64_t photographs = 0, saturated = 0;
    std::string first_saturated;
    double variance = 0;  // sum over coefficients of both films' variances

    template <typename Archive>
    void fields(Archive& archive) {
        archive(photographs, saturated, first_saturated, variance);
    }
};

class Assembler {
  public:
    Assembler(const Manifest& manifest, const Bench& bench, const AreaMap& to_plane, Assembly& assembly)
        : manifest_(manifest),
          bench_(bench),
          to_plane_(to_plane),
          to_xyz_(manifest.camera.to_xyz.value_or(srgb_to_xyz())),
          assembly_(assembly) {}

    // Adds one view behind one film.
    void add(int m, int n, FilterSign sign, Findings& findings) {
        const std::vector<Shot> shots = manifest_.shots(m, n, sign);
        std::vector<Photograph> taken;
        taken.reserve(shots.size());
        for (const Shot& shot : shots)
            taken.push_back(bench_.read(shot, {false, static_cast<int>(taken.size()), m, n, sign}));
        findings.photographs += shots.size();
        for (int c = 0; c < bench_.channels(); ++c) {
            std::vector<Exposure> exposures;
            for (std::size_t i = 0; i < shots.size(); ++i) {
                const DarkFrame& dark = bench_.dark(shots[i], c);
                exposures.push_back({shots[i].seconds, taken[i].channel(c), dark.level, dark.variance,
                                     manifest_.camera.pedestal});
            }
            MergedExposures merged = merge_exposures(exposures, bench_.noise());
            mend_hot(bench_.dark(shots.front(), c).hot, merged);
            for (const std::uint32_t pixel : merged.saturated) {
                if (!to_plane_.uses(pixel)) continue;
                if (findings.saturated++ == 0) findings.first_saturated = view_text(m, n, sign);
            }
            store({m, n, sign}, c, merged, findings);
        }
    }

  private:
    struct Film {
        int m, n;
        FilterSign sign;
    };
    // Replaces hot pixels that dark current alone fills in the shortest exposure, because they saw nothing.
    void mend_hot(std::span<const std::uint32_t> hot, MergedExposures& merged) const {
        std::vector<std::uint32_t> blind, full;
        std::set_intersection(merged.saturated.begin(), merged.saturated.end(), hot.begin(), hot.end(),
                              std::back_inserter(blind));
        if (blind.empty()) return;
        std::set_difference(merged.saturated.begin(), merged.saturated.end(), blind.begin(), blind.end(),
                            std::back_inserter(full));
        mend(merged.rate, bench_.size(), blind);
        mend(merged.variance, bench_.size(), blind);
        merged.saturated = std::move(full);
    }

    // Rectifies a channel's rates to irradiance on M, and propagates their variance to the coefficients.
    void store(const Film& film, int channel, const MergedExposures& merged, Findings& findings) {
        const Rig& rig = manifest_.rig;
        const auto pixels = static_cast<std::size_t>(rig.pixels.x) * static_cast<std::size_t>(rig.pixels.y);
        const std::size_t start = rig.index(film.m, film.n, 0, 0);
        const bool positive = film.sign == FilterSign::positive;
        double scale = manifest_.camera.scale / manifest_.camera.transmission[positive ? 0 : 1];  // > 0
        if (assembly_.images.coloured()) {
            plane_.resize(pixels);
            to_plane_.means(merged.rate, plane_);
            const Imath::M33d& to_xyz = to_xyz_;
            for (const int c : assembly_.images.channels()) {
                float* out = assembly_.images.of(film.sign, c).data() + start;
                for (std::size_t i = 0; i < pixels; ++i)
                    out[i] += static_cast<float>(double{plane_[i]} * scale * to_xyz[c][channel]);
            }
            scale *= to_xyz[1][channel];  // the noise is that of Y
        } else {
            const std::span<float> out(assembly_.images.of(film.sign).data() + start, pixels);
            to_plane_.means(merged.rate, out);
            for (float& value : out) value = static_cast<float>(double{value} * scale);
        }
        if (!manifest_.camera.noise_known && assembly_.deviations.empty()) return;
        plane_.resize(pixels);
        to_plane_.variances(merged.variance, plane_);
        const double factor = scale * filter_scale(rig, film.sign);
        for (std::size_t i = 0; i < pixels; ++i) {
            const double variance = double{plane_[i]} * factor * factor;
            findings.variance += variance;
            // `deviations` holds variances until all films are added.
            if (!assembly_.deviations.empty())
                assembly_.deviations[start + i] += static_cast<float>(variance);
        }
    }

    const Manifest& manifest_;
    const Bench& bench_;
    const AreaMap& to_plane_;
    Imath::M33d to_xyz_;
    Assembly& assembly_;
    std::vector<float> plane_;
};

void join(const std::vector<Findings>& all, bool noise_known, Assembly& assembly, Monitor& monitor) {
    double variance = 0;
    std::string first;
    for (const Findings& findings : all) {
        assembly.photographs += findings.photographs;
        assembly.saturated += findings.saturated;
        variance += findings.variance;
        if (first.empty()) first = findings.first_saturated;
    }
    const Rig& rig = assembly.images.rig;
    const double plus = filter_scale(rig, FilterSign::positive),
                 minus = filter_scale(rig, FilterSign::negative);
    double squares = 0;
    for (std::size_t i = 0; i < assembly.images.positive.size(); ++i) {
        const double e =
            plus * double{assembly.images.positive[i]} - minus * double{assembly.images.negative[i]};
        squares += e * e;
    }
    const auto count = static_cast<double>(assembly.images.positive.size());  // a rig has at least one
    assembly.signal = std::sqrt(squares / count);
    assembly.noise = noise_known ? std::sqrt(variance / count) : 0;
    if (assembly.saturated > 0) {
        monitor.warn(
            fmt::format("{} pixels are saturated in every exposure, the first in {}: their values are lower "
                        "bounds; add shorter exposures",
                        assembly.saturated, first));
    }
    if (assembly.noise > kMuchNoise * assembly.signal) {
        monitor.warn(
            fmt::format("the noise of the coefficients is {:.0f} % of their root mean square; use longer "
                        "exposures or larger pixels of M",
                        assembly.signal > 0 ? 100 * assembly.noise / assembly.signal : 100.0));
    }
}

}  // namespace

Assembly assemble(const Manifest& manifest, const Workers& workers, Monitor& monitor,
                  const AssembleOptions& options) {
    require_photographs(manifest);
    const auto from_files = [&](const Shot& shot, const ShotId&) {
        return read_photograph(shot.file, manifest.channel);
    };
    return assemble(manifest, from_files, workers, monitor, options);
}

Assembly assemble(const Manifest& manifest, const PhotographReader& reader, const Workers& workers,
                  Monitor& monitor, const AssembleOptions& options) {
    const Bench bench(manifest, reader, workers);
    const AreaMap to_plane = bench.to_plane();
    const Rig& rig = manifest.rig;
    Assembly assembly;
    assembly.images.rig = rig;
    assembly.images.info = manifest.info;
    assembly.images.flux = manifest.flux;
    const bool coloured = bench.channels() == 3;
    const std::size_t arrays = (coloured ? 6U : 2U) + (options.deviations ? 1U : 0U);
    require_memory(bytes_of(rig.coefficients(), arrays * sizeof(float)),
                   fmt::format("filter images of {} coefficients", rig.coefficients()),
                   "use fewer views or pixels");
    assembly.images.allocate(coloured);
    if (options.deviations) assembly.deviations.resize(rig.coefficients());
    assembly.size = bench.size();
    assembly.hot = bench.hot_pixels();
    assembly.density =
        Bench::area(manifest.corners.value_or(corners_of_crop({0, 0}, V2d(bench.size().x, bench.size().y)))) /
        (static_cast<double>(rig.pixels.x) * rig.pixels.y);
    if (assembly.density < 1) {
        monitor.warn(fmt::format("the photographs are coarser than M: {:.2g} of their pixels to one of M's",
                                 assembly.density));
    }

    // Each view writes its own coefficients, so the order of views does not matter.
    const std::int64_t views = std::int64_t{rig.views.x} * rig.views.y;
    std::vector<Findings> findings(static_cast<std::size_t>(views));
    Phase phase(monitor, "photographs", static_cast<std::uint64_t>(views));
    constexpr const char* kStopped = "photographs: stopped";
    const auto assemble_view = [&](std::int64_t view) {
        if (!workers.ranks && monitor.stopped()) throw Stopped(kStopped);
        Assembler assembler(manifest, bench, to_plane, assembly);
        const auto m = static_cast<int>(view / rig.views.y), n = static_cast<int>(view % rig.views.y);
        for (const FilterSign sign : kFilterSigns)
            assembler.add(m, n, sign, findings[static_cast<std::size_t>(view)]);
    };
    const std::size_t in_view = rig.coefficients() / static_cast<std::size_t>(views);
    const auto fields = [&](std::int64_t view, auto& archive) {
        findings[static_cast<std::size_t>(view)].fields(archive);
        const auto add = [&](std::vector<float>& of) {
            auto own = std::span(of).subspan(static_cast<std::size_t>(view) * in_view, in_view);
            archive(own);
        };
        for (const int c : assembly.images.channels())
            for (const FilterSign sign : kFilterSigns) add(assembly.images.of(sign, c));
        if (options.deviations) add(assembly.deviations);
    };
    if (!shared_chunks(workers, "photographs", views, ResultsGo::to_rank_0, assemble_view, fields,
                       [&](std::int64_t more) { phase.advance(static_cast<std::uint64_t>(more)); }))
        throw Stopped(kStopped);
    for (float& variance : assembly.deviations) variance = std::sqrt(variance);
    join(findings, manifest.camera.noise_known, assembly, monitor);
    assembly.images.info.provenance =
        fmt::format("{}{}assembled from {} photographs", manifest.info.provenance,
                    manifest.info.provenance.empty() ? "" : "; ", assembly.photographs);
    return assembly;
}

}  // namespace lucerna
