// GLDF archives with EULUMDAT and L3D files, which the tests make.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "lights/l3d.h"
#include "lights/photometric_files.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/archives.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace gldf_test {

using ::testing::ElementsAre;
using testing::error_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ListeningMonitor;

// The lamp has 100 cd at nadir and, at the horizon, 10, 20, 30 and 40 cd at C0, C90, C180 and C270. Its lamps
// have `lumens`, of which 80 % are stated to leave it.
std::string ldt(int lumens = 1000, int count = 1) {
    std::string t =
        "Works\n1\n0\n4\n90\n2\n90\nreport\nLamp\nnr\nfile\ndate\n300\n200\n50\n0\n0\n0\n0\n0\n0\n100\n80\n1"
        "\n0\n1\n";
    t += fmt::format("{}\nLED\n{}\n3000\n80\n25\n", count, lumens);
    for (int i = 0; i < 10; ++i) t += "0.5\n";
    return t + "0\n90\n180\n270\n0\n90\n100\n10\n100\n20\n100\n30\n100\n40\n";
}

// The head hangs 0.5 m below the joint, which is turned by 90 degrees; the object lies 0.1 m in front of the
// joint along the turned x axis, which is the luminaire's y axis.
std::string l3d(const std::string& object =
                    "<Rotation x=\"0\" y=\"0\" z=\"0\"/><Rectangle sizeX=\"0.2\" sizeY=\"0.6\"/>") {
    return testing::zip_of(
        {{"structure.xml",
          "<?xml version=\"1.0\"?><Luminaire><Structure><Geometry partName=\"base\"><Position "
          "x=\"0\" y=\"0\" z=\"1\"/><Rotation x=\"0\" y=\"0\" z=\"0\"/><Joints><Joint "
          "partName=\"j\"><Position x=\"0\" y=\"0\" z=\"1\"/><Rotation x=\"0\" y=\"0\" "
          "z=\"60\"/><DefaultRotation x=\"0\" y=\"0\" z=\"30\"/><Geometries><Geometry "
          "partName=\"head\"><Position x=\"0\" y=\"0\" z=\"-0.5\"/><Rotation x=\"0\" y=\"0\" "
          "z=\"0\"/><LightEmittingObjects><LightEmittingObject partName=\"leo\"><Position "
          "x=\"0.1\" y=\"0\" z=\"0\"/>" +
              object +
              "</LightEmittingObject></LightEmittingObjects></Geometry></Geometries></Joint>"
              "</Joints></Geometry></Structure></Luminaire>"}});
}

struct Product {
    std::string emitters =
        "<Emitter id=\"e\"><FixedLightEmitter><PhotometryReference "
        "photometryId=\"p\"/><RatedLuminousFlux>2500"
        "</RatedLuminousFlux></FixedLightEmitter></Emitter>";
    std::string variants =
        "<Variant id=\"v\"><Geometry><ModelGeometryReference geometryId=\"g\"><EmitterReference "
        "emitterId=\"e\">"
        "<EmitterObjectExternalName>leo</EmitterObjectExternalName></EmitterReference></"
        "ModelGeometryReference>"
        "</Geometry></Variant>";
    std::string ldt_type = "localFileName", ldt_text = ldt(), l3d_bytes = l3d(), more = "", root = "Root";

    std::string bytes() const {
        const std::string xml = fmt::format(
            "<?xml version=\"1.0\"?>\n<{0}><GeneralDefinitions><Files><File id=\"f\" "
            "contentType=\"ldc/eulumdat\" "
            "type=\"{1}\">Lamp.ldt</File><File id=\"m\" contentType=\"geo/l3d\" "
            "type=\"localFileName\">lamp.l3d"
            "</File></Files><Photometries><Photometry id=\"p\"><PhotometryFileReference "
            "fileId=\"f\"/></Photometry>"
            "</Photometries>{2}<Emitters>{3}</Emitters><Geometries><ModelGeometry "
            "id=\"g\"><GeometryFileReference "
            "fileId=\"m\"/></ModelGeometry><SimpleGeometry id=\"s\"><CircularEmitter><Diameter>400</Diameter>"
            "</CircularEmitter></SimpleGeometry></Geometries></"
            "GeneralDefinitions>\n<ProductDefinitions><Variants>"
            "{4}</Variants></ProductDefinitions></{0}>",
            root, ldt_type, more, emitters, variants);
        return testing::zip_of(
            {{"product.xml", xml}, {"ldc/lamp.ldt", ldt_text}, {"geo/lamp.l3d", l3d_bytes}});
    }
};

