// Pictures as textures and lights read them: the axes and headers of Radiance files, the colours stated by
// PNG and TIFF files, and the channels of OpenEXR. The tests write all files byte by byte.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/colour/colour_space.h"
#include "engine/colour/spectrum.h"
#include "engine/image/image.h"
#include "engine/image/photograph.h"
#include "engine/scene/texture_image.h"
#include "tests/support/error_of.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace picture_formats_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PictureFormats : public ::testing::Test {
  protected:
    std::filesystem::path file(const std::string& name, const std::string& bytes) {
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
        return folder_ / name;
    }
    std::shared_ptr<const Image> read(const std::filesystem::path& file) {
        warnings_.clear();
        return read_texture_image(file, {}, [this](const std::string& text) { warnings_.push_back(text); });
    }
    std::string error_of(const std::filesystem::path& file) {
        const std::string image = testing::error_of([&] { read(file); });
        TextureImages images;
        EXPECT_EQ(testing::error_of([&] { images.open(file, {}, WorkingSpace()); }), image);
        EXPECT_THAT(image, HasSubstr(file.filename().string()));
        return image;
    }
    testing::TemporaryFolder folder_;
    std::vector<std::string> warnings_;
};

void expect_near(const Rgb& is, const V3d& should, double relative = 1e-5) {
    const double scale = std::max({1e-6, should.x, should.y, should.z});
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(double{is[c]}, should[c], relative * scale) << is << ", not " << should;
}

// Compares texel by texel, with the texture in memory and in the tile cache.
void expect_texture(const std::filesystem::path& file, const Image& should) {
    for (const TextureMemory& memory : {TextureMemory{}, TextureMemory{0, 0, std::size_t{1} << 20}}) {
        TextureImages images(memory);
        const auto texels = images.open(file, {}, WorkingSpace());
        ASSERT_EQ(texels->width(), should.width);
        ASSERT_EQ(texels->height(), should.height);
        for (int y = 0; y < should.height; ++y) {
            for (int x = 0; x < should.width; ++x)
                expect_near(texels->square({{x, x}, {y, y}})[0], V3d(should.rgb_at(x, y)), 1e-6);
        }
    }
}

// --- Radiance ----------------------------------------------------------------------------------------------

struct Pixel {
    std::uint8_t r, g, b, e;
};

// No two pixels are equal, and the exponents form runs in each row.
Pixel pixel_at(int x, int y) {
    return {static_cast<std::uint8_t>(128 + x), static_cast<std::uint8_t>(128 + 3 * y),
            static_cast<std::uint8_t>(140 + x + y), static_cast<std::uint8_t>(x < 5 ? 130 : 128)};
}

V3d value_of(const Pixel& p) {
    return V3d(p.r, p.g, p.b) * std::ldexp(1.0, p.e - 136);
}

// Encodes one scan line with its four components separate: runs of 3 or more are packed.
std::string packed(const std::vector<Pixel>& line) {
    std::string out{2, 2, static_cast<char>(line.size() >> 8), static_cast<char>(line.size() & 0xFF)};
    for (const auto part : {&Pixel::r, &Pixel::g, &Pixel::b, &Pixel::e}) {
        for (std::size_t i = 0; i < line.size();) {
            std::size_t run = 1;
            while (i + run < line.size() && run < 127 && line[i + run].*part == line[i].*part) ++run;
            out += static_cast<char>(run >= 3 ? 128 + run : 1);
            out += static_cast<char>(line[i].*part);
            i += run >= 3 ? run : 1;
        }
    }
    return out;
}

// Writes a file with axes such as "-Y 9 +X 12" after this header; the lines are encoded if `pack` is set.
std::string radiance(const std::string& header, std::string_view axes, int width, int height, bool pack) {
    const bool columns = axes[1] == 'X';
    const bool up = (columns ? axes[3] : axes[0]) == '+', left = (columns ? axes[0] : axes[3]) == '-';
    std::string out = "#?RADIANCE\n" + header + "\n";
    out += fmt::format("{} {} {} {}\n", axes.substr(0, 2), columns ? width : height, axes.substr(3),
                       columns ? height : width);
    for (int l = 0; l < (columns ? width : height); ++l) {
        std::vector<Pixel> line;
        for (int p = 0; p < (columns ? height : width); ++p) {
            const int x = columns ? l : p, y = columns ? p : l;
            line.push_back(pixel_at(left ? width - 1 - x : x, up ? height - 1 - y : y));
        }
        if (pack) {
            out += packed(line);
        } else {
            for (const Pixel& p : line) out.append(reinterpret_cast<const char*>(&p), 4);
        }
    }
    return out;
}

