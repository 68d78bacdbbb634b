#include "engine/photometry/light_paths_at.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/stats.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/path_account.h"
#include "kdtree/box_tree.h"

namespace lucerna {
namespace {

// Radii of the balls: the largest, its half, its quarter and so on. A ring is the part of a ball's
// cross-section outside of the next smaller ball.
constexpr int kLevels = 7;
// Kinds of light.
constexpr std::size_t kChains = 0, kOthers = 1, kConnected = 2;
// Paths of a pilot, and passages that suffice for learning.
constexpr std::int64_t kPilot = 1 << 17;
constexpr std::uint32_t kFirstBouncesPass = 0xffff0000U;  // and below it; no pilot or pass has these
constexpr std::size_t kEnoughPassages = 2048;
// The random numbers of a path's connections.
constexpr std::uint32_t kConnectionBranch = 0x6c;

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

// Scores each path by what a first bounce off a specular surface leaves it.
struct FirstBounces : LightPathVisitor {
    std::vector<float> scores;
    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, scores);
    }
    bool begin(std::uint32_t, const std::optional<LightPathStart>&, const Sampler&) {
        scores.push_back(0);
        return true;
    }
    template <typename At>
    void arrive(const At& at) {
        if (at.path.began_specular) scores.back() = sqr(luminance(at.power));
    }
    void hit(const LightPathHit& at) { arrive(at); }
    void scatter(const LightPathScatter& at) { arrive(at); }
    void escape(const LightPathEscape& at) { arrive(at); }
};

const auto kNoMemoryTest = [](const auto&, std::int64_t, std::int64_t) {};

}  // namespace