class Gldf : public ::testing::Test {
  protected:
    std::filesystem::path write(const std::string& bytes, const std::string& name = "lamp.gldf") const {
        std::ofstream(folder / name, std::ios::binary) << bytes;
        return folder / name;
    }
    std::vector<LuminaireEmitter> emitters(const Product& product, const std::string& variant = "") const {
        Monitor silent;
        return read_luminaire(write(product.bytes()).string() + variant, silent);
    }
    std::string refusal(const Product& product, const std::string& variant = "") const {
        return error_of([&] { emitters(product, variant); });
    }
    testing::TemporaryFolder folder;
};

TEST_F(Gldf, Emitter_HasThePhotometryTheFluxAndThePlaceOfItsObject) {
    const std::vector<LuminaireEmitter> found = emitters({});
    ASSERT_EQ(found.size(), 1U);
    Monitor silent;
    const PhotometricWeb plain = parse_ldt(ldt(), "lamp.ldt", silent);
    EXPECT_NEAR(found[0].web.flux() / plain.flux(), 2.5, 1e-6) << "the lamps' lumens are replaced";
    EXPECT_EQ(found[0].web.info().lamp_lumens, 2500);
    EXPECT_EQ(found[0].web.info().opening.size, V3d(0.2, 0.6, 0));
    // z is up in the luminaire and down in the lamp; C90 is the luminaire's +y and the lamp's -y.
    EXPECT_LT((found[0].position - V3d(0, -0.1, -1.5)).length(), 1e-12);
    EXPECT_LT((found[0].axes[0] - V3d(0, -1, 0)).length(), 1e-12);
    EXPECT_LT((found[0].axes[2] - V3d(0, 0, 1)).length(), 1e-12);
}

TEST_F(Gldf, FarField_IsThatOfTheTurnedLdtTimesTheFlux) {
    Monitor silent;
    const PhotometricWeb web = read_photometric(write(Product().bytes()), silent);
    const PhotometricWeb plain = parse_ldt(ldt(), "lamp.ldt", silent);
    for (const double gamma : {0.0, 30.0, 70.0, 90.0}) {
        for (const double c : {0.0, 45.0, 100.0, 290.0}) {
            EXPECT_NEAR(web.intensity(web.direction(gamma, c + 90)),
                        2.5 * plain.intensity(plain.direction(gamma, c)), 1e-4);
        }
    }
    EXPECT_LT((web.info().opening.size - V3d(0.6, 0.2, 0)).length(), 1e-12) << "turned by 90 degrees";
}

TEST_F(Gldf, TiltedObject_ShinesWhereItPoints) {
    const std::string object =
        "<Rotation x=\"90\" y=\"0\" z=\"180\"/><Circle diameter=\"0.1\"/><LuminousHeights c0=\"10\" "
        "c90=\"10\" "
        "c180=\"10\" c270=\"10\"/>";
    ListeningMonitor monitor;
    const auto objects = read_l3d(l3d(object), "lamp.l3d", monitor);
    ASSERT_EQ(objects.size(), 1U);
    // Without the joint's turn the light would leave along the luminaire's -y, as z is turned first.
    EXPECT_LT((objects[0].axes[2] - V3d(1, 0, 0)).length(), 1e-12);
    EXPECT_NEAR(objects[0].opening.size.z, 0.01, 1e-12);
    EXPECT_THAT(monitor.warnings, ElementsAre(HasSubstr("are read as millimetres")));
    Monitor silent;
    Product product;
    product.l3d_bytes = l3d(object);
    const PhotometricWeb web = read_photometric(write(product.bytes()), silent);
    EXPECT_NEAR(web.intensity({1, 0, 0}), 250, 1);
    EXPECT_NEAR(web.flux() / emitters(product)[0].web.flux(), 1, 1e-5);
}

