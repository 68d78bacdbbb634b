#include "engine/render/method_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <span>

#include "engine/base/deadline_monitor.h"
#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/base/vec.h"
#include "engine/image/image.h"
#include "engine/ranks/ranks.h"
#include "engine/render/trial.h"
#include "engine/vpl/igi_caustics.h"

namespace lucerna {
namespace {

constexpr double kTrialShare = 0.1;   // of the total time
constexpr double kLongestTrial = 15;  // seconds, all methods together
constexpr double kSecondLook = 0.25;  // of the trials' time, for the two best methods
constexpr double kFirstLook = 0.5;    // seconds, before the time to an error can be estimated
// With less time, trials are meaningless and take half of the time available.
constexpr double kLeastTrial = 0.25;
// With so much time for trials, each of them has time for a pre-pass, which pays wherever the camera sees a
// part of the scene and costs little elsewhere.
constexpr double kAimedTrials = 1;

// Photons of a trial, if there is time for so many, and most photons of a render. With few photons all
// methods blur a caustic alike, and samples are cheap.
constexpr std::int64_t kTrialPhotons = 400'000, kMostPhotons = 25'600'000;
// Sets of VPLs of a trial, and most of a render; light paths of the trial's Caustic map.
constexpr int kTrialSets = 16, kMostSets = 4096;
constexpr std::int64_t kTrialCausticPaths = 50'000;
constexpr std::int64_t kPrePassPaths = 65'536;

// With twice the photons, a sample takes longer by this share (measured: 0.03 to 0.12): the tree is deeper
// and memory farther.
constexpr double kPhotonsGrowth = 0.06;

PhotonMapSettings photon_map_like(const IntegratorSettings& asked) {
    PhotonMapSettings settings;
    if (const auto* own = std::get_if<PhotonMapSettings>(&asked)) settings = *own;
    settings.quantity = quantity_of(asked);
    settings.max_depth = max_depth_of(asked);
    settings.photons = kTrialPhotons;
    settings.caustic_photons = settings.indirect_photons = 0;

    return settings;
}

IgiSettings igi_like(const IntegratorSettings& asked) {
    IgiSettings settings;
    if (const auto* own = std::get_if<IgiSettings>(&asked)) settings = *own;
    settings.quantity = quantity_of(asked);
    settings.max_depth = max_depth_of(asked);
    settings.nsets = kTrialSets;
    settings.caustic_paths = kTrialCausticPaths;
    // Without gather samples no number of VPLs renders all of the light.
    settings.gather_samples = std::max(settings.gather_samples, 1);
    return settings;
}

// Returns whether no other method renders the same image.
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
        return fmt::format("photonmap{}", maps->direct == DirectMethod::guided ? " (guided)"
                                          : maps->pre_pass > 0                 ? " (pre-pass)"
                                                                               : "");
    }
    if (const auto* igi = std::get_if<IgiSettings>(&settings))
        return fmt::format("igi{}", igi->pre_pass > 0 ? " (pre-pass)" : "");
    if (const auto* progressive = std::get_if<ProgressiveSettings>(&settings))
        return fmt::format("progressive{}", progressive->pre_pass > 0 ? " (pre-pass)" : "");
    return std::string(integrator_name(settings));
}

// Methods whose errors have the same cause: what one of a family misses or blurs, the others may miss or
// blur, too.
enum Family : std::size_t { kRays, kVirtualLights, kPhotons, kFamilies };
Family family_of(const IntegratorSettings& settings) {
    if (std::holds_alternative<PathSettings>(settings)) return kRays;
    return std::holds_alternative<IgiSettings>(settings) ? kVirtualLights : kPhotons;
}

// Returns MethodCost::left (measured on ten scenes). In larger images more pixels see the same light; where
// neighbours share photons or virtual lights, the noise that they have in common is not removed.
double left_by_denoiser(const Trial& trial, double pixels) {
    constexpr double kPixels = 65536;
    const Family family = family_of(trial.settings());
    const double left = trial.in_passes() ? 0.05 : family == kPhotons ? 0.025 : 0.021;
    return left * pow(kPixels / pixels, family == kRays ? 0.35 : 0.2);
}

// The luminance of a block, and its variance.
struct Level {
    double mean = 0, variance = 0;
};

