#include "engine/render/chance_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "engine/base/deadline_monitor.h"
#include "engine/base/elementary.h"
#include "engine/base/stats.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/scene/path_limits.h"
#include "engine/scene/quantity.h"
#include "engine/text/units.h"
#include "kdtree/box_tree.h"
#include "photon/density_estimate.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

constexpr std::int64_t kPaths = 1 << 17, kMostPaths = 1 << 21;  // the latter takes seconds
constexpr std::int64_t kPathsPerChunk = 2048;                   // 64 chunks give the standard error

LightPathRequest light_paths(const ChanceLightWork& work) {
    LightPathRequest paths;
    paths.count = kPaths;
    paths.per_chunk = kPathsPerChunk;
    paths.seed = work.seed;
    paths.purpose = Purpose::importance;
    paths.pass = 1;
    paths.use = PathUse::began_specular;
    paths.longest = work.longest - 1;  // one more follows at the receiver or surface
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

// Columns of sums of each receiver: by balls of half the radius; by whole balls, of light that came from
// lamps over specular surfaces alone. One column for each light group follows, or one in total if the scene
// has none.
constexpr std::size_t kHalf = 0, kSeen = 1, kColumns = 2;

struct Ball {
    V3f centre;
    float radius;
};

// Finds the balls that a segment comes near. Each ball is tested again with its own radius, so the tree may
// return too many balls but never too few.
class BallTree {
  public:
    BallTree(std::span<const Ball> balls, const Workers& workers) {
        std::vector<V3f> centres;
        for (const Ball& ball : balls) {
            centres.push_back(ball.centre);
            largest_ = std::max(largest_, ball.radius);
        }
        const std::vector<std::uint32_t> order = box_order(centres, workers);
        for (std::size_t i = 0; i < order.size(); ++i) centres[i] = balls[order[i]].centre;
        tree_ = build_box_tree(centres, order, workers);
    }

    // Calls visit(ball) for all balls that the ray comes near within `length`.
    template <typename Visit>
    void near(const V3f& o, const V3f& d, float length, Visit&& visit) const {
        const Measure measure{o, d, length + largest_};
        search_all(tree_, measure, largest_ * largest_, [&](const BlockKeys& keys, std::uint32_t first) {
            const PointBlock& block = tree_.blocks[first / kBlock];
            for (std::size_t i = 0; i < kBlock; ++i) {
                if (keys[i] < largest_ * largest_) visit(block.payload[i]);
            }
        });
    }

  private:
    struct Measure {
        V3f o, d;
        float end;
        // The squared distance from the line, as add() computes it.
        BlockKeys keys(const PointBlock& block) const {
            BlockKeys keys;
            for (std::size_t i = 0; i < kBlock; ++i) {
                const V3f way = V3f(block.x[i], block.y[i], block.z[i]) - o;
                const float along = way.dot(d);
                keys[i] = way.length2() - along * along;
            }
            return keys;
        }
        // These bound the keys by the ball around each box; they are lower by what the difference of squares
        // above may lose by rounding.
        Node8Keys bounds(const BoxNode8& node) const {
            constexpr float kRounding = 1e-3F;
            Node8Keys keys;
            for (std::size_t i = 0; i < kNodeWidth; ++i) {
                const V3f low(node.low_x[i], node.low_y[i], node.low_z[i]),
                    high(node.high_x[i], node.high_y[i], node.high_z[i]);
                const V3f way = 0.5F * (low + high) - o;
                const float along = std::min(std::max(way.dot(d), 0.0F), end);
                const float reach = 0.5F * (high - low).length();
                const float beside = (way - along * d).length() - reach - kRounding * (way.length() + reach);
                keys[i] = beside * std::max(beside, 0.0F);  // NaN if there is no box
            }
            return keys;
        }
    };

    BoxTree tree_;
    float largest_ = 0;
};

// Sums the contributions of a chunk's path segments to balls around receivers: a segment that comes nearer to
// the centre than the radius contributes its power over the cross-section of the ball.
struct BallVisitor : LightPathVisitor {
    // For visibility from the centre to the segment, since light behind a wall does not count.
    const Scene* scene = nullptr;
    std::span<const Receiver> receivers;
    std::span<const Ball> balls;
    const BallTree* tree = nullptr;  // of the balls
    const LightGroups* light_groups = nullptr;
    std::size_t columns = 0;       // for each receiver: kColumns, then one for each group
    std::vector<double> sums;      // row by row
    std::size_t group_column = 0;  // column of the path's light
    SurfacePoint from;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, sums);
    }
    bool begin(std::uint32_t /*path*/, const std::optional<LightPathStart>& start, const Sampler&) {
        if (!start) return true;
        from = start->from;
        group_column =
            kColumns +
            (light_groups->empty() ? 0 : light_groups->of(static_cast<std::int32_t>(start->light)));
        return true;
    }
    void hit(const LightPathHit& at) {
        // If the surface lets the path pass straight on, the next segment continues there; otherwise the rest
        // of the ball lies behind the surface, and counts.
        const bool passes = !is_black(at.bsdf.straight_share(-at.d));
        add(at, at.hit.t, !passes);
        from = at.hit.at;
    }
    void scatter(const LightPathScatter& at) {
        add(at, (at.p - from.p).length(), false);
        from = SurfacePoint{at.p};
    }
    void escape(const LightPathEscape& at) { add(at, INFINITY, false); }

  private:
    template <typename At>
    void add(const At& at, float length, bool beyond) {
        if (!at.path.began_specular) return;
        const V3f& d = at.d;
        const double power = double{luminance(at.power)};
        tree->near(from.p, d, length, [&](std::size_t i) {
            const V3f way = balls[i].centre - from.p;
            const float along = way.dot(d), r = balls[i].radius;
            if (!(along > 0) || !(along <= length + (beyond ? r : 0))) return;
            const float beside2 = way.length2() - along * along;
            if (!(beside2 < r * r)) return;
            // Both points are moved slightly off the surfaces on which they may lie.
            constexpr float kOff = 1e-3F;
            const V3f eye = balls[i].centre + kOff * r * receivers[i].normal;
            const V3f seen = from.p + (std::min(along, length) - kOff * r) * d;
            const V3f look = seen - eye;
            const float distance = look.length();
            if (distance > 0 && scene->blocked(Ray{eye, look / distance, distance}, false)) return;
            const double brought = power * response(receivers[i], -d) / double{kPi * r * r};  // r > 0
            double* of_receiver = &sums[columns * i];
            of_receiver[group_column] += brought;
            if (4 * beside2 < r * r) of_receiver[kHalf] += 4 * brought;
            if (!at.path.strayed) of_receiver[kSeen] += brought;
        });
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
    const double error = hypot(by_light_paths.standard_error, met.standard_error);
    return missing > standard_errors * error ? missing : 0.0;
}

