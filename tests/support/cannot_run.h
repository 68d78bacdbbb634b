// For a test that lacks something here: by hand it is skipped, with a word; where the environment variable CI
// is set and not empty nothing may be missing, and it fails.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

namespace lucerna::testing {

inline bool in_ci() {
    const char* const ci = std::getenv("CI");
    return ci != nullptr && *ci != 0;
}

}  // namespace lucerna::testing

// Ends the test; what is streamed into it says what is missing.
#define LUCERNA_CANNOT_RUN()                                                                       \
    return GTEST_MESSAGE_("", lucerna::testing::in_ci() ? ::testing::TestPartResult::kFatalFailure \
                                                        : ::testing::TestPartResult::kSkip)        \
           << "cannot run here: "
