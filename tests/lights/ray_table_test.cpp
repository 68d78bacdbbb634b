// Text tables of rays: headers with names and units, and LightTools's header of keywords.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "engine/colour/spectrum.h"
#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace ray_table_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class RayTables : public ::testing::Test {
  protected:
    RaySet read(const std::string& text) {
        monitor_.warnings.clear();
        std::ofstream(folder_ / "rays.txt", std::ios::binary) << text;
        return read_rays(folder_ / "rays.txt", monitor_);
    }
    std::string error_text(const std::string& text) {
        const std::string message = testing::error_of([&] { read(text); });
        EXPECT_THAT(message, AllOf(HasSubstr("rays.txt:"), Not(HasSubstr("\n"))));
        return message;
    }
    testing::TemporaryFolder folder_;
    testing::ListeningMonitor monitor_;
};

void expect_the_two_rays(const RaySet& set) {
    ASSERT_EQ(set.rays.size(), 2U);
    EXPECT_NEAR(set.rays[0].o.y, 0.002F, 1e-9F);
    EXPECT_NEAR(set.rays[1].o.x, -0.001F, 1e-9F);
    EXPECT_NEAR(set.rays[1].d.y, 0.6F, 1e-6F);
    EXPECT_NEAR(set.rays[1].d.z, 0.8F, 1e-6F);
    EXPECT_EQ(set.rays[1].flux, 3);
    EXPECT_EQ(set.flux, 4);
    EXPECT_EQ(set.unit, FluxUnit::lumen);
}

TEST_F(RayTables, NamedColumns_InAnyOrderAndSpelling) {
    for (const char* text :
         {"# x[mm] y[mm] z[mm] l m n flux[lm]\n1 2 3 0 0 1 1\n-1 0 0 0 3 4 3\n",
          "X (mm)\tY (mm)\tZ (mm)\tkx\tky\tkz\tPower "
          "(lumens)\r\n1\t2\t3\t0\t0\t1\t1\r\n-1\t0\t0\t0\t3\t4\t3\r\n",
          "number;flux/lm;dir z;dir y;dir x;pos z/mm;pos y/mm;pos x/mm\n1;1;1;0;0;3;2;1\n2; 3 ;4;3;0;0;0; -1",
          "\"x [mm]\",\"y [mm]\",\"z [mm]\",dx,dy,dz,luminous flux\n1,2,3,0,0,1,1\n# half of "
          "it\n\n-1,0,0,0,3,4,3\n",
          "% a lamp\n% length unit: cm\n% flux unit = lm\n% x y z u v w phi\n 0.1 .2 3e-1 0 0 1 1\n-0.1 0 0 "
          "0 3 4 +3\n",
          "! column 1: x [mm]\n! column 2: y\n! column 3: z\n! column 7: flux [lm]\n! column 6: n\n! column "
          "5: m\n"
          "! column 4: l\n1 2 3 0 0 1 1\n-1 0 0 0 3 4 3\n",
          "// 1 = a\n// 2 = b\n// 3 = c\n// 4 = flux, total 4 lm [lm]\n// 4 = energy\n"}) {
        SCOPED_TRACE(text);
        if (std::string(text).starts_with("//")) {
            EXPECT_THAT(error_text(text), HasSubstr("not a ray file")) << "it names no positions";
            continue;
        }
        expect_the_two_rays(read(text));
        EXPECT_TRUE(monitor_.warnings.empty());
    }
    EXPECT_THAT(read("# a lamp\n# of two rays\n# x[mm] y z l m n flux[W]\n0 0 0 0 0 1 1\n").provenance,
                HasSubstr("table of rays rays.txt, 1 rays; a lamp; of two rays"));
}

