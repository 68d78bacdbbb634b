// Eight lanes of floats for code that is written with Highway: Highway's own vectors where the processor has
// 256 bits, otherwise (arm64) arrays of eight with the few operations that lights/field_pyramid.cpp needs.
// Both compute every lane alike, so that results have the same bits. Calls are unqualified: the argument's
// namespace selects the function.
#pragma once

#define HWY_COMPILE_ONLY_STATIC 1  // for the build's own instruction set
#if !defined(__AES__)              // x86-64-v3 lacks AES, which Highway counts as part of AVX2
#define HWY_DISABLE_PCLMUL_AES 1
#endif
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace lucerna {

namespace hn = hwy::HWY_NAMESPACE;

// Four lanes are 128 bits, which every processor has.
using D4 = hn::FixedTag<float, 4>;
using I4 = hn::RebindToSigned<D4>;
using F4 = hn::Vec<D4>;

#if HWY_MAX_BYTES >= 32

using D8 = hn::FixedTag<float, 8>;
using I8 = hn::RebindToSigned<D8>;
using F8 = hn::Vec<D8>;
using N8 = hn::Vec<I8>;
using M8 = hn::Mask<D8>;

#else

namespace narrow {

template <typename T>
struct Eight {
    alignas(16) T at[8];
};
using F8 = Eight<float>;
using N8 = Eight<std::int32_t>;
using M8 = Eight<bool>;
struct D8 {};  // tags, as Highway's functions take them
struct I8 {};

template <typename T, typename Lane>
Eight<T> each(Lane&& lane) {
    Eight<T> result;
    for (std::size_t i = 0; i < 8; ++i) result.at[i] = lane(i);
    return result;
}

inline F8 operator+(const F8& a, const F8& b) {
    return each<float>([&](std::size_t i) { return a.at[i] + b.at[i]; });
}
inline F8 operator-(const F8& a, const F8& b) {
    return each<float>([&](std::size_t i) { return a.at[i] - b.at[i]; });
}
inline F8 operator*(const F8& a, const F8& b) {
    return each<float>([&](std::size_t i) { return a.at[i] * b.at[i]; });
}
inline F8 operator/(const F8& a, const F8& b) {
    return each<float>([&](std::size_t i) { return a.at[i] / b.at[i]; });
}
inline N8 operator+(const N8& a, const N8& b) {
    return each<std::int32_t>([&](std::size_t i) { return a.at[i] + b.at[i]; });
}
inline N8 operator-(const N8& a, const N8& b) {
    return each<std::int32_t>([&](std::size_t i) { return a.at[i] - b.at[i]; });
}
inline M8 operator<=(const F8& a, const F8& b) {
    return each<bool>([&](std::size_t i) { return a.at[i] <= b.at[i]; });
}
inline M8 operator<(const N8& a, const N8& b) {
    return each<bool>([&](std::size_t i) { return a.at[i] < b.at[i]; });
}
inline F8 Set(D8 /*tag*/, float x) {
    return each<float>([&](std::size_t) { return x; });
}
inline N8 Set(I8 /*tag*/, std::int32_t x) {
    return each<std::int32_t>([&](std::size_t) { return x; });
}
inline F8 Zero(D8 tag) {
    return Set(tag, 0.0F);
}
inline N8 Zero(I8 tag) {
    return Set(tag, 0);
}
inline F8 Iota(D8 /*tag*/, float first) {
    return each<float>([&](std::size_t i) { return first + static_cast<float>(i); });
}
inline F8 Load(D8 /*tag*/, const float* from) {
    return each<float>([&](std::size_t i) { return from[i]; });
}
inline F8 MaskedLoad(const M8& mask, D8 /*tag*/, const float* from) {
    return each<float>([&](std::size_t i) { return mask.at[i] ? from[i] : 0.0F; });
}
template <typename T, typename Tag>
void Store(const Eight<T>& lanes, Tag /*tag*/, T* to) {
    std::copy_n(lanes.at, 8, to);
}
template <typename T>
Eight<T> Min(const Eight<T>& a, const Eight<T>& b) {
    return each<T>([&](std::size_t i) { return std::min(a.at[i], b.at[i]); });
}
template <typename T>
Eight<T> Max(const Eight<T>& a, const Eight<T>& b) {
    return each<T>([&](std::size_t i) { return std::max(a.at[i], b.at[i]); });
}
inline F8 Sqrt(const F8& a) {
    return each<float>([&](std::size_t i) { return std::sqrt(a.at[i]); });
}
inline F8 Floor(const F8& a) {
    return each<float>([&](std::size_t i) { return std::floor(a.at[i]); });
}
inline N8 ConvertTo(I8 /*tag*/, const F8& a) {
    return each<std::int32_t>([&](std::size_t i) { return static_cast<std::int32_t>(a.at[i]); });
}
inline M8 RebindMask(D8 /*tag*/, const M8& mask) {
    return mask;
}
inline M8 FirstN(D8 /*tag*/, std::size_t n) {
    return each<bool>([&](std::size_t i) { return i < n; });
}
inline M8 And(const M8& a, const M8& b) {
    return each<bool>([&](std::size_t i) { return a.at[i] && b.at[i]; });
}
inline M8 AndNot(const M8& a, const M8& b) {
    return each<bool>([&](std::size_t i) { return !a.at[i] && b.at[i]; });
}
inline std::size_t CountTrue(D8 /*tag*/, const M8& mask) {
    return static_cast<std::size_t>(std::count(mask.at, mask.at + 8, true));
}
inline F8 IfThenElse(const M8& mask, const F8& a, const F8& b) {
    return each<float>([&](std::size_t i) { return mask.at[i] ? a.at[i] : b.at[i]; });
}
inline F8 IfThenElseZero(const M8& mask, const F8& a) {
    return each<float>([&](std::size_t i) { return mask.at[i] ? a.at[i] : 0.0F; });
}
inline N8 IndicesFromVec(D8 /*tag*/, const N8& indices) {
    return indices;
}
inline F8 TableLookupLanes(const F8& a, const N8& indices) {
    return each<float>([&](std::size_t i) { return a.at[indices.at[i]]; });
}
// Like Highway's, these functions act on each half by itself.
template <int kLanes>
F8 ShiftLeftLanes(D8 /*tag*/, const F8& a) {
    return each<float>([&](std::size_t i) { return i % 4 < kLanes ? 0.0F : a.at[i - kLanes]; });
}
inline F8 Shuffle2301(const F8& a) {
    return each<float>([&](std::size_t i) { return a.at[i ^ 1U]; });
}
inline F8 Shuffle1032(const F8& a) {
    return each<float>([&](std::size_t i) { return a.at[i ^ 2U]; });
}
inline F4 LowerHalf(const F8& a) {
    return hn::Load(D4(), a.at);
}
inline F4 UpperHalf(D4 /*tag*/, const F8& a) {
    return hn::Load(D4(), a.at + 4);
}
inline F8 Combine(D8 /*tag*/, F4 upper, F4 lower) {
    F8 result;
    hn::Store(lower, D4(), result.at);
    hn::Store(upper, D4(), result.at + 4);
    return result;
}
inline float GetLane(const F8& a) {
    return a.at[0];
}

}  // namespace narrow

using narrow::D8;
using narrow::F8;
using narrow::I8;
using narrow::M8;
using narrow::N8;

#endif

}  // namespace lucerna
