#include "engine/render/igi_estimator.h"

#include "engine/render/igi_shade.h"
#include "engine/render/specular_chain.h"

namespace lucerna {
namespace {

// Of the scene's diagonal: wide enough to hide the bright spots of some ten virtual lights per set.
constexpr float kDefaultMinDist = 0.02F;

IgiSettings with_distance(const Scene& scene, IgiSettings settings) {
    if (settings.mindist < 0) settings.mindist = kDefaultMinDist * diagonal(scene);
    return settings;
}

class IgiEstimator final : public Estimator {
  public:
    IgiEstimator(const Scene& scene, const IgiSettings& settings, VirtualLightSets sets, std::uint32_t paths)
        : scene_(scene),
          settings_(with_distance(scene, settings)),
          sets_(std::move(sets)),
          shading_(scene, settings_, paths) {}

    Rgb radiance(const Ray& ray, Stream& stream) const override {
        // One well-distributed number chooses the set.
        const auto count = static_cast<float>(sets_.begins.size() - 1);
        const auto set = static_cast<std::size_t>(stream.next() * count);
        const auto shade = [&](const Vertex& vertex) {
            DirectLight shaded = direct_light(scene_, vertex, stream);
            if (!vertex.bsdf.is_black()) shaded.radiance += indirect(vertex, set, stream);
            return shaded;
        };
        if (settings_.quantity == Quantity::illuminance) return meter_and_shade(scene_, ray, shade);
        const auto source = [&](const MediumVertex& vertex, const Rgb& sigma_s) {
            return sigma_s * (direct_light(scene_, vertex, stream) + indirect(vertex, set, stream));
        };
        return follow_and_shade(scene_, ray, settings_.max_specular_depth, stream, shade, source);
    }

  private:
    // All lights of one set.
    template <typename Place>
    Rgb indirect(const Place& place, std::size_t set, Stream& stream) const {
        Rgb sum(0);
        Stream roulette = stream.split(1);
        for (std::uint32_t i = sets_.begins[set]; i < sets_.begins[set + 1]; ++i) {
            sum += shading_.shade(place, sets_.lights[i], roulette);
        }
        return sum;
    }

    const Scene& scene_;
    IgiSettings settings_;
    VirtualLightSets sets_;
    VirtualLightShading shading_;
};

}  // namespace

std::unique_ptr<const Estimator> make_igi_estimator(const Scene& scene, const IgiSettings& settings,
                                                    VirtualLightSets sets, std::uint32_t paths) {
    return std::make_unique<IgiEstimator>(scene, settings, std::move(sets), paths);
}

}  // namespace lucerna
