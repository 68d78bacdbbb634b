#include "engine/integrators/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/error_of.h"

namespace lucerna {
namespace settings_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

const Location kHere{"scene.pbrt", 3, 14};

using testing::error_of;

TEST(Settings, EveryIntegrator_HasANameAndDescribesItself) {
    for (const char* name : {"path", "direct", "photonmap", "igi", "progressive"}) {
        const IntegratorSettings settings = make_settings(name, kHere);
        EXPECT_EQ(integrator_name(settings), name);
        EXPECT_FALSE(describe(settings).empty());
    }
}

TEST(Settings, EveryField_TakesItsOwnTextBack) {
    for (const char* name : {"path", "direct", "photonmap", "igi", "progressive"}) {
        IntegratorSettings settings = make_settings(name, kHere);
        const auto before = describe(settings);
        for (Field& field : fields(settings)) {
            EXPECT_FALSE(field.help.empty());
            const std::string text = field.text();
            if (field.choices.empty()) {
                field.set(std::stod(text), kHere);
            } else {
                field.set(text, kHere);
            }
        }
        EXPECT_EQ(describe(settings), before);
    }
}

TEST(Settings, SetParameter_ChangesTheTypedValue) {
    IntegratorSettings settings = make_settings("photonmap", kHere);
    set_parameter(settings, "photons", 2e6, kHere);
    set_parameter(settings, "direct", std::string("map"), kHere);
    set_parameter(settings, "radius", 0.25, kHere);
    const auto& s = std::get<PhotonMapSettings>(settings);
    EXPECT_EQ(s.photons, 2'000'000);
    EXPECT_EQ(s.direct, DirectMethod::map);
    EXPECT_EQ(s.estimate.radius, 0.25F);
}

TEST(Settings, WrongInputs_NamePlaceValueAndWhatIsAccepted) {
    IntegratorSettings s = make_settings("photonmap", kHere);
    EXPECT_THAT(error_of([&] { set_parameter(s, "photon", 1.0, kHere); }),
                AllOf(HasSubstr("scene.pbrt:3:14"), HasSubstr("did you mean \"photons\"")));
    EXPECT_THAT(error_of([&] { set_parameter(s, "photons", 0.0, kHere); }), HasSubstr("0 is not accepted"));
    EXPECT_THAT(error_of([&] { set_parameter(s, "photons", 1.5, kHere); }), HasSubstr("whole number"));
    EXPECT_THAT(error_of([&] { set_parameter(s, "photons", std::nan(""), kHere); }), HasSubstr("nan"));
    EXPECT_THAT(error_of([&] { set_parameter(s, "photons", std::string("many"), kHere); }),
                HasSubstr("\"many\" is not accepted"));
    EXPECT_THAT(error_of([&] { set_parameter(s, "direct", std::string("maps"), kHere); }),
                HasSubstr("expected mc, map"));
    EXPECT_THAT(error_of([&] { set_parameter(s, "guidek", 16.0, kHere); }),
                AllOf(HasSubstr("\"guidek\" has been removed"), HasSubstr("64 photons")));
    EXPECT_THAT(error_of([&] { make_settings("bdpt", kHere); }), HasSubstr("expected path"));
}

}  // namespace settings_test
}  // namespace lucerna
