#include "lights/measured.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "lights/cell_emission.h"

namespace lucerna {
namespace {

// Rays in proportion to what the eye has of their flux, flux · Y, so that all particles are of one luminance.
// The running sums are searched from where a guide of as many entries leads to: a constant number of steps on
// average [Chen and Asau 1974], and a monotone map, so that stratified numbers stay stratified over the file.
class RayChoice {
  public:
    explicit RayChoice(const RaySet& set) {
        const std::vector<LampRay>& rays = set.rays;
        upto_.reserve(rays.size());
        for (std::size_t i = 0; i < rays.size(); ++i)
            upto_.push_back(total_ += double{rays[i].flux} * set.xyz_of(i).y);
        guide_.resize(rays.size() + 1);
        std::size_t item = 0;
        for (std::size_t bucket = 0; bucket < rays.size(); ++bucket) {
            const double begin = total_ * static_cast<double>(bucket) / static_cast<double>(rays.size());
            while (item + 1 < rays.size() && upto_[item] <= begin) ++item;
            guide_[bucket] = item;
        }
        guide_.back() = rays.empty() ? 0 : rays.size() - 1;
    }
    double total() const { return total_; }
    // u in [0, 1). Requires total() > 0. A ray without light is never chosen.
    std::size_t draw(double u) const {
        const double target = u * total_;
        const auto n = static_cast<double>(upto_.size());
        const auto bucket = std::min(upto_.size() - 1, static_cast<std::size_t>(u * n));
        const auto first = upto_.begin() + static_cast<std::ptrdiff_t>(guide_[bucket]);
        // Rounding of the bucket's border may point a little too far: the sums say.
        const auto from = first != upto_.begin() && *(first - 1) > target ? upto_.begin() : first;
        auto found = std::upper_bound(
            from, upto_.begin() + static_cast<std::ptrdiff_t>(guide_[bucket + 1]) + 1, target);
        if (found == upto_.end() || *found <= target) found = std::upper_bound(from, upto_.end(), target);
        // Past the last ray by rounding: the last that has light.
        if (found == upto_.end()) found = std::lower_bound(upto_.begin(), upto_.end(), total_);
        return static_cast<std::size_t>(found - upto_.begin());
    }

  private:
    std::vector<double> upto_;  // sums of flux · Y up to and with ray i
    std::vector<std::size_t> guide_;
    double total_ = 0;
};

// Of each ray in linear sRGB: luminance 1, no component negative, as particles need it.
std::vector<Rgb> colours_in_gamut(const RaySet& set) {
    std::vector<Rgb> colours;
    colours.reserve(set.tristimulus.size());
    for (const V3f& xyz : set.tristimulus) colours.push_back(colour_of_luminance_one(xyz_to_rgb(V3d(xyz))));
    return colours;
}

class RayLight final : public Light {
  public:
    RayLight(RaySet set, const RayLightSettings& settings)
        : set_(std::move(set)),
          choice_(set_),
          colours_(colours_in_gamut(set_)),
          mean_colour_(mean_colour()),
          placement_(settings.world_from_light, V3d(0, 0, 0), {settings.file.string()}),
          flux_(settings.power > 0 ? double{settings.power}
                                   : choice_.total() * double{settings.power_scale}) {
        set_.tristimulus = {};  // colours_ has taken its place
    }

    std::string_view kind() const override { return "rayfile"; }
    FluxUnit unit() const override { return set_.unit; }
    bool is_delta() const override { return true; }
    bool only_particles() const override { return true; }
    Rgb flux() const override { return static_cast<float>(flux_) * mean_colour_; }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (!(flux_ > 0)) return std::nullopt;
        // One float tells 2^24 rays apart; files have more.
        const double number = double{u.position.x} + 0x1p-24 * double{u.position.y};
        const std::size_t i = choice_.draw(std::min(number, 0x1.fffffffffffffp-1));
        const LampRay& ray = set_.rays[i];
        const V3f d = to_float(placement_.vector(V3d(ray.d)).normalized());
        return LeSample{{to_float(placement_.point(V3d(ray.o)))},
                        d,
                        static_cast<float>(flux_) * (colours_.empty() ? mean_colour_ : colours_[i])};
    }

    std::optional<LightSample> sample_Li(const V3f& /*x*/, const V2f& /*u*/,
                                         std::optional<CellId> /*cell*/) const override {
        return std::nullopt;
    }

  private:
    // The mean of what is emitted, which the gamut may have made another colour than the set's.
    Rgb mean_colour() const {
        if (colours_.empty()) return set_.colour();
        V3d sum(0, 0, 0);
        double flux = 0;
        for (std::size_t i = 0; i < colours_.size(); ++i) {
            const double light = double{set_.rays[i].flux} * set_.xyz_of(i).y;
            sum += light * V3d(colours_[i]);
            flux += light;
        }
        return flux > 0 ? Rgb(V3f(sum / flux)) : Rgb(1);
    }

    RaySet set_;
    RayChoice choice_;
    std::vector<Rgb> colours_;  // of the rays, luminance 1; empty: all of mean_colour_
    Rgb mean_colour_;
    Placement placement_;
    double flux_;  // of all that leaves [the set's unit]
};

}  // namespace

std::unique_ptr<Light> make_ray_light(RaySet rays, const RayLightSettings& settings) {
    const Location at{settings.file.string()};
    if (!std::isfinite(settings.power_scale) || settings.power_scale < 0)
        input_error(at, "power scale {}; finite and not negative", settings.power_scale);
    if (!std::isfinite(settings.power) || settings.power < 0)
        input_error(at, "power {}; finite and not negative (0: as measured)", settings.power);
    bool lit = false;
    for (std::size_t i = 0; i < rays.rays.size(); ++i)
        lit = lit || (rays.rays[i].flux > 0 && rays.xyz_of(i).y > 0);
    if (!lit) throw InputError(at, "no ray carries flux");
    return std::make_unique<RayLight>(std::move(rays), settings);
}

std::unique_ptr<Light> make_ray_light(const RayLightSettings& settings, Monitor& monitor) {
    return make_ray_light(read_rays(settings.file, monitor), settings);
}

}  // namespace lucerna
