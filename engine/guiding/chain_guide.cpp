#include "engine/guiding/chain_guide.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// Fewer photons are not worth a search at each place.
constexpr std::size_t kFewestSeeds = 64;
// More photons hardly know more chains.
constexpr double kEnoughSeeds = 100'000;

// A lamp is small if its bounds are seen under at most this angle, rad. Rays drawn by the BSDF find larger
// ones.
constexpr float kSmall = 0.3F;

bool is_small(const Light& light, const V3f& from) {
    if (light.is_at_infinity() || light.only_particles()) return false;
    const auto bounds = light.bounds();
    if (!bounds) return false;
    const float size = bounds->box.size().length(), distance = (bounds->box.center() - from).length();
    return size < kSmall * distance;
}

double distance_of(const Chain& chain, const V3f& y) {
    return (V3d(y) - V3d(chain.from.p)).length();
}

// Describes where a line to a lamp ends: on the surface that carries it, or on a plane through its middle.
// Both strategies count area there.
struct LampPlace {
    V3f y, n;
    // Returns the density per area of a direction drawn at `from` with density `pdf_w`.
    double pdf_area(const V3f& from, float pdf_w) const {
        const V3d way = V3d(y) - V3d(from);
        const double r2 = way.length2();
        return static_cast<double>(pdf_w) * std::fabs(way.dot(V3d(n))) / (r2 * std::sqrt(r2));
    }
    // Returns the solid angle at the beginning of a chain that leads here per area.
    double solid_angle_per_area(const Chain& chain) const {
        return chain.solid_angle_per_area(distance_of(chain, y)) * std::fabs(double{chain.d.dot(n)});
    }
};
// Returns the place where a line through `o` along `d` ends on the plane through the lamp's middle that faces
// `from`; none if it is parallel to the plane.
std::optional<LampPlace> place_on_plane(const Light& light, const V3f& from, const V3f& o, const V3f& d) {
    const V3f middle = light.bounds()->box.center();  // seeds have only lights with bounds
    const V3f n = (middle - from).normalized();
    const float along = d.dot(n);
    if (along == 0) return std::nullopt;
    return LampPlace{o + (middle - o).dot(n) / along * d, n};
}

struct FoundEnd {
    LampPlace place;
    float pdf_w;  // with which sample_Li() at the reference point leads there
};
// Returns where a ray that has met the lamp ends. Where a lamp without geometry is also on a surface of the
// scene, rays to that surface are left to chance.
std::optional<FoundEnd> end_of(const Light& light, const V3f& reference, const ChainEnd& end) {
    if (end.hit) {
        if (light.has_impostor()) return std::nullopt;
        const LampPlace place{end.hit->at.p, end.hit->at.n};
        const V3f way = place.y - reference;
        const float distance = way.length();
        if (!(distance > 0)) return std::nullopt;
        const EmittedRadiance seen =
            light.Le_on_surface({reference, way / distance}, distance, place.n, end.hit->primitive);
        return FoundEnd{place, seen.pdf_w};
    }
    const auto place = place_on_plane(light, reference, end.ray.o, end.ray.d);
    if (!place) return std::nullopt;
    const auto seen = light.Le({reference, (place->y - reference).normalized()});
    return FoundEnd{*place, seen ? seen->pdf_w : 0.0F};
}

// The search ends after so many guesses that find no new chain.
constexpr int kMostInVain = 10;

}  // namespace

ChainGuide::ChainGuide(const Scene& scene, const Photons& photons, std::vector<Seed> seeds,
                       std::int64_t paths, const Workers& workers)
    : scene_(scene), seeds_(std::move(seeds)), paths_(paths), map_(photons, IndexKind::tree, workers) {
    // Photons that are much further away than others are from each other say nothing.
    constexpr std::size_t kProbes = 255;
    std::vector<float> distances;
    const float most2 = sqr(diagonal(scene));
    for (std::size_t i = 0; i < map_.size(); i += std::max<std::size_t>(map_.size() / kProbes, 1)) {
        const V3f x = map_.positions()[i], n = map_.normals()[i].unpack();
        distances.push_back(
            NearPhotons(map_, x, {x, n, MetricKind::euclidean, 1}, kMostGuesses, most2).radius2());
    }
    const auto upper = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() * 3 / 4);
    std::nth_element(distances.begin(), upper, distances.end());
    radius2_ = *upper;
}

ChainGuide::Guesses ChainGuide::guesses_at(const V3f& x, const V3f& n) const {
    Guesses guesses;
    const NearPhotons near(map_, x, {x, n, MetricKind::euclidean, 1}, kMostGuesses, radius2_);
    for (const Neighbour& neighbour : near.found())
        guesses.seeds[static_cast<std::size_t>(guesses.count++)] =
            &seeds_[map_.photons()[neighbour.index].cell];
    return guesses;
}

ChanceChain ChainGuide::chance_chain(const Place& place, const V3f& first, float pdf_w) const {
    return {this, place.at.hit.at, place.at.normal(), first, pdf_w, place.chance, {}};
}

