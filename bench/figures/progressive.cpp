// Measures how the error of `progressive` falls with its passes, for docs/images/progressive.svg.
//
// Renders a scene twice, with two seeds, and compares the images after 1, 2, 3, 4, 6, 8, 12 … passes with the
// mean of two independent long images, at whose size it renders. Writes lines
//
//   passes seconds error2 noise2 bias2
//
// with three relative squares, means over pixels and channels of x² / (r² + 1e-4) with the reference r: the
// error of one image; its noise, half the squared difference of the two; and the squared bias, the error of
// the two images' mean minus its noise, which is below 0 where noise hides it. The reference's own noise,
// known from the difference of its two images, is subtracted. Pixels whose reference is above MASK (visible
// lamps) are left out. Seconds are those since the start of one seed's render, pre-pass included.
//
// usage: figure_progressive SCENE FIRST.exr SECOND.exr MASK PASSES [KEY=VALUE …] > numbers.txt
#include <fmt/core.h>

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/figures/figure_main.h"
#include "engine/base/monitor.h"
#include "engine/evaluation/compare.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "engine/text/units.h"

namespace {

using namespace lucerna;

struct Shown {
    int passes;
    double seconds;
    Image image;
};

// Returns true for 1, 2, 3, 4, 6, 8, 12, …
bool is_shown(int passes) {
    int power = passes;
    while (power % 2 == 0) power /= 2;
    return power == 1 || power == 3;
}

std::vector<Shown> render_passes(const Job& job, std::uint64_t seed) {
    std::vector<Shown> all;
    RenderOptions options{seed, Workers{}};
    const Stopwatch watch;
    options.show_every = 0;
    options.show = [&](const RenderResult& result) {
        if (is_shown(result.report.passes_done))
            all.push_back({result.report.passes_done, watch.seconds(), result.image});
    };
    Monitor silent;
    render(job, options, silent);
    return all;
}

struct Reference {
    Image first, second;
    float mask;

    bool counts(int x, int y) const {
        return max_component(first.rgb_at(x, y)) <= mask && max_component(second.rgb_at(x, y)) <= mask;
    }
};

// Returns the mean over pixels of square(reference value r, x, y, channel) relative to r².
template <typename Square>
double relative_mean(const Reference& reference, Square&& square) {
    double sum = 0;
    std::size_t count = 0;
    for (int y = 0; y < reference.first.height; ++y) {
        for (int x = 0; x < reference.first.width; ++x) {
            if (!reference.counts(x, y)) continue;
            for (int c = 0; c < 3; ++c, ++count) {
                const double r =
                    0.5 * (double{reference.first.value(x, y, c)} + double{reference.second.value(x, y, c)});
                sum += square(r, x, y, c) / (r * r + kRelativeMseFloor);
            }
        }
    }
    return sum / static_cast<double>(count);
}

void write_line(const Reference& reference, const Shown& a, const Shown& b) {
    const double own = relative_mean(reference, [&](double r, int x, int y, int c) {
        return sqr(double{reference.first.value(x, y, c)} - r);
    });
    const double noise2 = relative_mean(reference, [&](double, int x, int y, int c) {
        return 0.5 * sqr(double{a.image.value(x, y, c)} - double{b.image.value(x, y, c)});
    });
    const double error2 = relative_mean(reference, [&](double r, int x, int y, int c) {
        return 0.5 * (sqr(double{a.image.value(x, y, c)} - r) + sqr(double{b.image.value(x, y, c)} - r));
    });
    const double mean2 = relative_mean(reference, [&](double r, int x, int y, int c) {
        return sqr(0.5 * (double{a.image.value(x, y, c)} + double{b.image.value(x, y, c)}) - r);
    });
    fmt::print("{} {:.3f} {:.5g} {:.5g} {:.5g}\n", a.passes, a.seconds, error2 - own, noise2,
               mean2 - noise2 / 2 - own);
}

void run(const std::vector<std::string>& words) {
    if (words.size() < 5) throw std::runtime_error("SCENE FIRST.exr SECOND.exr MASK PASSES are needed");
    const Reference reference{read_exr(words[1]), read_exr(words[2]),
                              static_cast<float>(parse_number({"MASK"}, words[3], 0, 1e30))};
    SceneOverrides overrides;
    overrides.integrator = "progressive";
    overrides.resolution = V2i(reference.first.width, reference.first.height);
    overrides.spp = static_cast<int>(parse_whole({"PASSES"}, words[4], 1, 1 << 20));
    for (std::size_t i = 5; i < words.size(); ++i)
        overrides.set.push_back(parse_assignment({"KEY=VALUE"}, words[i]));
    Monitor silent;
    const Job job = read_scene(words[0], overrides, Workers{}, silent);
    fmt::print("# {}", words[0]);
    for (const auto& [name, value] : describe(job.integrator)) fmt::print(" {}={}", name, value);
    fmt::print("\n# passes seconds error2 noise2 bias2\n");
    const std::vector<Shown> a = render_passes(job, 1), b = render_passes(job, 2);
    for (std::size_t i = 0; i < a.size(); ++i) write_line(reference, a[i], b[i]);
}

}  // namespace

int main(int argc, char** argv) {
    return lucerna::figure_main("figure_progressive", argc, argv, run);
}
