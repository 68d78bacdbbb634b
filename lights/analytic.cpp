// Analytic lights (area lights are in area.cpp), and lights whose surface is invisible to rays.
#include "lights/analytic.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"

namespace lucerna {

// An isotropic point light.

namespace {

class PointLight final : public Light {
  public:
    PointLight(const V3f& position, const Rgb& intensity, FluxUnit unit)
        : Light(unit), position_(position), intensity_(intensity) {}

    std::string_view kind() const override { return "point"; }
    bool is_delta() const override { return true; }
    Rgb flux() const override { return intensity_ * (4 * kPi); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(intensity_)) return std::nullopt;
        return LeSample{{position_}, square_to_sphere(u.direction), flux()};
    }

    std::optional<LightSample> sample_Li(const V3f& x, const V2f&, std::optional<CellId>) const override {
        return sample_Li_from_point(position_, x, intensity_);
    }
    std::optional<LightBounds> bounds() const override { return LightBounds{Box3f(position_)}; }

  private:
    V3f position_;   // scene units
    Rgb intensity_;  // W/sr
};

}  // namespace

std::optional<LightSample> sample_Li_from_point(const V3f& position, const V3f& x, const Rgb& intensity) {
    const V3d way = V3d(position) - V3d(x);
    const double r2 = way.length2();
    if (is_black(intensity) || !(r2 > 0)) return std::nullopt;
    const double r = std::sqrt(r2);
    const Rgb weight = intensity * static_cast<float>(1 / r2);
    if (!is_finite(weight)) return std::nullopt;  // x is the light itself, within float32
    // Lamps sit in ceilings, so geometry at the point itself must not occlude it.
    const auto distance = static_cast<float>(r);
    return LightSample{V3f(way / r), std::fmax(0.0F, distance - surface_error(position, distance)), weight,
                       0};
}

std::unique_ptr<Light> make_point_light(const V3f& position, const Rgb& intensity, FluxUnit unit) {
    return std::make_unique<PointLight>(position, intensity, unit);
}

// A spot light with pbrt's falloff. With c = cosθ from the axis, the intensity is I · s((c -
// c_total)/(c_start - c_total)), where s(t) = 3t² - 2t³ on [0,1], 0 below and 1 above. The mean of s over the
// rim is 1/2 and its integral from 0 is t³ - t⁴/2, so the flux is 2πI [(1 - c_start) + (c_start -
// c_total)/2], and directions are drawn in proportion to intensity.

namespace {

// Returns 1 - cosθ, exact for thin cones.
double one_minus_cos(double radians) {
    return 2 * sqr(sin(radians / 2));
}

// Returns the t in [0,1] with 2t³ - t⁴ = u, by Newton's method within bounds that bisection shrinks.
double invert_rim(double u) {
    double low = 0;
    double high = 1;
    double t = cbrt(u / 2);  // exact at both ends up to a factor near 1
    for (int i = 0; i < 60 && high - low > 1e-12; ++i) {
        const double f = t * t * t * (2 - t) - u;
        if (std::fabs(f) < 1e-14) break;
        (f < 0 ? low : high) = t;
        const double slope = t * t * (6 - 4 * t);
        const double next = slope > 0 ? t - f / slope : low;
        t = next > low && next < high ? next : 0.5 * (low + high);
    }
    return t;
}

class SpotLight final : public Light {
  public:
    SpotLight(const V3f& position, const V3f& axis, const Rgb& intensity, const SpotCone& cone, FluxUnit unit)
        : Light(unit),
          position_(position),
          frame_(axis.normalized()),
          intensity_(intensity),
          falloff_(cone.falloff) {
        const double end = std::clamp(static_cast<double>(cone.degrees), 0.0, 180.0);
        const double start = std::clamp(end - static_cast<double>(cone.delta_degrees), 0.0, end);
        start_ = one_minus_cos(start * kRadiansPerDegree);
        total_ = one_minus_cos(end * kRadiansPerDegree);
    }

