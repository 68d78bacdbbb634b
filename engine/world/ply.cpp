// PLY: a text header that describes rows of numbers, then the rows, as text or binary.
#include "engine/world/ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "engine/base/error.h"
#include "engine/base/files.h"

namespace lucerna {
namespace {

enum class Scalar : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };
constexpr std::size_t kSize[] = {1, 1, 2, 2, 4, 4, 4, 8};
std::size_t size_of(Scalar type) {
    return kSize[static_cast<std::size_t>(type)];
}
bool is_whole(Scalar type) {
    return type < Scalar::f32;
}

std::optional<Scalar> scalar_named(std::string_view name) {
    constexpr std::pair<std::string_view, Scalar> names[] = {
        {"char", Scalar::i8},   {"int8", Scalar::i8},     {"uchar", Scalar::u8},   {"uint8", Scalar::u8},
        {"short", Scalar::i16}, {"int16", Scalar::i16},   {"ushort", Scalar::u16}, {"uint16", Scalar::u16},
        {"int", Scalar::i32},   {"int32", Scalar::i32},   {"uint", Scalar::u32},   {"uint32", Scalar::u32},
        {"float", Scalar::f32}, {"float32", Scalar::f32}, {"double", Scalar::f64}, {"float64", Scalar::f64}};
    for (const auto& [known, type] : names) {
        if (known == name) return type;
    }
    return std::nullopt;
}

struct Property {
    std::string name;
    Scalar type = Scalar::f32;
    std::optional<Scalar> count;  // of a list
};

struct Element {
    std::string name;
    std::uint64_t rows = 0;
    std::vector<Property> properties;

    // Position of the first property of that name.
    std::optional<std::size_t> find(std::string_view wanted) const {
        for (std::size_t i = 0; i < properties.size(); ++i) {
            if (properties[i].name == wanted) return i;
        }
        return std::nullopt;
    }
    bool has_lists() const {
        for (const Property& property : properties) {
            if (property.count) return true;
        }
        return false;
    }
};

enum class Encoding : std::uint8_t { ascii, little, big };

// The file's bytes and how far they have been read. Every read checks what is left.
class Cursor {
  public:
    Cursor(const std::filesystem::path& file, const std::vector<std::byte>& bytes)
        : file_(file.string()), text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

    Encoding encoding = Encoding::ascii;

    std::size_t left() const { return text_.size() - at_; }
    const char* here() const { return text_.data() + at_; }
    void skip(std::size_t bytes) { at_ += bytes; }

    // A line of the header, without its end (any of the three conventions).
    std::string_view line() {
        const std::size_t end = text_.find_first_of("\r\n", at_);
        if (end == std::string_view::npos) fail("the header has no end_header line");
        const std::string_view result = text_.substr(at_, end - at_);
        at_ = end + 1;
        if (text_[end] == '\r' && at_ < text_.size() && text_[at_] == '\n') ++at_;
        ++line_;
        return result;
    }

    double number(Scalar type) {
        if (encoding == Encoding::ascii) return word(type);
        const std::size_t size = size_of(type);
        if (left() < size) fail("the file ends within its data");
        const double value = decode(here(), type);
        at_ += size;
        return value;
    }

    double decode(const char* from, Scalar type) const {
        switch (type) {
            case Scalar::i8:
                return load<std::int8_t>(from);
            case Scalar::u8:
                return load<std::uint8_t>(from);
            case Scalar::i16:
                return load<std::int16_t>(from);
            case Scalar::u16:
                return load<std::uint16_t>(from);
            case Scalar::i32:
                return load<std::int32_t>(from);
            case Scalar::u32:
                return load<std::uint32_t>(from);
            case Scalar::f32:
                return static_cast<double>(load<float>(from));
            case Scalar::f64:
                return load<double>(from);
        }
        return 0;
    }

    // Lines are only known in text; binary data have none.
    template <typename... Args>
    [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
        Location at{file_};
        if (in_header_) {
            at = {file_, line_, 1};
        } else if (encoding == Encoding::ascii) {
            at = {file_, 1, 1};
            for (std::size_t i = 0; i < at_; ++i) at.line += text_[i] == '\n' ? 1 : 0;
        }
        throw InputError(at, fmt::format(format, std::forward<Args>(args)...));
    }
    void end_header() { in_header_ = false; }