// Finds the balls that a segment comes near. Each ball is tested again with its own radius, so the tree may
// return too many balls but never too few.
class LightPathsAt::BallTree {
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

// Sums what a chunk of paths brings to the balls around receivers, by rings.
struct LightPathsAt::Visitor : LightPathVisitor {
    const LightPathsAt* at = nullptr;
    std::vector<double> sums;       // of rings, [receiver][part][ring]
    std::vector<Hits> hits;         // [receiver][kind]
    bool is_pilot = false;          // records `passages` through the wide balls in place of sums
    std::vector<Passage> passages;  // with the number of the path in this chunk
    std::uint32_t paths = 0;
    SurfacePoint from;
    std::size_t group = 0;
    // The last place where the path was not passed straight on, and whether it
    // has connections.
    V3f vertex;
    bool is_connected = false;
    std::uint32_t bounces = 0;
    std::optional<Sampler> connections;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, sums, hits, passages, paths);
    }
    bool begin(std::uint32_t /*path*/, const std::optional<LightPathStart>& start, const Sampler& sampler) {
        ++paths;
        if (!start) return true;
        connections = sampler.split(kConnectionBranch);
        bounces = 0;
        is_connected = false;
        from = start->from;
        const LightGroups& groups = at->work_.scene.light_groups();
        group = groups.empty() ? 0 : groups.of(static_cast<std::int32_t>(start->light));
        return true;
    }
    void hit(const LightPathHit& hit) {
        // If the surface lets the path pass straight on, the next segment continues there; otherwise the
        // part of the ball behind the surface counts.
        const bool passes = !is_black(hit.bsdf.straight_share(-hit.d));
        arrive(hit);
        add(hit, hit.hit.t, !passes);
        from = hit.hit.at;
        if (!is_pilot) connect(hit);
    }
    void scatter(const LightPathScatter& scatter) {
        arrive(scatter);
        add(scatter, (scatter.p - from.p).length(), false);
        from = SurfacePoint{scatter.p};
    }
    void escape(const LightPathEscape& escape) {
        arrive(escape);
        add(escape, INFINITY, false);
    }

  private:
    // Where there are media, places are not connected.
    bool connects() const { return at->work_.scene.media().empty(); }

    // Finds out where the segment began that ends now.
    template <typename At>
    void arrive(const At& segment) {
        if (segment.path.bounces() == bounces) return;  // it was passed straight on
        bounces = segment.path.bounces();
        vertex = from.p;
        is_connected = connects() && !segment.path.specular_last;
    }

    // Adds the light that a surface scatters to some receivers in a straight
    // line.
    void connect(const LightPathHit& hit) {
        constexpr std::size_t kConnections = 4;
        if (!connects() || !hit.path.began_specular || hit.bsdf.is_delta() ||
            static_cast<int>(hit.path.bounces()) >= at->work_.longest - 1)
            return;
        const std::size_t receivers = at->receivers_.size(), count = std::min(kConnections, receivers);
        const double share = static_cast<double>(count) / static_cast<double>(receivers);
        Sampler& sampler = *connections;
        const double first = double{sampler.next()};
        for (std::size_t k = 0; k < count; ++k) {
            const auto i =
                std::min(static_cast<std::size_t>((static_cast<double>(k) + first) / share), receivers - 1);
            const Receiver& receiver = at->receivers_[i];
            const Ball& ball = at->balls_.balls[i];
            const V3f way = ball.centre - hit.hit.at.p;
            const float distance = way.length();
            if (!(distance > at->near_[i])) continue;  // > 0
            const V3f w = way / distance;
            const double read = response(receiver, -w);
            if (!(read > 0)) continue;
            const Rgb scattered =
                hit.power * hit.bsdf.f(-hit.d, w, Transport::particles) *
                (std::fabs(w.dot(hit.bsdf.shading_normal())) * shading_correction(hit.bsdf, -hit.d, w));
            if (is_black(scattered)) continue;
            const Rgb arriving =
                scattered * passing(at->work_.scene, way_between(hit.hit.at, SurfacePoint{ball.centre}),
                                    kNoMedium, sampler, false);
            const double r = double{ball.radius};
            // A density estimate divides by the cross-section of its ball.
            const double brought =
                double{luminance(arriving)} * read * kPiD * sqr(r) / (share * sqr(double{distance}));
            if (!(brought > 0)) continue;
            hits[i * kKinds + kConnected].add({brought, sqr(brought)});
            sums[(i * at->parts_ + kKinds * group + kConnected) * kLevels] += brought;
        }
    }

    // Where a segment passes a receiver.
    struct Near {
        float along;   // the segment
        float beside;  // distance to the receiver, or what counts as such
        double response;
    };
    // A planar receiver is passed where the segment crosses its plane from the front; the cosine is then
    // that of the cross-section. Other receivers are passed at the point nearest to them. If the segment
    // ends at a surface, that point may lie behind it: at most kBehind radii, so that the error of concave
    // corners vanishes with the radius.
    static std::optional<Near> near(const Receiver& receiver, const V3f& way, const V3f& d, float length,
                                    bool beyond) {
        if (receiver.kind == ReceiverKind::planar) {
            const float facing = -receiver.normal.dot(d);
            if (!(facing > 0)) return std::nullopt;
            const float along = -receiver.normal.dot(way) / facing;  // may overflow, and is then too long
            if (!(along > 0 && along <= length)) return std::nullopt;
            return Near{along, (way - along * d).length(), 1};
        }
        constexpr float kBehind = 4;
        const float along = way.dot(d), behind = along - length;
        if (!(along > 0) || (behind > 0 && !beyond)) return std::nullopt;
        const float beside = std::sqrt(std::max(0.0F, way.length2() - along * along));
        return Near{std::min(along, length), std::max(beside, behind / kBehind), response(receiver, -d)};
    }

    template <typename At>
    void add(const At& segment, float length, bool beyond) {
        if (!segment.path.began_specular) return;
        const V3f& d = segment.d;
        const double power = double{luminance(segment.power)};
        const std::size_t part = kKinds * group + (segment.path.strayed ? kOthers : kChains);
        const Balls& balls = is_pilot ? at->wide_balls_ : at->balls_;
        balls.tree->near(from.p, d, length, [&](std::size_t i) {
            const Receiver& receiver = at->receivers_[i];
            const Ball& ball = balls.balls[i];
            const float r = ball.radius;
            const auto passes = near(receiver, ball.centre - from.p, d, length, beyond);
            if (!passes || !(passes->beside < r) || !(passes->response > 0)) return;
            if (is_connected && !is_pilot && (ball.centre - vertex).length() > at->near_[i]) return;
            // Both points are moved slightly off the surfaces on which they may lie.
            constexpr float kOff = 1e-3F;
            const V3f eye = ball.centre + kOff * r * receiver.normal;
            const V3f look = from.p + (passes->along - kOff * r) * d - eye;
            const float distance = look.length();
            if (distance > 0 && at->work_.scene.blocked(Ray{eye, look / distance, distance}, false)) return;
            const double brought = power * passes->response;
            if (is_pilot) {
                passages.push_back({paths - 1, static_cast<std::uint32_t>(i), static_cast<float>(brought)});
                return;
            }
            hits[i * kKinds + part % kKinds].add({brought, sqr(brought)});
            const int ring = passes->beside > 0 ? -1 - std::ilogb(passes->beside / r) : kLevels - 1;
            sums[(i * at->parts_ + part) * kLevels +
                 static_cast<std::size_t>(std::clamp(ring, 0, kLevels - 1))] += brought;
        });
    }
};

