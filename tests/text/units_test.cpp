#include "engine/text/units.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"

namespace lucerna {
namespace units_test {

TEST(Units, Length_WithItsUnit_IsMetres) {
    EXPECT_DOUBLE_EQ(parse_length({"-d"}, "40mm"), 0.04);
    EXPECT_DOUBLE_EQ(parse_length({"-d"}, "4cm"), 0.04);
    EXPECT_DOUBLE_EQ(parse_length({"-d"}, "1.2m"), 1.2);
    EXPECT_DOUBLE_EQ(parse_length({"-d"}, "250um"), 250e-6);
    EXPECT_DOUBLE_EQ(parse_length({"-d"}, "1e2mm"), 0.1);
    EXPECT_DOUBLE_EQ(parse_place({"-d"}, "-2mm"), -0.002);
    EXPECT_DOUBLE_EQ(parse_place({"-d"}, "0"), 0);
}

TEST(Units, Length_WithoutUnitOrSense_IsRefused) {
    for (const char* word :
         {"", "40", "mm", "-4mm", "0mm", "nanmm", "infm", "mm", "4mmm", "4km", "4mmx", "1e999m"}) {
        EXPECT_THROW(parse_length({"--distance"}, word), InputError) << word;
    }
    for (const char* word : {"", "1", "m", "nanm", "--1m"})
        EXPECT_THROW(parse_place({"--z"}, word), InputError) << word;
}

TEST(Units, Pairs_WidthByHeight_KeepTheirOrder) {
    EXPECT_EQ(parse_size({"--views"}, "12x8", 100), V2i(12, 8));
    EXPECT_DOUBLE_EQ(parse_length_pair({"--size"}, "20mmx1cm").x, 0.02);
    EXPECT_DOUBLE_EQ(parse_length_pair({"--size"}, "20mmx1cm").y, 0.01);
}

TEST(Units, Pairs_Malformed_AreRefused) {
    for (const char* word :
         {"", "x", "12", "12x", "x8", "0x8", "-1x8", "12x8x3", "12.5x8", "101x8", "12 x 8"}) {
        EXPECT_THROW(parse_size({"--views"}, word, 100), InputError) << word;
    }
    for (const char* word : {"", "20mm", "20x10", "20mmx", "20mmx-10mm", "20mmx10mmx3mm"}) {
        EXPECT_THROW(parse_length_pair({"--size"}, word), InputError) << word;
    }
}

TEST(Units, Numbers_OutOfRangeOrNotFinite_AreRefused) {
    EXPECT_DOUBLE_EQ(parse_number({"-e"}, "-1.5", -10, 10), -1.5);
    EXPECT_EQ(parse_whole({"--spp"}, "+16", 1, 100), 16);
    EXPECT_EQ(parse_seed({"--seed"}, "18446744073709551615"), UINT64_MAX);
    for (const char* word : {"", "nan", "inf", "11", "1e999", "1,5", "0x10", "1 "}) {
        EXPECT_THROW(parse_number({"-e"}, word, -10, 10), InputError) << word;
    }
    for (const char* word : {"0", "101", "1.0", "1e1", "ten", "99999999999999999999"}) {
        EXPECT_THROW(parse_whole({"--spp"}, word, 1, 100), InputError) << word;
    }
    for (const char* word : {"-1", "18446744073709551616", ""})
        EXPECT_THROW(parse_seed({"--seed"}, word), InputError);
}

TEST(Units, Duration_WithItsUnit_IsSeconds) {
    EXPECT_DOUBLE_EQ(parse_duration({"--time"}, "30s"), 30);
    EXPECT_DOUBLE_EQ(parse_duration({"--time"}, "1.5min"), 90);
    EXPECT_DOUBLE_EQ(parse_duration({"--time"}, "2 h"), 7200);
    for (const char* word : {"", "30", "s", "0s", "-1s", "nans", "infs", "30ms", "1e999s", "30sec"}) {
        EXPECT_THROW(parse_duration({"--time"}, word), InputError) << word;
    }
}

TEST(Units, Share_PercentAndFraction_AreTheSame) {
    EXPECT_DOUBLE_EQ(parse_share({"--capture"}, "98%"), 0.98);
    EXPECT_DOUBLE_EQ(parse_share({"--capture"}, "0.98"), 0.98);
    EXPECT_DOUBLE_EQ(parse_share({"--capture"}, "1"), 1);
    for (const char* word : {"", "%", "0", "98", "101%", "-5%", "nan"}) {
        EXPECT_THROW(parse_share({"--capture"}, word), InputError) << word;
    }
}

TEST(Units, Colour_AnyScale_HasLuminanceOne) {
    const Rgb colour = parse_colour({"--colour"}, "1,0.8,0.5");
    EXPECT_NEAR(luminance(colour), 1, 1e-6);
    EXPECT_NEAR(colour.y / colour.x, 0.8, 1e-6);
    EXPECT_NEAR(colour.z / colour.x, 0.5, 1e-6);
    for (const char* word : {"", "1,1", "1,1,1,1", "1,1,", "0,0,0", "-1,1,1", "nan,1,1", "1 1 1"}) {
        EXPECT_THROW(parse_colour({"--colour"}, word), InputError) << word;
    }
}

TEST(Units, Assignment_FirstEqualsSign_Parts) {
    EXPECT_EQ(parse_assignment({"--set"}, "a=b=c"), (std::pair<std::string, std::string>("a", "b=c")));
    for (const char* word : {"", "=", "a", "a=", "=b"})
        EXPECT_THROW(parse_assignment({"--set"}, word), InputError);
}

TEST(Units, Error_OfAWordWithNewlines_IsOneLine) {
    try {
        parse_length({"--size"}, "40\nmm\n");
        FAIL() << "was accepted";
    } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
}

TEST(Units, Error_AnyKind_NamesOptionWordAndExample) {
    try {
        parse_length({"--distance"}, "40");
        FAIL() << "no error";
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(),
                     "--distance: \"40\" is not a length; expected a positive number with a unit, for "
                     "example 40mm, 4cm, 1.2m");
    }
}

TEST(Units, Text_AllSizes_ReadWell) {
    EXPECT_EQ(length_text(0), "0");
    EXPECT_EQ(length_text(250e-6), "250 um");
    EXPECT_EQ(length_text(-0.0127), "-12.7 mm");
    EXPECT_EQ(length_text(1.2), "1.2 m");
    EXPECT_EQ(duration_text(0.001), "<0.01 s");
    EXPECT_EQ(duration_text(0.42), "0.42 s");
    EXPECT_EQ(duration_text(12.3), "12 s");
    EXPECT_EQ(duration_text(200), "3 min 20 s");
    EXPECT_EQ(duration_text(7500), "2 h 5 min");
    EXPECT_EQ(bytes_text(999), "999 bytes");
    EXPECT_EQ(bytes_text(12.34e6), "12.3 MB");
    EXPECT_EQ(bytes_text(999e9), "999 GB");
    EXPECT_EQ(bytes_text(4.4e12), "4.4 TB");
}

}  // namespace units_test
}  // namespace lucerna