  private:
    template <typename T>
    T load(const char* from) const {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), from, sizeof(T));
        const bool swap = (encoding == Encoding::big) != (std::endian::native == std::endian::big);
        if (swap) std::reverse(bytes.begin(), bytes.end());
        return std::bit_cast<T>(bytes);
    }

    double word(Scalar type) {
        constexpr std::string_view kSpace = " \t\r\n\v\f";
        at_ = std::min(text_.find_first_not_of(kSpace, at_), text_.size());
        const std::size_t end = std::min(text_.find_first_of(kSpace, at_), text_.size());
        if (at_ == end) fail("the file ends within its data");
        const char* first = text_.data() + at_ + (text_[at_] == '+' ? 1 : 0);
        double value = 0;
        const auto [stop, error] = std::from_chars(first, text_.data() + end, value);
        const bool range = error == std::errc::result_out_of_range;  // value keeps 0: too small, or too large
        if (stop != text_.data() + end || (error != std::errc() && !range)) {
            fail("'{}' is not a number", printable(text_.substr(at_, end - at_)));
        }
        if (range) fail("'{}' is out of range", printable(text_.substr(at_, end - at_)));
        if (is_whole(type) && value != std::floor(value)) fail("{} is not a whole number", value);
        at_ = end;
        return value;
    }

  public:
    // Part of the file, fit for one line of a message.
    static std::string printable(std::string_view text) {
        std::string result;
        for (const char c : text.substr(0, 40)) result += c >= 32 && c < 127 ? c : '?';
        return result;
    }

  private:
    std::string file_;
    std::string_view text_;
    std::size_t at_ = 0;
    int line_ = 0;
    bool in_header_ = true;
};

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    for (std::size_t at = line.find_first_not_of(" \t"); at != std::string_view::npos;) {
        const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
        words.push_back(line.substr(at, end - at));
        at = line.find_first_not_of(" \t", end);
    }
    return words;
}

Scalar parse_type(const Cursor& in, std::string_view name) {
    const auto type = scalar_named(name);
    if (!type)
        in.fail("unknown type '{}'; accepted: char uchar short ushort int uint float double",
                Cursor::printable(name));
    return *type;
}

Property parse_property(const Cursor& in, const std::vector<std::string_view>& words) {
    Property property;
    if (words.size() == 5 && words[1] == "list") {
        property.count = parse_type(in, words[2]);
        property.type = parse_type(in, words[3]);
        if (!is_whole(*property.count)) in.fail("a list's length must be of a whole type");
    } else if (words.size() == 3) {
        property.type = parse_type(in, words[1]);
    } else {
        in.fail("accepted: property TYPE NAME, or property list TYPE TYPE NAME");
    }
    property.name = words.back();
    return property;
}

Encoding parse_encoding(const Cursor& in, const std::vector<std::string_view>& words) {
    if (words.size() == 3 && words[2] == "1.0") {
        if (words[1] == "ascii") return Encoding::ascii;
        if (words[1] == "binary_little_endian") return Encoding::little;
        if (words[1] == "binary_big_endian") return Encoding::big;
    }
    in.fail("accepted: format ascii|binary_little_endian|binary_big_endian 1.0");
}

std::vector<Element> read_header(Cursor& in) {
    if (in.left() < 4 || std::string_view(in.here(), 3) != "ply" || in.line() != "ply") {
        in.fail("not a PLY file: it does not begin with a line 'ply'");
    }
    std::vector<Element> elements;
    std::optional<Encoding> encoding;
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
                in.fail("'{}' is not a count", Cursor::printable(words[2]));
            elements.push_back({std::string(words[1]), rows, {}});
        } else if (words[0] == "property" && !elements.empty()) {
            elements.back().properties.push_back(parse_property(in, words));
        } else {
            in.fail("'{}' is not understood here", Cursor::printable(words[0]));
        }
    }
    if (!encoding) in.fail("the header has no format line");
    in.encoding = *encoding;
    in.end_header();
    return elements;
}

// A count is believed only if the file could hold that many rows.
void require_room(const Cursor& in, const Element& element) {
    std::size_t least = 0;  // bytes of a row
    for (const Property& property : element.properties) {
        // The shortest text for a number is a digit and a blank; the last blank may be missing.
        least += in.encoding == Encoding::ascii ? 2 : size_of(property.count.value_or(property.type));
    }
    const std::size_t left = in.left() + 1;
    if (least > 0 && element.rows > left / least) {
        in.fail("the header says {} rows of '{}', but the file ends before", element.rows,
                Cursor::printable(element.name));
    }
}

