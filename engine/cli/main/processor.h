// Checks that the processor has the instructions that the program is compiled to use. Without them the
// program would end with SIGILL and no message.
//
// processor.cpp is compiled for baseline x86-64. Its check runs before any other code of the program, also
// before the initialisers of other files' globals and of shared libraries.
#pragma once

#include <cstddef>
#include <cstdint>

namespace lucerna {

// Registers of CPUID that state instruction sets.
enum CpuidWord { kLeaf1Ecx, kLeaf7Ebx, kLeaf7Ecx, kLeaf7Edx, kLeaf7Part1Eax, kExtended1Ecx, kCpuidWords };

// CPUID and the state that the operating system saves.
struct Processor {
    std::uint32_t words[kCpuidWords] = {};
    std::uint64_t kept = 0;  // registers that the system saves (XCR0)
};
inline constexpr std::uint64_t kYmm = 0x6,
                               kZmm = 0xe6;  // bits of XCR0 that 256 and 512 bit instructions need

struct InstructionSet {
    const char* name;
    CpuidWord word;
    int bit;
    std::uint64_t kept;
};

// The sets that the compiler was told to use, ending with a null name.
extern const InstructionSet kCompiledFor[];
// Advice for a missing set, the end of a sentence.
extern const char* const kUnfitAdvice;

Processor this_processor();

// Writes the names of the sets that `processor` lacks, separated by commas, into `names` of `size` bytes,
// truncated and null-terminated. Returns false if it lacks none.
bool lacks(const Processor& processor, const InstructionSet* sets, char* names, std::size_t size);

}  // namespace lucerna
