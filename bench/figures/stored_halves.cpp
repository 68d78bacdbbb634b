// Measures the cost and benefit of storing a light field's coefficients as halves, for the study `halves`.
//
// A file holds halves times a power of 2, memory holds floats (lights/light_field.h). Lamps that have never
// been in a file (computed discs, and the rays of a measured LED) are written as usual and as an atlas of
// floats. The irradiance on planes of the field read back is compared with that of the floats. Writes lines
//
//   lamp,coefficients,half_file,float_file,half_memory,float_memory,table,coefficient_rms,flux,plane,rms,noise
//
// with sizes in bytes, the relative root mean square changes of the coefficients and of the irradiance on a
// plane (its distance in units of M's), the change of the flux, and the noise of the coefficients from the
// rays (0 for a formula). After a line "#" it writes lines
//
//   lamp,storage,draw,fetch
//
// with the CPU seconds per particle of drawing its cell and of reading the cell's four coefficients from
// memory in that format.
//
// usage: figure_stored_halves [--quick] FOLDER RAYS > halves.csv
// FOLDER is for the files; RAYS need not exist.
#include <fmt/core.h>

#include <filesystem>
#include <string>

#include "bench/figures/figure_main.h"
#include "bench/figures/lamp_emission.h"
#include "engine/image/image.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/ray_projection.h"

namespace {

using namespace lucerna;

constexpr std::array<double, 3> kPlanes{0.05, 0.5, 10};

struct Lamp {
    std::string name;
    LightField field;
    double noise = 0;
};

// Returns the coefficients as one image of floats, with the views laid out as in the light field's file.
Image float_atlas(const LightField& field) {
    const Rig& rig = field.rig();
    Image image(rig.views.x * rig.pixels.x, rig.views.y * rig.pixels.y, {"Y"});
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    image.value(m * rig.pixels.x + k, image.height - 1 - (n * rig.pixels.y + l), 0) =
                        field.coefficient(m, n, k, l);
                }
            }
        }
    }
    return image;
}

std::vector<double> as_doubles(std::span<const float> values) {
    return {values.begin(), values.end()};
}

void compare(const Lamp& lamp, const std::filesystem::path& folder) {
    Monitor silent;
    const LightField& floats = lamp.field;
    const std::filesystem::path half_file = folder / (lamp.name + "-half.exr"),
                                float_file = folder / (lamp.name + "-float.exr");
    write_light_field(half_file, floats);
    write_exr(float_file, float_atlas(floats));
    const LightField halves = read_light_field(half_file);
    const double coefficient_rms =
        relative_rms(as_doubles(halves.coefficients()), as_doubles(floats.coefficients()));
    for (const double plane : kPlanes) {
        const PlanePatch patch = frame_light(floats, plane * floats.rig().distance, 64, Workers{}, silent);
        const PlaneIrradiance truth = project(floats, patch, Workers{}, silent),
                              stored = project(halves, patch, Workers{}, silent);
        fmt::print("{},{},{},{},{},{},{},{:.4g},{:.4g},{:g},{:.4g},{:.4g}\n", lamp.name,
                   floats.rig().coefficients(), std::filesystem::file_size(half_file),
                   std::filesystem::file_size(float_file), floats.rig().coefficients() * sizeof(half),
                   floats.coefficients().size_bytes(), CellTable::bytes_for(floats.rig()), coefficient_rms,
                   halves.flux() / floats.flux() - 1, plane, relative_rms(stored.values, truth.values),
                   lamp.noise);
    }
}

// Returns the sum of the four coefficients of a cell, from either kind of memory; missing views and pixels
// give 0.
template <typename Stored>
float sum_of_members(const Rig& rig, const std::vector<Stored>& stored, const CellTable::Block& block,
                     std::size_t i) {
    const auto in = [](int x, int size) { return static_cast<unsigned>(x) < static_cast<unsigned>(size); };
    float sum = 0;
    for (int a = 0; a < 2; ++a) {
        for (int b = 0; b < 2; ++b) {
            const int m = block.n[i] - 1 + a, n = block.o[i] - 1 + b;
            const int k = block.p[i] - (a == 0 ? 0 : rig.shift.x),
                      l = block.q[i] - (b == 0 ? 0 : rig.shift.y);
            if (in(m, rig.views.x) && in(n, rig.views.y) && in(k, rig.pixels.x) && in(l, rig.pixels.y))
                sum += static_cast<float>(stored[rig.index(m, n, k, l)]);
        }
    }
    return sum;
}

struct Times {
    double draw = 0, fetch = 0;  // CPU seconds per particle
    double sum = 0;              // keeps the reads from being optimised away
};

