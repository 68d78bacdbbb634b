#include "engine/system/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

// toml++ asserts conditions that a text may violate (in "[#" the table's name begins with an invalid
// character) and lets the compiler assume them. Here its assertions stay on and throw.
#undef NDEBUG
namespace {
struct TomlFault {};
[[noreturn]] void toml_fault() {
    throw TomlFault();
}
}  // namespace
#define TOML_ASSERT(expression) (static_cast<bool>(expression) ? void() : toml_fault())
#define TOML_MAX_NESTED_VALUES 32
#include <toml++/toml.h>

#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"
#include "engine/text/spelling.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr int kMostNested = TOML_MAX_NESTED_VALUES;
constexpr std::size_t kLongest = std::size_t{64} << 20;

// Returns the place behind the string that begins at `at`. Three quotes end it, or one; \" does not end a
// string in double quotes. At a string that is not valid toml++ stops, so what follows it may be misjudged.
std::size_t end_of_string(std::string_view text, std::size_t at) {
    const std::string three(3, text[at]);
    const std::string_view end = text.substr(at).starts_with(three) ? three : text.substr(at, 1);
    const bool escapes = text[at] == '"';
    for (at += end.size(); at < text.size() && !text.substr(at).starts_with(end); ++at) {
        if (escapes && text[at] == '\\') ++at;
        if (end.size() == 1 && at < text.size() && text[at] == '\n') return at;
    }
    at = std::min(at + end.size(), text.size());
    // Up to two more quotes belong to a long string.
    return end.size() == 1 ? at : std::min(text.find_first_not_of(three[0], at), text.size());
}

// Returns the place behind a byte-order mark.
std::size_t begin_of(std::string_view text) {
    constexpr std::string_view kMark = "\xef\xbb\xbf";
    return text.starts_with(kMark) ? kMark.size() : 0;
}

bool is_ascii(char c) {
    return (static_cast<unsigned char>(c) & 0x80U) == 0;
}

[[noreturn]] void refuse_at(std::string_view text, std::size_t at, const std::string& file,
                            const std::string& why) {
    const std::string_view before = text.substr(0, at);
    throw InputError({file, static_cast<int>(std::ranges::count(before, '\n')) + 1,
                      static_cast<int>(at - (before.rfind('\n') + 1)) + 1},
                     why);
}

// Refuses a string in double quotes in which a character beyond ASCII follows a backslash and blanks.
void check_escapes(std::string_view text, std::size_t at, std::size_t end, const std::string& file) {
    if (text[at] != '"') return;
    while ((at = text.find('\\', at)) < end) {
        const std::size_t next = std::min(text.find_first_not_of(" \t\r\n", at + 1), end);
        if (next < end && !is_ascii(text[next]))
            refuse_at(text, next, file, "a character beyond ASCII after a backslash in a text in quotes");
        at += 2;
    }
}

// Refuses what toml++ accepts and cannot handle. It makes a table in a table for each dot of a key and
// destroys these by recursion, and only limits how deep lists and tables in braces are nested. It classifies
// characters beyond ASCII by code that it marks as unreachable; TOML has them in strings and comments alone.
// A quote in the midst of a name or value begins no string for toml++, which then classifies what follows.
void check(std::string_view text, const std::string& file) {
    constexpr std::string_view kBeforeStrings = " \t\r\n=[{,.";
    const std::size_t begin = begin_of(text);
    int dots = 0;
    for (std::size_t at = begin; at < text.size();) {
        const char c = text[at];
        if (c == '"' || c == '\'') {
            if (at > begin && kBeforeStrings.find(text[at - 1]) == std::string_view::npos)
                refuse_at(text, at, file, "a quote in the midst of a name or value");
            const std::size_t end = end_of_string(text, at);
            check_escapes(text, at, end, file);
            at = end;
            continue;
        }
        if (c == '#') {
            at = std::min(text.find('\n', at), text.size());
            continue;
        }
        if (!is_ascii(c))
            refuse_at(text, at, file, "a name or value with a character beyond ASCII needs quotes");
        if (c == '.' && ++dots > kMostNested) {
            refuse_at(text, at, file,
                      fmt::format("tables nested more than {} deep, each dot of a key being one of them",
                                  kMostNested));
        }
        if (std::string_view("[]{},\n").find(c) != std::string_view::npos) dots = 0;
        ++at;
    }
}

Location place_of_node(const toml::node& node, const std::string& file) {
    const toml::source_position at = node.source().begin;
    return {file, static_cast<int>(at.line), static_cast<int>(at.column)};
}

