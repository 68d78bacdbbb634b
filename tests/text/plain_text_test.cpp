// Plain text contains no terminal control sequences and is otherwise unchanged.
#include "engine/text/plain_text.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace lucerna {
namespace plain_text_test {

TEST(PlainText, WhatTerminalsObey_IsWrittenOut) {
    EXPECT_EQ(plain_text("\x1b[31mred\x1b]0;title\x07"), "\\x1b[31mred\\x1b]0;title\\x07");
    EXPECT_EQ(plain_text("over\rwritten\b"), "over\\x0dwritten\\x08");
    EXPECT_EQ(plain_text(std::string_view("\0\x7f", 2)), "\\x00\\x7f");
    EXPECT_EQ(plain_text("\xc2\x9b"
                         "31m"),
              "\\xc2\\x9b31m");  // the same control sequence as one C1 character
    EXPECT_EQ(plain_text("\x9b"
                         "31m"),
              "\\x9b31m");
}

TEST(PlainText, TextInAnyLanguage_StaysAsItIs) {
    for (const char* text :
         {"", "a b\tc\n", "Grüße … 12 × 8 cd/m²", "日本語", "\U0001F4A1", "\u00a0", "\uffff", "\U0010ffff"})
        EXPECT_EQ(plain_text(text), text);
}

TEST(PlainText, BytesThatAreNoUtf8_AreWrittenOut) {
    EXPECT_EQ(plain_text("\xff"
                         "a\xc3"),
              "\\xffa\\xc3");
    EXPECT_EQ(plain_text("\xc0\x9b"), "\\xc0\\x9b");           // overlong encoding of a control character
    EXPECT_EQ(plain_text("\xe0\x80\x9b"), "\\xe0\\x80\\x9b");  // a longer overlong encoding
    EXPECT_EQ(plain_text("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // half a surrogate pair
    EXPECT_EQ(plain_text("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
}

// Tests any two bytes with any neighbours.
TEST(PlainText, AnyBytes_LeaveNothingToObey) {
    for (int a = 0; a < 256; ++a) {
        for (int b = 0; b < 256; ++b) {
            const std::string plain =
                plain_text(std::string{'x', static_cast<char>(a), static_cast<char>(b), 'y'});
            EXPECT_EQ(plain_text(plain), plain);
            const bool obeyed = std::any_of(plain.begin(), plain.end(), [](unsigned char c) {
                return (c < 0x20 && c != '\n' && c != '\t') || c == 0x7f;
            });
            ASSERT_FALSE(obeyed) << a << " " << b;
        }
    }
}

TEST(PlainText, CharactersInPieces_AreFinishedLater) {
    EXPECT_EQ(unfinished_bytes(""), 0U);
    EXPECT_EQ(unfinished_bytes("a"), 0U);
    EXPECT_EQ(unfinished_bytes("ü"), 0U);
    EXPECT_EQ(unfinished_bytes("a\xc3"), 1U);
    EXPECT_EQ(unfinished_bytes("\xe2\x80"), 2U);
    EXPECT_EQ(unfinished_bytes("\xf0\x9f\x92"), 3U);
    EXPECT_EQ(unfinished_bytes("\x80\x80\x80\x80"), 0U);
}

}  // namespace plain_text_test
}  // namespace lucerna
