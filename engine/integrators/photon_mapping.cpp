// Implements photon mapping in two passes with separate Direct, Global and Caustic maps [Jensen 2001, 7 to 9;
// Goesele 2003, 5.2, 5.3].
//
//   Pass 1   emits and traces light paths, stores their photons and indexes them; precomputes irradiance
//            where gather rays will look it up
//   Pass 2   traces camera rays, and estimates radiance from the maps where they end
//
// Every path of light is counted once. At a diffuse surface, arriving light is split by the way it came:
//   straight from a light        lights sampled (by MIS, guided by photons if asked for), or the Direct map
//   over mirrors and glass only  the Caustic map
//   over a diffuse surface       final gather, or the Global map
// Scattering in a medium counts as a diffuse surface. Light that media scatter into a ray, be it the camera's
// or a gather ray, is split in the same way:
//   straight from a light        lights sampled, or the Volume map
//   all else                     the Volume map
// Gloss, rough metal and glass store no photons: a ray that meets them samples the lights and continues, as
// in path tracing. A surface that is both (paint under varnish) is shaded as both. `specular_below` says what
// counts as a mirror: perfect ones alone, or gloss up to some alpha, with caustics from the Caustic map.
#include "engine/integrators/photon_mapping.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/monitor.h"
#include "engine/integrators/final_gather.h"

namespace lucerna {
namespace {

// Builds the maps of a pass and the estimator that reads them. split() has yet to set its numbers of samples.
// Returns null if the monitor stopped it.
std::unique_ptr<SecondPass> make_estimator(const PhotonMapSettings& settings, const PassContext& context,
                                           FirstPassResult parts) {
    auto state = first_pass(settings, context, parts);
    if (!state) return nullptr;
    return std::make_unique<SecondPass>(context.scene, settings, std::move(parts), std::move(*state));
}

// -----------------------------------------------------------------------------------------------------
// Two halves of the samples, each with its own maps
// Each half has half of the photons, and of those in an estimate, so that discs are equally wide. The mean of
// both is as good as one set of maps of all photons, and their difference estimates its error.
// -----------------------------------------------------------------------------------------------------

PhotonMapSettings settings_of_half(PhotonMapSettings settings) {
    const auto halve = [](auto& number) { number = (number + 1) / 2; };  // 0 stays 0
    halve(settings.photons);
    halve(settings.caustic_photons);
    halve(settings.indirect_photons);
    halve(settings.estimate.k);
    halve(settings.gather_k);
    return settings;
}

class HalvesEstimator final : public Estimator {
  public:
    using Halves = std::array<std::unique_ptr<SecondPass>, 2>;
    explicit HalvesEstimator(Halves halves) : halves_(std::move(halves)) {}

    // A path that belongs to no half may use either, because both are equally good.
    void follow(const EyePath& path, Sampler& sampler) const override {
        halves_[static_cast<std::size_t>(path.half.value_or(0))]->follow(path, sampler);
    }

