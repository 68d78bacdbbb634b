#include "lights/measurement/acquire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>

#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/impatient_monitor.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace acquire_part_test {

using testing::error_of;
using ::testing::HasSubstr;
using testing::ImpatientMonitor;

class AcquirePartTest : public ::testing::Test {
  protected:
    std::uint64_t acquired(const Rig& rig, AcquirePart* part, Monitor& monitor, int threads = 2) {
        AcquireOptions options;
        options.s_nodes = options.m_nodes = 2;
        options.part = part;
        return content_hash(acquire(emitter_, rig, {threads}, monitor, options));
    }
    EmitterModel emitter_ = cosine_emitter(EmitterModel::Outline::disc, {0.012, 0}, 2, 3);
    testing::TemporaryFolder folder_;
    std::filesystem::path file_ = folder_.path() / "lamp.exr.part";
    Monitor silent_;
};

TEST_F(AcquirePartTest, StoppedWork_TakenUpAgain_GivesTheSameBytes) {
    for (const Rig& rig : {testing::rig_a(), testing::rig_b()}) {
        const std::uint64_t whole = acquired(rig, nullptr, silent_);
        std::filesystem::remove(file_);
        std::size_t columns = 0;
        for (int tries = 0; tries < 2; ++tries) {
            AcquirePart part(file_, 5);
            EXPECT_EQ(part.columns(), columns);
            ImpatientMonitor impatient(columns + 1);
            EXPECT_THAT(error_of([&] { acquired(rig, &part, impatient, 1); }), HasSubstr("stopped"));
            ++columns;
        }
        AcquirePart part(file_, 5);
        EXPECT_EQ(part.columns(), columns);
        EXPECT_EQ(acquired(rig, &part, silent_), whole);
        AcquirePart complete(file_, 5);
        EXPECT_EQ(acquired(rig, &complete, silent_), whole);
    }
}

TEST_F(AcquirePartTest, EndCutOffOrDamaged_IsDoneAnew) {
    const Rig rig = testing::rig_b();
    const std::uint64_t whole = acquired(rig, nullptr, silent_);
    {
        AcquirePart part(file_, 5);
        acquired(rig, &part, silent_);
    }
    const std::size_t all = AcquirePart(file_, 5).columns();
    const auto size = std::filesystem::file_size(file_);
    std::filesystem::resize_file(file_, size - 3);
    {
        AcquirePart part(file_, 5);
        EXPECT_EQ(part.columns(), all - 1);
        EXPECT_EQ(acquired(rig, &part, silent_), whole);
    }
    {  // A changed number in the middle: this record and all that follow are discarded.
        std::fstream damage(file_, std::ios::binary | std::ios::in | std::ios::out);
        damage.seekp(static_cast<std::streamoff>(size / 2));
        damage.put('\x55').put('\x2a').put('\x55');
    }
    AcquirePart part(file_, 5);
    EXPECT_LT(part.columns(), all);
    EXPECT_EQ(acquired(rig, &part, silent_), whole);
}

TEST_F(AcquirePartTest, OtherWorkOrOtherFile_IsRefused) {
    {
        AcquirePart part(file_, 5);
        part.keep(0, std::vector<float>{1, 2, 3});
    }
    EXPECT_THAT(error_of([&] { AcquirePart(file_, 6); }), HasSubstr("another description"));
    EXPECT_EQ(AcquirePart(file_, 5).columns(), 1U);
    std::ofstream(file_) << "my diary, long enough to be a header";
    EXPECT_THAT(error_of([&] { AcquirePart(file_, 5); }), HasSubstr("not an unfinished acquisition"));
    EXPECT_THAT(error_of([&] { AcquirePart(folder_.path() / "none" / "x.part", 5); }), HasSubstr("x.part"));
}

// A record that claims more than the file holds must be discarded before memory is allocated for it.
TEST_F(AcquirePartTest, LyingCount_TakesNoMemory) {
    { AcquirePart part(file_, 5); }
    const std::uint64_t record[3] = {0, std::uint64_t{1} << 60, 0};
    std::ofstream(file_, std::ios::binary | std::ios::app)
        .write(reinterpret_cast<const char*>(record), sizeof(record));
    EXPECT_EQ(AcquirePart(file_, 5).columns(), 0U);
}

}  // namespace acquire_part_test
}  // namespace lucerna
