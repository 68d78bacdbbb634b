#include <OpenEXR/openexr.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <type_traits>

#include "engine/base/error.h"
#include "engine/base/float_traps.h"
#include "engine/image/pictures.h"
#include "engine/system/content.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// The library refuses larger images and tiles (pixels on a side). No larger light field is written.
constexpr int kWidestImage = 1 << 24, kWidestTile = 1 << 16;
constexpr std::uint64_t kSmallImage = 1 << 20;  // bytes that any file may claim

struct Finish {
    void operator()(exr_context_t context) const { exr_finish(&context); }
};
using Context = std::unique_ptr<std::remove_pointer_t<exr_context_t>, Finish>;

// Keeps the first complaint. The library goes on after many of them, although it then no longer reads what
// its C++ interface will read.
void keep_complaint(exr_const_context_t context, exr_result_t /*code*/, const char* text) {
    void* first = nullptr;
    if (!context || exr_get_user_data(context, &first) != EXR_ERR_SUCCESS) return;
    if (auto& kept = *static_cast<std::string*>(first); kept.empty()) kept = text;
}

Context open_header(const std::filesystem::path& file) {
    std::string complaint;
    exr_context_initializer_t how = EXR_DEFAULT_CONTEXT_INITIALIZER;
    how.error_handler_fn = keep_complaint;
    how.user_data = &complaint;
    how.max_image_width = how.max_image_height = kWidestImage;
    how.max_tile_width = how.max_tile_height = kWidestTile;
    exr_context_t opened = nullptr;
    const exr_result_t result = exr_start_read(&opened, file.c_str(), &how);
    Context context(opened);
    if (result != EXR_ERR_SUCCESS && complaint.empty()) complaint = exr_get_default_error_message(result);
    if (!complaint.empty()) throw InputError("damaged OpenEXR file: " + one_line(complaint));
    return context;
}

// Returns whether the value's own contents end where its size says. OpenEXRCore does not check this, and the
// C++ interface would then read on elsewhere.
bool ends_by_its_size(const std::string& type, const std::string& value) {
    std::size_t at = 0;
    if (type == "chlist") {  // names, each with its NUL and 16 bytes more, and an empty name
        while (at < value.size() && value[at] != '\0') at = std::min(value.find('\0', at), value.size()) + 17;
        return at + 1 == value.size();
    }
    for (std::uint32_t length = 0; at + sizeof length <= value.size(); at += sizeof length + length)
        std::memcpy(&length, &value[at], sizeof length);  // of the text that follows
    return at == value.size();
}

// Walks over the attributes of all parts, whose sizes OpenEXRCore has checked.
void check_lists(std::ifstream in, int parts) {
    in.seekg(8);
    std::string name, type, value;
    for (; parts > 0; --parts) {
        while (std::getline(in, name, '\0') && !name.empty()) {
            std::int32_t size = 0;
            std::getline(in, type, '\0');
            in.read(reinterpret_cast<char*>(&size), sizeof size);
            const bool list = type == "chlist" || type == "stringvector";
            value.resize(list ? static_cast<std::size_t>(size) : 0);
            in.read(value.data(), static_cast<std::streamsize>(value.size()));
            if (!list) in.seekg(size, std::ios::cur);
            if ((list && !ends_by_its_size(type, value)) || (type == "deepImageState" && size != 1))
                throw InputError(
                    fmt::format("damaged OpenEXR file: an attribute of type {} and {} bytes", type, size));
        }
    }
}

void check_part(exr_const_context_t context, int part, std::uint64_t file_bytes) {
    exr_attr_box2i_t window{};
    const exr_attr_chlist_t* channels = nullptr;
    std::int32_t chunks = 0;
    std::uint64_t chunk_bytes = 0;
    if (exr_get_data_window(context, part, &window) != EXR_ERR_SUCCESS ||
        exr_get_channels(context, part, &channels) != EXR_ERR_SUCCESS ||
        exr_get_chunk_count(context, part, &chunks) != EXR_ERR_SUCCESS ||
        exr_get_chunk_unpacked_size(context, part, &chunk_bytes) != EXR_ERR_SUCCESS)
        throw InputError("damaged OpenEXR file: a part without pixels");
    const auto side = [](int first, int last) {
        return static_cast<std::uint64_t>(std::int64_t{last} - first + 1);
    };
    const std::uint64_t width = side(window.min.x, window.max.x), height = side(window.min.y, window.max.y);
    const std::uint64_t bytes =
        bytes_of(width * height, 4 * static_cast<std::uint64_t>(channels->num_channels));
    // The table of offsets that follows the header has 8 bytes for each chunk.
    if (static_cast<std::uint64_t>(chunks) > file_bytes / 8 ||
        std::max(bytes, chunk_bytes) > file_bytes * kBestCompression + kSmallImage) {
        throw InputError(fmt::format("damaged OpenEXR file: an image of {} x {} pixels in {} bytes", width,
                                     height, file_bytes));
    }
    // Every thread that reads holds a chunk packed and unpacked.
    require_memory(bytes_of(chunk_bytes, 2), fmt::format("an OpenEXR image {} pixels wide", width),
                   "use a narrower one");
}

}  // namespace

ExrParts check_exr_header(const std::filesystem::path& file) {
    if (content_name(first_bytes(file)) != "an OpenEXR file")
        throw InputError(fmt::format("not an OpenEXR file: {}", content_of(file)));
    const FloatTraps none(kNoFaults);
    const Context context = open_header(file);
    ExrParts parts;
    exr_get_count(context.get(), &parts.count);
    check_lists(open_to_read(file), parts.count);
    for (int part = 0; part < parts.count; ++part) {
        exr_storage_t storage = EXR_STORAGE_SCANLINE;
        exr_get_storage(context.get(), part, &storage);
        parts.scan_lines = parts.scan_lines && storage == EXR_STORAGE_SCANLINE;
        check_part(context.get(), part, std::filesystem::file_size(file));
    }
    return parts;
}

}  // namespace lucerna
