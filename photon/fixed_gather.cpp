#include "photon/fixed_gather.h"

#include <algorithm>

#include "photon/shading_normals.h"

namespace lucerna {
namespace {

// Sums what the photons in the disc bring.
class Within final : public PointVisitor {
  public:
    Within(const PhotonMap& map, const TangentMetric& metric, float r2, KernelShape shape, const Bsdf& bsdf,
           const V3f& wo)
        : map_(map),
          metric_(metric),
          r2_(r2),
          ball2_(metric.ball2(r2)),
          shape_(shape),
          bsdf_(bsdf),
          wo_(wo),
          // A Lambertian surface sends on the same share of every photon.
          lambertian_(bsdf.is_lambertian() && bsdf.shading_normal() == bsdf.geometric_normal()) {}

    float visit(std::uint32_t index, float r2) override {
        const Photon& photon = map_.photons()[index];
        const V3f d = photon.direction.unpack();
        const float d2 = metric_(map_.positions()[index], d, r2);
        if (d2 < r2_) {
            ++photons;
            const float weight = kernel(shape_, d2 / r2_);  // r2_ > 0
            sum += lambertian_ ? photon.power * weight
                               : bsdf_.f(wo_, -d, Transport::radiance) * photon.power *
                                     (weight * shading_cosine_ratio(bsdf_, -d));
        }
        return ball2_;
    }

    // Radiance times r².
    Rgb total() const { return lambertian_ ? sum * bsdf_.f(wo_, wo_, Transport::radiance) : sum; }

    Rgb sum{0.0F};
    int photons = 0;

  private:
    const PhotonMap& map_;
    const TangentMetric& metric_;
    float r2_, ball2_;
    KernelShape shape_;
    const Bsdf& bsdf_;
    V3f wo_;
    bool lambertian_;
};

}  // namespace

GatherResult gather_within(const PhotonMap& map, const GatherSettings& settings, float radius, const Hit& hit,
                           const Bsdf& bsdf, const V3f& wo) {
    const V3f n = hit.at.n.dot(wo) < 0 ? -hit.at.n : hit.at.n;
    const float r2 = sqr(std::max(radius, hit.at.error));
    if (!(r2 > 0)) return {};
    const TangentMetric metric(hit.at.p, n, settings.metric, settings.ratio);
    Within within(map, metric, r2, settings.kernel, bsdf, wo);
    map.tree().visit_ball(hit.at.p, metric.ball2(r2), within);
    return {within.total() / r2, std::sqrt(r2), within.photons};
}

}  // namespace lucerna
