// Parses the header of a PLY file: its encoding, and elements with their properties.
#include "engine/scene/ply_cursor.h"

namespace lucerna {
namespace {

std::optional<PlyScalar> scalar_named(std::string_view name) {
    constexpr std::pair<std::string_view, PlyScalar> names[] = {
        {"char", PlyScalar::i8},    {"int8", PlyScalar::i8},     {"uchar", PlyScalar::u8},
        {"uint8", PlyScalar::u8},   {"short", PlyScalar::i16},   {"int16", PlyScalar::i16},
        {"ushort", PlyScalar::u16}, {"uint16", PlyScalar::u16},  {"int", PlyScalar::i32},
        {"int32", PlyScalar::i32},  {"uint", PlyScalar::u32},    {"uint32", PlyScalar::u32},
        {"float", PlyScalar::f32},  {"float32", PlyScalar::f32}, {"double", PlyScalar::f64},
        {"float64", PlyScalar::f64}};
    for (const auto& [known, type] : names) {
        if (known == name) return type;
    }
    return std::nullopt;
}

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    for (std::size_t at = line.find_first_not_of(" \t"); at != std::string_view::npos;) {
        const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
        words.push_back(line.substr(at, end - at));
        at = line.find_first_not_of(" \t", end);
    }
    return words;
}

PlyScalar parse_type(const PlyCursor& in, std::string_view name) {
    const auto type = scalar_named(name);
    if (!type)
        in.fail("unknown type '{}'; expected char, uchar, short, ushort, int, uint, float or double",
                PlyCursor::printable(name));
    return *type;
}

PlyProperty parse_property(const PlyCursor& in, const std::vector<std::string_view>& words) {
    PlyProperty property;
    if (words.size() == 5 && words[1] == "list") {
        property.count = parse_type(in, words[2]);
        property.type = parse_type(in, words[3]);
        if (!is_whole(*property.count)) in.fail("a list's length must have an integer type");
    } else if (words.size() == 3) {
        property.type = parse_type(in, words[1]);
    } else {
        in.fail("expected property TYPE NAME, or property list TYPE TYPE NAME");
    }
    property.name = words.back();
    return property;
}

PlyEncoding parse_encoding(const PlyCursor& in, const std::vector<std::string_view>& words) {
    if (words.size() == 3 && words[2] == "1.0") {
        if (words[1] == "ascii") return PlyEncoding::ascii;
        if (words[1] == "binary_little_endian") return PlyEncoding::little;
        if (words[1] == "binary_big_endian") return PlyEncoding::big;
    }
    in.fail("expected format ascii|binary_little_endian|binary_big_endian 1.0");
}

}  // namespace

std::vector<PlyElement> read_ply_header(PlyCursor& in) {
    if (in.left() < 4 || std::string_view(in.here(), 3) != "ply" || in.line() != "ply") {
        in.fail("not a PLY file: it does not begin with a line 'ply'");
    }
    std::vector<PlyElement> elements;
    std::optional<PlyEncoding> encoding;
    for (;;) {
        const std::vector<std::string_view> words = words_of(in.line());
        if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
        if (words[0] == "end_header") break;
        if (words[0] == "format") {
            encoding = parse_encoding(in, words);
        } else if (words[0] == "element" && words.size() == 3) {
            std::uint64_t rows = 0;
            const char* end = words[2].data() + words[2].size();
            const auto [stop, error] = std::from_chars(words[2].data(), end, rows);
            if (stop != end || error != std::errc())
                in.fail("'{}' is not a count", PlyCursor::printable(words[2]));
            elements.push_back({std::string(words[1]), rows, {}});
        } else if (words[0] == "property" && !elements.empty()) {
            elements.back().properties.push_back(parse_property(in, words));
        } else {
            in.fail("'{}' is not understood here", PlyCursor::printable(words[0]));
        }
    }
    if (!encoding) in.fail("the header has no format line");
    in.encoding = *encoding;
    in.end_header();
    return elements;
}

}  // namespace lucerna
