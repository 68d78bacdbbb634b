// Descriptions that people write by hand: TOML, read strictly.
//
// A table is asked for what it should hold, by name and kind, with the range that is accepted; whatever is
// wrong is said with its file, line and column. What nobody asked for is a mistake too: done() names it and
// the nearest name that was asked for. Lengths are text with a unit ("1.2mm", "0.75 m"): a bare number would
// be 40 of what?
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

// A value and where it stands.
struct TomlValue {
    using Array = std::vector<TomlValue>;
    using Table = std::map<std::string, TomlValue, std::less<>>;
    Location place;
    std::variant<bool, std::int64_t, double, std::string, Array, Table> is;
};

class TomlTable {
  public:
    // The whole file, at most 64 MiB. Throws InputError naming file, line and column.
    static TomlTable read(const std::filesystem::path& file);
    // The same from memory; `file` only names it in messages.
    static TomlTable parse(std::string_view text, const std::string& file);

    bool has(std::string_view key) const { return find(key) != nullptr; }
    const Location& place() const { return place_; }
    // Of the value; of the table if there is none of that name.
    Location place_of(std::string_view key) const;

    // Each throws InputError if the value is missing, of another kind or out of range. With a `fallback`, a
    // missing value is that.
    double number(std::string_view key, double least, double most, std::optional<double> fallback = {}) const;
    int whole(std::string_view key, int least, int most, std::optional<int> fallback = {}) const;
    bool flag(std::string_view key, std::optional<bool> fallback = {}) const;
    std::string text(std::string_view key, std::optional<std::string> fallback = {}) const;
    // One of `accepted`.
    std::string choice(std::string_view key, const std::vector<std::string>& accepted,
                       std::optional<std::string> fallback = {}) const;
    // Metres. length is > 0; place may be negative or "0".
    double length(std::string_view key, std::optional<double> fallback = {}) const;
    double position(std::string_view key, std::optional<double> fallback = {}) const;
    // [a, b], or one value for both.
    Imath::V2d lengths(std::string_view key, std::optional<Imath::V2d> fallback = {}) const;
    V2i wholes(std::string_view key, int least, int most, std::optional<V2i> fallback = {}) const;
    // [a, b, …] of numbers in range; any count.
    std::vector<double> numbers(std::string_view key, double least, double most) const;
    // [a, b, …] of times in seconds, each text with its unit ("5s", "2min") or a number of seconds; any
    // count.
    std::vector<double> durations(std::string_view key) const;
    // A path, relative to the folder of this file.
    std::filesystem::path path(std::string_view key) const;

    // [key]; a missing one is an error (ask has() first).
    TomlTable table(std::string_view key) const;
    // [[key]]; none if it is missing.
    std::vector<TomlTable> tables(std::string_view key) const;

    // Throws InputError at the first value that nobody asked this table for. Tables taken out of it have
    // their own done().
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
    std::string name_;  // as people write it, for messages; empty: the file itself
    mutable std::set<std::string, std::less<>> asked_;
};

}  // namespace lucerna
