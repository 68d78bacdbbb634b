// libFuzzer's entry to manifests: text gives a measurement whose photographs are assembled from fake ones, or
// one line that names the error. Only the text is read.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "lights/measurement/photographs.h"
#include "tests/fuzz/input.h"

using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

// Returns small photographs that are not empty.
lucerna::Photograph fake(const lucerna::Shot& shot, const lucerna::ShotId& which) {
    require(shot.seconds > 0 && std::isfinite(shot.seconds), "a time that is none");
    lucerna::Photograph photograph{{6, 5}, std::vector<float>(30), 255};
    for (std::size_t i = 0; i < photograph.counts.size(); ++i) {
        const auto seed = static_cast<int>(i) * 37 + which.m * 5 + which.n * 3 + which.number;
        photograph.counts[i] = static_cast<float>(which.dark ? seed % 3 : seed % 256);
    }
    return photograph;
}

void assemble_fakes(const lucerna::Manifest& manifest) {
    constexpr std::size_t kMost = 10'000;  // so that no input takes a second
    const lucerna::Rig& rig = manifest.rig;
    const std::size_t views = static_cast<std::size_t>(rig.views.x) * static_cast<std::size_t>(rig.views.y);
    if (manifest.shot_count() > kMost || views > kMost || rig.coefficients() > kMost) return;
    lucerna::Monitor silent;
    const lucerna::Assembly assembly = lucerna::assemble(manifest, fake, {1}, silent, {true});
    for (const lucerna::FilterSign sign : lucerna::kFilterSigns) {
        for (const float x : assembly.images.of(sign))
            require(!std::isnan(x), "irradiance that is no number");
    }
    for (const float x : assembly.deviations) require(x >= 0, "a deviation that is none");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        const std::string_view text(reinterpret_cast<const char*>(data), size);
        const lucerna::Manifest manifest =
            lucerna::read_manifest(lucerna::TomlTable::parse(text, "folder/manifest.toml"));
        require(manifest.rig.fault().empty(), "a rig that is none");
        require(!manifest.shots(0, 0, lucerna::FilterSign::positive).empty(), "no photographs");
        const std::string written = lucerna::manifest_text(manifest);
        lucerna::Manifest again =
            lucerna::read_manifest(lucerna::TomlTable::parse(written, "folder/manifest.toml"));
        again.info.colour = manifest.info.colour;  // normalising to luminance 1 again may change the last bit
        require(lucerna::manifest_text(again) == written, "a manifest that changes when it is written");
        assemble_fakes(manifest);
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
