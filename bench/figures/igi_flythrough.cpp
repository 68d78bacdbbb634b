// Measures flicker when a camera flies through a static scene, for `igi` with one seed for all frames against
// a new seed for each frame.
//
// Renders FRAMES frames of a scene's illuminance by `igi`, with the camera moved by an equal part of TRAVEL
// (three numbers, scene units) in each. All surfaces are divided into cells of space, separated by the
// direction they face. Pixels are assigned to cells by the hits of their central rays, so that a cell is the
// same piece of surface in every frame, seen from elsewhere. For cells that cover enough pixels in every
// frame, E_k is the mean illuminance in frame k. Flicker is the change from frame to frame,
//
//   root of the mean over frames of (E_k - E_{k-1})² / (mean E)²,
//
// of the median cell (edges of sunlit patches are other cells). A wall's own gradients, seen with different
// pixels in each frame, contribute to both numbers and reduce their ratio.
//
// Prints, for cells of every SIZE (scene units, separated by commas), the flicker with new seeds and with one
// seed, their ratio, and the number of cells. Writes to SERIES the frames' values in the cells seen by most
// pixels, relative to each cell's mean.
//
// usage: figure_igi_flythrough SCENE WIDTHxHEIGHT SPP FRAMES TRAVEL SIZE,SIZE... SERIES.txt [KEY=VALUE …]
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/figures/figure_main.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "engine/text/units.h"

namespace {

using namespace lucerna;

constexpr std::size_t kLeastPixels = 4;
constexpr std::size_t kSeriesCells = 3;

// A piece of surface: a cell of space, and the signed axis that is closest to the surface's normal.
using Cell = std::array<int, 4>;

Cell cell_of(const Hit& hit, double size) {
    const V3f& n = hit.at.n;
    int axis = 0;
    for (int a = 1; a < 3; ++a) {
        if (std::fabs(n[a]) > std::fabs(n[axis])) axis = a;
    }
    const auto at = [&](int a) { return static_cast<int>(std::floor(double{hit.at.p[a]} / size)); };
    return {at(0), at(1), at(2), 2 * axis + (n[axis] < 0 ? 1 : 0)};
}

// The sum and number of a cell's pixels in each frame.
struct Seen {
    std::vector<double> sum;
    std::vector<std::size_t> pixels;
};
using Cells = std::map<Cell, Seen>;

void add_frame(const Job& job, const Image& image, double size, std::size_t frame, std::size_t frames,
               Cells& cells) {
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const V2f middle(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
            const auto hit = job.scene.intersect(job.camera.ray(middle, V2f(0.5F)));
            if (!hit) continue;
            Seen& seen = cells[cell_of(*hit, size)];
            seen.sum.resize(frames);
            seen.pixels.resize(frames);
            seen.sum[frame] += double{luminance(image.rgb_at(x, y))};
            ++seen.pixels[frame];
        }
    }
}

// Returns a cell's value in each frame over its mean; empty if a frame does not see it well enough, or if it
// is dark.
std::vector<double> course(const Seen& seen) {
    std::vector<double> values;
    double mean = 0;
    for (std::size_t k = 0; k < seen.sum.size(); ++k) {
        if (seen.pixels[k] < kLeastPixels) return {};
        values.push_back(seen.sum[k] / static_cast<double>(seen.pixels[k]));
        mean += values.back() / static_cast<double>(seen.sum.size());
    }
    if (!(mean > 0)) return {};
    for (double& value : values) value /= mean;
    return values;
}

double squared_flicker(const std::vector<double>& values) {
    double sum = 0;
    for (std::size_t k = 1; k < values.size(); ++k)
        sum += (values[k] - values[k - 1]) * (values[k] - values[k - 1]);
    return sum / static_cast<double>(values.size() - 1);  // at least two frames
}

struct Flicker {
    double of_middle_cell = 0;
    std::size_t cells = 0;
};
Flicker flicker(const Cells& cells) {
    std::vector<double> all;
    for (const auto& [cell, seen] : cells) {
        const std::vector<double> values = course(seen);
        if (!values.empty()) all.push_back(std::sqrt(squared_flicker(values)));
    }
    if (all.empty()) return {};
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    return {*middle, all.size()};
}

V3d parse_path(const std::string& text) {
    std::istringstream words(text);
    V3d path;
    if (!(words >> path.x >> path.y >> path.z)) throw std::runtime_error("TRAVEL is three numbers");
    return path;
}

