#include "engine/scene/media_traversal.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

constexpr int kAims = 64;  // points in an interface's bounding box towards which medium_around() looks
constexpr int kMostPassages = 64;  // surfaces that each of these rays may pass

// Returns the i-th point of a low-discrepancy sequence in the box: the R3 sequence of [Roberts 2018].
V3f aim(const Box3f& box, int i) {
    constexpr double kSteps[] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
    V3f place;
    for (int j = 0; j < 3; ++j) {
        const double u = (i + 0.5) * kSteps[j];
        place[j] = static_cast<float>(std::lerp(double{box.min[j]}, double{box.max[j]}, u - std::floor(u)));
    }
    return place;
}

// Returns the medium on the near side of the first medium interface that a ray meets beyond other surfaces.
std::optional<std::int32_t> before_first_interface(const Scene& scene, Ray ray) {
    for (int i = 0; i < kMostPassages; ++i) {
        const auto hit = scene.intersect_with_medium_interfaces(ray);
        if (!hit) return std::nullopt;
        if (hit->media.is_interface) return medium_towards(hit->media, hit->at.n, -ray.d, kNoMedium);
        ray = Ray{hit->at.towards(ray.d), ray.d};
    }
    return std::nullopt;
}

// Multiplies `passed` by the transmittance of the media along a ray, and returns the medium at its end.
std::int32_t pass_media(const Scene& scene, const Ray& ray, std::int32_t medium, Sampler& sampler,
                        Rgb& passed) {
    return for_each_piece(scene, ray, medium, [&](MediumPiece piece) {
        passed *= transmittance(std::move(piece.along), sampler);
        return !is_black(passed);
    });
}

}  // namespace

Rgb transmittance(const Scene& scene, const Ray& ray, std::int32_t medium, Sampler& sampler) {
    Rgb result(1);
    if (!scene.media().empty()) pass_media(scene, ray, medium, sampler, result);
    return result;
}

Rgb passing(const Scene& scene, const Ray& way, std::int32_t medium, Sampler& sampler, bool shadow) {
    if (scene.blocked(way, shadow)) return Rgb(0);
    Rgb passed(1);
    Ray rest = way;
    for (int panes = 0; panes < kMaxMediumInterfaces && rest.t_max > 0; ++panes) {
        const auto pane = scene.has_panes() ? scene.intersect_pane(rest, shadow) : std::nullopt;
        if (!scene.media().empty()) {
            const Ray before{rest.o, rest.d, pane ? pane->t : rest.t_max};
            medium = pass_media(scene, before, medium, sampler, passed);
        }
        if (!pane || is_black(passed)) return passed;
        passed *= scene.bsdf(*pane).straight_share(-rest.d);
        if (is_black(passed)) return passed;
        medium = medium_towards(pane->media, pane->at.n, rest.d, medium);
        rest = Ray{pane->at.towards(rest.d), rest.d, rest.t_max - pane->t};
    }
    return passed;
}

V3f scattering_point(const MediumPiece& piece, double t, const std::optional<Hit>& hit) {
    if (hit) {
        const float height = static_cast<float>(piece.to_go - t) * std::fabs(piece.ray.d.dot(hit->at.n));
        if (!(height > hit->at.error)) return hit->at.towards(-piece.ray.d);
    }
    return piece.ray.at(static_cast<float>(t));
}

MediaTraversal traverse_media(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                              std::int32_t medium, const Rgb& power, Sampler& sampler) {
    MediaTraversal crossing{power, medium, {}};
    const Ray way{ray.o, ray.d, hit ? hit->t : ray.t_max};
    crossing.medium = for_each_piece(scene, way, medium, [&](MediumPiece piece) {
        const Flight flight = fly(piece.along, crossing.power, sampler);
        crossing.power = flight.throughput;
        if (flight.scattered) {
            crossing.scattered = {scattering_point(piece, flight.t, hit), flight.g};
            return false;
        }
        return !is_black(crossing.power);
    });
    return crossing;
}

std::int32_t medium_around(const Scene& scene, const SurfacePoint& from, const V3f& d) {
    const SceneMedia& media = scene.media();
    if (media.all.size() == media.regions.size()) return kNoMedium;  // regions have no interfaces
    if (const auto found = before_first_interface(scene, Ray{from.towards(d), d})) return *found;
    // The first interface on a ray towards any interface determines the medium, too.
    const V3f start = from.towards(d);
    for (int i = 0; scene.any_medium_interface() && i < kAims; ++i) {
        const V3f way = aim(*scene.any_medium_interface(), i) - start;
        const float length = way.length();
        if (!(length > 0)) continue;
        if (const auto found = before_first_interface(scene, Ray{start, way / length})) return *found;
    }
    return media.camera;
}

