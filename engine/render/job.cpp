#include "engine/render/job.h"

#include <fmt/format.h>

#include <fstream>
#include <set>
#include <span>

#include "engine/base/version.h"
#include "engine/scene/arithmetic.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"
#include "photon/build_maps.h"

namespace lucerna {

// By their contents: a folder may have been moved.
std::uint64_t SceneText::hash() const {
    WordHash hash = directives;
    std::set<std::filesystem::path> seen;
    std::vector<std::byte> block(std::size_t{1} << 20);  // a multiple of the hash's words
    for (const std::filesystem::path& file : files) {
        if (!seen.insert(file).second) continue;
        std::error_code status;
        if (!std::filesystem::exists(file, status)) {
            hash.add("missing");  // and left out, with the user's consent
            continue;
        }
        std::ifstream in = open_to_read(file);
        std::uint64_t size = 0;
        while (in) {
            in.read(reinterpret_cast<char*>(block.data()), static_cast<std::streamsize>(block.size()));
            const auto got = static_cast<std::size_t>(in.gcount());
            hash.add_bytes(std::span(block).first(got));
            size += got;
        }
        hash.add(size);
    }
    return hash.value();
}

Facts scene_facts(const Job& job) {
    const std::optional<FluxUnit> unit = job.scene.stated_unit();
    return {
        {"version of lucerna", std::string(program_version())},
        {"arithmetic", arithmetic()},
        {"unit of light", unit ? std::string(unit_name(*unit)) : "that of each light"},
        {std::string(kColourSpaceFact), std::string(job.film.colours.name())},
        {"scene (hash of geometry, materials, lights and media)", fmt::format("{:016x}", job.world.hash())}};
}

}  // namespace lucerna
