// A thousand corrupt files for every reader, beyond its fuzzer's findings: each is read or refused in one
// line, and none crashes, hangs or exhausts memory [docs/development/extremes.md]. The entries are the
// fuzzers' own (tests/fuzz/NAME_fuzz.cpp), the valid files their corpus.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "tests/fuzz/input.h"
#include "tests/mutations/mutation.h"
#include "tests/mutations/readers.h"
#include "tests/mutations/trial.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace mutations_test {

using namespace testing;
using ::testing::HasSubstr;

std::filesystem::path corpus_of(const std::string& reader) {
    return std::filesystem::path(LUCERNA_SOURCE_DIR) / "tests/fuzz/corpus" / reader;
}

// Returns the files in an order that is the same on every machine.
std::vector<std::string> whole_files(const std::string& reader) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(corpus_of(reader)))
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<std::string> all;
    for (const std::filesystem::path& file : files) {
        std::ostringstream text;
        text << std::ifstream(file, std::ios::binary).rdbuf();
        all.push_back(text.str());
    }
    return all;
}

class Mutated : public ::testing::TestWithParam<Reader> {};

TEST_P(Mutated, AThousandInputs_AreReadOrRefused) {
    const TemporaryFolder folder;
    const Reader& reader = GetParam();
    const Mutation mutation(whole_files(reader.name));
    const auto read = [&](const std::string& input) {
        reader.read(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
    };
    const TrialOutcome outcome = try_inputs(
        read, [&](std::uint64_t i) { return mutation.input(i); }, folder.path());
    EXPECT_EQ(outcome.done, 1000U);
    if (!outcome.finding.empty()) {
        const std::filesystem::path file =
            "mutation-" + std::string(reader.name) + "-" + std::to_string(outcome.done);
        std::ofstream(file, std::ios::binary) << mutation.input(outcome.done);
        ADD_FAILURE() << reader.name << ", input " << outcome.done << " (" << Mutation::name(outcome.done)
                      << "), kept as " << std::filesystem::absolute(file) << ": " << outcome.finding;
    }
}

// Unmodified corpus files, some of which are invalid, must also be harmless.
TEST_P(Mutated, UntouchedInputs_AreReadOrRefused) {
    const TemporaryFolder folder;
    const std::vector<std::string> whole = whole_files(GetParam().name);
    ASSERT_FALSE(whole.empty());
    TrialLimits limits;
    limits.inputs = whole.size();
    const TrialOutcome outcome = try_inputs(
        [&](const std::string& input) {
            GetParam().read(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
        },
        [&](std::uint64_t i) { return whole[i]; }, folder.path(), limits);
    EXPECT_EQ(outcome.finding, "");
}

INSTANTIATE_TEST_SUITE_P(Readers, Mutated, ::testing::ValuesIn(every_reader()),
                         [](const auto& test) { return std::string(test.param.name); });

// Every fuzzer must have a reader here.
TEST(Mutations, EveryFuzzer_IsAReaderOnTrial) {
    std::vector<std::string> fuzzers, readers;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(LUCERNA_SOURCE_DIR) / "tests/fuzz")) {
        const std::string name = entry.path().filename().string();
        if (const std::size_t end = name.find("_fuzz.cpp"); end != std::string::npos)
            fuzzers.push_back(name.substr(0, end));
    }
    for (const Reader& reader : every_reader()) readers.emplace_back(reader.name);
    EXPECT_THAT(readers, ::testing::UnorderedElementsAreArray(fuzzers));
}

TEST(Mutations, SameNumber_SameInput_AndNextToNoneIsWhole) {
    const std::vector<std::string> whole = whole_files("ply");
    const Mutation one(whole), same(whole), other(whole, 2);
    int untouched = 0, different = 0;
    for (std::uint64_t i = 0; i < 1000; ++i) {
        const std::string input = one.input(i);
        EXPECT_EQ(input, same.input(i));
        different += input != other.input(i);
        untouched += std::find(whole.begin(), whole.end(), input) != whole.end();
    }
    EXPECT_GT(different, 900);
    EXPECT_LT(untouched, 150);
}

