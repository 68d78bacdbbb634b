// libFuzzer's entry to the reader of IES LM-63 files: bytes give a web whose flux and directions are valid,
// or an InputError.
#include "lights/photometric_files.h"

#include "tests/fuzz/photometric_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    return lucerna::testing::fuzz_photometric(data, size, lucerna::parse_ies);
}