// Returns the level by a family, over its trials that have rendered the block.
std::optional<Level> level_by(Family family, const std::vector<const Trial*>& trials, std::size_t block) {
    Level sum;
    double count = 0;
    for (const Trial* trial : trials) {
        if (family_of(trial->settings()) != family || block >= trial->blocks().size()) continue;
        sum.mean += trial->blocks()[block].mean();
        sum.variance += trial->blocks()[block].variance();
        ++count;
    }
    if (count == 0) return std::nullopt;
    return Level{sum.mean / count, sum.variance / sqr(count)};
}

// Returns the level of a block on which most families of methods agree. Each family may be wrong by itself:
// paths miss small bright lights behind mirrors and glass without noticing, photons are blurred, and virtual
// lights have bright spots. Two of the three are seldom wrong in the same way.
Level consensus(const std::vector<const Trial*>& trials, std::size_t block) {
    std::vector<Level> levels;
    for (std::size_t family = 0; family < kFamilies; ++family) {
        if (const auto level = level_by(Family(family), trials, block)) levels.push_back(*level);
    }
    std::sort(levels.begin(), levels.end(), [](const Level& a, const Level& b) { return a.mean < b.mean; });
    if (levels.size() % 2 == 1) return levels[levels.size() / 2];
    return {0.5 * (levels[0].mean + levels[1].mean), 0.25 * (levels[0].variance + levels[1].variance)};
}

class Consensus {
  public:
    explicit Consensus(const std::vector<const Trial*>& trials) {
        std::size_t blocks = 0;
        for (const Trial* trial : trials) blocks = std::max(blocks, trial->blocks().size());
        for (std::size_t b = 0; b < blocks; ++b) levels_.push_back(consensus(trials, b));
        for (const Level& level : levels_)
            mean_ += std::fabs(level.mean) / static_cast<double>(levels_.size());
    }
    const Level& level(std::size_t block) const { return levels_[block]; }
    // Returns a squared error as a relative one, or 0 where the image is black.
    double share(std::size_t block, double square) const {
        const double scale = error_scale2(levels_[block].mean, mean_);
        return scale > 0 ? square / scale : 0;
    }

  private:
    std::vector<Level> levels_;
    double mean_ = 0;
};

// Returns the relative deviations of the trial's samples.
std::vector<double> deviations_of(const Trial& trial, const Consensus& agreed) {
    std::vector<double> deviations;
    for (std::size_t b = 0; b < trial.blocks().size(); ++b) {
        const Trial::Block& block = trial.blocks()[b];
        const double mean = block.mean();
        for (const float value : block.values)
            deviations.push_back(std::sqrt(agreed.share(b, sqr(double{value} - mean))));
    }
    return deviations;
}

// Estimates the variance of one sample and adds one standard error, because a few blocks often carry most of
// it. Density estimates of passes have no rare samples: the largest hundredth of their blocks counts like the
// next one, because it is chance whether a block lies on the few pixels where a lamp glints in metal. (With
// other methods rare bright samples may be anywhere, and a denoiser finds them.)
double variance_of(const Trial& trial, const Consensus& agreed, bool denoised) {
    constexpr std::size_t kOneIn = 100;
    std::vector<double> sorted;
    for (std::size_t b = 0; b < trial.blocks().size(); ++b)
        sorted.push_back(agreed.share(b, trial.blocks()[b].variance_of_a_sample()));
    std::sort(sorted.begin(), sorted.end());
    // At least one block, of two or more.
    const std::size_t few = std::min((sorted.size() + kOneIn - 1) / kOneIn, sorted.size() / 2);
    const std::size_t luck = trial.in_passes() || denoised ? few : 0;
    RunningStats shares;
    for (std::size_t i = 0; i < sorted.size(); ++i)
        shares.add(sorted[std::min(i, sorted.size() - luck - 1)]);  // luck < their number
    return shares.mean() + (shares.count() > 1 ? shares.standard_error() : 0);
}

// Returns the squared difference from the consensus that noise does not explain, plus one standard error.
double beyond_noise(const Trial& trial, const Consensus& agreed) {
    RunningStats shares;
    for (std::size_t b = 0; b < trial.blocks().size(); ++b) {
        const Trial::Block& own = trial.blocks()[b];
        const Level& level = agreed.level(b);
        const double difference = own.mean() - level.mean;
        shares.add(difference == 0 ? 0 : agreed.share(b, sqr(difference) - own.variance() - level.variance));
    }
    return std::max(0.0, shares.mean()) + (shares.count() > 1 ? shares.standard_error() : 0);
}

