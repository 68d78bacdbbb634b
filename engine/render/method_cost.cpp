#include "engine/render/method_cost.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/vec.h"

namespace lucerna {
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