LightPathsAt::LightPathsAt(std::span<const Receiver> receivers, std::span<const Reach> reaches,
                           const ChanceLightWork& work)
    : receivers_(receivers),
      work_(work),
      parts_(kKinds * std::max<std::size_t>(1, work.scene.light_groups().names.size())) {
    for (std::size_t i = 0; i < receivers.size(); ++i) {
        const V3f centre = ray_origin(receivers[i], work.scene);
        balls_.balls.push_back({centre, reaches[i].radius});
        wide_balls_.balls.push_back({centre, reaches[i].wide_radius});
        near_.push_back(reaches[i].near);
    }
    for (Balls* balls : {&balls_, &wide_balls_})
        balls->tree = std::make_shared<const BallTree>(balls->balls, work.workers);
    batches_.assign(kBatches, std::vector<double>(receivers.size() * parts_ * kLevels));
    levels_.resize(receivers.size() * kKinds);
    hits_.resize(levels_.size());
    was_hit_.resize(levels_.size());
}

// Traces the chunks; returns false if the monitor stopped it.
bool LightPathsAt::run(LightPathRequest& paths, bool is_pilot, std::vector<Visitor>& chunks) const {
    paths.seed = work_.seed;
    paths.use = PathUse::began_specular;
    paths.longest = work_.longest - 1;  // one more follows at the receiver
    paths.interleaved = false;          // Visitor follows the segments of one path at a time
    paths.phase = "light paths";
    trace_light_paths(
        {work_.scene, work_.workers, work_.monitor}, paths, chunks,
        [&](std::int64_t) {
            Visitor visitor;
            visitor.at = this;
            visitor.is_pilot = is_pilot;
            visitor.hits.resize(hits_.size());
            if (!is_pilot) visitor.sums.resize(batches_.front().size());
            return visitor;
        },
        kNoMemoryTest);
    return !work_.monitor.stopped();
}

bool LightPathsAt::learn(std::span<const double> others) {
    constexpr std::int64_t kMostPilot = 1 << 19;
    double mean = 0;
    for (const double other : others) mean += other / static_cast<double>(others.size());
    for (std::size_t i = 0; i < others.size(); ++i) {
        const double light = std::max(others[i], mean);
        const double areas = sqr(double{balls_.balls[i].radius} * double{wide_balls_.balls[i].radius});
        weights_.push_back(1 / (sqr(light > 0 ? light : 1.0) * areas));
    }
    if (!pilot(kPilot, nullptr)) return false;
    if (has_learned()) return true;
    if (!learn_first_bounces()) return false;
    while (!has_learned() && pilot_paths_ < kMostPilot)
        if (!pilot(kPilot, emission_)) return false;
    if (emission_) forget();
    return true;
}