    std::string_view kind() const override { return "spot"; }
    bool is_delta() const override { return true; }
    Rgb flux() const override { return intensity_ * static_cast<float>(solid_angle()); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(intensity_) || !(solid_angle() > 0)) return std::nullopt;
        const double part = static_cast<double>(u.direction.x) * (start_ + rim_integral());
        // The full cone is uniform in the cosine; the rim inverts its integral.
        const double h = part < start_ ? part : total_ - rim() * t_of_rim(rim_u(part));
        const double r = std::sqrt(std::max(0.0, h * (2 - h)));
        const float phi = 2 * kPi * u.direction.y;
        const V3f local(static_cast<float>(r) * cos(phi), static_cast<float>(r) * sin(phi),
                        static_cast<float>(1 - h));
        return LeSample{{position_}, frame_.to_world(local).normalized(), flux()};
    }

    std::optional<LightSample> sample_Li(const V3f& x, const V2f&, std::optional<CellId>) const override {
        const V3d way = V3d(x) - V3d(position_);
        const double r = way.length();
        if (!(r > 0)) return std::nullopt;
        // Half the squared chord between unit vectors gives 1 - cosθ without cancellation near the axis.
        const double h = 0.5 * (way / r - V3d(frame_.n)).length2();
        return sample_Li_from_point(position_, x, intensity_ * static_cast<float>(falloff(h)));
    }
    // The bounds treat the intensity as constant over the cone.
    std::optional<LightBounds> bounds() const override {
        const auto cone = static_cast<float>(2 * asin(std::sqrt(std::min(1.0, total_ / 2))));
        return LightBounds{Box3f(position_), frame_.n, cone, 0};
    }

  private:
    double rim() const { return total_ - start_; }
    // Integrates the falloff over 1 - cos within the rim.
    double rim_integral() const { return falloff_ == SpotFalloff::quadratic ? rim() / 3 : rim() / 2; }
    double solid_angle() const { return 2 * kPiD * (start_ + rim_integral()); }  // sr, weighted

    // The rim is darkest at its outer edge, where u = 0.
    double rim_u(double part) const {
        return rim() > 0 ? std::clamp(1 - (part - start_) / rim_integral(), 0.0, 1.0) : 1.0;
    }

    // Returns the t at which the falloff's integral from the outer edge is the share u of the rim's.
    double t_of_rim(double u) const { return falloff_ == SpotFalloff::quadratic ? cbrt(u) : invert_rim(u); }

    double falloff(double h) const {
        if (h <= start_) return 1;
        if (h >= total_) return 0;
        const double t = (total_ - h) / rim();  // > 0: start < h < total
        return falloff_ == SpotFalloff::quadratic ? t * t : t * t * (3 - 2 * t);
    }

    V3f position_;   // scene units
    Frame frame_;    // n is the axis
    Rgb intensity_;  // W/sr on the axis
    SpotFalloff falloff_;
    double start_ = 0, total_ = 0;  // 1 - cos of the angles where the falloff starts and ends
};

}  // namespace

std::unique_ptr<Light> make_spot_light(const V3f& position, const V3f& axis, const Rgb& intensity,
                                       const SpotCone& cone, FluxUnit unit) {
    return std::make_unique<SpotLight>(position, axis, intensity, cone, unit);
}

// Parallel light, as from the sun.

namespace {

class DistantLight final : public Light {
  public:
    DistantLight(const V3f& direction, const Rgb& irradiance, const SceneSphere& scene, FluxUnit unit)
        : Light(unit), frame_(direction.normalized()), irradiance_(irradiance), scene_(scene) {}

    std::string_view kind() const override { return "distant"; }
    bool is_at_infinity() const override { return true; }
    bool is_delta() const override { return true; }
    // The flux through the disc that covers the scene, including light that misses the scene.
    Rgb flux() const override { return irradiance_ * (kPi * sqr(scene_.radius)); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(irradiance_)) return std::nullopt;
        return particle_from_afar(scene_, frame_, u.position, flux());
    }