TomlValue copy(const toml::node& node, const std::string& file, int depth) {
    TomlValue value;
    value.place = place_of_node(node, file);
    if (depth > kMostNested) input_error(value.place, "nested more than {} deep", kMostNested);
    if (const toml::table* table = node.as_table()) {
        TomlValue::Table entries;
        for (const auto& [key, entry] : *table)
            entries.emplace(std::string(key.str()), copy(entry, file, depth + 1));
        value.is = std::move(entries);
    } else if (const toml::array* array = node.as_array()) {
        TomlValue::Array items;
        for (const toml::node& item : *array) items.push_back(copy(item, file, depth + 1));
        value.is = std::move(items);
    } else if (const auto* text = node.as_string()) {
        value.is = text->get();
    } else if (const auto* whole = node.as_integer()) {
        value.is = whole->get();
    } else if (const auto* real = node.as_floating_point()) {
        value.is = real->get();
    } else if (const auto* truth = node.as_boolean()) {
        value.is = truth->get();
    } else {
        throw InputError(value.place, "dates and times are not accepted; expected text in quotes");
    }
    return value;
}

std::string_view kind_of(const TomlValue& value) {
    constexpr std::string_view kKinds[] = {"true or false", "a whole number", "a number",
                                           "text",          "a list",         "a table"};
    return kKinds[value.is.index()];
}

}  // namespace

TomlTable TomlTable::read(const std::filesystem::path& file) {
    return parse(read_text(file), file.string());
}

TomlTable TomlTable::parse(std::string_view text, const std::string& file) {
    if (text.size() > kLongest)
        input_error({file}, "is longer than {} MiB, the limit for a description", kLongest >> 20);
    // toml++ and copy() take some 400 bytes for a value, with the text of its place.
    const auto values = std::ranges::count_if(
        text, [](char c) { return std::string_view("[{.=,\n").find(c) != std::string_view::npos; });
    require_memory(bytes_of(static_cast<std::uint64_t>(values), 400), file, "use a shorter description");
    check(text, file);
    try {
        // Where toml++ refuses the text with letters in place of all characters beyond ASCII, it would
        // classify them (see check()): a quote within a value begins no string for it.
        const std::string_view written = text.substr(begin_of(text));
        if (!std::ranges::all_of(written, is_ascii)) {
            std::string plain(written);
            for (char& c : plain) c = is_ascii(c) ? c : 'x';
            static_cast<void>(toml::parse(plain, file));
        }
        const toml::table table = toml::parse(text, file);
        TomlValue root = copy(table, file, 0);
        return {std::get<TomlValue::Table>(std::move(root.is)), {file}, {}};
    } catch (const toml::parse_error& error) {
        const toml::source_position at = error.source().begin;
        throw InputError({file, static_cast<int>(at.line), static_cast<int>(at.column)},
                         one_line(error.description()));
    } catch (const TomlFault&) {
        throw InputError({file}, "is not TOML: a name begins with an invalid character");
    }
}

const TomlValue* TomlTable::find(std::string_view key) const {
    if (!asked_.contains(key)) asked_.emplace(key);
    const auto at = values_.find(key);
    return at == values_.end() ? nullptr : &at->second;
}

Location TomlTable::place_of(std::string_view key) const {
    const TomlValue* value = find(key);
    return value ? value->place : place_;
}

const TomlValue& TomlTable::need(std::string_view key) const {
    const TomlValue* value = find(key);
    if (!value) {
        input_error(place_, "{} lacks \"{}\"", name_.empty() ? std::string("the file") : "[" + name_ + "]",
                    key);
    }
    return *value;
}

template <typename T>
const T& TomlTable::as(std::string_view key, const TomlValue& value, std::string_view what) const {
    const T* held = std::get_if<T>(&value.is);
    if (!held) input_error(value.place, "\"{}\" is {}; expected {}", key, kind_of(value), what);
    return *held;
}

double TomlTable::real(std::string_view key, const TomlValue& value, double least, double most) const {
    const auto* whole = std::get_if<std::int64_t>(&value.is);
    const double number = whole ? static_cast<double>(*whole) : as<double>(key, value, "a number");
    if (!(number >= least && number <= most)) {  // false for NaN
        input_error(value.place, "\"{}\" of {:g} is not accepted; expected {:g} to {:g}", key, number, least,
                    most);
    }
    return number;
}

double TomlTable::number(std::string_view key, double least, double most,
                         std::optional<double> fallback) const {
    if (fallback && !has(key)) return *fallback;
    return real(key, need(key), least, most);
}

int TomlTable::whole(std::string_view key, int least, int most, std::optional<int> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    const auto number = as<std::int64_t>(key, value, "a whole number");
    if (number < least || number > most)
        input_error(value.place, "\"{}\" of {} is not accepted; expected {} to {}", key, number, least, most);
    return static_cast<int>(number);
}

bool TomlTable::flag(std::string_view key, std::optional<bool> fallback) const {
    if (fallback && !has(key)) return *fallback;
    return as<bool>(key, need(key), "true or false");
}

std::string TomlTable::text(std::string_view key, std::optional<std::string> fallback) const {
    if (fallback && !has(key)) return *fallback;
    return as<std::string>(key, need(key), "text in quotes");
}