// Forgets all paths but the pilots', which other densities have emitted.
void LightPathsAt::forget() {
    first_ += paths_;
    paths_ = 0;
    for (std::vector<double>& batch : batches_) std::ranges::fill(batch, 0.0);
    for (std::size_t i = 0; i < hits_.size(); ++i) was_hit_[i] = was_hit_[i] || hits_[i].sum > 0;
    std::ranges::fill(hits_, Hits{});
    for (std::size_t kind = 0; kind < kKinds; ++kind) {
        if (pooled_[kind].sum > 0) earlier_[kind] = pooled_[kind].each();
    }
    pooled_ = {};
}

bool LightPathsAt::has_learned() const {
    return passages_.size() >= kEnoughPassages;
}

// Traces pilot paths and records which receivers they pass. Returns false if
// the monitor stopped it.
bool LightPathsAt::pilot(std::int64_t count, std::shared_ptr<const LearnedEmission> emission) {
    LightPathRequest paths;
    paths.purpose = Purpose::emission;
    paths.pass = kEmissionPrePass - static_cast<std::uint32_t>(pilots_.size());
    paths.emission = emission.get();
    paths.per_chunk = 2048;
    paths.count = count;
    std::vector<Visitor> chunks;
    if (!run(paths, true, chunks)) return false;
    for (const Visitor& chunk : chunks) {
        for (Passage passage : chunk.passages) {
            passage.path += static_cast<std::uint32_t>(pilot_paths_);
            passages_.push_back(passage);
        }
        pilot_paths_ += chunk.paths;
    }
    pilots_.push_back({paths.pass, count, std::move(emission)});
    return true;
}

// Learns emission from paths that end after the first bounce, if any meet a specular surface. Returns false
// if the monitor stopped it.
bool LightPathsAt::learn_first_bounces() {
    constexpr std::int64_t kFirst = 1 << 20, kFurther = 1 << 17;
    constexpr std::size_t kRounds = 8, kPlainRounds = 4;
    constexpr std::size_t kFew = 8, kEnough = 1024;  // bounces off specular surfaces
    std::vector<PilotPaths> rounds;
    std::vector<float> scores;
    for (std::size_t found = 0; rounds.size() < kRounds && found < kEnough;) {
        LightPathRequest paths;
        paths.purpose = Purpose::emission;
        paths.pass = kFirstBouncesPass - static_cast<std::uint32_t>(rounds.size());
        paths.seed = work_.seed;
        paths.count = found < kFew ? kFirst : kFurther;
        paths.emission = emission_.get();
        paths.use = PathUse::began_specular;
        paths.longest = 1;
        paths.interleaved = false;
        paths.phase = "light paths";
        std::vector<FirstBounces> chunks;
        trace_light_paths({work_.scene, work_.workers, work_.monitor}, paths, chunks,
                          [](std::int64_t) { return FirstBounces(); });
        if (work_.monitor.stopped()) return false;
        for (const FirstBounces& chunk : chunks) {
            scores.insert(scores.end(), chunk.scores.begin(), chunk.scores.end());
            found +=
                static_cast<std::size_t>(std::ranges::count_if(chunk.scores, [](float x) { return x > 0; }));
        }
        rounds.push_back({paths.pass, paths.count, emission_});
        if (found < kFew && rounds.size() < kPlainRounds) continue;
        if (found == 0) return true;
        const float largest = std::ranges::max(scores);  // > 0
        std::vector<float> relative;
        for (const float score : scores) relative.push_back(score / largest);
        emission_ = std::make_shared<LearnedEmission>(
            learn_density(work_.scene, work_.seed, rounds, relative).emission);
    }
    return true;
}

