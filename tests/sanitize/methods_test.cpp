// Renders with every method under every light, on four threads: all code that a render uses, in sizes small
// enough for a build that checks each access and each operation.
#include <gtest/gtest.h>

#include "tests/support/every_light.h"

namespace lucerna {
namespace methods_test {

using namespace testing;

constexpr int kThreads = 4;

// Reduces the number of particles far below that of a real render: only the code that they reach matters.
Method small(Method method) {
    for (auto& [name, value] : method.set) {
        if (name == "photons") value = "800";
        if (name == "nlights") value = "16";
    }
    return method;
}

Image rendered(const LightCase& light, const Method& method, double power = 1) {
    ListeningMonitor monitor;
    const Job job = lights().job(lights().scene(light, {}, power), small(method), 1, monitor);
    return render(job, {1, Workers{kThreads}}, monitor).image;
}

class SmallRenders : public ::testing::TestWithParam<Method> {};

TEST_P(SmallRenders, UnderEveryLight_EndFinite) {
    for (const LightCase& light : lights().cases()) {
        if (!light.suits(GetParam())) continue;
        SCOPED_TRACE(light.name);
        EXPECT_TRUE(is_finite(rendered(light, GetParam())));
    }
}

TEST_P(SmallRenders, OfNoPowerAtAll_AreBlack) {
    const LightCase point = lights().cases().front();
    EXPECT_EQ(mean_luminance(rendered(point, GetParam(), 0)), 0);
}

INSTANTIATE_TEST_SUITE_P(Methods, SmallRenders, ::testing::ValuesIn(every_method()), name_of);

}  // namespace methods_test
}  // namespace lucerna