namespace {

constexpr std::uint32_t kBranch = 0xf1;  // branch of the path's sampler

// Below this transmittance Russian roulette ends half of the estimates.
constexpr double kFaint = 0.05;

double exponential(float u) {
    return -log1p(-static_cast<double>(u));  // u < 1
}

V3d decay(const V3d& sigma, double distance) {
    V3d result(1);
    for (int k = 0; k < 3; ++k) {
        if (sigma[k] > 0) result[k] = exp(-sigma[k] * distance);  // the distance may be infinite
    }
    return result;
}

double largest(const V3d& v) {
    return std::max({v.x, v.y, v.z});
}

// Holds the channel that samples distances, and the path's densities so far for all channels, up to a common
// factor.
class Channels {
  public:
    Channels(const Rgb& throughput, float u) : throughput_(throughput) {
        const V3d chance = throughput_ / (throughput_.x + throughput_.y + throughput_.z);
        double rest = static_cast<double>(u);
        for (int k = 0; k < 3; ++k) {
            chance_[k] = chance[k];
            density_[k] = chance[k] > 0 ? 1 : 0;  // a channel without throughput needs no density
            if (chance[k] > 0 && rest >= 0) hero_ = k;
            rest -= chance[k];
        }
    }

    int hero() const { return hero_; }
    // Multiplies the densities by the factors of an event that all channels share.
    void multiply(const V3d& factor) {
        density_ *= factor;
        const double most = largest(density_);
        if (most > 0) density_ /= most;  // only ratios matter; products must not underflow
    }
    // Returns the throughput after an event of value `value` that was drawn with density `pdf` per channel.
    Rgb weigh(const V3d& value, const V3d& pdf) const {
        const double mean = chance_.dot(density_ * pdf);
        if (!(mean > 0)) return Rgb(0);
        return Rgb(V3f(throughput_ * density_ * value / mean));
    }

  private:
    V3d throughput_;
    V3d chance_;
    V3d density_;
    int hero_ = 0;
};

Flight scatter(const MediaAlong& along, double t, const Channels& channels, const Coefficients& here,
               Sampler& more) {
    Flight flight;
    flight.scattered = true;
    flight.t = t;
    const Rgb weight = channels.weigh(here.sigma_s, here.sigma_t);
    if (is_black(weight)) return flight;
    const MediaAlong::Choice choice = along.choose(t, V3d(weight), static_cast<double>(more.next()));
    flight.throughput = Rgb(V3f(V3d(weight) * choice.share));
    flight.g = choice.medium->g;
    return flight;
}

// Advances to the next real collision, `depth` away in the hero channel's optical depth. Returns none if the
// end is reached. Leaves `along` in the stretch of the collision.
std::optional<double> collide(MediaAlong& along, Channels& channels, double depth, Sampler& more,
                              Rgb& emitted) {
    const int hero = channels.hero();
    while (along.next()) {
        const V3d majorant = along.uniform() + along.bound() + V3d(along.search());
        double t = along.begin();
        for (;;) {
            const double step = majorant[hero] > 0 ? depth / majorant[hero] : INFINITY;
            if (!(t + step < along.end())) break;
            channels.multiply(decay(majorant, step));
            t += step;
            const Coefficients here = along.at(t);
            emitted += channels.weigh(here.emission, majorant);
            // The collision is real with probability sigma_t / majorant, else it is a null collision.
            if (static_cast<double>(more.next()) * majorant[hero] < here.sigma_t[hero]) return t;
            V3d null = majorant - here.sigma_t;
            for (int k = 0; k < 3; ++k) null[k] = std::max(0.0, null[k]);
            channels.multiply(null);
            depth = exponential(more.next());
        }
        const double rest = along.end() - t;
        channels.multiply(decay(majorant, rest));
        if (majorant[hero] > 0) depth = std::max(0.0, depth - majorant[hero] * rest);
    }
    return std::nullopt;
}

// Returns the optical depth of the present stretch from its beginning to t, which may be infinite.
V3d uniform_depth(const MediaAlong& along, double t) {
    V3d depth(0);
    for (int k = 0; k < 3; ++k) {
        if (along.uniform()[k] > 0) depth[k] = along.uniform()[k] * (t - along.begin());
    }
    return depth;
}

// Draws a distance within uniform media. The channel that draws it is chosen by what it scatters or loses on
// the ray; its density is exponential, truncated at the end.
struct DrawnWithin {
    double t;
    V3d flow;
};
std::optional<DrawnWithin> draw_within(MediaAlong& along, const Rgb& throughput, const V2f& u) {
    V3d all(0);
    for (MediaAlong way = along; way.next();) all += uniform_depth(way, way.end());
    V3d interacting(0);
    for (int k = 0; k < 3; ++k) interacting[k] = -expm1(-all[k]);
    const V3d contribution = V3d(throughput) * interacting;
    const double sum = contribution.x + contribution.y + contribution.z;
    if (!(sum > 0)) return std::nullopt;
    int hero = 0;
    double rest = static_cast<double>(u.x) * sum;
    for (int k = 0; k < 3; ++k) {
        if (contribution[k] > 0 && rest >= 0) hero = k;
        rest -= contribution[k];
    }
    const double goal =
        -log1p(-static_cast<double>(u.y) * interacting[hero]);  // finite: u < 1, interacting <= 1
    V3d before(0);
    while (along.next()) {
        const V3d stretch = uniform_depth(along, along.end());
        if (!(goal - before[hero] < stretch[hero])) {
            before += stretch;
            continue;
        }
        const double t =
            along.begin() + (goal - before[hero]) / along.uniform()[hero];  // > 0 where interacting is
        V3d passed(1);
        double pdf = 0;
        const V3d depth = before + uniform_depth(along, t);
        for (int k = 0; k < 3; ++k) {
            passed[k] = exp(-depth[k]);
            if (contribution[k] > 0)
                pdf += contribution[k] / sum * along.uniform()[k] * passed[k] / interacting[k];
        }
        return DrawnWithin{t, passed / pdf};  // > 0, because the hero's part is
    }
    return std::nullopt;  // by rounding, the goal is at the very end
}

}  // namespace

