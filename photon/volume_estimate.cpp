#include "photon/volume_estimate.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "engine/scene/media_traversal.h"
#include "photon/photon_shares.h"

namespace lucerna {
namespace {

// Number of directions in which the ball is probed, times the eight sign combinations of each; edges and
// corners of axis-parallel walls are thus resolved almost without noise.
constexpr std::uint32_t kAppearances = 2;
constexpr unsigned kSigns = 8;
// Least share of the ball that is assumed to be open.
constexpr float kLeastFilling = 1.0F / 64;
constexpr std::uint32_t kBranch = 0xba;

float unit_part(float x) {
    return x - std::floor(x);
}

}  // namespace

// Returns ∫ σ_s t² dt over the ray up to t_max, in luminance.
double VolumeDensityEstimate::scattered_along(const ScatteringPoint& at, const Ray& ray,
                                              Sampler& sampler) const {
    double sum = 0;
    for_each_piece(scene_, ray, at.medium, [&](MediumPiece piece) {
        const double before = static_cast<double>(ray.t_max) - piece.to_go;
        while (piece.along.next()) {
            const double a = before + piece.along.begin(), b = before + piece.along.end();
            const double a3 = a * a * a, b3 = b * b * b;
            // Where the density varies, one point represents the stretch, drawn in proportion to the ball's
            // volume.
            const double place = cbrt(a3 + static_cast<double>(sampler.next()) * (b3 - a3)) - before;
            const Rgb sigma_s(V3f(piece.along.at(place).sigma_s));
            sum += static_cast<double>(luminance(sigma_s)) * (b3 - a3) / 3;
        }
        return true;
    });
    return sum;
}

// Probes the ball along `first` and the directions that belong to it: a lattice over the octant, shifted so
// as to contain `first`, with all signs of each point. Starting from any of its points gives the same
// lattice.
VolumeDensityEstimate::Filling VolumeDensityEstimate::filling(const ScatteringPoint& at, float radius,
                                                              const V3f& first, Sampler sampler) const {
    // Position of `first`, folded into the octant, under the equal-area map to the unit square.
    const V2f place(std::fabs(first.z), atan2(std::fabs(first.y), std::fabs(first.x)) / (0.5F * kPi));
    double sum = 0;
    bool obstructed = false;
    for (std::uint32_t look = 0; look < kAppearances; ++look) {
        const float step = static_cast<float>(look) / kAppearances;
        const float z = unit_part(place.x + step), phi = 0.5F * kPi * unit_part(place.y + step);
        const float s = std::sqrt(1 - z * z);
        const V3f w(s * cos(phi), s * sin(phi), z);
        for (unsigned signs = 0; signs < kSigns; ++signs) {
            const V3f d((signs & 1U) != 0 ? -w.x : w.x, (signs & 2U) != 0 ? -w.y : w.y,
                        (signs & 4U) != 0 ? -w.z : w.z);
            Ray ray{at.p, d.normalized(), radius};
            if (const auto hit = scene_.intersect(ray)) {
                obstructed = true;
                ray.t_max = hit->t;
            }
            sum += scattered_along(at, ray, sampler);
        }
    }
    const auto r = static_cast<double>(radius);
    const double open = kSigns * kAppearances * static_cast<double>(luminance(at.sigma_s)) * r * r * r / 3;
    return {std::max(static_cast<float>(sum / open), kLeastFilling), obstructed};
}

// Picks a photon in proportion to its contribution, or the last one if none contributes.
std::size_t VolumeDensityEstimate::pick(std::span<const Brought> found, float u) {
    float total = 0;
    for (const Brought& photon : found) total += luminance(photon.value);
    float sum = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        sum += luminance(found[i].value);
        if (sum > u * total) return i;
    }
    return found.size() - 1;
}