bool has_chance_light(const Scene& scene) {
    return scene.has_specular() && !scene.lights().empty();
}

ChanceLightAt::Mean ChanceLightAt::mean(std::size_t first, std::size_t count) const {
    constexpr double kSignificant = 2;   // standard errors
    constexpr double kOfHalf = 4 / 3.0;  // for blur that grows with the square of the radius
    Mean mean;
    mean.groups.resize(groups_);
    RunningStats whole, beside, seen;
    const double share = 1 / (static_cast<double>(count) * double{kPathsPerChunk});
    for (const std::vector<double>& sums : chunks_) {
        double half = 0, all = 0, by_chains = 0;
        for (std::size_t i = first; i < first + count; ++i) {
            const double* of_receiver = &sums[i * (kColumns + groups_)];
            half += share * of_receiver[kHalf];
            by_chains += share * of_receiver[kSeen];
            for (std::size_t g = 0; g < groups_; ++g) {
                const double found = share * of_receiver[kColumns + g];
                all += found;
                mean.groups[g] += found / static_cast<double>(chunks_.size());
            }
        }
        whole.add(all);
        beside.add(all - half);
        seen.add(by_chains);
    }
    mean.light = {whole.mean(), whole.standard_error()};
    mean.seen = {seen.mean(), seen.standard_error()};
    const double by_blur = std::fabs(beside.mean());
    if (by_blur > kSignificant * beside.standard_error()) mean.blur = kOfHalf * by_blur;
    return mean;
}

