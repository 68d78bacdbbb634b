// Reads and writes the project's images in OpenEXR. Measured light fields have their own reader and writer
// (lights/light_field_io.cpp).
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>

#include <algorithm>
#include <array>
#include <exception>
#include <fstream>
#include <initializer_list>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/colour/colour_space.h"
#include "engine/image/image.h"
#include "engine/image/picture_colours.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// Returns the rank of a channel: its place in `first`, or one behind all of these.
std::size_t channel_rank(const std::string& name, std::string_view first) {
    return name.size() == 1 ? std::min(first.find(name), first.size()) : first.size();
}

bool has_all(const std::vector<std::string>& channels, std::initializer_list<const char*> names) {
    return std::ranges::all_of(names, [&](const char* n) { return std::ranges::count(channels, n) > 0; });
}

bool has_any(const std::vector<std::string>& channels, std::initializer_list<const char*> names) {
    return std::ranges::any_of(names, [&](const char* n) { return std::ranges::count(channels, n) > 0; });
}

bool in_colour(const Image& image) {
    return has_all(image.channels, {"R", "G", "B"});
}

// Channels of colours may not hold integers. Others may, for example identifiers.
void refuse_integers(const Imf::ChannelList& channels) {
    for (const char* name : {"R", "G", "B", "X", "Y", "Z"}) {
        const Imf::Channel* channel = channels.findChannel(name);
        if (channel && channel->type == Imf::UINT)
            throw InputError(fmt::format("channel {} holds integers (UINT); expected half or float", name));
    }
}

Imf::Chromaticities chromaticities_of(const ColourSpace* space) {
    if (!space) return {};  // Rec. 709's
    const Chromaticities& c = space->chromaticities;
    return {{c[0], c[1]}, {c[2], c[3]}, {c[4], c[5]}, {c[6], c[7]}};
}

// Returns the colour space that the header states for R, G and B. OpenEXR's default is Rec. 709.
ColourSpace space_of(const Imf::Header& header) {
    if (!Imf::hasChromaticities(header)) return colour_spaces().front();
    const Imf::Chromaticities& c = Imf::chromaticities(header);
    const auto space =
        colour_space_of({c.red.x, c.red.y, c.green.x, c.green.y, c.blue.x, c.blue.y, c.white.x, c.white.y});
    if (!space)
        throw InputError(
            fmt::format("its chromaticities, ({:g}, {:g}) ({:g}, {:g}) ({:g}, {:g}) and white ({:g}, {:g}), "
                        "do not span a colour space",
                        c.red.x, c.red.y, c.green.x, c.green.y, c.blue.x, c.blue.y, c.white.x, c.white.y));
    return *space;
}

// Converts an image from another space to linear sRGB, and notes that in an attribute.
Image brought_from(const ColourSpace& space, Image image) {
    image.attributes["lucerna.broughtfrom"] =
        space.name.empty() ? "a space of its own" : std::string(space.name);
    image.space = &space;
    return brought_to_srgb(std::move(image));
}

Imf::FrameBuffer frame_buffer(Image& image, const Imath::V2i& origin) {
    Imf::FrameBuffer buffer;
    const std::size_t x_stride = image.channels.size() * sizeof(float);
    const std::size_t y_stride = x_stride * static_cast<std::size_t>(image.width);
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        char* base = reinterpret_cast<char*>(image.data.data() + c) -
                     static_cast<std::ptrdiff_t>(x_stride) * origin.x -
                     static_cast<std::ptrdiff_t>(y_stride) * origin.y;
        buffer.insert(image.channels[c], Imf::Slice(Imf::FLOAT, base, x_stride, y_stride));
    }
    return buffer;
}

// Reads where the data window lies in the display window, if the two differ.
void read_windows(const Imf::Header& header, Image& image) {
    const Imath::Box2i data = header.dataWindow(), display = header.displayWindow();
    // Differences of corners further out would overflow, so the place in such a picture is ignored.
    constexpr int kFar = 1 << 29;
    const Imath::Box2i near({-kFar, -kFar}, {kFar, kFar});
    for (const Imath::V2i& corner : {data.min, data.max, display.min, display.max}) {
        if (!near.intersects(corner)) return;
    }
    if (data == display) return;
    image.corner = data.min - display.min;
    image.picture = display.max - display.min + V2i(1);
}

// Holds a file's image and the space of its R, G and B, or no space if it lacks these channels.
struct Stated {
    Image image;
    std::optional<ColourSpace> space;
};

