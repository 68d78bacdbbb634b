// Compiled for baseline x86-64 (CMakeLists.txt), hence without parts of the standard library that could be
// inlined or shared with code that is not.
#include "engine/cli/main/processor.h"

#include <cpuid.h>
#include <string.h>
#include <unistd.h>

namespace lucerna {
namespace {

// The registers of a CPUID leaf; 0 if the processor lacks the leaf.
struct Registers {
    unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
};
Registers cpuid(unsigned leaf, unsigned part) {
    Registers r;
    if (__get_cpuid_count(leaf, part, &r.eax, &r.ebx, &r.ecx, &r.edx) == 0) return {};
    return r;
}

std::uint64_t registers_kept(const Registers& leaf1) {
    constexpr unsigned kXgetbvIsThere = 1U << 27;
    if ((leaf1.ecx & kXgetbvIsThere) == 0) return 0;
    std::uint32_t low = 0, high = 0;
    asm volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return std::uint64_t{high} << 32 | low;
}

void append(const char* text, char* to, std::size_t size) {
    const std::size_t length = strlen(to);
    strncpy(to + length, text, size - 1 - length);
    to[size - 1] = '\0';
}

// Runs before the other initialisers of the program, some of which have instructions that this one looks for.
constexpr int kFirst = 101;  // the numbers below are the compiler's
[[gnu::constructor(kFirst)]] void refuse_unfit_processor() {
    char line[600] = "lucerna: this processor lacks ";
    const std::size_t begun = strlen(line);
    if (!lacks(this_processor(), kCompiledFor, line + begun, 300)) return;
    append("; ", line, sizeof line);
    append(kUnfitAdvice, line, sizeof line);
    append("\n", line, sizeof line);
    const ssize_t none = write(STDERR_FILENO, line, strlen(line));
    static_cast<void>(none);
    _exit(1);
}

}  // namespace

Processor this_processor() {
    const Registers leaf1 = cpuid(1, 0), leaf7 = cpuid(7, 0);
    Processor processor;
    processor.words[kLeaf1Ecx] = leaf1.ecx;
    processor.words[kLeaf7Ebx] = leaf7.ebx;
    processor.words[kLeaf7Ecx] = leaf7.ecx;
    processor.words[kLeaf7Edx] = leaf7.edx;
    if (leaf7.eax >= 1) processor.words[kLeaf7Part1Eax] = cpuid(7, 1).eax;
    processor.words[kExtended1Ecx] = cpuid(0x80000001, 0).ecx;
    processor.kept = registers_kept(leaf1);
    return processor;
}

bool lacks(const Processor& processor, const InstructionSet* sets, char* names, std::size_t size) {
    names[0] = '\0';
    bool any = false;
    for (const InstructionSet* set = sets; set->name != nullptr; ++set) {
        const bool has = (processor.words[set->word] >> set->bit & 1U) != 0;
        const bool is_kept = (processor.kept & set->kept) == set->kept;
        if (has && is_kept) continue;
        if (any) append(", ", names, size);
        append(set->name, names, size);
        any = true;
    }
    return any;
}

}  // namespace lucerna
