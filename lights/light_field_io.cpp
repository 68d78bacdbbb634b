// The light field's file: one OpenEXR image, which any viewer shows.
//
// The image is an atlas: view (m, n) fills the W_M by H_M pixels in column m and, counted from the bottom,
// row n; t, too, grows upwards within a view. The channel Y holds E / scale as halves. The scale is a power
// of 2 that puts the largest magnitude in (512, 1024], so that a half's 11 bits hold every coefficient that
// matters. Coloured fields also have channels X and Z, each with its own scale. Everything else is in
// attributes whose names begin with "lightfield".
//
// A lamp of several slabs is a multi-part file. Each part is such an image with its slab's axes, the number
// of slabs and the lamp's box.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatVectorAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <new>

#include "engine/base/error.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"
#include "lights/light_field.h"
#include "lights/lumigraph.h"

namespace lucerna {
namespace {

constexpr const char* kVersionName = "lightfieldVersion";
// For each plane: its distance from S, the squared error, and the noise of counting (PlaneError).
constexpr const char* kErrorsName = "lightfieldHeldOutErrors";
// The values of each spectrum one after the other [W/(nm lm)] (SpectralBasis), and their error.
constexpr const char* kSpectraName = "lightfieldSpectra";
constexpr const char* kSpectraErrorName = "lightfieldSpectraError";
constexpr const char* kReplicateName = "lightfieldReplicateOf";
// Version 1 has uniform boxes only and is written whenever it suffices, for programs that know no other. A
// slab of a lumigraph has version 3, which is version 2 plus the slab's orientation.
constexpr int kEvenBoxes = 1, kVersion = 2, kOfSlab = 3;
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
    return found->name;  // the list is complete
}
bool is_even(const Rig& rig) {
    return rig.s_coordinate.c == 0 && rig.m_coordinate.c == 0;
}

// Maps coefficients (m, n, k, l) to the atlas.
struct Atlas {
    const Rig& rig;
    std::size_t width() const {
        return static_cast<std::size_t>(rig.views.x) * static_cast<std::size_t>(rig.pixels.x);
    }
    std::size_t height() const {
        return static_cast<std::size_t>(rig.views.y) * static_cast<std::size_t>(rig.pixels.y);
    }

    // Calls visit(index of the coefficient, index of the pixel) for all, in the order of the coefficients.
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
    if (info.replicate_of != 0) {
        header.insert(kReplicateName, Imf::StringAttribute(fmt::format("{:016x}", info.replicate_of)));
    }
    if (info.spectra.known()) {
        Imf::FloatVector values;
        for (const BandSpectrum& spectrum : info.spectra.spectra) {
            for (const double value : spectrum.at) values.push_back(static_cast<float>(value));
        }
        header.insert(kSpectraName, Imf::FloatVectorAttribute(values));
        header.insert(kSpectraErrorName, Imf::DoubleAttribute(info.spectra.error));
    }
    if (!info.errors.empty()) {
        Imf::FloatVector errors;
        for (const PlaneError& e : info.errors) {
            for (const double value : {e.distance, e.squared, e.counts})
                errors.push_back(static_cast<float>(value));
        }
        header.insert(kErrorsName, Imf::FloatVectorAttribute(errors));
    }
    return header;
}

// Returns the value of an attribute. Throws InputError if it is missing or of another type.
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
    throw InputError(fmt::format("basis \"{}\"; expected {}", one_line(name), accepted));
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
    if (unit != "m") throw InputError(fmt::format("length unit \"{}\"; expected \"m\"", one_line(unit)));
    return rig;
}

