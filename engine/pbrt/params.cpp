#include "engine/pbrt/params.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/names.h"

namespace lucerna {
namespace {

using Type = Param::Type;

struct TypeWord {
    std::string_view word;
    Type type;
};
constexpr TypeWord kTypeWords[] = {
    {"bool", Type::boolean},
    {"integer", Type::integer},
    {"float", Type::real},
    {"point2", Type::point2},
    {"vector2", Type::vector2},
    {"point3", Type::point3},
    {"vector3", Type::vector3},
    {"normal3", Type::normal3},
    {"string", Type::string},
    {"texture", Type::texture},
    {"rgb", Type::rgb},
    {"spectrum", Type::spectrum},
    {"blackbody", Type::blackbody},
    {"xyz", Type::xyz},
    // Names of older versions of pbrt.
    {"point", Type::point3},
    {"vector", Type::vector3},
    {"normal", Type::normal3},
    {"color", Type::rgb},
};

Type type_of(std::string_view word, std::string_view declaration, const Place& at) {
    for (const TypeWord& known : kTypeWords) {
        if (known.word == word) return known.type;
    }
    std::vector<std::string_view> words;
    for (const TypeWord& known : kTypeWords) words.push_back(known.word);
    fail(at, "\"{}\": unknown type \"{}\"; {}known are {}", shown(declaration), shown(word),
         did_you_mean(word, words), fmt::join(words, ", "));
}

// Numbers that make up one value of the type.
std::size_t width_of(Type type) {
    switch (type) {
        case Type::point2:
        case Type::vector2:
            return 2;
        case Type::point3:
        case Type::vector3:
        case Type::normal3:
        case Type::rgb:
        case Type::xyz:
            return 3;
        default:
            return 1;
    }
}

bool is_numeric(Type type) {
    return type != Type::boolean && type != Type::string && type != Type::texture;
}

std::string declared(const Param& param) {
    return fmt::format("\"{} {}\"", type_name(param.type), shown(param.name));
}

// Takes one value that is not a number from the tokens.
void read_word_value(Tokens& tokens, Param& param) {
    const Place at = tokens.place();
    const Token token = tokens.next();
    const bool is_string = token.kind == Token::Kind::string;
    if (param.type == Type::boolean) {  // true; "true" in older versions
        if ((is_string || token.kind == Token::Kind::word) &&
            (token.text == "true" || token.text == "false")) {
            param.flags.push_back(token.text == "true");
            return;
        }
        fail(at, "{}: {} is no truth value; true or false is accepted", declared(param), shown(token.text));
    }
    const bool names_a_spectrum = param.type == Type::spectrum && is_string;
    if ((is_numeric(param.type) && !names_a_spectrum) || !is_string) {
        fail(at, "{}: \"{}\" is not accepted; {} is", declared(param), shown(token.text),
             is_numeric(param.type) ? "a number" : "a string in quotes");
    }
    param.strings.push_back(string_value(token, at));
}

void read_values(Tokens& tokens, Param& param) {
    using Kind = Token::Kind;
    param.values = tokens.place();
    if (tokens.peek().kind == Kind::end) fail(param.values, "{} has no value", declared(param));
    if (tokens.peek().kind != Kind::open) {
        if (is_numeric(param.type) && tokens.peek().kind == Kind::number) {
            param.numbers.push_back(number_value(tokens.peek().text, param.values));
            tokens.next();
        } else {
            read_word_value(tokens, param);
        }
        return;
    }
    tokens.next();
    while (tokens.peek().kind != Kind::close) {
        if (tokens.peek().kind == Kind::end)
            fail(param.values, "{}: this [ is never closed", declared(param));
        if (is_numeric(param.type) && tokens.peek().kind == Kind::number) {
            tokens.read_numbers(param.numbers);
        } else {
            read_word_value(tokens, param);
        }
    }
    tokens.next();
}

// "type name" taken apart; any number of blanks between.
Param declare(const Token& token, const Place& at) {
    constexpr std::string_view blanks = " \t";
    const std::string_view text = token.text;
    const std::size_t type_begin = std::min(text.find_first_not_of(blanks), text.size());
    const std::size_t type_end = std::min(text.find_first_of(blanks, type_begin), text.size());
    const std::size_t name_begin = std::min(text.find_first_not_of(blanks, type_end), text.size());
    const std::size_t name_end = std::min(text.find_first_of(blanks, name_begin), text.size());
    const bool two_words = name_begin < name_end && text.find_first_not_of(blanks, name_end) == text.npos;
    if (!two_words) {
        fail(at, "\"{}\" declares no parameter; \"type name\" does, like \"float radius\"", shown(text));
    }
    Param param;
    param.place = at;
    param.type = type_of(text.substr(type_begin, type_end - type_begin), text, at);
    param.name = text.substr(name_begin, name_end - name_begin);
    return param;
}

}  // namespace

std::string_view type_name(Type type) {
    return kTypeWords[static_cast<std::size_t>(type)].word;  // the first entries stand in the order of Type
}

Place Param::place_of(std::size_t value) const {
    if (!values.source) return place;
    Tokens tokens(*values.source, values.offset);
    if (tokens.peek().kind == Token::Kind::open) tokens.next();
    for (; value > 0 && tokens.peek().kind != Token::Kind::close; --value) tokens.next();
    return tokens.place();
}

Params Params::read(Tokens& tokens, std::string owner, const Place& place) {
    Params result;
    result.owner_ = std::move(owner);
    result.place_ = place;
    while (tokens.peek().kind == Token::Kind::string) {
        const Place at = tokens.place();
        Param param = declare(tokens.next(), at);
        if (result.has(param.name)) {
            fail(at, "parameter \"{}\" of {} is given twice", shown(param.name), result.owner_);
        }
        read_values(tokens, param);
        const std::size_t width = width_of(param.type);
        if (param.numbers.size() % width != 0) {
            fail(at, "{} of {} has {} numbers; a multiple of {} is accepted", declared(param), result.owner_,
                 param.numbers.size(), width);
        }
        result.params_.push_back(std::move(param));
    }
    return result;
}

void Params::add_defaults(const std::vector<Param>& defaults) {
    for (const Param& param : defaults) {
        if (has(param.name)) continue;
        params_.push_back(param);
        params_.back().used = true;
    }
}

bool Params::has(std::string_view name) const {
    return std::any_of(params_.begin(), params_.end(), [&](const Param& p) { return p.name == name; });
}

Place Params::place_of(std::string_view name) const {
    const auto found =
        std::find_if(params_.begin(), params_.end(), [&](const Param& p) { return p.name == name; });
    return found == params_.end() ? place_ : found->place;
}

const Param* Params::find_any(std::string_view name) {
    if (std::find(asked_.begin(), asked_.end(), name) == asked_.end()) asked_.emplace_back(name);
    for (Param& param : params_) {
        if (param.name != name) continue;
        param.used = true;
        return &param;
    }
    return nullptr;
}

const Param* Params::find(std::string_view name, std::initializer_list<Type> types) {
    const Param* param = find_any(name);
    if (param && std::find(types.begin(), types.end(), param->type) == types.end()) {
        std::vector<std::string_view> accepted;
        for (const Type type : types) accepted.push_back(type_name(type));
        fail(param->place, "{} of {} has the wrong type; \"{} {}\" is accepted", declared(*param), owner_,
             fmt::join(accepted, "|"), name);
    }
    return param;
}

const Param* Params::find_sized(std::string_view name, std::initializer_list<Type> types, std::size_t count) {
    const Param* param = find(name, types);
    if (param && param->count() != count) {
        fail(param->place, "{} of {} has {} values; {} {} accepted", declared(*param), owner_, param->count(),
             count, count == 1 ? "is" : "are");
    }
    return param;
}

bool Params::boolean(std::string_view name, bool fallback) {
    const Param* param = find_sized(name, {Type::boolean}, 1);
    return param ? param->flags.front() : fallback;
}

int Params::integer(std::string_view name, int fallback) {
    const Param* param = find_sized(name, {Type::integer}, 1);
    return param ? to_integer(*param, 0) : fallback;
}

double Params::real(std::string_view name, double fallback) {
    const Param* param = find_sized(name, {Type::real}, 1);
    return param ? param->numbers.front() : fallback;
}

double Params::real_within(std::string_view name, double fallback, double least, double most) {
    const double value = real(name, fallback);
    if (value < least || value > most) {
        fail(place_of(name), "{} of {}: {:g} is not accepted; {:g} to {:g} is", name, owner_, value, least,
             most);
    }
    return value;
}

std::string Params::string(std::string_view name, std::string_view fallback) {
    const Param* param = find_sized(name, {Type::string}, 1);
    return param ? param->strings.front() : std::string(fallback);
}

Rgb Params::rgb(std::string_view name, const Rgb& fallback) {
    const Param* param = find(name, {Type::rgb});
    return param ? to_rgb(*param) : fallback;
}

V3d Params::point(std::string_view name, const V3d& fallback) {
    const Param* param = find_sized(name, {Type::point3}, 3);
    return param ? V3d(param->numbers[0], param->numbers[1], param->numbers[2]) : fallback;
}

void Params::accept(std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names) find_any(name);
}

