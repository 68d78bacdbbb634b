// Describes what determines the bits of a result beside the input: how the program was built, and which
// version of Embree traces rays with which instruction set.
//
// A portable build (the default) computes the same on every machine of its architecture that has the same
// major version of Embree: it has one instruction set for compiled code and one for Embree, elementary
// functions of its own (engine/base/elementary.h), and no fused or reordered arithmetic. A native build uses
// the instruction set of the machine that builds it, and Embree that of the machine that runs it.
// docs/explanation/portable.md says what is promised and how it is verified.
#pragma once

#include <string>
#include <string_view>

namespace lucerna {

#ifdef LUCERNA_NATIVE
inline constexpr bool kPortableBuild = false;
#else
inline constexpr bool kPortableBuild = true;
#endif

// Returns the instruction set that Embree is told to use: "avx2" in a portable build for x86-64, and "" on
// other processors, for which Embree has only one.
std::string_view embree_isa();

// Returns e.g. "portable, x86-64-v3, Embree 3 avx2, g++ 12.2.0", at most kArithmeticLength characters.
// Results of programs with equal strings may be mixed.
inline constexpr std::size_t kArithmeticLength = 95;
std::string arithmetic();

}  // namespace lucerna
