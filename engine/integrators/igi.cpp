// Instant global illumination [Keller 1997; Wald 2002; Pharr 2004]: indirect light from sets of VPLs, on
// surfaces and where media scatter. How VPLs are made, chosen and clamped is engine/vpl.
#include <fmt/format.h>

#include <bit>

#include "engine/base/path_limits.h"
#include "engine/guiding/guide.h"
#include "engine/integrators/integrator.h"
#include "engine/transport/light_choice.h"
#include "engine/transport/specular_chain.h"
#include "engine/vpl/igi_caustics.h"
#include "engine/vpl/igi_pre_pass.h"
#include "engine/vpl/igi_vpls.h"
#include "engine/vpl/vpl_shading.h"

namespace lucerna {
namespace {

// -----------------------------------------------------------------------------------------------------
// What the camera sees: a set of VPLs lights surfaces, and the places along a ray at which media scatter
// -----------------------------------------------------------------------------------------------------

// A compensating path: its ray at hand begins at a place that VPLs have lit.
struct CompensatingPath {
    Ray ray{};
    SurfacePoint from{};  // where the ray begins
    float cosine = 1;     // of the ray there, as ClampedGeometry wants it
    Rgb throughput{1.0F};
    EmissionRule rule{};
    std::int32_t medium = kNoMedium;  // of the borders, in which it begins
    // Of the throughput, the share that belongs to lobes which VPLs light: 0 after a mirror or gloss, where
    // what is met no VPL has brought.
    Rgb by_vpls{1.0F};
    float eta_scale = 1;  // as survival_of() has it
    // Of light that comes over L(S+D)*S+ to where the path last left a place that is not specular: the share
    // that no Caustic map has brought to a place before. And whether the path has come over specular surfaces
    // since.
    Rgb caustic{1.0F};
    bool specular = false;
    int left = 0;  // bounces that the whole path, from the light, may still have

    Rgb of_lamps() const { return specular ? caustic : Rgb(1.0F); }
};

// A part of a surface over which a path goes on, and its throughput there.
struct LobeChoice {
    Bsdf bsdf;
    Rgb throughput;
    bool specular;  // it turns light as mirrors do, as far as caustics go
};

// Of what all lobes of `bsdf` send from wi to wo, the share of those in `part`.
Rgb share_of_part(const Bsdf& part, const Bsdf& bsdf, const V3f& wo, const V3f& wi) {
    if (part.is_black()) return Rgb(0);
    const Rgb own = part.f(wo, wi, Transport::radiance), all = bsdf.f(wo, wi, Transport::radiance);
    Rgb share(0);
    for (int c = 0; c < 3; ++c) share[c] = all[c] > 0 ? std::min(own[c] / all[c], 1.0F) : 0.0F;
    return share;
}

class IgiEstimator final : public Estimator {
  public:
    IgiEstimator(const Scene& scene, const IgiSettings& settings, IgiVpls lights, IgiCaustics caustics,
                 const GuideMap* guides)
        : scene_(scene),
          settings_(settings),
          lights_(std::move(lights)),
          caustics_(std::move(caustics)),
          guides_(guides),
          chooser_(scene, settings.lights),
          guided_{settings.pre_pass.defensive_weight, candidates_that_pay(scene)},
          shading_(scene, settings, lights_.paths()),
          only_diffuse_(!throws_caustics(scene)) {}

    Rgb Li(const Ray& ray, Sampler& sampler) const override { return Li_of(CameraRay{ray}, sampler); }
    // Each half of the samples sees one half of the sets, so that what sets differ by is what halves differ
    // by. One well-distributed number chooses the set.
    Rgb Li_of(const CameraRay& camera, Sampler& sampler) const override {
        const std::size_t vpls = chosen_set(sampler.next(), camera.half, lights_.sets());
        return camera_sample(camera, {vpls, static_cast<std::size_t>(camera.half.value_or(0))}, sampler);
    }

  private:
    // What a camera sample sees of all that was made: a set of VPLs, and the caustic photons of its half.
    struct LightSet {
        std::size_t vpls, half;
    };