SpectralBasis read_spectra(const Imf::Header& header) {
    SpectralBasis basis;
    const auto* found = header.findTypedAttribute<Imf::FloatVectorAttribute>(kSpectraName);
    if (found == nullptr) return basis;
    const Imf::FloatVector& values = found->value();
    const std::size_t count = values.size() / kBands;
    bool valid = values.size() == count * kBands && count >= 1 && count <= SpectralBasis::kMost;
    for (std::size_t k = 0; valid && k < count; ++k) {
        BandSpectrum spectrum;
        for (std::size_t i = 0; i < kBands; ++i) spectrum.at[i] = double{values[k * kBands + i]};
        const double lumens = band_lumens(spectrum);
        valid = std::isfinite(lumens) && lumens > 0;
        // Rounding has changed it a little.
        if (valid) basis.spectra.push_back(1 / lumens * spectrum);
    }
    basis.error = required<Imf::DoubleAttribute>(header, kSpectraErrorName);
    if (!valid || !(basis.error >= 0) || !std::isfinite(basis.error)) {
        throw InputError(fmt::format(
            "{}: expected {} values for each of 1 to {} visible spectra, and an error of 0 or more",
            kSpectraName, kBands, SpectralBasis::kMost));
    }
    return basis;
}

LightFieldInfo read_info(const Imf::Header& header) {
    LightFieldInfo info;
    const auto unit = required<Imf::StringAttribute>(header, "lightfieldFluxUnit");
    if (unit != "W" && unit != "lm") {
        throw InputError(fmt::format("flux unit \"{}\"; expected \"W\" or \"lm\"", one_line(unit)));
    }
    info.unit = unit == "W" ? FluxUnit::watt : FluxUnit::lumen;
    const auto colour = required<Imf::V3fAttribute>(header, "lightfieldColour");
    info.colour = {colour.x, colour.y, colour.z};
    // The sRGB components of blue at the end of the visible range are some thousands per luminance.
    constexpr float kMost = 1e5F;
    const Rgb& c = info.colour;
    if (!is_finite(c) || std::max({std::fabs(c.x), std::fabs(c.y), std::fabs(c.z)}) > kMost ||
        !(std::fabs(luminance(c) - 1) < 1e-3F * std::max(1.0F, max_component(c)))) {
        throw InputError(fmt::format("colour {} {} {}; expected luminance 1 and components up to {:g}",
                                     colour.x, colour.y, colour.z, kMost));
    }
    info.provenance = one_line(required<Imf::StringAttribute>(header, "lightfieldProvenance"));
    info.captured = required<Imf::DoubleAttribute>(header, "lightfieldCapturedFlux");
    info.missed = required<Imf::DoubleAttribute>(header, "lightfieldMissedFlux");
    if (const auto* efficacy = header.findTypedAttribute<Imf::DoubleAttribute>("lightfieldLumensPerWatt")) {
        info.lumens_per_watt = efficacy->value();
        if (!(info.lumens_per_watt > 0 && info.lumens_per_watt <= kMostLumensPerWatt)) {
            throw InputError(fmt::format("{} lumens per watt; expected more than 0 and at most {}",
                                         info.lumens_per_watt, kMostLumensPerWatt));
        }
    }
    info.spectra = read_spectra(header);
    if (const auto* lamp = header.findTypedAttribute<Imf::StringAttribute>(kReplicateName)) {
        const std::string& hash = lamp->value();
        const auto [end, error] =
            std::from_chars(hash.data(), hash.data() + hash.size(), info.replicate_of, 16);
        if (error != std::errc() || end != hash.data() + hash.size()) {
            throw InputError(
                fmt::format("{} \"{}\"; expected a hash of 16 digits", kReplicateName, one_line(hash)));
        }
    }
    if (const auto* errors = header.findTypedAttribute<Imf::FloatVectorAttribute>(kErrorsName)) {
        const Imf::FloatVector& values = errors->value();
        bool known = values.size() % 3 == 0;
        for (std::size_t i = 0; known && i < values.size(); i += 3) {
            info.errors.push_back({double{values[i]}, double{values[i + 1]}, double{values[i + 2]}});
            known = values[i] >= 0 && std::isfinite(values[i + 1]) && std::isfinite(values[i + 2]) &&
                    values[i + 2] >= 0;
        }
        if (!known) {
            throw InputError(fmt::format(
                "{}: expected a distance, a squared error and a noise for each plane, none of them NaN",
                kErrorsName));
        }
    }
    return info;
}

