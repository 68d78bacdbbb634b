// Computes the mean luminance of two regions of an image, over renders of independent seeds, for methods
// whose error is common to all pixels and hence not contained in the variance of a pixel.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "engine/base/stats.h"
#include "engine/render/render.h"

namespace lucerna::testing {

// Tells which pixels count; x and y are from -1 to 1.
using Where = std::function<bool(double x, double y)>;

struct RegionMeans {
    RunningStats whole, part;  // one value per seed
};

// Renders the seeds 1 to `seeds`. `part` is a subset of `whole`.
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

// Excludes the lamp, whose few bright pixels would dominate every mean.
inline bool all_but_the_lamp(double x, double y) {
    return y < 0.6 || std::fabs(x) > 0.35;
}

// Returns settings for compensated VPLs in many small sets, so that the paths of one seed estimate the mean
// at little cost per sample.
inline IgiSettings few_lights(float mindist, int sets) {
    IgiSettings igi;
    igi.nlights = 4;
    igi.nsets = sets;
    igi.mindist = mindist;
    igi.gather_samples = 1;
    return igi;
}

struct MeansCompared {
    double ratio;   // ratio of the means
    double sigmas;  // their difference in standard errors of both
    double noise;   // standard error of the ratio
};

inline MeansCompared compare_means(const RunningStats& ours, const RunningStats& reference) {
    const double error = std::hypot(ours.standard_error(), reference.standard_error());
    const double difference = std::fabs(ours.mean() - reference.mean());
    return {ours.mean() / reference.mean(), error > 0 ? difference / error : (difference > 0 ? INFINITY : 0),
            error / reference.mean()};
}

// Expects agreement within four standard errors: a correct method fails once in 400 comparisons of six seeds
// each, once in 1600 of twelve (Student's t). One relative standard error must not exceed `noise`, or three
// times that in the part, because the test would be too weak. `bias` is a relative tolerance in addition,
// where light is estimated from photons.
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

// Expects that the same test rejects the method.
inline void expect_differs(const RegionMeans& ours, const RegionMeans& reference, const std::string& what) {
    for (RunningStats RegionMeans::*which : {&RegionMeans::whole, &RegionMeans::part}) {
        const auto compared = compare_means(ours.*which, reference.*which);
        EXPECT_GT(compared.sigmas, 4) << what << " " << compared.ratio;
        EXPECT_GT(std::fabs(compared.ratio - 1), 0.01) << what;
    }
}

}  // namespace lucerna::testing
