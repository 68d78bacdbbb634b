// Runs the tests of a sanitized build; floating-point faults stop them, too, if the build has traps.
#include <gtest/gtest.h>

#include "engine/base/float_traps.h"

int main(int argc, char** argv) {
    ::testing::InitGoogleTest(&argc, argv);
    const lucerna::FloatTraps traps(lucerna::kFaults);
    return RUN_ALL_TESTS();
}