    Rgb camera_sample(const CameraRay& camera, const LightSet& set, Sampler& sampler) const {
        const Ray& ray = camera.ray;
        const PartsSink of_ray(camera.parts, camera.blur);
        const int most = most_bounces(settings_.max_depth);
        const auto shade = [&](const Vertex& vertex, int left, const PartsSink& parts) {
            return shade_place(vertex, set, left, sampler, parts);
        };
        if (settings_.quantity == Quantity::illuminance)
            return meter_and_shade(scene_, ray, most, shade, of_ray);
        const auto source = [&](const MediumVertex& vertex, const Rgb& sigma_s, int left,
                                const PartsSink& parts) {
            return sigma_s * shade_place(vertex, set, left, sampler, parts.times(sigma_s).in_medium());
        };
        return follow_and_shade(scene_, from_camera(scene_, ray, camera.rule(), most), sampler, shade, source,
                                of_ray);
    }

    // Where paths may have `left` > 0 more bounces, the one there included.
    DirectLight shade_place(const Vertex& vertex, const LightSet& set, int left, Sampler& sampler,
                            const PartsSink& parts) const;
    Rgb shade_place(const MediumVertex& vertex, const LightSet& set, int left, Sampler& sampler,
                    const PartsSink& parts) const;
    // `parts`: of the path's ray, but for its throughput.
    Rgb follow(CompensatingPath path, const LightSet& set, Sampler& sampler, PartsSink parts) const;
    std::optional<LobeChoice> choose_lobe(const Bsdf& bsdf, const CompensatingPath& path, const Rgb& left,
                                          Sampler& sampler) const;
    CompensatingPath continue_path(const Vertex& vertex, const BsdfSample& sample, const LightChoice& choice,
                                   const Rgb& by_vpls, const CompensatingPath& before) const;
    CompensatingPath continue_path(const MediumVertex& vertex, const V2f& u, const LightChoice& choice,
                                   const CompensatingPath& before) const;
    static CompensatingPath straight_on(CompensatingPath path, const Hit& hit, const Rgb& throughput,
                                        std::int32_t medium);
    // What there is before the first ray of a compensating path.
    static CompensatingPath from_eye(int left) {
        CompensatingPath path;
        path.left = left;
        return path;
    }
    Rgb residual(const CompensatingPath& path, const SurfacePoint& y, float cosine) const;
    static bool survives(CompensatingPath& path, Sampler& sampler);

    // The lobes of a surface that VPLs light. With compensation gloss is none of them: through its peak
    // single VPLs are seen as sparks, and rays find all of what it shows.
    Bsdf lit_by_vpls(const Bsdf& bsdf) const {
        return settings_.compensate ? bsdf.blurred_part(caustics_.specular_below()) : bsdf;
    }

    // How a surface chooses the light that it asks.
    LightChoice choice_at(const Vertex& vertex) const {
        const SurfacePoint& x = vertex.hit.at;
        const LightChoice plain = chooser_.at(x, vertex.bsdf, vertex.wo);
        if (!guides_) return plain;
        const Guide guide = guides_->at(x.p, vertex.normal());
        return plain.guided(guide, std::max(settings_.pre_pass.defensive_weight, guide.defensive_weight()));
    }
    DirectLight direct(const Vertex& vertex, Sampler& sampler, const PartsSink& parts) const {
        if (!guides_) return direct_light(scene_, vertex, sampler, choice_at(vertex), parts);
        const LightChoice plain = chooser_.at(vertex.hit.at, vertex.bsdf, vertex.wo);
        return GuidedLight(scene_, *guides_, guided_)(vertex, sampler, plain, parts);
    }

    // Bounces of light paths before VPLs that count where `left` are left: one is the VPL's, one the place's.
    int within(int left) const { return settings_.max_depth > 0 ? left - 2 : kMaxBounces; }

    // All lights of one set, by way of those that are asked, times `throughput`.
    template <typename Place>
    Rgb indirect(const Place& place, const LightSet& set, int left, const Rgb& throughput, Sampler& sampler,
                 const PartsSink& parts) const {
        Rgb sum(0);
        const float u = sampler.next();
        Sampler more = sampler.split(1);
        const int bounces = within(left);
        if (bounces < 0) return sum;
        lights_.choose(place, set.vpls, u, more, [&](const Vpl& light, float scale) {
            if (int{light.bounces} > bounces) return;
            const Rgb brought = scale * shading_.shade(place, light, throughput, more);
            sum += brought;
            parts.indirect(brought, light.light);
        });
        return sum;
    }

