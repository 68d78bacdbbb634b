// Reads TOML, in which people write descriptions by hand, strictly.
//
// The caller asks a table for each value by name, kind and accepted range. Errors name file, line and column.
// A value that nobody asked for is an error, too: done() names it and the most similar name that was asked
// for. Lengths are text with a unit ("1.2mm", "0.75 m"), because the unit of a bare number could only be
// guessed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/vec.h"

namespace lucerna {

// Holds a value and its place in the file.
struct TomlValue {
    using Array = std::vector<TomlValue>;
    using Table = std::map<std::string, TomlValue, std::less<>>;
    Location place;
    std::variant<bool, std::int64_t, double, std::string, Array, Table> is;
};

class TomlTable {
  public:
    // Reads a file of at most 64 MiB. Throws InputError naming file, line and column.
    static TomlTable read(const std::filesystem::path& file);
    // Reads a text; `file` only names it in messages.
    static TomlTable parse(std::string_view text, const std::string& file);

    bool has(std::string_view key) const { return find(key) != nullptr; }
    const Location& place() const { return place_; }
    // Returns the place of a value, or of the table if it has none of that name.
    Location place_of(std::string_view key) const;

    // Each of these throws InputError if the value is missing, of another kind or out of range. A `fallback`
    // replaces a missing value.
    double number(std::string_view key, double least, double most, std::optional<double> fallback = {}) const;
    int whole(std::string_view key, int least, int most, std::optional<int> fallback = {}) const;
    bool flag(std::string_view key, std::optional<bool> fallback = {}) const;
    std::string text(std::string_view key, std::optional<std::string> fallback = {}) const;
    // Returns one of `accepted`.
    std::string choice(std::string_view key, const std::vector<std::string>& accepted,
                       std::optional<std::string> fallback = {}) const;
    // Return metres. A length is greater than 0; a position may be negative or "0".
    double length(std::string_view key, std::optional<double> fallback = {}) const;
    double position(std::string_view key, std::optional<double> fallback = {}) const;
    // Read [a, b], or one value for both.
    Imath::V2d lengths(std::string_view key, std::optional<Imath::V2d> fallback = {}) const;
    V2i wholes(std::string_view key, int least, int most, std::optional<V2i> fallback = {}) const;
    // Reads a list of any number of numbers in the range.
    std::vector<double> numbers(std::string_view key, double least, double most) const;
    // Reads a list of any number of times in seconds, each a text with a unit ("5s", "2min") or a number.
    std::vector<double> durations(std::string_view key) const;
    // Returns a path that is relative to the folder of this file.
    std::filesystem::path path(std::string_view key) const;

    // Returns [key]. Throws if it is missing, so ask has() first.
    TomlTable table(std::string_view key) const;
    // Returns all of [[key]], or none if it is missing.
    std::vector<TomlTable> tables(std::string_view key) const;

    // Throws InputError at the first value that nobody asked this table for. Its inner tables have their own
    // done().
    void done() const;

  private:
    TomlTable(TomlValue::Table values, Location place, std::string name)
        : values_(std::move(values)), place_(std::move(place)), name_(std::move(name)) {}
    const TomlValue* find(std::string_view key) const;
    const TomlValue& need(std::string_view key) const;
    template <typename T>
    const T& as(std::string_view key, const TomlValue& value, std::string_view what) const;
    double real(std::string_view key, const TomlValue& value, double least, double most) const;

    TomlValue::Table values_;
    Location place_;
    std::string name_;  // as in the file, for messages; empty for the file itself
    mutable std::set<std::string, std::less<>> asked_;
};

}  // namespace lucerna
