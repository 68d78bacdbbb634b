#include "engine/render/method_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/image.h"
#include "engine/base/monitor.h"
#include "engine/base/vec.h"
#include "engine/render/trial.h"
#include "engine/vpl/igi_caustics.h"

namespace lucerna {
namespace {

constexpr double kTrialShare = 0.08;  // of all time
constexpr double kLongestTrial = 12;  // seconds, all methods together
constexpr double kJudgeShare = 0.35;  // of the trial, for the method that is unbiased

constexpr std::int64_t kTrialPhotons = 50'000, kMostPhotons = 25'600'000;
constexpr int kTrialSets = 16, kMostSets = 4096;
constexpr std::int64_t kPrePassPaths = 65'536;

PhotonMapSettings photon_map_like(const IntegratorSettings& asked) {
    PhotonMapSettings settings;
    if (const auto* own = std::get_if<PhotonMapSettings>(&asked)) settings = *own;
    settings.quantity = quantity_of(asked);
    settings.max_depth = max_depth_of(asked);
    settings.photons = kTrialPhotons;
    settings.caustic_photons = settings.indirect_photons = 0;
    // At equal time more samples are worth more than more rays for each.
    settings.gather_rays = 4;
    return settings;
}

IgiSettings igi_like(const IntegratorSettings& asked) {
    IgiSettings settings;
    if (const auto* own = std::get_if<IgiSettings>(&asked)) settings = *own;
    settings.quantity = quantity_of(asked);
    settings.max_depth = max_depth_of(asked);
    settings.nsets = kTrialSets;
    settings.caustic_paths = kTrialPhotons;
    // Without these no number of lights gives the whole picture.
    settings.compensate = true;
    if (settings.caustics == CausticMethod::none) settings.caustics = CausticMethod::map;
    return settings;
}

// Whether no other method shows the same.
bool is_its_own(const IntegratorSettings& asked) {
    if (std::holds_alternative<DirectSettings>(asked)) return true;
    if (const auto* maps = std::get_if<PhotonMapSettings>(&asked))
        return maps->indirect == IndirectMethod::none;
    if (const auto* igi = std::get_if<IgiSettings>(&asked)) return igi->indirect_scale != 1;
    return false;
}

IntegratorSettings with_work(IntegratorSettings settings, double work) {
    if (auto* maps = std::get_if<PhotonMapSettings>(&settings))
        maps->photons = static_cast<std::int64_t>(static_cast<double>(maps->photons) * work);
    if (auto* igi = std::get_if<IgiSettings>(&settings)) {
        igi->nsets = static_cast<int>(igi->nsets * work);
        igi->caustic_paths = static_cast<std::int64_t>(static_cast<double>(igi->caustic_paths) * work);
    }
    return settings;
}

std::string short_text(const IntegratorSettings& settings) {
    if (const auto* maps = std::get_if<PhotonMapSettings>(&settings)) {
        return fmt::format("photonmap{}", maps->direct == DirectMethod::guided ? " (guided)" : "");
    }
    if (const auto* igi = std::get_if<IgiSettings>(&settings))
        return fmt::format("igi{}", igi->pre_pass.paths > 0 ? " (pre-pass)" : "");
    return std::string(integrator_name(settings));
}

// Luminance of each block, by what most methods agree on: one method's firefly or bias must not decide to
// what errors are relative.
std::vector<double> levels(const std::vector<const Trial*>& trials, std::size_t blocks) {
    std::vector<double> result(blocks);
    for (std::size_t b = 0; b < blocks; ++b) {
        std::vector<double> means;
        for (const Trial* trial : trials) {
            if (b < trial->blocks().size()) means.push_back(trial->blocks()[b].mean());
        }
        std::sort(means.begin(), means.end());
        result[b] = means[(means.size() - 1) / 2];
    }
    return result;
}

class Scales {
  public:
    explicit Scales(const std::vector<double>& levels) : levels_(levels) {
        for (const double level : levels) mean_ += std::fabs(level) / static_cast<double>(levels.size());
    }
    // A squared error as a share; 0 where all is black, and nothing can be told.
    double share(std::size_t block, double square) const {
        const double scale = error_scale2(levels_[block], mean_);
        return scale > 0 ? square / scale : 0;
    }

