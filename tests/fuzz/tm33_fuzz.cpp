// libFuzzer's entry to the reader of TM-33 files: bytes give a web whose flux and directions are valid, or an
// InputError.
#include "lights/photometric_files.h"

#include "tests/fuzz/photometric_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto parse = [](std::string_view text, const char* file, lucerna::Monitor& monitor) {
        return lucerna::luminaire_web(lucerna::parse_tm33(text, file, monitor));
    };
    return lucerna::testing::fuzz_photometric(data, size, parse);
}