// Estimates the squared blur of density estimates and adds one standard error.
double blur2_of(const Trial& trial, const Consensus& agreed) {
    RunningStats shares;
    for (std::size_t b = 0; b < trial.blocks().size(); ++b)
        shares.add(agreed.share(b, trial.blocks()[b].blur2()));
    return std::max(0.0, shares.mean()) + (shares.count() > 1 ? shares.standard_error() : 0);
}

// Returns the variance of a sample from light that unbiased samples have not met, though other methods have.
// If N samples have missed light of mean D, their probability of meeting it is at most 1/N, and its variance
// at least D² N. N is the number of a block's own samples, or of those of all blocks, as far as other blocks
// have no excess to balance what this one lacks.
double variance_of_missed_light(const Trial& trial, const Consensus& agreed) {
    RunningStats missed;
    double lacking = 0, signed_sum = 0, noise = 0, samples = 0;
    const auto blocks = static_cast<double>(trial.blocks().size());
    for (std::size_t b = 0; b < trial.blocks().size(); ++b) {
        const Trial::Block& own = trial.blocks()[b];
        const Level& level = agreed.level(b);
        const double difference = level.mean - own.mean();
        const double variance = own.variance() + level.variance;
        signed_sum += difference;
        lacking += std::max(difference, 0.0);
        noise += variance;
        for (const RunningStats& pixel : own.pixels) samples += static_cast<double>(pixel.count()) / blocks;
        missed.add(difference > 0 ? agreed.share(b, sqr(difference) - variance) : 0);
    }
    const double square = missed.mean() - (missed.count() > 1 ? missed.standard_error() : missed.mean());
    if (!(square > 0)) return 0;
    const double in_vain =
        std::clamp((signed_sum - 2 * std::sqrt(noise)) / lacking, 0.0, 1.0);  // lacking > 0
    return square * samples * (1 + in_vain * (blocks - 1));
}

// Returns whether the image includes density estimates, whose blur only more photons reduce.
bool estimates_from_photons(const IntegratorSettings& settings, const Scene& scene) {
    if (std::holds_alternative<PhotonMapSettings>(settings)) return true;
    const auto* igi = std::get_if<IgiSettings>(&settings);
    return igi && igi->caustic_paths > 0 && throws_caustics(scene);
}

// Returns the cost of a method after its trial. `speed` is that of all ranks together over that of the trial.
// Preparation is shared in part; the rest takes as long.
MethodCost cost_of(const Trial& trial, const Consensus& agreed, const Job& job, double speed) {
    const V2i size = job.film.rendered_size();
    const double pixels = static_cast<double>(size.x) * size.y;
    MethodCost cost;
    cost.once = trial.once_seconds();
    cost.prepare = trial.prepare_seconds();
    cost.sample = trial.sample_seconds() * pixels / speed;
    cost.variance = variance_of(trial, agreed, job.film.two_halves);
    const std::vector<double> deviations = deviations_of(trial, agreed);
    cost.seen = static_cast<double>(deviations.size()) / pixels;
    if (job.film.two_halves) {
        // The denoiser recognises rare samples by their variance, and their remainder does not grow.
        cost.left = left_by_denoiser(trial, pixels);
    } else if (!trial.in_passes()) {
        cost.tail = tail_exponent(deviations);  // passes have no rare samples
    }
    if (family_of(trial.settings()) == kRays) {
        cost.missed = variance_of_missed_light(trial, agreed);
        return cost;
    }
    cost.beyond = beyond_noise(trial, agreed);
    if (trial.in_passes()) {
        // The difference from other methods includes the noise that a block's pixels share, and theirs; the
        // blur that two passes show is noisy in dim places. Both bound the bias, which is no more than the
        // smaller one.
        cost.beyond = std::min(cost.beyond, blur2_of(trial, agreed));
        cost.kind = MethodCost::Kind::passes;
        cost.sample *= make_integrator(trial.settings())->samples_per_pass();
        cost.passes = trial.passes();
        // The squared radius falls with the number of passes to the power of alpha - 1, and so does the bias.
        const auto& settings = std::get<ProgressiveSettings>(trial.settings());
        cost.power = 2 * (1 - double{settings.alpha});
        return cost;
    }
    cost.kind = MethodCost::Kind::maps;
    // The consensus does not reveal blur where all methods but paths, which miss that light, show it by
    // photons, as in a caustic.
    cost.beyond = std::max(cost.beyond, blur2_of(trial, agreed));
    // For VPLs this error is noise. For photons, with a fixed number in an estimate, it lies at the rims of
    // caustics and shadows, in bands as wide as the estimate's radius, which falls with the root of the
    // number.
    const bool photons = estimates_from_photons(trial.settings(), job.scene);
    cost.power = photons ? 0.5 : 1;
    cost.growth = photons ? kPhotonsGrowth : 0;
    const auto* maps = std::get_if<PhotonMapSettings>(&trial.settings());
    cost.most_work = maps ? static_cast<double>(kMostPhotons) / static_cast<double>(maps->photons)
                          : double(kMostSets) / kTrialSets;
    return cost;
}

}  // namespace