  private:
    const std::vector<double>& levels_;
    double mean_ = 0;
};

double variance_of(const Trial& trial, const Scales& scales) {
    RunningStats shares;
    for (std::size_t b = 0; b < trial.blocks().size(); ++b)
        shares.add(scales.share(b, trial.blocks()[b].variance_of_a_sample()));
    return shares.mean();
}

// The squared difference from the judge that neither's noise explains, and one standard error more.
double beyond_noise(const Trial& trial, const Trial& judge, const Scales& scales) {
    RunningStats shares;
    for (std::size_t b = 0; b < std::min(trial.blocks().size(), judge.blocks().size()); ++b) {
        const Trial::Block &own = trial.blocks()[b], &right = judge.blocks()[b];
        shares.add(scales.share(b, sqr(own.mean() - right.mean()) - own.variance() - right.variance()));
    }
    return std::max(0.0, shares.mean()) + shares.standard_error();
}

// Whether photons make a part of the picture, whose number alone mends what they blur.
bool estimates_from_photons(const IntegratorSettings& settings, const Scene& scene) {
    if (std::holds_alternative<PhotonMapSettings>(settings)) return true;
    const auto* igi = std::get_if<IgiSettings>(&settings);
    return igi && igi->caustics == CausticMethod::map && throws_caustics(scene);
}

MethodCost cost_of(const Trial& trial, const Trial& judge, const Scales& scales, const Job& job) {
    const V2i size = job.film.rendered_size();
    const double pixels = static_cast<double>(size.x) * size.y;
    MethodCost cost;
    cost.once = trial.once_seconds();
    cost.prepare = trial.prepare_seconds() - cost.once;
    cost.sample = trial.sample_seconds() * pixels;
    cost.variance = variance_of(trial, scales);
    if (&trial == &judge) return cost;
    cost.beyond = beyond_noise(trial, judge, scales);
    if (trial.in_passes()) {
        cost.kind = MethodCost::Kind::passes;
        cost.sample *= make_integrator(trial.settings())->samples_per_pass();
        cost.passes = trial.passes();
        // The radius' square falls by the number of passes to the power of alpha - 1, the bias with it.
        const auto& settings = std::get<ProgressiveSettings>(trial.settings());
        cost.power = 2 * (1 - double{settings.alpha});
        return cost;
    }
    cost.kind = MethodCost::Kind::maps;
    // Of VPLs it is noise. Of photons, with a fixed number in an estimate, it falls by the estimates' area;
    // the studies give somewhat less.
    const bool photons = std::holds_alternative<PhotonMapSettings>(trial.settings());
    cost.power = estimates_from_photons(trial.settings(), job.scene) ? 2.0 / 3 : 1;
    cost.most_work = photons ? static_cast<double>(kMostPhotons) / kTrialPhotons : kMostSets / kTrialSets;
    return cost;
}

}  // namespace

std::vector<Method> methods_like(const IntegratorSettings& asked) {
    if (is_its_own(asked)) return {{asked, 0}};
    PathSettings path;
    if (const auto* own = std::get_if<PathSettings>(&asked)) path = *own;
    path.quantity = quantity_of(asked);
    path.max_depth = max_depth_of(asked);
    PhotonMapSettings maps = photon_map_like(asked), guided = maps;
    maps.direct = DirectMethod::mc;
    guided.direct = DirectMethod::guided;
    ProgressiveSettings progressive;
    if (const auto* own = std::get_if<ProgressiveSettings>(&asked)) progressive = *own;
    progressive.quantity = quantity_of(asked);
    progressive.max_depth = max_depth_of(asked);
    IgiSettings igi = igi_like(asked), pre_pass = igi;
    igi.pre_pass.paths = 0;
    pre_pass.pre_pass.paths = kPrePassPaths;
    return {{path, 0}, {igi, 0.1}, {maps, 0.2}, {pre_pass, 0.4}, {guided, 0.4}, {progressive, 0.6}};
}

namespace {

class Choosing {
  public:
    Choosing(const Job& job, const Limits& limits, std::uint64_t seed, const Workers& workers,
             Monitor& monitor)
        : job_(job), limits_(limits), seed_(seed), workers_(workers), monitor_(monitor) {}

    std::optional<MethodChoice> choose() {
        const std::vector<Method> methods = methods_like(job_.integrator);
        if (methods.size() < 2) return std::nullopt;
        const double first = by_error() ? 0.5 : kJudgeShare * budget(limits_.seconds);
        if (!run(methods[0].settings, std::min(first, kJudgeShare * kLongestTrial))) return std::nullopt;
        for (std::size_t m = 1; m < methods.size(); ++m) {
            // More than that share of what the best one needs would not come back.
            const double left = budget(by_error() ? soonest() : limits_.seconds) - clock_.seconds();
            const double share =
                std::max(methods[m].least_seconds, left / static_cast<double>(methods.size() - m));
            if (left < methods[m].least_seconds) {
                untried_.push_back(short_text(methods[m].settings));
            } else if (!run(methods[m].settings, share)) {
                return std::nullopt;
            }
        }
        return best();
    }

  private:
    bool by_error() const { return limits_.error > 0; }

    static double budget(double seconds) { return std::min(kTrialShare * seconds, kLongestTrial); }
    double soonest() const {
        double seconds = kNever;
        for (const Expectation& expectation : expect()) seconds = std::min(seconds, expectation.seconds);
        return seconds;
    }

    // False if the user stopped it. What this scene has and the method cannot do is no reason to fail.
    bool run(const IntegratorSettings& settings, double seconds) {
        Phase phase(monitor_, fmt::format("trial of {}", short_text(settings)), 1);
        auto trial = std::make_unique<Trial>(job_, settings, ~seed_, workers_, monitor_);
        try {
            if (!trial->run(seconds)) return false;
        } catch (const InputError&) {
            if (trials_.empty()) throw;
            untried_.push_back(short_text(settings));
            return true;
        }
        trials_.push_back(std::move(trial));
        phase.advance(1);
        return true;
    }

