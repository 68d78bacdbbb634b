// Reads PLY: a text header that describes rows of numbers, then the rows, as text or binary.
#include "engine/scene/mesh.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "engine/scene/ply_cursor.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

// Throws unless the file could hold the number of rows that the header states.
void require_room(const PlyCursor& in, const PlyElement& element) {
    std::size_t least = 0;  // bytes of a row
    for (const PlyProperty& property : element.properties) {
        // The shortest text of a number is a digit and a blank; the last blank may be missing.
        least += in.encoding == PlyEncoding::ascii ? 2 : size_of(property.count.value_or(property.type));
    }
    const std::size_t left = in.left() + 1;
    if (least > 0 && element.rows > left / least) {
        in.fail("the header says {} rows of '{}', but the file ends before", element.rows,
                PlyCursor::printable(element.name));
    }
}

std::uint64_t list_length(PlyCursor& in, const PlyProperty& property) {
    const double count = in.number(*property.count);
    const std::size_t least = in.encoding == PlyEncoding::ascii ? 2 : size_of(property.type);
    if (!(count >= 0) || count > static_cast<double>((in.left() + 1) / least)) {
        in.fail("a list of {} values in '{}' does not fit in the file", count,
                PlyCursor::printable(property.name));
    }
    return static_cast<std::uint64_t>(count);
}

void skip_property(PlyCursor& in, const PlyProperty& property) {
    const std::uint64_t values = property.count ? list_length(in, property) : 1;
    for (std::uint64_t i = 0; i < values; ++i) in.number(property.type);
}

void skip_element(PlyCursor& in, const PlyElement& element) {
    if (element.properties.empty()) return;
    for (std::uint64_t row = 0; row < element.rows; ++row) {
        for (const PlyProperty& property : element.properties) skip_property(in, property);
    }
}

// Maps vertex properties to slots: slot c of p, n or uv.
struct Slots {
    std::vector<int> of;  // per property; -1: ignored
    bool n = false, uv = false;
};

constexpr int kSlots = 8;  // x y z nx ny nz u v

Slots find_slots(const PlyCursor& in, const PlyElement& vertex) {
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

// Reads binary rows without lists, which have a fixed size, in place. Positions alone are copied as one block
// if their layout fits.
void read_fixed_vertices(PlyCursor& in, const PlyElement& vertex, const Slots& slots, PlyMesh& mesh) {
    struct Source {
        std::size_t offset;
        PlyScalar type;
        int slot;
    };
    std::vector<Source> sources;
    std::size_t stride = 0;
    for (std::size_t i = 0; i < vertex.properties.size(); ++i) {
        if (slots.of[i] >= 0) sources.push_back({stride, vertex.properties[i].type, slots.of[i]});
        stride += size_of(vertex.properties[i].type);
    }
    if (vertex.rows > in.left() / stride) in.fail("the file ends within its vertices");
    const bool packed = stride == sizeof(V3f) && in.encoding == PlyEncoding::little &&
                        std::endian::native == std::endian::little && slots.of == std::vector<int>{0, 1, 2} &&
                        sources[0].type == PlyScalar::f32 && sources[1].type == PlyScalar::f32 &&
                        sources[2].type == PlyScalar::f32;
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

void read_vertices(PlyCursor& in, const PlyElement& vertex, PlyMesh& mesh) {
    const Slots slots = find_slots(in, vertex);
    require_room(in, vertex);
    // The scene also holds the positions in double precision.
    require_memory(bytes_of(vertex.rows, sizeof(V3f) + sizeof(V3d) + (slots.n ? sizeof(V3f) : 0) +
                                             (slots.uv ? sizeof(V2f) : 0)),
                   fmt::format("{}: {} vertices", in.file(), vertex.rows), "use fewer vertices");
    mesh.p.reserve(vertex.rows);
    if (slots.n) mesh.n.reserve(vertex.rows);
    if (slots.uv) mesh.uv.reserve(vertex.rows);
    if (in.encoding != PlyEncoding::ascii && !vertex.has_lists()) {
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

int read_index(PlyCursor& in, const PlyProperty& list) {
    const double index = in.number(list.type);
    if (!(index >= 0 && index < static_cast<double>(std::numeric_limits<int>::max()))) {
        in.fail("{} is not an index of a vertex", index);
    }
    return static_cast<int>(index);
}

// Reads the most frequent form: binary rows of a byte 3 and three 32-bit indices, up to the first other row.
std::uint64_t read_plain_triangles(PlyCursor& in, const PlyElement& face, PlyMesh& mesh) {
    const PlyProperty& list = face.properties.front();
    const bool plain = face.properties.size() == 1 && in.encoding == PlyEncoding::little &&
                       std::endian::native == std::endian::little &&
                       (list.count == PlyScalar::u8 || list.count == PlyScalar::i8) &&
                       (list.type == PlyScalar::i32 || list.type == PlyScalar::u32);
    if (!plain) return 0;
    constexpr std::size_t kRow = 1 + sizeof(V3i);
    const std::uint64_t rows = std::min<std::uint64_t>(face.rows, in.left() / kRow);
    std::uint64_t taken = 0;
    for (; taken < rows && *in.here() == 3; ++taken) {
        V3i triangle;
        std::memcpy(&triangle.x, in.here() + 1, sizeof triangle);
        if (triangle.x < 0 || triangle.y < 0 || triangle.z < 0) break;  // the general reader reports it
        mesh.triangles.push_back(triangle);
        in.skip(kRow);
    }
    return taken;
}

void read_faces(PlyCursor& in, const PlyElement& face, PlyMesh& mesh) {
    auto chosen = face.find("vertex_indices");
    if (!chosen) chosen = face.find("vertex_index");
    if (!chosen || !face.properties[*chosen].count || !is_whole(face.properties[*chosen].type)) {
        in.fail("its faces have no list vertex_indices of whole numbers");
    }
    require_room(in, face);
    require_memory(bytes_of(face.rows, sizeof(V3i)), fmt::format("{}: {} faces", in.file(), face.rows),
                   "use fewer faces");
    mesh.triangles.reserve(face.rows);
    const std::uint64_t taken = read_plain_triangles(in, face, mesh);
    for (std::uint64_t row = taken; row < face.rows; ++row) {
        for (std::size_t k = 0; k < face.properties.size(); ++k) {
            const PlyProperty& property = face.properties[k];
            if (k != *chosen) {
                skip_property(in, property);
                continue;
            }
            const std::uint64_t corners = list_length(in, property);
            if (corners < 3) in.fail("face {} has {} corners; expected 3 or more", row, corners);
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

void check_indices(const PlyCursor& in, const PlyMesh& mesh) {
    const std::size_t vertices = mesh.p.size();
    for (const V3i& triangle : mesh.triangles) {
        for (int c = 0; c < 3; ++c) {
            if (static_cast<std::size_t>(triangle[c]) >= vertices) {
                in.fail("a face refers to vertex {}, but there are only {}", triangle[c], vertices);
            }
        }
    }
}

}  // namespace

PlyMesh read_ply(const std::filesystem::path& file) {
    const std::vector<std::byte> bytes = read_unpacked(file);
    PlyCursor in(file, bytes);
    const std::vector<PlyElement> elements = read_ply_header(in);
    PlyMesh mesh;
    bool vertices = false;
    bool faces = false;
    for (const PlyElement& element : elements) {
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
