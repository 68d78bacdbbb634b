#include "engine/render/chance_light.h"

#include <algorithm>
#include <cmath>

#include "engine/base/path_limits.h"
#include "engine/base/stats.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/scene/quantity.h"
#include "photon/density_estimate.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

constexpr std::int64_t kPaths = 1 << 17, kMostPaths = 1 << 21;  // the latter: seconds
constexpr std::int64_t kPathsPerChunk = 2048;                   // 64 chunks tell the standard error
constexpr double kKnown = 0.1;                                  // relative standard error that is enough

LightPaths light_paths(const ChanceLightWork& work) {
    LightPaths paths;
    paths.count = kPaths;
    paths.per_chunk = kPathsPerChunk;
    paths.seed = work.seed;
    paths.purpose = Purpose::importance;
    paths.pass = 1;
    paths.use = PathUse::began_specular;
    paths.longest = work.longest - 1;  // one more where it arrives
    paths.phase = "cross-check by light paths";
    return paths;
}

// Returns what a receiver reads for a unit of flux density, across the direction, that arrives from w.
double response(const Receiver& receiver, const V3f& w) {
    const double along = double{receiver.normal.dot(w)};
    switch (receiver.kind) {
        case ReceiverKind::planar:
            return std::max(0.0, along);
        case ReceiverKind::cylindrical:  // its normal is the axis
            return std::sqrt(std::max(0.0, 1 - along * along)) / kPiD;
        case ReceiverKind::semicylindrical: {
            const double up = double{receiver.up.dot(w)};
            const double level = std::sqrt(std::max(0.0, 1 - up * up));
            return (level + along) / kPiD;  // (1 + cos α) sin ε, as along = cos α sin ε
        }
        case ReceiverKind::hemispherical:
            return (1 + along) / 4;
        case ReceiverKind::spherical:
            return 0.25;
    }
    return 0;
}

struct Ball {
    V3f centre;
    float radius;
};

// Adds up what the segments of a chunk of paths bring to balls around receivers: a segment that comes nearer
// to the centre than the radius brings its power over the ball's cross-section.
struct BallVisitor : LightPathVisitor {
    // The centre must see the segment in it: light behind a wall does not count.
    const Scene* scene = nullptr;
    std::span<const Receiver> receivers;
    std::span<const Ball> balls;
    std::vector<double> sums;
    SurfacePoint from;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, sums);
    }
    bool begin(std::uint32_t /*path*/, const std::optional<LightPathStart>& start, const Sampler&) {
        if (start) from = start->from;
        return true;
    }
    void hit(const LightPathHit& at) {
        // Beyond a surface that lets it pass straight on comes the next segment; before any other the last
        // part of the ball lies behind the surface, and counts.
        const bool passes = !is_black(at.bsdf.straight_share(-at.d));
        if (at.path.began_specular) add(at.d, double{luminance(at.power)}, at.hit.t, !passes);
        from = at.hit.at;
    }
    void scatter(const LightPathScatter& at) {
        if (at.path.began_specular) add(at.d, double{luminance(at.power)}, (at.p - from.p).length(), false);
        from = SurfacePoint{at.p};
    }
    void escape(const LightPathEscape& at) {
        if (at.path.began_specular) add(at.d, double{luminance(at.power)}, INFINITY, false);
    }

  private:
    void add(const V3f& d, double power, float length, bool beyond) {
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const V3f way = balls[i].centre - from.p;
            const float along = way.dot(d), r = balls[i].radius;
            if (!(along > 0) || !(along <= length + (beyond ? r : 0))) continue;
            if (!(way.length2() - along * along < r * r)) continue;
            // Both a little off the surfaces that they may lie on.
            constexpr float kOff = 1e-3F;
            const V3f eye = balls[i].centre + kOff * r * receivers[i].normal;
            const V3f seen = from.p + (std::min(along, length) - kOff * r) * d;
            const V3f look = seen - eye;
            const float distance = look.length();
            if (distance > 0 && scene->blocked(Ray{eye, look / distance, distance}, false)) continue;
            sums[i] += power * response(receivers[i], -d) / double{kPi * r * r};  // r > 0
        }
    }
};

// Keeps the hits of a chunk of paths on surfaces that store photons.
struct HitVisitor : LightPathVisitor {
    Photons photons;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, photons);
    }
    void hit(const LightPathHit& at) {
        if (!at.path.began_specular || !stores_photons(at.bsdf)) return;
        photons.add_hit(at.hit.at, at.d, at.power / static_cast<float>(kPaths), at.start.light, at.start.cell,
                        at.path.bounces(), at.path.strayed);
    }
};

const auto kNoMemoryTest = [](const auto&, std::int64_t, std::int64_t) {};

}  // namespace

double missing_light(const ChanceLight& by_light_paths, const ChanceLight& met, double standard_errors) {
    const double missing = by_light_paths.value - met.value;
    const double error = std::hypot(by_light_paths.standard_error, met.standard_error);
    return missing > standard_errors * error ? missing : 0.0;
}

bool has_chance_light(const Scene& scene) {
    return scene.has_specular() && !scene.lights().empty();
}

