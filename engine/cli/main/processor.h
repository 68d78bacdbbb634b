// Whether the processor has the instructions that the program is compiled to use; without them it would end
// with SIGILL, and no word, at the first of them that it meets.
//
// processor.cpp is compiled for the first of all x86-64 and looks before any other code of the program runs,
// also before what initialises other files' globals and shared libraries.
#pragma once

#include <cstddef>
#include <cstdint>

namespace lucerna {

// Words of CPUID that tell of instruction sets.
enum CpuidWord { kLeaf1Ecx, kLeaf7Ebx, kLeaf7Ecx, kLeaf7Edx, kLeaf7Part1Eax, kExtended1Ecx, kCpuidWords };

// What a processor, and the system that runs on it, say of themselves.
struct Processor {
    std::uint32_t words[kCpuidWords] = {};
    std::uint64_t kept = 0;  // registers that the system saves (XCR0)
};
inline constexpr std::uint64_t kYmm = 0x6,
                               kZmm = 0xe6;  // of XCR0: what instructions on 256 and 512 bits need

struct InstructionSet {
    const char* name;
    CpuidWord word;
    int bit;
    std::uint64_t kept;
};

// Those that the compiler was told to use; ends with a name that is null.
extern const InstructionSet kCompiledFor[];
// What to do where one is missing: the end of a sentence.
extern const char* const kUnfitAdvice;

Processor this_processor();

// Writes the names of the sets that `processor` lacks, with commas between, into `names` of `size` bytes, as
// many as it holds, and a null. False: it lacks none.
bool lacks(const Processor& processor, const InstructionSet* sets, char* names, std::size_t size);

}  // namespace lucerna
