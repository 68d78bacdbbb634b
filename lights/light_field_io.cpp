// The light field's file: one OpenEXR image that any viewer shows.
//
// The image is an atlas: view (m, n) fills the W_M by H_M pixels in column m and, counted from the bottom,
// row n; within a view t grows upwards too. The channel Y holds E / scale in half floats, with scale a power
// of 2 that puts the largest magnitude in (512, 1024], so that a half's 11 bits hold every coefficient that
// matters; coloured fields have the channels X and Z besides, each with a scale of its own. All else is in
// attributes whose names begin with "lightfield".
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <new>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/memory.h"
#include "engine/base/pictures.h"
#include "lights/light_field.h"

namespace lucerna {
namespace {

constexpr const char* kVersionName = "lightfieldVersion";
// Version 1 has even boxes alone; whatever it can say is written in it, for programs that know no other.
constexpr int kEvenBoxes = 1, kVersion = 2;
struct NamedBasis {
    FilterBasis filter;
    PixelBasis pixel;
    const char* name;
};
constexpr NamedBasis kBases[] = {
    {FilterBasis::bell, PixelBasis::box, "piecewise quadratic bell on S, pixel box on M"},
    {FilterBasis::bell, PixelBasis::hat, "piecewise quadratic bell on S, pixel hat on M"},
    {FilterBasis::hat, PixelBasis::box, "hat on S, pixel box on M"},
    {FilterBasis::hat, PixelBasis::hat, "hat on S, pixel hat on M"},
};

const char* basis_name(const Rig& rig) {
    const auto* const found = std::find_if(std::begin(kBases), std::end(kBases), [&](const NamedBasis& b) {
        return b.filter == rig.filter_basis && b.pixel == rig.basis;
    });
    return found->name;  // all pairs are there
}
bool is_even(const Rig& rig) {
    return rig.s_coordinate.c == 0 && rig.m_coordinate.c == 0;
}

// Where coefficient (m, n, k, l) lies in the atlas.
struct Atlas {
    const Rig& rig;
    std::size_t width() const {
        return static_cast<std::size_t>(rig.views.x) * static_cast<std::size_t>(rig.pixels.x);
    }
    std::size_t height() const {
        return static_cast<std::size_t>(rig.views.y) * static_cast<std::size_t>(rig.pixels.y);
    }