    const Scene& scene_;
    IgiSettings settings_;
    IgiVpls lights_;
    IgiCaustics caustics_;
    const GuideMap* guides_;  // null: none
    LightChooser chooser_;
    GuidedLightSettings guided_;
    VplShading shading_;
    bool only_diffuse_;
};

// The BSDF's sample serves direct light (its share of multiple importance sampling) and compensation at once.
DirectLight IgiEstimator::shade_place(const Vertex& vertex, const LightSet& set, int left, Sampler& sampler,
                                      const PartsSink& parts) const {
    DirectLight shaded;
    LightChoice choice;
    if (settings_.compensate) {
        choice = choice_at(vertex);
        shaded.radiance = next_event(scene_, vertex, sampler, choice, parts);
    } else {
        shaded = direct(vertex, sampler, parts);
    }
    if (vertex.bsdf.is_black()) return shaded;
    const Bsdf lit = lit_by_vpls(vertex.bsdf);
    const Vertex lit_vertex{vertex.hit, lit, vertex.wo, vertex.medium};
    shaded.radiance += indirect(lit_vertex, set, left, Rgb(settings_.indirect_scale), sampler, parts);
    shaded.radiance += settings_.indirect_scale *
                       caustics_.radiance(vertex, set.half, left, parts.times(settings_.indirect_scale));
    if (!settings_.compensate) return shaded;

    const float share = 1 / static_cast<float>(settings_.gather_samples);
    for (int i = 0; i < settings_.gather_samples; ++i) {
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
        if (!sample) continue;
        if (!sample->delta) {
            const Rgb by_vpls = share_of_part(lit, vertex.bsdf, vertex.wo, sample->wi);
            shaded.radiance += share * follow(continue_path(vertex, *sample, choice, by_vpls, from_eye(left)),
                                              set, sampler, parts.times(share).past_surface());
        } else if (i == 0) {
            shaded.specular = sample;  // what mirrors show, one of the samples is enough for
        }
    }
    return shaded;
}

Rgb IgiEstimator::shade_place(const MediumVertex& vertex, const LightSet& set, int left, Sampler& sampler,
                              const PartsSink& parts) const {
    const LightChoice choice = chooser_.at(vertex.p);
    const Rgb scale(settings_.indirect_scale);
    if (!settings_.compensate) {
        const Rgb direct = direct_light(scene_, vertex, sampler, choice, parts);
        return direct + indirect(vertex, set, left, scale, sampler, parts);
    }
    Rgb result = next_event(scene_, vertex, sampler, choice, parts);
    result += indirect(vertex, set, left, scale, sampler, parts);
    const float share = 1 / static_cast<float>(settings_.gather_samples);
    for (int i = 0; i < settings_.gather_samples; ++i) {
        result += share * follow(continue_path(vertex, sampler.next2(), choice, from_eye(left)), set, sampler,
                                 parts.times(share));
    }
    return result;
}

// A path tracer of which VPLs have taken over all that lies beyond the bound: at each place it asks them, and
// goes on with the residual of clamping, 1 - clamped(), of what it meets. So the two halves of each pair of
// places add up to the whole, exactly. What leaves there towards the eye is worked out with the surface as it
// is, and not as the Lambertian one that a VPL takes it for: the nearer the bound is to all there is, the
// nearer the image to the path tracer's. The set stays the same: every term of the sum is linear in one set's
// lights, so its mean is that over all sets.
//
// VPLs stand for what scatters diffusely (vpl_gloss()): of light that a mirror, glass or gloss turned where
// the ray lands nothing is taken off. Of lamps that are met over such surfaces, and of caustics that are seen
// by way of them, counts what the Caustic map has not brought to a place before them: they are small and
// bright, and rays would meet them seldom.
Rgb IgiEstimator::follow(CompensatingPath path, const LightSet& set, Sampler& sampler,
                         PartsSink parts) const {
    Rgb near(0), beyond(0);                        // up to the first place that is met, and from there
    const float scale = settings_.indirect_scale;  // of the latter
    int bounce = 0;
    while (bounce < kMaxBounces && !is_black(path.throughput)) {
        const CompensatingPath arriving = path;
        const auto hit = scene_.intersect(path.ray);
        const PartsSink of_lamps = parts.times(path.throughput * path.of_lamps() * (bounce == 0 ? 1 : scale));
        (bounce == 0 ? near : beyond) +=
            path.throughput * path.of_lamps() *
            (path.left == 0 ? emission_ahead(scene_, path.ray, hit, path.rule, path.medium, sampler, of_lamps)
                            : emission(scene_, path.ray, hit, path.rule, path.medium, sampler, of_lamps));
        if (path.left == 0) break;

        const MediaTraversal crossing =
            traverse_media(scene_, path.ray, hit, path.medium, path.throughput, sampler);
        path.throughput = crossing.power;
        path.medium = crossing.medium;
        if (crossing.scattered) {
            const MediumVertex vertex{crossing.scattered->p, HenyeyGreenstein(crossing.scattered->g),
                                      -path.ray.d, path.medium};
            path.throughput = residual(path, vertex.from(), 1);
            if (!survives(path, sampler)) break;
            const LightChoice choice = chooser_.at(vertex.p);
            parts = parts.in_medium();
            beyond += path.throughput *
                      next_event(scene_, vertex, sampler, choice, parts.times(path.throughput * scale));
            beyond += indirect(vertex, set, path.left, path.throughput, sampler, parts.times(scale));
            path = continue_path(vertex, sampler.next2(), choice, path);
            ++bounce;
            continue;
        }
        if (!hit) break;
        const Rgb left = residual(path, hit->at, std::fabs(path.ray.d.dot(hit->at.n)));
        // Most ways end here, before anything is worked out about the surface.
        if (is_black(left) && only_diffuse_) break;
        const auto on = choose_lobe(scene_.bsdf(*hit), path, left, sampler);
        if (!on) break;
        path.throughput = on->throughput;
        // What came over nothing specular no map has brought before.
        if (!on->specular && !path.specular) path.caustic = Rgb(1.0F);
        path.specular = on->specular;
        const Vertex vertex{*hit, on->bsdf, -path.ray.d, path.medium};
        LightChoice choice;
        if (!on->bsdf.is_delta()) {
            if (!survives(path, sampler)) break;
            choice = choice_at(vertex);
            const PartsSink here = parts.times(path.throughput * scale);
            Rgb lamps =
                path.of_lamps() * next_event(scene_, vertex, sampler, choice, here.times(path.of_lamps()));
            if (!path.specular && !is_black(path.caustic))
                lamps +=
                    path.caustic * caustics_.radiance(vertex, set.half, path.left, here.times(path.caustic));
            beyond += path.throughput * lamps;
            if (!on->specular)
                beyond += indirect(vertex, set, path.left, path.throughput, sampler, parts.times(scale));
        } else if (bounce >= kRouletteFrom && !survives(path, sampler)) {
            break;
        }
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = on->bsdf.sample(vertex.wo, u, Transport::radiance);
        if (!sample || is_black(sample->weight)) break;
        if (sample->straight) {
            path = straight_on(arriving, *hit, path.throughput * sample->weight, path.medium);
            continue;
        }
        const Rgb by_vpls(sample->delta || on->specular ? 0.0F : 1.0F);
        parts = parts.past(sample->delta);
        path = continue_path(vertex, *sample, choice, by_vpls, path);
        ++bounce;
    }
    return near + beyond * settings_.indirect_scale;
}

// By chance one of the two parts of a surface: that for which VPLs stand, whose share of the path's
// throughput is what they left; and that which turns light as mirrors do. None if neither contributes.
std::optional<LobeChoice> IgiEstimator::choose_lobe(const Bsdf& bsdf, const CompensatingPath& path,
                                                    const Rgb& left, Sampler& sampler) const {
    const float below = caustics_.specular_below();
    const Bsdf blurred = bsdf.blurred_part(below);
    const float diffuse = blurred.is_black() ? 0.0F : max_component(left);
    if (only_diffuse_) return diffuse > 0 ? std::optional(LobeChoice{blurred, left, false}) : std::nullopt;
    const Bsdf sharp = bsdf.sharp_part(below);
    const float specular = sharp.is_black() ? 0.0F : max_component(path.throughput);
    if (!(diffuse + specular > 0)) return std::nullopt;
    const float chance = specular / (diffuse + specular);
    // Never where the chance is 0, always where it is 1.
    if (sampler.next() < chance) return LobeChoice{sharp, path.throughput / chance, true};
    return LobeChoice{blurred, left / (1 - chance), false};
}

// `choice`: by which the place asked the lights; `by_vpls` as CompensatingPath has it.
CompensatingPath IgiEstimator::continue_path(const Vertex& vertex, const BsdfSample& sample,
                                             const LightChoice& choice, const Rgb& by_vpls,
                                             const CompensatingPath& before) const {
    const EmissionRule rule = sample.delta ? EmissionRule::all() : EmissionRule::mis(sample.pdf_w, choice);
    return {Ray{vertex.hit.at.towards(sample.wi), sample.wi},
            vertex.hit.at,
            cosine_at(vertex, sample.wi),
            before.throughput * sample.weight,
            rule,
            vertex.medium_towards(sample.wi),
            by_vpls,
            before.eta_scale * sample.eta_scale,
            before.specular ? before.caustic : before.caustic * caustics_.left_to_rays(vertex, sample.wi),
            before.specular,
            before.left - 1};
}
CompensatingPath IgiEstimator::continue_path(const MediumVertex& vertex, const V2f& u,
                                             const LightChoice& choice,
                                             const CompensatingPath& before) const {
    const V3f wi = vertex.phase.sample(vertex.wo, u);
    const EmissionRule rule = EmissionRule::mis(vertex.pdf_w(wi), choice);
    // The phase function over its own density is 1.
    return {Ray{vertex.p, wi},
            vertex.from(),
            1,
            before.throughput,
            rule,
            vertex.medium,
            Rgb(1),
            before.eta_scale,
            caustics_.left_to_rays(),
            false,
            before.left - 1};
}

// The path goes straight on behind a pane. It still belongs to the place where it began: lamps and VPLs
// behind the pane have lit that place, too.
CompensatingPath IgiEstimator::straight_on(CompensatingPath path, const Hit& hit, const Rgb& throughput,
                                           std::int32_t medium) {
    path.rule = path.rule.behind(path.ray, hit.t);
    path.medium = medium_towards(hit.media, hit.at.n, path.ray.d, medium);
    path.ray = Ray{hit.at.towards(path.ray.d), path.ray.d};
    path.throughput = throughput;
    return path;
}

// What is left of a path's throughput after VPLs at y have brought theirs to where it began.
Rgb IgiEstimator::residual(const CompensatingPath& path, const SurfacePoint& y, float cosine) const {
    if (is_black(path.by_vpls)) return path.throughput;
    const float d2 = (y.p - path.from.p).length2();
    const float clamped = shading_.geometry().clamped(d2, path.cosine * cosine, path.from.error + y.error);
    return path.throughput * (Rgb(1) - path.by_vpls * clamped);
}

// Roulette, before a set of lights is asked: every survivor is worth it. Even with albedo 1 it ends.
bool IgiEstimator::survives(CompensatingPath& path, Sampler& sampler) {
    const float survival = survival_of(path.throughput, path.eta_scale);
    if (!(sampler.next() < survival)) return false;  // also where nothing is left
    path.throughput /= survival;
    return true;
}

// -----------------------------------------------------------------------------------------------------
// Before the sets: an importance pre-pass
// -----------------------------------------------------------------------------------------------------

// Learns where light paths start, which VPLs stay and which lights surfaces ask, and tells what it learned,
// or why emission stays plain. None: it stays plain (or the monitor stopped it). Settings as with_distance()
// gives them.
std::optional<IgiPrePass> learn_emission(const IgiSettings& settings, const RenderContext& context,
                                         OnceStatistics& statistics) {
    statistics.emission = why_emission_is_plain(settings.pre_pass, context);
    if (!statistics.emission.empty()) return std::nullopt;
    auto pre_pass = run_igi_pre_pass(settings, context);
    report_pre_pass(pre_pass ? &pre_pass->importance : nullptr, settings.pre_pass, context.scene, statistics);
    return pre_pass;
}

// -----------------------------------------------------------------------------------------------------
// The integrator: makes sets of VPLs, thins them, puts them in order, and a map of caustics beside them
// -----------------------------------------------------------------------------------------------------

// Numbers of sets, and of light paths for each, as sequences want them.
std::uint32_t sets_of(const IgiSettings& settings) {
    return std::bit_ceil(static_cast<std::uint32_t>(settings.nsets));
}
std::uint32_t paths_of(const IgiSettings& settings) {
    return std::bit_ceil(static_cast<std::uint32_t>(settings.nlights));
}
// Whether more VPLs are made than are kept. A defensive weight of 1 leaves all as it is.
bool thins(const IgiSettings& settings) {
    return settings.pre_pass.paths > 0 && settings.pre_pass.defensive_weight < 1;
}

class IgiSession final : public Session {
  public:
    // `settings` as with_distance() gives them.
    IgiSession(const IgiSettings& settings, const RenderContext& context, std::optional<IgiPrePass> pre_pass)
        : settings_(settings), context_(context), pre_pass_(std::move(pre_pass)) {}

