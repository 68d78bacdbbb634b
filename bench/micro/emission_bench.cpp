// Measures the cost of drawing a particle from a measured lamp, and that of alternatives, and the cost of
// drawing a point of its sampling plane for a lit place.
//
// The lamps are synthetic: 32 x 32 views of 128 x 128 pixels (16.8 million coefficients, 17.8 million cells)
// and 8 x 8 views of 16 x 16. The beam moves and widens from view to view, with some noise, and is negative
// in places. A particle is complete: position, direction, weight and cell are written to a span. One thread
// is used.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/base/huge_pages.h"
#include "engine/base/sampler.h"
#include "lights/emission_net.h"
#include "lights/field_pyramid.h"
#include "lights/measured.h"

namespace {

using namespace lucerna;  // a program of its own, not a header

constexpr std::size_t kBatch = 512;

LightField make_field(int views, int pixels, bool negative) {
    Rig rig;
    rig.views = {views, views};
    rig.spacing = {0.04 / views, 0.04 / views};
    rig.pixels = {pixels, pixels};
    rig.pixel = {0.1 / pixels, 0.1 / pixels};
    rig.distance = 0.05;
    std::vector<float> e(rig.coefficients());
    Sampler noise(1, Purpose::bench, 0, 0);
    for (int m = 0; m < views; ++m) {
        for (int n = 0; n < views; ++n) {
            const float u = (static_cast<float>(m) + 0.5F) / static_cast<float>(views) - 0.5F;
            const float v = (static_cast<float>(n) + 0.5F) / static_cast<float>(views) - 0.5F;
            for (int k = 0; k < pixels; ++k) {
                for (int l = 0; l < pixels; ++l) {
                    const float s = (static_cast<float>(k) + 0.5F) / static_cast<float>(pixels) - 0.5F;
                    const float t = (static_cast<float>(l) + 0.5F) / static_cast<float>(pixels) - 0.5F;
                    const float r2 = sqr(s - 0.5F * u) + sqr(t - 0.5F * v);
                    const float beam = std::exp(-12 * r2) * std::exp(-4 * (u * u + v * v));
                    const float low = negative ? -0.05F : 0.01F;
                    e[rig.index(m, n, k, l)] = beam * (0.7F + 0.3F * noise.next()) + low * noise.next();
                }
            }
        }
    }
    return {rig, std::move(e)};
}

// Returns a field that is made once and shared by all benchmarks.
const LightField& field_of(bool large, bool negative = false) {
    static std::map<std::pair<bool, bool>, LightField> fields;
    const auto found = fields.find({large, negative});
    if (found != fields.end()) return found->second;
    return fields.emplace(std::pair(large, negative), make_field(large ? 32 : 8, large ? 128 : 16, negative))
        .first->second;
}

const CellTable& table_of(bool large, bool negative = false) {
    static std::map<std::pair<bool, bool>, CellTable> tables;
    const auto found = tables.find({large, negative});
    if (found != tables.end()) return found->second;
    Monitor silent;
    return tables.emplace(std::pair(large, negative), CellTable(field_of(large, negative), Workers{}, silent))
        .first->second;
}

void build_table(benchmark::State& state, bool large, bool negative) {
    const LightField& field = field_of(large, negative);
    Monitor silent;
    for (auto _ : state) {
        const CellTable table(field, Workers{static_cast<int>(state.range(0))}, silent);
        benchmark::DoNotOptimize(table.flux());
    }
    state.counters["bytes"] = static_cast<double>(table_of(large, negative).bytes());
}

// Returns random numbers for many batches, so that no batch finds the cache as the previous one left it.
std::vector<LeSampleU> numbers() {
    std::vector<LeSampleU> u(kBatch * 2048);
    const EmissionNet net(1, Purpose::bench, 0);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = net.at(static_cast<std::uint32_t>(i)).u;
    return u;
}

void emit_batches(benchmark::State& state, bool large, EmissionMode mode, bool negative) {
    MeasuredSettings settings;
    settings.mode = mode;
    Monitor silent;
    const auto light =
        make_measured_light(field_of(large, negative), table_of(large, negative), settings, silent);
    const std::vector<LeSampleU> u = numbers();
    std::vector<std::optional<LeSample>> out(kBatch);
    std::size_t at = 0;
    for (auto _ : state) {
        light->sample_Le_many(std::span(u).subspan(at, kBatch), out);
        benchmark::DoNotOptimize(out.data());
        benchmark::ClobberMemory();
        at = (at + kBatch) % u.size();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kBatch));
}

