#include "engine/render/features.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <span>
#include <string>
#include <vector>

#include "engine/base/stats.h"
#include "engine/denoise/denoise.h"
#include "engine/ranks/shared_work.h"
#include "engine/render/film.h"
#include "engine/render/finishing.h"
#include "engine/render/tiles.h"

namespace lucerna {
namespace {

// Largest number of mirrors and panes, one behind the other.
constexpr int kMostSpecular = 16;

struct Seen {
    Rgb albedo{1.0F};
    V3f normal{0, 0, 0}, geometric_normal{0, 0, 0}, position{0, 0, 0};
    float depth = 0, emitter = 1;
    std::uint32_t object = 0, material = 0;  // from 1
};

// Returns the albedo: exact for lobes without a peak, estimated for gloss.
Rgb feature_albedo(const Bsdf& bsdf, const V3f& wo) {
    Rgb albedo(0.0F);
    if (bsdf.has_diffuse()) albedo = bsdf.diffuse_part().albedo(wo);
    if (!bsdf.is_diffuse()) albedo += Rgb(bsdf.rest().guessed_albedo(wo));
    return {std::min(albedo.x, 1.0F), std::min(albedo.y, 1.0F), std::min(albedo.z, 1.0F)};
}

// Follows the brighter path at smooth boundaries to the first other surface, which represents what the pixel
// shows.
Seen first_surface(const Scene& scene, Ray ray) {
    Seen seen;
    for (int specular = 0; specular < kMostSpecular; ++specular) {
        const auto closest = scene.closest_hit(ray);
        if (!closest) break;
        const Hit met = scene.intersect(ray, *closest);
        const Hit* const hit = &met;
        seen.depth += hit->t;
        const Bsdf bsdf = scene.bsdf(*hit);
        const V3f wo = -ray.d;
        const bool emits = hit->light != kNoLight;
        if (emits || !bsdf.is_delta() || bsdf.is_black()) {
            if (!emits) seen.albedo *= feature_albedo(bsdf, wo);
            seen.geometric_normal = face_forward(hit->at.n, wo);
            seen.normal = face_forward(bsdf.shading_normal(), seen.geometric_normal);
            seen.position = hit->at.p;
            seen.emitter = emits ? 1 : 0;
            seen.object = scene.object_of(*closest);
            seen.material = hit->material + 1;
            return seen;
        }
        const float reflect = bsdf.reflect_chance(wo).value_or(1);
        const BsdfU u{reflect >= 0.5F ? 0.0F : 0.5F * (1 + reflect), V2f(0.5F)};
        const auto sample = bsdf.sample(wo, u, Transport::radiance);
        if (!sample) break;
        seen.albedo *= sample->weight;
        ray = Ray{hit->at.towards(sample->wi), sample->wi};
    }
    seen.depth = 0;
    return seen;
}

// Returns unit axes of the camera in the scene: to the right, up, and towards the viewer.
std::array<V3f, 3> camera_axes(const Camera& camera) {
    const M44d& m = camera.settings().world_from_camera;
    const auto axis = [&m](int row) { return V3f(V3d(m[row][0], m[row][1], m[row][2]).normalized()); };
    return {axis(0), axis(1), -axis(2)};
}

// Returns the most frequent id, and of equally frequent ones the first.
std::uint32_t most_frequent(std::span<const std::uint32_t> ids) {
    std::uint32_t best = 0;
    std::ptrdiff_t most = 0;
    for (const std::uint32_t id : ids) {
        const std::ptrdiff_t count = std::ranges::count(ids, id);
        if (count > most) most = count, best = id;
    }
    return best;
}

// Means of n quantities, and the variances of these means.
template <std::size_t n>
class Means {
  public:
    void add(const std::array<float, n>& values) {
        for (std::size_t i = 0; i < n; ++i) of_[i].add(double{values[i]});
    }
    float mean(std::size_t i) const { return static_cast<float>(of_[i].mean()); }
    float variance(std::size_t i) const {
        return of_[i].count() < 2 ? 0.0F : static_cast<float>(sqr(of_[i].standard_error()));
    }