  private:
    Halves halves_;
};

// Runs a pass for both halves. `parts_of_half()` returns the pass's parts, except `sets`. Null: it was
// stopped.
template <typename Parts>
std::unique_ptr<const Estimator> halves_of_pass(const PhotonMapSettings& whole, const PassContext& context,
                                                Parts&& parts_of_half) {
    PhotonMapSettings settings = settings_of_half(whole);
    HalvesEstimator::Halves halves;
    for (std::uint32_t half = 0; half < 2; ++half) {
        FirstPassResult parts = parts_of_half();
        parts.sets = half == 0 ? 2 : 1;
        PassStatistics statistics;
        const PassContext own{context.with_deadline(context.prepared.shared_by(parts.sets)),
                              2 * context.pass + half, statistics};
        halves[half] = make_estimator(settings, own, std::move(parts));
        if (!halves[half]) return nullptr;
        if (half == 0) {
            halves[0]->split(own);
            // The other half gets as many paths, even if there were time for more or fewer.
            if (statistics.ledger && context.prepared.exists())
                settings.photons = static_cast<std::int64_t>(statistics.ledger->paths());
        } else {
            halves[1]->split_by(halves[0]->splitting());
        }
        context.statistics.add(statistics);
    }
    return std::make_unique<HalvesEstimator>(std::move(halves));
}

}  // namespace

std::unique_ptr<const Estimator> photon_map_pass(const PhotonMapSettings& settings,
                                                 const PassContext& context, FirstPassResult parts) {
    auto estimator = make_estimator(settings, context, std::move(parts));
    if (estimator) estimator->split(context);
    return estimator;
}

namespace {

// -----------------------------------------------------------------------------------------------------
// Made once for all passes: an importance pre-pass, which steers the emission of light paths towards what the
// camera sees, and the photons that guide direct light
// -----------------------------------------------------------------------------------------------------

// Returns the number of pre-pass photons in an estimate, so that its disc is about as wide as the image's.
// Fewer than kLeast say little; more than kMost take long.
int pre_pass_photons(const PhotonMapSettings& settings, int k) {
    constexpr double kLeast = 8, kMost = 32;
    if (k == 0) return static_cast<int>(kMost);
    const double share = static_cast<double>(settings.pre_pass) / static_cast<double>(settings.photons);
    return static_cast<int>(std::clamp(std::ceil(k * share), kLeast, kMost));
}

}  // namespace

std::optional<ImportancePrePass> learn_emission(const PhotonMapSettings& settings,
                                                const DensityEstimateSettings& estimate,
                                                const RenderContext& context, OnceStatistics& statistics) {
    ImportancePrePassSettings how;
    how.paths = settings.pre_pass;
    how.seed = context.seed;
    how.gather = settings.indirect == IndirectMethod::gather;
    how.meter = settings.quantity == Quantity::illuminance;
    how.estimate = estimate;
    how.estimate.k = pre_pass_photons(settings, estimate.k);
    how.specular_below = settings.specular_below;
    how.index = settings.index;
    bool reads = false;
    for (const MapKind kind : {MapKind::direct, MapKind::global, MapKind::caustic}) {
        const auto i = static_cast<std::size_t>(kind);
        const bool built = map_need(kind, settings, context.scene).build;
        how.at_gather[i] = built && how.gather;
        how.seen[i] = built && !(how.gather && kind == MapKind::global);
        reads = reads || built;
    }
    statistics.emission = why_emission_is_plain(settings.pre_pass, context);
    if (statistics.emission.empty() && !reads) statistics.emission = "plain: no map is read";
    if (!statistics.emission.empty()) return std::nullopt;
    auto pre_pass =
        run_importance_pre_pass(context.scene, *context.view, how, context.workers, context.monitor);
    report_pre_pass(pre_pass ? &*pre_pass : nullptr, settings.pre_pass, context.scene, statistics);
    return pre_pass;
}

namespace {

// Traces the photons that guide direct light; none if the settings do not use them.
std::optional<GuideMap> emit_guides(const PhotonMapSettings& settings, const RenderContext& context,
                                    OnceStatistics& statistics) {
    if (!uses_light_guides(settings, context.scene)) return std::nullopt;
    const bool gate = settings.direct == DirectMethod::gated;
    const Stopwatch building;
    const float radius = density_settings(settings, context.scene).eye.radius;
    const GuideParameters parameters{
        guide_paths(settings), context.seed, 0, {gate ? 0 : GuideSettings{}.k, radius, settings.index}};
    GuideMap map = build_guides(context.scene, parameters, context.workers, context.monitor);
    statistics.seconds.add("guide", building.seconds());
    statistics.guides = {map.map().size(), map.distributions()};
    return map;
}

// -----------------------------------------------------------------------------------------------------
// The integrator: an importance pre-pass and guides once, then both passes
// -----------------------------------------------------------------------------------------------------

class PhotonMapSession final : public Session {
  public:
    PhotonMapSession(const PhotonMapSettings& settings, const MapFiles& files, const RenderContext& context,
                     std::optional<ImportancePrePass> pre_pass, std::optional<GuideMap> guides)
        : settings_(settings),
          files_(files),
          context_(context),
          pre_pass_(std::move(pre_pass)),
          guides_(std::move(guides)) {}

