// The parameters of one directive: "type name" [values], with types and places, retrieved by name.
//
// The reader of a directive asks for each parameter that it knows. As in pbrt, a parameter of the wrong type
// or size counts as not given, the last one of several with one name counts, and one that no reader asks for
// has no effect. Each case is reported (tokens.h), so no parameter is overlooked silently.
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
        blackbody,  // kelvins; in version 3 kelvins and a scale
        xyz
    };
    Type type = Type::real;
    std::string name;
    Place place;   // of the declaration
    Place values;  // of the first value, or the bracket before it
    std::vector<double> numbers;
    std::vector<std::string> strings;
    std::vector<bool> flags;
    const ColourSpace* space = nullptr;  // space of an rgb's numbers; null: linear sRGB
    bool used = false;
    bool said = false;  // its error is already reported

    std::size_t count() const { return numbers.size() + strings.size() + flags.size(); }
    // Returns the place of the value with this index. It scans the text, so it is for messages only.
    Place place_of(std::size_t value) const;
};

// Shared by all directives to which they apply, as lists may be long and blocks and directives many.
using ParamDefaults = std::vector<std::shared_ptr<const Param>>;

class Params {
  public:
    Params() = default;
    // Reads declarations up to the first token that is no string. `owner` names the directive in messages.
    // `ours` marks a directive of Lucerna, read strictly. `leniency` must outlive the result.
    static Params read(Tokens& tokens, std::string owner, const Place& place, Leniency& leniency,
                       bool ours = false);
    // Continues the list.
    void read_more(Tokens& tokens);

    // Hashes names, types and values of the parameters given here.
    void add_to(WordHash& hash) const;

    // Sets the colour space of the numbers.
    void take_colours_in(const ColourSpace* space);

    // Adds defaults of pbrt's Attribute directive, which give no warning if unused.
    void add_defaults(const ParamDefaults& defaults) { defaults_ = defaults; }

    // Returns the parameter of that name and one of these types and marks it used; null if there is none. A
    // texture is preferred to a value.
    const Param* find(std::string_view name, std::initializer_list<Param::Type> types);
    // Returns the parameter of any type and marks it used.
    const Param* find_any(std::string_view name);
    bool has(std::string_view name);
    // Returns the place for an error message about the parameter, without marking it used.
    Place place_of(std::string_view name) const;

    // Return one value, or the fallback if the parameter is absent.
    bool boolean(std::string_view name, bool fallback);
    int integer(std::string_view name, int fallback);
    double real(std::string_view name, double fallback);
    std::string string(std::string_view name, std::string_view fallback);
    V3d point(std::string_view name, const V3d& fallback);
    // Returns a number clamped to [least, most].
    double real_within(std::string_view name, double fallback, double least, double most);

    // Accepts these without a warning, because they steer how pbrt works and not its results.
    void accept(std::initializer_list<std::string_view> names);
    void depart_unused() const;
    // Calls Leniency::warn_or_refuse(), or throws if the directive is Lucerna's own.
    void warn_or_refuse(const Place& at, std::string_view what, std::string_view instead,
                        std::string_view lost = {}) const;
    // Reports like warn_or_refuse() once for a parameter that is looked up several times.
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
    std::vector<std::string> asked_;  // names that were looked up, which a warning suggests
    std::string owner_;
    Place place_;
    Leniency* leniency_ = nullptr;
    bool ours_ = false;
};

// Returns the type's name in scene text: "float", "point3", ...
std::string_view type_name(Param::Type type);

// Throws TextError: `kind` of `what` is known to pbrt but not supported, or unknown.
[[noreturn]] void refuse_kind(const Place& at, std::string_view what, std::string_view kind,
                              std::initializer_list<std::string_view> supported,
                              std::initializer_list<std::string_view> known_elsewhere);

}  // namespace lucerna
