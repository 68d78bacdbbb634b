#include "engine/system/toml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/error_of.h"

namespace lucerna {
namespace toml_test {

using testing::error_of;

using ::testing::HasSubstr;
using ::testing::StartsWith;

TomlTable table_of(std::string_view text) {
    return TomlTable::parse(text, "rig.toml");
}

TEST(Toml, Values_AsWritten_ComeBackWithUnits) {
    const TomlTable t = table_of(
        "name = 'lamp'\nviews = [41, 31]\nside = 7\nspacing = '1.267mm'\nplane = ['2cm', '18 mm']\n"
        "height = '-2mm'\nscale = 3\non = true\ntimes = [0.5, 2]\n[emitter]\nkind = 'disc'\n"
        "[[frame]]\nn = 1\n[[frame]]\nn = 2\n");
    EXPECT_EQ(t.text("name"), "lamp");
    EXPECT_EQ(t.wholes("views", 1, 100), V2i(41, 31));
    EXPECT_EQ(t.wholes("side", 1, 100), V2i(7, 7));
    EXPECT_DOUBLE_EQ(t.length("spacing"), 1.267e-3);
    EXPECT_TRUE(t.lengths("plane").equalWithAbsError({0.02, 0.018}, 1e-15));
    EXPECT_EQ(t.lengths("spacing"), Imath::V2d(1.267e-3, 1.267e-3));
    EXPECT_DOUBLE_EQ(t.position("height"), -2e-3);
    EXPECT_EQ(t.number("scale", 0, 10), 3);
    EXPECT_TRUE(t.flag("on"));
    EXPECT_EQ(t.numbers("times", 0, 10), (std::vector<double>{0.5, 2}));
    EXPECT_EQ(t.table("emitter").choice("kind", {"disc", "rectangle"}), "disc");
    ASSERT_EQ(t.tables("frame").size(), 2U);
    EXPECT_EQ(t.tables("frame")[1].whole("n", 0, 9), 2);
    EXPECT_TRUE(t.tables("none").empty());
    EXPECT_NO_THROW(t.done());
}

TEST(Toml, Fallback_Missing_IsTaken) {
    const TomlTable t = table_of("");
    EXPECT_EQ(t.number("scale", 0, 1, 0.5), 0.5);
    EXPECT_EQ(t.whole("n", 0, 9, 3), 3);
    EXPECT_EQ(t.length("width", 0.25), 0.25);
    EXPECT_EQ(t.choice("kind", {"a", "b"}, "b"), "b");
}

TEST(Toml, Mistakes_OfEveryKind_NamePlaceValueAndWhatIsAccepted) {
    const auto error = [](std::string_view text, auto ask) { return error_of([&] { ask(table_of(text)); }); };
    EXPECT_THAT(error("a = \n", [](const TomlTable&) {}), StartsWith("rig.toml:1:"));
    EXPECT_THAT(error("\na = 5\n", [](const TomlTable& t) { t.length("a"); }),
                AllOf(StartsWith("rig.toml:2:5: "), HasSubstr("whole number"), HasSubstr("40mm")));
    EXPECT_THAT(error("a = '5'\n", [](const TomlTable& t) { t.length("a"); }),
                HasSubstr("\"5\" is not a length"));
    EXPECT_THAT(error("a = 5\n", [](const TomlTable& t) { t.whole("a", 0, 4); }), HasSubstr("0 to 4"));
    EXPECT_THAT(error("a = nan\n", [](const TomlTable& t) { t.number("a", 0, 4); }), HasSubstr("nan"));
    EXPECT_THAT(error("a = [1,2,3]\n", [](const TomlTable& t) { t.wholes("a", 0, 4); }),
                HasSubstr("3 values"));
    EXPECT_THAT(error("a = 'dics'\n",
                      [](const TomlTable& t) {
                          t.choice("a", {"disc", "rectangle"});
                      }),
                HasSubstr("did you mean \"disc\""));
    EXPECT_THAT(error("[rig]\n", [](const TomlTable& t) { t.table("rig").text("name"); }),
                HasSubstr("[rig] lacks \"name\""));
    EXPECT_THAT(error("a = 1979-05-27\n", [](const TomlTable&) {}), HasSubstr("dates"));
    EXPECT_THAT(error("veiws = 5\n", [](const TomlTable& t) { t.whole("views", 0, 9, 1), t.done(); }),
                AllOf(StartsWith("rig.toml:1:"), HasSubstr("did you mean \"views\"")));
}

// The library asserts on such names, and a release build would rely on the assertion.
TEST(Toml, TableNameThatIsNone_IsRefused) {
    for (const char* text : {"[# re", "[]", "[=]", "[[#", "set\xc2\xb5mup = 1"}) {
        EXPECT_THAT(error_of([&] { table_of(text); }), StartsWith("rig.toml")) << text;
    }
}

TEST(Toml, CharactersBeyondAscii_BelongInStringsAndComments) {
    EXPECT_THAT(error_of([&] { table_of("a = 1\nset\xc2\xb5mup = 1"); }),
                AllOf(StartsWith("rig.toml:2:4"), HasSubstr("needs quotes")));
    EXPECT_THAT(error_of([&] { table_of("a = \"\"\"b \\\n \xc2\xb5\"\"\""); }),
                AllOf(StartsWith("rig.toml:2:2"), HasSubstr("after a backslash")));
    EXPECT_THAT(error_of([&] { table_of("a = \"\\\xc2\xb5\""); }), StartsWith("rig.toml:1:7"));
    EXPECT_THAT(error_of([&] { table_of("title = -\"Choi\r\n\xcf\xbb"); }),
                AllOf(StartsWith("rig.toml:1:10"), HasSubstr("quote in the midst")));
    for (const char* text :
         {"a = 19T\"\xc2\xb5m\"", "a\"\xc2\xb5\" = 1", "a = 'b''\xc2\xb5'", "a = 1'\xc2\xb5'"})
        EXPECT_THAT(error_of([&] { table_of(text); }), HasSubstr("quote in the midst")) << text;
    for (const char* text : {"er =38=\"\xc2\xb5p", "er =3\x11 F.\x0e[\"\xc2\xb5r#", "a = 3F[\"\xc2\xb5\"]"})
        EXPECT_THAT(error_of([&] { table_of(text); }), StartsWith("rig.toml:1:")) << text;
    EXPECT_EQ(table_of("a = {b = 1, c = {d = '='}}\ne = \"=\" # =").text("e"), "=");
    EXPECT_EQ(table_of("\xef\xbb\xbf\"\xc2\xb5\" = 'a\xc2\xb5' # \xc2\xb5\n").text("\xc2\xb5"), "a\xc2\xb5");
}

TEST(Toml, Nesting_Abysmal_IsRefused) {
    std::string deep = "a = ";
    for (int i = 0; i < 100; ++i) deep += '[';
    for (int i = 0; i < 100; ++i) deep += ']';
    EXPECT_THAT(error_of([&] { table_of(deep); }), StartsWith("rig.toml:1:"));
}

std::string many(std::string_view text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
}

TEST(Toml, NestedAsDeepAsAccepted_IsRead) {
    EXPECT_NO_THROW(table_of(many("a.", 30) + "a = 1.5\n"));
    EXPECT_NO_THROW(table_of("[" + many("a . ", 30) + "a]\n"));
    EXPECT_NO_THROW(table_of("a = " + many("[", 31) + "1.5" + many("]", 31) + "\n"));
    EXPECT_NO_THROW(table_of("a = [" + many("'.', 1.5, ", 1000) + "]\n"));  // dots outside keys
    EXPECT_NO_THROW(table_of("a = '''\n" + many(".[{'\"", 1000) + "'''\nb = \"\"\"\\\"\"\"" +
                             many(".{[", 1000) + "\"\"\"\n# " + many(".[", 1000)));
}

// Nests by dots, by brackets and by both; strings are parts of keys, and their dots do not nest.
TEST(Toml, NestedTooDeep_IsRefusedWithItsPlace) {
    const auto refusal = [](const std::string& text) { return error_of([&] { table_of(text); }); };
    EXPECT_THAT(refusal("x = 1\n" + many("a.", 40) + "a = 1\n"), StartsWith("rig.toml:2:66: tables nested"));
    EXPECT_THAT(refusal("x = 1\na = " + many("[", 40)), StartsWith("rig.toml:2:37: "));
    for (const std::string& text :
         {"[" + many("a.", 100'000) + "a]\n", "[[" + many("a.", 100'000) + "a]]\n",
          many("'a.b' . ", 100'000) + "a = 1\n", many("'=' . ", 100'000) + "a = 1\n",
          many("\"\\\",\" . ", 100'000) + "a = 1\n",
          "a = " + many("[{a.a=", 12) + "1" + many("}]", 12) + "\n"}) {
        EXPECT_THAT(refusal(text), HasSubstr("nested more than 32 deep")) << text.substr(0, 40);
    }
    for (const std::string& text : {"a = " + many("[", 100'000), "a = " + many("{a=", 100'000),
                                    "a = " + many("{a.a.a.a.a.a.a.a=", 200) + "1" + many("}", 200) + "\n",
                                    "a = " + many("[{a.a=", 20) + "1" + many("}]", 20) + "\n"}) {
        EXPECT_THAT(refusal(text), HasSubstr("depth of 32")) << text.substr(0, 40);
    }
}

TEST(Toml, AsDeepAsTheLibraryMayFirstMakeIt_IsRefused) {
    const std::string dots = many("a.", 32);
    EXPECT_THAT(error_of([&] {
                    table_of("[" + dots + "a]\n" + dots + "b = " + many("{" + dots + "a=", 31) + "1" +
                             many("}", 31) + "\n");
                }),
                HasSubstr("nested more than 32 deep"));
}

}  // namespace toml_test
}  // namespace lucerna
