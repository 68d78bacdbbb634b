#include "lights/measurement/rig_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/error_of.h"

namespace lucerna {
namespace rig_file_test {

using ::testing::AllOf;
using testing::error_of;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kPlanesA =
    "[rig]\nsetup = 'A'\nviews = [41, 41]\nfilter = '5.068mm'\npixels = [150, 100]\n"
    "sensor = ['27.15mm', '18.1mm']\ndistance = '39mm'\n";
const std::string kPlanesB =
    "[rig]\nsetup = 'B'\nviews = [9, 7]\nspacing = '7.5mm'\npixels = 30\nscreen = '1.2m'\ndistance = "
    "'750mm'\n";
const std::string kDisc = "[emitter]\nkind = 'disc'\nradius = '20mm'\nflux = 100\n";

RigDescription rig_of(const std::string& text) {
    return read_rig(TomlTable::parse(text, "rig.toml"));
}
std::string fault(const std::string& text) {
    return error_of([&] { rig_of(text); });
}
std::string without(std::string text, const std::string& part, const std::string& with = "") {
    return text.replace(text.find(part), part.size(), with);
}

TEST(RigFile, ThePapersProjector_IsReadAsStated) {
    const std::filesystem::path file =
        std::filesystem::path(LUCERNA_SOURCE_DIR) / "scenes/lamps/projector/rig.toml";
    const RigDescription d = read_rig_file(file);
    EXPECT_EQ(d.rig.views, V2i(41, 41));
    EXPECT_EQ(d.rig.pixels, V2i(150, 100));
    EXPECT_EQ(d.rig.shift, V2i(7, 7));
    EXPECT_NEAR(d.rig.spacing.x, 1.267e-3, 1e-12);
    EXPECT_NEAR(d.rig.pixel.y, 0.181e-3, 1e-12);
    EXPECT_DOUBLE_EQ(d.rig.distance, 0.039);
    EXPECT_EQ(d.emitter.kind, EmitterDescription::Kind::projector);
    EXPECT_DOUBLE_EQ(d.emitter.half_size.x, 0.025);
    EXPECT_DOUBLE_EQ(d.emitter.focal_length, 0.059);
    EXPECT_DOUBLE_EQ(d.emitter.setback, 0.02);
    EXPECT_EQ(double{d.rig.centre.z}, 0.02);
    EXPECT_TRUE(d.emitter.inverted);
    EXPECT_TRUE(std::filesystem::exists(d.emitter.slide));
    // The paper's format needs four bytes for each coefficient, 96 MiB for this number of them.
    EXPECT_NEAR(static_cast<double>(d.rig.coefficients()) * 4 / (1 << 20), 96, 1);
}

TEST(RigFile, SetupB_LamplikeThings_AreRead) {
    const RigDescription d = rig_of(
        kPlanesB + without(kDisc, "flux = 100", "flux = 3\nunit = 'W'\nexponent = 8\ncolour = [2, 2, 2]") +
        "[camera]\nexposures = [0.01, 0.1]\nbits = 12\nread_noise = 4\nx = '-1m'\n");
    EXPECT_EQ(d.rig.shift, V2i(0, 0));
    EXPECT_DOUBLE_EQ(d.rig.pixel.x, 0.04);
    EXPECT_EQ(d.emitter.unit, FluxUnit::watt);
    EXPECT_EQ(d.emitter.exponent, 8);
    EXPECT_NEAR(d.emitter.colour.x, 1, 1e-6);
    ASSERT_TRUE(d.camera);
    EXPECT_EQ(d.camera->exposures.size(), 2U);
    EXPECT_EQ(d.camera->bits, 12);
    EXPECT_EQ(double{d.camera->place.x}, -1);
}

TEST(RigFile, FilterThatMovesTheSensorByNoWholePixels_IsRefusedWithTheNearest) {
    EXPECT_THAT(fault(without(kPlanesA, "5.068mm", "5.1mm") + kDisc),
                AllOf(StartsWith("rig.toml:4:"), HasSubstr("7.0442 pixels"), HasSubstr("5.068 mm"),
                      HasSubstr("5.792 mm")));
}

TEST(RigFile, Mistakes_NameTheirPlaceAndWhatIsAccepted) {
    EXPECT_THAT(fault(kDisc), HasSubstr("lacks \"rig\""));
    EXPECT_THAT(fault(kPlanesA), HasSubstr("lacks \"emitter\""));
    EXPECT_THAT(fault(without(kPlanesB, "spacing = '7.5mm'") + kDisc),
                HasSubstr("\"spacing\" or \"filter\""));
    EXPECT_THAT(fault(without(kPlanesB, "spacing", "filter = '3cm'\nspacing") + kDisc),
                HasSubstr("exclude each other"));
    EXPECT_THAT(fault(without(kPlanesB, "screen", "sensor") + kDisc), HasSubstr("\"pixel\" or \"screen\""));
    EXPECT_THAT(fault(without(kPlanesB, "'B'", "'C'") + kDisc), HasSubstr("expected A, B"));
    EXPECT_THAT(fault(kPlanesB + without(kDisc, "disc", "disk")), HasSubstr("did you mean \"disc\""));
    EXPECT_THAT(fault(kPlanesB + kDisc + "setback = '-1mm'\n"), HasSubstr("0 or more"));
    EXPECT_THAT(fault(kPlanesB + kDisc + "focus = '1m'\n"), HasSubstr("\"focus\" is unknown"));
    EXPECT_THAT(fault(kPlanesB + kDisc + "colour = [0, 0, 0]\n"), HasSubstr("black"));
    EXPECT_THAT(fault(kPlanesB + kDisc + "[camera]\nexposures = [1, 1]\n"), HasSubstr("ascending"));
    EXPECT_THAT(fault(kPlanesB + kDisc + "[camera]\nbits = 20\n"), HasSubstr("32 for floats"));
    EXPECT_THAT(fault(kPlanesB + kDisc + "[quality]\ns_nodes = 9\n"), HasSubstr("1 to 5"));
    const std::string projector =
        "[emitter]\nkind = 'projector'\naperture = '5cm'\nfocal_length = '59mm'\nfocus = '50mm'\nflux = 1\n"
        "slide = 's.png'\nslide_size = '3cm'\n";
    EXPECT_THAT(fault(kPlanesB + projector), HasSubstr("not beyond the focal length"));
}

TEST(RigFile, Key_ChangesWithEveryNumber) {
    const auto key = [](const std::string& text) { return description_key(rig_of(text)); };
    const std::uint64_t one = key(kPlanesB + kDisc);
    EXPECT_EQ(one, key("# a remark\n" + kPlanesB + kDisc));
    for (const auto& [from, to] :
         std::vector<std::pair<std::string, std::string>>{{"[9, 7]", "[7, 9]"},
                                                          {"750mm", "751mm"},
                                                          {"20mm", "21mm"},
                                                          {"flux = 100", "flux = 101"},
                                                          {"pixels = 30", "pixels = 31"},
                                                          {"kind", "exponent = 2\nkind"},
                                                          {"kind", "setback = '1mm'\nkind"}})
        EXPECT_NE(one, key(without(kPlanesB + kDisc, from, to))) << to;
    EXPECT_NE(one, key(kPlanesB + kDisc + "[quality]\nm_nodes = 2\n"));
}

}  // namespace rig_file_test
}  // namespace lucerna