    std::vector<Expectation> expect() const {
        std::vector<const Trial*> trials;
        for (const auto& trial : trials_) trials.push_back(trial.get());
        std::size_t blocks = 0;
        for (const Trial* trial : trials) blocks = std::max(blocks, trial->blocks().size());
        const std::vector<double> level = levels(trials, blocks);
        const Scales scales(level);
        std::vector<Expectation> result;
        for (const Trial* trial : trials) {
            const MethodCost cost = cost_of(*trial, *trials.front(), scales, job_);
            const double left = limits_.seconds - clock_.seconds();
            result.push_back(by_error() ? soonest_below(limits_.error, cost)
                                        : best_in(std::max(left, 1e-3), cost));
        }
        return result;
    }

    MethodChoice best() const {
        const std::vector<Expectation> expected = expect();
        const auto better = [this](const Expectation& a, const Expectation& b) {
            return by_error() ? a.seconds < b.seconds : a.error < b.error;
        };
        const auto found = std::min_element(expected.begin(), expected.end(), better);
        const std::size_t chosen = static_cast<std::size_t>(found - expected.begin());
        MethodChoice choice{with_work(trials_[chosen]->settings(), found->work),
                            found->error,
                            found->seconds,
                            std::sqrt(found->beyond),
                            {}};
        for (std::size_t t = 0; t < trials_.size(); ++t) {
            const double figure = by_error() ? expected[t].seconds : 100 * expected[t].error;
            choice.tried += fmt::format("{}{} ", t > 0 ? ", " : "", short_text(trials_[t]->settings()));
            choice.tried += !std::isfinite(figure) ? "not within reach"
                            : by_error()           ? fmt::format("{:.2g} s", figure)
                                                   : fmt::format("{:.2g} %", figure);
        }
        for (const std::string& method : untried_) choice.tried += fmt::format(", {} not tried", method);
        return choice;
    }

    const Job& job_;
    const Limits& limits_;
    std::uint64_t seed_;
    const Workers& workers_;
    Monitor& monitor_;
    Stopwatch clock_;
    std::vector<std::unique_ptr<Trial>> trials_;  // the judge first
    std::vector<std::string> untried_;
};

}  // namespace

std::optional<MethodChoice> choose_method(const Job& job, const Limits& limits, std::uint64_t seed,
                                          const Workers& workers, Monitor& monitor) {
    return Choosing(job, limits, seed, workers, monitor).choose();
}

namespace {

constexpr double kMostPreparation = 0.5;  // of the time
// Of an error that was asked for, what may be of a kind that is estimated once and not seen to fall.
constexpr double kBeyondShare = 0.5;

}  // namespace

Expectation best_in(double seconds, const MethodCost& cost) {
    Expectation best{kNever, seconds, cost.beyond, 1};
    const auto offer = [&](double samples, double beyond, double work) {
        const double error = std::sqrt(beyond + cost.variance / samples);
        if (samples >= 1 && error < best.error) best = {error, seconds, beyond, work};
    };
    if (cost.kind == MethodCost::Kind::passes) {
        const double passes = seconds / (cost.prepare + cost.sample);
        if (passes >= 2) offer(passes, cost.beyond * std::pow(cost.passes / passes, cost.power), 1);
        return best;
    }
    for (double work = 1; work <= cost.most_work; work *= 2) {
        const double prepare = cost.once + cost.prepare * work;
        if (prepare > kMostPreparation * seconds) break;
        offer((seconds - prepare) / cost.sample, cost.beyond * std::pow(work, -cost.power), work);
    }
    return best;
}

Expectation soonest_below(double error, const MethodCost& cost) {
    Expectation best{error, kNever, 0, 1};
    const double square = sqr(error);
    const auto offer = [&](double samples, double seconds, double beyond, double work) {
        if (samples > 0 && seconds < best.seconds) best = {error, seconds, beyond, work};
    };
    if (cost.kind == MethodCost::Kind::passes) {
        // Where both have become small enough; doubling finds it near enough.
        for (double passes = 2; passes < 1e9; passes *= 2) {
            const double beyond = cost.beyond * std::pow(cost.passes / passes, cost.power);
            if (beyond > sqr(kBeyondShare) * square || beyond + cost.variance / passes > square) continue;
            offer(passes, passes * (cost.prepare + cost.sample), beyond, 1);
            break;
        }
        return best;
    }
    for (double work = 1; work <= cost.most_work; work *= 2) {
        const double beyond = cost.beyond * std::pow(work, -cost.power);
        if (beyond > sqr(kBeyondShare) * square) continue;
        const double samples = std::max(1.0, cost.variance / (square - beyond));
        offer(samples, cost.once + cost.prepare * work + samples * cost.sample, beyond, work);
    }
    return best;
}

}  // namespace lucerna