TEST_F(Gldf, SeveralEmitters_AreAddedUp) {
    Product product;
    product.emitters +=
        "<Emitter id=\"up\"><ChangeableLightEmitter><Rotation><X>0</X><Y>0</Y><Z>0</Z><G0>90</G0></Rotation>"
        "<PhotometryReference photometryId=\"p\"/><EquipmentReference "
        "equipmentId=\"q\"/></ChangeableLightEmitter>"
        "</Emitter>";
    product.more =
        "<LightSources><ChangeableLightSource "
        "id=\"l\"><RatedInputPower>30</RatedInputPower><RatedLuminousFlux>500"
        "</RatedLuminousFlux></ChangeableLightSource></LightSources><Equipments><Equipment id=\"q\">"
        "<LightSourceReference changeableLightSourceId=\"l\" "
        "lightSourceCount=\"2\"/></Equipment></Equipments>";
    product.variants =
        "<Variant id=\"v\"><Geometry><EmitterReference emitterId=\"e\"/><EmitterReference emitterId=\"up\"/>"
        "</Geometry></Variant>";
    const std::vector<LuminaireEmitter> found = emitters(product);
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[1].web.info().lamp_lumens, 1000) << "two lamps";
    EXPECT_EQ(found[1].web.info().watts, 60);
    EXPECT_NEAR(found[1].web.intensity(found[1].web.direction(90, 90)), 10, 1e-4) << "turned about G0";
    const PhotometricWeb whole = luminaire_web(found);
    EXPECT_NEAR(whole.flux() / (found[0].web.flux() + found[1].web.flux()), 1, 1e-5);
    EXPECT_NEAR(whole.intensity(whole.direction(90, 90)), 2.5 * 20 + 10, 1e-3);
}

TEST_F(Gldf, AbsolutePhotometry_IsScaledToTheFlux) {
    Product product;
    product.ldt_text = ldt(1000, -1);
    EXPECT_NEAR(emitters(product)[0].web.flux(), 2500, 1e-2);
}

TEST_F(Gldf, Variants_AreNamed) {
    Product product;
    product.variants +=
        "<Variant id=\"round\"><Geometry><SimpleGeometryReference geometryId=\"s\" "
        "emitterId=\"e\"/></Geometry>"
        "</Variant>";
    ListeningMonitor monitor;
    read_luminaire(write(product.bytes()), monitor);
    EXPECT_THAT(monitor.warnings, ElementsAre(HasSubstr("2 variants (v, round); the first is used")));
    const auto found = emitters(product, "#round");
    EXPECT_EQ(found[0].web.info().opening.name(), "disc");
    EXPECT_NEAR(found[0].web.info().opening.size.x, 0.4, 1e-12);
    EXPECT_THAT(refusal(product, "#square"),
                HasSubstr("no variant is called \"square\"; expected one of v, round"));
    EXPECT_TRUE(is_photometric((folder / "lamp.gldf").string() + "#round"));
}

TEST_F(Gldf, Modes_ExcludeEachOther) {
    Product product;
    const std::string mode = "<PhotometryReference photometryId=\"p\"/><RatedLuminousFlux>";
    product.emitters = "<Emitter id=\"e\"><FixedLightEmitter emergencyBehaviour=\"EmergencyOnly\">" + mode +
                       "50</RatedLuminousFlux></FixedLightEmitter><FixedLightEmitter>" + mode +
                       "2500</RatedLuminousFlux></FixedLightEmitter></Emitter>";
    EXPECT_EQ(emitters(product)[0].web.info().lamp_lumens, 2500);
}

