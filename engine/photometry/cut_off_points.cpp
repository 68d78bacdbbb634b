#include "engine/photometry/cut_off_points.h"

#include <algorithm>
#include <numeric>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"

namespace lucerna {
namespace {

// Walks at random from a place and returns whether the walk leads out, or to where one of the places is seen.
bool leads_out(const Scene& scene, const V3f& from, std::span<const V3f> lit, Sampler& sampler) {
    constexpr int kMostSteps = 16;
    Ray ray{from, square_to_sphere(sampler.next2())};
    for (int step = 0; step < kMostSteps; ++step) {
        const auto hit = scene.intersect(ray);
        if (!hit) return true;
        const V3f n = face_forward(hit->at.n, -ray.d);
        const auto chosen = static_cast<std::size_t>(sampler.next() * static_cast<float>(lit.size()));
        const V3f way = lit[std::min(chosen, lit.size() - 1)] - hit->at.p;
        const float distance = way.length();
        if (distance > 0 && way.dot(n) > 0) {
            const V3f d = way / distance;
            if (!scene.blocked(Ray{hit->at.towards(d), d, distance}, false)) return true;
        }
        const V3f d = unit(Frame(n).to_world(square_to_cosine_hemisphere(sampler.next2())));
        ray = Ray{hit->at.towards(d), d};
    }
    return false;
}

}  // namespace

std::vector<bool> cut_off_points(const Scene& scene, std::span<const Receiver> receivers,
                                 std::span<const double> all, std::span<const double> direct,
                                 std::uint64_t seed, const Workers& workers) {
    constexpr double kLittle = 1e-4, kLit = 0.1;  // of the mean
    constexpr int kWalks = 256;
    const double mean = std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
    std::vector<bool> cut_off(all.size());
    std::vector<V3f> lit;
    std::vector<std::size_t> dark;
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (all[i] > kLit * mean) lit.push_back(ray_origin(receivers[i], scene));
        if (!(all[i] > kLittle * mean) && !(direct[i] > 0)) dark.push_back(i);
    }
    if (lit.empty()) return cut_off;
    std::vector<char> is_closed(dark.size());
    parallel_each(workers, dark.size(), 1, [&](std::size_t i) {
        Sampler sampler(seed, Purpose::receiver, 1, static_cast<std::uint32_t>(i));
        const V3f from = ray_origin(receivers[dark[i]], scene);
        int walk = 0;
        while (walk < kWalks && !leads_out(scene, from, lit, sampler)) ++walk;
        is_closed[i] = walk == kWalks ? 1 : 0;
    });
    for (std::size_t i = 0; i < dark.size(); ++i) cut_off[dark[i]] = is_closed[i] != 0;
    return cut_off;
}

}  // namespace lucerna
