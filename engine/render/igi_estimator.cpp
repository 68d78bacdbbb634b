#include "engine/render/igi_estimator.h"

#include "engine/render/guided_light.h"
#include "engine/render/igi_shade.h"
#include "engine/render/light_choice.h"
#include "engine/render/path_estimators.h"
#include "engine/render/specular_chain.h"
#include "photon/walk.h"

namespace lucerna {
namespace {

// Of the scene's diagonal: wide enough to hide the bright spots of some ten virtual lights per set.
constexpr float kDefaultMinDist = 0.02F;

// A compensating ray on its way from a place that virtual lights have lit.
struct Onward {
    Ray ray{};
    SurfacePoint from{};  // where the ray begins
    float cosine = 1;     // of the ray there, as NearBound wants it
    Rgb worth{1.0F};
    EmissionRule rule{};
    std::int32_t medium = kNoMedium;  // of the borders, in which it begins
    // False after a mirror or smooth glass: what is met then no virtual light has brought.
    bool lit = true;
    float eta_scale = 1;  // radiance compression inside glass says nothing about what a path is worth
    // Of light that comes over L(S+D)*S+ to where the way last left a place that is not specular: the share
    // that no Caustic map has brought to a place before. And whether the way has come over specular surfaces
    // since.
    Rgb caustic{1.0F};
    bool specular = false;

    Rgb of_lamps() const { return specular ? caustic : Rgb(1.0F); }
};

// A part of a surface over which a way goes on, and what the way is worth there.
struct WayOn {
    Bsdf bsdf;
    Rgb worth;
    bool specular;  // it turns light as mirrors do, as far as caustics go
};

class IgiEstimator final : public Estimator {
  public:
    IgiEstimator(const Scene& scene, const IgiSettings& settings, IgiLights lights, IgiCaustics caustics,
                 std::optional<GuideMap> guides)
        : scene_(scene),
          settings_(settings),
          lights_(std::move(lights)),
          caustics_(std::move(caustics)),
          guides_(std::move(guides)),
          chooser_(scene, settings.lights),
          guided_{settings.pilot_floor, candidates_that_pay(scene)},
          shading_(scene, settings, lights_.paths()),
          only_diffuse_(!throws_caustics(scene)) {}

    Rgb radiance(const Ray& ray, Stream& stream) const override {
        // One well-distributed number chooses the set.
        const auto count = static_cast<float>(lights_.sets());
        const auto set = static_cast<std::size_t>(stream.next() * count);
        const auto shade = [&](const Vertex& vertex) { return seen(vertex, set, stream); };
        if (settings_.quantity == Quantity::illuminance) return meter_and_shade(scene_, ray, shade);
        const auto source = [&](const MediumVertex& vertex, const Rgb& sigma_s) {
            return sigma_s * seen(vertex, set, stream);
        };
        return follow_and_shade(scene_, ray, settings_.max_specular_depth, stream, shade, source);
    }

  private:
    DirectLight seen(const Vertex& vertex, std::size_t set, Stream& stream) const;
    Rgb seen(const MediumVertex& vertex, std::size_t set, Stream& stream) const;
    Rgb follow(Onward way, std::size_t set, Stream& stream) const;
    std::optional<WayOn> way_on(const Bsdf& bsdf, const Onward& way, const Rgb& left, Stream& stream) const;
    Onward onward(const Vertex& vertex, const BsdfSample& sample, const LightChoice& choice,
                  const Onward& before = {}) const;
    Onward onward(const MediumVertex& vertex, const V2f& u, const LightChoice& choice,
                  const Onward& before = {}) const;
    Rgb uncut(const Onward& way, const SurfacePoint& y, float cosine) const;
    static bool survives(Onward& way, Stream& stream);

    // How a surface chooses the light that it asks.
    LightChoice choice_at(const Vertex& vertex) const {
        const SurfacePoint& x = vertex.hit.at;
        const LightChoice plain = chooser_.at(x, vertex.bsdf, vertex.wo);
        if (!guides_) return plain;
        const Guide guide = guides_->at(x.p, x.n.dot(vertex.wo) < 0 ? -x.n : x.n);
        return plain.guided(guide, std::max(settings_.pilot_floor, guide.plain_share()));
    }
    DirectLight direct(const Vertex& vertex, Stream& stream) const {
        if (!guides_) return direct_light(scene_, vertex, stream, choice_at(vertex));
        const LightChoice plain = chooser_.at(vertex.hit.at, vertex.bsdf, vertex.wo);
        return GuidedLight(scene_, *guides_, guided_)(vertex, stream, plain);
    }

    // All lights of one set, by way of those that are asked, times `worth`.
    template <typename Place>
    Rgb indirect(const Place& place, std::size_t set, const Rgb& worth, Stream& stream) const {
        Rgb sum(0);
        const float u = stream.next();
        Stream more = stream.split(1);
        lights_.choose(place, set, u, more, [&](const VirtualLight& light, float scale) {
            sum += scale * shading_.shade(place, light, worth, more);
        });
        return sum;
    }