TEST_F(Gldf, BadFiles_AreRefusedInOneLine) {
    Product product;
    product.ldt_type = "url";
    EXPECT_THAT(refusal(product), HasSubstr("product.xml:2:1: the file \"Lamp.ldt\" is not in the archive"));
    product = {};
    product.ldt_text.resize(40);
    EXPECT_THAT(refusal(product), HasSubstr("lamp.gldf/ldc/lamp.ldt: the file ends"));
    product = {};
    product.l3d_bytes = "PK";
    EXPECT_THAT(refusal(product), HasSubstr("lamp.gldf/geo/lamp.l3d: the zip archive cannot be read"));
    product = {};
    product.root = "Product";
    EXPECT_THAT(refusal(product), HasSubstr("the root is <Product>; expected <Root>"));
    product = {};
    product.emitters = "<Emitter id=\"other\"/>";
    EXPECT_THAT(refusal(product),
                HasSubstr("emitterId is \"e\", which no element of <Emitters> has as its id"));
    product.emitters = "<Emitter id=\"e\"><SensorEmitter/></Emitter>";
    product.variants = "<Variant id=\"v\"><Geometry><EmitterReference emitterId=\"e\"/></Geometry></Variant>";
    EXPECT_THAT(refusal(product), HasSubstr("the variant \"v\" has no emitter of light"));
    product = {};
    product.variants.replace(product.variants.find("leo<"), 3, "LED");
    EXPECT_THAT(refusal(product),
                HasSubstr("no light-emitting object of the L3D file is called \"LED\"; it has leo"));
    product = {};
    product.l3d_bytes = l3d("<Rotation x=\"nan\" y=\"0\" z=\"0\"/>");
    EXPECT_THAT(refusal(product), HasSubstr("structure.xml:1:1: x is \"nan\"; expected a number"));
    Monitor silent;
    const std::string bytes = Product().bytes();
    EXPECT_THAT(error_of([&] { read_luminaire(write(bytes.substr(0, bytes.size() / 2)), silent); }),
                HasSubstr("lamp.gldf: the zip archive cannot be read"));
    EXPECT_THAT(error_of([&] { read_luminaire(write(l3d(), "lamp.l3d"), silent); }),
                HasSubstr("lamp.l3d: an L3D file has the geometry of a luminaire and no light"));
    EXPECT_THAT(error_of([&] { read_luminaire(write(ldt(), "lamp.ldt").string() + "#v", silent); }),
                HasSubstr("\"#v\" names a variant, which only a GLDF file has"));
}

TEST_F(Gldf, Formats_AreToldByTheirContent) {
    Monitor silent;
    const std::string ies = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 1 9 0 90 0 1 1\n";
    const std::string tm33 =
        "<?xml version=\"1.0\"?><!-- a comment --><t:IESTM33-18 "
        "xmlns:t=\"x\"><t:Emitter><t:LuminousData><t:IntData "
        "h=\"0\" v=\"0\">1</t:IntData><t:IntData h=\"0\" v=\"90\">1</t:IntData></t:LuminousData></t:Emitter>"
        "</t:IESTM33-18>";
    for (const char* name : {"lamp.txt", "lamp.ies", "lamp.ldt", "lamp.xml", "lamp"}) {
        for (const std::string& text : {ies, ldt(), tm33, Product().bytes()}) {
            const auto file = write(text, name);
            EXPECT_TRUE(is_photometric(file)) << name;
            EXPECT_GT(read_photometric(file, silent).flux(), 0) << name << text.substr(0, 20);
        }
    }
    EXPECT_TRUE(is_photometric(write("<html><body/></html>", "page.xml"))) << "to be refused by name";
    EXPECT_FALSE(is_photometric(write(testing::zip_of({{"a.txt", "text"}}), "a.zip")));
    EXPECT_FALSE(is_photometric(write("LookAt 0 0 0 1 1 1 0 1 0\nWorldBegin\n", "a.pbrt")));
    EXPECT_THAT(error_of([&] { read_photometric(write("<html/>", "page.xml"), silent); }),
                HasSubstr("no photometric file but XML with the root <html>; expected IES LM-63, EULUMDAT"));
    EXPECT_THAT(error_of([&] { read_photometric(write("words\n", "lamp.txt"), silent); }),
                HasSubstr("no photometric file but text"));
}

}  // namespace gldf_test
}  // namespace lucerna