  private:
    std::array<RunningStats, n> of_;
};

// Number of samples of every pixel; more are taken only where these disagree, and at edges between pixels.
constexpr int kFirstSamples = 4;

// Returns whether the samples of a pixel disagree, at an edge or in a texture as fine as pixels.
bool disagree(const Means<kFeatureChannels>& means) {
    // Limits of standard errors, relative for albedo and depth.
    constexpr float kAlbedoError = 0.01F, kLeastAlbedo = 0.01F, kDepthError = 0.01F, kError = 0.01F;
    const auto beyond = [&means](std::size_t i, float error) { return means.variance(i) > sqr(error); };
    for (const std::size_t c : {0, 1, 2}) {
        if (beyond(kAlbedo + c, kAlbedoError * (means.mean(kAlbedo + c) + kLeastAlbedo)) ||
            beyond(kNormal + c, kError))
            return true;
    }
    return beyond(kDepth, kDepthError * means.mean(kDepth)) || beyond(kEmitter, kError);
}

constexpr std::size_t kFeatures = kFeatureChannels, kInCamera = 3;
// Number of channels of Features::more: variances of the features, then Nc, its variances and the ids.
constexpr std::size_t kMore = kFeatures + 2 * kInCamera + 2;

std::string variance_name(const std::string& name) {
    const std::size_t dot = name.rfind('.');
    return dot == name.npos ? "variance." + name : name.substr(0, dot) + ".variance" + name.substr(dot);
}

// Returns all of them, or the ids alone.
std::vector<std::string> more_channels(bool all) {
    if (!all) return {"id.object", "id.material"};
    const std::vector<std::string> in_camera{"Nc.X", "Nc.Y", "Nc.Z"};
    std::vector<std::string> names;
    for (const std::string& name : feature_channels()) names.push_back(variance_name(name));
    names.insert(names.end(), in_camera.begin(), in_camera.end());
    for (const std::string& name : in_camera) names.push_back(variance_name(name));
    names.insert(names.end(), {"id.object", "id.material"});
    assert(names.size() == kMore);
    return names;
}

// Takes samples of pixels, and writes what they see.
class Looker {
  public:
    Looker(const Job& job, std::uint64_t seed)
        : scene_(job.scene), sampler_(job, seed, 0, nullptr), axes_(camera_axes(job.camera)) {}

    // Takes `least` samples of a pixel, and up to `most` if these disagree. Returns the number taken.
    int look(int x, int y, int least, int most, Features& features) const {
        Means<kFeatures> means;
        Means<kInCamera> in_camera;
        std::array<std::uint32_t, kMostFeatureSamples> objects, materials;
        assert(most <= kMostFeatureSamples);
        std::size_t seen_samples = 0;
        for (int s = 0; s < most; ++s) {
            if (s == least && !disagree(means)) break;
            const Seen seen = first_surface(scene_, sampler_.sample({x, y}, s).ray);
            means.add({seen.albedo.x, seen.albedo.y, seen.albedo.z, seen.normal.x, seen.normal.y,
                       seen.normal.z, seen.position.x, seen.position.y, seen.position.z, seen.depth,
                       seen.geometric_normal.x, seen.geometric_normal.y, seen.geometric_normal.z,
                       seen.emitter});
            in_camera.add({axes_[0].dot(seen.normal), axes_[1].dot(seen.normal), axes_[2].dot(seen.normal)});
            objects[seen_samples] = seen.object;
            materials[seen_samples++] = seen.material;
        }
        float* const to = &features.image.data[features.image.index(x, y)];
        float* more = &features.more.data[features.more.index(x, y)];
        for (std::size_t i = 0; i < kFeatures; ++i) to[i] = means.mean(i);
        if (features.more.channels.size() == kMore) {
            for (std::size_t i = 0; i < kFeatures; ++i) *more++ = means.variance(i);
            for (std::size_t i = 0; i < kInCamera; ++i) *more++ = in_camera.mean(i);
            for (std::size_t i = 0; i < kInCamera; ++i) *more++ = in_camera.variance(i);
        }
        *more++ = static_cast<float>(most_frequent(std::span(objects).first(seen_samples)));
        *more++ = static_cast<float>(most_frequent(std::span(materials).first(seen_samples)));
        return static_cast<int>(seen_samples);
    }

    // Takes `samples` samples of each of these pixels.
    void look_at(std::span<const V2i> pixels, int samples, Features& features, const Workers& workers,
                 Monitor& monitor) const {
        parallel_chunks(workers, static_cast<std::int64_t>(pixels.size()), [&](std::int64_t i) {
            const V2i& pixel = pixels[static_cast<std::size_t>(i)];
            if (!monitor.stopped()) look(pixel.x, pixel.y, samples, samples, features);
        });
    }