constexpr std::array<std::string_view, 8> kAxes{"-Y +X", "-Y -X", "+Y +X", "+Y -X",
                                                "+X +Y", "+X -Y", "-X +Y", "-X -Y"};
const std::string kRgbe = "FORMAT=32-bit_rle_rgbe\n";

TEST_F(PictureFormats, Radiance_AllAxisOrders_AreTheSamePicture) {
    for (const std::string_view axes : kAxes) {
        for (const bool pack : {false, true}) {
            SCOPED_TRACE(std::string(axes) + (pack ? " packed" : ""));
            const auto path = file("a.hdr", radiance(kRgbe, axes, 12, 9, pack));
            const auto image = read(path);
            ASSERT_EQ(image->width, 12);
            ASSERT_EQ(image->height, 9);
            for (int y = 0; y < 9; ++y) {
                for (int x = 0; x < 12; ++x) expect_near(image->rgb_at(x, y), value_of(pixel_at(x, y)), 0);
            }
            expect_texture(path, *image);
            const Photograph photograph = read_photograph(path, "G");
            EXPECT_EQ(photograph.size, V2i(12, 9));
            EXPECT_EQ(photograph.counts[12 + 5], image->rgb_at(5, 1).y);
        }
    }
}

TEST_F(PictureFormats, Radiance_ShortLinesAndOldRuns_AreRead) {
    expect_near(read(file("a.hdr", radiance(kRgbe, "-Y +X", 3, 2, false)))->rgb_at(2, 1),
                value_of(pixel_at(2, 1)), 0);
    // The run stands for 300 = 44 + 1 * 256 further pixels like the first.
    std::string old = "#?RGBE\n\n-Y 1 +X 302\n";
    for (const Pixel p :
         {Pixel{200, 100, 50, 129}, Pixel{1, 1, 1, 44}, Pixel{1, 1, 1, 1}, Pixel{20, 30, 40, 128}})
        old.append(reinterpret_cast<const char*>(&p), 4);
    const auto image = read(file("old.pic", old));
    for (const int x : {0, 1, 44, 45, 300}) expect_near(image->rgb_at(x, 0), V3d(200, 100, 50) / 128, 0);
    expect_near(image->rgb_at(301, 0), V3d(20, 30, 40) / 256, 0);
}

TEST_F(PictureFormats, Radiance_ExposureAndColourCorrection_DivideByTheirProducts) {
    const std::string header =
        "EXPOSURE=2\n" + kRgbe + "\tEXPOSURE=100\nCOLORCORR= 1 2 4\nEXPOSURE= 4.0 \r\nCOLORCORR=2 1 1\n";
    const auto path = file("a.hdr", radiance(header, "-Y +X", 12, 9, true));
    const auto image = read(path);
    expect_near(image->rgb_at(7, 3), value_of(pixel_at(7, 3)) / V3d(16, 16, 32), 1e-6);
    expect_texture(path, *image);
}

TEST_F(PictureFormats, Radiance_Xyze_IsConvertedFromCieXyz) {
    const auto path = file("a.hdr", radiance("FORMAT=32-bit_rle_xyze\n", "-Y +X", 12, 9, true));
    const auto image = read(path);
    for (const V2i& at : {V2i(0, 0), V2i(11, 3), V2i(4, 8)}) {
        const V3d xyz = value_of(pixel_at(at.x, at.y));
        expect_near(image->rgb_at(at.x, at.y), colour_spaces().front().from_xyz(xyz));
        EXPECT_NEAR(double{luminance(image->rgb_at(at.x, at.y))}, xyz.y, 1e-4 * xyz.y);
    }
    expect_texture(path, *image);
    EXPECT_EQ(read_photograph(path).counts[0], static_cast<float>(value_of(pixel_at(0, 0)).y))
        << "luminance is Y";
    // Equal X, Y and Z are not white.
    std::string equal = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n\x80\x80\x80\x81";
    expect_near(read(file("e.hdr", equal))->rgb_at(0, 0), colour_spaces().front().from_xyz(V3d(1)));
}