    std::unique_ptr<const Estimator> pass(std::uint32_t index, Monitor& monitor,
                                          PassStatistics& statistics) const override {
        const auto parts = [this] {
            FirstPassResult own;
            own.emission = pre_pass_ ? &pre_pass_->emission : nullptr;
            own.guides = guides_ ? &*guides_ : nullptr;
            own.files = files_;
            return own;
        };
        const PassContext context{context_.with_monitor(monitor), index, statistics};
        if (!context.two_halves) return photon_map_pass(settings_, context, parts());
        // A file holds one set of maps, which both halves must share.
        if (!files_.any()) return halves_of_pass(settings_, context, parts);
        warn_of_shared("the maps in a file are", monitor);
        return photon_map_pass(settings_, context, parts());
    }

  private:
    PhotonMapSettings settings_;
    MapFiles files_;
    RenderContext context_;
    std::optional<ImportancePrePass> pre_pass_;
    std::optional<GuideMap> guides_;
};

class PhotonMapIntegrator final : public Integrator {
  public:
    PhotonMapIntegrator(const PhotonMapSettings& settings, const MapFiles& files)
        : settings_(settings), files_(files) {}

    std::unique_ptr<const Session> begin(const RenderContext& context,
                                         OnceStatistics& statistics) const override {
        const DensityEstimateSettings how = density_settings(settings_, context.scene).eye;
        std::optional<ImportancePrePass> pre_pass;
        if (files_.any() && settings_.pre_pass > 0) {
            statistics.emission = "plain: maps in files serve every camera";
        } else {
            pre_pass = learn_emission(settings_, how, context, statistics);
        }
        if (context.monitor.stopped()) return nullptr;
        auto guides = emit_guides(settings_, context, statistics);
        if (context.monitor.stopped()) return nullptr;
        return std::make_unique<PhotonMapSession>(settings_, files_, context, std::move(pre_pass),
                                                  std::move(guides));
    }

    std::string why_no_light_groups() const override {
        if (settings_.indirect != IndirectMethod::gather || settings_.precompute == 0) return {};
        return "photonmap with precomputed irradiance cannot separate it by light; use path, direct, igi, "
               "progressive, or photonmap with \"integer precompute\" 0 or \"string indirect\" \"map\"";
    }

    std::vector<std::string> describe(const Scene& scene) const override {
        std::vector<std::string> lines;
        for (std::size_t i = 0; i < kMapKinds; ++i) {
            const auto kind = static_cast<MapKind>(i);
            lines.push_back(
                fmt::format("{} map {}", map_name(kind), map_need(kind, settings_, scene).text()));
        }
        if (settings_.pre_pass > 0) lines.push_back(describe_pre_pass(settings_.pre_pass));
        const bool targets = settings_.caustic_photons > 0 || settings_.indirect_photons > 0;
        lines.push_back(targets ? "light paths until the targets are met"
                                : fmt::format("{} light paths", settings_.photons));
        if (settings_.indirect == IndirectMethod::gather && settings_.precompute > 0) {
            lines.push_back(
                fmt::format("irradiance at the hit of a bounce from one photon in {}", settings_.precompute));
        }
        return lines;
    }

  private:
    PhotonMapSettings settings_;
    MapFiles files_;
};

}  // namespace

std::unique_ptr<Integrator> make_photon_mapping(const PhotonMapSettings& settings, const MapFiles& files) {
    return std::make_unique<PhotonMapIntegrator>(settings, files);
}

}  // namespace lucerna
