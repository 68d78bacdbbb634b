#include "engine/pbrt/tokens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace lucerna {
namespace tokens_test {

using Kind = Token::Kind;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::vector<std::pair<Kind, std::string>> all(const std::string& text) {
    const Source source("s", text);
    Tokens tokens(source);
    std::vector<std::pair<Kind, std::string>> result;
    while (tokens.peek().kind != Kind::end) {
        const Token token = tokens.next();
        result.emplace_back(token.kind, token.text);
    }
    return result;
}

std::string refusal(const std::string& text) {
    try {
        const Source source("s", text);
        Tokens tokens(source);
        std::vector<double> numbers;
        while (tokens.peek().kind != Kind::end) {
            tokens.read_numbers(numbers);
            const Token token = tokens.next();
            if (token.kind == Kind::string) string_value(token, tokens.place(token));
        }
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

double number(const std::string& text) {
    const Source source("s", text);
    return number_value(text, {&source, 0});
}

TEST(Tokens, EveryKind_IsRecognised) {
    const std::vector<std::pair<Kind, std::string>> expected = {
        {Kind::word, "Shape"},  {Kind::string, "sphere"}, {Kind::string, "float radius"}, {Kind::open, "["},
        {Kind::number, "-1.5"}, {Kind::close, "]"},       {Kind::word, "true"},
    };
    EXPECT_EQ(all("Shape\"sphere\" \"float radius\"[-1.5]# comment [ \" 3\n\ttrue"), expected);
}

TEST(Tokens, EmptyTextAndCommentsOnly_HaveNoToken) {
    EXPECT_TRUE(all("").empty());
    EXPECT_TRUE(all(" \r\n\t# nothing\n#").empty());
    EXPECT_TRUE(all("\xEF\xBB\xBF").empty()) << "a byte order mark";
}

TEST(Tokens, Places_CountLinesAndBytesFromOne) {
    const Source source("a.pbrt", "Shape \"x\"\r\n  # c\n\n\t[ 1");
    Tokens tokens(source);
    std::vector<std::pair<int, int>> places;
    for (; tokens.peek().kind != Kind::end; tokens.next()) {
        const Location at = tokens.place().location();
        places.emplace_back(at.line, at.column);
    }
    const std::vector<std::pair<int, int>> expected = {{1, 1}, {1, 7}, {4, 2}, {4, 4}};
    EXPECT_EQ(places, expected);
    EXPECT_EQ(to_string(tokens.place().location()), "a.pbrt:4:5") << "the end";
    EXPECT_EQ(to_string(source.location(6)), "a.pbrt:1:7") << "asked backwards";
}

TEST(Tokens, NumberList_IsReadAsSingleNumbersAre) {
    const std::string text = "1 -2 +3 .5 5. 1e3 -1.25E-2 # note\n 00 7]";
    const Source source("s", text);
    Tokens tokens(source);
    std::vector<double> numbers;
    tokens.read_numbers(numbers);
    EXPECT_EQ(numbers, (std::vector<double>{1, -2, 3, .5, 5, 1000, -0.0125, 0, 7}));
    EXPECT_EQ(tokens.peek().kind, Kind::close);
}

TEST(Tokens, Numbers_AreExact) {
    EXPECT_EQ(number("0.1"), 0.1);
    EXPECT_EQ(number("1e308"), 1e308);
    EXPECT_EQ(number("0x10"), 16);
    EXPECT_EQ(number("123456789.123456789"), 123456789.123456789);
    EXPECT_EQ(number("1e-400"), 0.0) << "the nearest double";
    EXPECT_EQ(number("4.9406564584124654e-324"), 4.9406564584124654e-324);
    EXPECT_TRUE(std::signbit(number("-0")));
}

TEST(Tokens, BadNumbers_AreRefusedWithPlaceAndText) {
    EXPECT_EQ(refusal("[ 1 -x ]"), "s:1:5: -x is not a number");
    for (const std::string bad : {"--1", "+-1", "++1", "-", ".", "+", "-.", ".e5"}) {
        EXPECT_THAT(refusal(bad), HasSubstr("not a")) << bad;
        EXPECT_THAT(refusal("0 " + bad), HasSubstr("s:1:3: ")) << bad;
    }
}

TEST(Tokens, OddNumbers_GoAsFarAsTheyAreOnesAndBecomeFinite) {
    constexpr double kLargest = std::numeric_limits<double>::max();
    const std::vector<std::pair<std::string, double>> odd = {{"2x", 2},
                                                             {"1.2.3", 1.2},
                                                             {"1e", 1},
                                                             {"0.5f", 0.5},
                                                             {"nan", 0},
                                                             {"-nan", 0},
                                                             {"-nan(ind)", 0},
                                                             {"nan(snan)", 0},
                                                             {"1.#QNAN", 0},
                                                             {"-1.#IND00", 0},
                                                             {"1.#INF", kLargest},
                                                             {"-1.#INF", -kLargest},
                                                             {"inf", kLargest},
                                                             {"-infinity", -kLargest},
                                                             {"1e999", kLargest},
                                                             {"-1e999", -kLargest}};
    for (const auto& [text, value] : odd) {
        const Source source("s", "7 " + text + " 8]");
        Tokens tokens(source, 2);
        std::vector<double> numbers;
        tokens.read_numbers(numbers);
        if (numbers.empty()) {
            EXPECT_TRUE(names_a_number(tokens.peek().text)) << text;
            numbers.push_back(number_value(tokens.peek().text, tokens.place()));
            tokens.next();
            tokens.read_numbers(numbers);
        }
        EXPECT_EQ(numbers, (std::vector<double>{value, 8})) << text;
        const auto notes = source.take_oddities();
        ASSERT_EQ(notes.size(), 1U) << text;
        EXPECT_THAT(notes[0].what, AllOf(HasSubstr(text), HasSubstr("is not a"))) << text;
        EXPECT_EQ(notes[0].offset, 2U) << text;
        EXPECT_TRUE(source.take_oddities().empty()) << "told once";
    }
}

TEST(Tokens, Oddities_AreCountedWhereTheyAreAlike) {
    std::string text = "nan";
    for (int i = 0; i < 1000; ++i) text += ", nan";
    const Source source("s", text);
    for (Tokens tokens(source); tokens.peek().kind != Kind::end; tokens.next())
        number_value(tokens.peek().text, tokens.place());
    const auto notes = source.take_oddities();
    ASSERT_EQ(notes.size(), 2U);
    EXPECT_EQ(notes[0].times + notes[1].times, 2001U);
}

TEST(Tokens, Strings_ResolveEscapesAndRefuseOpenOnes) {
    const Source source("s", R"("a\"b\\c\n")");
    Tokens tokens(source);
    EXPECT_EQ(string_value(tokens.peek(), tokens.place()), "a\"b\\c\n");
    EXPECT_EQ(refusal("x \"abc"), "s:1:3: the string \"abc\" has no closing quote on its line");
    EXPECT_EQ(refusal("\"abc\ndef\""), "s:1:1: the string \"abc\" has no closing quote on its line");
    EXPECT_EQ(refusal("\"abc\\"), "s:1:1: the string \"abc\\\" has no closing quote on its line");
    const Source odd("s", R"("a\qb")");
    EXPECT_EQ(string_value(Tokens(odd).peek(), {&odd, 0}), "a\\qb");
    EXPECT_THAT(odd.take_oddities().at(0).what, HasSubstr("\\q is not an escape"));
}

TEST(Tokens, OtherCharacters_AreLeftOutWithANoteInPrint) {
    const std::string text = std::string("Shape ; 1,2 \x80\x81 Scale ") + std::string("\0\x1a", 2);
    const std::vector<std::pair<Kind, std::string>> expected = {
        {Kind::word, "Shape"}, {Kind::number, "1"}, {Kind::number, "2"}, {Kind::word, "Scale"}};
    EXPECT_EQ(all(text), expected);
    const Source source("s", text);
    for (Tokens walk(source); walk.peek().kind != Kind::end; walk.next()) {
    }
    const auto notes = source.take_oddities();
    ASSERT_EQ(notes.size(), 4U);
    EXPECT_THAT(notes[0].what, HasSubstr("unexpected character ';'"));
    EXPECT_EQ(notes[0].offset, 6U);
    EXPECT_THAT(notes[2].what, HasSubstr("'\\x80'"));
    EXPECT_THAT(notes.back().what, HasSubstr("'\\x00'"));
}

TEST(Tokens, LoneReturns_EndLinesAndComments) {
    const Source source("s", "# one\rShape\r\n# two\r\rScale");
    Tokens tokens(source);
    EXPECT_EQ(tokens.peek().text, "Shape");
    EXPECT_EQ(to_string(tokens.place().location()), "s:2:1");
    tokens.next();
    EXPECT_EQ(tokens.peek().text, "Scale");
    EXPECT_EQ(to_string(tokens.place().location()), "s:5:1");
}

TEST(Tokens, ShownText_IsShortAndPrintable) {
    EXPECT_EQ(shown("abc"), "abc");
    EXPECT_EQ(shown("a\nb"), "a\\x0ab");
    EXPECT_EQ(shown(std::string(100, 'x')), std::string(40, 'x') + "...");
}

}  // namespace tokens_test
}  // namespace lucerna