std::vector<Method> methods_like(const IntegratorSettings& asked, bool aimed) {
    if (is_its_own(asked)) return {{asked, 0}};
    PathSettings path;
    if (const auto* own = std::get_if<PathSettings>(&asked)) path = *own;
    path.quantity = quantity_of(asked);
    path.max_depth = max_depth_of(asked);
    // Where light goes over chains to small lamps, the other methods find it sooner than a search at each
    // place.
    path.chains = 0;
    PhotonMapSettings maps = photon_map_like(asked);
    maps.direct = DirectMethod::mc;
    maps.pre_pass = aimed ? kPrePassPaths : 0;
    PhotonMapSettings guided = maps, aimed_maps = maps;
    guided.direct = DirectMethod::guided;
    aimed_maps.pre_pass = kPrePassPaths;
    ProgressiveSettings progressive;
    if (const auto* own = std::get_if<ProgressiveSettings>(&asked)) progressive = *own;
    progressive.quantity = quantity_of(asked);
    progressive.max_depth = max_depth_of(asked);
    IgiSettings igi = igi_like(asked), pre_pass = igi;
    igi.pre_pass = 0;
    pre_pass.pre_pass = kPrePassPaths;
    // If little of the light reaches the visible surfaces, as in a close view of a caustic, most photons are
    // wasted without a pre-pass.
    progressive.pre_pass = maps.pre_pass;
    ProgressiveSettings aimed_passes = progressive;
    aimed_passes.pre_pass = kPrePassPaths;
    // Two passes cannot be shortened, so progressive follows the other methods that are always tried. It is
    // the best more often than photonmap, whose pilot may take all of the time that is left. With the few
    // photons of a shorter trial, photonmap's gather rays find no precomputed irradiance and take three times
    // as long as in the render.
    std::vector<Method> methods{{path, 0, true}, {igi, 0.05, true}, {progressive, 0.05, true},
                                {maps, 0.12},    {pre_pass, 0.3},   {guided, 0.3}};
    if (!aimed) methods.insert(methods.end(), {{aimed_passes, 0.3}, {aimed_maps, 0.3}});
    return methods;
}

namespace {

class Choosing {
  public:
    Choosing(const Job& job, const Limits& limits, std::uint64_t seed, const Workers& workers,
             Monitor& monitor, double head_start)
        : job_(job),
          limits_(limits),
          seed_(seed),
          workers_(workers.alone()),
          speed_(workers.ranks ? static_cast<double>(workers.ranks->all_threads()) / workers.threads : 1),
          head_start_(head_start),
          user_(monitor),
          monitor_(monitor, by_error() ? Deadline() : Deadline::after(budget(limits.seconds))) {}