ChanceLightAt chance_light_at(std::span<const Receiver> receivers, std::span<const float> radii,
                              std::span<const double> others, double share, const ChanceLightWork& work) {
    std::vector<Ball> balls;
    for (std::size_t i = 0; i < receivers.size(); ++i)
        balls.push_back({V3f(receivers[i].position - work.scene.origin()) + receivers[i].off, radii[i]});
    const BallTree tree(balls, work.workers);
    const LightGroups& groups = work.scene.light_groups();
    ChanceLightAt result;
    result.groups_ = std::max<std::size_t>(1, groups.names.size());
    LightPathRequest paths = light_paths(work);
    paths.interleaved = false;  // BallVisitor follows the segments of one path at a time
    std::vector<BallVisitor> chunks;
    constexpr double kSignificant = 5, kLittle = 0.1;
    const auto is_known = [&] {
        double mean = 0;
        std::vector<ChanceLight> light;
        for (std::size_t i = 0; i < balls.size(); ++i) {
            light.push_back(result.mean(i, 1).light);
            mean += (others[i] + light[i].value) / static_cast<double>(balls.size());
        }
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const double enough = share * std::max(mean, others[i] + light[i].value);
            if (light[i].standard_error > enough) return false;
            // Light that may count must be significantly above 0.
            const bool significant = light[i].value > kSignificant * light[i].standard_error;
            if (!significant && light[i].value > kLittle * enough) return false;
        }
        return true;
    };
    do {
        trace_light_paths(
            {work.scene, work.workers, work.monitor}, paths, chunks,
            [&](std::int64_t) {
                BallVisitor visitor;
                visitor.scene = &work.scene;
                visitor.receivers = receivers;
                visitor.balls = balls;
                visitor.tree = &tree;
                visitor.light_groups = &groups;
                visitor.columns = kColumns + result.groups_;
                visitor.sums.resize(visitor.columns * balls.size());
                return visitor;
            },
            kNoMemoryTest);
        if (work.monitor.stopped()) {
            result.chunks_.assign(1, std::vector<double>((kColumns + result.groups_) * balls.size()));
            return result;
        }
        for (std::size_t i = result.chunks_.size(); i < chunks.size(); ++i)
            result.chunks_.push_back(std::move(chunks[i].sums));
        paths.count *= 4;
    } while (paths.count <= kMostPaths && !is_known());
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
    // The number of photons is uncertain, too, and each is seen by many rays.
    const double of_photons = 2 * rays.mean() / std::sqrt(static_cast<double>(photons));
    return {rays.mean(), hypot(rays.standard_error(), of_photons)};
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

void record_chance_light(Job& job) {
    job.film.chance = std::holds_alternative<PathSettings>(job.integrator) && !job.film.is_part() &&
                      has_chance_light(job.scene);
}

std::optional<ChanceLight> light_that_paths_hardly_find(Job& job, const RenderOptions& options,
                                                        Monitor& monitor) {
    constexpr double kMostShare = 0.05;
    record_chance_light(job);
    if (!job.film.chance) return std::nullopt;
    const bool can_be_cut = !options.workers.ranks;
    DeadlineMonitor cut(monitor,
                        can_be_cut ? Deadline::after(kMostShare * options.limits.seconds) : Deadline());
    const int longest = most_bounces(std::get<PathSettings>(job.integrator).max_depth);
    const ChanceLight found =
        chance_light_in_view(job, {job.scene, options.seed, longest, options.workers, cut});
    if (cut.stopped() && !monitor.stopped()) return std::nullopt;
    return found;
}

void warn_of_missing_light(const Job& job, const ChanceLight& there, RenderResult& result, Monitor& monitor) {
    const MissingInImage missing = missing_in(job, result, there);
    if (!(missing.missing > 0)) return;
    monitor.warn(fmt::format(
        "about {} of the image's light is missing, by a cross-check with light paths: it comes over mirrors, "
        "lenses or solid glass from lamps that are too small for path tracing to meet; the image's error is "
        "not known; use photonmap, progressive or igi",
        percent_text(missing.share())));
    result.report.relative_error.reset();
    result.report.denoised_error.reset();
}

}  // namespace lucerna
