#include "engine/scene/mesh.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <string>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace ply_test {

using testing::TemporaryFolder;

PlyMesh read(const std::string& content) {
    static const TemporaryFolder folder;  // shared by all tests: there are thousands of reads
    std::ofstream(folder / "mesh.ply", std::ios::binary) << content;
    return read_ply(folder / "mesh.ply");
}

// Returns the one-line error of reading, or an empty text if there is none.
std::string error_of(const std::string& content) {
    try {
        read(content);
        return "";
    } catch (const InputError& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find("mesh.ply"), std::string::npos) << text;
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        return text;
    }
}

template <typename T>
void append(std::string& bytes, T value, bool big) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big) std::reverse(raw, raw + sizeof(T));
    bytes.append(raw, sizeof(T));
}

const std::string kSquare =
    "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0.5\n0 1 -2e-1\n4 0 1 2 3\n";

TEST(Ply, AsciiQuad_BecomesTwoTriangles) {
    const PlyMesh mesh = read(kSquare);
    ASSERT_EQ(mesh.p.size(), 4U);
    EXPECT_EQ(mesh.p[2], V3f(1, 1, 0.5F));
    EXPECT_EQ(mesh.p[3], V3f(0, 1, -0.2F));
    EXPECT_EQ(mesh.triangles, (std::vector<V3i>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_TRUE(mesh.n.empty());
    EXPECT_TRUE(mesh.uv.empty());
}

TEST(Ply, LineEndsOfAllSystems_ReadAlike) {
    for (const std::string end : {"\r\n", "\r"}) {
        std::string text;
        for (const char c : kSquare) text += c == '\n' ? end : std::string(1, c);
        EXPECT_EQ(read(text).p, read(kSquare).p);
    }
}

TEST(Ply, Pentagon_BecomesAFan) {
    std::string text = kSquare;
    text.replace(text.find("4 0 1 2 3"), 9, "5 0 1 2 3 1");
    EXPECT_EQ(read(text).triangles, (std::vector<V3i>{{0, 1, 2}, {0, 2, 3}, {0, 3, 1}}));
}

// Returns a file with all features at once: normals, uv, foreign properties and elements, and lists before
// and after the indices.
std::string rich(const std::string& format, bool big) {
    std::string bytes =
        "ply\nformat " + format +
        " 1.0\nobj_info none\nelement camera 2\nproperty list uchar short lens\nproperty double fov\n"
        "element vertex 3\nproperty double x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty float nx\nproperty float ny\nproperty float nz\n"
        "property float s\nproperty float t\nelement face 1\nproperty list ushort float weights\n"
        "property list uint uint vertex_index\nproperty char flag\nelement end 0\nproperty int x\n"
        "end_header\n";
    for (int i = 0; i < 2; ++i) {
        append<std::uint8_t>(bytes, 2, big), append<std::int16_t>(bytes, -3, big),
            append<std::int16_t>(bytes, 4, big);
        append(bytes, 45.0, big);
    }
    for (int i = 0; i < 3; ++i) {
        const auto f = static_cast<float>(i);
        append(bytes, static_cast<double>(f) + 0.25, big), append(bytes, f * f, big),
            append(bytes, 1 - f, big);
        append<std::uint8_t>(bytes, 200, big);
        append(bytes, 0.0F, big), append(bytes, 0.0F, big), append(bytes, 1.0F, big);
        append(bytes, 0.5F * f, big), append(bytes, 0.125F, big);
    }
    append<std::uint16_t>(bytes, 2, big), append(bytes, 1.5F, big), append(bytes, 2.5F, big);
    append<std::uint32_t>(bytes, 3, big);
    for (const std::uint32_t index : {2U, 0U, 1U}) append(bytes, index, big);
    append<std::int8_t>(bytes, -1, big);
    return bytes;
}

TEST(Ply, BinaryOfEitherByteOrder_ReadsEverythingItNeedsAndSkipsTheRest) {
    for (const bool big : {false, true}) {
        const PlyMesh mesh = read(rich(big ? "binary_big_endian" : "binary_little_endian", big));
        ASSERT_EQ(mesh.p.size(), 3U);
        EXPECT_EQ(mesh.p[2], V3f(2.25F, 4, -1));
        ASSERT_EQ(mesh.n.size(), 3U);
        EXPECT_EQ(mesh.n[1], V3f(0, 0, 1));
        ASSERT_EQ(mesh.uv.size(), 3U);
        EXPECT_EQ(mesh.uv[2], V2f(1, 0.125F));
        EXPECT_EQ(mesh.triangles, (std::vector<V3i>{{2, 0, 1}}));
    }
}

std::string packed(int vertices, int faces) {
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) +
                        "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                        std::to_string(faces) + "\nproperty list uchar int vertex_indices\nend_header\n";
    for (int i = 0; i < vertices; ++i) {
        for (int c = 0; c < 3; ++c) append(bytes, static_cast<float>(i * 3 + c), false);
    }
    for (int i = 0; i < faces; ++i) {
        append<std::uint8_t>(bytes, 3, false);
        for (int c = 0; c < 3; ++c) append(bytes, (i + c) % vertices, false);
    }
    return bytes;
}

TEST(Ply, PackedFloats_AreTakenInOnePiece) {
    const PlyMesh mesh = read(packed(1000, 2000));
    ASSERT_EQ(mesh.p.size(), 1000U);
    EXPECT_EQ(mesh.p[999], V3f(2997, 2998, 2999));
    EXPECT_EQ(mesh.triangles.size(), 2000U);
}

TEST(Ply, EveryTruncation_IsAnError) {
    for (const std::string& whole : {packed(5, 4), rich("binary_big_endian", true)}) {
        for (std::size_t size = 1; size < whole.size(); ++size) {
            EXPECT_NE(error_of(whole.substr(0, size)), "") << size << " of " << whole.size();
        }
    }
    // In text format, only the last number may lose digits unnoticed.
    for (std::size_t size = 1; size < kSquare.size() - 2; ++size) {
        EXPECT_NE(error_of(kSquare.substr(0, size)), "") << size;
    }
}

TEST(Ply, LyingCounts_AreRefusedBeforeAnythingIsAllocated) {
    for (const std::string lie : {"9223372036854775807", "18446744073709551615", "4000000000", "3000"}) {
        for (const std::string& whole : {packed(5, 4), kSquare}) {
            for (const std::string element : {"element vertex ", "element face "}) {
                std::string text = whole;
                const std::size_t at = text.find(element) + element.size();
                text.replace(at, 1, lie);
                EXPECT_NE(error_of(text).find("ends"), std::string::npos) << element << lie;
            }
        }
    }
    std::string list = packed(5, 1);
    list[list.size() - 13] = static_cast<char>(200);
    EXPECT_NE(error_of(list).find("does not fit"), std::string::npos);
}

TEST(Ply, BadContent_IsNamedWithItsLine) {
    const auto changed = [](const std::string& from, const std::string& to) {
        std::string text = kSquare;
        text.replace(text.find(from), from.size(), to);
        return error_of(text);
    };
    EXPECT_NE(changed("4 0 1 2 3", "4 0 1 2 9").find("vertex 9, but there are only 4"), std::string::npos);
    EXPECT_NE(changed("4 0 1 2 3", "4 0 1 -2 3").find("-2 is not an index"), std::string::npos);
    EXPECT_NE(changed("4 0 1 2 3", "4 0 1 1.5 3").find("not a whole number"), std::string::npos);
    EXPECT_NE(changed("4 0 1 2 3", "2 0 1 2 3").find("2 corners"), std::string::npos);
    EXPECT_NE(changed("1 1 0.5", "1 one 0.5").find("mesh.ply:13:1: 'one' is not a number"),
              std::string::npos);
    EXPECT_NE(changed("1 1 0.5", "1 1e999 0.5").find("out of range"), std::string::npos);
    EXPECT_NE(changed("format ascii", "format xml").find("mesh.ply:2:1: expected format"), std::string::npos);
    EXPECT_NE(changed("property float y", "property quad y").find("unknown type 'quad'"), std::string::npos);
    EXPECT_NE(changed("property float y", "property float w").find("no x, y and z"), std::string::npos);
    EXPECT_NE(changed("element vertex 4", "element vertex four").find("'four' is not a count"),
              std::string::npos);
    EXPECT_NE(changed("vertex_indices", "corners").find("no list vertex_indices"), std::string::npos);
    EXPECT_NE(changed("element vertex", "element corner").find("vertex"), std::string::npos);
    EXPECT_NE(error_of("solid stl\nfacet\n").find("not a PLY file"), std::string::npos);
    EXPECT_NE(error_of("").find("empty"), std::string::npos);
    EXPECT_NE(error_of("ply\nformat ascii 1.0\nend_header\n").find("no element 'vertex'"), std::string::npos);
}

TEST(Ply, RandomDamage_EndsInAMeshOrAnError) {
    const std::string wholes[] = {packed(20, 20), rich("binary_little_endian", false), kSquare};
    Sampler s(1, Purpose::test, 0, 0);
    int errors = 0;
    for (int i = 0; i < 3000; ++i) {
        std::string text = wholes[i % 3];
        const int edits = 1 + static_cast<int>(s.bits() % 4);
        for (int e = 0; e < edits; ++e) text[s.bits() % text.size()] = static_cast<char>(s.bits());
        try {
            const PlyMesh mesh = read(text);
            for (const V3i& t : mesh.triangles) {
                for (int c = 0; c < 3; ++c) ASSERT_LT(static_cast<std::size_t>(t[c]), mesh.p.size());
            }
        } catch (const InputError& error) {
            ++errors;
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        }
    }
    EXPECT_GT(errors, 300);
}

}  // namespace ply_test
}  // namespace lucerna
