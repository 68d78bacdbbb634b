// A light whose surface is not there for rays. No direction that was drawn without it meets it, so its own
// samples are the only ones, as a delta light's are: nothing to be weighed against [Veach 1997, 9.2].
#include "lights/analytic.h"

namespace lucerna {
namespace {

class UnseenLight final : public Light {
  public:
    explicit UnseenLight(std::unique_ptr<Light> light) : light_(std::move(light)) {}

    std::string_view kind() const override { return light_->kind(); }
    FluxUnit unit() const override { return light_->unit(); }
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
