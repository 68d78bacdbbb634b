#include "engine/pbrt/params.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "engine/system/hash.h"
#include "engine/text/spelling.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// Limits the parameters of a directive, because each is looked up among the others. About fifty names are
// known.
constexpr std::size_t kMostParams = 256;

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
    // Names in older versions of pbrt.
    {"point", Type::point3},
    {"vector", Type::vector3},
    {"normal", Type::normal3},
    {"color", Type::rgb},
};

std::optional<Type> type_of(std::string_view word) {
    for (const TypeWord& known : kTypeWords) {
        if (known.word == word) return known.type;
    }
    return std::nullopt;
}

// Returns the number of numbers in one value of the type.
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

// The first error in a parameter's values.
struct Problem {
    Place at;
    std::string what, instead;
    bool drops = true;  // drops the whole parameter
};

// Reads one value that is not a number, whatever its type. An unquoted word ends the list in every version
// and is a syntax error.
void read_word_value(Tokens& tokens, Param& param, std::optional<Problem>& problem) {
    const Place at = tokens.place();
    const Token token = tokens.next();
    const bool is_string = token.kind == Token::Kind::string;
    if (param.type == Type::boolean) {  // true is unquoted, "true" belongs to older versions
        const bool word = is_string || token.kind == Token::Kind::word;
        const bool known = word && (token.text == "true" || token.text == "false");
        const auto what = fmt::format("{}: {} is not a Boolean; expected true or false", declared(param),
                                      shown(token.text));
        if (!known && !is_string && token.kind != Token::Kind::number) fail(at, "{}", what);
        param.flags.push_back(known && token.text == "true");
        if (!known && !problem)
            problem = {at, what, is_string ? "false is used" : "the parameter is left out", !is_string};
        return;
    }
    const bool names_a_spectrum = param.type == Type::spectrum && is_string;
    if ((!is_numeric(param.type) || names_a_spectrum) && is_string) {
        param.strings.push_back(string_value(token, at));
        return;
    }
    if (is_numeric(param.type) && !is_string && names_a_number(token.text)) {
        param.numbers.push_back(number_value(token.text, at));
        return;
    }
    const auto what =
        fmt::format("{}: \"{}\" is not accepted; expected {}", declared(param), shown(token.text),
                    is_numeric(param.type) ? "a number" : "a string in quotes");
    if (!is_string && token.kind != Token::Kind::number) fail(at, "{}", what);
    if (!problem) problem = {at, what, "the parameter is left out", true};
}

std::optional<Problem> read_values(Tokens& tokens, Param& param) {
    using Kind = Token::Kind;
    std::optional<Problem> problem;
    param.values = tokens.place();
    if (tokens.peek().kind == Kind::end) fail(param.values, "{} has no value", declared(param));
    if (tokens.peek().kind != Kind::open) {
        if (is_numeric(param.type) && tokens.peek().kind == Kind::number) {
            param.numbers.push_back(number_value(tokens.peek().text, param.values));
            tokens.next();
        } else {
            read_word_value(tokens, param, problem);
        }
        return problem;
    }
    tokens.next();
    while (tokens.peek().kind != Kind::close) {
        if (tokens.peek().kind == Kind::end)
            fail(param.values, "{}: this [ is never closed", declared(param));
        if (is_numeric(param.type) && tokens.peek().kind == Kind::number) {
            tokens.read_numbers(param.numbers);
        } else {
            read_word_value(tokens, param, problem);
        }
    }
    tokens.next();
    return problem;
}

// Splits "type name", with any number of blanks in between. Returns the problem if it fails.
std::optional<Problem> declare(const Token& token, Param& param) {
    constexpr std::string_view blanks = " \t";
    const std::string_view text = token.text;
    const std::size_t type_begin = std::min(text.find_first_not_of(blanks), text.size());
    const std::size_t type_end = std::min(text.find_first_of(blanks, type_begin), text.size());
    const std::size_t name_begin = std::min(text.find_first_not_of(blanks, type_end), text.size());
    const std::size_t name_end = std::min(text.find_first_of(blanks, name_begin), text.size());
    const bool two_words = name_begin < name_end && text.find_first_not_of(blanks, name_end) == text.npos;
    constexpr std::string_view instead = "it is left out";
    if (!two_words) {
        return Problem{
            param.place,
            fmt::format(
                "\"{}\" is not a parameter declaration; expected \"type name\", for example \"float radius\"",
                shown(text)),
            std::string(instead), true};
    }
    const std::string_view word = text.substr(type_begin, type_end - type_begin);
    const std::optional<Type> type = type_of(word);
    if (!type) {
        std::vector<std::string_view> words;
        for (const TypeWord& known : kTypeWords) words.push_back(known.word);
        return Problem{param.place,
                       fmt::format("\"{}\": unknown type \"{}\"; {}known are {}", shown(text), shown(word),
                                   did_you_mean(word, words), fmt::join(words, ", ")),
                       std::string(instead), true};
    }
    param.type = *type;
    param.name = text.substr(name_begin, name_end - name_begin);
    return std::nullopt;
}