    const Scene& scene_;
    IgiSettings settings_;
    IgiLights lights_;
    IgiCaustics caustics_;
    std::optional<GuideMap> guides_;
    LightChooser chooser_;
    GuidedLightSettings guided_;
    VirtualLightShading shading_;
    bool only_diffuse_;
};

// The BSDF's sample serves direct light (its share of multiple importance sampling) and compensation at once.
DirectLight IgiEstimator::seen(const Vertex& vertex, std::size_t set, Stream& stream) const {
    DirectLight shaded;
    LightChoice choice;
    if (settings_.compensate) {
        choice = choice_at(vertex);
        shaded.radiance = next_event(scene_, vertex, stream, choice);
    } else {
        shaded = direct(vertex, stream);
    }
    if (vertex.bsdf.is_black()) return shaded;
    shaded.radiance += indirect(vertex, set, Rgb(settings_.indirect_scale), stream);
    shaded.radiance += settings_.indirect_scale * caustics_.radiance(vertex);
    if (!settings_.compensate) return shaded;

    const float share = 1 / static_cast<float>(settings_.gather_samples);
    for (int i = 0; i < settings_.gather_samples; ++i) {
        const BsdfU u{stream.next(), stream.next2()};
        const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
        if (!sample) continue;
        if (!sample->delta) {
            shaded.radiance += share * follow(onward(vertex, *sample, choice), set, stream);
        } else if (i == 0) {
            shaded.specular = sample;  // what mirrors show, one of the samples is enough for
        }
    }
    return shaded;
}

Rgb IgiEstimator::seen(const MediumVertex& vertex, std::size_t set, Stream& stream) const {
    const LightChoice choice = chooser_.at(vertex.p);
    const Rgb scale(settings_.indirect_scale);
    if (!settings_.compensate) {
        const Rgb direct = direct_light(scene_, vertex, stream, choice);
        return direct + indirect(vertex, set, scale, stream);
    }
    Rgb result = next_event(scene_, vertex, stream, choice);
    result += indirect(vertex, set, scale, stream);
    const float share = 1 / static_cast<float>(settings_.gather_samples);
    for (int i = 0; i < settings_.gather_samples; ++i) {
        result += share * follow(onward(vertex, stream.next2(), choice), set, stream);
    }
    return result;
}

// A path tracer of which virtual lights have taken over all that lies beyond the bound: at each place it asks
// them, and goes on with what they were not let to bring, 1 - kept, of what it meets. So the two halves of
// each pair of places add up to the whole, exactly. What leaves there towards the eye is worked out with the
// surface as it is, and not as the Lambertian one that a virtual light takes it for: the nearer the bound is
// to all there is, the nearer the image to the path tracer's. The set stays the same: every term of the sum
// is linear in one set's lights, so its mean is that over all sets.
//
// Virtual lights stand for what scatters diffusely (virtual_light_gloss()): of light that a mirror, glass or
// gloss turned where the ray lands nothing is taken off. Of lamps that are met over such surfaces, and of
// caustics that are seen by way of them, counts what the Caustic map has not brought to a place before them:
// they are small and bright, and rays would meet them seldom.
Rgb IgiEstimator::follow(Onward way, std::size_t set, Stream& stream) const {
    Rgb near(0), beyond(0);  // up to the first place that is met, and from there
    for (std::uint32_t bounce = 0; bounce < kMaxBounces && !is_black(way.worth); ++bounce) {
        const auto hit = scene_.hit(way.ray);
        (bounce == 0 ? near : beyond) +=
            way.worth * way.of_lamps() * emission(scene_, way.ray, hit, way.rule, way.medium, stream);

        const Crossing crossing = cross_media(scene_, way.ray, hit, way.medium, way.worth, stream);
        way.worth = crossing.power;
        way.medium = crossing.medium;
        if (crossing.scattered) {
            const MediumVertex vertex{crossing.scattered->p, HenyeyGreenstein(crossing.scattered->g),
                                      -way.ray.d, way.medium};
            way.worth = uncut(way, vertex.from(), 1);
            if (!survives(way, stream)) break;
            const LightChoice choice = chooser_.at(vertex.p);
            beyond += way.worth * next_event(scene_, vertex, stream, choice);
            beyond += indirect(vertex, set, way.worth, stream);
            way = onward(vertex, stream.next2(), choice, way);
            continue;
        }
        if (!hit) break;
        const Rgb left = uncut(way, hit->at, std::fabs(way.ray.d.dot(hit->at.n)));
        // Most ways end here, before anything is worked out about the surface.
        if (is_black(left) && only_diffuse_) break;
        const auto on = way_on(scene_.bsdf(*hit), way, left, stream);
        if (!on) break;
        way.worth = on->worth;
        // What came over nothing specular no map has brought before.
        if (!on->specular && !way.specular) way.caustic = Rgb(1.0F);
        way.specular = on->specular;
        const Vertex vertex{*hit, on->bsdf, -way.ray.d, way.medium};
        LightChoice choice;
        if (!on->bsdf.is_delta()) {
            if (!survives(way, stream)) break;
            choice = choice_at(vertex);
            Rgb lamps = way.of_lamps() * next_event(scene_, vertex, stream, choice);
            if (!way.specular && !is_black(way.caustic)) lamps += way.caustic * caustics_.radiance(vertex);
            beyond += way.worth * lamps + indirect(vertex, set, way.worth, stream);
        } else if (bounce >= kRouletteFrom && !survives(way, stream)) {
            break;
        }
        const BsdfU u{stream.next(), stream.next2()};
        const auto sample = on->bsdf.sample(vertex.wo, u, Transport::radiance);
        if (!sample || is_black(sample->weight)) break;
        way = onward(vertex, *sample, choice, way);
    }
    return near + beyond * settings_.indirect_scale;
}

// By chance one of the two parts of a surface: that for which virtual lights stand, whose share of the way's
// worth is what they left; and that which turns light as mirrors do. None if neither is worth anything.
std::optional<WayOn> IgiEstimator::way_on(const Bsdf& bsdf, const Onward& way, const Rgb& left,
                                          Stream& stream) const {
    const float below = caustics_.specular_below();
    const Bsdf blurred = bsdf.blurred_part(below);
    const float diffuse = blurred.is_black() ? 0.0F : max_component(left);
    if (only_diffuse_) return diffuse > 0 ? std::optional(WayOn{blurred, left, false}) : std::nullopt;
    const Bsdf sharp = bsdf.sharp_part(below);
    const float specular = sharp.is_black() ? 0.0F : max_component(way.worth);
    if (!(diffuse + specular > 0)) return std::nullopt;
    const float chance = specular / (diffuse + specular);
    // Never where the chance is 0, always where it is 1.
    if (stream.next() < chance) return WayOn{sharp, way.worth / chance, true};
    return WayOn{blurred, left / (1 - chance), false};
}

// `choice`: by which the place asked the lights.
Onward IgiEstimator::onward(const Vertex& vertex, const BsdfSample& sample, const LightChoice& choice,
                            const Onward& before) const {
    const EmissionRule rule = sample.delta ? EmissionRule::all() : EmissionRule::mis(sample.pdf_w, choice);
    return {Ray{vertex.hit.at.towards(sample.wi), sample.wi},
            vertex.hit.at,
            cosine_at(vertex, sample.wi),
            before.worth * sample.weight,
            rule,
            vertex.medium_towards(sample.wi),
            !sample.delta,
            before.eta_scale * sample.eta_scale,
            before.specular ? before.caustic : before.caustic * caustics_.left_to_rays(vertex, sample.wi),
            before.specular};
}
Onward IgiEstimator::onward(const MediumVertex& vertex, const V2f& u, const LightChoice& choice,
                            const Onward& before) const {
    const V3f wi = vertex.phase.sample(vertex.wo, u);
    const EmissionRule rule = EmissionRule::mis(vertex.pdf_w(wi), choice);
    // The phase function over its own density is 1.
    return {
        Ray{vertex.p, wi},        vertex.from(), 1, before.worth, rule, vertex.medium, true, before.eta_scale,
        caustics_.left_to_rays(), false};
}

// What is left of a way's worth after virtual lights at y have brought theirs to where it began.
Rgb IgiEstimator::uncut(const Onward& way, const SurfacePoint& y, float cosine) const {
    if (!way.lit) return way.worth;
    const float d2 = (y.p - way.from.p).length2();
    return way.worth * (1 - shading_.bound().kept(d2, way.cosine * cosine, way.from.error + y.error));
}

// Roulette, before a set of lights is asked: every survivor is worth it. Even with albedo 1 it ends.
bool IgiEstimator::survives(Onward& way, Stream& stream) {
    const float survival = std::min(kMaxSurvival, max_component(way.worth) / way.eta_scale);
    if (!(stream.next() < survival)) return false;  // also where nothing is left
    way.worth /= survival;
    return true;
}

}  // namespace

IgiSettings with_distance(const Scene& scene, IgiSettings settings) {
    if (settings.mindist < 0) settings.mindist = kDefaultMinDist * diagonal(scene);
    return settings;
}

std::unique_ptr<const Estimator> make_igi_estimator(const Scene& scene, const IgiSettings& settings,
                                                    IgiLights lights, IgiCaustics caustics,
                                                    std::optional<GuideMap> guides) {
    return std::make_unique<IgiEstimator>(scene, settings, std::move(lights), std::move(caustics),
                                          std::move(guides));
}

}  // namespace lucerna
