#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "lights/photometric_files.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"

namespace lucerna {
namespace tm33_test {

using ::testing::ElementsAre;
using testing::error_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ListeningMonitor;

constexpr const char* kSizes =
    "<Dimensions><Length>1.2</Length><Width>0.3</Width><Height>0.1</Height></Dimensions>";

// Writes the intensity 100 + 10 v / 45 + h at the angles v = 0, 45, 90 of each plane h.
std::string points(const std::vector<double>& planes) {
    std::string text;
    for (const double h : planes) {
        for (const double v : {0.0, 45.0, 90.0})
            text +=
                fmt::format("<IntData h=\"{}\" v=\"{}\">{}</IntData>\n", h, v, v == 0 ? 100 : 100 + v + h);
    }
    return text;
}
std::string counts(std::size_t planes) {
    return fmt::format(
        "<NumberMeasured>{}</NumberMeasured><NumberHorz>{}</NumberHorz><NumberVert>3</NumberVert>",
        3 * planes, planes);
}
std::string emitter(const std::string& intensity, const std::string& more = "") {
    return "<Emitter><Quantity>1</Quantity><InputWattage>25</InputWattage>" + more +
           "<LuminousData><LuminousIntensity>\n" + intensity +
           "</LuminousIntensity></LuminousData></Emitter>\n";
}
std::string document(const std::string& emitters, const std::string& luminaire = kSizes,
                     const std::string& root = "IESTM33-22") {
    return fmt::format(
        "<?xml version=\"1.0\"?>\n<!-- <Fake> -->\n<{0}>\n<Version>1.1</Version>\n<Header><Manufacturer>Works"
        "</Manufacturer><Description>Lamp</Description></Header>\n<Luminaire>{1}</Luminaire>\n{2}</{0}>\n",
        root, luminaire, emitters);
}
std::string with_planes(const std::vector<double>& planes, const std::string& symmetry) {
    return document(emitter("<Symm>" + symmetry + "</Symm>" + counts(planes.size()) + points(planes)));
}

std::vector<LuminaireEmitter> read(const std::string& text) {
    Monitor silent;
    return parse_tm33(text, "lamp.xml", silent);
}
PhotometricWeb parse(const std::string& text) {
    return luminaire_web(read(text));
}
std::string refusal(const std::string& text) {
    return error_of([&] { parse(text); });
}
double at_horizon(const PhotometricWeb& web, double c) {
    return web.intensity(web.direction(90, c));
}

TEST(Tm33, Web_IsThatOfAnIesFileOfTheSameDistribution) {
    Monitor silent;
    const PhotometricWeb ies = parse_ies(
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 2 3 3 1 2 0.3 1.2 0\n1 1 25\n0 45 90\n0 90 180\n"
        "100 145 190 100 235 280 100 325 370\n",
        "lamp.ies", silent);
    for (const char* root : {"IESTM33-18", "IESTM33-22", "IESTM33", "LuminaireOpticalData"}) {
        const PhotometricWeb web = parse(document(
            emitter("<Symm>Symm_Bi_0</Symm><Multiplier>2</Multiplier>" + counts(3) + points({0, 90, 180})),
            kSizes, root));
        EXPECT_EQ(web.grid().candela, ies.grid().candela) << root;
        EXPECT_EQ(web.grid().azimuth, ies.grid().azimuth);
        EXPECT_EQ(web.grid().polar, ies.grid().polar);
        EXPECT_EQ(web.flux(), ies.flux());
        EXPECT_EQ(web.info().watts, 25);
        EXPECT_EQ(web.info().opening.size, V3d(0.3, 1.2, 0)) << "the length lies along C90";
        EXPECT_TRUE(web.info().axis_along_c90);
        EXPECT_EQ(web.info().provenance, std::string(root) + ", Works, Lamp");
    }
}

TEST(Tm33, EverySymmetry_GivesAllPlanes) {
    for (const std::string space : {"", " "}) {
        const std::string symm = "Symm" + space + "_" + space;
        EXPECT_NEAR(at_horizon(parse(with_planes({0}, symm + "Full")), 200), 190, 1e-3);
        EXPECT_NEAR(at_horizon(parse(with_planes({0, 90}, symm + "Quad")), 200), 210, 1e-3);
        EXPECT_NEAR(at_horizon(parse(with_planes({0, 180}, symm + "Bi_0")), 270), 280, 1e-3);
        EXPECT_NEAR(at_horizon(parse(with_planes({90, 270}, symm + "Bi_90")), 0), 370, 1e-3);
        EXPECT_NEAR(at_horizon(parse(with_planes({0, 90, 180, 270}, symm + "None")), 315), 325, 1e-3);
    }
    EXPECT_NEAR(at_horizon(parse(document(emitter(points({0, 90})))), 315), 235, 1e-3) << "as in an IES file";
}

TEST(Tm33, PointsInAnyOrder_AndOtherNamesOfAngles_AreRead) {
    const std::string text =
        "<IntensityData horz=\"0\" vert=\"90\">5</IntensityData><IntensityData horizontal=\"0\" "
        "vertical=\"0\">7</IntensityData>";
    const PhotometricWeb web =
        parse(document("<Emitter><LuminousData>" + text + "</LuminousData></Emitter>"));
    EXPECT_THAT(web.grid().polar, ElementsAre(0, 90));
    EXPECT_NEAR(web.intensity({0, 0, 1}), 7, 1e-6);
    const std::string unimetric = "<Emitter><IntensityDistribution><Metric>Radiant</Metric>" + text +
                                  "</IntensityDistribution><IntensityDistribution><Metric>Luminous</Metric>" +
                                  text + "</IntensityDistribution></Emitter>";
    EXPECT_NEAR(parse(document(unimetric)).peak(), 7, 1e-6);
}

TEST(Tm33, EmissionAreas_AreTheOpening) {
    const auto opening = [](const std::string& areas) {
        return parse(document(emitter(points({0}), "<EmissionAreas>" + areas + "</EmissionAreas>")))
            .info()
            .opening;
    };
    const auto area = [](double length, double width, double offset, const std::string& more = "") {
        return fmt::format(
            "<BottomArea><Length>{}</Length><Width>{}</Width><LengthOffset>{}</LengthOffset><WidthOffset>0"
            "</WidthOffset>{}</BottomArea>",
            length, width, offset, more);
    };
    const LuminousOpening one = opening("<BottomFace><NumberBottom>1</NumberBottom>" + area(0.6, 0.2, 0) +
                                        "</BottomFace><C0Face><C0Area>"
                                        "<Length>0.6</Length><Height>0.05</Height></C0Area></C0Face>");
    EXPECT_EQ(one.size.x, 0.2);
    EXPECT_EQ(one.size.y, 0.6);
    EXPECT_NEAR(one.projected_area({1, 0, 0}), 0.6 * 0.05, 1e-12) << "the side that faces C0";
    EXPECT_EQ(one.projected_area({-1, 0, 0}), 0);
    EXPECT_EQ(
        opening("<BottomFace>" + area(0.2, 0.2, 0, "<Circular>true</Circular>") + "</BottomFace>").name(),
        "disc");
    const LuminousOpening two =
        opening("<BottomFace>" + area(0.2, 0.2, -0.4) + area(0.2, 0.2, 0.4) + "</BottomFace>");
    EXPECT_NEAR(two.size.y, 1, 1e-12) << "the rectangle around both";
}

TEST(Tm33, SeveralEmitters_AreAddedUp_AndKeepTheirPlaces) {
    const std::string centre =
        "<EmitterCenter><LengthOffset>0.5</LengthOffset><WidthOffset>0.2</WidthOffset><HeightOffset>0.1"
        "</HeightOffset></EmitterCenter>";
    const std::string text = document(emitter(points({0})) + emitter(points({0}), centre));
    const std::vector<LuminaireEmitter> emitters = read(text);
    ASSERT_EQ(emitters.size(), 2U);
    EXPECT_EQ(emitters[1].position, V3d(0.2, -0.5, -0.1));
    EXPECT_NEAR(parse(text).flux() / emitters[0].web.flux(), 2, 1e-5);
}

TEST(Tm33, WhatIsNotRead_IsNamed) {
    ListeningMonitor monitor;
    parse_tm33(
        document(emitter(points({0}),
                         "<RatedLumens>9000</RatedLumens><BallastFactor>0.9</BallastFactor>"
                         "<SpectralData/>"),
                 "<Dimensions><Length>1200</Length><Width>300</Width><Height>80</Height></Dimensions>"),
        "lamp.xml", monitor);
    EXPECT_THAT(monitor.warnings,
                ElementsAre(HasSubstr("the ballast factor 0.9 is not applied"),
                            HasSubstr("1200 m is read as millimetres"),
                            HasSubstr("lm, but RatedLumens is 9000; they are read as candela"),
                            HasSubstr("<SpectralData> is not read")));
    ListeningMonitor quiet;
    parse_tm33(document(emitter(points({0}))), "lamp.xml", quiet);
    EXPECT_THAT(quiet.warnings, IsEmpty());
}

TEST(Tm33, BadFiles_NameTheirLine) {
    EXPECT_THAT(refusal(document(emitter(points({0}))).substr(0, 400)),
                HasSubstr("the XML is not well-formed"));
    EXPECT_THAT(refusal("<html/>"), HasSubstr("lamp.xml:1:1: the root is <html>; expected <IESTM33-18>"));
    EXPECT_THAT(refusal(document("")), HasSubstr("<IESTM33-22> has no <Emitter>"));
    EXPECT_THAT(
        refusal(document("<Emitter>\n<PhotonData/></Emitter>")),
        HasSubstr("the emitter has no luminous intensities, expected in <LuminousData>; it has PhotonData"));
    EXPECT_THAT(refusal(document(emitter(counts(2) + points({0})))),
                HasSubstr("NumberHorz is 2, but the intensities have 1"));
    EXPECT_THAT(refusal(document(emitter(points({0}) + "<IntData h=\"0\" v=\"90\">1</IntData>"))),
                HasSubstr("lamp.xml:11:1: a second intensity at h 0, v 90"));
    EXPECT_THAT(refusal(document(emitter(points({0}) + "<IntData h=\"90\" v=\"0\">1</IntData>"))),
                HasSubstr("the plane h 90 has 1 intensities, at other angles v than the 3 of the plane h 0"));
    for (const char* value : {"nan", "inf", "", "1,5", "-1", "1e31"}) {
        EXPECT_THAT(refusal(document(emitter(fmt::format("<IntData h=\"0\" v=\"0\">{}</IntData>", value)))),
                    HasSubstr("lamp.xml:8:1: an intensity is"))
            << value;
    }
    EXPECT_THAT(refusal(document(emitter("<IntData h=\"0\">1</IntData>"))),
                HasSubstr("<IntData> lacks the attribute \"v\""));
    EXPECT_THAT(refusal(document(emitter("<IntData h=\"0\" v=\"190\">1</IntData>"))),
                HasSubstr("v is 190; expected 0 to 180"));
    EXPECT_THAT(refusal(with_planes({0, 90}, "Symm_Bi_90")),
                HasSubstr("Symm_Bi_90 with planes from 0 to 90 degrees; expected planes from 90 to 270"));
    EXPECT_THAT(refusal(with_planes({0, 90}, "Symm_Odd")),
                HasSubstr("the symmetry is \"Symm_Odd\"; expected"));
    EXPECT_THAT(
        refusal(document("<Equipment><Gonioradiometer><Type>CIE_B</Type></Gonioradiometer></Equipment>" +
                         emitter(points({0})))),
        HasSubstr("the goniometer's type is \"CIE_B\"; expected C planes"));
}

}  // namespace tm33_test
}  // namespace lucerna