// Skips the values of a parameter whose type is unknown.
void skip_values(Tokens& tokens) {
    using Kind = Token::Kind;
    const Place begin = tokens.place();
    if (tokens.peek().kind != Kind::open) {
        const Token& value = tokens.peek();
        if (value.kind == Kind::number || value.kind == Kind::string || value.text == "true" ||
            value.text == "false")
            tokens.next();
        return;
    }
    while (tokens.peek().kind != Kind::close) {
        if (tokens.peek().kind == Kind::end) fail(begin, "this [ is never closed");
        tokens.next();
    }
    tokens.next();
}

// Groups types as pbrt does, with one list per type and one for all spellings of a colour.
Type family_of(Type type) {
    const bool colour = type == Type::spectrum || type == Type::blackbody || type == Type::xyz;
    return colour ? Type::rgb : type;
}

}  // namespace

std::string_view type_name(Type type) {
    return kTypeWords[static_cast<std::size_t>(type)].word;  // the first entries are in the order of Type
}

Place Param::place_of(std::size_t value) const {
    if (!values.source) return place;
    Tokens tokens(*values.source, values.offset);
    if (tokens.peek().kind == Token::Kind::open) tokens.next();
    for (; value > 0 && tokens.peek().kind != Token::Kind::close; --value) tokens.next();
    values.source->take_oddities();  // already reported when the list was read
    return tokens.place();
}

Params Params::read(Tokens& tokens, std::string owner, const Place& place, Leniency& leniency, bool ours) {
    Params result;
    result.owner_ = std::move(owner);
    result.place_ = place;
    result.leniency_ = &leniency;
    result.ours_ = ours;
    result.read_more(tokens);
    return result;
}

void Params::read_more(Tokens& tokens) {
    while (tokens.peek().kind == Token::Kind::string) {
        Param param;
        param.place = tokens.place();
        if (params_.size() == kMostParams)
            fail(param.place, "{} has more than {} parameters; use fewer", owner_, kMostParams);
        if (const auto problem = declare(tokens.next(), param)) {
            warn_or_refuse(problem->at, problem->what, problem->instead);
            skip_values(tokens);
            continue;
        }
        if (const auto problem = read_values(tokens, param)) {
            warn_or_refuse(problem->at, problem->what, problem->instead);
            if (problem->drops) continue;
        }
        const std::size_t width = width_of(param.type), count = param.numbers.size();
        if (count % width != 0) {
            warn_or_refuse(param.place,
                           fmt::format("{} of {} has {} numbers; expected a multiple of {}", declared(param),
                                       owner_, count, width),
                           fmt::format("the last {} are left out", count % width));
            param.numbers.resize(count - count % width);
        }
        add(std::move(param));
    }
    depart_oddities(*tokens.place().source);
}

void Params::add_to(WordHash& hash) const {
    for (const Param& param : params_) {
        hash.add(static_cast<int>(param.type));
        hash.add(param.name);
        hash.add(std::uint64_t{param.numbers.size()});
        hash.add_bytes(std::as_bytes(std::span(param.numbers)));
        hash.add(std::uint64_t{param.strings.size()});
        for (const std::string& text : param.strings) hash.add(text);
        for (const bool flag : param.flags) hash.add(int{flag});
    }
}

void Params::take_colours_in(const ColourSpace* space) {
    for (Param& param : params_) param.space = space;
}

void Params::depart_oddities(const Source& source) const {
    for (const Source::Oddity& oddity : source.take_oddities()) {
        for (std::uint64_t i = 0; i < oddity.times; ++i)
            warn_or_refuse({&source, oddity.offset}, oddity.what, oddity.instead);
    }
}

void Params::add(Param param) {
    const auto same = [&](const Param& other) {
        return other.name == param.name && family_of(other.type) == family_of(param.type);
    };
    const auto earlier = std::find_if(params_.begin(), params_.end(), same);
    if (earlier == params_.end()) return params_.push_back(std::move(param));
    warn_or_refuse(param.place,
                   fmt::format("parameter \"{}\" of {} is given twice", shown(param.name), owner_),
                   "the last one is used");
    *earlier = std::move(param);
}

void Params::warn_or_refuse(const Place& at, std::string_view what, std::string_view instead,
                            std::string_view lost) const {
    if (ours_) throw TextError(at, std::string(what));
    leniency_->warn_or_refuse(at, what, instead, lost);
}

void Params::depart_once(const Param& param, std::string_view what, std::string_view instead) {
    // A default is shared by directives and is never marked.
    for (Param& mine : params_) {
        if (&mine != &param) continue;
        if (mine.said) return;
        mine.said = true;
    }
    warn_or_refuse(param.place, what, instead);
}

