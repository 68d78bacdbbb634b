#include "photon/irradiance.h"

#include <algorithm>

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
    std::vector<PackedDirection> normals(values_.size());
    std::transform(values_.begin(), values_.end(), normals.begin(), [](const Value& v) { return v.normal; });
    // Every n-th of a map's photons lies in an order as good as theirs.
    index_ = make_photon_index(first.index_kind(), positions_, normals, workers);
}

std::optional<IrradiancePoints::Found> IrradiancePoints::nearest(const V3f& x, const V3f& n,
                                                                 float radius) const {
    const auto nearest = index_->nearest_facing(x, n, kSameNormal, radius * radius);
    if (!nearest) return std::nullopt;
    const Value& value = values_[nearest->index];
    return Found{value.irradiance, value.radius};
}

}  // namespace lucerna
