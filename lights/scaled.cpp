#include "lights/scaled.h"

#include <cassert>
#include <utility>

namespace lucerna {
namespace {

class ScaledLight final : public Light {
  public:
    ScaledLight(std::unique_ptr<Light> light, const Rgb& factor)
        : Light(light->unit()), light_(std::move(light)), factor_(factor) {}

    std::string_view kind() const override { return light_->kind(); }
    bool is_at_infinity() const override { return light_->is_at_infinity(); }
    Rgb flux() const override { return light_->flux() * factor_; }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        std::optional<LeSample> sample = light_->sample_Le(u);
        if (sample) sample->weight *= factor_;
        return sample;
    }
    void sample_Le_many(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const override {
        light_->sample_Le_many(u, out);
        for (std::optional<LeSample>& sample : out) {
            if (sample) sample->weight *= factor_;
        }
    }
    std::optional<LightSample> sample_Li(const V3f& x, const V2f& u,
                                         std::optional<CellId> cell) const override {
        std::optional<LightSample> sample = light_->sample_Li(x, u, cell);
        if (sample) sample->weight *= factor_;
        return sample;
    }
    CellId part_of(CellId cell) const override { return light_->part_of(cell); }
    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        std::optional<EmittedRadiance> emitted = light_->Le(ray);
        if (emitted) emitted->radiance *= factor_;
        return emitted;
    }
    EmittedRadiance Le_on_surface(const Ray& ray, float t, const V3f& n,
                                  std::uint32_t primitive) const override {
        EmittedRadiance emitted = light_->Le_on_surface(ray, t, n, primitive);
        emitted.radiance *= factor_;
        return emitted;
    }

    std::optional<LightBounds> bounds() const override { return light_->bounds(); }
    std::span<const LightBounds> part_bounds() const override { return light_->part_bounds(); }
    std::optional<float> arriving(const V3f& x) const override { return light_->arriving(x); }
    bool is_delta() const override { return light_->is_delta(); }
    bool only_particles() const override { return light_->only_particles(); }
    bool has_impostor() const override { return light_->has_impostor(); }

  private:
    std::unique_ptr<Light> light_;
    Rgb factor_;
};

}  // namespace

std::unique_ptr<Light> make_scaled_light(std::unique_ptr<Light> light, const Rgb& factor) {
    assert(light && is_finite(factor) && factor.x >= 0 && factor.y >= 0 && factor.z >= 0);
    return std::make_unique<ScaledLight>(std::move(light), factor);
}

}  // namespace lucerna