    std::unique_ptr<const Estimator> pass(std::uint32_t index, Monitor& monitor,
                                          PassStatistics& statistics) const override {
        const Scene& scene = context_.scene;
        const RenderContext context = context_.told_to(monitor);
        VplParameters parameters;
        parameters.sets = sets_of(settings_);
        parameters.paths = paths_of(settings_);
        parameters.seed = context.seed;
        parameters.pass = index;
        parameters.gloss = vpl_gloss(settings_);
        parameters.longest =
            most_bounces(settings_.max_depth) - 2;  // its own, and the place's that it lights
        if (pre_pass_) parameters.emission = &pre_pass_->importance.emission;
        const std::uint32_t factor = pre_pass_ && thins(settings_) ? thinning(parameters) : 1;
        parameters.paths *= factor;
        VplSets vpls = build_vpls(scene, parameters, context.workers, monitor);
        if (monitor.stopped()) return nullptr;
        VplStatistics& made = statistics.vpls.emplace();
        if (factor > 1) {
            made.tried = vpls.lights.size();
            vpls = thin_vpls(vpls, factor, pre_pass_->seen, settings_, context);
            if (monitor.stopped()) return nullptr;
        }
        statistics.ledger = LedgerStatistics(vpls.ledger);
        warn_of_endless_light(vpls.ledger, monitor);
        Phase phase(monitor, "sorted virtual point lights", 1);
        IgiVpls ordered(vpls, parameters.paths, settings_, context.workers);
        phase.advance(1);
        if (context.two_halves && ordered.sets() < 2)
            warn_of_shared("one set of virtual lights (\"integer nsets\" 1, \"string choice\" \"tree\") is",
                           monitor);
        made.total = vpls.lights.size();
        made.sets = parameters.sets;
        made.bytes = ordered.bytes();
        IgiCaustics caustics(settings_, context, index, parameters.emission);
        if (monitor.stopped()) return nullptr;
        if (const auto& photons = caustics.made()) {
            statistics.caustic_paths = photons->paths;
            statistics.maps[static_cast<std::size_t>(MapKind::caustic)] = photons->photons;
            statistics.seconds.add("caustics", photons->seconds);
        }
        return std::make_unique<IgiEstimator>(scene, settings_, std::move(ordered), std::move(caustics),
                                              pre_pass_ && pre_pass_->guides ? &*pre_pass_->guides : nullptr);
    }

