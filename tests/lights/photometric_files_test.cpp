// Checks the flux of real photometric files against the values that they state.
#include <gtest/gtest.h>

#include <cmath>

#include "lights/photometric_files.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace photometric_files_test {

struct Known {
    const char* file;
    double lumens;     // of the luminaire, as the file or its maker states it
    double tolerance;  // relative: tables are rounded, and integrated by other rules
};

TEST(PhotometricFile, Real_HoldTheFluxThatTheyState) {
    Monitor silent;
    const Known known[] = {
        {"examp1.ies", 5297, 1e-3},
        {"italo-street.ies", 10'580, 1e-3},
        {"fluorescent_luminaire.ldt", 8100 * 0.403, 1e-2},
        {"floor_uplight.ldt", 20'000 * 0.7233, 1e-2},
        {"projector.ldt", 6500 * 0.7771, 2.5e-2},  // a narrow beam, sampled at steps as wide as its edge
        {"road_luminaire.ldt", 33'200 * 0.8442, 1e-2},
    };
    for (const Known& lamp : known) {
        LUCERNA_NEED_DATA(file, std::filesystem::path("photometry") / lamp.file);
        const PhotometricWeb web = read_photometric(file, silent);
        EXPECT_NEAR(web.flux() / lamp.lumens, 1, lamp.tolerance) << lamp.file;
    }
}

}  // namespace photometric_files_test
}  // namespace lucerna
