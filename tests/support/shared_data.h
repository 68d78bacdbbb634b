// Measured lamps and reference images are not part of the project; tests that read them skip where they are
// absent.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>

namespace lucerna::testing {

inline std::filesystem::path shared_data() {
    return std::filesystem::path(LUCERNA_SOURCE_DIR) / ".." / "shared" / "data";
}

}  // namespace lucerna::testing

// Ends the test as skipped, with a message, unless the file is there. Defines `variable`.
#define LUCERNA_NEED_DATA(variable, name)                                            \
    const std::filesystem::path variable = lucerna::testing::shared_data() / (name); \
    if (!std::filesystem::exists(variable)) GTEST_SKIP() << variable << " is not here"
