#include "lights/measurement/camera_simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/image/photograph.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

constexpr double kTwoPi = 6.28318530717958647692;
constexpr std::uint32_t kDarkPhotographs = 0x80000000U;  // photographs of darkness are numbered from here
constexpr std::uint32_t kHotPixels = 0xffffffffU;

double normal(Sampler& sampler) {
    const V2f u = sampler.next2();
    return std::sqrt(-2 * log1p(-double{u.x})) * cos(kTwoPi * double{u.y});  // u.x < 1
}

bool travels(const Rig& rig) {
    return rig.shift.x > 0 || rig.shift.y > 0;
}

// Seen straight on, the pixels of M and the photograph are aligned.
CameraView straight_view(const Rig& rig, const CameraModel& camera) {
    const V2i inner(rig.pixels.x * camera.oversampling.x, rig.pixels.y * camera.oversampling.y);
    return {inner + 2 * camera.margin,
            corners_of_crop(V2d(camera.margin.x, camera.margin.y), V2d(inner.x, inner.y))};
}

// A pinhole at camera.place looks at the centre of M; M's image fills the photograph inside the margin.
CameraView oblique_view(const Rig& rig, const CameraModel& camera) {
    using Imath::V3d;
    CameraView view = straight_view(rig, camera);
    if (camera.photograph.x > 0) view.size = camera.photograph;
    const V3d forward = (V3d(0, 0, rig.distance) - camera.place).normalized();
    const V3d side = forward.cross(std::fabs(forward.y) < 0.999 ? V3d(0, 1, 0) : V3d(1, 0, 0)).normalized();
    const V3d up = side.cross(forward);
    const V2d half(0.5 * rig.pixels.x * rig.pixel.x, 0.5 * rig.pixels.y * rig.pixel.y);
    V2d low(1e300, 1e300), high(-1e300, -1e300);
    const Corners on_m{V2d(-half.x, -half.y), V2d(half.x, -half.y), half, V2d(-half.x, half.y)};
    for (std::size_t i = 0; i < 4; ++i) {
        const V3d ray = V3d(on_m[i].x, on_m[i].y, rig.distance) - camera.place;
        const double depth = ray.dot(forward);
        if (!(depth > 1e-6 * ray.length()))
            throw InputError("camera: it is too close to the screen, or in its plane, to see all of it");
        view.corners[i] = {ray.dot(side) / depth, -ray.dot(up) / depth};  // y runs down
        for (int axis = 0; axis < 2; ++axis) {
            low[axis] = std::min(low[axis], view.corners[i][axis]);
            high[axis] = std::max(high[axis], view.corners[i][axis]);
        }
    }
    for (int axis = 0; axis < 2; ++axis) {
        const double room = view.size[axis] - 2.0 * camera.margin[axis];
        if (!(room >= 1)) {
            throw InputError(
                fmt::format("camera: a photograph of {} x {} pixels is too small for margins of {} and {}",
                            view.size.x, view.size.y, camera.margin.x, camera.margin.y));
        }
        for (V2d& c : view.corners)  // they span some width, as projections of a visible rectangle
            c[axis] = camera.margin[axis] + room * (c[axis] - low[axis]) / (high[axis] - low[axis]);
    }
    return view;
}

}  // namespace

double poisson(double mean, Sampler& sampler) {
    if (!(mean > 0)) return 0;
    if (mean < 64) {  // inversion; e^-64 is far above the smallest double
        double term = exp(-mean), sum = term;
        const double u = double{sampler.next()} + 0x1p-25;  // the middle of its interval of 2^-24
        int k = 0;
        while (u > sum && k < 1000) {
            term *= mean / ++k;
            sum += term;
        }
        return k;
    }
    const double z = normal(sampler);  // Cornish-Fisher to the third cumulant
    return std::max(0.0, std::round(mean + std::sqrt(mean) * z + (z * z - 1) / 6));
}

CountScale::CountScale(const CameraModel& camera) {
    if (camera.bits == 32) {
        pedestal = std::max(camera.pedestal, 0.0);
        return;
    }
    most = (1 << camera.bits) - 1;
    pedestal = camera.pedestal;
    if (pedestal < 0) {  // the counts below it hold six deviations of the read noise
        const double share = std::min(6 * camera.read_noise / camera.full_well, 1.0);
        pedestal = std::ceil(most * share / (1 + share));
    }
    pedestal = std::min(pedestal, 0.5 * most);
    gain = (most - pedestal) / camera.full_well;
}

