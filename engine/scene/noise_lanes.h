// Evaluates eight octaves of Perlin noise at once on processors that can look up 64 bytes in a table of 256
// in one step (AVX-512 VBMI). It serves texture_noise.cpp.
//
// The arithmetic is that of the scalar code, in the same order and without fused steps, so that both give the
// same bits. A portable build can therefore choose at run time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/base/vec.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define LUCERNA_NOISE_LANES 1
#include <immintrin.h>
#else
#define LUCERNA_NOISE_LANES 0
#endif

namespace lucerna {

inline constexpr std::size_t kNoiseLanes = 8;

// Beyond this coordinate the vector code's search of the cell loses fractions.
inline constexpr double kLanesReach = 0x1p50;

#if LUCERNA_NOISE_LANES

// Tells whether noise_lanes() may be called.
inline bool has_noise_lanes() {
    static const bool has = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                            __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
                            __builtin_cpu_supports("avx512vbmi");
    return has;
}

// All functions from here to the end of the region are compiled for that processor, whatever the build's
// target is. Other code calls only noise_lanes().
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512bw,avx512vl,avx512vbmi"))), \
                             apply_to = function)
#else
#pragma GCC diagnostic push  // for intrinsics' deliberately undefined registers
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512bw,avx512vl,avx512vbmi")
#endif

// Holds Perlin's permutation and the components of the sixteen gradients in registers.
class NoiseLanes {
  public:
    NoiseLanes(const std::array<std::uint8_t, 256>& permutation,
               const std::array<std::array<double, 16>, 3>& gradients) {
        for (std::size_t i = 0; i < 4; ++i) permutation_[i] = _mm512_loadu_si512(&permutation[64 * i]);
        for (std::size_t c = 0; c < 3; ++c) {
            gradients_[c][0] = _mm512_loadu_pd(&gradients[c][0]);
            gradients_[c][1] = _mm512_loadu_pd(&gradients[c][8]);
        }
    }

    // Evaluates the noise at p times each of the eight frequencies; all products must be within kLanesReach.
    void at(double px, double py, double pz, const double* frequencies, double* out) const {
        const __m512d f = _mm512_loadu_pd(frequencies);
        const auto along = [&](double coordinate) {
            return Axis(_mm512_mul_pd(f, _mm512_set1_pd(coordinate)));
        };
        at(along(px), along(py), along(pz), out);
    }
    // Evaluates the noise at eight places, which must be within kLanesReach.
    void at(const double* px, const double* py, const double* pz, double* out) const {
        const auto along = [](const double* coordinates) { return Axis(_mm512_loadu_pd(coordinates)); };
        at(along(px), along(py), along(pz), out);
    }

  private:
    struct Axis {
        __m512d within, weight;
        __m128i cell;  // modulo 256, one byte per lane

        explicit Axis(__m512d x) {
            const __m512d floor = _mm512_roundscale_pd(x, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
            within = _mm512_sub_pd(x, floor);
            const __m512d t = within;
            const __m512d inner = _mm512_add_pd(
                _mm512_mul_pd(t, _mm512_sub_pd(_mm512_mul_pd(t, _mm512_set1_pd(6)), _mm512_set1_pd(15))),
                _mm512_set1_pd(10));
            weight = _mm512_mul_pd(_mm512_mul_pd(_mm512_mul_pd(t, t), t), inner);
            cell = _mm512_cvtepi64_epi8(_mm512_cvtpd_epi64(floor));  // takes the lowest byte
        }
    };

    void at(const Axis& x, const Axis& y, const Axis& z, double* out) const {
        const __m512i hash = hash_corners(x.cell, y.cell, z.cell);
        // The corners are in the order of hash_corners: x first, then y, then z.
        const __m512d one = _mm512_set1_pd(1);
        const __m512d x1 = _mm512_sub_pd(x.within, one), y1 = _mm512_sub_pd(y.within, one),
                      z1 = _mm512_sub_pd(z.within, one);
        const __m256i below = _mm512_castsi512_si256(hash), above = _mm512_extracti64x4_epi64(hash, 1);
        const auto along_x = [&](__m128i pair, __m512d ry, __m512d rz) {
            return between(x.weight, gradient(pair, x.within, ry, rz),
                           gradient(_mm_unpackhi_epi64(pair, pair), x1, ry, rz));
        };
        const auto plane = [&](__m256i four, __m512d rz) {
            return between(y.weight, along_x(_mm256_castsi256_si128(four), y.within, rz),
                           along_x(_mm256_extracti128_si256(four, 1), y1, rz));
        };
        _mm512_storeu_pd(out, between(z.weight, plane(below, z.within), plane(above, z1)));
    }

    static __m512d between(__m512d t, __m512d a, __m512d b) {
        return _mm512_add_pd(a, _mm512_mul_pd(t, _mm512_sub_pd(b, a)));
    }

    __m512i look_up(__m512i index) const {
        const __m512i low = _mm512_permutex2var_epi8(permutation_[0], index, permutation_[1]);
        const __m512i high = _mm512_permutex2var_epi8(permutation_[2], index, permutation_[3]);
        return _mm512_mask_blend_epi8(_mm512_movepi8_mask(index), low, high);
    }

    // Returns one byte per lane for each of the cell's eight corners. Byte arithmetic wraps with the period.
    __m512i hash_corners(__m128i x, __m128i y, __m128i z) const {
        const __m128i one = _mm_set1_epi8(1);
        const __m128i by_x = _mm512_castsi512_si128(
            look_up(_mm512_castsi128_si512(_mm_unpacklo_epi64(x, _mm_add_epi8(x, one)))));
        const __m128i y0 = _mm_unpacklo_epi64(y, y);
        const __m256i of_y =
            _mm256_set_m128i(_mm_add_epi8(by_x, _mm_add_epi8(y0, one)), _mm_add_epi8(by_x, y0));
        const __m256i by_xy = _mm512_castsi512_si256(look_up(_mm512_castsi256_si512(of_y)));
        const __m256i of_z = _mm256_add_epi8(by_xy, _mm256_broadcastq_epi64(z));
        const __m256i of_z1 = _mm256_add_epi8(of_z, _mm256_set1_epi8(1));
        return look_up(_mm512_inserti64x4(_mm512_castsi256_si512(of_z), of_z1, 1));
    }

    // Returns the gradient's product with the offset, by four bits of each of the first eight bytes of
    // `hash`.
    __m512d gradient(__m128i hash, __m512d dx, __m512d dy, __m512d dz) const {
        const __m512i index = _mm512_cvtepu8_epi64(hash);
        const auto component = [&](std::size_t c) {
            return _mm512_permutex2var_pd(gradients_[c][0], index, gradients_[c][1]);
        };
        return _mm512_add_pd(_mm512_add_pd(_mm512_mul_pd(component(0), dx), _mm512_mul_pd(component(1), dy)),
                             _mm512_mul_pd(component(2), dz));
    }

    __m512i permutation_[4];
    __m512d gradients_[3][2];
};

inline void noise_lanes(const std::array<std::uint8_t, 256>& permutation,
                        const std::array<std::array<double, 16>, 3>& gradients, const V3d& p,
                        const double* frequencies, double* out) {
    NoiseLanes(permutation, gradients).at(p.x, p.y, p.z, frequencies, out);
}
inline void noise_lanes(const std::array<std::uint8_t, 256>& permutation,
                        const std::array<std::array<double, 16>, 3>& gradients, const double* x,
                        const double* y, const double* z, double* out) {
    NoiseLanes(permutation, gradients).at(x, y, z, out);
}

#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#pragma GCC diagnostic pop
#endif

#endif

}  // namespace lucerna