ChainGuide::Found ChainGuide::search(const SurfacePoint& x, const Guesses& guesses, std::uint32_t light,
                                     const V3f& y) const {
    Found found;
    int in_vain = 0;
    for (int i = 0; i < guesses.count && in_vain < kMostInVain; ++i) {
        const Seed& seed = *guesses.seeds[i];
        if (seed.light != light) continue;
        ++in_vain;
        auto chain = find_chain(scene_, x, (seed.via - x.p).normalized(), seed.events, y);
        if (!chain) continue;
        const auto is_known = [&](const FoundChain& other) {
            return seed.events == other.events &&
                   other.chain.begins_as(chain->first, distance_of(other.chain, y));
        };
        if (std::any_of(found.chains.begin(), found.chains.begin() + found.count, is_known)) continue;
        found.chains[found.count++] = {*chain, seed.events};
        in_vain = 0;
    }
    return found;
}

void ChainGuide::add_light(const Place& place, Sampler sampler, const PathAccount& path) const {
    if (place.chance < 1 && !(sampler.next() < place.chance)) return;
    const Guesses guesses = guesses_at(place.at.hit.at.p, place.at.normal());
    PathAccount account = path;
    account.scatter_at_surface(false);
    account.scatter_at_surface(true);
    for (int i = 0; i < guesses.count; ++i) {
        const Seed& seed = *guesses.seeds[i];
        const auto is_of_lamp = [&](const Seed* other) { return other->light == seed.light; };
        if (std::any_of(guesses.seeds.begin(), guesses.seeds.begin() + i, is_of_lamp)) continue;
        add_lamp(place, guesses, seed, sampler, account);
    }
}

void ChainGuide::add_lamp(const Place& place, const Guesses& guesses, const Seed& seed, Sampler& sampler,
                          const PathAccount& account) const {
    const auto& [at, drawn_by, chance, bounces_left] = place;
    const Light& lamp = *scene_.lights()[seed.light];
    const auto drawn = lamp.sample_Li(seed.first, sampler.next2());
    if (!drawn) return;
    V3f y = seed.first + drawn->distance * drawn->w;
    if (lamp.has_impostor()) {
        const auto on_plane = place_on_plane(lamp, seed.first, seed.first, drawn->w);
        if (!on_plane) return;
        y = on_plane->y;
    }
    const Found found = search(at.hit.at, guesses, seed.light, y);
    for (std::size_t i = 0; i < found.count; ++i) {
        const auto& [chain, events] = found.chains[i];
        if (events.bounces() >= bounces_left) continue;
        Rgb radiance = at.value(chain.first) * chain.passed / chance;
        if (is_black(radiance)) continue;
        const Ray ray = chain.ray();
        const auto hit = scene_.intersect(ray);
        float distance = 0;
        if (lamp.is_delta()) {
            const V3f& last = chain.from.p;
            const auto arriving = lamp.sample_Li(last, V2f(0.5F));
            distance = (y - last).length();
            if (!arriving || (hit && hit->t < distance * (1 - 1e-4F))) continue;
            const double per_area = chain.solid_angle_per_area(double{distance});
            radiance *= arriving->weight * static_cast<float>(sqr(double{distance}) * per_area);
        } else {
            const bool carries = hit && hit->light == static_cast<std::int32_t>(seed.light);
            EmittedRadiance seen{Rgb(0), 0, 0};
            if (carries) {
                seen = lamp.Le_on_surface(ray, hit->t, hit->at.n, hit->primitive);
            } else if (const auto impostor = lamp.Le(ray);
                       impostor && !(hit && hit->t < impostor->distance)) {
                seen = *impostor;
            }
            if (is_black(seen.radiance)) continue;
            distance = seen.distance;
            const auto end = end_of(lamp, seed.first, {ray, distance, carries ? &*hit : nullptr});
            if (!end || !(end->pdf_w > 0)) continue;
            const double pdf = double{chance} * end->place.pdf_area(seed.first, drawn->pdf_w);
            const double per_area = end->place.solid_angle_per_area(chain);
            const double by_chance = double{drawn_by.pdf_w(chain.first)} * double{chain.chance} * per_area;
            // The weight pdf²/(pdf² + by_chance²) keeps the quotient bounded at a focus.
            const double weight = double{chance} * per_area * pdf / (pdf * pdf + by_chance * by_chance);
            if (!std::isfinite(weight)) continue;
            radiance *= seen.radiance * static_cast<float>(weight);
        }
        if (!scene_.media().empty()) {
            radiance *= transmittance(scene_, at.hit.at, at.medium_towards(chain.first), chain.first, events,
                                      distance, sampler);
        }
        account.add_emitted(radiance, seed.light, true);
    }
}