float simulated_count(double electrons, const CameraModel& camera, const CountScale& scale,
                      Sampler& sampler) {
    double collected = camera.shot_noise ? poisson(electrons, sampler) : electrons;
    if (scale.most > 0) collected = std::min(collected, camera.full_well);
    if (camera.read_noise > 0) collected += camera.read_noise * normal(sampler);
    const double count = scale.pedestal + scale.gain * collected;
    if (scale.most == 0) return static_cast<float>(count);
    return static_cast<float>(std::clamp(std::round(count), 0.0, double(scale.most)));
}

CameraView camera_view(const Rig& rig, const CameraModel& camera) {
    const bool oblique = camera.place.z != 0 && !travels(rig);
    const CameraView view = oblique ? oblique_view(rig, camera) : straight_view(rig, camera);
    constexpr std::int64_t kMostPixels = std::int64_t{1} << 28;  // the limit of read_photograph()
    if (view.size.x > kMostPixels / view.size.y) {
        throw InputError(fmt::format("camera: photographs of {} x {} pixels; the limit is 2^28 pixels",
                                     view.size.x, view.size.y));
    }
    return view;
}

namespace {

class Photographer {
  public:
    Photographer(const FilterImages& images, const CameraModel& camera, const std::filesystem::path& folder)
        : images_(images),
          camera_(camera),
          folder_(folder),
          scale_(camera),
          view_(checked_view(images.rig, camera)),
          to_photograph_(plane_to_photograph(images.rig.pixels, view_.size, view_.corners)) {
        sensitivity_ = camera.sensitivity > 0 ? camera.sensitivity : sensitivity_for_brightest();
        dark_current_.resize(pixels() * channels());
        for (std::size_t i = 0; i < dark_current_.size(); ++i) {
            Sampler sampler(camera.seed, Purpose::acquisition, kHotPixels, i);
            const bool hot = double{sampler.next()} < camera.hot_pixels;
            dark_current_[i] = static_cast<float>(camera.dark_current * (hot ? camera.hot_factor : 1));
        }
    }

    std::size_t pixels() const {
        return static_cast<std::size_t>(view_.size.x) * static_cast<std::size_t>(view_.size.y);
    }

    std::size_t channels() const { return images_.channels().size(); }

    Photograph dark(int number) const {
        const std::vector<float> nothing(pixels() * channels());
        const auto exposure =
            static_cast<std::size_t>(number / camera_.darks);  // number exists, so darks > 0
        return take(nothing, camera_.exposures[exposure],
                    kDarkPhotographs + static_cast<std::uint32_t>(number));
    }
    int darks() const { return camera_.darks * static_cast<int>(camera_.exposures.size()); }

    Photograph view(const ShotId& which) const {
        const Rig& rig = images_.rig;
        const auto plane = static_cast<std::size_t>(rig.pixels.x) * static_cast<std::size_t>(rig.pixels.y);
        std::vector<float> seen(pixels() * channels());
        std::size_t place = 0;
        for (const int c : images_.channels()) {
            to_photograph_.means(
                {images_.of(which.sign, c).data() + rig.index(which.m, which.n, 0, 0), plane},
                std::span(seen).subspan(pixels() * place++, pixels()));
        }
        const int film = (which.m * rig.views.y + which.n) * 2 + (which.sign == FilterSign::positive ? 0 : 1);
        const auto exposures = static_cast<std::uint32_t>(camera_.exposures.size());
        const auto exposure = static_cast<std::uint32_t>(which.number);
        return take(seen, camera_.exposures[exposure],
                    static_cast<std::uint32_t>(film) * exposures + exposure);
    }

    // Returns the manifest of all photographs, whose own file is manifest.place.
    const Manifest& describe() {
        manifest_.place = {(folder_ / "manifest.toml").string()};
        manifest_.rig = images_.rig;
        manifest_.info = images_.info;
        manifest_.flux = images_.flux;
        manifest_.channel = std::string(images_.coloured() ? kColourChannels : kLuminanceChannel);
        if (images_.coloured()) manifest_.camera.to_xyz = Imath::M33d();
        manifest_.corners = view_.corners;
        manifest_.folder = folder_;
        manifest_.name = ShotName(manifest_.place, "view_{m:03}_{n:03}_{sign}_{exposure}" + suffix());
        manifest_.exposures = {camera_.exposures, camera_.exposures};
        CameraCalibration& calibration = manifest_.camera;
        calibration.scale = 1 / (sensitivity_ * scale_.gain);  // both > 0
        calibration.pedestal = scale_.pedestal;
        calibration.gain = camera_.shot_noise ? scale_.gain : 0;
        calibration.read_noise = camera_.read_noise * scale_.gain;
        calibration.noise_known = true;
        // A full pixel is read with noise, too.
        if (scale_.most > 0) calibration.saturated = scale_.most - std::ceil(6 * calibration.read_noise);
        for (std::size_t e = 0; e < camera_.exposures.size(); ++e) {
            for (int i = 0; i < camera_.darks; ++i)
                manifest_.darks.push_back({camera_.exposures[e], dark_file(e, i)});
        }
        return manifest_;
    }