// Returns Y, and X and Z if there are any.
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

// Throws InputError unless a file of that size can hold that many coefficients.
void require_packed(std::size_t coefficients, std::uintmax_t file_bytes) {
    constexpr std::uintmax_t kBestCompression = 1 << 12;  // coefficients per byte, far above what ZIP reaches
    if (coefficients / kBestCompression > file_bytes) {
        throw InputError(fmt::format("damaged light field: {} coefficients in a file of {} bytes",
                                     coefficients, file_bytes));
    }
}

// Throws InputError unless the image has the atlas's size and the file can hold it, so that a false header
// causes no allocation.
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
    require_packed(rig.coefficients(), file_bytes);
    for (const char* name : channel_names(header)) {
        const Imf::Channel* channel = header.channels().findChannel(name);
        if (channel == nullptr || channel->xSampling != 1 || channel->ySampling != 1)
            throw InputError(fmt::format("damaged light field: channel {} is missing or incomplete", name));
    }
}

// Returns a field's version. Throws InputError for other images and unknown versions.
int read_version(const Imf::Header& header) {
    if (header.findTypedAttribute<Imf::IntAttribute>(kVersionName) == nullptr) {
        throw InputError(
            fmt::format("an OpenEXR image, but not a light field: it has no attribute {}", kVersionName));
    }
    const int version = required<Imf::IntAttribute>(header, kVersionName);
    if (version < kEvenBoxes || version > kOfSlab) {
        throw InputError(
            fmt::format("light field version {}; expected {} to {}", version, kEvenBoxes, kOfSlab));
    }
    return version;
}