// Returns how many pilot paths with equal second moments would tell as much. A few teach nothing.
double LightPathsAt::learn_emission() {
    constexpr double kFew = 16;
    double largest = 0;
    std::vector<double> moments(static_cast<std::size_t>(pilot_paths_));
    for (const Passage& passage : passages_) {
        double& moment = moments[passage.path];
        moment += weights_[passage.receiver] * sqr(double{passage.brought});
        largest = std::max(largest, moment);
    }
    if (!(largest > 0)) return 0;
    std::vector<float> scores;
    for (const double moment : moments) scores.push_back(static_cast<float>(moment / largest));
    LearnedDensity learned = learn_density(work_.scene, work_.seed, pilots_, scores);
    if (learned.effective >= kFew) emission_ = std::make_shared<LearnedEmission>(std::move(learned.emission));
    return learned.effective;
}

bool LightPathsAt::focus(std::span<const double> errors) {
    constexpr double kLeast = 1e-3;  // relative to the largest error
    const double largest = *std::max_element(errors.begin(), errors.end());
    if (!(largest > 0)) return true;
    for (std::size_t i = 0; i < errors.size(); ++i) weights_[i] *= sqr(std::max(errors[i] / largest, kLeast));
    constexpr double kEnough = 256;
    if (learn_emission() < kEnough) {
        if (!pilot(kPilot, emission_)) return false;
        learn_emission();
    }
    forget();
    return true;
}

std::int64_t LightPathsAt::trace(std::int64_t wanted) {
    constexpr std::int64_t kMostOfCall = 1 << 21, kMostPaths = std::int64_t{1} << 32;
    LightPathRequest paths;
    paths.count = static_cast<std::int64_t>(
        std::bit_floor(static_cast<std::uint64_t>(std::clamp(wanted, kLeastRound, kMostOfCall))));
    paths.first = first_ + paths_;
    if (paths.first + paths.count > kMostPaths) return 0;
    paths.purpose = Purpose::importance;
    paths.pass = 1;
    paths.per_chunk = paths.count / static_cast<std::int64_t>(kBatches);
    paths.emission = emission_.get();
    std::vector<Visitor> chunks;
    if (!run(paths, false, chunks)) return 0;
    for (std::size_t batch = 0; batch < kBatches; ++batch) {
        const std::vector<double>& more = chunks[batch].sums;
        for (std::size_t i = 0; i < more.size(); ++i) batches_[batch][i] += more[i];
        for (std::size_t i = 0; i < hits_.size(); ++i) {
            hits_[i].add(chunks[batch].hits[i]);
            pooled_[i % kKinds].add(chunks[batch].hits[i]);
        }
    }
    paths_ += paths.count;
    choose_levels();
    return paths.count;
}

double LightPathsAt::estimate(std::size_t batch, std::size_t receiver, std::size_t part, int level) const {
    const double* const rings = &batches_[batch][(receiver * parts_ + part) * kLevels];
    double sum = 0;
    for (int ring = level; ring < kLevels; ++ring) sum += rings[ring];
    const double r = std::ldexp(double{balls_.balls[receiver].radius}, -level);  // > 0
    return sum * static_cast<double>(kBatches) / (static_cast<double>(paths_) * kPiD * r * r);
}