    std::optional<MethodChoice> choose() {
        const bool aimed = !by_error() && budget(limits_.seconds) >= kAimedTrials;
        std::vector<Method> methods = methods_like(job_.integrator, aimed);
        if (job_.film.parts && !job_.scene.light_groups().empty()) {
            std::erase_if(methods, [](const Method& method) {
                return !make_integrator(method.settings)->why_no_light_groups().empty();
            });
        }
        if (methods.size() < 2) return std::nullopt;
        if (const Medium* medium = emitting_medium(job_.scene.media())) {
            return unquestioned(
                methods.front().settings,
                fmt::format("none: only path shows the light that medium \"{}\" emits", medium->name));
        }
        if (!by_error() && budget(limits_.seconds) < kLeastTrial) return in_a_second(methods);
        const std::size_t bases = methods_before_variants(methods);
        for (std::size_t m = 0; m < methods.size(); ++m) {
            if (m == bases) put_promising_first(std::span(methods).subspan(bases));
            // Trials never take more than their share of the time that the best method needs, since more
            // would not pay off.
            const bool unknown = m == 0 && by_error();
            const double all = unknown ? kFirstLook : budget(by_error() ? soonest() : limits_.seconds);
            const double left = (1 - kSecondLook) * all - clock_.seconds();
            const double share =
                unknown ? all : std::max(methods[m].least_seconds, left / waiting(methods, m, left));
            if (m > 0 && left < methods[m].least_seconds && !(by_error() && methods[m].always)) {
                untried_.push_back(short_text(methods[m].settings));
            } else if (!run(methods[m].settings, share)) {
                return std::nullopt;
            }
        }
        if (!look_again_at_the_best()) return std::nullopt;
        if (trials_.empty()) return unquestioned(methods.front().settings, "none: too little time");
        return best();
    }

  private:
    bool by_error() const { return limits_.error > 0; }

    // Returns for how many of the methods from `first` on there is time.
    static double waiting(const std::vector<Method>& methods, std::size_t first, double left) {
        const auto fits = [left](const Method& method) { return method.least_seconds <= left; };
        const auto begin = methods.begin() + static_cast<std::ptrdiff_t>(first);
        return static_cast<double>(std::max<std::ptrdiff_t>(1, std::count_if(begin, methods.end(), fits)));
    }

    static double budget(double seconds) { return std::min(kTrialShare * seconds, kLongestTrial); }
    double soonest() const {
        double seconds = kNever;
        for (const Expectation& expectation : expect()) seconds = std::min(seconds, expectation.seconds);
        return seconds;
    }

    // Returns the number of methods before the first variant of an earlier one.
    static std::size_t methods_before_variants(const std::vector<Method>& methods) {
        const auto first = std::find_if(methods.begin(), methods.end(), [&](const Method& method) {
            const auto same = [&](const Method& other) {
                return other.settings.index() == method.settings.index();
            };
            return &*std::find_if(methods.begin(), methods.end(), same) != &method;
        });
        return static_cast<std::size_t>(first - methods.begin());
    }

    // Orders variants of methods by what is expected of those methods.
    void put_promising_first(std::span<Method> variants) const {
        const std::vector<Expectation> expected = expect();
        const auto of_base = [&](const Method& variant) {
            for (std::size_t t = 0; t < trials_.size(); ++t) {
                if (trials_[t]->settings().index() == variant.settings.index()) return expected[t];
            }
            return Expectation{kNever, kNever};
        };
        std::stable_sort(variants.begin(), variants.end(),
                         [&](const Method& a, const Method& b) { return better(of_base(a), of_base(b)); });
    }

    // Returns what methods are compared by: the seconds to the error, or the error in the time.
    double figure_of(const Expectation& expected) const {
        return by_error() ? expected.seconds : expected.error;
    }
    bool better(const Expectation& a, const Expectation& b) const { return figure_of(a) < figure_of(b); }