void emit_batches_of(benchmark::State& state, LightField field, EmissionMode mode) {
    Monitor silent;
    CellTable table(field, Workers{}, silent);
    MeasuredSettings settings;
    settings.mode = mode;
    const auto light = make_measured_light(std::move(field), std::move(table), settings, silent);
    const std::vector<LeSampleU> u = numbers();
    std::vector<std::optional<LeSample>> out(kBatch);
    std::size_t at = 0;
    for (auto _ : state) {
        light->sample_Le_many(std::span(u).subspan(at, kBatch), out);
        benchmark::DoNotOptimize(out.data());
        benchmark::ClobberMemory();
        at = (at + kBatch) % u.size();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kBatch));
}

// Emits the same coefficients as hats on M, on planes that are finer in the middle, like a field made of
// rays.
void emit_hats(benchmark::State& state, bool large, EmissionMode mode) {
    const LightField& boxes = field_of(large);
    Rig rig = boxes.rig();
    rig.basis = PixelBasis::hat;
    rig.s_coordinate.c = 0.02;
    rig.m_coordinate.c = 0.05;
    emit_batches_of(state, {rig, {boxes.coefficients().begin(), boxes.coefficients().end()}}, mode);
}

// Returns a field with X and Z beside its coefficients, which vary between places.
LightField coloured(const LightField& grey) {
    const std::vector<float> y(grey.coefficients().begin(), grey.coefficients().end());
    std::vector<float> x = y, z = y;
    Sampler noise(2, Purpose::bench, 0, 0);
    for (std::size_t i = 0; i < y.size(); ++i) x[i] *= 0.8F + 0.4F * noise.next(), z[i] *= 2 * noise.next();
    return {grey.rig(), x, y, z};
}
void emit_coloured(benchmark::State& state, bool large, EmissionMode mode) {
    emit_batches_of(state, coloured(field_of(large)), mode);
}

// Emits the same lamp at increasing resolutions, in one colour and in three channels. The arguments are views
// and pixels per axis, and whether it is coloured.
void emit_by_resolution(benchmark::State& state) {
    LightField field = make_field(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), false);
    if (state.range(2) != 0) field = coloured(field);
    state.counters["coefficients"] = static_cast<double>(field.coefficients().size());
    state.counters["bytes"] =
        static_cast<double>(field.coefficients().size_bytes() +
                            field.colour_channels().pairs.size() * sizeof(ColourChannels::Pair));
    emit_batches_of(state, std::move(field), EmissionMode::exact);
}

void emit_singly(benchmark::State& state, bool large, EmissionMode mode) {
    MeasuredSettings settings;
    settings.mode = mode;
    Monitor silent;
    const auto light = make_measured_light(field_of(large), table_of(large), settings, silent);
    const std::vector<LeSampleU> u = numbers();
    std::size_t at = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(light->sample_Le(u[at]));
        at = (at + 1) % u.size();
    }
    state.SetItemsProcessed(state.iterations());
}

void draw_cells(benchmark::State& state, bool large) {
    const CellTable& table = table_of(large);
    const std::vector<LeSampleU> u = numbers();
    CellTable::Block block;
    std::size_t at = 0;
    for (auto _ : state) {
        for (std::size_t i = 0; i < CellTable::Block::kSize; ++i) {
            block.u[0][i] = u[at + i].position.x;
            block.u[1][i] = u[at + i].position.y;
            block.u[2][i] = u[at + i].direction.x;
            block.u[3][i] = u[at + i].direction.y;
        }
        table.draw(block, CellTable::Block::kSize);
        benchmark::DoNotOptimize(&block);
        benchmark::ClobberMemory();
        at = (at + CellTable::Block::kSize) % u.size();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(CellTable::Block::kSize));
}

