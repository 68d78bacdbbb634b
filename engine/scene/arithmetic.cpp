#include "engine/scene/arithmetic.h"

#include <fmt/format.h>

#include "engine/scene/accelerator.h"

namespace lucerna {
namespace {

// Names the instruction set that the compiler was allowed to use.
constexpr std::string_view compiled_for() {
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512CD__) && defined(__AVX512DQ__) && \
    defined(__AVX512VL__)
    return "x86-64-v4";
#elif defined(__AVX2__) && defined(__FMA__) && defined(__F16C__) && defined(__BMI2__)
    return "x86-64-v3";
#elif defined(__SSE4_2__)
    return "x86-64-v2";
#elif defined(__x86_64__)
    return "x86-64";
#elif defined(__aarch64__)
    return "arm64";
#else
    return "other processor";
#endif
}

#ifdef __clang__
constexpr std::string_view kCompiler = "clang++ " __clang_version__;
#else
constexpr std::string_view kCompiler = "g++ " __VERSION__;
#endif

}  // namespace

std::string_view embree_isa() {
#ifndef __x86_64__
    return "";  // Embree has only one there
#else
    if (kPortableBuild) return "avx2";  // every x86-64-v3 machine has it
    // This is Embree's own order of preference.
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512vl")) {
        return "avx512";
    }
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "avx2";
    if (__builtin_cpu_supports("avx")) return "avx";
    if (__builtin_cpu_supports("sse4.2")) return "sse4.2";
    return "sse2";
#endif
}

std::string arithmetic() {
    const std::string_view isa = embree_isa();
    return fmt::format("{}, {}, Embree {}{}{}, {}", kPortableBuild ? "portable" : "native", compiled_for(),
                       embree_version(), isa.empty() ? "" : " ", isa, kCompiler)
        .substr(0, kArithmeticLength);
}

}  // namespace lucerna