    std::optional<LightSample> sample_Li(const V3f&, const V2f&, std::optional<CellId>) const override {
        if (is_black(irradiance_)) return std::nullopt;
        return LightSample{-frame_.n, INFINITY, irradiance_, 0};
    }

  private:
    Frame frame_;     // n is the direction of propagation
    Rgb irradiance_;  // W/m² on a plane that faces the light
    SceneSphere scene_;
};

}  // namespace

std::unique_ptr<Light> make_distant_light(const V3f& direction, const Rgb& irradiance,
                                          const SceneSphere& scene, FluxUnit unit) {
    return std::make_unique<DistantLight>(direction, irradiance, scene, unit);
}

// A sky of constant radiance. A particle's line is uniform among the lines that meet the scene's sphere: a
// uniform direction, and a uniform point of the disc of radius R across it. The measure of these lines is 4π
// · πR², hence the flux 4π²R² L.

namespace {

class InfiniteLight final : public Light {
  public:
    InfiniteLight(const Rgb& radiance, const SceneSphere& scene, FluxUnit unit)
        : Light(unit), radiance_(radiance), scene_(scene) {}

    std::string_view kind() const override { return "infinite"; }
    bool is_at_infinity() const override { return true; }
    bool has_impostor() const override { return true; }
    Rgb flux() const override { return radiance_ * (4 * kPi * kPi * sqr(scene_.radius)); }
    std::optional<double> sky_irradiance() const override { return kPiD * double{luminance(radiance_)}; }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(radiance_)) return std::nullopt;
        const Frame frame(square_to_sphere(u.direction).normalized());
        return particle_from_afar(scene_, frame, u.position, flux());
    }

    std::optional<LightSample> sample_Li(const V3f&, const V2f& u, std::optional<CellId>) const override {
        if (is_black(radiance_)) return std::nullopt;
        return LightSample{square_to_sphere(u).normalized(), INFINITY, radiance_ * (4 * kPi), kSpherePdfW};
    }

    // Rays with a finite end do not reach the sky.
    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        if (ray.t_max < INFINITY) return std::nullopt;
        return EmittedRadiance{radiance_, kSpherePdfW, INFINITY};
    }

  private:
    Rgb radiance_;  // W/(m² sr)
    SceneSphere scene_;
};

}  // namespace

std::unique_ptr<Light> make_infinite_light(const Rgb& radiance, const SceneSphere& scene, FluxUnit unit) {
    return std::make_unique<InfiniteLight>(radiance, scene, unit);
}

// A light whose surface is invisible to rays. Rays drawn otherwise never meet it, so that its own samples are
// the only ones, as for a delta light, and need no MIS weight [Veach 1997, 9.2].

namespace {

class UnseenLight final : public Light {
  public:
    explicit UnseenLight(std::unique_ptr<Light> light) : Light(light->unit()), light_(std::move(light)) {}

    std::string_view kind() const override { return light_->kind(); }
    bool is_at_infinity() const override { return light_->is_at_infinity(); }
    Rgb flux() const override { return light_->flux(); }
    std::optional<LeSample> sample_Le(const LeSampleU& u) const override { return light_->sample_Le(u); }
    std::optional<LightSample> sample_Li(const V3f& x, const V2f& u,
                                         std::optional<CellId> cell) const override {
        std::optional<LightSample> light_sample = light_->sample_Li(x, u, cell);
        if (light_sample) light_sample->pdf_w = 0;
        return light_sample;
    }
    std::optional<LightBounds> bounds() const override { return light_->bounds(); }
    bool is_delta() const override { return true; }

  private:
    std::unique_ptr<Light> light_;
};

}  // namespace

std::unique_ptr<Light> make_unseen_light(std::unique_ptr<Light> light) {
    return std::make_unique<UnseenLight>(std::move(light));
}

}  // namespace lucerna
