#include "engine/system/content.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "engine/system/files.h"

namespace lucerna {
namespace {

struct Signature {
    std::string_view bytes, name;
    std::size_t at = 0;
};

using std::string_view_literals::operator""sv;
constexpr Signature kSignatures[] = {
    {"\x1F\x8B"sv, "gzip, to be unpacked first"},
    {"PK\x03\x04"sv, "a zip archive, to be unpacked first"},
    {"PK\x05\x06"sv, "an empty zip archive"},
    {"7z\xBC\xAF\x27\x1C"sv, "a 7z archive, to be unpacked first"},
    {"Rar!\x1A"sv, "a RAR archive, to be unpacked first"},
    {"BZh"sv, "bzip2, to be unpacked first"},
    {"\xFD\x37zXZ\x00"sv, "xz, to be unpacked first"},
    {"\x28\xB5\x2F\xFD"sv, "Zstandard, to be unpacked first"},
    {"ustar"sv, "a tar archive, to be unpacked first", 257},
    {"\x89PNG\r\n\x1A\n"sv, "a PNG picture"},
    {"\xFF\xD8\xFF"sv, "a JPEG picture"},
    {"GIF8"sv, "a GIF picture"},
    {"II*\x00"sv, "a TIFF picture"},
    {"MM\x00*"sv, "a TIFF picture"},
    {"BM"sv, "a BMP picture"},
    {"WEBP"sv, "a WebP picture", 8},
    {"\x76\x2F\x31\x01"sv, "an OpenEXR file"},
    {"#?"sv, "a Radiance picture"},
    {"%PDF"sv, "a PDF document"},
    {"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1"sv, "a document of Microsoft Office"},
    {"\x89HDF"sv, "an HDF5 file"},
    {"glTF"sv, "a glTF model"},
    {"\x7F\x45LF"sv, "a program"},
    {"TM25"sv, "an IES TM-25 ray file"},
    {"LTRF"sv, "a LightTools ray file"},
    {"\xF2\x03\x00\x00"sv, "a Zemax ray file"},
    {"ply\n"sv, "a PLY mesh"},
    {"ply\r"sv, "a PLY mesh"},
    {"IESNA"sv, "an IES LM-63 photometric file"},
    {"IES:LM-63"sv, "an IES LM-63 photometric file"},
    {"<!DOCTYPE html"sv, "a web page"},
    {"<!doctype html"sv, "a web page"},
    {"<html"sv, "a web page"},
    {"<?xml"sv, "XML"},
};

}  // namespace

std::string_view content_name(std::span<const std::byte> first) {
    const std::string_view bytes(reinterpret_cast<const char*>(first.data()), first.size());
    if (bytes.empty()) return "an empty file";
    for (const Signature& known : kSignatures) {
        if (bytes.size() >= known.at && bytes.substr(known.at).starts_with(known.bytes)) return known.name;
    }
    const auto is_text = [](char c) {
        const auto code = static_cast<unsigned char>(c);
        return code == '\t' || code == '\n' || code == '\r' || code == '\f' || (code >= ' ' && code != 0x7F);
    };
    return std::ranges::all_of(bytes, is_text) ? kPlainText : std::string_view();
}

std::vector<std::byte> first_bytes(const std::filesystem::path& file) {
    std::vector<std::byte> bytes(kFirstBytes);
    std::ifstream in = open_to_read(file);
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<std::size_t>(in.gcount()));
    return bytes;
}

std::string content_of(const std::filesystem::path& file) {
    const std::string_view name = content_name(first_bytes(file));
    return name.empty() ? "its contents are of no format that is known here" : fmt::format("it is {}", name);
}

}  // namespace lucerna