  private:
    static CameraView checked_view(const Rig& rig, const CameraModel& camera) {
        if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
        if ((rig.shift.x > 0) != (rig.shift.y > 0))
            throw InputError("rig: its sensor moves along one axis only; photographs need Setup A or B");
        return camera_view(rig, camera);
    }
    double sensitivity_for_brightest() const {
        float most = 0;
        for (const int c : images_.channels()) {
            for (const FilterSign sign : kFilterSigns)
                for (const float x : images_.of(sign, c)) most = std::max(most, x);
        }
        const double filled = camera_.fill * camera_.full_well / camera_.exposures.front();
        return most > 0 ? filled / double{most} : filled;  // any value will do for darkness
    }
    std::string suffix() const { return camera_.format == "tiff" ? ".tif" : "." + camera_.format; }
    std::filesystem::path dark_file(std::size_t exposure, int number) const {
        return folder_ / fmt::format("dark_{}_{:03}{}", exposure, number, suffix());
    }

    Photograph take(std::span<const float> irradiance, double seconds, std::uint32_t number) const {
        Photograph photograph{view_.size, std::vector<float>(irradiance.size()), scale_.most,
                              static_cast<int>(channels())};
        for (std::size_t i = 0; i < photograph.counts.size(); ++i) {
            Sampler sampler(camera_.seed, Purpose::acquisition, number, i);
            const double electrons =
                (sensitivity_ * std::max(double{irradiance[i]}, 0.0) + double{dark_current_[i]}) * seconds;
            photograph.counts[i] = simulated_count(electrons, camera_, scale_, sampler);
        }
        return photograph;
    }

    const FilterImages& images_;
    const CameraModel& camera_;
    std::filesystem::path folder_;
    CountScale scale_;
    CameraView view_;
    AreaMap to_photograph_;
    double sensitivity_ = 1;
    std::vector<float> dark_current_;  // electrons per second
    Manifest manifest_;
};

void make_folder(const std::filesystem::path& folder) {
    std::error_code error;
    if (!std::filesystem::is_directory(folder, error)) std::filesystem::create_directory(folder, error);
    if (error)
        throw InputError({folder.string()}, "the folder cannot be created: " + one_line(error.message()));
}

}  // namespace

bool is_photographs_name(const std::string& file) {
    return file == "manifest.toml" || file.starts_with("view_") || file.starts_with("dark_");
}

void check_photographs(const Rig& rig, const CameraModel& camera, const std::filesystem::path& folder) {
    camera_view(rig, camera);
    make_folder(folder);
}

void write_photographs(const FilterImages& images, const CameraModel& camera,
                       const std::filesystem::path& folder, const Workers& workers, Monitor& monitor) {
    const Rig& rig = images.rig;
    Photographer photographer(images, camera, folder);
    const Manifest& manifest = photographer.describe();
    make_folder(folder);
    // Until the new manifest is written, an old one would describe a mixture.
    std::error_code none;
    std::filesystem::remove(manifest.place.file, none);
    const std::int64_t views = std::int64_t{rig.views.x} * rig.views.y;
    Phase phase(monitor, "photographs", static_cast<std::uint64_t>(views + photographer.darks()));
    parallel_chunks(workers, photographer.darks(), [&](std::int64_t number) {
        write_photograph(manifest.darks[static_cast<std::size_t>(number)].file,
                         photographer.dark(static_cast<int>(number)));
        phase.advance(1);
    });
    parallel_chunks(workers, views, [&](std::int64_t view) {
        if (monitor.stopped()) throw Stopped("photographs: stopped");
        const int m = static_cast<int>(view / rig.views.y), n = static_cast<int>(view % rig.views.y);
        for (const FilterSign sign : kFilterSigns) {
            int number = 0;
            for (const Shot& shot : manifest.shots(m, n, sign))
                write_photograph(shot.file, photographer.view({false, number++, m, n, sign}));
        }
        phase.advance(1);
    });
    write_manifest(manifest.place.file, manifest);
}

Assembly photographed(const FilterImages& images, const CameraModel& camera, const Workers& workers,
                      Monitor& monitor, const AssembleOptions& options) {
    Photographer photographer(images, camera, {});
    const Manifest manifest = photographer.describe();
    const auto take = [&](const Shot&, const ShotId& which) {
        return which.dark ? photographer.dark(which.number) : photographer.view(which);
    };
    return assemble(manifest, take, workers, monitor, options);
}

}  // namespace lucerna