void Params::warn_unused(Monitor& monitor) const {
    for (const Param& param : params_) {
        if (param.used) continue;
        const std::vector<std::string_view> known(asked_.begin(), asked_.end());
        const std::string names =
            known.empty() ? "it takes none" : fmt::format("known are {}", fmt::join(known, ", "));
        monitor.warn(fmt::format("{}: {} of {} has no effect; {}{}", to_string(param.place.location()),
                                 declared(param), owner_, did_you_mean(param.name, known), names));
    }
}

Rgb to_rgb(const Param& param) {
    if (param.numbers.size() != 3) {
        fail(param.place, "{} has {} numbers; 3 are accepted", declared(param), param.numbers.size());
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const double value = param.numbers[i];
        if (value < 0 || value > static_cast<double>(std::numeric_limits<float>::max())) {
            fail(param.place_of(i), "{}: {:g} is not accepted; 0 to 3.4e38 is", declared(param), value);
        }
    }
    return {static_cast<float>(param.numbers[0]), static_cast<float>(param.numbers[1]),
            static_cast<float>(param.numbers[2])};
}

int to_integer(const Param& param, std::size_t index) {
    const double value = param.numbers[index];
    if (value != std::floor(value) || std::fabs(value) > std::numeric_limits<int>::max()) {
        fail(param.place_of(index), "{}: {:.10g} is not accepted; a whole number below 2147483648 is",
             declared(param), value);
    }
    return static_cast<int>(value);
}

void refuse_kind(const Place& at, std::string_view what, std::string_view kind,
                 std::initializer_list<std::string_view> supported,
                 std::initializer_list<std::string_view> known_elsewhere) {
    if (std::find(known_elsewhere.begin(), known_elsewhere.end(), kind) != known_elsewhere.end()) {
        fail(at, "{} \"{}\" is not supported yet; supported are {}", what, kind, fmt::join(supported, ", "));
    }
    fail(at, "unknown {} \"{}\"; {}known are {}", what, shown(kind),
         did_you_mean(kind, {supported.begin(), supported.size()}), fmt::join(supported, ", "));
}

}  // namespace lucerna