Flight fly(MediaAlong along, const Rgb& throughput, Sampler& sampler) {
    const V2f u = sampler.next2();
    Sampler more = sampler.split(kBranch);
    Flight flight;
    if (!along.scatters() && !along.emits()) {
        flight.throughput = throughput * transmittance(std::move(along), more);
        return flight;
    }
    Channels channels(throughput, u.x);
    Rgb emitted(0);
    if (const auto t = collide(along, channels, exponential(u.y), more, emitted)) {
        flight = scatter(along, *t, channels, along.at(*t), more);
    } else {
        flight.throughput = channels.weigh(V3d(1), V3d(1));
    }
    flight.emitted = emitted;
    return flight;
}

std::optional<InScattering> scatter_within(MediaAlong along, const Rgb& throughput, Sampler& sampler) {
    const V2f u = sampler.next2();
    if (!along.scatters()) return std::nullopt;
    Sampler more = sampler.split(kBranch);
    InScattering place;
    V3d flow;
    if (along.is_uniform()) {
        const auto drawn = draw_within(along, throughput, u);
        if (!drawn) return std::nullopt;
        place.t = drawn->t;
        flow = drawn->flow;
    } else {
        Channels channels(throughput, u.x);
        Rgb emitted(0);
        const auto t = collide(along, channels, exponential(u.y), more, emitted);
        if (!t) return std::nullopt;
        place.t = *t;
        flow = V3d(channels.weigh(V3d(1), along.at(*t).sigma_t));
        // weigh() includes the throughput, which is not black. A channel without throughput gets nothing.
        for (int k = 0; k < 3; ++k)
            flow[k] = throughput[k] > 0 ? flow[k] / static_cast<double>(throughput[k]) : 0;
    }
    const Coefficients here = along.at(place.t);
    const V3d weight = flow * here.sigma_s * V3d(throughput);
    if (!(largest(weight) > 0)) return std::nullopt;
    const MediaAlong::Choice choice = along.choose(place.t, weight, static_cast<double>(more.next()));
    place.g = choice.medium->g;
    place.flow = Rgb(V3f(flow * choice.share));
    place.sigma_s = Rgb(V3f(here.sigma_s));
    return place;
}

std::optional<InScattering> scattered_at(MediaAlong along, MediaAlong before, double t, const Rgb& throughput,
                                         Sampler& sampler) {
    do {
        if (!along.next() || along.begin() > t) return std::nullopt;
    } while (!(t < along.end()));
    const Coefficients here = along.at(t);
    const V3d flow(transmittance(std::move(before), sampler));
    const V3d weight = flow * here.sigma_s * V3d(throughput);
    if (!(largest(weight) > 0)) return std::nullopt;
    const MediaAlong::Choice choice = along.choose(t, weight, static_cast<double>(sampler.next()));
    return InScattering{t, choice.medium->g, Rgb(V3f(flow * choice.share)), Rgb(V3f(here.sigma_s))};
}

Rgb transmittance(MediaAlong along, Sampler& sampler) {
    V3d result(1);
    double depth = 0;
    bool drawn = false;
    while (along.next()) {
        result *= decay(along.uniform(), along.end() - along.begin());
        const double bound = largest(along.bound());
        if (!(bound > 0)) continue;
        if (!drawn) depth = exponential(sampler.next());
        drawn = true;
        double t = along.begin();
        while (t + depth / bound < along.end()) {
            t += depth / bound;
            const V3d there = along.varying_at(t) / bound;
            for (int k = 0; k < 3; ++k) result[k] *= std::max(0.0, 1 - there[k]);
            if (largest(result) < kFaint) {
                if (sampler.next() < 0.5F) return Rgb(0);
                result *= 2;
            }
            depth = exponential(sampler.next());
        }
        depth = std::max(0.0, depth - bound * (along.end() - t));
    }
    return Rgb(V3f(result));
}

}  // namespace lucerna