const Param* Params::known(std::string_view name) const {
    for (const Param& param : params_) {
        if (param.name == name) return &param;
    }
    for (const auto& param : defaults_) {
        if (param->name == name) return param.get();
    }
    return nullptr;
}

bool Params::has(std::string_view name) {
    note_asked(name);
    return known(name) != nullptr;
}

void Params::note_asked(std::string_view name) {
    if (std::find(asked_.begin(), asked_.end(), name) == asked_.end()) asked_.emplace_back(name);
}

Place Params::place_of(std::string_view name) const {
    const Param* param = known(name);
    return param ? param->place : place_;
}

const Param* Params::find_any(std::string_view name) {
    note_asked(name);
    Param* found = nullptr;
    for (Param& param : params_) {
        if (param.name == name && (!found || param.type == Type::texture)) found = &param;
    }
    if (found) found->used = true;
    return found ? found : known(name);
}

const Param* Params::find(std::string_view name, std::initializer_list<Type> types) {
    note_asked(name);
    const auto is_accepted = [&](const Param& param) {
        return std::find(types.begin(), types.end(), param.type) != types.end();
    };
    Param* found = nullptr;
    Param* other = nullptr;
    for (Param& param : params_) {
        if (param.name != name) continue;
        if (!is_accepted(param)) {
            other = &param;
        } else if (!found || param.type == Type::texture) {
            found = &param;
        }
    }
    if (found) {
        found->used = true;
        return found;
    }
    if (other) other->used = true;
    const Param* not_taken = other ? other : known(name);
    if (not_taken && is_accepted(*not_taken)) return not_taken;
    if (not_taken) {
        std::vector<std::string_view> accepted;
        for (const Type type : types) accepted.push_back(type_name(type));
        depart_once(*not_taken,
                    fmt::format("{} of {} has the wrong type; expected \"{} {}\"", declared(*not_taken),
                                owner_, fmt::join(accepted, "|"), name),
                    "it is left out");
    }
    return nullptr;
}

const Param* Params::find_sized(std::string_view name, std::initializer_list<Type> types, std::size_t count) {
    const Param* param = find(name, types);
    if (!param || param->count() == count) return param;
    depart_once(
        *param,
        fmt::format("{} of {} has {} values; expected {}", declared(*param), owner_, param->count(), count),
        "it is left out");
    return nullptr;
}

bool Params::boolean(std::string_view name, bool fallback) {
    const Param* param = find_sized(name, {Type::boolean}, 1);
    return param ? param->flags.front() : fallback;
}

int Params::integer(std::string_view name, int fallback) {
    const Param* param = find_sized(name, {Type::integer}, 1);
    if (!param) return fallback;
    const double value = param->numbers.front(), most = std::numeric_limits<int>::max();
    const double taken = std::clamp(std::trunc(value), -most, most);
    if (taken != value) {
        warn_or_refuse(param->place_of(0),
                       fmt::format("{}: {:.10g} is not accepted; expected a whole number below 2147483648",
                                   declared(*param), value),
                       fmt::format("{:.10g} is used", taken));
    }
    return static_cast<int>(taken);
}

double Params::real(std::string_view name, double fallback) {
    const Param* param = find_sized(name, {Type::real}, 1);
    return param ? param->numbers.front() : fallback;
}

double Params::real_within(std::string_view name, double fallback, double least, double most) {
    const double value = real(name, fallback);
    if (value >= least && value <= most) return value;
    const double held = std::clamp(value, least, most);
    warn_or_refuse(place_of(name),
                   fmt::format("{} of {}: {:g} is not accepted; expected {:g} to {:g}", name, owner_, value,
                               least, most),
                   fmt::format("{:g} is used", held));
    return held;
}

std::string Params::string(std::string_view name, std::string_view fallback) {
    const Param* param = find_sized(name, {Type::string}, 1);
    return param ? param->strings.front() : std::string(fallback);
}

V3d Params::point(std::string_view name, const V3d& fallback) {
    const Param* param = find_sized(name, {Type::point3}, 3);
    return param ? V3d(param->numbers[0], param->numbers[1], param->numbers[2]) : fallback;
}

void Params::accept(std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names) find_any(name);
}

void Params::depart_unused() const {
    for (const Param& param : params_) {
        if (param.used) continue;
        const std::vector<std::string_view> known(asked_.begin(), asked_.end());
        const std::string names =
            known.empty() ? "it has no parameters" : fmt::format("known are {}", fmt::join(known, ", "));
        warn_or_refuse(param.place,
                       fmt::format("{} of {} has no effect; {}{}", declared(param), owner_,
                                   did_you_mean(param.name, known), names),
                       "it is left out");
    }
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