// The standard error of a receiver's estimate from few hits is not known from
// their scatter, and is 0 without hits. It is at least that of a Poisson
// process. Where the largest ball has many hits, the square of its error over
// its estimate is what one hit brings there, and four times as much in a ball
// of half the radius; otherwise it brings what the receiver's hits brought. A
// receiver without hits may have missed one, which brings what one does on the
// average of all receivers, but no more than they get on the average; if it
// never had any, all paths so far have missed it. If no receiver has hits, they
// are at least one like the last ones.
void LightPathsAt::choose_levels() {
    constexpr double kTold = 5;        // standard errors of an estimate that is told from 0
    constexpr double kAgreeing = 1.5;  // standard errors of a difference that may be chance
    double area = 0;                   // > 0
    for (const Ball& ball : balls_.balls) area += kPiD * sqr(double{ball.radius});
    const auto each_of = [&](std::size_t kind) {
        return pooled_[kind].sum > 0 ? pooled_[kind].each() : earlier_[kind];
    };
    const auto average = [&](std::size_t kind) {  // over the balls of all receivers, by their areas
        return std::max(pooled_[kind].sum, each_of(kind)) / (static_cast<double>(paths_) * area);
    };
    const auto error_of_hits = [&](std::size_t i, double value) {
        const double r = double{balls_.balls[i / kKinds].radius};  // > 0
        const bool is_hit = hits_[i].sum > 0;
        const std::int64_t paths = is_hit || was_hit_[i] ? paths_ : first_ + paths_;
        const double brought = is_hit ? hits_[i].each() : each_of(i % kKinds);
        const double of_one = brought / (static_cast<double>(paths) * kPiD * r * r);
        const double each = is_hit ? of_one : std::min(of_one, average(i % kKinds));
        return std::sqrt(each * std::max(value, each));
    };
    const auto choose = [&](std::size_t i) {
        const std::size_t receiver = i / kKinds, kind = i % kKinds;
        // Returns the estimate at a level, less that of a larger ball.
        const auto difference = [&](int level, std::optional<int> larger) {
            RunningStats stats;
            for (std::size_t batch = 0; batch < kBatches; ++batch) {
                double value = 0;
                for (std::size_t part = kind; part < parts_; part += kKinds) {
                    value += estimate(batch, receiver, part, level);
                    if (larger) value -= estimate(batch, receiver, part, *larger);
                }
                stats.add(value);
            }
            return ChanceLight{stats.mean(), stats.standard_error()};
        };
        const ChanceLight whole = difference(0, std::nullopt);
        Level& chosen = levels_[i];
        chosen = {};
        if (kind == kConnected) {
            chosen.least_error = error_of_hits(i, whole.value);
            return;
        }
        if (!(whole.value > kTold * whole.standard_error)) {
            chosen.least_error = error_of_hits(i, whole.value);
            return;
        }
        double of_hit = sqr(whole.standard_error) / whole.value;
        for (int level = 1; level < kLevels; ++level) {
            of_hit *= 4;
            const ChanceLight light = difference(level, std::nullopt);
            const double least_error = std::sqrt(of_hit * std::max(light.value, of_hit));
            const ChanceLight blur = difference(level, level - 1);
            const double change = std::fabs(blur.value);
            const bool agrees = change <= kAgreeing * std::max(blur.standard_error, least_error / 2);
            if (!(whole.value > kTold * std::max(light.standard_error, least_error))) {
                if (level == 1 && !agrees) chosen.blur = change;
                return;
            }
            // Blur grows with the square of the radius where light is smooth, and in proportion to it at
            // edges: what remains is a third of the change, or all of it.
            chosen = {level, agrees ? change / 3 : change, least_error};
            if (agrees) return;
        }
    };
    parallel_each(work_.workers, levels_.size(), 16, choose);
}

LightPathsAt::Mean LightPathsAt::mean(std::span<const std::size_t> receivers) const {
    Mean mean;
    mean.groups.resize(parts_ / kKinds);
    RunningStats whole, seen;
    const double share = 1 / static_cast<double>(receivers.size());
    for (std::size_t batch = 0; batch < kBatches; ++batch) {
        double all = 0, by_chains = 0;
        for (const std::size_t i : receivers) {
            for (std::size_t part = 0; part < parts_; ++part) {
                const std::size_t kind = part % kKinds;
                const double found = share * estimate(batch, i, part, levels_[i * kKinds + kind].level);
                all += found;
                if (kind == kChains) by_chains += found;
                mean.groups[part / kKinds] += found / static_cast<double>(kBatches);
            }
        }
        whole.add(all);
        seen.add(by_chains);
    }
    double least_error = 0;
    for (const std::size_t i : receivers) {
        for (std::size_t kind = 0; kind < kKinds; ++kind) {
            const Level& level = levels_[i * kKinds + kind];
            mean.blur += share * level.blur;
            if (level.level == kLevels - 1) mean.lasting_blur += share * level.blur;
            least_error = hypot(least_error, share * level.least_error);
        }
    }
    mean.light = {whole.mean(), std::max(whole.standard_error(), least_error)};
    mean.seen = {seen.mean(), seen.standard_error()};
    return mean;
}

}  // namespace lucerna