Stated read_stated(const std::filesystem::path& file) {
    require_readable(file);
    try {
        check_exr_header(file);
        Imf::InputFile in(file.c_str());
        const Imath::Box2i window = in.header().dataWindow();
        const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
        const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
        std::vector<std::string> names;
        for (auto c = in.header().channels().begin(); c != in.header().channels().end(); ++c) {
            names.emplace_back(c.name());
        }
        refuse_integers(in.header().channels());
        const bool xyz = has_all(names, {"X", "Y", "Z"}) && !has_any(names, {"R", "G", "B"});
        // Viewers and people expect R, G, B first; OpenEXR sorts channels by name.
        const std::string_view first = xyz ? "XYZ" : has_any(names, {"R", "G", "B"}) ? "RGB" : "Y";
        std::stable_sort(names.begin(), names.end(), [first](const std::string& a, const std::string& b) {
            return channel_rank(a, first) < channel_rank(b, first);
        });
        require_memory(bytes_of(static_cast<std::uint64_t>(width * height), names.size() * sizeof(float)),
                       fmt::format("an image of {} x {} pixels", width, height), "use fewer pixels");
        Image image(static_cast<int>(width), static_cast<int>(height), std::move(names));
        read_windows(in.header(), image);
        in.setFrameBuffer(frame_buffer(image, window.min));
        in.readPixels(window.min.y, window.max.y);
        for (auto a = in.header().begin(); a != in.header().end(); ++a) {
            if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute())) {
                image.attributes[a.name()] = text->value();
            }
        }
        if (xyz) {
            std::copy_n(std::array{"R", "G", "B"}.begin(), 3, image.channels.begin());
            return {std::move(image), cie_xyz_space()};
        }
        if (!in_colour(image)) return {std::move(image), std::nullopt};
        const ColourSpace space = space_of(in.header());
        return {std::move(image), space};
    } catch (const std::bad_alloc&) {
        throw InputError({file.string()}, "not enough memory to read it; use fewer pixels");
    } catch (const std::exception& error) {
        throw InputError({file.string()},
                         std::string("not a readable OpenEXR image: ") + one_line(error.what()));
    }
}

}  // namespace

Image read_exr(const std::filesystem::path& file) {
    Stated stated = read_stated(file);
    if (!stated.space || stated.space->name == colour_spaces().front().name) return std::move(stated.image);
    return brought_from(*stated.space, std::move(stated.image));
}

Image read_exr_as_stated(const std::filesystem::path& file) {
    Stated stated = read_stated(file);
    if (!stated.space) return std::move(stated.image);
    stated.image.space = find_colour_space(stated.space->name);
    if (!stated.image.space) throw InputError({file.string()}, "its colours are in an unnamed colour space");
    return std::move(stated.image);
}

namespace {

// Throws an exception of OpenEXR for names of channels or attributes that it does not accept.
void write_into(Imf::OStream& stream, const Image& image) {
    const V2i last = image.corner + V2i(image.width - 1, image.height - 1);
    const Imath::Box2i data({image.corner.x, image.corner.y}, {last.x, last.y});
    const V2i whole = image.picture == V2i(0, 0) ? V2i(image.width, image.height) : image.picture;
    Imf::Header header({{0, 0}, {whole.x - 1, whole.y - 1}}, data);
    // The low bits of floats that hold noise do not pack: ZIP takes five times as long and saves 2 to 5 %
    // more of a render of 1280 x 720 pixels, a quarter of one with all layers.
    header.compression() = Imf::RLE_COMPRESSION;
    for (const std::string& name : image.channels) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    if (in_colour(image)) Imf::addChromaticities(header, chromaticities_of(image.space));
    for (const auto& [name, text] : image.attributes) header.insert(name, Imf::StringAttribute(text));
    Imf::OutputFile out(stream, header);
    Image& source = const_cast<Image&>(image);  // the frame buffer is not const; writing only reads
    out.setFrameBuffer(frame_buffer(source, data.min));
    out.writePixels(image.height);
}

}  // namespace

void write_exr(const std::filesystem::path& file, const Image& image, int threads) {
    if (threads > std::max(1, Imf::globalThreadCount())) {
        try {
            Imf::setGlobalThreadCount(threads);
        } catch (const std::exception&) {  // no memory for their stacks: this thread compresses alone
        }
    }
    replace_file(file, [&](const std::filesystem::path& temporary) {
        // OpenEXR writes the last bytes in a destructor, which cannot report a failure. This stream can.
        std::ofstream stream(temporary, std::ios::binary);
        {
            Imf::StdOFStream named(stream, temporary.c_str());
            write_into(named, image);
        }
        stream.exceptions(std::ios::badbit | std::ios::failbit);  // this throws if a write has failed
        stream.close();
    });
}

std::vector<std::byte> exr_bytes(const Image& image) {
    Imf::StdOSStream stream;
    write_into(stream, image);
    const std::string text = stream.str();
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

const ColourSpace* space_of_layers(const Image& image) {
    const auto from = image.attributes.find("lucerna.broughtfrom");
    return from != image.attributes.end() ? find_colour_space(from->second) : image.space;
}

}  // namespace lucerna
