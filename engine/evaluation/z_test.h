// Tests whether two independent renders differ by more than their noise, with a z-test for every pixel and
// channel from the variances that both state, and one verdict for the image.
//
// Three tests each have a third of the image's level, so the probability of calling equal images different is
// at most that level (Bonferroni):
//   largest  Is the largest |z| too large for so many values (Šidák)? Finds a single wrong pixel.
//   beyond   Are more pixels beyond 2, 3 or 4 sigma than expected (binomial, per channel and limit)?
//   mean     Is the sum of all differences too large for the sum of all variances, per channel? Finds a bias
//            that no single pixel shows.
// The level holds for normal noise that is independent between pixels and has the stated variance; channels
// may be correlated. A mean of few samples is not normal, and its variance is an estimate, so below some
// hundred samples per pixel the first two tests reject more often than stated. The third is robust; and cells
// of several pixels, tested by their sums, have the samples of all their pixels.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lucerna {

// Probability that the z-test calls equal images different, for the whole image.
inline constexpr double kComparisonLevel = 0.01;

struct BeyondSigma {
    double sigmas = 0;
    std::uint64_t values = 0;  // with larger |z|
    double share = 0;          // of all tests
    double expected = 0;       // share for a normal variate
    double p_value = 1;        // of the channel with the most significant excess, corrected for the channels
};

struct ZTest {
    int cell = 1;  // pixels along the side of a cell that is tested as one value
    std::uint64_t tests = 0;
    std::uint64_t untestable = 0;  // values that differ without a variance in either image
    std::uint64_t rejected = 0;    // tests whose p-value is below the corrected level
    double level = kComparisonLevel;
    double corrected_level = 0;  // 1 - (1 - level)^(1/tests)
    double smallest_p = 1;       // of a single test
    double p_value = 1;          // of the largest |z|: 1 - (1 - smallest_p)^tests
    int x = 0, y = 0;            // location of the smallest p-value
    std::string channel;

    std::array<BeyondSigma, 3> beyond{};  // 2, 3 and 4 sigma
    // Mean of z, above 0 if the image is brighter, and an upper bound of its standard error for any
    // correlation of channels. It tends below 0 where samples are few and skewed, as dark pixels then state
    // too little variance.
    double mean_z = 0, mean_z_error = 0;
    double mean_p = 1;  // of the sums of differences, corrected for the channels

    double verdict_p = 1;  // of all three tests together
    bool equal() const { return verdict_p >= level; }
    // The test with the smallest p-value: "largest", "beyond" or "mean".
    std::string answered_by = "largest";
};

// Collects the values of one comparison and computes the result.
class ZTester {
  public:
    // Tests cells of `cell` x `cell` pixels, at least 1, of an image of `width` columns.
    ZTester(std::vector<std::string> channels, int width, int cell = 1, double level = kComparisonLevel);

    // Adds a value of channel number `channel`. `difference` is image - reference, and `variance` is that of
    // the difference. Call once per value.
    void add(int x, int y, std::size_t channel, double difference, double variance);
    ZTest finish();

  private:
    struct Channel {
        std::string name;
        std::uint64_t tests = 0;
        std::array<std::uint64_t, 3> beyond{};
        double difference = 0, variance = 0, z = 0;
    };
    struct Sum {
        double difference = 0, variance = 0;
    };
    void test(int x, int y, Channel& channel, const Sum& sum);
    void judge_largest();
    void judge_beyond();
    void judge_mean();

    std::vector<Channel> channels_;
    int cell_, across_;                    // size of a cell, and number of cells in a row
    std::vector<std::vector<Sum>> cells_;  // per channel, row-major
    std::vector<double> p_values_;
    ZTest test_;
};

// Returns 1 - (1 - level)^(1/tests), the level of each of independent tests that together have `level` [Šidák
// 1967].
double sidak_level(double level, std::uint64_t tests);
// Returns 1 - (1 - p)^tests, the p-value of the smallest of so many.
double sidak_p_value(double smallest_p, std::uint64_t tests);
// Returns P(X >= observed) for `tests` trials with success probability `chance` in (0, 1), or 1 if `observed`
// is not above the mean.
double binomial_excess(std::uint64_t observed, std::uint64_t tests, double chance);

}  // namespace lucerna
