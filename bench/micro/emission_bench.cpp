// What it costs to draw a particle from a measured lamp, and what other ways of drawing cost.
//
// The lamps are synthetic: 32 x 32 views of 128 x 128 pixels (16.8 million coefficients, 17.8 million cells)
// and 8 x 8 views of 16 x 16; a beam that moves and widens from view to view, with some noise, negative in
// places. A particle is complete: position, direction, weight and cell, written to a span. One thread.
#include <benchmark/benchmark.h>

#include <cmath>
#include <map>

#include "engine/base/stream.h"
#include "lights/emit_net.h"
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
    Stream noise(1, Purpose::bench, 0, 0);
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

// Made once for all benchmarks: a program's memory, not a library's.
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

// Random numbers for many batches, so that no batch finds the cache as the last one left it.
std::vector<EmitU> numbers() {
    std::vector<EmitU> u(kBatch * 2048);
    const EmitNet net(1, Purpose::bench, 0);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = net.at(static_cast<std::uint32_t>(i)).u;
    return u;
}

void emit_batches(benchmark::State& state, bool large, EmissionMode mode, bool negative) {
    MeasuredSettings settings;
    settings.mode = mode;
    Monitor silent;
    const auto light =
        make_measured_light(field_of(large, negative), table_of(large, negative), settings, silent);
    const std::vector<EmitU> u = numbers();
    std::vector<std::optional<Emitted>> out(kBatch);
    std::size_t at = 0;
    for (auto _ : state) {
        light->emit_many(std::span(u).subspan(at, kBatch), out);
        benchmark::DoNotOptimize(out.data());
        benchmark::ClobberMemory();
        at = (at + kBatch) % u.size();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kBatch));
}

void emit_singly(benchmark::State& state, bool large, EmissionMode mode) {
    MeasuredSettings settings;
    settings.mode = mode;
    Monitor silent;
    const auto light = make_measured_light(field_of(large), table_of(large), settings, silent);
    const std::vector<EmitU> u = numbers();
    std::size_t at = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(light->emit(u[at]));
        at = (at + 1) % u.size();
    }
    state.SetItemsProcessed(state.iterations());
}

void draw_cells(benchmark::State& state, bool large) {
    const CellTable& table = table_of(large);
    const std::vector<EmitU> u = numbers();
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

void net_numbers(benchmark::State& state) {
    const EmitNet net(1, Purpose::bench, 0);
    std::uint32_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(net.at(i++));
    state.SetItemsProcessed(state.iterations());
}

BENCHMARK(net_numbers)->Name("emission/numbers");
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
BENCHMARK_CAPTURE(emit_batches, wl, true, EmissionMode::weighted, false)
    ->Name("emission/batch/weighted/32x32x128x128");
BENCHMARK_CAPTURE(emit_singly, cs, false, EmissionMode::constant)->Name("emission/single/constant/8x8x16x16");
BENCHMARK_CAPTURE(emit_singly, cl, true, EmissionMode::constant)
    ->Name("emission/single/constant/32x32x128x128");
BENCHMARK_CAPTURE(emit_singly, el, true, EmissionMode::exact)->Name("emission/single/exact/32x32x128x128");

}  // namespace
