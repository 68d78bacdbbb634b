#include "engine/pictures/svg.h"

#include <dlfcn.h>
#include <fontconfig/fontconfig.h>
#include <librsvg/rsvg.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>

namespace lucerna {
namespace {

struct Release {
    void operator()(void* object) const { g_object_unref(object); }
    void operator()(GError* error) const { g_error_free(error); }
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* cairo) const { cairo_destroy(cairo); }
    void operator()(FcPattern* pattern) const { FcPatternDestroy(pattern); }
};
template <typename T>
using Owned = std::unique_ptr<T, Release>;

[[noreturn]] void fail(GError* error) {
    const Owned<GError> owned(error);
    throw std::runtime_error(owned ? owned->message : "no cause given");
}

// A relocatable archive has its fonts beside this library (scripts/package.sh). They are then used alone, so
// that the system needs neither fonts nor fontconfig's files.
void use_own_fonts() {
    Dl_info here{};
    if (dladdr(reinterpret_cast<void*>(&use_own_fonts), &here) == 0) return;
    const std::filesystem::path fonts = std::filesystem::path(here.dli_fname).parent_path() / "fonts";
    std::error_code unknown;
    if (!std::filesystem::is_directory(fonts, unknown)) return;
    FcConfig* const own = FcConfigCreate();
    // Without a folder for caches fontconfig complains on standard error.
    constexpr const char* kCaches =
        R"(<fontconfig><cachedir prefix="xdg">fontconfig</cachedir></fontconfig>)";
    FcConfigParseAndLoadFromMemory(own, reinterpret_cast<const FcChar8*>(kCaches), FcTrue);
    FcConfigAppFontAddDir(own, reinterpret_cast<const FcChar8*>(fonts.c_str()));
    FcConfigSetCurrent(own);
    FcConfigDestroy(own);  // the current configuration has its own reference
}

// Throws if the font is missing. librsvg would silently use another font, or omit the text if there is none.
void require_font(const std::string& family) {
    use_own_fonts();
    const Owned<FcPattern> wanted(FcPatternCreate());
    FcPatternAddString(wanted.get(), FC_FAMILY, reinterpret_cast<const FcChar8*>(family.c_str()));
    FcConfigSubstitute(nullptr, wanted.get(), FcMatchPattern);
    FcDefaultSubstitute(wanted.get());
    FcResult result = FcResultNoMatch;
    const Owned<FcPattern> found(FcFontMatch(nullptr, wanted.get(), &result));
    FcChar8* name = nullptr;
    if (!found || FcPatternGetString(found.get(), FC_FAMILY, 0, &name) != FcResultMatch ||
        family != reinterpret_cast<const char*>(name))
        throw std::runtime_error("text needs the font " + family + ", which is not installed");
}

}  // namespace

DrawnSvg draw_svg_by_librsvg(std::string_view svg, double scale, const std::string& font) {
    require_font(font);
    const Owned<GInputStream> stream(
        g_memory_input_stream_new_from_data(svg.data(), static_cast<gssize>(svg.size()), nullptr));
    GError* error = nullptr;
    // UNLIMITED allows pictures inside a drawing, which are long attributes. Without a base no other file is
    // read.
    const Owned<RsvgHandle> drawing(
        rsvg_handle_new_from_stream_sync(stream.get(), nullptr, RSVG_HANDLE_FLAG_UNLIMITED, nullptr, &error));
    if (!drawing) fail(error);
    double width = 0, height = 0;
    if (!rsvg_handle_get_intrinsic_size_in_pixels(drawing.get(), &width, &height))
        throw std::runtime_error("the drawing does not state its size");
    DrawnSvg drawn;
    drawn.width = static_cast<int>(std::lround(width * scale));
    drawn.height = static_cast<int>(std::lround(height * scale));

    const Owned<cairo_surface_t> surface(
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, drawn.width, drawn.height));
    const Owned<cairo_t> cairo(cairo_create(surface.get()));
    cairo_set_source_rgb(cairo.get(), 1, 1, 1);
    cairo_paint(cairo.get());
    const RsvgRectangle all{0, 0, static_cast<double>(drawn.width), static_cast<double>(drawn.height)};
    if (!rsvg_handle_render_document(drawing.get(), cairo.get(), &all, &error)) fail(error);
    cairo_surface_flush(surface.get());
    if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS)
        throw std::runtime_error(cairo_status_to_string(cairo_surface_status(surface.get())));

    const unsigned char* const bytes = cairo_image_surface_get_data(surface.get());
    const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(surface.get()));
    drawn.rgb.reserve(3 * static_cast<std::size_t>(drawn.width) * static_cast<std::size_t>(drawn.height));
    for (int y = 0; y < drawn.height; ++y) {
        const auto* const row =
            reinterpret_cast<const std::uint32_t*>(bytes + static_cast<std::size_t>(y) * stride);
        for (int x = 0; x < drawn.width; ++x) {
            for (const int shift : {16, 8, 0})
                drawn.rgb.push_back(static_cast<std::uint8_t>(row[x] >> shift));
        }
    }
    return drawn;
}

}  // namespace lucerna
