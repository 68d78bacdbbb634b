// libFuzzer's entry to the reader of spectra: text gives increasing wavelengths with finite values, or an
// InputError.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/colour/spectrum.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::filesystem::path file = file_of_input(data, size, ".spd");
    try {
        const lucerna::Spectrum spectrum = lucerna::read_spd(file);
        require(!spectrum.empty(), "a spectrum without samples");
        for (std::size_t i = 0; i < spectrum.size(); ++i) {
            require(std::isfinite(spectrum[i].nanometres) && std::isfinite(spectrum[i].weight),
                    "a sample is none");
            require(i == 0 || spectrum[i - 1].nanometres < spectrum[i].nanometres, "wavelengths do not rise");
        }
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
