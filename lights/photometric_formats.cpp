#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "engine/system/content.h"
#include "engine/system/files.h"
#include "engine/system/zip_archive.h"
#include "engine/text/plain_text.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

namespace fs = std::filesystem;

enum class Format { none, ies, ldt, tm33, gldf, l3d };

std::string_view view_of(const std::vector<std::byte>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool is_xml(std::string_view text) {
    return trimmed(without_byte_order_mark(text).substr(0, 64)).starts_with('<');
}

// Returns the name of the root element, without the prefix of its namespace; "" if there is none.
std::string_view root_of(std::string_view text) {
    for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
        const std::string_view rest = text.substr(at + 1);
        if (rest.starts_with("!--")) {
            at = text.find("-->", at);
            if (at == std::string_view::npos) break;
        } else if (!rest.starts_with('?') && !rest.starts_with('!')) {
            const std::string_view name = rest.substr(0, rest.find_first_of(" \t\r\n/>"));
            return name.substr(name.find(':') + 1);
        }
    }
    return {};
}

Format format_of_text(std::string_view text) {
    if (is_xml(text)) return is_tm33_root(root_of(text)) ? Format::tm33 : Format::none;
    text = without_byte_order_mark(text);
    const std::string_view first = trimmed(text.substr(0, text.find_first_of("\r\n")));
    if (first.starts_with("IESNA") || first.starts_with("IES:")) return Format::ies;
    for (const TextLine& line : lines_of(text)) {
        if (trimmed(line.text).starts_with("TILT=")) return Format::ies;
    }
    return looks_like_ldt(text) ? Format::ldt : Format::none;
}

Format format_of(const ZipArchive& archive) {
    if (archive.find("product.xml")) return Format::gldf;
    return archive.find("structure.xml") ? Format::l3d : Format::none;
}

// Only text of the first editions, and damaged files, are not told by their content.
Format format_by_suffix(const fs::path& file) {
    const std::string suffix = suffix_of(file);
    if (suffix == ".ies") return Format::ies;
    if (suffix == ".ldt") return Format::ldt;
    return suffix == ".gldf" ? Format::gldf : Format::none;
}

Format format_of(const fs::path& file) {
    const std::vector<std::byte> first = first_bytes(file);
    Format found = Format::none;
    if (is_zip(view_of(first))) {
        try {
            found = format_of(ZipArchive(file));
        } catch (const InputError&) {  // reported when the file is read
        }
    } else {
        found = is_xml(view_of(first)) ? format_of_text(read_text(file)) : format_of_text(view_of(first));
    }
    return found != Format::none ? found : format_by_suffix(file);
}

[[noreturn]] void refuse_l3d(const std::string& file) {
    input_error(
        {file},
        "an L3D file has the geometry of a luminaire and no light; expected the GLDF file to which it "
        "belongs, or the luminaire's EULUMDAT or IES file");
}

std::vector<LuminaireEmitter> parse(Format format, std::string_view text, const std::string& name,
                                    Monitor& monitor) {
    switch (format) {
        case Format::ies:
            return {{parse_ies(text, name, monitor)}};
        case Format::ldt:
            return {{parse_ldt(text, name, monitor)}};
        case Format::tm33:
            return parse_tm33(text, name, monitor);
        default:
            break;
    }
    const std::string root = is_xml(text) ? fmt::format("XML with the root <{}>", shown_value(root_of(text)))
                                          : std::string(content_name(std::as_bytes(std::span(text))));
    input_error({name}, "this is no photometric file{}; expected IES LM-63, EULUMDAT, IES TM-33 or GLDF",
                root.empty() ? root : " but " + root);
}

struct Named {
    fs::path file;
    std::string variant;
};
// Splits "lamp.gldf#variant", unless a file has that name.
Named named(const fs::path& path) {
    const std::string text = path.string();
    const std::size_t hash = text.rfind('#');
    if (hash == std::string::npos || fs::exists(path)) return {path, {}};
    return {text.substr(0, hash), text.substr(hash + 1)};
}

}  // namespace

std::filesystem::path photometric_file(const fs::path& path) {
    return named(path).file;
}

bool is_photometric(const fs::path& path) {
    const Named name = named(path);
    if (!name.variant.empty() || format_by_suffix(name.file) != Format::none) return true;
    return format_of(name.file) != Format::none || is_xml(view_of(first_bytes(name.file)));
}

std::vector<LuminaireEmitter> parse_luminaire(std::string_view text, const std::string& file,
                                              Monitor& monitor) {
    Format format = format_of_text(text);
    if (format == Format::none && !is_xml(text)) format = format_by_suffix(file);
    return parse(format, text, file, monitor);
}

std::vector<LuminaireEmitter> read_luminaire(const fs::path& path, Monitor& monitor) {
    const auto [file, variant] = named(path);
    const Format format = format_of(file);
    if (format == Format::l3d) refuse_l3d(file.string());
    if (format == Format::gldf) return read_gldf(ZipArchive(file), file.string(), variant, monitor);
    if (!variant.empty()) {
        input_error({file.string()}, "\"#{}\" names a variant, which only a GLDF file has",
                    shown_value(variant));
    }
    return parse(format, read_text(file), file.string(), monitor);
}

PhotometricWeb read_photometric(const fs::path& file, Monitor& monitor) {
    const std::vector<LuminaireEmitter> emitters = read_luminaire(file, monitor);
    PhotometricWeb web = luminaire_web(emitters);
    if (emitters.size() > 1) {
        monitor.warn(
            fmt::format("{}: {} emitters are added up; the luminous opening is the box around theirs",
                        file.string(), emitters.size()));
    }
    return web;
}

}  // namespace lucerna
