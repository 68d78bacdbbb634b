// Requirements from the rows of a table.
#include "engine/photometry/requirement_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "engine/text/plain_text.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace requirement_table_test {

using ::lucerna::testing::error_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kTable =
    "\xef\xbb\xbftask,reference,Em,U0,UGR,modelling\r\n"
    "\"drawing, \"\"technical\"\"\",34.3,750,0.7,16,0.3-0.6\r\n"
    "\n"
    "archive,34.7,200,0.4,25\n";

RequiredLighting parsed(const std::string& table, const std::string& after) {
    const testing::TemporaryFolder folder;
    const std::filesystem::path file = folder / "tasks.csv";
    std::ofstream(file, std::ios::binary) << table;
    return parse_required_lighting({"--require"}, file.string() + after);
}

TEST(RequirementTable, Row_HasItsRequirementsAndName) {
    const RequiredLighting found = parsed(kTable, "#34.3");
    EXPECT_EQ(found.task, "34.3 drawing, \"technical\"");
    EXPECT_EQ(required(found.limits, Requirement::em)->low, 750);
    EXPECT_EQ(required(found.limits, Requirement::ugr)->high, 16);
    EXPECT_EQ(required(found.limits, Requirement::modelling)->high, 0.6);
    EXPECT_FALSE(required(found.limits, Requirement::walls));
}

TEST(RequirementTable, ShortRow_RequiresNothingInItsLastColumns) {
    const RequiredLighting found = parsed(kTable, "#34.7");
    EXPECT_EQ(required(found.limits, Requirement::em)->low, 200);
    EXPECT_FALSE(required(found.limits, Requirement::modelling));
}

TEST(RequirementTable, ValuesAfterTheRow_ReplaceItsOwn) {
    const RequiredLighting found = parsed(kTable, "#34.7,UGR=22,walls=50");
    EXPECT_EQ(required(found.limits, Requirement::ugr)->high, 22);
    EXPECT_EQ(required(found.limits, Requirement::walls)->low, 50);
    EXPECT_EQ(required(found.limits, Requirement::em)->low, 200);
}

TEST(RequirementTable, Values_WithoutATable) {
    const RequiredLighting found = parse_required_lighting({"--require"}, "Em=500");
    EXPECT_TRUE(found.table.empty() && found.task.empty());
    EXPECT_EQ(required(found.limits, Requirement::em)->low, 500);
}

TEST(RequirementTable, WrongTables_NameFileLineAndWhatIsThere) {
    EXPECT_THAT(error_of([] { parsed(kTable, "#34.2"); }),
                HasSubstr("has no row with the reference \"34.2\"; it has 34.3, 34.7"));
    EXPECT_THAT(error_of([] { parsed("task,Em\na,1\n", "#a"); }),
                HasSubstr("tasks.csv:1:1: expected names of columns, among them \"reference\""));
    EXPECT_THAT(error_of([] { parsed("reference,Em\na,1\na,2\n", "#a"); }),
                HasSubstr("tasks.csv:3:1: is a second row \"a\""));
    EXPECT_THAT(error_of([] { parsed("reference,Em\na,many\n", "#a"); }),
                HasSubstr("tasks.csv:2:1: \"many\""));
    EXPECT_THAT(
        error_of([] { parsed("reference,Ev\na,1\n", "#a"); }),
        HasSubstr("tasks.csv:2:1: \"Ev=1\" is not a requirement; expected NAME=VALUE with the names Em,"));
    EXPECT_THAT(error_of([] { parse_required_lighting({"--require"}, "absent.csv#a"); }),
                HasSubstr("absent.csv"));
}

TEST(CsvFields, OfWrittenFields_AreTheTexts) {
    const std::vector<std::string> texts{"plain", "a, b", "say \"so\"", "", "\"\""};
    std::string line;
    for (const std::string& text : texts) line += (line.empty() ? "" : ",") + csv_field(text);
    EXPECT_EQ(csv_fields(line), texts);
    EXPECT_THAT(csv_fields(" a ,b , "), ElementsAre("a", "b", ""));
}

}  // namespace requirement_table_test
}  // namespace lucerna
