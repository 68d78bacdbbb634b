// Which reader a ray file is for: its first bytes say; where they are of no format known, its name does.
#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "lights/ray_set.h"

namespace lucerna {
namespace {

struct ReaderFormat {
    std::string_view magic, suffix;
    RaySet (*read)(const std::filesystem::path&, Monitor&);
};
constexpr ReaderFormat kReaderFormats[] = {
    {"TM25", ".tm25ray", read_tm25},
    {"LTRF", ".ray", read_lighttools},
    {std::string_view("\xf2\x03\x00\x00", 4), ".dat", read_zemax},  // the number 1010
};

}  // namespace

RaySet read_rays(const std::filesystem::path& file, Monitor& monitor) {
    std::array<char, 4> first{};
    open_to_read(file).read(first.data(), first.size());
    for (const ReaderFormat& format : kReaderFormats) {
        if (std::equal(first.begin(), first.end(), format.magic.begin(), format.magic.end()))
            return format.read(file, monitor);
    }
    // Its own reader says best what is wrong with it.
    for (const ReaderFormat& format : kReaderFormats) {
        if (suffix_of(file) == format.suffix) return format.read(file, monitor);
    }
    throw InputError(
        {file.string()},
        "no ray file: IES TM-25 (.tm25ray), Zemax binary (.dat) and LightTools binary (.ray) are accepted");
}

}  // namespace lucerna
