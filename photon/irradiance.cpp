#include "photon/irradiance.h"

namespace lucerna {
namespace {

constexpr float kSameNormal = 0.9F;  // cosine

}  // namespace

IrradiancePoints::IrradiancePoints(std::span<const PhotonMap* const> maps, const GatherSettings& settings,
                                   std::size_t stride, const Workers& workers, Monitor& monitor) {
    const PhotonMap& first = *maps.front();
    const auto count = static_cast<std::int64_t>((first.size() + stride - 1) / stride);
    positions_.resize(static_cast<std::size_t>(count));
    values_.resize(static_cast<std::size_t>(count));
    Phase phase(monitor, "irradiance", static_cast<std::uint64_t>(count));
    constexpr std::int64_t kGrain = 1024;
    parallel_ranges(workers, count, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        if (monitor.stopped()) return;
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
            const V3f& p = first.positions()[i * stride];
            const PackedDirection normal = first.normals()[i * stride];
            const SurfacePoint at{p, normal.unpack(), surface_error(p, 0)};
            const GatherResult own = Gather(first, settings).irradiance(at);
            Rgb all = own.value;
            for (const PhotonMap* map : maps.subspan(1)) all += Gather(*map, settings).irradiance(at).value;
            positions_[i] = p;
            values_[i] = {normal, all, own.radius};
        }
        phase.advance(static_cast<std::uint64_t>(end - begin));
    });
    tree_ = make_flann_tree(positions_);
}

std::optional<IrradiancePoints::Found> IrradiancePoints::nearest(const V3f& x, const V3f& n,
                                                                 float radius) const {
    class Nearest final : public PointVisitor {
      public:
        Nearest(const std::vector<Value>& values, const V3f& normal, float most2)
            : best2(most2), values_(values), normal_(normal) {}
        float visit(std::uint32_t index, float r2) override {
            // Ties go to the lower index, whatever the order of the search.
            const bool nearer = r2 < best2 || (r2 == best2 && index < best);
            if (nearer && values_[index].normal.unpack().dot(normal_) > kSameNormal) {
                best2 = r2;
                best = index;
            }
            return std::nextafter(best2, INFINITY);
        }
        float best2;
        std::uint32_t best = 0xffffffffU;

      private:
        const std::vector<Value>& values_;
        const V3f& normal_;
    } nearest(values_, n, radius * radius);
    tree_->visit_ball(x, radius * radius, nearest);
    if (nearest.best == 0xffffffffU) return std::nullopt;
    return Found{values_[nearest.best].irradiance, values_[nearest.best].radius};
}

}  // namespace lucerna