TEST_F(RayTables, Units_AreTurnedIntoMetresAndNanometres) {
    const auto x_of = [&](const char* unit) {
        return read(std::string("# x[") + unit + "] y z l m n flux[W]\n2 0 0 0 0 1 1\n").rays[0].o.x;
    };
    EXPECT_FLOAT_EQ(x_of("Inches"), 0.0508F);
    EXPECT_FLOAT_EQ(x_of("ft"), 0.6096F);
    EXPECT_FLOAT_EQ(x_of("µm"), 2e-6F);
    EXPECT_FLOAT_EQ(x_of("m"), 2);
    for (const char* text :
         {"# x[mm] y z l m n flux[W] wavelength[nm]\n0 0 0 0 0 1 1 470\n0 0 0 0 0 1 3 630\n",
          "# x[mm] y z l m n flux[W] lambda[um]\n0 0 0 0 0 1 1 .47\n0 0 0 0 0 1 3 .63\n"}) {
        const RaySet set = read(text);
        EXPECT_EQ(set.unit, FluxUnit::watt);
        EXPECT_NEAR(set.lumens_per_watt, 683 * (cie_xyz(470).y + 3 * cie_xyz(630).y) / 4, 1e-2);
        EXPECT_EQ(set.tristimulus.size(), 2U);
    }
}

TEST_F(RayTables, WrongTables_SayWhatIsWrongAndWhere) {
    const std::string row = "1 2 3 0 0 1 1\n";
    EXPECT_THAT(error_text("# x y z l m n flux[lm]\n" + row), HasSubstr(":2:1: no unit of the positions"));
    EXPECT_THAT(error_text("# x[mm] y z l m n flux\n" + row), HasSubstr("no unit of the flux; expected"));
    EXPECT_THAT(error_text("# x[mm] y z l m n flux[lm] wl\n" + row), HasSubstr("no unit of the wavelength"));
    EXPECT_THAT(error_text("# x[mm] y z l m flux[lm]\n" + row), HasSubstr("no column for the direction's z"));
    EXPECT_THAT(error_text("# x[mm] y z l m n\n" + row), HasSubstr("no column for the flux"));
    EXPECT_THAT(error_text("# x[mm] y z l m n n flux[lm]\n" + row),
                HasSubstr(":1:1: two columns for the direction's z"));
    EXPECT_THAT(error_text("# x[mm] y[cm] z l m n flux[lm]\n" + row), HasSubstr("several units"));
    EXPECT_THAT(error_text("# x[miles] y z l m n flux[lm]\n" + row), HasSubstr("\"miles\"; expected mm, cm"));
    EXPECT_THAT(error_text("# x[mm] y z l m n flux[cd]\n" + row), HasSubstr("\"cd\"; expected W or lm"));
    EXPECT_THAT(error_text("# x[mm] y z l m n flux[W] wl[mm]\n" + row),
                HasSubstr("\"mm\"; expected nm or um"));
    const std::string good = "# x[mm] y z l m n flux[lm]\n" + row;
    EXPECT_THAT(error_text(good + "1 2 3 0 0 1\n"), HasSubstr(":3:1: 6 numbers; expected 7"));
    EXPECT_THAT(error_text(good + "1 2 3 0 0 1 1 1\n"), HasSubstr(":3:1: 8 numbers; expected 7"));
    EXPECT_THAT(error_text(good + "1 2 3 0 zero 1 1\n"), HasSubstr(":3:1: \"zero\" is not a number"));
    EXPECT_THAT(error_text("x[mm],y,z,l,m,n,flux[lm]\n1,2,,0,0,1,1\n"),
                HasSubstr(":2:1: \"\" is not a number"));
    EXPECT_THAT(error_text("# x[mm] y z l m n flux[lm]\n"),
                HasSubstr("truncated in the rays: there are none"));
    EXPECT_THAT(error_text("# x[mm] y z l m n flux[lm]\n0 0 0 0 0 1 nan\n"),
                HasSubstr("no ray is usable: the first, at line 2, has the flux nan"));
    EXPECT_EQ(read(good + "0 0 0 0 0 0 1\n0 0 0 0 0 1 -1\n").rays.size(), 1U);
    EXPECT_THAT(monitor_.warnings,
                Contains(HasSubstr(
                    "2 of 3 rays are skipped: the first, at line 3, has the position (0, 0, 0) and the "
                    "direction (0, 0, 0)")));
    EXPECT_THAT(error_text("1 2 3 0 0 1 1\n-1 0 0 0 3 4 3\n"), HasSubstr("not a ray file"));
}

