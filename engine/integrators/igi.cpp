// Implements instant global illumination [Keller 1997; Wald 2002; Pharr 2004]: indirect light from sets of
// VPLs, on surfaces and where media scatter. engine/vpl makes, chooses and clamps the VPLs.
#include <fmt/format.h>

#include <bit>

#include "engine/base/defensive.h"
#include "engine/guiding/guide.h"
#include "engine/integrators/integrator.h"
#include "engine/transport/follow.h"
#include "engine/transport/light_choice.h"
#include "engine/vpl/igi_caustics.h"
#include "engine/vpl/igi_pre_pass.h"
#include "engine/vpl/igi_vpls.h"
#include "engine/vpl/vpl_shading.h"

namespace lucerna {
namespace {

// -----------------------------------------------------------------------------------------------------
// Shading: a set of VPLs lights surfaces, and the places along a ray at which media scatter
// -----------------------------------------------------------------------------------------------------

// Holds the lobes of a surface over which a path continues, and its throughput there.
struct LobeChoice {
    Bsdf bsdf;
    Rgb throughput;
    bool specular;  // the lobes count as specular, as far as caustics go
};

// Returns the share of the lobes in `part` in what all lobes of `bsdf` scatter from wi to wo.
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
          chooser_(scene),
          guided_{candidates_that_pay(scene)},
          shading_(scene, settings, lights_.paths()),
          only_diffuse_(!throws_caustics(scene)) {}

    // Each half of the samples uses one half of the sets, so that the halves differ by the error due to the
    // sets. One well-distributed number chooses the set.
    void follow(const EyePath& path, Sampler& sampler) const override {
        const std::size_t vpls = chosen_set(sampler.next(), path.half, lights_.sets());
        lucerna::follow(scene_, path, sampler,
                        Visitor{{}, *this, {vpls, static_cast<std::size_t>(path.half.value_or(0))}});
    }

  private:
    // Names what a camera sample uses: a set of VPLs, and the caustic photons of its half.
    struct LightSet {
        std::size_t vpls, half;
    };

    struct Visitor : EyeVisitor {
        const IgiEstimator& of;
        LightSet set;

        bool at_surface(EyePath& path, const Vertex& at, Sampler& sampler) const {
            return go_on(path, at, of.shade(path, at, set, sampler), sampler);
        }
        bool at_medium(EyePath& path, const MediumVertex& at, const Rgb& sigma_s, Sampler& sampler) const {
            path.throughput *= sigma_s;
            of.shade(path, at, set, sampler);
            return false;
        }
    };
    class Compensation;

    // These book the light at a place that the eye sees. The first returns a specular sample of the BSDF, if
    // there is one, which the path has yet to follow.
    std::optional<BsdfSample> shade(const EyePath& path, const Vertex& at, const LightSet& set,
                                    Sampler& sampler) const;
    void shade(const EyePath& path, const MediumVertex& at, const LightSet& set, Sampler& sampler) const;

    // Returns the lobes of a surface that VPLs light. With compensation gloss is not among them: through its
    // peak single VPLs would be seen as sparks, and compensation rays find all of its light.
    Bsdf lit_by_vpls(const Bsdf& bsdf) const {
        return settings_.compensates() ? bsdf.blurred_part(caustics_.specular_below()) : bsdf;
    }

    // Returns how a surface chooses the lights that it samples.
    LightChoice choice_at(const Vertex& vertex) const {
        const SurfacePoint& x = vertex.hit.at;
        const LightChoice plain = chooser_.at(x, vertex.bsdf, vertex.wo);
        if (!guides_) return plain;
        const Guide guide = guides_->at(x.p, vertex.normal());
        return plain.guided(guide, std::max(kDefensiveWeight, guide.defensive_weight()));
    }
    std::optional<BsdfSample> direct(const PathAccount& path, const Vertex& vertex, Sampler& sampler) const {
        if (!guides_) return direct_light(scene_, vertex, sampler, choice_at(vertex), path);
        const LightChoice plain = chooser_.at(vertex.hit.at, vertex.bsdf, vertex.wo);
        return GuidedLight(scene_, *guides_, guided_)(vertex, sampler, plain, path);
    }

    // Returns one of the compensation paths that begin where a path has arrived. Its Russian roulette depends
    // only on what it carries from there on.
    EyePath gather_path(const EyePath& path) const {
        EyePath gather = path;
        gather.throughput *= 1 / static_cast<float>(settings_.gather_samples);
        gather.eta_scale = max_component(gather.throughput);
        gather.bounces = 0;
        return gather;
    }

    // Returns the bounce limit of light paths before a VPL: the VPL and the lit place take one bounce each.
    int within(int left) const { return settings_.max_depth > 0 ? left - 2 : kMaxBounces; }