// Reads the field in a file, or in one part of it.
template <typename In>
LightField read_field(In& in, const Imf::Header& header, int version, std::uintmax_t file_bytes) {
    const Rig rig = read_rig(header, version);
    LightFieldInfo info = read_info(header);
    check_window(header, rig, file_bytes);
    const std::vector<const char*> names = channel_names(header);
    // Counts the images, their coefficients in order, and the field's own.
    require_memory(bytes_of(rig.coefficients(), (2 * names.size() + 2) * sizeof(float)),
                   fmt::format("a light field of {} coefficients", rig.coefficients()),
                   "use fewer coefficients");

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

int checked_parts(const std::filesystem::path& file) {
    const ExrParts parts = check_exr_header(file);
    if (!parts.scan_lines) throw InputError("not a light field: its pixels are not in scan lines");
    return parts.count;
}

LightField read_single_field(const std::filesystem::path& file) {
    if (checked_parts(file) > 1)
        throw InputError("an OpenEXR file of several parts; expected a single light field");
    Imf::InputFile in(file.c_str());
    const int version = read_version(in.header());
    if (version == kOfSlab)
        throw InputError("a lamp with slabs on several sides; expected a single light field");
    return read_field(in, in.header(), version, std::filesystem::file_size(file));
}

// Holds what each part of a lumigraph states about the lamp.
struct SlabHeader {
    SlabAxes axes;
    int slabs = 0;
    Box3d box;
};

SlabHeader read_slab_header(const Imf::Header& header) {
    SlabHeader slab;
    slab.axes.u = required<Imf::V3dAttribute>(header, "lightfieldAxisU");
    slab.axes.v = required<Imf::V3dAttribute>(header, "lightfieldAxisV");
    slab.axes.n = required<Imf::V3dAttribute>(header, "lightfieldAxisN");
    slab.slabs = required<Imf::IntAttribute>(header, "lightfieldSlabs");
    slab.box = Box3d(required<Imf::V3dAttribute>(header, "lightfieldBoxMin"),
                     required<Imf::V3dAttribute>(header, "lightfieldBoxMax"));
    if (const std::string fault = slab.axes.fault(); !fault.empty())
        throw InputError("damaged light field: " + fault);
    return slab;
}

// Reads the parts of a lumigraph and checks that their headers agree.
class SlabReader {
  public:
    SlabReader(int parts, std::uintmax_t file_bytes) : parts_(parts), bytes_(file_bytes) {}

    template <typename In>
    void read(In& in, const Imf::Header& header, int part) {
        const int version = read_version(header);
        if (version != kOfSlab) {
            throw InputError(fmt::format("damaged light field: part {} has version {}, and slabs have {}",
                                         part, version, kOfSlab));
        }
        const SlabHeader slab = read_slab_header(header);
        if (slab.slabs != parts_) {
            throw InputError(fmt::format("damaged light field: {} parts, and part {} says there are {} slabs",
                                         parts_, part, slab.slabs));
        }
        if (part > 0 && (slab.box.min != box_.min || slab.box.max != box_.max))
            throw InputError("damaged light field: its parts say that the lamp's box is in different places");
        box_ = slab.box;
        slabs_.push_back({slab.axes, read_field(in, header, version, bytes_)});
        // The file must also be able to hold all coefficients together.
        coefficients_ += slabs_.back().field.rig().coefficients();
        require_packed(coefficients_, bytes_);
    }
    Lumigraph finish() && { return Lumigraph(std::move(slabs_), box_); }

  private:
    int parts_;
    std::uintmax_t bytes_;
    std::size_t coefficients_ = 0;
    Box3d box_;
    std::vector<Slab> slabs_;
};

Lumigraph read_slabs(const std::filesystem::path& file) {
    const bool several = checked_parts(file) > 1;
    const std::uintmax_t bytes = std::filesystem::file_size(file);
    if (!several) {
        Imf::InputFile in(file.c_str());
        const int version = read_version(in.header());
        if (version < kOfSlab) return Lumigraph(read_field(in, in.header(), version, bytes));
        SlabReader reader(1, bytes);
        reader.read(in, in.header(), 0);
        return std::move(reader).finish();
    }
    Imf::MultiPartInputFile in(file.c_str());
    SlabReader reader(in.parts(), bytes);
    for (int part = 0; part < in.parts(); ++part) {
        Imf::InputPart image(in, part);
        reader.read(image, in.header(part), part);
    }
    return std::move(reader).finish();
}

// Adds the file's name to errors.
template <typename Read>
auto reading(const std::filesystem::path& file, Read&& read) {
    require_readable(file);
    try {
        return read(file);
    } catch (const InputError& error) {
        throw InputError({file.string()}, error.what());
    } catch (const std::bad_alloc&) {
        throw InputError({file.string()}, "not enough memory to read it; use fewer coefficients");
    } catch (const std::exception& error) {
        throw InputError({file.string()},
                         std::string("not a readable OpenEXR file: ") + one_line(error.what()));
    }
}

// Holds a field's images as a file stores them: halves of each channel, in the order of the atlas.
struct Images {
    std::vector<const char*> names;
    std::vector<std::vector<half>> pixels;
    V3d scale{1, 1, 1};

    explicit Images(const LightField& field)
        : names(field.coloured() ? std::vector{"X", "Y", "Z"} : std::vector{"Y"}),
          pixels(names.size(), std::vector<half>(field.coefficients().size())) {
        const Atlas atlas{field.rig()};
        for (std::size_t c = 0; c < names.size(); ++c) {
            const int which = names[c][0] - 'X';
            std::optional<LightField> channel;
            if (field.coloured()) channel = field.channel(which);
            const std::span<const float> e = channel ? channel->coefficients() : field.coefficients();
            scale[which] = storage_scale(e);
            atlas.for_each([&](std::size_t i, std::size_t pixel) {
                pixels[c][pixel] = stored_half(e[i], scale[which]);
            });
        }
    }
    Imf::FrameBuffer buffer(std::size_t width) {
        Imf::FrameBuffer all;
        for (std::size_t c = 0; c < names.size(); ++c) {
            all.insert(names[c], Imf::Slice(Imf::HALF, reinterpret_cast<char*>(pixels[c].data()),
                                            sizeof(half), sizeof(half) * width));
        }
        return all;
    }
};

// Calls write(stream) with our own stream, because OpenEXR writes the last bytes where it cannot report
// failure.
template <typename Write>
void write_exr_stream(const std::filesystem::path& file, Write&& write) {
    replace_file(file, [&](const std::filesystem::path& temporary) {
        std::ofstream stream(temporary, std::ios::binary);
        {
            Imf::StdOFStream named(stream, temporary.c_str());
            write(named);
        }
        stream.exceptions(std::ios::badbit | std::ios::failbit);  // throws if the stream has already failed
        stream.close();
    });
}

}  // namespace