  private:
    IgiSettings settings_;
    RenderContext context_;
    std::optional<IgiPrePass> pre_pass_;
};

class IgiIntegrator final : public Integrator {
  public:
    explicit IgiIntegrator(const IgiSettings& settings) : settings_(settings) {}

    std::unique_ptr<const Session> begin(const RenderContext& context,
                                         OnceStatistics& statistics) const override {
        const IgiSettings settings = with_distance(context.scene, settings_);
        auto pre_pass = learn_emission(settings, context, statistics);
        if (context.monitor.stopped()) return nullptr;
        return std::make_unique<IgiSession>(settings, context, std::move(pre_pass));
    }

    std::vector<std::string> describe(const Scene& scene) const override {
        std::vector<std::string> lines;
        if (settings_.pre_pass.paths > 0) lines.push_back(describe_pre_pass(settings_.pre_pass.paths));
        lines.push_back(fmt::format("{} sets of virtual point lights from {} light paths each",
                                    sets_of(settings_), paths_of(settings_)));
        if (thins(settings_))
            lines.push_back(
                "selected from more light paths, the virtual point lights that the picture needs");
        if (settings_.caustics == CausticMethod::map && throws_caustics(scene)) {
            lines.push_back(fmt::format("a Caustic map of {} light paths", settings_.caustic_paths));
        }
        return lines;
    }

  private:
    IgiSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_igi(const IgiSettings& settings) {
    return std::make_unique<IgiIntegrator>(settings);
}

}  // namespace lucerna
