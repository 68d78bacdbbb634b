// Compiled with the options of the whole program, so that the compiler's macros state them. It contains only
// numbers and text, because they are read before it is known that the processor can run code of this file.
#include "engine/cli/main/processor.h"

namespace lucerna {

constinit const InstructionSet kCompiledFor[] = {
#ifdef __SSE3__
    {"SSE3", kLeaf1Ecx, 0, 0},
#endif
#ifdef __SSSE3__
    {"SSSE3", kLeaf1Ecx, 9, 0},
#endif
#ifdef __SSE4_1__
    {"SSE4.1", kLeaf1Ecx, 19, 0},
#endif
#ifdef __SSE4_2__
    {"SSE4.2", kLeaf1Ecx, 20, 0},
#endif
#ifdef __POPCNT__
    {"POPCNT", kLeaf1Ecx, 23, 0},
#endif
#ifdef __GCC_HAVE_SYNC_COMPARE_AND_SWAP_16
    {"CMPXCHG16B", kLeaf1Ecx, 13, 0},
#endif
#ifdef __LAHF_SAHF__
    {"LAHF-SAHF", kExtended1Ecx, 0, 0},
#endif
#ifdef __AVX__
    {"AVX", kLeaf1Ecx, 28, kYmm},
#endif
#ifdef __AVX2__
    {"AVX2", kLeaf7Ebx, 5, kYmm},
#endif
#ifdef __FMA__
    {"FMA", kLeaf1Ecx, 12, kYmm},
#endif
#ifdef __F16C__
    {"F16C", kLeaf1Ecx, 29, kYmm},
#endif
#ifdef __BMI__
    {"BMI1", kLeaf7Ebx, 3, 0},
#endif
#ifdef __BMI2__
    {"BMI2", kLeaf7Ebx, 8, 0},
#endif
#ifdef __LZCNT__
    {"LZCNT", kExtended1Ecx, 5, 0},
#endif
#ifdef __MOVBE__
    {"MOVBE", kLeaf1Ecx, 22, 0},
#endif
// A native build may also use these sets beyond x86-64-v3.
#ifdef __SSE4A__
    {"SSE4A", kExtended1Ecx, 6, 0},
#endif
#ifdef __XOP__
    {"XOP", kExtended1Ecx, 11, kYmm},
#endif
#ifdef __FMA4__
    {"FMA4", kExtended1Ecx, 16, kYmm},
#endif
#ifdef __TBM__
    {"TBM", kExtended1Ecx, 21, 0},
#endif
#ifdef __GFNI__
    {"GFNI", kLeaf7Ecx, 8, 0},
#endif
#ifdef __AVXVNNI__
    {"AVX-VNNI", kLeaf7Part1Eax, 4, kYmm},
#endif
#ifdef __AVX512F__
    {"AVX512F", kLeaf7Ebx, 16, kZmm},
#endif
#ifdef __AVX512DQ__
    {"AVX512DQ", kLeaf7Ebx, 17, kZmm},
#endif
#ifdef __AVX512IFMA__
    {"AVX512-IFMA", kLeaf7Ebx, 21, kZmm},
#endif
#ifdef __AVX512CD__
    {"AVX512CD", kLeaf7Ebx, 28, kZmm},
#endif
#ifdef __AVX512BW__
    {"AVX512BW", kLeaf7Ebx, 30, kZmm},
#endif
#ifdef __AVX512VL__
    {"AVX512VL", kLeaf7Ebx, 31, kZmm},
#endif
#ifdef __AVX512VBMI__
    {"AVX512-VBMI", kLeaf7Ecx, 1, kZmm},
#endif
#ifdef __AVX512VBMI2__
    {"AVX512-VBMI2", kLeaf7Ecx, 6, kZmm},
#endif
#ifdef __AVX512VNNI__
    {"AVX512-VNNI", kLeaf7Ecx, 11, kZmm},
#endif
#ifdef __AVX512BITALG__
    {"AVX512-BITALG", kLeaf7Ecx, 12, kZmm},
#endif
#ifdef __AVX512VPOPCNTDQ__
    {"AVX512-VPOPCNTDQ", kLeaf7Ecx, 14, kZmm},
#endif
#ifdef __AVX512FP16__
    {"AVX512-FP16", kLeaf7Edx, 23, kZmm},
#endif
#ifdef __AVX512BF16__
    {"AVX512-BF16", kLeaf7Part1Eax, 5, kZmm},
#endif
    {nullptr, kLeaf1Ecx, 0, 0},
};

#ifdef LUCERNA_NATIVE
constinit const char* const kUnfitAdvice =
    "this native build only runs on machines like the one it was built on; build it on this machine "
    "(docs/explanation/portable.md)";
#else
constinit const char* const kUnfitAdvice =
    "the portable build needs x86-64-v3; build for this machine with -DLUCERNA_NATIVE=ON "
    "(docs/explanation/portable.md)";
#endif

}  // namespace lucerna