std::uint64_t list_length(Cursor& in, const Property& property) {
    const double count = in.number(*property.count);
    const std::size_t least = in.encoding == Encoding::ascii ? 2 : size_of(property.type);
    if (!(count >= 0) || count > static_cast<double>((in.left() + 1) / least)) {
        in.fail("a list of {} values in '{}' does not fit in the file", count,
                Cursor::printable(property.name));
    }
    return static_cast<std::uint64_t>(count);
}

void skip_property(Cursor& in, const Property& property) {
    const std::uint64_t values = property.count ? list_length(in, property) : 1;
    for (std::uint64_t i = 0; i < values; ++i) in.number(property.type);
}

void skip_element(Cursor& in, const Element& element) {
    if (element.properties.empty()) return;
    for (std::uint64_t row = 0; row < element.rows; ++row) {
        for (const Property& property : element.properties) skip_property(in, property);
    }
}

// Where a vertex property goes: slot c of p, n or uv.
struct Slots {
    std::vector<int> of;  // per property; -1: not wanted
    bool n = false, uv = false;
};

constexpr int kSlots = 8;  // x y z nx ny nz u v

Slots find_slots(const Cursor& in, const Element& vertex) {
    Slots slots;
    slots.of.assign(vertex.properties.size(), -1);
    const auto scalar = [&](std::string_view name) {
        const auto at = vertex.find(name);
        return at && !vertex.properties[*at].count ? at : std::nullopt;
    };
    const auto claim = [&](std::initializer_list<std::string_view> names, int first) {
        for (const auto name : names) {
            if (!scalar(name)) return false;
        }
        for (const auto name : names) slots.of[*scalar(name)] = first++;
        return true;
    };
    if (!claim({"x", "y", "z"}, 0)) in.fail("its vertices have no x, y and z");
    slots.n = claim({"nx", "ny", "nz"}, 3);
    slots.uv = claim({"u", "v"}, 6) || claim({"s", "t"}, 6) || claim({"texture_u", "texture_v"}, 6) ||
               claim({"texture_s", "texture_t"}, 6);
    return slots;
}

void store(PlyMesh& mesh, const Slots& slots, const std::array<float, kSlots>& row) {
    mesh.p.emplace_back(row[0], row[1], row[2]);
    if (slots.n) mesh.n.emplace_back(row[3], row[4], row[5]);
    if (slots.uv) mesh.uv.emplace_back(row[6], row[7]);
}

// Binary rows without lists all have one size: take them where they lie, positions in one piece if they can
// be.
void read_fixed_vertices(Cursor& in, const Element& vertex, const Slots& slots, PlyMesh& mesh) {
    struct Source {
        std::size_t offset;
        Scalar type;
        int slot;
    };
    std::vector<Source> sources;
    std::size_t stride = 0;
    for (std::size_t i = 0; i < vertex.properties.size(); ++i) {
        if (slots.of[i] >= 0) sources.push_back({stride, vertex.properties[i].type, slots.of[i]});
        stride += size_of(vertex.properties[i].type);
    }
    if (vertex.rows > in.left() / stride) in.fail("the file ends within its vertices");
    const bool packed = stride == sizeof(V3f) && in.encoding == Encoding::little &&
                        std::endian::native == std::endian::little && slots.of == std::vector<int>{0, 1, 2} &&
                        sources[0].type == Scalar::f32 && sources[1].type == Scalar::f32 &&
                        sources[2].type == Scalar::f32;
    if (packed) {
        mesh.p.resize(vertex.rows);
        if (vertex.rows > 0) std::memcpy(&mesh.p[0].x, in.here(), vertex.rows * stride);
    } else {
        std::array<float, kSlots> row{};
        for (std::uint64_t i = 0; i < vertex.rows; ++i) {
            const char* from = in.here() + i * stride;
            for (const Source& source : sources) {
                row[static_cast<std::size_t>(source.slot)] =
                    static_cast<float>(in.decode(from + source.offset, source.type));
            }
            store(mesh, slots, row);
        }
    }
    in.skip(vertex.rows * stride);
}

