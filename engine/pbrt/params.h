// The parameters of one directive: "type name" [values], typed, placed, and asked for by name.
//
// Whoever reads a directive asks for each parameter it knows; an ill-typed or wrongly sized one is an error
// at its place, and what nobody asked for is a warning. So no parameter can be overlooked in silence.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/vec.h"
#include "engine/pbrt/tokens.h"

namespace lucerna {

// One parameter as the scene declares it.
struct Param {
    enum class Type : std::uint8_t {
        boolean,
        integer,
        real,
        point2,
        vector2,
        point3,
        vector3,
        normal3,
        string,
        texture,
        rgb,
        spectrum,   // wavelengths and values, a name, or a file
        blackbody,  // kelvins; version 3: kelvins and a scale
        xyz
    };
    Type type = Type::real;
    std::string name;
    Place place;   // of the declaration
    Place values;  // of the first value, or the bracket before it
    std::vector<double> numbers;
    std::vector<std::string> strings;
    std::vector<bool> flags;
    bool used = false;

    std::size_t count() const { return numbers.size() + strings.size() + flags.size(); }
    // Of the value with this index; walks through the text, so only for messages.
    Place place_of(std::size_t value) const;
};

class Params {
  public:
    Params() = default;
    // Reads declarations up to the first token that is no string. `owner` names the directive in messages.
    static Params read(Tokens& tokens, std::string owner, const Place& place);

    // Adds those that are not given here, without a warning if they stay unused (pbrt's Attribute directive).
    void add_defaults(const std::vector<Param>& defaults);

    // The parameter of that name, marked as used; null if absent. Throws InputError if its type is another.
    const Param* find(std::string_view name, std::initializer_list<Param::Type> types);
    // Whatever its type; marked as used.
    const Param* find_any(std::string_view name);
    bool has(std::string_view name) const;
    // The name, without marking it used: what stands at an error.
    Place place_of(std::string_view name) const;

    // One value each, or the fallback if the parameter is absent.
    bool boolean(std::string_view name, bool fallback);
    int integer(std::string_view name, int fallback);
    double real(std::string_view name, double fallback);
    std::string string(std::string_view name, std::string_view fallback);
    Rgb rgb(std::string_view name, const Rgb& fallback);
    V3d point(std::string_view name, const V3d& fallback);
    // A number that must lie in [least, most].
    double real_within(std::string_view name, double fallback, double least, double most);

    // Accepts these without a warning: they steer how pbrt works, not what it computes.
    void accept(std::initializer_list<std::string_view> names);
    void warn_unused(Monitor& monitor) const;

    const std::vector<Param>& all() const { return params_; }
    const std::string& owner() const { return owner_; }
    const Place& place() const { return place_; }

  private:
    const Param* find_sized(std::string_view name, std::initializer_list<Param::Type> types,
                            std::size_t count);

    std::vector<Param> params_;
    std::vector<std::string> asked_;  // every name that was looked for: what a warning offers
    std::string owner_;
    Place place_;
};

// As scene text spells it: "float", "point3", ...
std::string_view type_name(Param::Type type);
Rgb to_rgb(const Param& param);  // of three numbers, none negative
int to_integer(const Param& param, std::size_t index);

// Throws InputError: `kind` of `what` is known to pbrt but not here yet, or not known at all.
[[noreturn]] void refuse_kind(const Place& at, std::string_view what, std::string_view kind,
                              std::initializer_list<std::string_view> supported,
                              std::initializer_list<std::string_view> known_elsewhere);

}  // namespace lucerna