void write_light_field(const std::filesystem::path& file, const LightField& field) {
    const Atlas atlas{field.rig()};
    Images images(field);
    write_exr_stream(file, [&](Imf::OStream& stream) {
        Imf::OutputFile out(stream, make_header(field, images.scale));
        out.setFrameBuffer(images.buffer(atlas.width()));
        out.writePixels(static_cast<int>(atlas.height()));
    });
}

void write_lumigraph(const std::filesystem::path& file, const Lumigraph& lamp) {
    if (lamp.simple()) return write_light_field(file, lamp.slabs()[0].field);
    std::vector<Images> images;
    std::vector<Imf::Header> headers;
    for (const Slab& slab : lamp.slabs()) {
        images.emplace_back(slab.field);
        Imf::Header header = make_header(slab.field, images.back().scale);
        header.insert(kVersionName, Imf::IntAttribute(kOfSlab));
        header.insert("lightfieldCoordinateS", Imf::DoubleAttribute(slab.field.rig().s_coordinate.c));
        header.insert("lightfieldCoordinateM", Imf::DoubleAttribute(slab.field.rig().m_coordinate.c));
        header.insert("lightfieldSlabs", Imf::IntAttribute(static_cast<int>(lamp.slabs().size())));
        header.insert("lightfieldAxisU", Imf::V3dAttribute(slab.axes.u));
        header.insert("lightfieldAxisV", Imf::V3dAttribute(slab.axes.v));
        header.insert("lightfieldAxisN", Imf::V3dAttribute(slab.axes.n));
        header.insert("lightfieldBoxMin", Imf::V3dAttribute(lamp.box().min));
        header.insert("lightfieldBoxMax", Imf::V3dAttribute(lamp.box().max));
        header.setName(fmt::format("slab {} {}", headers.size(), slab.axes.name()));
        header.setType(Imf::SCANLINEIMAGE);
        headers.push_back(header);
    }
    // All parts of a file share one display window: that of the largest.
    Imath::Box2i display;
    for (const Imf::Header& header : headers) display.extendBy(header.dataWindow());
    for (Imf::Header& header : headers) header.displayWindow() = display;
    write_exr_stream(file, [&](Imf::OStream& stream) {
        Imf::MultiPartOutputFile out(stream, headers.data(), static_cast<int>(headers.size()));
        for (std::size_t part = 0; part < headers.size(); ++part) {
            const Atlas atlas{lamp.slabs()[part].field.rig()};
            Imf::OutputPart image(out, static_cast<int>(part));
            image.setFrameBuffer(images[part].buffer(atlas.width()));
            image.writePixels(static_cast<int>(atlas.height()));
        }
    });
}

LightField read_light_field(const std::filesystem::path& file) {
    return reading(file, read_single_field);
}

Lumigraph read_lumigraph(const std::filesystem::path& file) {
    return reading(file, read_slabs);
}

}  // namespace lucerna