// Returns the clamped means of all cells, in the order of CellId.
std::vector<double> cell_weights(bool large) {
    const LightField& field = field_of(large);
    const CellTable& table = table_of(large);
    std::vector<double> weights(table.cells());
    for (std::size_t id = 0; id < weights.size(); ++id) {
        weights[id] = field.members(*table.cell(static_cast<CellId>(id))).clamped_mean();
    }
    return weights;
}

// The chain of conditionals, each searched by bisection.
class BinarySearch {
  public:
    BinarySearch(const Rig& rig, std::vector<double> weights)
        : size_{static_cast<std::size_t>(rig.intervals(0)), static_cast<std::size_t>(rig.intervals(1)),
                static_cast<std::size_t>(rig.columns(0)), static_cast<std::size_t>(rig.columns(1))} {
        for (std::size_t link = 4; link-- > 0;) {
            const std::size_t items = size_[link], rows = weights.size() / items;
            std::vector<double> sums(rows);
            upto_[link].resize(weights.size());
            for (std::size_t row = 0; row < rows; ++row) {
                for (std::size_t i = 0; i < items; ++i) sums[row] += weights[row * items + i];
                double sum = 0;
                for (std::size_t i = 0; i < items; ++i) {
                    sum += weights[row * items + i];
                    upto_[link][row * items + i] = sums[row] > 0 ? static_cast<float>(sum / sums[row]) : 0.0F;
                }
            }
            weights = std::move(sums);
        }
    }

    CellId draw(const std::array<float, 4>& u, float& remainder) const {
        std::size_t row = 0;
        remainder = 0;
        for (std::size_t link = 0; link < 4; ++link) {
            const float* const first = &upto_[link][row * size_[link]];
            const float* const found = std::upper_bound(first, first + size_[link] - 1, u[link]);
            const float before = found == first ? 0.0F : found[-1];
            remainder += (u[link] - before) / (*found - before);  // position in the cell, as in our table
            row = row * size_[link] + static_cast<std::size_t>(found - first);
        }
        return static_cast<CellId>(row);
    }

  private:
    std::array<std::size_t, 4> size_;
    std::array<HugeVector<float>, 4> upto_;
};

class AliasTable {
  public:
    explicit AliasTable(const std::vector<double>& weights) : entries_(weights.size()) {
        double total = 0;
        for (const double w : weights) total += w;
        std::vector<double> share(weights.size());
        std::vector<std::uint32_t> small, large;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            share[i] = weights[i] / total * static_cast<double>(weights.size());
            (share[i] < 1 ? small : large).push_back(static_cast<std::uint32_t>(i));
        }
        while (!small.empty() && !large.empty()) {
            const std::uint32_t low = small.back(), high = large.back();
            small.pop_back();
            entries_[low] = {static_cast<float>(share[low]), high};
            share[high] -= 1 - share[low];
            if (share[high] < 1) {
                large.pop_back();
                small.push_back(high);
            }
        }
        for (const auto* rest : {&small, &large}) {
            for (const std::uint32_t i : *rest) entries_[i] = {1, i};
        }
    }

    CellId draw(const std::array<float, 4>& u) const {
        // The place takes two floats, because one has too few bits for that many cells.
        const double where = double{u[0]} + double{u[1]} * 0x1p-24;
        const auto i = static_cast<std::size_t>(where * static_cast<double>(entries_.size()));
        return u[2] < entries_[i].keep ? static_cast<CellId>(i) : entries_[i].other;
    }
    std::size_t bytes() const { return entries_.size() * sizeof(Entry); }

  private:
    struct Entry {
        float keep = 0;
        std::uint32_t other = 0;
    };
    HugeVector<Entry> entries_;
};

// Runs draw(u) repeatedly.
template <typename DrawCell>
void draw_singly(benchmark::State& state, DrawCell&& draw) {
    std::vector<std::array<float, 4>> u;
    for (const LeSampleU& e : numbers())
        u.push_back({e.position.x, e.position.y, e.direction.x, e.direction.y});
    std::size_t at = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(draw(u[at]));
        at = (at + 1) % u.size();
    }
    state.SetItemsProcessed(state.iterations());
}