void read_vertices(Cursor& in, const Element& vertex, PlyMesh& mesh) {
    const Slots slots = find_slots(in, vertex);
    require_room(in, vertex);
    mesh.p.reserve(vertex.rows);
    if (slots.n) mesh.n.reserve(vertex.rows);
    if (slots.uv) mesh.uv.reserve(vertex.rows);
    if (in.encoding != Encoding::ascii && !vertex.has_lists()) {
        read_fixed_vertices(in, vertex, slots, mesh);
        return;
    }
    std::array<float, kSlots> row{};
    for (std::uint64_t i = 0; i < vertex.rows; ++i) {
        for (std::size_t k = 0; k < vertex.properties.size(); ++k) {
            if (slots.of[k] < 0) {
                skip_property(in, vertex.properties[k]);
            } else {
                row[static_cast<std::size_t>(slots.of[k])] =
                    static_cast<float>(in.number(vertex.properties[k].type));
            }
        }
        store(mesh, slots, row);
    }
}

int read_index(Cursor& in, const Property& list) {
    const double index = in.number(list.type);
    if (!(index >= 0 && index < static_cast<double>(std::numeric_limits<int>::max()))) {
        in.fail("{} is not an index of a vertex", index);
    }
    return static_cast<int>(index);
}

// The usual case by far: binary rows of a byte 3 and three 32-bit indices, up to the first that is none.
std::uint64_t read_plain_triangles(Cursor& in, const Element& face, PlyMesh& mesh) {
    const Property& list = face.properties.front();
    const bool plain = face.properties.size() == 1 && in.encoding == Encoding::little &&
                       std::endian::native == std::endian::little &&
                       (list.count == Scalar::u8 || list.count == Scalar::i8) &&
                       (list.type == Scalar::i32 || list.type == Scalar::u32);
    if (!plain) return 0;
    constexpr std::size_t kRow = 1 + sizeof(V3i);
    const std::uint64_t rows = std::min<std::uint64_t>(face.rows, in.left() / kRow);
    std::uint64_t taken = 0;
    for (; taken < rows && *in.here() == 3; ++taken) {
        V3i triangle;
        std::memcpy(&triangle.x, in.here() + 1, sizeof triangle);
        if (triangle.x < 0 || triangle.y < 0 || triangle.z < 0) break;  // the slow way says what is wrong
        mesh.triangles.push_back(triangle);
        in.skip(kRow);
    }
    return taken;
}

void read_faces(Cursor& in, const Element& face, PlyMesh& mesh) {
    auto chosen = face.find("vertex_indices");
    if (!chosen) chosen = face.find("vertex_index");
    if (!chosen || !face.properties[*chosen].count || !is_whole(face.properties[*chosen].type)) {
        in.fail("its faces have no list vertex_indices of whole numbers");
    }
    require_room(in, face);
    mesh.triangles.reserve(face.rows);
    const std::uint64_t taken = read_plain_triangles(in, face, mesh);
    for (std::uint64_t row = taken; row < face.rows; ++row) {
        for (std::size_t k = 0; k < face.properties.size(); ++k) {
            const Property& property = face.properties[k];
            if (k != *chosen) {
                skip_property(in, property);
                continue;
            }
            const std::uint64_t corners = list_length(in, property);
            if (corners < 3) in.fail("face {} has {} corners; accepted: 3 or more", row, corners);
            const int first = read_index(in, property);
            int previous = read_index(in, property);
            for (std::uint64_t i = 2; i < corners; ++i) {
                const int next = read_index(in, property);
                mesh.triangles.emplace_back(first, previous, next);
                previous = next;
            }
        }
    }
}

void check_indices(const Cursor& in, const PlyMesh& mesh) {
    const std::size_t vertices = mesh.p.size();
    for (const V3i& triangle : mesh.triangles) {
        for (int c = 0; c < 3; ++c) {
            if (static_cast<std::size_t>(triangle[c]) >= vertices) {
                in.fail("a face asks for vertex {}, but there are only {}", triangle[c], vertices);
            }
        }
    }
}

}  // namespace

PlyMesh read_ply(const std::filesystem::path& file) {
    const std::vector<std::byte> bytes = read_unpacked(file);
    Cursor in(file, bytes);
    const std::vector<Element> elements = read_header(in);
    PlyMesh mesh;
    bool vertices = false;
    bool faces = false;
    for (const Element& element : elements) {
        if (element.name == "vertex" && !vertices) {
            read_vertices(in, element, mesh);
            vertices = true;
        } else if (element.name == "face" && !faces) {
            read_faces(in, element, mesh);
            faces = true;
        } else {
            require_room(in, element);
            skip_element(in, element);
        }
    }
    if (!vertices) in.fail("it has no element 'vertex'");
    if (!faces) in.fail("it has no element 'face'");
    check_indices(in, mesh);
    return mesh;
}

}  // namespace lucerna
