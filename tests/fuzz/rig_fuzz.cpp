// libFuzzer's entry to rig descriptions: text gives a rig that light fields accept, or one line that names
// the error.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "lights/measurement/rig_file.h"
#include "tests/fuzz/input.h"

using lucerna::testing::require;
using lucerna::testing::require_one_line;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using lucerna::EmitterDescription;
    try {
        const std::string_view text(reinterpret_cast<const char*>(data), size);
        const lucerna::RigDescription d = lucerna::read_rig(lucerna::TomlTable::parse(text, "rig.toml"));
        require(d.rig.fault().empty(), "a rig that is none");
        require(d.emitter.kind == EmitterDescription::Kind::scene || d.emitter.flux > 0,
                "a lamp without flux");
        require(std::isfinite(d.emitter.setback) && std::isfinite(d.emitter.focus), "a length that is none");
        require(lucerna::description_key(d) == lucerna::description_key(d), "a key that changes");
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