TEST_F(PictureFormats, Radiance_Primaries_AreConverted) {
    const auto path = file("a.hdr", radiance(kRgbe + "PRIMARIES=.708 .292 .170 .797 .131 .046 .3127 .3290\n",
                                             "-Y +X", 12, 9, true));
    const auto image = read(path);
    const V3d raw = value_of(pixel_at(2, 2));
    expect_near(image->rgb_at(2, 2),
                conversion(*find_colour_space("rec2020"), colour_spaces().front()) * raw);
    expect_texture(path, *image);
    EXPECT_THAT(
        error_of(file("b.hdr", radiance(kRgbe + "PRIMARIES=0 1 0 1 0 1 0 1\n", "-Y +X", 12, 9, true))),
        HasSubstr("do not span a colour space"));
}

TEST_F(PictureFormats, Radiance_Damage_IsNamed) {
    const auto of = [&](const std::string& bytes) { return error_of(file("a.hdr", bytes)); };
    const std::string good = radiance(kRgbe, "-Y +X", 12, 9, true);
    EXPECT_THAT(of(good.substr(0, good.size() - 1)), HasSubstr("ends before its last pixel"));
    EXPECT_THAT(of("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"), HasSubstr("ends in its header"));
    EXPECT_THAT(of("#?RADIANCE\nFORMAT=32-bit_rle_spec\n\n"),
                HasSubstr("FORMAT=32-bit_rle_spec; expected 32-bit_rle_rgbe"));
    for (const char* size :
         {"-Y 16 +Y 32", "-Z 16 +X 32", "Y 16 X 32", "-Y 0 +X 32", "-Y 16", "-Y -16 +X 32", "nonsense"})
        EXPECT_THAT(of(fmt::format("#?RADIANCE\n\n{}\n", size)),
                    HasSubstr(fmt::format("the size \"{}\"", size)));
    EXPECT_THAT(of("#?RADIANCE\n\n-Y 30000 +X 30000\n"), HasSubstr("not plausible"));
    for (const char* line : {"EXPOSURE=0", "EXPOSURE=-1", "EXPOSURE=x", "EXPOSURE=1 2", "COLORCORR=1 2",
                             "COLORCORR=1 0 1", "PRIMARIES=1"})
        EXPECT_THAT(of(radiance(std::string(line) + "\n", "-Y +X", 3, 2, false)),
                    HasSubstr(std::string(line) + "; expected"));
    Sampler sampler(5, Purpose::test, 0, 0);
    for (int i = 0; i < 300; ++i) {
        std::string bad = good;
        bad[sampler.bits() % bad.size()] = static_cast<char>(sampler.bits());
        try {
            const auto image = read(file("b.hdr", bad));
            for (const float v : image->data) EXPECT_TRUE(v >= 0 && std::isfinite(v));
        } catch (const InputError&) {
        }
    }
}

TEST_F(PictureFormats, SkyOfBothOrders_IsUpright) {
    LUCERNA_NEED_DATA(normal, "faults/sky/top_normal.hdr");
    LUCERNA_NEED_DATA(flipped, "faults/sky/top_plusY.hdr");
    LUCERNA_NEED_DATA(xyze, "faults/sky/xyze.hdr");
    const auto up = read(flipped);
    EXPECT_EQ(up->data, read(normal)->data);
    // A uniform upper half of the sky has the irradiance pi times its radiance.
    EXPECT_NEAR(double{up->rgb_at(3, 0).y} * 3.14159265, 12.57, 0.005);
    EXPECT_GT(up->rgb_at(3, 7).y, 3);
    EXPECT_LT(up->rgb_at(3, 8).y, 1.5);
    const auto xyz = read(xyze);
    EXPECT_NEAR(double{luminance(xyz->rgb_at(0, 0))}, 2, 1e-4);
}

// --- PNG and TIFF: colours that files state

std::string big(std::uint32_t number, int bytes = 4) {
    std::string out;
    for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>(number >> (8 * i) & 0xFF);
    return out;
}

std::string chunk(const std::string& type, const std::string& content) {
    std::uint32_t c = 0xFFFFFFFF;
    for (const char byte : type + content) {
        c ^= static_cast<unsigned char>(byte);
        for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? 0xEDB88320 ^ (c >> 1) : c >> 1;
    }
    return big(static_cast<std::uint32_t>(content.size())) + type + content + big(~c);
}