std::vector<ChanceLight> chance_light_at(std::span<const Receiver> receivers, std::span<const float> radii,
                                         std::span<const double> enough, const ChanceLightWork& work) {
    std::vector<ChanceLight> result(receivers.size());
    std::vector<Ball> balls;
    for (std::size_t i = 0; i < receivers.size(); ++i)
        balls.push_back({V3f(receivers[i].position - work.scene.origin()) + receivers[i].off, radii[i]});
    LightPaths paths = light_paths(work);
    paths.interleaved = false;  // a segment begins where the one before it ended
    std::vector<BallVisitor> chunks;
    for (bool known = false; !known && paths.count <= kMostPaths; paths.count *= 4) {
        trace_light_paths(
            {work.scene, work.workers, work.monitor}, paths, chunks,
            [&](std::int64_t) {
                BallVisitor visitor;
                visitor.scene = &work.scene;
                visitor.receivers = receivers;
                visitor.balls = balls;
                visitor.sums.resize(balls.size());
                return visitor;
            },
            kNoMemoryTest);
        if (work.monitor.stopped()) return std::vector<ChanceLight>(receivers.size());
        known = true;
        for (std::size_t i = 0; i < balls.size(); ++i) {
            RunningStats of_chunks;
            for (const BallVisitor& chunk : chunks) of_chunks.add(chunk.sums[i] / double{kPathsPerChunk});
            result[i] = {of_chunks.mean(), of_chunks.standard_error()};
            known = known && !(result[i].standard_error > std::max(kKnown * result[i].value, enough[i]));
        }
    }
    return result;
}

ChanceLight chance_light_in_view(const Job& job, const ChanceLightWork& work) {
    constexpr std::size_t kLeastPhotons = 64;
    std::vector<HitVisitor> chunks;
    trace_light_paths(
        {work.scene, work.workers, work.monitor}, light_paths(work), chunks,
        [](std::int64_t) { return HitVisitor(); }, kNoMemoryTest);
    if (work.monitor.stopped()) return {};
    Photons all;
    for (const HitVisitor& chunk : chunks) all.append(chunk.photons);
    const std::size_t photons = all.size();
    if (photons < kLeastPhotons) return {};
    const PhotonMap map(all);
    DensityEstimateSettings how;
    how.k = static_cast<int>(kLeastPhotons);
    how.radius = largest_radius(diagonal(work.scene));
    const DensityEstimate estimate(map, how);
    const bool meter = quantity_of(job.integrator) == Quantity::illuminance;
    constexpr std::int64_t kRays = 8192, kRaysPerChunk = 256;
    const auto look = [&](Ray ray, std::uint32_t, Sampler& sampler, std::vector<double>& found) {
        Rgb throughput(1);
        double seen = 0;
        for (int bounce = 0; bounce < kRouletteFromSpecular; ++bounce) {
            const auto hit = work.scene.intersect(ray);
            if (!hit) break;
            const Bsdf bsdf = meter ? white_receiver(*hit) : work.scene.bsdf(*hit);
            if (stores_photons(bsdf)) {
                const Rgb radiance = estimate.radiance(*hit, bsdf.diffuse_part(), -ray.d).value;
                seen = double{luminance(throughput * (meter ? meter_reading(radiance) : radiance))};
                break;
            }
            const auto sample = bsdf.sample(-ray.d, {sampler.next(), sampler.next2()}, Transport::radiance);
            if (!sample || !sample->delta) break;
            throughput *= sample->weight;
            ray = Ray{hit->at.towards(sample->wi), sample->wi};
        }
        found.push_back(seen);
    };
    RunningStats rays;
    for (const auto& chunk : trace_view_rays<std::vector<double>>(
             view_of(job), {kRays, kRaysPerChunk, work.seed}, work.workers, look)) {
        for (const double value : chunk) rays.add(value);
    }
    // The photons' own number is uncertain, too, and each is seen by many rays.
    const double of_photons = 2 * rays.mean() / std::sqrt(static_cast<double>(photons));
    return {rays.mean(), std::hypot(rays.standard_error(), of_photons)};
}

ChanceLight mean_of(const Image& image) {
    const std::size_t channels = image.channels.size();
    std::vector<double> values;
    for (std::size_t at = 0; at + 2 < image.data.size(); at += channels) {
        const float* rgb = &image.data[at];
        values.push_back(std::max(0.0, double{luminance(Rgb(rgb[0], rgb[1], rgb[2]))}));
    }
    const double limit = limit_of_most(values);
    RunningStats of_most;
    for (const double value : values) {
        if (value <= limit) of_most.add(value);
    }
    return {of_most.mean(), of_most.standard_error()};
}

MissingInImage missing_in(const Job& job, const RenderResult& result, const ChanceLight& there) {
    constexpr double kStandardErrors = 3, kLeastShare = 0.01;
    MissingInImage missing;
    if (!result.chance) return missing;
    missing.mean = mean_of(result.image).value;
    const double scale = double{job.film.scale};
    missing.missing = missing_light({scale * there.value, scale * there.standard_error},
                                    mean_of(*result.chance), kStandardErrors);
    if (!(missing.missing > kLeastShare * missing.mean)) missing.missing = 0;
    return missing;
}

}  // namespace lucerna
