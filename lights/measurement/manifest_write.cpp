// Writes the manifest as text that read_manifest() restores.
#include <fmt/format.h>

#include <span>

#include "engine/system/files.h"
#include "lights/measurement/manifest.h"

namespace lucerna {
namespace {

// Returns a basic string of TOML.
std::string toml_string(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') {
            out += '\\';
            out += c;
        } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
            out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
        } else {
            out += c;
        }
    }
    return out + "\"";
}

std::string lengths(const V2d& metres) {
    return fmt::format("[\"{}m\", \"{}m\"]", metres.x, metres.y);
}

std::string point(const V2d& p) {
    return fmt::format("[{}, {}]", p.x, p.y);
}

std::string rig_text(const Rig& rig) {
    const bool a = rig.shift.x > 0 && rig.shift.y > 0;
    std::string text = fmt::format("\n[rig]\nsetup = \"{}\"\n", a ? "A" : "B");
    text += fmt::format("views = [{}, {}]\nspacing = {}\n", rig.views.x, rig.views.y, lengths(rig.spacing));
    text += fmt::format("pixels = [{}, {}]\npixel = {}\n", rig.pixels.x, rig.pixels.y, lengths(rig.pixel));
    return text + fmt::format("distance = \"{}m\"\n", rig.distance);
}

std::string camera_text(const CameraCalibration& camera) {
    std::string text =
        fmt::format("\n[camera]\nscale = {}  # irradiance per count and second\n", camera.scale);
    if (camera.transmission != V2d(1, 1))
        text += fmt::format("transmission = {}\n", point(camera.transmission));
    if (camera.pedestal != 0) text += fmt::format("pedestal = {}  # counts\n", camera.pedestal);
    if (camera.noise_known) {
        text += fmt::format("gain = {}  # counts per electron\n", camera.gain);
        text += fmt::format("read_noise = {}  # counts\n", camera.read_noise);
    }
    if (camera.saturated) text += fmt::format("saturated = {}  # counts\n", *camera.saturated);
    if (camera.black) text += fmt::format("black = {}  # counts\n", *camera.black);
    if (camera.to_xyz) {
        const Imath::M33d& m = *camera.to_xyz;
        text += fmt::format("to_xyz = [{}, {}, {}, {}, {}, {}, {}, {}, {}]  # of R, G and B: X, then Y, Z\n",
                            m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2], m[2][0], m[2][1], m[2][2]);
    }
    return text;
}

std::string photographs_text(const Manifest& manifest) {
    std::string text = "\n[photographs]\n";
    if (manifest.listed.empty()) {
        text += fmt::format("name = {}\n", toml_string(manifest.name.text()));
        text += fmt::format("exposures = [{}]  # seconds\n", fmt::join(manifest.exposures[0], ", "));
        if (manifest.exposures[1] != manifest.exposures[0])
            text += fmt::format("negative_exposures = [{}]\n", fmt::join(manifest.exposures[1], ", "));
        for (const FilterSign sign : kFilterSigns) {
            const std::string& word = manifest.sign_words[sign == FilterSign::positive ? 0 : 1];
            if (word != sign_name(sign)) text += fmt::format("{} = {}\n", sign_name(sign), toml_string(word));
        }
        if (manifest.count_from != 0) text += fmt::format("count_from = {}\n", manifest.count_from);
    }
    if (manifest.channel != "luminance") text += fmt::format("channel = {}\n", toml_string(manifest.channel));
    if (manifest.corners) {
        const Corners& c = *manifest.corners;
        text += fmt::format(
            "\n[photographs.corners]  # of M in a photograph, pixels from its upper left corner\n"
            "lower_left = {}\nlower_right = {}\nupper_right = {}\nupper_left = {}\n",
            point(c[0]), point(c[1]), point(c[2]), point(c[3]));
    }
    return text;
}

}  // namespace

std::string manifest_text(const Manifest& manifest) {
    const std::filesystem::path home = std::filesystem::path(manifest.place.file).parent_path();
    const auto name = [&](const std::filesystem::path& file) {
        return toml_string(home.empty() ? file.string() : file.lexically_relative(home).string());
    };
    std::string text =
        "# Photographs of a lamp behind the filters of a rig; `lucerna light assemble` reads it.\n";
    text += fmt::format("unit = \"{}\"\n", flux_unit_name(manifest.info.unit));
    if (manifest.flux > 0) text += fmt::format("flux = {}  # of the whole lamp\n", manifest.flux);
    if (manifest.rig.centre.z != 0)
        text += fmt::format("setback = \"{}m\"  # of the lamp behind S\n", manifest.rig.centre.z);
    const Rgb& colour = manifest.info.colour;
    if (colour != Rgb(1.0F)) text += fmt::format("colour = [{}, {}, {}]\n", colour.x, colour.y, colour.z);
    if (!manifest.info.provenance.empty())
        text += fmt::format("provenance = {}\n", toml_string(manifest.info.provenance));
    text += rig_text(manifest.rig) + camera_text(manifest.camera) + photographs_text(manifest);
    for (const auto& [view, shots] : manifest.listed) {
        for (const Shot& shot : shots) {
            text += fmt::format("\n[[photograph]]\nview = [{}, {}]\nsign = \"{}\"\nseconds = {}\nfile = {}\n",
                                view.first.first, view.first.second, sign_name(view.second), shot.seconds,
                                name(shot.file));
        }
    }
    for (const Shot& dark : manifest.darks)
        text += fmt::format("\n[[dark]]\nseconds = {}\nfile = {}\n", dark.seconds, name(dark.file));
    return text;
}

void write_manifest(const std::filesystem::path& file, const Manifest& manifest) {
    const std::string text = manifest_text(manifest);
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    replace_file(file, std::span(&bytes, 1));
}

}  // namespace lucerna
