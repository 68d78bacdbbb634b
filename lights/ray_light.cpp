#include "lights/measured.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "lights/cell_emission.h"

namespace lucerna {
namespace {

float mean_of_channels(const Rgb& c) {
    return (c.x + c.y + c.z) / 3;
}

// The emission of a set's rays: flux · Y of each, and its colour in the working space without negative
// components, as particles need it.
//
// Spectral colours lie outside a gamut, for example an LED's outside sRGB's, but their sum, a white LED's
// light, lies inside. Mixing each ray with grey would change the lamp's colour: an LED's deep blue has so
// little luminance that no blue of sRGB is as blue. So negative components are set to 0, and each channel is
// scaled down to the total of all rays. The lamp keeps its flux and colour, while places that are lit by one
// spectral colour change in luminance. If the lamp's own colour is out of gamut and was mixed with grey, the
// same grey is added to each ray.
class EmittedColours {
  public:
    EmittedColours(const RaySet& set, const WorkingSpace& colours)
        : mean_(light_of_luminance_one(colours, set.xyz)) {
        for (std::size_t i = 0; i < set.rays.size(); ++i) light_ += set.light_of(i);
        if (!set.coloured() || !(light_ > 0)) return;
        each_.reserve(set.rays.size());
        V3d sum(0, 0, 0);
        for (std::size_t i = 0; i < set.rays.size(); ++i) {
            const V3d xyz = set.xyz_of(i);
            const Rgb colour = xyz.y > 0 ? colours.open_light_of_xyz(xyz / xyz.y) : Rgb(0);
            each_.push_back({std::max(0.0F, colour.x), std::max(0.0F, colour.y), std::max(0.0F, colour.z)});
            sum += set.light_of(i) * V3d(each_.back());
        }
        Rgb scale(1), grey(0);
        for (int c = 0; c < 3; ++c) {
            const double clipped = sum[c] / light_, wanted = double{mean_[c]};
            if (clipped > wanted) scale[c] = static_cast<float>(wanted / clipped);
            grey[c] = static_cast<float>(std::max(0.0, wanted - clipped));
        }
        for (Rgb& colour : each_) colour = colour * scale + grey;
    }
    const Rgb& of(std::size_t ray) const { return each_.empty() ? mean_ : each_[ray]; }
    // Returns the mean colour of all emitted light.
    const Rgb& mean() const { return mean_; }
    double light() const { return light_; }  // the sum of flux · Y

  private:
    std::vector<Rgb> each_;  // empty: all have mean_
    Rgb mean_;
    double light_ = 0;
};

// Draws rays in proportion to the mean of the three channels of their emission. Drawing by luminance would
// make the few rays of a deep blue, each many times as blue as the lamp, a source of blue noise; the mean
// costs little noise in luminance. A guide with one entry per ray leads into the cumulative sums: the search
// takes a constant number of steps on average [Chen and Asau 1974], and the map is monotone, so that
// stratified numbers stay stratified over the file.
class RayChoice {
  public:
    RayChoice(const RaySet& set, const EmittedColours& colours) {
        const std::vector<LampRay>& rays = set.rays;
        upto_.reserve(rays.size());
        for (std::size_t i = 0; i < rays.size(); ++i) {
            upto_.push_back(total_ += set.light_of(i) * double{mean_of_channels(colours.of(i))});
        }
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
    // Requires u in [0, 1) and total() > 0. A ray without light is never drawn.
    std::size_t draw(double u) const {
        const double target = u * total_;
        const auto n = static_cast<double>(upto_.size());
        const auto bucket = std::min(upto_.size() - 1, static_cast<std::size_t>(u * n));
        const auto first = upto_.begin() + static_cast<std::ptrdiff_t>(guide_[bucket]);
        // Rounding of the bucket's boundary may point slightly too far; then the search starts at the
        // beginning.
        const auto from = first != upto_.begin() && *(first - 1) > target ? upto_.begin() : first;
        auto found = std::upper_bound(
            from, upto_.begin() + static_cast<std::ptrdiff_t>(guide_[bucket + 1]) + 1, target);
        if (found == upto_.end() || *found <= target) found = std::upper_bound(from, upto_.end(), target);
        // If rounding leads past the last ray, the last one with light is drawn.
        if (found == upto_.end()) found = std::lower_bound(upto_.begin(), upto_.end(), total_);
        return static_cast<std::size_t>(found - upto_.begin());
    }

  private:
    std::vector<double> upto_;  // upto_[i] is the sum over rays 0 to i
    std::vector<std::size_t> guide_;
    double total_ = 0;
};

class RayLight final : public Light {
  public:
    RayLight(RaySet set, const RayLightSettings& settings)
        : Light(settings.unit.taken(set.unit)),
          set_(std::move(set)),
          colours_(set_, settings.colours),
          choice_(set_, colours_),
          placement_(settings.world_from_light, V3d(0, 0, 0), {settings.file.string()}),
          flux_(flux_of(settings)) {
        set_.tristimulus = {};  // colours_ replaces it
    }

    std::string_view kind() const override { return "rayfile"; }
    bool is_delta() const override { return true; }
    bool only_particles() const override { return true; }
    Rgb flux() const override { return static_cast<float>(flux_) * colours_.mean(); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (!(flux_ > 0)) return std::nullopt;
        // A float distinguishes 2^24 rays; files have more.
        const double number = double{u.position.x} + 0x1p-24 * double{u.position.y};
        const std::size_t i = choice_.draw(std::min(number, kBelowOneD));
        const LampRay& ray = set_.rays[i];
        const V3f d = to_float(placement_.vector(V3d(ray.d)).normalized());
        // The scale is flux · colour · share of the light / probability.
        const Rgb& colour = colours_.of(i);
        const double scale = flux_ * choice_.total() / (colours_.light() * double{mean_of_channels(colour)});
        return LeSample{{to_float(placement_.point(V3d(ray.o)))}, d, static_cast<float>(scale) * colour};
    }

    std::optional<LightSample> sample_Li(const V3f& /*x*/, const V2f& /*u*/,
                                         std::optional<CellId> /*cell*/) const override {
        return std::nullopt;
    }

  private:
    double flux_of(const RayLightSettings& settings) const {
        const double scale{settings.power_scale};
        if (settings.power > 0) return double{settings.power} * scale;
        const Location at{settings.file.string()};
        return colours_.light() * unit_factor(settings.unit, set_.unit, set_.lumens_per_watt, at) * scale;
    }

    RaySet set_;
    EmittedColours colours_;
    RayChoice choice_;
    Placement placement_;
    double flux_;  // total [the light's unit]
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
