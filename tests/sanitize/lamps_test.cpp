// A measured lamp from its rays to its light, and an acquired lamp, on four threads.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/warp.h"
#include "lights/cell_table.h"
#include "lights/light_field.h"
#include "lights/measured.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/ray_projection.h"
#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace lamps_test {

using namespace testing;

constexpr Workers kFour{4};

RaySet disc_of_rays(int count) {
    RaySet set;
    set.flux = 10;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(5, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f p = 0.005F * square_to_disc(sampler.next2());
        set.rays.push_back({{p.x, p.y, 0},
                            square_to_cosine_hemisphere(sampler.next2()),
                            static_cast<float>(set.flux / count)});
    }
    return set;
}

void expect_to_emit(const LightField& field) {
    Monitor monitor;
    const CellTable table(field, kFour, monitor);
    for (const EmissionMode mode : {EmissionMode::exact, EmissionMode::constant}) {
        MeasuredSettings settings;
        settings.file = "field.exr";
        settings.mode = mode;
        const auto light = make_measured_light(field, table, settings, monitor);
        EXPECT_GT(light->power(), 0);
        std::vector<double> sums(16);
        parallel_chunks(kFour, 16, [&](std::int64_t chunk) {
            Sampler sampler(6, Purpose::test, 0, static_cast<std::uint64_t>(chunk));
            for (int i = 0; i < 200; ++i) {
                const auto particle = light->sample_Le({sampler.next2(), sampler.next2()});
                if (particle) sums[static_cast<std::size_t>(chunk)] += double{luminance(particle->weight)};
            }
        });
        for (const double sum : sums) EXPECT_TRUE(std::isfinite(sum));
    }
}

TEST(SmallLamps, RaysWrittenReadAndFitted_Emit) {
    const TemporaryFolder folder;
    write_rays(folder / "lamp.tm25ray", disc_of_rays(4000));
    Monitor monitor;
    const RaySet read = read_rays(folder / "lamp.tm25ray", monitor);
    FitOptions options;
    options.views = {4, 4};
    options.pixels = {6, 6};
    const Projection fitted = fit_light_field(read, options, kFour, monitor);
    EXPECT_NEAR(fitted.account.explained(), fitted.account.missed(), 1e-6 * fitted.account.total);
    expect_to_emit(fitted.field);
}

TEST(SmallLamps, AcquiredWrittenAndRead_Emit) {
    const TemporaryFolder folder;
    Monitor monitor;
    const EmitterModel disc = cosine_emitter(EmitterModel::Outline::disc, {0.008, 0.008}, 1);
    write_light_field(folder / "field.exr", acquire(disc, rig_b(), kFour, monitor));
    expect_to_emit(read_light_field(folder / "field.exr"));
}

}  // namespace lamps_test
}  // namespace lucerna