// --- the trial itself: readers with faults that it must find ---

// The faults of such readers.
enum class Fault : std::uint8_t {
    none,
    believes_the_count,
    overruns,
    never_ends,
    throws_another,
    talks,
    recurses
};

// Reads a count, then that number of bytes.
class FaultyReader {
  public:
    explicit FaultyReader(Fault fault) : fault_(fault) {}

    void operator()(const std::string& input) const {
        std::uint32_t count = 0;
        std::memcpy(&count, input.data(), std::min<std::size_t>(4, input.size()));
        const bool lies = count > input.size();
        if (fault_ == Fault::believes_the_count) {
            const std::vector<char> bytes(count, 1);
            require(bytes.size() == count, "?");
        }
        if (fault_ == Fault::overruns && lies) {
            int sum = 0;
            for (std::uint32_t i = 0; i < count; ++i) sum += static_cast<volatile const char*>(nowhere_)[i];
            require(sum >= 0, "?");
        }
        volatile bool waits = fault_ == Fault::never_ends && count == 0;
        while (waits) continue;
        if (fault_ == Fault::throws_another && lies) throw std::out_of_range("no such byte");
        if (fault_ == Fault::recurses) require(depth_of(input, 0) <= input.size(), "?");
        if (fault_ == Fault::talks && lies) require_one_line(InputError("a count\nthat lies"));
    }

  private:
    // Counts the open brackets by one recursive call for each.
    static std::size_t depth_of(const std::string& input, std::size_t at) {
        volatile char frame[256] = {};
        at = input.find('[', at);
        return at == input.npos ? 0 : 1 + depth_of(input, at + 1) + static_cast<std::size_t>(frame[at % 256]);
    }

    Fault fault_;
    const char* nowhere_ = nullptr;
};

TrialOutcome trial_of(Fault fault) {
    const TemporaryFolder folder;
    std::string whole(20, 'x');
    whole += "[1]";
    whole.replace(0, 4, std::string("\x10\0\0\0", 4));
    const Mutation mutation({whole});
    TrialLimits limits;
    limits.seconds_each = 1;
    limits.memory_at_once = std::size_t{64} << 20;
    return try_inputs(
        FaultyReader(fault), [&](std::uint64_t i) { return mutation.input(i); }, folder.path(), limits);
}

TEST(Trial, SoundReader_Passes) {
    const TrialOutcome outcome = trial_of(Fault::none);
    EXPECT_EQ(outcome.finding, "");
    EXPECT_EQ(outcome.done, 1000U);
}

TEST(Trial, ReaderThatCrashes_IsFound) {
    EXPECT_THAT(trial_of(Fault::overruns).finding, HasSubstr(kSanitized ? "left with" : "ended by"));
}

TEST(Trial, ReaderThatBelievesACount_IsFound) {
    if (kSanitized) GTEST_SKIP() << "sanitizers allocate by themselves";
    EXPECT_THAT(trial_of(Fault::believes_the_count).finding, HasSubstr("too much memory"));
}

TEST(Trial, ReaderThatHangs_IsFound) {
    EXPECT_EQ(trial_of(Fault::never_ends).finding, "hangs");
}

TEST(Trial, ReaderThatRecursesOncePerBracket_IsFound) {
    EXPECT_THAT(trial_of(Fault::recurses).finding, HasSubstr(kSanitized ? "left with" : "ended by"));
}

TEST(Trial, ReaderWithAnotherException_IsFound) {
    EXPECT_THAT(trial_of(Fault::throws_another).finding, HasSubstr("no such byte"));
}

TEST(Trial, RefusalOfTwoLines_IsFound) {
    EXPECT_THAT(trial_of(Fault::talks).finding, HasSubstr("not one line"));
}

}  // namespace mutations_test
}  // namespace lucerna