template <typename Stored>
Times time_fetches(const Rig& rig, const CellTable& table, const std::vector<Stored>& stored,
                   std::uint32_t particles) {
    constexpr auto kSize = static_cast<std::uint32_t>(CellTable::Block::kSize);
    constexpr std::uint32_t kBlocks = 16;  // many at a time, so that the clock is read rarely
    const EmissionNet net(1, Purpose::bench, 0);
    std::vector<CellTable::Block> blocks(kBlocks);
    Times times;
    for (std::uint32_t first = 0; first < particles; first += kBlocks * kSize) {
        for (std::uint32_t i = 0; i < kBlocks * kSize; ++i) {
            const LeSampleU u = net.at(first + i).u;
            CellTable::Block& block = blocks[i / kSize];
            block.u[0][i % kSize] = u.position.x, block.u[1][i % kSize] = u.position.y;
            block.u[2][i % kSize] = u.direction.x, block.u[3][i % kSize] = u.direction.y;
        }
        const double begin = cpu_seconds();
        for (CellTable::Block& block : blocks) table.draw(block, kSize);
        const double between = cpu_seconds();
        for (const CellTable::Block& block : blocks) {
            for (std::size_t i = 0; i < kSize; ++i)
                times.sum += double{sum_of_members(rig, stored, block, i)};
        }
        times.draw += between - begin;
        times.fetch += cpu_seconds() - between;
    }
    times.draw /= particles, times.fetch /= particles;
    return times;
}

void time_both(const Lamp& lamp, std::uint32_t particles) {
    Monitor silent;
    const LightField& field = lamp.field;
    const CellTable table(field, Workers{}, silent);
    const double scale = storage_scale(field.coefficients());
    std::vector<float> floats;
    std::vector<half> halves;
    for (const float e : field.coefficients()) {
        halves.push_back(stored_half(e, scale));
        floats.push_back(static_cast<float>(halves.back()));
    }
    // The two alternate; the first turn only warms the caches.
    Times of_floats, of_halves;
    for (int turn = 0; turn < 3; ++turn) {
        const Times a = time_fetches(field.rig(), table, floats, particles / 2);
        const Times b = time_fetches(field.rig(), table, halves, particles / 2);
        if (turn == 0) continue;
        of_floats = {of_floats.draw + a.draw / 2, of_floats.fetch + a.fetch / 2, of_floats.sum + a.sum};
        of_halves = {of_halves.draw + b.draw / 2, of_halves.fetch + b.fetch / 2, of_halves.sum + b.sum};
    }
    fmt::print("{},floats,{:.4g},{:.4g}\n", lamp.name, of_floats.draw, of_floats.fetch);
    fmt::print("{},halves,{:.4g},{:.4g}\n", lamp.name, of_halves.draw, of_halves.fetch);
    if (of_floats.sum != of_halves.sum)
        fmt::print(stderr, "figure_stored_halves: {}: the two hold different numbers\n", lamp.name);
}

Lamp disc(const char* name, double exponent, int views, int pixels) {
    Monitor silent;
    constexpr double kRadius = 0.025, kDistance = 0.25;
    Rig rig;
    rig.views = {views, views};
    rig.pixels = {pixels, pixels};
    rig.distance = kDistance;
    const double cosine = std::pow(0.02, 1 / (exponent + 1));  // 98 % of the light is within it
    rig.spacing = V2d(2 * kRadius / (views - 3));
    rig.pixel = V2d(2 * (kRadius + kDistance * std::sqrt(1 - cosine * cosine) / cosine) / pixels);
    const EmitterModel model =
        cosine_emitter(EmitterModel::Outline::disc, V2d(kRadius, kRadius), 1000, exponent);
    return {name, acquire(model, rig, Workers{}, silent, AcquireOptions{2, 2, nullptr}), 0};
}

void run(std::vector<std::string> words) {
    std::erase(words, "");
    const bool quick = std::erase(words, "--quick") > 0;
    if (words.size() != 2) throw std::runtime_error("FOLDER and RAYS are needed");
    std::vector<Lamp> lamps;
    if (quick) {
        lamps.push_back(disc("disc cos^20", 20, 5, 12));
    } else {
        lamps.push_back(disc("disc cos^20", 20, 9, 64));
        lamps.push_back(disc("disc cos^1000", 1000, 33, 64));
    }
    if (!quick && std::filesystem::exists(words[1])) {
        Monitor silent;
        Projection led = fit_light_field(read_rays(words[1], silent), {}, Workers{}, silent);
        lamps.push_back({"measured LED", std::move(led.field), led.noise});
    }
    fmt::print(
        "lamp,coefficients,half_file,float_file,half_memory,float_memory,table,coefficient_rms,flux,plane,"
        "rms,"
        "noise\n");
    for (const Lamp& lamp : lamps) compare(lamp, words[0]);
    fmt::print("#\nlamp,storage,draw,fetch\n");
    for (const Lamp& lamp : lamps) time_both(lamp, quick ? 1U << 14 : 1U << 22);
}

}  // namespace

int main(int argc, char** argv) {
    return lucerna::figure_main("figure_stored_halves", argc, argv, run);
}
