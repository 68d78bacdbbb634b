// libFuzzer's entry to the descriptions of studies: text gives a description that can be executed, or an
// InputError.
#include <cstddef>
#include <cstdint>

#include "engine/evaluation/study.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::filesystem::path file = file_of_input(data, size, ".toml");
    try {
        const lucerna::StudyDescription description = lucerna::read_study(file);
        require(description.seeds > 0, "no seed");
        require(!description.scenes.empty() && !description.points.empty(), "nothing to do");
        for (const lucerna::StudyPoint& point : description.points) {
            require(point.overrides.spp > 0, "no samples");
            require(!point.overrides.integrator.empty(), "no integrator");
        }
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