    // Books the light of all VPLs of one set, estimated from those that get a shadow ray.
    template <typename Place>
    void indirect(const EyePath& path, const Place& place, const LightSet& set, Sampler& sampler) const {
        const float u = sampler.next();
        Sampler more = sampler.split(1);
        const int bounces = within(path.left);
        if (bounces < 0) return;
        const PathAccount scaled = path.times(settings_.indirect_scale);
        lights_.choose(place, set.vpls, u, more, [&](const Vpl& light, float scale) {
            if (int{light.bounces} > bounces) return;
            scaled.add_indirect(scale * shading_.shade(place, light, Rgb(1), more), light.light);
        });
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

// Compensates for clamping [Kollig and Keller 2004]: a path tracer finds the light that clamped VPLs leave
// out. At each place it adds the light of the VPLs, and continues with the residual of clamping,
// 1 - clamped(), of what it meets. Both shares of each pair of places thus add up to the whole, exactly. The
// light that leaves such a place towards the eye is evaluated with the surface's own BSDF, and not with the
// Lambertian one of a VPL: the more light clamping leaves to rays, the nearer the image is to the path
// tracer's. A path uses one set throughout: every term of the sum is linear in one set's VPLs, so its mean is
// that over all sets.
//
// VPLs stand for diffuse scattering (vpl_gloss()), so nothing is taken off light that a mirror, glass or
// gloss turns where the ray lands. Lamps met over such surfaces, and caustics seen over them, count only as
// far as the Caustic map has not brought them to an earlier place: they are small and bright, and rays seldom
// meet them.
class IgiEstimator::Compensation : public EyeVisitor {
  public:
    static constexpr bool kSplitsMedia = false, kTakesMirrors = true;

    Compensation(const IgiEstimator& of, const LightSet& set) : of_(of), set_(set) {}

    // Turns a path away from a place that the eye sees and VPLs have lit. `choice` is how the place sampled
    // the lights; `by_vpls` is the share of lobes lit by VPLs in what the place scatters along the sample.
    void leave(EyePath& path, const Vertex& at, const BsdfSample& sample, const LightChoice& choice,
               const Rgb& by_vpls) {
        path.turn(at, sample, EmissionRule::mis(sample.pdf_w, choice));
        if (!specular_) caustic_ *= of_.caustics_.left_to_rays(at, sample.wi);
        from_ = at.hit.at;
        cosine_ = cosine_at(at, sample.wi);
        by_vpls_ = by_vpls;
        path.rule.weight = lamps();
    }
    void leave(EyePath& path, const MediumVertex& at, const V3f& wi, const LightChoice& choice) {
        path.turn(at, wi, EmissionRule::mis(at.pdf_w(wi), choice));
        from_ = at.from();
        cosine_ = 1;
        by_vpls_ = Rgb(1);
        caustic_ = Rgb(1);
        specular_ = false;
        path.rule.weight = lamps();
    }
    // Scales light beyond the first place that the path meets by `indirect_scale`.
    void beyond(EyePath& path) const { path.rule.weight *= of_.settings_.indirect_scale; }

    bool arrives(const EyePath& path, const Hit& hit) {
        residual_ = residual(path, hit.at, std::fabs(path.ray.d.dot(hit.at.n)));
        // Most paths end here, before the surface's BSDF is evaluated.
        return !is_black(residual_) || (!of_.only_diffuse_ && !is_black(path.throughput));
    }
    bool at_surface(EyePath& path, const Vertex& met, Sampler& sampler);
    bool at_medium(EyePath& path, const MediumVertex& at, const Rgb& sigma_s, Sampler& sampler);

  private:
    std::optional<LobeChoice> choose_lobe(const Bsdf& bsdf, const EyePath& path, Sampler& sampler) const;

    // Returns the share of a lamp's emission that counts where a ray meets it: after specular surfaces, the
    // share that no Caustic map has brought to an earlier place.
    Rgb lamps() const { return specular_ ? caustic_ : Rgb(1.0F); }

    // Returns the throughput that is left after VPLs at y have lit the place where the path's ray began.
    Rgb residual(const EyePath& path, const SurfacePoint& y, float cosine) const {
        if (is_black(by_vpls_)) return path.throughput;
        const float d2 = (y.p - from_.p).length2();
        const float clamped = of_.shading_.geometry().clamped(d2, cosine_ * cosine, from_.error + y.error);
        return path.throughput * (Rgb(1) - by_vpls_ * clamped);
    }

    const IgiEstimator& of_;
    LightSet set_;
    // Describe where the path was last scattered at a place that VPLs have lit: the place, the cosine of the
    // ray there as ClampedGeometry takes it, and the share of the throughput that belongs to lobes lit by
    // VPLs. It is 0 after a mirror or gloss, because no VPL has brought what the path meets from there.
    SurfacePoint from_{};
    float cosine_ = 1;
    Rgb by_vpls_{1.0F};
    // This is the share of light over L(S+D)*S+, to where the path last left a place that is not specular,
    // that no Caustic map has brought to an earlier place.
    Rgb caustic_{1.0F};
    bool specular_ = false;  // whether the path has come over specular surfaces since
    Rgb residual_{0.0F};     // throughput that VPLs left, at the surface met last
};

// Chooses at random one of two parts of a surface: the one for which VPLs stand, whose throughput is what
// they left, or the one that turns light as mirrors do. Returns none if neither contributes.
std::optional<LobeChoice> IgiEstimator::Compensation::choose_lobe(const Bsdf& bsdf, const EyePath& path,
                                                                  Sampler& sampler) const {
    const float below = of_.caustics_.specular_below();
    const Bsdf blurred = bsdf.blurred_part(below);
    const float diffuse = blurred.is_black() ? 0.0F : max_component(residual_);
    if (of_.only_diffuse_)
        return diffuse > 0 ? std::optional(LobeChoice{blurred, residual_, false}) : std::nullopt;
    const Bsdf sharp = bsdf.sharp_part(below);
    const float specular = sharp.is_black() ? 0.0F : max_component(path.throughput);
    if (!(diffuse + specular > 0)) return std::nullopt;
    const float chance = specular / (diffuse + specular);
    // The comparison is never true for a chance of 0, and always for 1.
    if (sampler.next() < chance) return LobeChoice{sharp, path.throughput / chance, true};
    return LobeChoice{blurred, residual_ / (1 - chance), false};
}

bool IgiEstimator::Compensation::at_surface(EyePath& path, const Vertex& met, Sampler& sampler) {
    const auto on = choose_lobe(met.bsdf, path, sampler);
    if (!on) return false;
    path.throughput = on->throughput;
    const Vertex at{met.hit, on->bsdf, met.wo, met.medium};
    const Rgb caustic = !on->specular && !specular_ ? Rgb(1.0F) : caustic_;
    const Rgb of_lamps = on->specular ? caustic : Rgb(1.0F);
    LightChoice choice;
    if (!on->bsdf.is_delta()) {
        // Russian roulette comes before light sampling, so that only survivors pay for it.
        if (!path.survives(path.survival(), sampler)) return false;
        choice = of_.choice_at(at);
        const PathAccount scaled = path.times(of_.settings_.indirect_scale);
        next_event(of_.scene_, at, sampler, choice, scaled.times(of_lamps));
        if (!on->specular) {
            // If the path came over nothing specular, no map has brought these caustics before.
            if (!is_black(caustic))
                of_.caustics_.add_radiance(at, set_.half, path.left, scaled.times(caustic));
            of_.indirect(path, at, set_, sampler);
        }
    } else if (path.bounces > kRouletteFrom && !path.survives(path.survival(), sampler)) {
        return false;
    }
    const BsdfU u{sampler.next(), sampler.next2()};
    const auto sample = on->bsdf.sample(at.wo, u, Transport::radiance);
    if (!sample || is_black(sample->weight)) return false;
    if (sample->straight) {
        // The path still belongs to the place where its ray began, because lamps and VPLs behind the pane
        // have lit that place, too.
        path.turn(at, *sample, EmissionRule::none());
        return true;
    }
    caustic_ = caustic;
    specular_ = on->specular;
    leave(path, at, *sample, choice, Rgb(sample->delta || on->specular ? 0.0F : 1.0F));
    beyond(path);
    return true;
}

bool IgiEstimator::Compensation::at_medium(EyePath& path, const MediumVertex& at, const Rgb& /*sigma_s*/,
                                           Sampler& sampler) {
    path.throughput = residual(path, at.from(), 1);
    if (!path.survives(path.survival(), sampler)) return false;
    const LightChoice choice = of_.chooser_.at(at.p);
    next_event(of_.scene_, at, sampler, choice, path.times(of_.settings_.indirect_scale));
    of_.indirect(path, at, set_, sampler);
    leave(path, at, at.phase.sample(at.wo, sampler.next2()), choice);
    beyond(path);
    return true;
}

// One sample of the BSDF serves both direct light (for MIS) and compensation.
std::optional<BsdfSample> IgiEstimator::shade(const EyePath& path, const Vertex& at, const LightSet& set,
                                              Sampler& sampler) const {
    LightChoice choice;
    std::optional<BsdfSample> specular;
    if (settings_.compensates()) {
        choice = choice_at(at);
        next_event(scene_, at, sampler, choice, path);
    } else {
        specular = direct(path, at, sampler);
    }
    if (at.bsdf.is_black()) return specular;
    const Bsdf lit = lit_by_vpls(at.bsdf);
    indirect(path, Vertex{at.hit, lit, at.wo, at.medium}, set, sampler);
    caustics_.add_radiance(at, set.half, path.left, path.times(settings_.indirect_scale));
    if (!settings_.compensates()) return specular;

    for (int i = 0; i < settings_.gather_samples; ++i) {
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = at.bsdf.sample(at.wo, u, Transport::radiance);
        if (!sample) continue;
        if (!sample->delta) {
            Compensation visit(*this, set);
            EyePath compensating = gather_path(path);
            visit.leave(compensating, at, *sample, choice, share_of_part(lit, at.bsdf, at.wo, sample->wi));
            lucerna::follow(scene_, compensating, sampler, visit);
        } else if (i == 0) {
            specular = sample;  // one sample is enough for what mirrors show
        }
    }
    return specular;
}

void IgiEstimator::shade(const EyePath& path, const MediumVertex& at, const LightSet& set,
                         Sampler& sampler) const {
    const LightChoice choice = chooser_.at(at.p);
    if (!settings_.compensates()) {
        direct_light(scene_, at, sampler, choice, path);
        return indirect(path, at, set, sampler);
    }
    next_event(scene_, at, sampler, choice, path);
    indirect(path, at, set, sampler);
    for (int i = 0; i < settings_.gather_samples; ++i) {
        Compensation visit(*this, set);
        EyePath compensating = gather_path(path);
        visit.leave(compensating, at, at.phase.sample(at.wo, sampler.next2()), choice);
        lucerna::follow(scene_, compensating, sampler, visit);
    }
}

// -----------------------------------------------------------------------------------------------------
// The importance pre-pass, before the sets
// -----------------------------------------------------------------------------------------------------

// Learns where light paths start, which VPLs are kept and which lights surfaces sample, and reports what it
// learned, or why emission stays plain. Returns none if it stays plain or the monitor stopped it. `settings`
// are as with_distance() returns them.
std::optional<IgiPrePass> learn_emission(const IgiSettings& settings, const RenderContext& context,
                                         OnceStatistics& statistics) {
    statistics.emission = why_emission_is_plain(settings.pre_pass, context);
    if (!statistics.emission.empty()) return std::nullopt;
    auto pre_pass = run_igi_pre_pass(settings, context);
    report_pre_pass(pre_pass ? &pre_pass->importance : nullptr, settings.pre_pass, context.scene, statistics);
    return pre_pass;
}

// -----------------------------------------------------------------------------------------------------
// The integrator: makes sets of VPLs, thins and orders them, and builds a Caustic map beside them
// -----------------------------------------------------------------------------------------------------

// These return the numbers of sets, and of light paths for each, as low-discrepancy sequences need them.
std::uint32_t sets_of(const IgiSettings& settings) {
    return std::bit_ceil(static_cast<std::uint32_t>(settings.nsets));
}
std::uint32_t paths_of(const IgiSettings& settings) {
    return std::bit_ceil(static_cast<std::uint32_t>(settings.nlights));
}

class IgiSession final : public Session {
  public:
    // `settings` are as with_distance() returns them.
    IgiSession(const IgiSettings& settings, const RenderContext& context, std::optional<IgiPrePass> pre_pass)
        : settings_(settings), context_(context), pre_pass_(std::move(pre_pass)) {}

    std::unique_ptr<const Estimator> pass(std::uint32_t index, Monitor& monitor,
                                          PassStatistics& statistics) const override {
        const Scene& scene = context_.scene;
        const RenderContext context = context_.with_monitor(monitor);
        VplParameters parameters;
        parameters.sets = sets_of(settings_);
        parameters.paths = paths_of(settings_);
        parameters.seed = context.seed;
        parameters.pass = index;
        parameters.gloss = vpl_gloss(settings_);
        parameters.longest =
            most_bounces(settings_.max_depth) - 2;  // a bounce at the VPL, one where it shines
        if (pre_pass_) parameters.emission = &pre_pass_->importance.emission;
        const std::uint32_t factor = pre_pass_ ? thinning(parameters) : 1;
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
            warn_of_shared("one set of virtual lights (\"integer nsets\" 1) is", monitor);
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
        if (settings_.pre_pass > 0) lines.push_back(describe_pre_pass(settings_.pre_pass));
        lines.push_back(fmt::format("{} sets of virtual point lights from {} light paths each",
                                    sets_of(settings_), paths_of(settings_)));
        if (settings_.pre_pass > 0)
            lines.push_back(
                "selected from more light paths, the virtual point lights that the picture needs");
        if (settings_.caustic_paths > 0 && throws_caustics(scene)) {
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
