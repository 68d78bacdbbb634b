// A ray file's first bytes select its reader.
#include <algorithm>
#include <string_view>

#include "engine/system/content.h"
#include "lights/photometric_files.h"
#include "lights/ray_reader.h"

namespace lucerna {
namespace {

struct RayFormat {
    bool (*is)(std::span<const std::byte> first);
    RaySet (*read)(RaySource&, Monitor&);
};
// Formats without a signature come last.
constexpr RayFormat kRayFormats[] = {
    {is_tm25, read_tm25},
    {is_lighttools, read_lighttools},
    {is_zemax, read_zemax},
    {is_asap, read_asap},
    {is_zemax_text, read_zemax_text},
    {is_lighttools_text, read_lighttools_text},
    {is_ray_table, read_ray_table},
    {is_speos, read_speos},
};

// Returns the format of a file that begins with these bytes, or nullptr.
const RayFormat* format_of(std::span<const std::byte> first) {
    const auto* const found =
        std::ranges::find_if(kRayFormats, [first](const RayFormat& format) { return format.is(first); });
    return found == std::end(kRayFormats) ? nullptr : found;
}

bool is_known(std::span<const std::byte> first) {
    return format_of(first) != nullptr;
}
constexpr const char* kNoun = "ray file";

// Returns the optics program that a text names, or an empty name.
std::string_view program_named(std::string_view text) {
    for (const std::string_view program :
         {"LightTools", "TracePro", "LucidShape", "SPEOS", "SimuLux", "ASAP", "Photopia", "FRED"}) {
        if (text.find(program) != text.npos) return program;
    }
    return {};
}

// Describes a file that is in none of the formats, as a clause: "it is a zip archive".
std::string content_of_ray_file(std::span<const std::byte> first) {
    const std::string_view content = content_name(first), text = text_of(first);
    if (content.empty()) return "its contents are of no format that is known here";
    if (content != kPlainText) return fmt::format("it is {}", content);
    if (const std::string_view program = program_named(text); !program.empty())
        return fmt::format("it is text of {}, in whose header no line names the columns", program);
    const std::size_t begin = std::min(text.find_first_not_of(" \t\r\n"), text.size());
    return fmt::format("it is text that begins with \"{}\"",
                       shown_value(text.substr(begin, text.find_first_of("\r\n", begin) - begin)));
}

}  // namespace

bool is_ray_file(const std::filesystem::path& file) {
    return is_known(UnpackedFile(file, is_known, kNoun).first());
}

RaySet read_rays(const std::filesystem::path& file, Monitor& monitor) {
    RaySource source(UnpackedFile(file, is_known, kNoun));
    if (const RayFormat* format = format_of(source.first())) return format->read(source, monitor);
    input_error(source.at(), "not a ray file: {}; expected {}", content_of_ray_file(source.first()),
                kReadRayFormats);
}

}  // namespace lucerna