// Writes zlib's format without compression.
std::string stored(const std::string& bytes) {
    std::uint32_t a = 1, b = 0;
    for (const char byte : bytes) {
        a = (a + static_cast<unsigned char>(byte)) % 65521;
        b = (b + a) % 65521;
    }
    const auto length = static_cast<std::uint16_t>(bytes.size());
    const auto little = [](std::uint16_t n) {
        return std::string{static_cast<char>(n & 0xFF), static_cast<char>(n >> 8)};
    };
    return "\x78\x01\x01" + little(length) + little(static_cast<std::uint16_t>(~length)) + bytes +
           big(b << 16 | a);
}

// Writes a PNG of one pixel with three 16-bit numbers, or with one.
std::string png(const std::string& chunks, const std::vector<int>& numbers) {
    std::string row(1, '\0');
    for (const int number : numbers) row += big(static_cast<std::uint32_t>(number), 2);
    return "\x89PNG\r\n\x1a\n" +
           chunk("IHDR", big(1) + big(1) + std::string{16, numbers.size() == 3 ? '\2' : '\0', 0, 0, 0}) +
           chunks + chunk("IDAT", stored(row)) + chunk("IEND", "");
}

std::string gama(double value) {
    return chunk("gAMA", big(static_cast<std::uint32_t>(std::lround(value * 1e5))));
}

std::string chrm(const ColourSpace& space) {
    std::string bytes;
    for (const std::size_t i : {6, 7, 0, 1, 2, 3, 4, 5})
        bytes += big(static_cast<std::uint32_t>(std::lround(double{space.chromaticities[i]} * 1e5)));
    return chunk("cHRM", bytes);
}

// --- ICC profiles ---

std::string fixed(double value) {
    return big(static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(value * 65536))));
}

std::string xyz_type(const V3d& v) {
    return "XYZ " + big(0) + fixed(v.x) + fixed(v.y) + fixed(v.z);
}
std::string gamma_curve(double exponent) {
    return "curv" + big(0) + big(1) + big(static_cast<std::uint32_t>(std::lround(exponent * 256)), 2) +
           big(0, 2);
}
const std::string kLinearCurve = "curv" + big(0) + big(0);
std::string table_curve(const std::function<double(double)>& f, int count) {
    std::string out = "curv" + big(0) + big(static_cast<std::uint32_t>(count));
    for (int i = 0; i < count; ++i)
        out += big(static_cast<std::uint32_t>(std::lround(65535 * f(i / (count - 1.0)))), 2);
    return out;
}
const std::string kSrgbCurve = "para" + big(0) + big(3, 2) + big(0, 2) + fixed(2.4) + fixed(1 / 1.055) +
                               fixed(0.055 / 1.055) + fixed(1 / 12.92) + fixed(0.04045);

// Returns the colorants of a space with white D65, adapted to D50 by Bradford's matrix as printed in
// ICC.1:2010.
std::array<V3d, 3> colorants(const ColourSpace& space) {
    const std::array<V3d, 3> rows{V3d(1.047886, 0.022919, -0.050216), V3d(0.029582, 0.990484, -0.017079),
                                  V3d(-0.009252, 0.015073, 0.751678)};
    std::array<V3d, 3> out;
    for (std::size_t i = 0; i < 3; ++i) {
        const V3d& p = space.primaries[i];
        out[i] = V3d(rows[0].dot(p), rows[1].dot(p), rows[2].dot(p));
    }
    return out;
}

std::string profile(std::string_view colours, const std::vector<std::pair<std::string, std::string>>& tags) {
    std::string table = big(static_cast<std::uint32_t>(tags.size())), data;
    const std::size_t begin = 128 + 4 + 12 * tags.size();
    for (const auto& [name, content] : tags) {
        table += name + big(static_cast<std::uint32_t>(begin + data.size())) +
                 big(static_cast<std::uint32_t>(content.size()));
        data += content + std::string((4 - content.size() % 4) % 4, '\0');
    }
    std::string header(128, '\0');
    const auto put = [&header](std::size_t at, const std::string& bytes) {
        header.replace(at, bytes.size(), bytes);
    };
    put(0, big(static_cast<std::uint32_t>(begin + data.size())));
    put(8, big(0x02400000));
    put(12, "mntr" + std::string(colours) + "XYZ ");
    put(36, "acsp");
    put(68, big(0xF6D6) + big(0x10000) + big(0xD32D));
    return header + table + data;
}

