// libFuzzer's entry to the cell table's cache: bytes give a table that can be sampled, or a reason.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "lights/cell_table.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;

namespace {

// Returns the field to which the corpus's tables belong.
const lucerna::LightField& field() {
    static const lucerna::LightField kField = [] {
        lucerna::Rig rig;
        rig.views = {2, 1};
        rig.spacing = {0.01, 0.01};
        rig.pixels = {2, 3};
        rig.pixel = {0.01, 0.01};
        rig.distance = 0.1;
        return lucerna::LightField(rig, {1, 2, 3, 4, 5, 6, 7, -1, 9, 10, 11, 12});
    }();
    return kField;
}

void require_sound(const lucerna::CellTable& table) {
    require(std::isfinite(table.flux()) && table.flux() >= 0, "the flux is no number");
    for (const float u : {0.0F, 0.3F, 0.7F, 0.99999994F}) {
        const auto draw = table.draw({u, u, u, u});
        require(table.cell(draw.id).has_value(), "a cell is none of the table");
        require(draw.probability >= 0 && draw.probability <= 1.001, "a probability is none");
        for (const float r : draw.remainder) require(r >= 0 && r < 1.0001F, "a remainder is out of range");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::filesystem::path file = file_of_input(data, size, ".cells");
    std::string reason;
    const auto table = lucerna::CellTable::load(file, field(), reason);
    if (table)
        require_sound(*table);
    else
        require(!reason.empty(), "a refusal without a reason");
    return 0;
}
