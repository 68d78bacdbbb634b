// Checks that the comments and names of the product keep to the field's terms: reads the sources and reports
// the words and the beginnings of sentences that must not come back.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace lucerna {
namespace words_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Rule {
    std::regex pattern;
    const char* instead;
};

// Applied to the text of comments, with `//` removed, a block of lines at a time.
const std::vector<Rule>& rules_of_comments() {
    static const std::vector<Rule> rules{
        {std::regex("(^|[.:?!] )(Of|What) "), "a sentence that names its subject"},
        {std::regex("\\b(stations?|Stations?)\\b"), "cache record"},
        {std::regex("\\b(photometer|sensor) heads?\\b"), "sensor or replica"},
        {std::regex(
             "\\bmedi(um|a)'s borders?\\b|\\bborders? of (the )?medi(um|a)\\b|\\bborders between media\\b"),
         "medium interface"},
    };
    return rules;
}

// Applied to the code, without comments and strings.
const std::vector<Rule>& rules_of_names() {
    static const std::vector<Rule> rules{
        {std::regex(
             "\\b(a_border|has_borders_?|kBorders|is_border|kMaxBorders|intersect_(with_)?borders?)\\b"),
         "medium_interface"},
        {std::regex("\\b(stations?|kStation[A-Z]\\w*)\\b"), "records of a cache"},
        {std::regex("\\b(heads_|heads_without|kLeastHeads|head_normal|head_of)\\b"), "sensors"},
        {std::regex("\\b(told_to|told_to_stop_?|untold|take_up|come_in|hurry_?|room_around|PictureFacts)\\b"),
         "a verb that says what is done"},
        {std::regex("\\bstruct Order\\b"), "an agreement among all ranks"},
    };
    return rules;
}

struct Text {
    struct Comment {
        std::size_t line;
        std::string text;
    };
    std::vector<Comment>
        comments;  // blocks of adjacent comment lines; trailing comments are blocks of their own
    std::vector<std::string> code;  // by line
};

// Splits a source into comments and code. Strings are emptied; raw strings stay, as code.
Text split(const std::string& source) {
    Text text;
    std::istringstream in(source);
    std::size_t number = 0;
    bool open = false;  // whether the line before was a comment and nothing else
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

std::vector<std::string> faults_of(const std::string& path, const std::string& source) {
    std::vector<std::string> faults;
    const Text text = split(source);
    for (const Text::Comment& comment : text.comments) {
        for (const Rule& rule : rules_of_comments()) {
            if (std::smatch match; std::regex_search(comment.text, match, rule.pattern))
                faults.push_back(fmt::format("{}:{}: \"{}\"; expected {}", path, comment.line,
                                             match.str() + match.suffix().str().substr(0, 40), rule.instead));
        }
    }
    for (std::size_t i = 0; i < text.code.size(); ++i) {
        for (const Rule& rule : rules_of_names()) {
            if (std::smatch match; std::regex_search(text.code[i], match, rule.pattern))
                faults.push_back(
                    fmt::format("{}:{}: {}; expected {}", path, i + 1, match.str(), rule.instead));
        }
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
    EXPECT_THAT(faults_of("a.h", "// Of one sample.\nint x;\n"),
                ElementsAre(HasSubstr("a.h:1: \"Of one sample.\"")));
    EXPECT_THAT(faults_of("a.h", "int x;  // What is whole needs none\n"), ElementsAre(HasSubstr("a.h:1")));
    EXPECT_THAT(faults_of("a.h", "// Counts the photons\n// near x. Of many, some.\n"),
                ElementsAre(HasSubstr("Of many")));
    EXPECT_THAT(faults_of("a.h", "bool has_borders() const;\n"), ElementsAre(HasSubstr("medium_interface")));
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