void single_table(benchmark::State& state, bool large) {
    const CellTable& table = table_of(large);
    draw_singly(state, [&](const std::array<float, 4>& u) { return table.draw(u); });
    state.counters["bytes"] = static_cast<double>(table.bytes());
}
void single_binary(benchmark::State& state, bool large) {
    const BinarySearch search(field_of(large).rig(), cell_weights(large));
    draw_singly(state, [&](const std::array<float, 4>& u) {
        float remainder = 0;
        const CellId id = search.draw(u, remainder);
        return std::pair(id, remainder);
    });
}
void single_alias(benchmark::State& state, bool large) {
    const AliasTable table(cell_weights(large));
    draw_singly(state, [&](const std::array<float, 4>& u) { return table.draw(u); });
    state.counters["bytes"] = static_cast<double>(table.bytes());
}
void single_brute(benchmark::State& state, bool large) {
    const std::vector<double> weights = cell_weights(large);
    double total = 0;
    for (const double w : weights) total += w;
    draw_singly(state, [&](const std::array<float, 4>& u) {
        // All cells are read for any u, because u is compared with their cumulative sum.
        double sum = 0;
        std::size_t found = 0;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            sum += weights[i];
            found += sum <= double{u[0]} * total;
        }
        return found;
    });
}

const FieldPyramid& pyramid_of(bool large) {
    static std::map<bool, FieldPyramid> pyramids;
    const auto found = pyramids.find(large);
    if (found != pyramids.end()) return found->second;
    return pyramids.emplace(large, FieldPyramid(field_of(large), table_of(large), 16, Workers{}))
        .first->second;
}

void build_pyramid(benchmark::State& state) {
    for (auto _ : state) {
        const FieldPyramid pyramid(field_of(true), table_of(true), 16,
                                   Workers{static_cast<int>(state.range(0))});
        benchmark::DoNotOptimize(pyramid.bytes());
    }
    state.counters["bytes"] = static_cast<double>(pyramid_of(true).bytes());
}

// Returns places on a plane a metre in front of S, row by row as in an image, mostly in the beam.
std::vector<V3d> places() {
    constexpr int kAcross = 256;
    std::vector<V3d> x;
    for (int i = 0; i < kAcross * kAcross; ++i) {
        x.emplace_back(1.4 * ((i / kAcross + 0.5) / kAcross - 0.5),
                       1.4 * ((i % kAcross + 0.5) / kAcross - 0.5), 1);
    }
    return x;
}

// Draws a point of S and its densities, overall and within its part.
void draw_for_place(benchmark::State& state, bool large) {
    const FieldPyramid& pyramid = pyramid_of(large);
    const std::vector<V3d> x = places();
    const std::vector<LeSampleU> u = numbers();
    std::size_t at = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(pyramid.draw(x[at % x.size()], u[at % u.size()].position));
        ++at;
    }
    state.SetItemsProcessed(state.iterations());
}

// As above with the radiance and the directions in the scene; if `found`, evaluates what a ray finds.
void light_for_place(benchmark::State& state, bool large, bool found) {
    Monitor silent;
    const auto light = make_measured_light(field_of(large), table_of(large), {}, silent);
    const std::vector<V3d> x = places();
    const std::vector<LeSampleU> u = numbers();
    std::size_t at = 0;
    for (auto _ : state) {
        const V3f place(x[at % x.size()]);
        const V2f& v = u[at % u.size()].position;
        if (found) {
            const V3f from(0.04F * (v.x - 0.5F), 0.04F * (v.y - 0.5F), 0);
            benchmark::DoNotOptimize(light->Le(Ray{place, (from - place).normalized()}));
        } else {
            benchmark::DoNotOptimize(light->sample_Li(place, v));
        }
        ++at;
    }
    state.SetItemsProcessed(state.iterations());
}

void net_numbers(benchmark::State& state) {
    const EmissionNet net(1, Purpose::bench, 0);
    std::uint32_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(net.at(i++));
    state.SetItemsProcessed(state.iterations());
}

