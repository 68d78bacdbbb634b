// Do two independent renders differ by more than their noise? A z-test for every pixel and channel, from the
// variances that both carry, and one verdict for the image.
//
// Three questions, each asked at a third of the image's level, so that equal images are called different with
// that probability at most (Bonferroni):
//   largest  is the largest of all |z| too large for so many (Šidák)? Finds a single wrong pixel.
//   beyond   are more pixels beyond 2, 3 or 4 sigma than there should be (binomial, per channel and limit)?
//   mean     is the sum of all differences too large for the sum of all variances, per channel? Finds a bias
//   that no
//            pixel shows.
// The level holds for noise that is normal, independent from pixel to pixel and of the variance that is
// stated; channels may depend on each other in any way. A mean of few samples is not normal, and its variance
// is itself an estimate: below some hundred samples per pixel the first two reject more than they claim. The
// third does not mind; and cells of several pixels, tested by their sums as if each were one, have as many
// samples as their pixels together.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lucerna {

// Chance that a comparison of equal images is called different by the z-test: of the image, not of one pixel.
inline constexpr double kComparisonLevel = 0.01;

struct BeyondSigma {
    double sigmas = 0;
    std::uint64_t values = 0;  // with |z| above it
    double share = 0;          // of all tests
    double expected = 0;       // share, of a normal variate
    double p_value = 1;        // of the channel with the most surprising excess, corrected for the channels
};

struct ZTest {
    int cell = 1;  // pixels along the side of what is tested as one value
    std::uint64_t tests = 0;
    std::uint64_t untestable = 0;  // pixels' values without a variance in either image, but different
    std::uint64_t rejected = 0;    // tests whose p-value is below the corrected level
    double level = kComparisonLevel;
    double corrected_level = 0;  // 1 - (1 - level)^(1/tests)
    double smallest_p = 1;       // of one test
    double p_value = 1;          // of the largest |z|: 1 - (1 - smallest_p)^tests
    int x = 0, y = 0;            // where the smallest p-value is
    std::string channel;

    std::array<BeyondSigma, 3> beyond{};  // 2, 3 and 4 sigma
    // Mean of z, above 0 where the image is brighter; its standard error at most, whatever the channels do.
    // Leans below 0 where samples are few and skewed, as dark pixels then state too little variance.
    double mean_z = 0, mean_z_error = 0;
    double mean_p = 1;  // of the sums of differences, corrected for the channels

    double verdict_p = 1;  // of all three questions together
    bool equal() const { return verdict_p >= level; }
    // The question with the smallest p-value: "largest", "beyond" or "mean".
    std::string answered_by = "largest";
};

// Takes the values of one comparison and draws the conclusions.
class ZTester {
  public:
    // Tests cells of `cell` x `cell` pixels, at least 1, of an image of `width` columns.
    ZTester(std::vector<std::string> channels, int width, int cell = 1, double level = kComparisonLevel);

    // `difference`: image - reference; `variance`: of the difference. Call once per value, channel by its
    // number.
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
    int cell_, across_;                    // cells in a row
    std::vector<std::vector<Sum>> cells_;  // per channel, row-major
    std::vector<double> p_values_;
    ZTest test_;
};

// 1 - (1 - level)^(1/tests): the level of each of so many independent tests that together have `level` [Šidák
// 1967].
double sidak_level(double level, std::uint64_t tests);
// 1 - (1 - p)^tests: the p-value of the smallest of so many.
double sidak_p_value(double smallest_p, std::uint64_t tests);
// P(X >= observed) of `tests` trials that succeed with `chance` in (0, 1); 1 for what is not above the mean,
// where nothing is surprising.
double binomial_excess(std::uint64_t observed, std::uint64_t tests, double chance);

}  // namespace lucerna
