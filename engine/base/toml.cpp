#include "engine/base/toml.h"

#include <fmt/format.h>

#include <cmath>

// toml++ takes for granted what a text may break ("[#": a table's name that does not begin as one), and lets
// the compiler rely on it. Here its assertions stay on, as errors of the input.
#undef NDEBUG
namespace {
struct TomlFault {};
[[noreturn]] void toml_fault() {
    throw TomlFault();
}
}  // namespace
#define TOML_ASSERT(expression) (static_cast<bool>(expression) ? void() : toml_fault())
#include <toml++/toml.h>

#include "engine/base/files.h"
#include "engine/base/names.h"
#include "engine/base/units.h"

namespace lucerna {
namespace {

constexpr int kMostNested = 32;  // tables and arrays within each other

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
        throw InputError(value.place, "dates and times are not accepted; text in quotes is");
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
    require_readable(file);
    constexpr std::uintmax_t kMost = std::uintmax_t{64} << 20;
    std::error_code unknown;
    if (std::filesystem::file_size(file, unknown) > kMost && !unknown)
        throw InputError({file.string()}, "larger than 64 MiB; this is no description");
    return parse(read_text(file), file.string());
}

TomlTable TomlTable::parse(std::string_view text, const std::string& file) {
    try {
        const toml::table table = toml::parse(text, file);
        TomlValue root = copy(table, file, 0);
        return {std::get<TomlValue::Table>(std::move(root.is)), {file}, {}};
    } catch (const toml::parse_error& error) {
        const toml::source_position at = error.source().begin;
        throw InputError({file, static_cast<int>(at.line), static_cast<int>(at.column)},
                         one_line(error.description()));
    } catch (const TomlFault&) {
        throw InputError({file}, "is not TOML: a name begins with a character that no name may begin with");
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
    if (!held) input_error(value.place, "\"{}\" is {}; {} is accepted", key, kind_of(value), what);
    return *held;
}

double TomlTable::real(std::string_view key, const TomlValue& value, double least, double most) const {
    const auto* whole = std::get_if<std::int64_t>(&value.is);
    const double number = whole ? static_cast<double>(*whole) : as<double>(key, value, "a number");
    if (!(number >= least && number <= most)) {  // false for NaN
        input_error(value.place, "\"{}\" of {:g} is not accepted; {:g} to {:g} is", key, number, least, most);
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
        input_error(value.place, "\"{}\" of {} is not accepted; {} to {} is", key, number, least, most);
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
        input_error(place_of(key), "\"{}\" of \"{}\" is unknown; {}accepted are {}", key, one_line(word),
                    did_you_mean(word, known), fmt::join(known, ", "));
    }
    return word;
}

double TomlTable::length(std::string_view key, std::optional<double> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    return parse_length(value.place, as<std::string>(key, value, "a length with its unit, as \"40mm\","));
}

double TomlTable::position(std::string_view key, std::optional<double> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    return parse_place(value.place,
                       as<std::string>(key, value, "a place with its unit, as \"-2mm\" or \"0\","));
}

Imath::V2d TomlTable::lengths(std::string_view key, std::optional<Imath::V2d> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    if (std::holds_alternative<std::string>(value.is)) return Imath::V2d(length(key));
    const auto& items = as<TomlValue::Array>(key, value, "a length or a list of two");
    if (items.size() != 2)
        input_error(value.place, "\"{}\" has {} values; 2 are accepted", key, items.size());
    const auto one = [&](const TomlValue& item) {
        return parse_length(item.place, as<std::string>(key, item, "a length with its unit, as \"40mm\","));
    };
    return {one(items[0]), one(items[1])};
}

V2i TomlTable::wholes(std::string_view key, int least, int most, std::optional<V2i> fallback) const {
    if (fallback && !has(key)) return *fallback;
    const TomlValue& value = need(key);
    if (std::holds_alternative<std::int64_t>(value.is)) return V2i(whole(key, least, most));
    const auto& items = as<TomlValue::Array>(key, value, "a whole number or a list of two");
    if (items.size() != 2)
        input_error(value.place, "\"{}\" has {} values; 2 are accepted", key, items.size());
    V2i both;
    for (int a = 0; a < 2; ++a) {
        const TomlValue& item = items[static_cast<std::size_t>(a)];
        const auto number = as<std::int64_t>(key, item, "a whole number");
        if (number < least || number > most)
            input_error(item.place, "\"{}\" of {} is not accepted; {} to {} is", key, number, least, most);
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

std::filesystem::path TomlTable::path(std::string_view key) const {
    const std::string name = text(key);
    if (name.empty()) input_error(place_of(key), "\"{}\" is empty; a file's name is accepted", key);
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
        input_error(value.place, "\"{}\" is unknown here; {}known are {}", one_line(key),
                    did_you_mean(key, known), fmt::join(known, ", "));
    }
}

}  // namespace lucerna
