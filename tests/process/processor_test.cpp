// The message on a processor that lacks an instruction set of the build; tests/startup/processor.sh tests the
// program itself.
#include "engine/cli/main/processor.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "engine/scene/arithmetic.h"

namespace lucerna {
namespace processor_test {

constexpr InstructionSet kSets[] = {{"SSE4.2", kLeaf1Ecx, 20, 0},   {"AVX", kLeaf1Ecx, 28, kYmm},
                                    {"AVX2", kLeaf7Ebx, 5, kYmm},   {"BMI2", kLeaf7Ebx, 8, 0},
                                    {"LZCNT", kExtended1Ecx, 5, 0}, {nullptr, kLeaf1Ecx, 0, 0}};

std::string lacking(const Processor& processor, const InstructionSet* sets = kSets) {
    std::array<char, 300> names{};
    const bool any = lacks(processor, sets, names.data(), names.size());
    EXPECT_EQ(any, names[0] != '\0');
    return names.data();
}

// The processors' CPUID words: SSE4.2, and AVX2 with the other extensions of that generation.
Processor nehalem() {
    Processor processor;
    processor.words[kLeaf1Ecx] = 1U << 20;
    return processor;
}
Processor haswell() {
    Processor processor = nehalem();
    processor.words[kLeaf1Ecx] |= 1U << 28;
    processor.words[kLeaf7Ebx] = 1U << 5 | 1U << 8;
    processor.words[kExtended1Ecx] = 1U << 5;
    processor.kept = 0x7;
    return processor;
}

TEST(Processor, WithAll_LacksNothing) {
    EXPECT_EQ(lacking(haswell()), "");
    EXPECT_EQ(lacking(this_processor(), kCompiledFor), "") << "this program runs";
}

TEST(Processor, OfEarlierKind_LacksWhatItDoesNotTellOf) {
    EXPECT_EQ(lacking(nehalem()), "AVX, AVX2, BMI2, LZCNT");
    Processor hidden = haswell();  // a virtual machine may hide any of them
    hidden.words[kLeaf7Ebx] ^= 1U << 8;
    EXPECT_EQ(lacking(hidden), "BMI2");
}

TEST(Processor, WhoseSystemKeepsNoWideRegisters_LacksWhatNeedsThem) {
    Processor processor = haswell();
    processor.kept = 0x3;
    EXPECT_EQ(lacking(processor), "AVX, AVX2");
    const InstructionSet wide[] = {{"AVX512F", kLeaf7Ebx, 5, kZmm}, {nullptr, kLeaf1Ecx, 0, 0}};
    processor.kept = 0x7;
    EXPECT_EQ(lacking(processor, wide), "AVX512F");
    processor.kept = 0xe7;
    EXPECT_EQ(lacking(processor, wide), "");
}

TEST(Processor, NamesBeyondTheirRoom_AreCutOff) {
    std::array<char, 8> names{};
    names.fill('x');
    EXPECT_TRUE(lacks(nehalem(), kSets, names.data(), names.size()));
    EXPECT_STREQ(names.data(), "AVX, AV");
}

TEST(Processor, OfAPortableBuild_IsAskedForX86_64V3) {
    if (!kPortableBuild) GTEST_SKIP() << "what the machine that builds has";
    const std::string names = lacking(Processor{}, kCompiledFor);
    for (const char* set :
         {"SSE3", "SSE4.2", "POPCNT", "AVX", "AVX2", "FMA", "F16C", "BMI1", "BMI2", "LZCNT", "MOVBE"})
        EXPECT_NE((", " + names + ",").find(std::string(", ") + set + ","), std::string::npos) << set;
    EXPECT_EQ(names.find("AVX512"), std::string::npos);
}

}  // namespace processor_test
}  // namespace lucerna
