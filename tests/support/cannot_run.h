// Ends tests that lack something on this machine. They are skipped with a message; where the environment
// variable CI is set and not empty they fail, because nothing may be missing there.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

namespace lucerna::testing {

inline bool in_ci() {
    const char* const ci = std::getenv("CI");
    return ci != nullptr && *ci != 0;
}

}  // namespace lucerna::testing

// Ends the test; the text streamed into it states what is missing.
#define LUCERNA_CANNOT_RUN()                                                                       \
    return GTEST_MESSAGE_("", lucerna::testing::in_ci() ? ::testing::TestPartResult::kFatalFailure \
                                                        : ::testing::TestPartResult::kSkip)        \
           << "cannot run here: "
