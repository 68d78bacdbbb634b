// Measures the cost of a lookup in an image texture, of bytes and floats, kept in memory and through the tile
// cache, at adjacent places like those of neighbouring rays, and at random places.
#include <benchmark/benchmark.h>

#include <vector>

#include "engine/base/sampler.h"
#include "engine/scene/texture_image.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace lucerna;  // a program of its own, not a header

constexpr int kTextureSide = 512;

Image noise() {
    Image image = Image::rgb(kTextureSide, kTextureSide);
    Sampler sampler(3, Purpose::test, 0, 0);
    for (float& value : image.data) value = sampler.next();
    return image;
}

std::vector<V2f> places(bool near) {
    std::vector<V2f> all;
    Sampler sampler(4, Purpose::test, 0, 0);
    for (int i = 0; i < 1 << 16; ++i) {
        const float jitter = sampler.next();
        if (near) {
            // Walks along rows of 256 places, three quarters of a texel apart.
            all.emplace_back(static_cast<float>(i % 256) * 0.75F / kTextureSide + jitter * 1e-4F,
                             static_cast<float>(i / 256) * 0.75F / kTextureSide);
        } else {
            all.emplace_back(jitter, sampler.next());
        }
    }
    return all;
}

void lookup(benchmark::State& state, const char* name, bool kept, bool near) {
    const testing::TemporaryFolder folder;
    write_png_display(folder / "a.png", noise());
    write_exr(folder / "a.exr", noise());
    // The cache can hold the whole image.
    TextureImages images(kept ? TextureMemory{} : TextureMemory{0, 0, std::size_t{64} << 20});
    const auto texture = image_texture<Rgb>(images.open(folder / name, {}), {});
    const std::vector<V2f> all = places(near);
    std::size_t i = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(texture.at(all[i]));
        i = (i + 1) % all.size();
    }
}

BENCHMARK_CAPTURE(lookup, bytes_kept_near, "a.png", true, true);
BENCHMARK_CAPTURE(lookup, bytes_kept_anywhere, "a.png", true, false);
BENCHMARK_CAPTURE(lookup, floats_kept_near, "a.exr", true, true);
BENCHMARK_CAPTURE(lookup, floats_kept_anywhere, "a.exr", true, false);
BENCHMARK_CAPTURE(lookup, bytes_cached_near, "a.png", false, true);
BENCHMARK_CAPTURE(lookup, bytes_cached_anywhere, "a.png", false, false);
BENCHMARK_CAPTURE(lookup, floats_cached_near, "a.exr", false, true);
BENCHMARK_CAPTURE(lookup, floats_cached_anywhere, "a.exr", false, false);

}  // namespace
