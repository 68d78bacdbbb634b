// The parameters of one directive: "type name" [values], typed, placed, and asked for by name.
//
// Whoever reads a directive asks for each parameter it knows. As in pbrt, one that is ill-typed or wrongly
// sized counts as not given, of two with one name the last one counts, and what nobody asked for has no
// effect; each of these is said (tokens.h), so that no parameter can be overlooked in silence.
#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/vec.h"
#include "engine/colour/colour_space.h"
#include "engine/pbrt/tokens.h"
#include "engine/system/hash.h"

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
    const ColourSpace* space = nullptr;  // of the numbers of an rgb; null: linear sRGB
    bool used = false;
    bool said = false;  // that it cannot be taken as it stands

    std::size_t count() const { return numbers.size() + strings.size() + flags.size(); }
    // Of the value with this index; walks through the text, so only for messages.
    Place place_of(std::size_t value) const;
};

// Shared by all directives that have them: they may be long lists, and blocks and directives many.
using ParamDefaults = std::vector<std::shared_ptr<const Param>>;

class Params {
  public:
    Params() = default;
    // Reads declarations up to the first token that is no string. `owner` names the directive in messages;
    // `ours`: a directive that pbrt does not have, which is taken strictly. `leniency` must outlive them.
    static Params read(Tokens& tokens, std::string owner, const Place& place, Leniency& leniency,
                       bool ours = false);
    // The list goes on.
    void read_more(Tokens& tokens);

    // Names, types and values of those that are given here.
    void add_to(WordHash& hash) const;

    // The space that the numbers of colours are in.
    void take_colours_in(const ColourSpace* space);

    // Adds those that are not given here, without a warning if they stay unused (pbrt's Attribute directive).
    void add_defaults(const ParamDefaults& defaults) { defaults_ = defaults; }

    // The parameter of that name and one of these types, marked as used; null if there is none. Of a texture
    // and a value the texture is taken.
    const Param* find(std::string_view name, std::initializer_list<Param::Type> types);
    // Whatever its type; marked as used.
    const Param* find_any(std::string_view name);
    bool has(std::string_view name);
    // The name, without marking it used: what stands at an error.
    Place place_of(std::string_view name) const;

    // One value each, or the fallback if the parameter is absent.
    bool boolean(std::string_view name, bool fallback);
    int integer(std::string_view name, int fallback);
    double real(std::string_view name, double fallback);
    std::string string(std::string_view name, std::string_view fallback);
    V3d point(std::string_view name, const V3d& fallback);
    // A number held in [least, most].
    double real_within(std::string_view name, double fallback, double least, double most);

    // Accepts these without a warning: they steer how pbrt works, not what it computes.
    void accept(std::initializer_list<std::string_view> names);
    void depart_unused() const;
    // Leniency's depart(), or an error if the directive is ours.
    void depart(const Place& at, std::string_view what, std::string_view instead,
                std::string_view lost = {}) const;
    // The same for a parameter that is asked for several times: said once.
    void depart_once(const Param& param, std::string_view what, std::string_view instead);

    const std::vector<Param>& all() const { return params_; }
    const std::string& owner() const { return owner_; }
    const Place& place() const { return place_; }
    bool ours() const { return ours_; }

  private:
    void add(Param param);
    void depart_oddities(const Source& source) const;
    const Param* find_sized(std::string_view name, std::initializer_list<Param::Type> types,
                            std::size_t count);

    void note_asked(std::string_view name);
    const Param* known(std::string_view name) const;  // null: neither given nor a default

    std::vector<Param> params_;
    ParamDefaults defaults_;
    std::vector<std::string> asked_;  // every name that was looked for: what a warning offers
    std::string owner_;
    Place place_;
    Leniency* leniency_ = nullptr;
    bool ours_ = false;
};

// As scene text spells it: "float", "point3", ...
std::string_view type_name(Param::Type type);

// Throws TextError: `kind` of `what` is known to pbrt but not here yet, or not known at all.
[[noreturn]] void refuse_kind(const Place& at, std::string_view what, std::string_view kind,
                              std::initializer_list<std::string_view> supported,
                              std::initializer_list<std::string_view> known_elsewhere);

}  // namespace lucerna
