// ASAP ray distribution files, record by record.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/lights/ray_bytes.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace asap_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::put;
using testing::rows_of_floats;

// Returns a file of two rays with 1 and 3 units of flux: the records of the header are those of the format's
// description by TechnoTeam.
std::string two_rays(const std::string& columns = "XYZABCF MM") {
    std::string b(140, ' ');
    put(b, 0, std::int32_t{247 + 1024 * 7});
    b.replace(28, 6, "a lamp");
    put(b, 52, std::int32_t{1});
    b.replace(56, 8, "Tot Flux");
    put(b, 64, 0.0F);
    b.replace(68, columns.size(), columns);
    b.replace(84, 10, "Ray number");
    put(b, 100, 1.0F), put(b, 104, 2.0F), put(b, 108, std::int32_t{-2});
    b.replace(112, 10, "Wavelength");
    put(b, 128, 0.0F), put(b, 132, 0.0F), put(b, 136, std::int32_t{1});
    return b + rows_of_floats({{1, 2, 3, 0, 0, 1, 1}, {-1, 0, 0, 0, 3, 4, 3}});
}

template <typename T>
std::string with(std::string bytes, std::size_t at, const T& value) {
    put(bytes, at, value);
    return bytes;
}

class Asap : public ::testing::Test {
  protected:
    RaySet read(const std::string& bytes) {
        monitor_.warnings.clear();
        std::ofstream(folder_ / "lamp.dis", std::ios::binary) << bytes;
        return read_rays(folder_ / "lamp.dis", monitor_);
    }
    std::string error_text(const std::string& bytes) {
        const std::string message = testing::error_of([&] { read(bytes); });
        EXPECT_THAT(message, AllOf(HasSubstr("lamp.dis: "), Not(HasSubstr("\n"))));
        return message;
    }
    testing::TemporaryFolder folder_;
    testing::ListeningMonitor monitor_;
};

TEST_F(Asap, Rows_ArePositionDirectionAndFlux) {
    const RaySet set = read(two_rays());
    ASSERT_EQ(set.rays.size(), 2U);
    EXPECT_NEAR(set.rays[0].o.y, 0.002F, 1e-9F);
    EXPECT_NEAR(set.rays[1].o.x, -0.001F, 1e-9F);
    EXPECT_NEAR(set.rays[1].d.y, 0.6F, 1e-6F);
    EXPECT_EQ(set.rays[1].flux, 3);
    EXPECT_EQ(set.flux, 4);
    EXPECT_EQ(set.unit, FluxUnit::watt);
    EXPECT_FALSE(set.coloured());
    EXPECT_EQ(set.lumens_per_watt, 0);
    EXPECT_THAT(set.provenance, HasSubstr("ASAP ray file lamp.dis, 2 rays; a lamp"));
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0], HasSubstr("watts are assumed"));
}

TEST_F(Asap, LengthUnits_StandBehindTheColumns) {
    EXPECT_FLOAT_EQ(read(two_rays("XYZABCF CM")).rays[0].o.y, 0.02F);
    EXPECT_FLOAT_EQ(read(two_rays("XYZABCF M")).rays[0].o.y, 2);
    EXPECT_FLOAT_EQ(read(two_rays("XYZABCF INCH")).rays[0].o.y, 0.0508F);
    EXPECT_FLOAT_EQ(read(two_rays("XYZABCF")).rays[0].o.y, 0.002F);
    EXPECT_THAT(monitor_.warnings, ::testing::Contains(HasSubstr("mm is assumed")));
    EXPECT_THAT(error_text(two_rays("XYZABCF MILE")), HasSubstr("\"MILE\"; expected MM, CM, M or INCH"));
}

TEST_F(Asap, HeaderFlux_Wins) {
    const RaySet set = read(with(two_rays(), 64, 8.0F));
    EXPECT_EQ(set.flux, 8);
    EXPECT_EQ(set.rays[1].flux, 6);
    EXPECT_THAT(monitor_.warnings, ::testing::Contains(HasSubstr("the header's flux is used")));
}

TEST_F(Asap, Wavelength_HasNoUnitAndIsIgnored) {
    const RaySet set = read(with(two_rays(), 128, 0.55F));
    EXPECT_EQ(set.lumens_per_watt, 0);
    EXPECT_THAT(monitor_.warnings, ::testing::Contains(HasSubstr("the wavelength 0.55 is ignored")));
}

TEST_F(Asap, WrongFiles_SayWhatIsWrong) {
    EXPECT_THAT(error_text(with(two_rays(), 0, std::int32_t{247 + 1024 * 9})),
                HasSubstr("records of 9 words; expected 7"));
    EXPECT_THAT(error_text(two_rays("XYZABCW MM")),
                HasSubstr("columns \"XYZABCW MM\"; expected \"XYZABCF\""));
    EXPECT_THAT(error_text(with(two_rays(), 108, std::int32_t{-3})),
                HasSubstr("3 rays of 28 bytes stated, 56 bytes left at byte 140"));
    EXPECT_THAT(error_text(with(two_rays(), 108, std::int32_t{-2147483647 - 1})),
                HasSubstr("2147483648 rays of 28 bytes stated"));
    EXPECT_THAT(error_text(with(two_rays(), 108, std::int32_t{0})), HasSubstr("states 0 rays"));
    EXPECT_THAT(error_text(with(two_rays(), 108, std::int32_t{2})), HasSubstr("states -2 rays"));
    EXPECT_THAT(error_text(two_rays().substr(0, 139)), HasSubstr("truncated in the header"));
    std::string swapped = two_rays();
    std::reverse(swapped.begin(), swapped.begin() + 4);
    EXPECT_THAT(error_text(swapped), HasSubstr("big-endian"));
    EXPECT_THAT(error_text(two_rays().substr(0, 140) +
                           rows_of_floats({{0, NAN, 0, 0, 0, 1, 1}, {0, 0, 0, 0, 0, 1, -1}})),
                HasSubstr("no ray is usable: the first, at byte 140, has the position (0, nan, 0)"));
    const RaySet set =
        read(with(two_rays() + rows_of_floats({{0, 0, 0, 0, 0, 0, 1}}), 108, std::int32_t{-3}));
    EXPECT_EQ(set.skipped_zero_direction, 1U);
    EXPECT_THAT(monitor_.warnings,
                ::testing::Contains(HasSubstr("at byte 196, has the position (0, 0, 0) and the "
                                              "direction (0, 0, 0)")));
}

}  // namespace asap_test
}  // namespace lucerna