    // Gives the rest of the time to the two best methods, because with few samples luck may have put them
    // there. Returns false if the user stopped it.
    bool look_again_at_the_best() {
        const std::vector<Expectation> expected = expect();
        std::vector<std::size_t> order(expected.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::sort(order.begin(), order.end(),
                  [&](std::size_t a, std::size_t b) { return better(expected[a], expected[b]); });
        constexpr std::size_t kBest = 2;
        // So much worse a method is not put second by luck alone.
        constexpr double kFarBehind = 1.7;
        if (order.size() < kBest ||
            figure_of(expected[order[1]]) > kFarBehind * figure_of(expected[order[0]]))
            return true;
        const double all = budget(by_error() ? soonest() : limits_.seconds);
        for (std::size_t i = 0; i < kBest; ++i) {
            const double left = (all - clock_.seconds()) / static_cast<double>(kBest - i);
            if (left > 0 && !trials_[order[i]]->run(left) && user_.stopped()) return false;
        }
        return true;
    }

    // Returns false if the user stopped it. A method that does not support this scene is skipped, and so is
    // one whose trial is cut.
    bool run(const IntegratorSettings& settings, double seconds) {
        Phase phase(monitor_, fmt::format("trial of {}", short_text(settings)), 1);
        auto trial = std::make_unique<Trial>(job_, lamps_, settings, ~seed_, workers_, monitor_);
        try {
            if (!trial->run(seconds)) {
                untried_.push_back(short_text(settings));
                return !user_.stopped();
            }
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
        const Consensus agreed(trials);
        std::vector<Expectation> result;
        for (const Trial* trial : trials) {
            const MethodCost cost = cost_of(*trial, agreed, job_, speed_);
            const bool has_begun = family_of(trial->settings()) == kRays;
            const double left = limits_.seconds - clock_.seconds() + (has_begun ? head_start_ : 0);
            result.push_back(by_error() ? soonest_below(limits_.error, cost)
                                        : best_in(std::max(left, 1e-3), cost));
        }
        return result;
    }

    // Chooses progressive passes, which are rarely far from the best, unless there is hardly time for two of
    // them after the first image.
    MethodChoice in_a_second(const std::vector<Method>& methods) const {
        constexpr double kTwoPasses = 4;  // times as long as a sample of each pixel
        if (head_start_ > 0 && limits_.seconds < kTwoPasses * head_start_)
            return unquestioned(methods.front().settings, "none: too little time");
        const auto passes = std::find_if(methods.begin(), methods.end(), [](const Method& method) {
            return std::holds_alternative<ProgressiveSettings>(method.settings);
        });
        return unquestioned(passes->settings, "none: too little time");
    }

    MethodChoice unquestioned(const IntegratorSettings& settings, const std::string& why) const {
        const double seconds = by_error() ? std::nan("") : limits_.seconds;
        return {settings, std::nan(""), seconds, 0, why};
    }

    MethodChoice best() const {
        const std::vector<Expectation> expected = expect();
        const auto found =
            std::min_element(expected.begin(), expected.end(),
                             [this](const Expectation& a, const Expectation& b) { return better(a, b); });
        const std::size_t chosen = static_cast<std::size_t>(found - expected.begin());
        MethodChoice choice{with_work(trials_[chosen]->settings(), found->work),
                            found->error,
                            found->seconds,
                            std::sqrt(found->beyond),
                            {}};
        for (std::size_t t = 0; t < trials_.size(); ++t) {
            const double figure = figure_of(expected[t]);
            choice.tried += fmt::format("{}{} ", t > 0 ? ", " : "", short_text(trials_[t]->settings()));
            choice.tried += !std::isfinite(figure) ? "not reached"
                            : by_error()           ? fmt::format("{:.2g} s", figure)
                                                   : fmt::format("{:.2g} %", 100 * figure);
        }
        for (const std::string& method : untried_) choice.tried += fmt::format(", {} not tried", method);
        return choice;
    }

    const Job& job_;
    const Limits& limits_;
    std::uint64_t seed_;
    Workers workers_;  // for trials
    double speed_;     // of all ranks of a parallel job together, relative to this one
    double head_start_;
    Monitor& user_;
    DeadlineMonitor monitor_;  // ends the trials
    Stopwatch clock_;
    SmallLamps lamps_{job_};  // shared by all trials
    std::vector<std::unique_ptr<Trial>> trials_;
    std::vector<std::string> untried_;
};

}  // namespace

std::optional<MethodChoice> choose_method(const Job& job, const Limits& limits, std::uint64_t seed,
                                          const Workers& workers, Monitor& monitor, double head_start) {
    return Choosing(job, limits, seed, workers, monitor, head_start).choose();
}

namespace {

constexpr double kMostPreparation = 0.15;  // share of the time
// The share of a requested error that may be of a kind that is estimated once and does not fall visibly.
constexpr double kBeyondShare = 0.5;
constexpr double kMostSamples = 1e12;

}  // namespace

double variance_in(double samples, const MethodCost& cost) {
    return cost.variance * pow(std::max(samples / cost.seen, 1.0), cost.tail);
}

double noise2_in(double samples, const MethodCost& cost) {
    const double square = variance_in(samples, cost) / samples;
    const double left = cost.left > 0 ? std::min(square, cost.left * pow(square, kDenoisedPower)) : square;
    return left + cost.missed / samples;
}

double tail_exponent(std::vector<double> deviations) {
    constexpr std::size_t kShare = 50, kLeast = 8;
    constexpr double kMostExponent = 0.9;  // with 1 no number of samples reduces an error
    const std::size_t largest = std::max(deviations.size() / kShare, kLeast);
    if (deviations.size() <= largest) return 0;
    const auto threshold = deviations.begin() + static_cast<std::ptrdiff_t>(largest);
    std::nth_element(deviations.begin(), threshold, deviations.end(), std::greater<>());
    if (!(*threshold > 0)) return 0;  // most samples do not vary at all
    double sum = 0;
    for (auto d = deviations.begin(); d != threshold; ++d) sum += log(*d / *threshold);
    if (!(sum > 0)) return 0;
    const double index = static_cast<double>(largest) / sum;
    // Blocks of different noise show a small exponent, too, when taken together.
    constexpr double kLeastExponent = 0.2;
    const double exponent = 2 / index - 1;
    return exponent < kLeastExponent ? 0 : std::min(exponent, kMostExponent);
}

Expectation best_in(double seconds, const MethodCost& cost) {
    Expectation best{kNever, seconds, cost.beyond, 1};
    const auto error_of = [&](double samples, double beyond) {
        return std::sqrt(beyond + noise2_in(samples, cost));
    };
    if (cost.kind == MethodCost::Kind::passes) {
        const double passes = (seconds - cost.once) / (cost.prepare + cost.sample);
        if (passes < 2) return best;
        const double beyond = cost.beyond * pow(cost.passes / passes, cost.power);
        return {error_of(passes, beyond), seconds, beyond, 1};
    }
    // Where methods blur alike, `beyond` is too small: at the tumbler of a close caustic a tenth. More
    // photons cost little time, so that their number is chosen as if it were larger.
    constexpr double kCaution = 4;
    double sample = cost.sample, least = kNever;
    for (double work = 1; work <= cost.most_work; work *= 2, sample += cost.growth * cost.sample) {
        const double prepare = cost.once + cost.prepare * work;
        if (prepare > kMostPreparation * seconds) break;
        const double samples = (seconds - prepare) / sample, beyond = cost.beyond * pow(work, -cost.power);
        const double cautious = error_of(samples, kCaution * beyond);
        if (samples < 1 || !(cautious < least)) continue;
        least = cautious;
        best = {error_of(samples, beyond), seconds, beyond, work};
    }
    return best;
}

namespace {

// Returns the least number of samples, from 1 on, with so much squared noise; noise2_in() falls with it.
double samples_for(double square, const MethodCost& cost) {
    double enough = 1;
    while (enough < kMostSamples && noise2_in(enough, cost) > square) enough *= 2;
    if (enough == 1 || enough >= kMostSamples) return enough;
    double few = enough / 2;
    for (int step = 0; step < 60; ++step) {  // to the last bit
        const double middle = 0.5 * (few + enough);
        (noise2_in(middle, cost) > square ? few : enough) = middle;
    }
    return enough;
}

}  // namespace

Expectation soonest_below(double error, const MethodCost& cost) {
    Expectation best{error, kNever, 0, 1};
    const double square = sqr(error);
    const auto offer = [&](double samples, double seconds, double beyond, double work) {
        if (samples > 0 && seconds < best.seconds) best = {error, seconds, beyond, work};
    };
    if (cost.kind == MethodCost::Kind::passes) {
        // Both errors must be small enough; doubling finds the number of passes accurately enough.
        for (double passes = 2; passes < 1e9; passes *= 2) {
            const double beyond = cost.beyond * pow(cost.passes / passes, cost.power);
            if (beyond > sqr(kBeyondShare) * square || beyond + noise2_in(passes, cost) > square) continue;
            offer(passes, cost.once + passes * (cost.prepare + cost.sample), beyond, 1);
            break;
        }
        return best;
    }
    double sample = cost.sample;
    for (double work = 1; work <= cost.most_work; work *= 2, sample += cost.growth * cost.sample) {
        const double beyond = cost.beyond * pow(work, -cost.power);
        if (beyond > sqr(kBeyondShare) * square) continue;
        const double samples = samples_for(square - beyond, cost);
        offer(samples, cost.once + cost.prepare * work + samples * sample, beyond, work);
    }
    return best;
}

}  // namespace lucerna