std::vector<double> parse_sizes(const std::string& text) {
    std::vector<double> sizes;
    std::istringstream words(text);
    for (std::string word; std::getline(words, word, ',');)
        sizes.push_back(parse_number({"SIZE"}, word, 1e-6, 1e6));
    return sizes;
}

class Flight {
  public:
    Flight(Job job, const V3d& path, std::size_t frames)
        : job_(std::move(job)), begin_(job_.camera.settings()), path_(path), frames_(frames) {}

    // Returns the cells of each size.
    std::vector<Cells> fly(bool fresh_seeds, const std::vector<double>& sizes) {
        std::vector<Cells> cells(sizes.size());
        Monitor silent;
        for (std::size_t frame = 0; frame < frames_; ++frame) {
            Camera::Settings camera = begin_;
            const double share = static_cast<double>(frame) / static_cast<double>(frames_ - 1);
            for (int a = 0; a < 3; ++a) camera.world_from_camera[3][a] += share * path_[a];
            job_.camera = Camera(camera);
            const RenderOptions options{fresh_seeds ? 1000 + frame : 1000, Workers{}};
            const Image image = render(job_, options, silent).image;
            for (std::size_t i = 0; i < sizes.size(); ++i)
                add_frame(job_, image, sizes[i], frame, frames_, cells[i]);
        }
        return cells;
    }

  private:
    Job job_;
    Camera::Settings begin_;
    V3d path_;
    std::size_t frames_;
};

// Writes lines "frame fresh fixed" for each of the cells seen by most pixels, separated by blank lines.
void write_series(const std::string& file, const Cells& fresh, const Cells& fixed) {
    std::vector<std::pair<std::size_t, Cell>> cells;
    for (const auto& [cell, seen] : fixed) {
        if (course(seen).empty()) continue;
        std::size_t pixels = 0;
        for (const std::size_t n : seen.pixels) pixels += n;
        cells.emplace_back(pixels, cell);
    }
    std::sort(cells.rbegin(), cells.rend());
    std::ofstream out(file);
    for (std::size_t i = 0; i < std::min(kSeriesCells, cells.size()); ++i) {
        const auto a = course(fresh.at(cells[i].second)), b = course(fixed.at(cells[i].second));
        for (std::size_t k = 0; k < a.size(); ++k) out << fmt::format("{} {:.6f} {:.6f}\n", k, a[k], b[k]);
        out << "\n";
    }
    if (!out.flush()) throw std::runtime_error("cannot write " + file);
}

void run(const std::vector<std::string>& words) {
    if (words.size() < 7)
        throw std::runtime_error("SCENE WIDTHxHEIGHT SPP FRAMES TRAVEL SIZE,SIZE... SERIES.txt are needed");
    SceneOverrides overrides;
    overrides.integrator = "igi";
    overrides.resolution = parse_size({"WIDTHxHEIGHT"}, words[1], 1 << 14);
    overrides.spp = static_cast<int>(parse_whole({"SPP"}, words[2], 1, 1 << 20));
    const auto frames = static_cast<std::size_t>(parse_whole({"FRAMES"}, words[3], 2, 10'000));
    overrides.set = {{"quantity", "illuminance"}};
    for (std::size_t i = 7; i < words.size(); ++i)
        overrides.set.push_back(parse_assignment({"KEY=VALUE"}, words[i]));
    const std::vector<double> sizes = parse_sizes(words[5]);
    Monitor silent;
    Flight flight(read_scene(words[0], overrides, Workers{}, silent), parse_path(words[4]), frames);
    const auto fresh = flight.fly(true, sizes), fixed = flight.fly(false, sizes);
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const Flicker a = flicker(fresh[i]), b = flicker(fixed[i]);
        if (b.cells == 0 || !(b.of_middle_cell > 0)) {
            fmt::print("cells of {:g}: none is seen well enough in every frame\n", sizes[i]);
            continue;
        }
        fmt::print(
            "cells of {:g}: {} of them; flicker by fresh seeds {:.4f}, by one seed {:.4f}: {:.1f} times "
            "less\n",
            sizes[i], b.cells, a.of_middle_cell, b.of_middle_cell, a.of_middle_cell / b.of_middle_cell);
    }
    if (!sizes.empty()) write_series(words[6], fresh.front(), fixed.front());
}

}  // namespace

int main(int argc, char** argv) {
    return lucerna::figure_main("figure_igi_flythrough", argc, argv, run);
}