// --- LightTools --------------------------------------------------------------------------------------------

std::string lighttools(const std::string& more = "", const std::string& end = "lt_endofdata\n") {
    return "# LightTools 2024.03\n# Ray Data Export File\nlt_rdf_version: 2.0\ndataname: aLamp\n"
           "lt_datatype: luminous_flux\nlt_far_field_data: no\nlt_color_info: none\nlt_length_units: "
           "millimeters\n"
           "lt_data_origin:          0          0          0\n" +
           more + "lt_startofdata\n     1      2   3  0  0 1   1\n -1  0 6.123234e-017 0 3 4 3\n" + end;
}

TEST_F(RayTables, LightToolsText_HasKeywordsBeforeItsRows) {
    expect_the_two_rays(read(lighttools()));
    EXPECT_TRUE(monitor_.warnings.empty());
    EXPECT_THAT(read(lighttools()).provenance, HasSubstr("LightTools text ray file rays.txt, 2 rays; aLamp"));
    const RaySet set =
        read(lighttools("lt_datatype: radiant_power\nlt_length_units: Inches\nlt_radiant_flux: 8\n"));
    EXPECT_EQ(set.unit, FluxUnit::watt);
    EXPECT_FLOAT_EQ(set.rays[0].o.x, 0.0254F);
    EXPECT_EQ(set.flux, 8);
    EXPECT_EQ(set.rays[1].flux, 6);
    read(lighttools("lt_length_units: system\n"));
    EXPECT_THAT(monitor_.warnings, Contains(HasSubstr("mm is assumed")));
    read(lighttools("", ""));
    EXPECT_THAT(monitor_.warnings, Contains(HasSubstr("the end mark lt_endofdata is missing")));
}

TEST_F(RayTables, LightToolsText_WavelengthsAreInNanometres) {
    std::string text = lighttools("lt_color_info: wavelength\n");
    text.replace(text.find("1   1\n"), 6, "1   1 470\n");
    text.replace(text.find("4 3\n"), 4, "4 3 630\n");
    const RaySet set = read(text);
    ASSERT_EQ(set.tristimulus.size(), 2U);
    EXPECT_NEAR(double{set.tristimulus[0].x}, cie_xyz(470).x / cie_xyz(470).y, 1e-5);
}

TEST_F(RayTables, LightToolsText_SaysWhatIsRefused) {
    EXPECT_THAT(error_text(lighttools("lt_rdf_version: 3.0\n")),
                HasSubstr(":10:1: lt_rdf_version \"3.0\"; expected 2.0 (no polarisation)"));
    EXPECT_THAT(error_text(lighttools("lt_datatype: cats\n")),
                HasSubstr("expected radiant_power or luminous_flux"));
    EXPECT_THAT(error_text(lighttools("lt_far_field_data: YES\n")),
                HasSubstr("expected no (rays with positions)"));
    EXPECT_THAT(error_text(lighttools("lt_color_info: tristimulus\n")),
                HasSubstr("expected none or wavelength"));
    EXPECT_THAT(error_text(lighttools("lt_length_units: miles\n")), HasSubstr("unit of length \"miles\""));
    EXPECT_THAT(error_text(lighttools("lt_radiant_flux: much\n")), HasSubstr("expected a number"));
    EXPECT_THAT(error_text(lighttools("lt_radiant_flux: 1e39\n")),
                HasSubstr("expected a number up to 3.4e38"));
    EXPECT_THAT(error_text(lighttools("", "1 2 3 0 0 1\n")), HasSubstr(":13:1: 6 numbers; expected 7"));
    const std::string good = lighttools();
    EXPECT_THAT(testing::error_of([&] { read(good.substr(0, good.find("lt_startofdata"))); }),
                HasSubstr("truncated in the header: there is no line lt_startofdata"));
}

}  // namespace ray_table_test
}  // namespace lucerna