  private:
    const Scene& scene_;
    CameraSampler sampler_;
    std::array<V3f, 3> axes_;
};

// Returns whether an edge lies between two pixels.
bool differ(const Features& features, const V2i& a, const V2i& b) {
    // Limits of the differences of normals and albedos.
    constexpr float kNormalStep = 0.2F, kAlbedoStep = 0.15F;
    const auto difference = [&](std::size_t channel) {
        const int c = static_cast<int>(channel);
        return features.image.value(a.x, a.y, c) - features.image.value(b.x, b.y, c);
    };
    float of_normals = 0, of_albedos = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        of_normals += sqr(difference(kNormal + c));
        of_albedos = std::max(of_albedos, std::fabs(difference(kAlbedo + c)));
    }
    if (of_normals > sqr(kNormalStep) || of_albedos > kAlbedoStep || difference(kEmitter) != 0) return true;
    const auto channels = static_cast<int>(features.more.channels.size());
    for (const int c : {channels - 2, channels - 1}) {
        if (features.more.value(a.x, a.y, c) != features.more.value(b.x, b.y, c)) return true;
    }
    return false;
}

// The features of all pixels are on rank 0 alone.
bool leads(const Workers& workers) {
    return !workers.ranks || workers.ranks->leads();
}

std::vector<V2i> pixels_at_edges(const Features& features) {
    const int width = features.image.width, height = features.image.height;
    std::vector<std::uint8_t> is_at_edge(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const auto at = [width](const V2i& p) {
        return static_cast<std::size_t>(p.y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(p.x);
    };
    std::vector<V2i> pixels;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (const V2i& next : {V2i(x + 1, y), V2i(x, y + 1)}) {
                if (next.x < width && next.y < height && differ(features, {x, y}, next))
                    is_at_edge[at({x, y})] = is_at_edge[at(next)] = 1;
            }
        }
    }
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (is_at_edge[at({x, y})]) pixels.emplace_back(x, y);
        }
    }
    return pixels;
}

}  // namespace

Features render_features(const Job& job, std::uint64_t seed, int most_samples, const Workers& workers,
                         Monitor& monitor) {
    const V2i size = job.film.rendered_size();
    Features features{{size.x, size.y, feature_channels()}, {size.x, size.y, more_channels(job.film.parts)}};
    const Looker looker(job, seed);
    const auto width = static_cast<std::size_t>(size.x);
    std::vector<std::uint8_t> taken(width * static_cast<std::size_t>(size.y));  // samples of each pixel
    const auto look = [&](std::int64_t row) {
        if (monitor.stopped()) return;
        for (int x = 0; x < size.x; ++x) {
            taken[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(x)] =
                static_cast<std::uint8_t>(
                    looker.look(x, static_cast<int>(row), kFirstSamples, most_samples, features));
        }
    };
    const auto row_of = [&](Image& image, std::int64_t row) {
        return std::span(image.data)
            .subspan(image.index(0, static_cast<int>(row)), width * image.channels.size());
    };
    shared_chunks(
        workers, "features", size.y, ResultsGo::to_rank_0, look, [&](std::int64_t row, auto& archive) {
            std::span<float> of_image = row_of(features.image, row), more = row_of(features.more, row);
            std::span<std::uint8_t> counts =
                std::span(taken).subspan(static_cast<std::size_t>(row) * width, width);
            archive(of_image, more, counts);
        });
    if (most_samples <= kFirstSamples || !leads(workers)) return features;
    // Four samples miss an edge that crosses less than a fifth of their pixel more often than not. Along an
    // edge that is nearly parallel to the pixels they would show dots, and its neighbours tell of it.
    std::vector<V2i> missed = pixels_at_edges(features);
    std::erase_if(missed, [&](const V2i& p) {
        return taken[static_cast<std::size_t>(p.y) * width + static_cast<std::size_t>(p.x)] > kFirstSamples;
    });
    looker.look_at(missed, most_samples, features, workers.alone(), monitor);
    return features;
}

void refine_features(const Job& job, std::uint64_t seed, double samples, Features& features,
                     const Workers& workers, Monitor& monitor) {
    if (!leads(workers)) return;
    const std::vector<V2i> pixels = pixels_at_edges(features);
    if (pixels.empty()) return;
    const int each =
        static_cast<int>(std::min<double>(samples / static_cast<double>(pixels.size()), kMostFeatureSamples));
    if (each < 2) return;
    Looker(job, seed).look_at(pixels, each, features, workers.alone(), monitor);
}

}  // namespace lucerna
