// Measures the cost of reading a scene on one core: bytes of scene text and of binary PLY per second of CPU
// time, and separately the conversion from the draft to the scene's floats and the building of Embree's tree.
//
// The scene is a sheet of half a million triangles, a size that real meshes have, or ten of them
// (load/.../10). A scene is loaded once, into memory that the process did not have before, so all large
// blocks come from the system in every iteration. With reused blocks, binary PLY would seem several times as
// fast. The file itself is in the system's cache.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <malloc.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "engine/pbrt/draft.h"
#include "engine/pbrt/read_scene.h"
#include "engine/scene/mesh.h"
#include "engine/system/files.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace lucerna;  // a program of its own, not a header

constexpr int kSide = 500;  // squares along each side of the sheet
constexpr std::int64_t kTriangles = 2 * kSide * kSide;

PlyMesh sheet() {
    PlyMesh mesh;
    for (int y = 0; y <= kSide; ++y) {
        for (int x = 0; x <= kSide; ++x) {
            const float u = static_cast<float>(x) / kSide, v = static_cast<float>(y) / kSide;
            mesh.p.emplace_back(10 * u, 0.1F * std::sin(40 * u) * std::cos(30 * v), 10 * v);
        }
    }
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const int corner = x + y * (kSide + 1), above = corner + kSide + 1;
            mesh.triangles.emplace_back(corner, corner + 1, above + 1);
            mesh.triangles.emplace_back(corner, above + 1, above);
        }
    }
    return mesh;
}

constexpr const char* kWorld = "WorldBegin\nLightSource \"infinite\"\n";

std::string sheet_as_text() {
    const PlyMesh mesh = sheet();
    std::string text = "Shape \"trianglemesh\" \"point3 P\" [\n";
    const auto out = std::back_inserter(text);
    for (const V3f& p : mesh.p) fmt::format_to(out, "{:.6g} {:.6g} {:.6g}\n", p.x, p.y, p.z);
    text += "] \"integer indices\" [\n";
    for (const V3i& t : mesh.triangles) fmt::format_to(out, "{} {} {}\n", t.x, t.y, t.z);
    return text + "]\n";
}

std::string repeated(const std::string& text, std::int64_t times) {
    std::string all = kWorld;
    for (; times > 0; --times) all += text;
    return all;
}

std::string sheet_as_ply(bool ascii) {
    const PlyMesh mesh = sheet();
    std::string ply = fmt::format(
        "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        ascii ? "ascii" : "binary_little_endian", mesh.p.size(), mesh.triangles.size());
    const auto out = std::back_inserter(ply);
    for (const V3f& p : mesh.p) {
        if (ascii) {
            fmt::format_to(out, "{:.6g} {:.6g} {:.6g}\n", p.x, p.y, p.z);
        } else {
            ply.append(reinterpret_cast<const char*>(&p.x), sizeof p);
        }
    }
    for (const V3i& t : mesh.triangles) {
        if (ascii) {
            fmt::format_to(out, "3 {} {} {}\n", t.x, t.y, t.z);
        } else {
            ply += '\3';
            ply.append(reinterpret_cast<const char*>(&t.x), sizeof t);
        }
    }
    return ply;
}

// Counts sheets of that many bytes each; items are triangles.
void count(benchmark::State& state, std::size_t bytes, std::int64_t sheets = 1) {
    state.SetBytesProcessed(state.iterations() * sheets * static_cast<std::int64_t>(bytes));
    state.SetItemsProcessed(state.iterations() * sheets * kTriangles);
}

// Fixes glibc's threshold for separate blocks, which would otherwise grow with what is freed.
void take_fresh_memory() {
    mallopt(M_MMAP_THRESHOLD, 128 * 1024);
}

void scene_text(benchmark::State& state) {
    take_fresh_memory();
    const testing::TemporaryFolder folder;
    const std::string text = repeated(sheet_as_text(), state.range(0));
    std::ofstream(folder / "sheet.pbrt", std::ios::binary) << text;
    Monitor silent;
    for (auto _ : state) {
        const Draft draft =
            read_draft(read_text(folder / "sheet.pbrt"), folder / "sheet.pbrt", SceneOverrides{}, silent);
        benchmark::DoNotOptimize(draft.meshes.front().p.data());
    }
    count(state, text.size() / static_cast<std::size_t>(state.range(0)), state.range(0));
}
BENCHMARK(scene_text)->Name("load/text")->Arg(1)->Arg(10)->Unit(benchmark::kMillisecond);

void ply_file(benchmark::State& state, bool ascii) {
    take_fresh_memory();
    const testing::TemporaryFolder folder;
    const std::string ply = sheet_as_ply(ascii);
    std::ofstream(folder / "sheet.ply", std::ios::binary) << ply;
    for (auto _ : state) benchmark::DoNotOptimize(read_ply(folder / "sheet.ply").p.data());
    count(state, ply.size());
}
BENCHMARK_CAPTURE(ply_file, binary, false)->Name("load/ply_binary")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(ply_file, ascii, true)->Name("load/ply_ascii")->Unit(benchmark::kMillisecond);

// Measures a mesh as in a scene: read, checked, moved to world space.
void ply_shape(benchmark::State& state) {
    take_fresh_memory();
    const testing::TemporaryFolder folder;
    const std::string ply = sheet_as_ply(false);
    std::ofstream(folder / "sheet.ply", std::ios::binary) << ply;
    const std::string text =
        repeated("Shape \"plymesh\" \"string filename\" \"sheet.ply\"\n", state.range(0));
    Monitor silent;
    for (auto _ : state) {
        const Draft draft = read_draft(text, folder / "sheet.pbrt", SceneOverrides{}, silent);
        benchmark::DoNotOptimize(draft.meshes.front().p.data());
    }
    count(state, ply.size(), state.range(0));
}
BENCHMARK(ply_shape)->Name("load/ply_in_scene")->Arg(1)->Arg(10)->Unit(benchmark::kMillisecond);

void to_floats(benchmark::State& state) {
    take_fresh_memory();
    const std::string text = kWorld + sheet_as_text();
    Monitor silent;
    for (auto _ : state) {
        state.PauseTiming();
        Draft draft = read_draft(text, "sheet.pbrt", SceneOverrides{}, silent);
        state.ResumeTiming();
        const Assembled assembled = assemble(std::move(draft), Workers{1}, silent);
        benchmark::DoNotOptimize(assembled.parts.meshes.front().p.data());
    }
    count(state, 0);
}
BENCHMARK(to_floats)->Name("load/assemble")->Unit(benchmark::kMillisecond);

void embree(benchmark::State& state) {
    take_fresh_memory();
    const std::string text = kWorld + sheet_as_text();
    Monitor silent;
    for (auto _ : state) {
        state.PauseTiming();
        Draft draft = read_draft(text, "sheet.pbrt", SceneOverrides{}, silent);
        Assembled assembled = assemble(std::move(draft), Workers{1}, silent);
        state.ResumeTiming();
        const Scene scene(std::move(assembled.parts), Workers{1});
        benchmark::DoNotOptimize(scene.bounds());
    }
    count(state, 0);
}
BENCHMARK(embree)->Name("load/embree")->Unit(benchmark::kMillisecond);

}  // namespace
