// Checks that the comments and names of the product use the terms of the field: reads the sources and reports
// forbidden words and beginnings of sentences.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace lucerna {
namespace words_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Rule {
    std::string_view word, instead;
};

// Phrases that no comment may contain.
constexpr Rule kPhrases[] = {
    {"photometer head", "sensor"},
    {"sensor head", "sensor"},
    {"border between media", "medium interface"},
    {"borders between media", "medium interfaces"},
    {"medium of the borders", "medium"},
};
// Words that no sentence of a comment may begin with.
constexpr Rule kBeginnings[] = {
    {"Of", "a sentence that names its subject"},
    {"What", "a sentence that names its subject"},
};
// Words that neither comments nor names may contain.
constexpr Rule kWords[] = {
    {"station", "cache record"},
    {"stations", "cache records"},
    {"a_border", "any_medium_interface"},
    {"has_borders", "has_medium_interfaces"},
    {"kBorders", "kMediumInterfaces"},
    {"is_border", "is_medium_interface"},
    {"kMaxBorders", "kMaxMediumInterfaces"},
    {"intersect_border", "intersect_medium_interface"},
    {"intersect_with_borders", "intersect_with_medium_interfaces"},
    {"heads_of_a_point", "sensors_of_a_point"},
    {"kLeastHeads", "kLeastSensors"},
    {"told_to", "with_monitor"},
    {"prepared_by", "with_deadline"},
    {"untold", "a verb that says what is done"},
    {"take_up", "a verb that says what is done"},
    {"come_in", "a verb that says what is done"},
    {"hurry", "a verb that says what is done"},
    {"room_around", "a length"},
    {"PictureFacts", "Facts"},
};

struct Text {
    struct Comment {
        std::size_t line;
        std::string text;
    };
    std::vector<Comment>
        comments;  // blocks of adjacent comment lines; trailing comments are blocks of their own
    std::vector<std::string> code;  // by line
};

// Splits a source into comments and code. Strings are emptied; raw strings are kept as code.
Text split(const std::string& source) {
    Text text;
    std::istringstream in(source);
    std::size_t number = 0;
    bool open = false;  // whether the previous line was only a comment
    for (std::string line; std::getline(in, line);) {
        ++number;
        std::string code, comment;
        bool in_string = false, is_comment = false;
        for (std::size_t i = 0; i < line.size() && !is_comment; ++i) {
            if (in_string && line[i] == '\\') {
                ++i;
            } else if (line[i] == '"') {
                in_string = !in_string;
            } else if (!in_string && line.compare(i, 2, "//") == 0) {
                comment = line.substr(std::min(line.size(), line.find_first_not_of("/ ", i)));
                is_comment = true;
            } else if (!in_string) {
                code += line[i];
            }
        }
        text.code.push_back(code);
        const bool alone = is_comment && code.find_first_not_of(' ') == std::string::npos;
        if (alone && open && !comment.empty()) {
            text.comments.back().text += ' ' + comment;
        } else if (is_comment) {
            text.comments.push_back({number, comment});
        }
        open = alone && !comment.empty();
    }
    return text;
}

bool is_letter(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

// Calls visit(word, begins a sentence) for the words of a text.
template <typename Visit>
void for_each_word(const std::string& text, Visit&& visit) {
    bool begins = true;
    for (std::size_t i = 0; i < text.size();) {
        std::size_t end = i;
        while (end < text.size() && is_letter(text[end])) ++end;
        if (end > i) {
            visit(std::string_view(text).substr(i, end - i), begins);
            begins = false;
            i = end;
        } else {
            if (std::string_view(".:?!").find(text[i]) != std::string_view::npos) begins = true;
            ++i;
        }
    }
}

std::vector<std::string> faults_of(const std::string& path, const std::string& source) {
    std::vector<std::string> faults;
    const auto report = [&](std::size_t line, const Rule& rule) {
        faults.push_back(fmt::format("{}:{}: \"{}\"; expected {}", path, line, rule.word, rule.instead));
    };
    const Text text = split(source);
    for (const Text::Comment& comment : text.comments) {
        for (const Rule& rule : kPhrases) {
            if (comment.text.find(rule.word) != std::string::npos) report(comment.line, rule);
        }
        for_each_word(comment.text, [&](std::string_view word, bool begins) {
            for (const Rule& rule : kBeginnings) {
                if (begins && word == rule.word) report(comment.line, rule);
            }
            for (const Rule& rule : kWords) {
                if (word == rule.word) report(comment.line, rule);
            }
        });
    }
    for (std::size_t i = 0; i < text.code.size(); ++i) {
        for_each_word(text.code[i], [&](std::string_view word, bool) {
            for (const Rule& rule : kWords) {
                if (word == rule.word) report(i + 1, rule);
            }
        });
    }
    return faults;
}

TEST(Words, OfComments_AndNames_AreTheFields) {
    const std::filesystem::path root(LUCERNA_SOURCE_DIR);
    std::vector<std::string> faults;
    std::size_t files = 0;
    for (const char* folder : {"engine", "lights", "photon", "kdtree", "python/bindings", "bench"}) {
        for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
            const std::string suffix = entry.path().extension().string();
            if (suffix != ".h" && suffix != ".cpp") continue;
            std::ostringstream source;
            source << std::ifstream(entry.path()).rdbuf();
            ++files;
            for (std::string& fault :
                 faults_of(std::filesystem::relative(entry.path(), root).string(), source.str()))
                faults.push_back(std::move(fault));
        }
    }
    EXPECT_GT(files, 500U);
    EXPECT_THAT(faults, IsEmpty()) << fmt::format("{}", fmt::join(faults, "\n"));
}

TEST(WordsChecker, FragmentsAndPrivateWords_AreReported) {
    EXPECT_THAT(faults_of("a.h", "// Of one sample.\nint x;\n"), ElementsAre(HasSubstr("a.h:1: \"Of\"")));
    EXPECT_THAT(faults_of("a.h", "int x;  // What is whole needs none\n"), ElementsAre(HasSubstr("a.h:1")));
    EXPECT_THAT(faults_of("a.h", "// Counts the photons\n// near x. Of many, some.\n"),
                ElementsAre(HasSubstr("\"Of\"")));
    EXPECT_THAT(faults_of("a.h", "bool has_borders() const;\n"),
                ElementsAre(HasSubstr("has_medium_interfaces")));
    EXPECT_THAT(faults_of("a.h", "// Stores a station.\n"), ElementsAre(HasSubstr("cache record")));
}

TEST(WordsChecker, SentencesAndStrings_AreSilent) {
    EXPECT_THAT(
        faults_of("a.h", "// Returns the share of light that passes.\nint x;  // number of photons\n"),
        IsEmpty());
    EXPECT_THAT(faults_of("a.h", "const char* text = \"// What of it? has_borders\";\n"), IsEmpty());
    EXPECT_THAT(faults_of("a.h", "// Returns the radius.\n// of the disc\nint border = 0;\n"), IsEmpty());
}

}  // namespace words_test
}  // namespace lucerna