    // Calls visit(index of the coefficient, index of the pixel) for all, coefficient by coefficient.
    template <typename Visit>
    void for_each(Visit&& visit) const {
        std::size_t i = 0;
        for (int m = 0; m < rig.views.x; ++m) {
            for (int n = 0; n < rig.views.y; ++n) {
                for (int k = 0; k < rig.pixels.x; ++k) {
                    const auto x = static_cast<std::size_t>(m * rig.pixels.x + k);
                    for (int l = 0; l < rig.pixels.y; ++l, ++i) {
                        const std::size_t y = height() - 1 - static_cast<std::size_t>(n * rig.pixels.y + l);
                        visit(i, y * width() + x);
                    }
                }
            }
        }
    }
};

Imf::Header make_header(const LightField& field, const V3d& scale) {
    const Rig& rig = field.rig();
    const LightFieldInfo& info = field.info();
    const Atlas atlas{rig};
    if (atlas.width() > 1U << 24 || atlas.height() > 1U << 24) {
        throw InputError(
            fmt::format("an atlas of {} x {} pixels; at most 2^24 on a side", atlas.width(), atlas.height()));
    }
    Imf::Header header(static_cast<int>(atlas.width()), static_cast<int>(atlas.height()));
    header.compression() = Imf::ZIP_COMPRESSION;
    header.channels().insert("Y", Imf::Channel(Imf::HALF));
    const bool plain = is_even(rig) && rig.filter_basis == FilterBasis::bell &&
                       rig.basis == PixelBasis::box && !field.coloured();
    header.insert(kVersionName, Imf::IntAttribute(plain ? kEvenBoxes : kVersion));
    if (!plain) {
        header.insert("lightfieldCoordinateS", Imf::DoubleAttribute(rig.s_coordinate.c));
        header.insert("lightfieldCoordinateM", Imf::DoubleAttribute(rig.m_coordinate.c));
    }
    if (field.coloured()) {
        for (const char* name : {"X", "Z"}) header.channels().insert(name, Imf::Channel(Imf::HALF));
        header.insert("lightfieldScaleX", Imf::DoubleAttribute(scale.x));
        header.insert("lightfieldScaleZ", Imf::DoubleAttribute(scale.z));
        header.insert("lightfieldWeights", Imf::V3dAttribute(field.colour_channels().weight));
    }
    header.insert("lightfieldViews", Imf::V2iAttribute(rig.views));
    header.insert("lightfieldPixels", Imf::V2iAttribute(rig.pixels));
    header.insert("lightfieldShift", Imf::V2iAttribute(rig.shift));
    header.insert("lightfieldSpacing", Imf::V2dAttribute(rig.spacing));
    header.insert("lightfieldPixelSize", Imf::V2dAttribute(rig.pixel));
    header.insert("lightfieldDistance", Imf::DoubleAttribute(rig.distance));
    header.insert("lightfieldCentre", Imf::V3dAttribute(rig.centre));
    header.insert("lightfieldLengthUnit", Imf::StringAttribute("m"));
    header.insert("lightfieldFluxUnit", Imf::StringAttribute(std::string(flux_unit_name(info.unit))));
    header.insert("lightfieldScale", Imf::DoubleAttribute(scale.y));
    header.insert("lightfieldColour", Imf::V3fAttribute({info.colour.x, info.colour.y, info.colour.z}));
    header.insert("lightfieldBasis", Imf::StringAttribute(basis_name(rig)));
    header.insert("lightfieldProvenance", Imf::StringAttribute(info.provenance));
    header.insert("lightfieldCapturedFlux", Imf::DoubleAttribute(info.captured));
    header.insert("lightfieldMissedFlux", Imf::DoubleAttribute(info.missed));
    if (info.lumens_per_watt > 0)
        header.insert("lightfieldLumensPerWatt", Imf::DoubleAttribute(info.lumens_per_watt));
    return header;
}

// The value of an attribute that must be there, with this type.
template <typename Attribute>
auto required(const Imf::Header& header, const char* name) {
    const auto* found = header.findTypedAttribute<Attribute>(name);
    if (found == nullptr) {
        throw InputError(
            fmt::format("damaged light field: the attribute {} is missing or of another type", name));
    }
    return found->value();
}

void read_basis(const Imf::Header& header, Rig& rig) {
    const auto name = required<Imf::StringAttribute>(header, "lightfieldBasis");
    std::string accepted;
    for (const NamedBasis& basis : kBases) {
        if (name == basis.name) {
            rig.filter_basis = basis.filter;
            rig.basis = basis.pixel;
            return;
        }
        accepted += fmt::format("{}\"{}\"", accepted.empty() ? "" : ", ", basis.name);
    }
    throw InputError(fmt::format("basis \"{}\"; {} are accepted", one_line(name), accepted));
}

Rig read_rig(const Imf::Header& header, int version) {
    Rig rig;
    read_basis(header, rig);
    if (version > kEvenBoxes) {
        rig.s_coordinate.c = required<Imf::DoubleAttribute>(header, "lightfieldCoordinateS");
        rig.m_coordinate.c = required<Imf::DoubleAttribute>(header, "lightfieldCoordinateM");
    }
    rig.views = required<Imf::V2iAttribute>(header, "lightfieldViews");
    rig.pixels = required<Imf::V2iAttribute>(header, "lightfieldPixels");
    rig.shift = required<Imf::V2iAttribute>(header, "lightfieldShift");
    rig.spacing = required<Imf::V2dAttribute>(header, "lightfieldSpacing");
    rig.pixel = required<Imf::V2dAttribute>(header, "lightfieldPixelSize");
    rig.distance = required<Imf::DoubleAttribute>(header, "lightfieldDistance");
    rig.centre = required<Imf::V3dAttribute>(header, "lightfieldCentre");
    if (const std::string fault = rig.fault(); !fault.empty())
        throw InputError("damaged light field: " + fault);
    const auto unit = required<Imf::StringAttribute>(header, "lightfieldLengthUnit");
    if (unit != "m") throw InputError(fmt::format("length unit \"{}\"; \"m\" is accepted", one_line(unit)));
    return rig;
}

LightFieldInfo read_info(const Imf::Header& header) {
    LightFieldInfo info;
    const auto unit = required<Imf::StringAttribute>(header, "lightfieldFluxUnit");
    if (unit != "W" && unit != "lm") {
        throw InputError(fmt::format("flux unit \"{}\"; \"W\" and \"lm\" are accepted", one_line(unit)));
    }
    info.unit = unit == "W" ? FluxUnit::watt : FluxUnit::lumen;
    const auto colour = required<Imf::V3fAttribute>(header, "lightfieldColour");
    info.colour = {colour.x, colour.y, colour.z};
    // The sRGB components of the blue at the visible range's end are some thousands per luminance.
    constexpr float kMost = 1e5F;
    const Rgb& c = info.colour;
    if (!is_finite(c) || std::max({std::fabs(c.x), std::fabs(c.y), std::fabs(c.z)}) > kMost ||
        !(std::fabs(luminance(c) - 1) < 1e-3F * std::max(1.0F, max_component(c)))) {
        throw InputError(fmt::format("colour {} {} {}; luminance 1 is accepted, and components up to {:g}",
                                     colour.x, colour.y, colour.z, kMost));
    }
    info.provenance = one_line(required<Imf::StringAttribute>(header, "lightfieldProvenance"));
    info.captured = required<Imf::DoubleAttribute>(header, "lightfieldCapturedFlux");
    info.missed = required<Imf::DoubleAttribute>(header, "lightfieldMissedFlux");
    if (const auto* efficacy = header.findTypedAttribute<Imf::DoubleAttribute>("lightfieldLumensPerWatt")) {
        info.lumens_per_watt = efficacy->value();
        if (!(info.lumens_per_watt > 0 && info.lumens_per_watt <= kMostLumensPerWatt)) {
            throw InputError(fmt::format("{} lumens per watt; more than 0 and at most {} are accepted",
                                         info.lumens_per_watt, kMostLumensPerWatt));
        }
    }
    return info;
}

// Y, and the others if there are any.
std::vector<const char*> channel_names(const Imf::Header& header) {
    if (header.channels().findChannel("X") == nullptr && header.channels().findChannel("Z") == nullptr)
        return {"Y"};
    return {"X", "Y", "Z"};
}

double read_scale(const Imf::Header& header, const char* name) {
    const double scale = required<Imf::DoubleAttribute>(header, name);
    if (!std::isfinite(scale) || !(scale > 0)) {
        throw InputError(fmt::format("damaged light field: scale {}; it must be finite and positive", scale));
    }
    return scale;
}

// Is there an image of the atlas's size, and can the file hold it? A lying header must not make us allocate.
void check_window(const Imf::Header& header, const Rig& rig, std::uintmax_t file_bytes) {
    const Imath::Box2i window = header.dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    const Atlas atlas{rig};
    if (width != static_cast<std::int64_t>(atlas.width()) ||
        height != static_cast<std::int64_t>(atlas.height())) {
        throw InputError(
            fmt::format("damaged light field: {} x {} views of {} x {} pixels, but an image of {} x {}",
                        rig.views.x, rig.views.y, rig.pixels.x, rig.pixels.y, width, height));
    }
    constexpr std::uintmax_t kBestCompression = 1 << 12;  // coefficients per byte: far above what ZIP reaches
    if (rig.coefficients() / kBestCompression > file_bytes) {
        throw InputError(fmt::format("damaged light field: {} coefficients in a file of {} bytes",
                                     rig.coefficients(), file_bytes));
    }
    for (const char* name : channel_names(header)) {
        const Imf::Channel* channel = header.channels().findChannel(name);
        if (channel == nullptr || channel->xSampling != 1 || channel->ySampling != 1)
            throw InputError(fmt::format("damaged light field: no full channel {}", name));
    }
}

LightField read_field(const std::filesystem::path& file) {
    check_exr_header(file, ExrKind::light_field);
    Imf::InputFile in(file.c_str());
    const Imf::Header& header = in.header();
    if (header.findTypedAttribute<Imf::IntAttribute>(kVersionName) == nullptr) {
        throw InputError(
            fmt::format("an OpenEXR image, but no light field: it has no attribute {}", kVersionName));
    }
    const int version = required<Imf::IntAttribute>(header, kVersionName);
    if (version < kEvenBoxes || version > kVersion) {
        throw InputError(
            fmt::format("light field version {}; {} to {} is accepted", version, kEvenBoxes, kVersion));
    }
    const Rig rig = read_rig(header, version);
    LightFieldInfo info = read_info(header);
    check_window(header, rig, std::filesystem::file_size(file));
    const std::vector<const char*> names = channel_names(header);
    // The images, their coefficients in their order, and the field's own.
    require_memory(bytes_of(rig.coefficients(), (2 * names.size() + 2) * sizeof(float)),
                   fmt::format("a light field of {} coefficients", rig.coefficients()), "fewer are accepted");

    const Atlas atlas{rig};
    const Imath::V2i origin = header.dataWindow().min;
    const auto row = static_cast<std::ptrdiff_t>(atlas.width());
    Imf::FrameBuffer buffer;
    std::vector<std::vector<float>> pixels(names.size(), std::vector<float>(rig.coefficients()));
    for (std::size_t c = 0; c < names.size(); ++c) {
        char* base = reinterpret_cast<char*>(pixels[c].data()) -
                     static_cast<std::ptrdiff_t>(sizeof(float)) * (origin.x + row * origin.y);
        buffer.insert(names[c], Imf::Slice(Imf::FLOAT, base, sizeof(float), sizeof(float) * atlas.width()));
    }
    in.setFrameBuffer(buffer);
    in.readPixels(header.dataWindow().min.y, header.dataWindow().max.y);

    std::vector<std::vector<float>> coefficients(names.size(), std::vector<float>(rig.coefficients()));
    for (std::size_t c = 0; c < names.size(); ++c) {
        const double scale = read_scale(header, names[c][0] == 'Y'   ? "lightfieldScale"
                                                : names[c][0] == 'X' ? "lightfieldScaleX"
                                                                     : "lightfieldScaleZ");
        atlas.for_each([&](std::size_t i, std::size_t pixel) {
            coefficients[c][i] = static_cast<float>(double{pixels[c][pixel]} * scale);
        });
    }
    if (names.size() == 1) return LightField(rig, coefficients[0], std::move(info));
    const auto weight = required<Imf::V3dAttribute>(header, "lightfieldWeights");
    return LightField(rig, coefficients[0], coefficients[1], coefficients[2], std::move(info), weight);
}

}  // namespace

void write_light_field(const std::filesystem::path& file, const LightField& field) {
    const Atlas atlas{field.rig()};
    const std::vector<const char*> names = field.coloured() ? std::vector{"X", "Y", "Z"} : std::vector{"Y"};
    V3d scale(1, 1, 1);
    std::vector<std::vector<half>> pixels(names.size(), std::vector<half>(field.coefficients().size()));
    for (std::size_t c = 0; c < names.size(); ++c) {
        const int which = names[c][0] - 'X';
        std::optional<LightField> channel;
        if (field.coloured()) channel = field.channel(which);
        const std::span<const float> e = channel ? channel->coefficients() : field.coefficients();
        scale[which] = storage_scale(e);
        atlas.for_each(
            [&](std::size_t i, std::size_t pixel) { pixels[c][pixel] = stored_half(e[i], scale[which]); });
    }
    replace_file(file, [&](const std::filesystem::path& temporary) {
        // A stream of our own: OpenEXR writes the last part where it cannot say that it failed.
        std::ofstream stream(temporary, std::ios::binary);
        {
            Imf::StdOFStream named(stream, temporary.c_str());
            Imf::OutputFile out(named, make_header(field, scale));
            Imf::FrameBuffer buffer;
            for (std::size_t c = 0; c < names.size(); ++c) {
                buffer.insert(names[c], Imf::Slice(Imf::HALF, reinterpret_cast<char*>(pixels[c].data()),
                                                   sizeof(half), sizeof(half) * atlas.width()));
            }
            out.setFrameBuffer(buffer);
            out.writePixels(static_cast<int>(atlas.height()));
        }
        stream.exceptions(std::ios::badbit | std::ios::failbit);  // throws if it has failed already
        stream.close();
    });
}

LightField read_light_field(const std::filesystem::path& file) {
    require_readable(file);
    try {
        return read_field(file);
    } catch (const InputError& error) {
        throw InputError({file.string()}, error.what());
    } catch (const std::bad_alloc&) {
        throw InputError({file.string()}, "not enough memory to read it; fewer coefficients are accepted");
    } catch (const std::exception& error) {
        throw InputError({file.string()},
                         std::string("not a readable OpenEXR file: ") + one_line(error.what()));
    }
}

}  // namespace lucerna