std::string rgb_profile(const ColourSpace& space, const std::string& red, const std::string& green,
                        const std::string& blue) {
    const auto [r, g, b] = colorants(space);
    return profile("RGB ", {{"rXYZ", xyz_type(r)},
                            {"gXYZ", xyz_type(g)},
                            {"bXYZ", xyz_type(b)},
                            {"rTRC", red},
                            {"gTRC", green},
                            {"bTRC", blue}});
}
std::string rgb_profile(const ColourSpace& space, const std::string& curve) {
    return rgb_profile(space, curve, curve, curve);
}

std::string iccp(const std::string& profile) {
    return chunk("iCCP", std::string("profile\0\0", 9) + stored(profile));
}

const std::vector<int> kNumbers{40000, 30000, 24000};
V3d shares() {
    return V3d(kNumbers[0], kNumbers[1], kNumbers[2]) / 65535.0;
}
V3d decoded(const std::function<double(double)>& f) {
    return {f(shares().x), f(shares().y), f(shares().z)};
}
double srgb(double x) {
    return double{srgb_decoded(static_cast<float>(x))};
}
V3d from(std::string_view space, const V3d& rgb) {
    return conversion(*find_colour_space(space), colour_spaces().front()) * rgb;
}

TEST_F(PictureFormats, Png_GammaAndChromaticities_AreFollowed) {
    const auto expect = [&](const std::string& chunks, const V3d& should) {
        const auto path = file("a.png", png(chunks, kNumbers));
        const auto image = read(path);
        expect_near(image->rgb_at(0, 0), should);
        EXPECT_THAT(warnings_, IsEmpty());
        expect_texture(path, *image);
    };
    const ColourSpace& wide = *find_colour_space("rec2020");
    expect("", decoded(srgb));
    expect(gama(1), shares());
    expect(gama(0.45455), decoded(srgb));
    expect(gama(0.46), decoded(srgb));
    expect(gama(1 / 1.8), decoded([](double x) { return std::pow(x, 1 / 0.55556); }));
    expect(gama(1) + chunk("sRGB", std::string(1, '\0')), decoded(srgb));
    expect(chrm(colour_spaces().front()) + gama(0.45455), decoded(srgb));
    expect(chrm(wide) + gama(1), from("rec2020", shares()));
    expect(chrm(wide), from("rec2020", decoded(srgb)));
    // The scene's encoding takes precedence over the file's.
    TextureImages images;
    const auto path = file("b.png", png(gama(1) + chrm(wide), kNumbers));
    expect_near(images.open(path, {Encoding::Kind::srgb}, WorkingSpace())->square({{0, 0}, {0, 0}})[0],
                decoded(srgb));
    // A grey picture has no primaries.
    const auto grey = file("c.png", png(gama(1) + chrm(wide), {kNumbers[0]}));
    expect_near(read(grey)->rgb_at(0, 0), V3d(shares().x));
    // Photographs keep the numbers that the camera wrote.
    EXPECT_EQ(read_photograph(path, "R").counts[0], static_cast<float>(kNumbers[0]));
}

TEST_F(PictureFormats, Png_ChunksThatSayNothing_AreNamed) {
    const std::string nowhere = chunk("cHRM", std::string(32, '\0'));
    expect_near(read(file("a.png", png(gama(0), kNumbers)))->rgb_at(0, 0), decoded(srgb));
    EXPECT_THAT(warnings_, ElementsAre(AllOf(HasSubstr("a.png"), HasSubstr("gAMA of 0"))));
    expect_near(read(file("b.png", png(nowhere, kNumbers)))->rgb_at(0, 0), decoded(srgb));
    EXPECT_THAT(warnings_, ElementsAre(HasSubstr("cHRM spans no colour space")));
    expect_near(read(file("c.png", png(chunk("cICP", {9, 16, 0, 1}), kNumbers)))->rgb_at(0, 0),
                decoded(srgb));
    EXPECT_THAT(warnings_, ElementsAre(HasSubstr("cICP")));
    read(file("d.png", png(chunk("cICP", {1, 13, 0, 1}), kNumbers)));
    EXPECT_THAT(warnings_, IsEmpty());
}

