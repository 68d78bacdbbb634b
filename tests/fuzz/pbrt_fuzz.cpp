// libFuzzer's entry to the scene reader: text gives the parts of a scene or an InputError; anything else is a
// finding.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "engine/pbrt/draft.h"
#include "engine/pbrt/read_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    lucerna::Monitor monitor;
    try {
        // The folder does not exist, so that Include cannot read files other than the input.
        auto draft = lucerna::read_draft({reinterpret_cast<const char*>(data), size},
                                         "no-such-folder/scene.pbrt", {}, monitor);
        lucerna::assemble(std::move(draft), {1}, monitor);
    } catch (const lucerna::InputError& error) {
        const std::string_view message = error.what();
        if (message.empty() || message.find('\n') != message.npos) {
            std::fprintf(stderr, "not one line: %s\n", error.what());
            std::abort();
        }
    }
    return 0;
}
