// Locates measured lamps and reference images, which are not part of the project; tests that read them cannot
// run where they are absent (cannot_run.h).
#pragma once

#include <filesystem>

#include "tests/support/cannot_run.h"

namespace lucerna::testing {

inline std::filesystem::path shared_data() {
    return std::filesystem::path(LUCERNA_SOURCE_DIR) / ".." / "shared" / "data";
}

}  // namespace lucerna::testing

// Defines `variable` as the file's path, and ends the test unless the file exists.
#define LUCERNA_NEED_DATA(variable, name)                                            \
    const std::filesystem::path variable = lucerna::testing::shared_data() / (name); \
    if (!std::filesystem::exists(variable)) LUCERNA_CANNOT_RUN() << variable << " is not there"