std::string TomlTable::choice(std::string_view key, const std::vector<std::string>& accepted,
                              std::optional<std::string> fallback) const {
    const std::string word = text(key, std::move(fallback));
    const std::vector<std::string_view> known(accepted.begin(), accepted.end());
    if (std::find(known.begin(), known.end(), word) == known.end()) {
        input_error(place_of(key), "\"{}\" of \"{}\" is unknown; {}expected {}", key, one_line(word),
                    did_you_mean(word, known), fmt::join(known, ", "));
    }
    return word;
}

double TomlTable::length(std::string_view key, std::optional<double> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    return parse_length(value.place,
                        as<std::string>(key, value, "a length with its unit, for example \"40mm\""));
}

double TomlTable::position(std::string_view key, std::optional<double> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    return parse_place(
        value.place, as<std::string>(key, value, "a position with its unit, for example \"-2mm\" or \"0\""));
}

Imath::V2d TomlTable::lengths(std::string_view key, std::optional<Imath::V2d> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    if (std::holds_alternative<std::string>(value.is)) return Imath::V2d(length(key));
    const auto& items = as<TomlValue::Array>(key, value, "a length or a list of two");
    if (items.size() != 2) input_error(value.place, "\"{}\" has {} values; expected 2", key, items.size());
    const auto one = [&](const TomlValue& item) {
        return parse_length(item.place,
                            as<std::string>(key, item, "a length with its unit, for example \"40mm\""));
    };
    return {one(items[0]), one(items[1])};
}

V2i TomlTable::wholes(std::string_view key, int least, int most, std::optional<V2i> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    if (std::holds_alternative<std::int64_t>(value.is)) return V2i(whole(key, least, most));
    const auto& items = as<TomlValue::Array>(key, value, "a whole number or a list of two");
    if (items.size() != 2) input_error(value.place, "\"{}\" has {} values; expected 2", key, items.size());
    V2i both;
    for (int a = 0; a < 2; ++a) {
        const TomlValue& item = items[static_cast<std::size_t>(a)];
        const auto number = as<std::int64_t>(key, item, "a whole number");
        if (number < least || number > most)
            input_error(item.place, "\"{}\" of {} is not accepted; expected {} to {}", key, number, least,
                        most);
        both[a] = static_cast<int>(number);
    }
    return both;
}

std::vector<double> TomlTable::numbers(std::string_view key, double least, double most) const {
    std::vector<double> all;
    for (const TomlValue& item : as<TomlValue::Array>(key, need(key), "a list of numbers"))
        all.push_back(real(key, item, least, most));
    return all;
}

std::vector<double> TomlTable::durations(std::string_view key) const {
    constexpr double kMost = 1e9;  // seconds
    std::vector<double> all;
    for (const TomlValue& item :
         as<TomlValue::Array>(key, need(key), "a list of times, for example [\"5s\"]")) {
        const auto* text = std::get_if<std::string>(&item.is);
        const bool number =
            std::holds_alternative<std::int64_t>(item.is) || std::holds_alternative<double>(item.is);
        if (!text && !number) {
            input_error(item.place, "\"{}\" has {}; expected times, as \"5s\", or numbers of seconds", key,
                        kind_of(item));
        }
        all.push_back(text ? parse_duration(item.place, *text) : real(key, item, 0, kMost));
        if (!(all.back() > 0 && all.back() <= kMost))
            input_error(item.place,
                        "\"{}\" of {:g} s is not accepted; expected more than 0, and at most {:g} s", key,
                        all.back(), kMost);
    }
    return all;
}

std::filesystem::path TomlTable::path(std::string_view key) const {
    const std::string name = text(key);
    if (name.empty()) input_error(place_of(key), "\"{}\" is empty; expected a file name", key);
    return std::filesystem::path(place_.file).parent_path() / name;
}

TomlTable TomlTable::table(std::string_view key) const {
    const TomlValue& value = need(key);
    return {as<TomlValue::Table>(key, value, "a table"), value.place,
            name_.empty() ? std::string(key) : fmt::format("{}.{}", name_, key)};
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) const {
    std::vector<TomlTable> all;
    if (!has(key)) return all;
    for (const TomlValue& item : as<TomlValue::Array>(key, need(key), "a list of tables")) {
        all.push_back(TomlTable(as<TomlValue::Table>(key, item, "a table"), item.place,
                                name_.empty() ? std::string(key) : fmt::format("{}.{}", name_, key)));
    }
    return all;
}

void TomlTable::done() const {
    for (const auto& [key, value] : values_) {
        if (asked_.contains(key)) continue;
        const std::vector<std::string_view> known(asked_.begin(), asked_.end());
        input_error(value.place, "\"{}\" is unknown here; {}expected {}", one_line(key),
                    did_you_mean(key, known), fmt::join(known, ", "));
    }
}

}  // namespace lucerna