// The profile's curves and primaries apply.
TEST_F(PictureFormats, IccProfile_OfCurvesAndPrimaries_IsFollowed) {
    const ColourSpace &standard = colour_spaces().front(), &p3 = *find_colour_space("dci-p3");
    const auto expect = [&](const std::string& icc, const V3d& should, double relative = 1e-4) {
        const auto path = file("a.png", png(gama(0.3) + iccp(icc), kNumbers));
        const auto image = read(path);
        expect_near(image->rgb_at(0, 0), should, relative);
        EXPECT_THAT(warnings_, IsEmpty());
        expect_texture(path, *image);
    };
    expect(rgb_profile(standard, kSrgbCurve), decoded(srgb), 1e-6);
    expect(rgb_profile(standard, table_curve(srgb, 1024)), decoded(srgb), 1e-6);
    expect(rgb_profile(standard, kLinearCurve), shares());
    expect(rgb_profile(standard, gamma_curve(1)), shares());
    expect(rgb_profile(standard, gamma_curve(1.8)),
           decoded([](double x) { return std::pow(x, static_cast<double>(std::lround(1.8 * 256)) / 256); }));
    const auto square = [](double x) { return x * x; };
    expect(rgb_profile(standard, table_curve(square, 2049)), decoded(square));
    expect(rgb_profile(p3, kSrgbCurve), from("dci-p3", decoded(srgb)), 1e-3);
    expect(rgb_profile(p3, kLinearCurve), from("dci-p3", shares()), 1e-3);
    // The curve is y = (a x + b)^g, or 0 below; the next one has a linear part below d [ICC.1:2010, table
    // 65].
    expect(rgb_profile(standard,
                       "para" + big(0) + big(1, 2) + big(0, 2) + fixed(2) + fixed(1.25) + fixed(-0.25)),
           decoded([](double x) { return x < 0.2 ? 0 : std::pow(1.25 * x - 0.25, 2); }));
    const auto grey =
        read(file("g.png", png(iccp(profile("GRAY", {{"kTRC", gamma_curve(3)}})), {kNumbers[0]})));
    expect_near(grey->rgb_at(0, 0), V3d(std::pow(shares().x, 3)));
}

TEST_F(PictureFormats, IccProfile_OfAnotherKind_IsNamed) {
    const ColourSpace& standard = colour_spaces().front();
    const auto expect = [&](const std::string& icc, const char* why) {
        expect_near(read(file("a.png", png(gama(1) + iccp(icc), kNumbers)))->rgb_at(0, 0), shares());
        EXPECT_THAT(warnings_, ElementsAre(AllOf(HasSubstr("a.png"), HasSubstr("ICC profile is not followed"),
                                                 HasSubstr(why))));
    };
    expect(profile("RGB ", {{"A2B0", std::string(64, '\1')}}), "no rTRC");
    expect(rgb_profile(standard, kSrgbCurve, kSrgbCurve, kLinearCurve), "differ");
    expect(rgb_profile(standard, "what" + big(0) + big(0)), "unknown type");
    expect(profile("RGB ", {{"rTRC", "curv" + big(0) + big(500)}}), "damaged");
}

// Writes a TIFF of one pixel with three bytes and a profile.
std::string tiff(const std::string& icc) {
    const auto little = [](std::uint32_t n, int bytes) {
        std::string out;
        for (int i = 0; i < bytes; ++i) out += static_cast<char>(n >> (8 * i) & 0xFF);
        return out;
    };
    struct Entry {
        std::uint32_t tag, type, count, value;
    };
    constexpr std::uint32_t kEntries = 10, kData = 8 + 2 + 12 * kEntries + 4;
    const Entry entries[kEntries] = {
        {256, 3, 1, 1},     {257, 3, 1, 1},
        {258, 3, 3, kData}, {259, 3, 1, 1},
        {262, 3, 1, 2},     {273, 4, 1, kData + 8},
        {277, 3, 1, 3},     {278, 3, 1, 1},
        {279, 4, 1, 3},     {34675, 7, static_cast<std::uint32_t>(icc.size()), kData + 12}};
    std::string out = std::string("II*\0", 4) + little(8, 4) + little(kEntries, 2);
    for (const Entry& e : entries)
        out += little(e.tag, 2) + little(e.type, 2) + little(e.count, 4) + little(e.value, 4);
    out += little(0, 4) + little(8, 2) + little(8, 2) + little(8, 2) + little(0, 2);
    return out + std::string{'\x99', '\x4D', '\x1A', 0} + icc;
}

