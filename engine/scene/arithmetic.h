// What the bits of a result depend on beside what was asked for: how this program was built, and with which
// of Embree's instruction sets it traces rays.
//
// A portable build (the default) computes the same everywhere: one instruction set for all it compiles, one
// for Embree, libm's functions bound when it is linked, no fused or reordered arithmetic. A native build
// takes what the machine that builds it has, and Embree what the machine that runs it has.
// docs/explanation/portable.md says what is promised and how it is shown.
#pragma once

#include <string>
#include <string_view>

namespace lucerna {

#ifdef LUCERNA_NATIVE
inline constexpr bool kPortableBuild = false;
#else
inline constexpr bool kPortableBuild = true;
#endif

// The instruction set that Embree is told to use: "avx2".
std::string_view embree_isa();

// "portable, x86-64-v3, Embree avx2, g++ 12.2.0". What two programs that say the same have computed may be
// mixed. At most kArithmeticLength characters.
inline constexpr std::size_t kArithmeticLength = 95;
std::string arithmetic();

}  // namespace lucerna
