#include "photon/volume_gather.h"

#include <algorithm>
#include <cmath>

#include "engine/base/surface_point.h"
#include "engine/world/passage.h"
#include "kdtree/nearest_heap.h"

namespace lucerna {
namespace {

// Places at which the ball is looked at.
constexpr int kProbes = 16;
constexpr std::uint32_t kBranch = 0xba;

// Keeps the nearest in space.
class KeepNearest final : public PointVisitor {
  public:
    KeepNearest(float most2, NearestHeap& heap) : most2_(most2), heap_(heap) {}

    float visit(std::uint32_t index, float r2) override {
        if (r2 < most2_) heap_.offer(r2, index);
        // A hair beyond the worst, so that ties are decided by index, not by the order of the search.
        return std::nextafter(std::min(most2_, heap_.worst()), INFINITY);
    }

  private:
    float most2_;
    NearestHeap& heap_;
};

float wrapped(float x) {
    return x - std::floor(x);
}

// Even over the ball of radius 1, all `kProbes` together: a rank-1 lattice moved by `shift` (Roberts, "The
// Unreasonable Effectiveness of Quasirandom Sequences", 2018: powers of the root of x⁴ = x + 1).
V3f in_ball(int i, const V3f& shift) {
    const auto n = static_cast<float>(i);
    const float z = 1 - 2 * wrapped(shift.x + n * 0.8191725F);
    const float phi = 2 * kPi * wrapped(shift.y + n * 0.6710436F);
    const float r = std::cbrt(wrapped(shift.z + n * 0.5497005F));
    const float s = std::sqrt(std::max(0.0F, 1 - z * z));
    return V3f(s * std::cos(phi), s * std::sin(phi), z) * r;
}

}  // namespace

bool VolumeGather::sees(const V3f& from, const V3f& to) const {
    const V3f way = to - from;
    const float distance = way.length();
    return !(distance > 0) || scene_.visible(SurfacePoint{from}, way / distance, distance);
}

VolumeGather::Filling VolumeGather::filling(const ScatteringPoint& at, float radius, Stream stream) const {
    const V2f u = stream.next2();
    const V3f shift(u.x, u.y, stream.next());
    Filling result{0, false};
    for (int i = 0; i < kProbes; ++i) {
        const V3f way = radius * in_ball(i, shift);
        const V3f there = at.p + way;
        const float distance = way.length();
        std::int32_t medium = at.medium;
        if (distance > 0) {
            const Ray ray{at.p, way / distance, distance};
            if (!scene_.visible(SurfacePoint{at.p}, ray.d, distance)) {
                result.obstructed = true;
                continue;
            }
            if (scene_.has_borders())
                medium = for_each_piece(scene_, ray, medium, [](const MediumPiece&) { return true; });
        }
        result.share += luminance(scattering_at(scene_.media(), medium, there));
    }
    // Not black: above 0. Where all looks missed what holds the photons, one that just did not is a bound.
    result.share = std::max(result.share / luminance(at.sigma_s), 1.0F) / kProbes;
    return result;
}

VolumeGather::Result VolumeGather::in_scattered(const ScatteringPoint& at, const Stream& stream) const {
    if (map_.size() == 0) return {};
    const float most2 = sqr(settings_.radius);
    // One more than k: it fixes the radius.
    NearestHeap heap(std::min(static_cast<std::size_t>(settings_.k), map_.size()) + 1);
    KeepNearest keep(most2, heap);
    map_.tree().visit_ball(at.p, most2, keep);
    const bool full = heap.full();
    // Photons all at one point: no nearer than float32 can tell.
    const float r2 = std::max(full ? heap.worst() : most2, sqr(surface_error(at.p, 0)));
    std::span<const Neighbour> near = heap.sorted();
    if (full) near = near.first(near.size() - 1);
    if (!(r2 > 0) || near.empty()) return {};

    Result result;
    result.radius = std::sqrt(r2);
    const Filling filled = filling(at, result.radius, stream.split(kBranch));
    result.filled = filled.share;
    for (const Neighbour& neighbour : near) {
        if (filled.obstructed && !sees(at.p, map_.positions()[neighbour.index])) continue;
        const Photon& photon = map_.photons()[neighbour.index];
        result.value += photon.power * at.phase.value(at.wo, -photon.direction.unpack());
        ++result.photons;
    }
    // By r² and by r, one after the other: r³ of a tiny scene would vanish.
    result.value = result.value * (0.75F * kInvPi / r2) / (result.radius * result.filled);
    return result;
}

}  // namespace lucerna