BENCHMARK_CAPTURE(single_table, small, false)->Name("other/ours/8x8x16x16");
BENCHMARK_CAPTURE(single_table, large, true)->Name("other/ours/32x32x128x128");
BENCHMARK_CAPTURE(single_binary, small, false)->Name("other/binary_search/8x8x16x16");
BENCHMARK_CAPTURE(single_binary, large, true)->Name("other/binary_search/32x32x128x128");
BENCHMARK_CAPTURE(single_alias, small, false)->Name("other/alias/8x8x16x16");
BENCHMARK_CAPTURE(single_alias, large, true)->Name("other/alias/32x32x128x128");
BENCHMARK_CAPTURE(single_brute, small, false)->Name("other/all_cells/8x8x16x16");
BENCHMARK_CAPTURE(single_brute, large, true)
    ->Name("other/all_cells/32x32x128x128")
    ->Unit(benchmark::kMillisecond);
BENCHMARK(build_pyramid)
    ->Name("place/build/32x32x128x128")
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_for_place, small, false)->Name("place/draw/8x8x16x16");
BENCHMARK_CAPTURE(draw_for_place, large, true)->Name("place/draw/32x32x128x128");
BENCHMARK_CAPTURE(light_for_place, small, false, false)->Name("place/sample_Li/8x8x16x16");
BENCHMARK_CAPTURE(light_for_place, large, true, false)->Name("place/sample_Li/32x32x128x128");
BENCHMARK_CAPTURE(light_for_place, large_found, true, true)->Name("place/Le/32x32x128x128");
BENCHMARK(net_numbers)->Name("emission/numbers");
BENCHMARK(emit_by_resolution)
    ->Name("emission/resolution")
    ->ArgNames({"views", "pixels", "colour"})
    ->ArgsProduct({{8}, {16}, {0, 1}})
    ->ArgsProduct({{16}, {32}, {0, 1}})
    ->ArgsProduct({{16}, {128}, {0, 1}})
    ->ArgsProduct({{32}, {128}, {0, 1}});
BENCHMARK_CAPTURE(build_table, large, true, false)
    ->Name("table/build/32x32x128x128")
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(build_table, large_negative, true, true)
    ->Name("table/build/32x32x128x128/negative")
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_cells, small, false)->Name("table/draw/8x8x16x16");
BENCHMARK_CAPTURE(draw_cells, large, true)->Name("table/draw/32x32x128x128");
BENCHMARK_CAPTURE(emit_batches, cs, false, EmissionMode::constant, false)
    ->Name("emission/batch/constant/8x8x16x16");
BENCHMARK_CAPTURE(emit_batches, cl, true, EmissionMode::constant, false)
    ->Name("emission/batch/constant/32x32x128x128");
BENCHMARK_CAPTURE(emit_batches, es, false, EmissionMode::exact, false)
    ->Name("emission/batch/exact/8x8x16x16");
BENCHMARK_CAPTURE(emit_batches, el, true, EmissionMode::exact, false)
    ->Name("emission/batch/exact/32x32x128x128");
BENCHMARK_CAPTURE(emit_batches, eln, true, EmissionMode::exact, true)
    ->Name("emission/batch/exact/32x32x128x128/negative");
BENCHMARK_CAPTURE(emit_hats, hs, false, EmissionMode::exact)->Name("emission/batch/exact/8x8x16x16/hats");
BENCHMARK_CAPTURE(emit_hats, hl, true, EmissionMode::exact)->Name("emission/batch/exact/32x32x128x128/hats");
BENCHMARK_CAPTURE(emit_coloured, as, false, EmissionMode::exact)
    ->Name("emission/batch/exact/8x8x16x16/coloured");
BENCHMARK_CAPTURE(emit_coloured, al, true, EmissionMode::exact)
    ->Name("emission/batch/exact/32x32x128x128/coloured");
BENCHMARK_CAPTURE(emit_singly, cs, false, EmissionMode::constant)->Name("emission/single/constant/8x8x16x16");
BENCHMARK_CAPTURE(emit_singly, cl, true, EmissionMode::constant)
    ->Name("emission/single/constant/32x32x128x128");
BENCHMARK_CAPTURE(emit_singly, el, true, EmissionMode::exact)->Name("emission/single/exact/32x32x128x128");

}  // namespace