float ChainGuide::share(const ChanceChain& chain, std::uint32_t light, const ChainEnd& end) const {
    const Guesses guesses = guesses_at(chain.x.p, chain.facing);
    const auto* const last = guesses.seeds.data() + guesses.count;
    const auto* const seed =
        std::find_if(guesses.seeds.data(), last, [&](const Seed* of) { return of->light == light; });
    if (seed == last) return 1;
    const auto at = end_of(*scene_.lights()[light], (*seed)->first, end);
    if (!at || !(at->pdf_w > 0)) return 1;
    const Found found = search(chain.x, guesses, light, at->place.y);
    for (std::size_t i = 0; i < found.count; ++i) {
        const auto& [same, events] = found.chains[i];
        if (!(events == chain.events) || !same.begins_as(chain.first, distance_of(same, at->place.y)))
            continue;
        const double pdf = double{chain.chance} * at->place.pdf_area((*seed)->first, at->pdf_w);
        const double by_chance =
            double{chain.pdf_w} * double{same.chance} * at->place.solid_angle_per_area(same);
        const double ratio = pdf / by_chance;
        return static_cast<float>(1 / (1 + ratio * ratio));
    }
    return 1;
}

namespace {

// Keeps the photons of one chunk of paths, one path after the other.
struct ChainHits : LightPathVisitor {
    ChainHits() = default;
    explicit ChainHits(const Scene& of_scene) : scene(&of_scene) {}

    const Scene* scene = nullptr;
    Photons photons;
    std::vector<ChainGuide::Seed> seeds;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, photons, seeds);
    }

    // Hold the hits of the present path, on specular surfaces, and its directions of travel towards them.
    struct Passed {
        V3f p, n, d;
    };
    std::vector<Passed> passed;
    bool is_known = true;  // whether all of its surfaces can be part of a chain

    bool begin(std::uint32_t /*path*/, const std::optional<LightPathStart>& /*start*/, const Sampler& /*s*/) {
        passed.clear();
        is_known = true;
        return true;
    }
    void hit(const LightPathHit& at) {
        if (!at.bsdf.is_delta()) store(at);
        is_known = is_known && at.bsdf.is_single_delta() && passed.size() < ChainEvents::kMost;
        if (is_known) passed.push_back({at.hit.at.p, at.hit.at.n, at.d});
    }
    void store(const LightPathHit& at) {
        if (!is_known || at.path.bounces() == 0) return;
        if (!is_small(*scene->lights()[at.start.light], passed.front().p)) return;
        ChainEvents events;
        V3f leaving = at.d;
        for (std::size_t i = passed.size(); i-- > 0;) {
            const V3f& n = passed[i].n;
            const bool crosses = (n.dot(leaving) > 0) == (n.dot(passed[i].d) > 0);
            const bool is_straight = crosses && (leaving - passed[i].d).length2() < 1e-12F;
            events.append(is_straight ? SpecularEvent::straight
                          : crosses   ? SpecularEvent::refraction
                                      : SpecularEvent::reflection);
            leaving = passed[i].d;
        }
        photons.add_hit(at.hit.at, at.d, at.power, at.start.light, static_cast<CellId>(seeds.size()));
        seeds.push_back({passed.back().p, passed.front().p, at.start.light, events});
    }
};

}  // namespace

std::unique_ptr<const ChainGuide> build_chain_guide(const Scene& scene, const ChainParameters& parameters,
                                                    const Workers& workers, Monitor& monitor) {
    constexpr std::int64_t kFirst = 16'384;
    if (!scene.has_specular()) return nullptr;
    require_path_numbers("chains", parameters.paths);
    LightPathRequest paths;
    paths.count = std::min(parameters.paths, kFirst);
    paths.seed = parameters.seed;
    paths.use = PathUse::caustics;
    paths.interleaved = false;  // a visitor sees one path after the other
    paths.phase = "chains";
    std::vector<ChainHits> chunks;
    std::size_t seeds = 0;
    const auto trace = [&] {
        trace_light_paths({scene, workers, monitor}, paths, chunks,
                          [&](std::int64_t /*count*/) { return ChainHits(scene); });
        seeds = 0;
        for (const ChainHits& chunk : chunks) seeds += chunk.seeds.size();
    };
    trace();
    // More paths are traced until there are enough seeds, unless even all paths would make too few.
    const double found = static_cast<double>(seeds), all = static_cast<double>(parameters.paths);
    if (found * all >= kFewestSeeds * static_cast<double>(paths.count)) {  // so that found > 0
        const double wanted = kEnoughSeeds / found * static_cast<double>(paths.count);
        paths.count = std::max(paths.count, static_cast<std::int64_t>(std::min(wanted, all)));
        trace();
    }
    if (seeds < kFewestSeeds || monitor.stopped()) return nullptr;
    Photons photons;
    std::vector<ChainGuide::Seed> joined;
    for (ChainHits& chunk : chunks) {
        for (Photon& photon : chunk.photons.photons) photon.cell += static_cast<CellId>(joined.size());
        photons.append(chunk.photons);
        joined.insert(joined.end(), chunk.seeds.begin(), chunk.seeds.end());
    }
    return std::make_unique<const ChainGuide>(scene, photons, std::move(joined), paths.count, workers);
}

}  // namespace lucerna
