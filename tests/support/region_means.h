// Mean luminance of an image, or most of it, and of a part, over renders of independent seeds: for methods
// whose error all pixels share, of which a pixel's own variance knows nothing.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "engine/base/stats.h"
#include "engine/render/render.h"

namespace lucerna::testing {

// Which pixels count; x and y from -1 to 1.
using Where = std::function<bool(double x, double y)>;

struct RegionMeans {
    RunningStats whole, part;  // one number for each seed
};

// `part` is a part of `whole`.
inline RegionMeans region_means(const Job& job, int seeds, const Where& whole, const Where& part) {
    Monitor silent;
    RegionMeans means;
    for (int seed = 1; seed <= seeds; ++seed) {
        const Image image = render(job, {static_cast<std::uint64_t>(seed), Workers{2}}, silent).image;
        RunningStats in_whole, in_part;
        for (int j = 0; j < image.height; ++j) {
            for (int i = 0; i < image.width; ++i) {
                const double value{luminance(image.rgb_at(i, j))};
                const double x = (2 * i + 1.0) / image.width - 1, y = 1 - (2 * j + 1.0) / image.height;
                if (!whole(x, y)) continue;
                in_whole.add(value);
                if (part(x, y)) in_part.add(value);
            }
        }
        means.whole.add(in_whole.mean());
        means.part.add(in_part.mean());
    }
    return means;
}

// The lamp is a few bright pixels of the box, which would decide every mean.
inline bool all_but_the_lamp(double x, double y) {
    return y < 0.6 || std::fabs(x) > 0.35;
}

// Compensated VPLs, in many sets of few: what one seed's paths say of the whole, at little cost per sample.
inline IgiSettings few_lights(float mindist, int sets) {
    IgiSettings igi;
    igi.nlights = 4;
    igi.nsets = sets;
    igi.mindist = mindist;
    igi.gather_samples = 1;
    return igi;
}

struct MeansCompared {
    double ratio;   // of the means
    double sigmas;  // between them, by both their standard errors
    double noise;   // of the ratio: one sigma
};

inline MeansCompared compare_means(const RunningStats& ours, const RunningStats& reference) {
    const double error = std::hypot(ours.standard_error(), reference.standard_error());
    const double difference = std::fabs(ours.mean() - reference.mean());
    return {ours.mean() / reference.mean(), error > 0 ? difference / error : (difference > 0 ? INFINITY : 0),
            error / reference.mean()};
}

// Within four standard errors: a right method fails once in 400 comparisons of six seeds each, once in 1600
// of twelve (Student's t). `noise`: what one standard error, relative, must not exceed, three times as much
// in the part, or the test says nothing. `bias`: what it may be off besides, relative, where light is
// estimated from photons.
inline void expect_agrees(const RegionMeans& ours, const RegionMeans& reference, const std::string& what,
                          double noise, double bias = 0) {
    for (RunningStats RegionMeans::*which : {&RegionMeans::whole, &RegionMeans::part}) {
        const auto compared = compare_means(ours.*which, reference.*which);
        const std::string where = what + (which == &RegionMeans::whole ? ", whole" : ", part");
        EXPECT_NEAR(compared.ratio, 1, bias + 4 * compared.noise) << where << " " << compared.sigmas;
        EXPECT_LT(compared.noise, which == &RegionMeans::whole ? noise : 3 * noise) << where;
        std::printf("%s: %.4f ± %.4f\n", where.c_str(), compared.ratio, compared.noise);
    }
}

// That the same test rejects it.
inline void expect_differs(const RegionMeans& ours, const RegionMeans& reference, const std::string& what) {
    for (RunningStats RegionMeans::*which : {&RegionMeans::whole, &RegionMeans::part}) {
        const auto compared = compare_means(ours.*which, reference.*which);
        EXPECT_GT(compared.sigmas, 4) << what << " " << compared.ratio;
        EXPECT_GT(std::fabs(compared.ratio - 1), 0.01) << what;
    }
}

}  // namespace lucerna::testing