VolumeDensityEstimate::Filling VolumeDensityEstimate::filling(const ScatteringPoint& at, float radius,
                                                              std::vector<Brought>& found,
                                                              const Sampler& sampler) const {
    Sampler own = sampler;
    const float u = own.next();
    const V3f anywhere = square_to_sphere(own.next2());
    const auto look = [&](const Brought& photon) {
        const V3f way = photon.from - at.p;
        return filling(at, radius, way.length() > 0 ? way.normalized() : anywhere, sampler.split(1));
    };
    const V3f first = found[pick(found, u)].from;
    const Filling seen = look({first, Rgb(0), 0});
    if (!seen.obstructed) return seen;
    std::erase_if(found,
                  [&](const Brought& photon) { return !scene_.unoccluded_along(at.p, photon.from - at.p); });
    // A photon that does not count gives no direction for those that do.
    return found.empty() || scene_.unoccluded_along(at.p, first - at.p) ? seen : look(found[pick(found, u)]);
}

VolumeDensityEstimate::Result VolumeDensityEstimate::in_scattered(const ScatteringPoint& at,
                                                                  const Sampler& sampler) const {
    return found_around(at, sampler, nullptr);
}
VolumeDensityEstimate::Result VolumeDensityEstimate::in_scattered(const ScatteringPoint& at,
                                                                  const Sampler& sampler,
                                                                  const PathAccount& path) const {
    return found_around(at, sampler, &path);
}

VolumeDensityEstimate::Result VolumeDensityEstimate::found_around(const ScatteringPoint& at,
                                                                  const Sampler& sampler,
                                                                  const PathAccount* path) const {
    if (map_.size() == 0) return {};
    const float most2 = sqr(settings_.radius);
    if (settings_.k == 0) {
        std::vector<Neighbour> all;
        map_.index().within_in_space(at.p, most2, all);
        return sum(at, all, most2, sampler, path);
    }
    // Searches one more photon than k, to fix the radius.
    const std::size_t k = std::min(static_cast<std::size_t>(settings_.k), map_.size());
    Nearest nearest(k + 1, most2);
    map_.index().nearest_in_space(at.p, nearest);
    const std::span<const Neighbour> found = nearest.sorted();
    if (found.size() <= k) return sum(at, found, most2, sampler, path);
    return sum(at, found.first(k), found.back().key, sampler, path);
}

VolumeDensityEstimate::Result VolumeDensityEstimate::sum(const ScatteringPoint& at,
                                                         std::span<const Neighbour> found, float radius2,
                                                         const Sampler& sampler,
                                                         const PathAccount* path) const {
    // If all photons lie at one point, the radius is the smallest distance that float32 resolves there.
    const float r2 = std::max(radius2, sqr(surface_error(at.p, 0)));
    if (!(r2 > 0) || found.empty()) return {};
    Result result;
    result.radius = std::sqrt(r2);
    std::vector<Brought> brought;
    brought.reserve(found.size());
    for (const Neighbour& neighbour : found) {
        if (settings_.most_bounces < int{map_.bounces()[neighbour.index]}) continue;
        const Photon& photon = map_.photons()[neighbour.index];
        brought.push_back({map_.positions()[neighbour.index],
                           photon.power * at.phase.value(at.wo, -photon.direction.unpack()), photon.light});
    }
    if (brought.empty()) return result;
    result.filled = filling(at, result.radius, brought, sampler.split(kBranch)).share;
    result.photons = static_cast<int>(brought.size());
    for (const Brought& photon : brought) result.value += photon.value;
    // Divides by r² and by r separately, because r³ of a tiny scene would underflow.
    result.value = result.value * (0.75F * kInvPi / r2) / (result.radius * result.filled);
    if (!path) return result;
    path->add_to_layer(Layer::indirect, result.value);
    if (!path->has_groups()) return result;
    PhotonShares shares(*path);
    for (const Brought& photon : brought) shares.add(photon.light, true, photon.value);
    shares.book_groups(result.value);
    return result;
}

}  // namespace lucerna