TEST_F(PictureFormats, IccProfile_OfATiff_IsFollowed) {
    const V3d bytes = V3d(0x99, 0x4D, 0x1A) / 255.0;
    const auto path = file("a.tif", tiff(rgb_profile(colour_spaces().front(), kLinearCurve)));
    const auto image = read(path);
    expect_near(image->rgb_at(0, 0), bytes);
    expect_texture(path, *image);
    expect_near(
        read(file("b.tif", tiff(rgb_profile(*find_colour_space("dci-p3"), kLinearCurve))))->rgb_at(0, 0),
        from("dci-p3", bytes), 1e-3);
    EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(PictureFormats, SixteenBitPngOfGammaOne_IsLinear) {
    LUCERNA_NEED_DATA(path, "faults/sky/p16lin_gama.png");
    expect_near(read(path)->rgb_at(3, 3), V3d(32958.0 / 65535), 1e-6);
}

// --- OpenEXR -----------------------------------------------------------------------------------------------

TEST_F(PictureFormats, ExrOfIntegers_IsRefused) {
    LUCERNA_NEED_DATA(path, "faults/sky/uint.exr");
    EXPECT_THAT(error_of(path),
                AllOf(HasSubstr("channel R holds integers"), HasSubstr("expected half, float")));
    EXPECT_THAT(testing::error_of([&] { read_exr(path); }),
                AllOf(HasSubstr("holds integers (UINT)"), HasSubstr("expected half or float")));
    EXPECT_THAT(testing::error_of([&] { read_photograph(path); }),
                HasSubstr("expected 8- or 16-bit integers, half or float"));
}

TEST_F(PictureFormats, ExrOfXyz_IsConvertedFromCieXyz) {
    const V3d xyz(0.9, 0.7, 0.3), equal(0.5, 0.5, 0.5);
    Image written(2, 1, {"X", "Y", "Z", "A"});
    for (int c = 0; c < 3; ++c) {
        written.value(0, 0, c) = static_cast<float>(xyz[c]);
        written.value(1, 0, c) = static_cast<float>(equal[c]);
    }
    const auto path = folder_ / "a.exr";
    write_exr(path, written);
    const ColourSpace& srgb = colour_spaces().front();
    const auto image = read(path);
    expect_near(image->rgb_at(0, 0), srgb.from_xyz(xyz));
    expect_near(image->rgb_at(1, 0), srgb.from_xyz(equal));
    expect_texture(path, *image);
    const Image compared = read_exr(path);
    EXPECT_EQ(compared.channels, (std::vector<std::string>{"R", "G", "B", "A"}));
    expect_near(compared.rgb_at(0, 0), srgb.from_xyz(xyz));
    expect_near(compared.rgb_at(1, 0), srgb.from_xyz(equal));
    EXPECT_EQ(compared.attributes.at("lucerna.broughtfrom"), "cie-xyz");
    EXPECT_EQ(read_photograph(path).counts[0], 0.7F) << "luminance is Y";
    EXPECT_THAT(testing::error_of([&] { read_photograph(path, kColourChannels); }),
                HasSubstr("channels X, Y and Z"));
    // Numbers that are not colours are kept in their order.
    TextureImages images;
    EXPECT_EQ(images.open(path, {Encoding::Kind::linear})->square({{0, 0}, {0, 0}})[0], Rgb(V3f(xyz)));
    // Beside R, G and B, the channels X, Y and Z are not the colour.
    Image both(1, 1, {"R", "G", "B", "X", "Y", "Z"});
    both.set_rgb(0, 0, Rgb(0.1F, 0.2F, 0.3F));
    write_exr(folder_ / "b.exr", both);
    EXPECT_EQ(read(folder_ / "b.exr")->rgb_at(0, 0), Rgb(0.1F, 0.2F, 0.3F));
    EXPECT_EQ(read_exr(folder_ / "b.exr").rgb_at(0, 0), Rgb(0.1F, 0.2F, 0.3F));
}

}  // namespace picture_formats_test
}  // namespace lucerna
