// Reads and writes picture files by OpenImageIO. This is part of a shared library that
// engine/image/pictures.cpp loads. It uses no other module but the header pictures.h, and does not
// interpret the numbers.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>

#include <cassert>
#include <fstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "engine/image/pictures.h"
#include "engine/pictures/svg.h"

namespace lucerna {
namespace {

template <typename Number>
constexpr OIIO::TypeDesc::BASETYPE kTypeOf = std::is_same_v<Number, std::uint8_t>    ? OIIO::TypeDesc::UINT8
                                             : std::is_same_v<Number, std::uint16_t> ? OIIO::TypeDesc::UINT16
                                                                                     : OIIO::TypeDesc::FLOAT;

PictureNumbers numbers_of(const OIIO::TypeDesc& type) {
    switch (type.basetype) {
        case OIIO::TypeDesc::UINT8:
            return PictureNumbers::bytes;
        case OIIO::TypeDesc::UINT16:
            return PictureNumbers::words;
        case OIIO::TypeDesc::HALF:
        case OIIO::TypeDesc::FLOAT:
            return PictureNumbers::floats;
        default:
            return type.is_floating_point() ? PictureNumbers::other_floats : PictureNumbers::other_whole;
    }
}

PictureHeader header_of(const OIIO::ImageSpec& spec) {
    PictureHeader header;
    header.width = spec.width;
    header.height = spec.height;
    header.flat = !spec.deep && spec.depth <= 1;
    header.numbers = numbers_of(spec.format);
    header.kind = spec.format.c_str();
    header.bits = spec.get_int_attribute("oiio:BitsPerSample", static_cast<int>(8 * spec.format.basesize()));
    header.channels = spec.nchannels;
    header.channel_names = spec.channelnames;
    for (int c = 0; c < spec.nchannels; ++c)
        header.integer_channels.push_back(!spec.channelformat(c).is_floating_point());
    const auto* stated = spec.find_attribute("chromaticities");
    if (stated && stated->type() == OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8))
        std::copy_n(static_cast<const float*>(stated->data()), 8, header.chromaticities.emplace().begin());
    const auto* profile = spec.find_attribute("ICCProfile");
    if (profile && profile->type().basetype == OIIO::TypeDesc::UINT8) {
        const auto* bytes = static_cast<const std::uint8_t*>(profile->data());
        header.icc_profile.assign(bytes, bytes + profile->type().size());
    }
    return header;
}

class Reader final : public PictureReader {
  public:
    explicit Reader(std::unique_ptr<OIIO::ImageInput> in)
        : in_(std::move(in)), header_(header_of(in_->spec())) {}

    const PictureHeader& header() const override { return header_; }
    void read(const ChannelRange& c, std::span<std::uint8_t> out) override { read_into(c, out); }
    void read(const ChannelRange& c, std::span<std::uint16_t> out) override { read_into(c, out); }
    void read(const ChannelRange& c, std::span<float> out) override { read_into(c, out); }

  private:
    template <typename Number>
    void read_into(const ChannelRange& channels, std::span<Number> out) {
        assert(out.size() == static_cast<std::size_t>(header_.width) *
                                 static_cast<std::size_t>(header_.height) *
                                 static_cast<std::size_t>(channels.end - channels.first));
        if (!in_->read_image(0, 0, channels.first, channels.end, kTypeOf<Number>, out.data()))
            throw std::runtime_error(in_->geterror());
    }

    std::unique_ptr<OIIO::ImageInput> in_;
    PictureHeader header_;
};

class Tiled final : public TiledPicture {
  public:
    Tiled(std::shared_ptr<OIIO::ImageCache> cache, const std::filesystem::path& file,
          const ChannelRange& channels)
        : cache_(std::move(cache)),
          handle_(cache_->get_image_handle(OIIO::ustring(file.string()))),
          channels_(channels) {
        if (!handle_) throw std::runtime_error(cache_->geterror());
    }

    void read(const PictureRegion& box, std::span<std::uint8_t> out) const override { read_into(box, out); }
    void read(const PictureRegion& box, std::span<float> out) const override { read_into(box, out); }

  private:
    template <typename Number>
    void read_into(const PictureRegion& b, std::span<Number> out) const {
        assert(out.size() == static_cast<std::size_t>(b.x1 - b.x0) * static_cast<std::size_t>(b.y1 - b.y0) *
                                 static_cast<std::size_t>(channels_.end - channels_.first));
        if (!cache_->get_pixels(handle_, cache_->get_perthread_info(), 0, 0, b.x0, b.x1, b.y0, b.y1, 0, 1,
                                channels_.first, channels_.end, kTypeOf<Number>, out.data())) {
            throw std::runtime_error(cache_->geterror());
        }
    }

    std::shared_ptr<OIIO::ImageCache> cache_;
    OIIO::ImageCache::ImageHandle* handle_;  // owned by the cache
    ChannelRange channels_;
};

// Makes a private cache, not the one that the library shares among all callers.
class Cache final : public TileCache {
  public:
    explicit Cache(std::size_t bytes)
        : cache_(OIIO::ImageCache::create(false), [](OIIO::ImageCache* c) { OIIO::ImageCache::destroy(c); }) {
        cache_->attribute("max_memory_MB", static_cast<float>(bytes) / (1 << 20));
        cache_->attribute("autotile", 64);
        cache_->attribute("unassociatedalpha", 1);
    }
    std::unique_ptr<const TiledPicture> open(const std::filesystem::path& file,
                                             const ChannelRange& channels) const override {
        return std::make_unique<Tiled>(cache_, file, channels);
    }

  private:
    std::shared_ptr<OIIO::ImageCache> cache_;
};

const char* name_of(PictureFormat format) {
    switch (format) {
        case PictureFormat::png:
            return "png";
        case PictureFormat::tiff:
            return "tiff";
        case PictureFormat::exr:
            break;
    }
    return "openexr";
}

class OpenImageIo final : public Pictures {
  public:
    std::unique_ptr<PictureReader> open(const std::filesystem::path& file, PictureUse use) const override {
        OIIO::ImageSpec how;
        // Colours that are used without alpha must not be darkened by it.
        how.attribute("oiio:UnassociatedAlpha", 1);
        if (use == PictureUse::measurement) how.attribute("oiio:RawColor", 1);
        auto in = OIIO::ImageInput::open(file.string(), &how);
        if (!in) throw std::runtime_error(OIIO::geterror());
        return std::make_unique<Reader>(std::move(in));
    }

    std::unique_ptr<TileCache> tiles(std::size_t bytes) const override {
        return std::make_unique<Cache>(bytes);
    }

    void write(const std::filesystem::path& file, const PictureToWrite& picture) const override {
        // Encodes in memory first, because the writers of PNG and TIFF do not report a full disk.
        auto out = OIIO::ImageOutput::create(name_of(picture.format));
        if (!out) throw std::runtime_error(OIIO::geterror());
        std::vector<unsigned char> bytes;
        OIIO::Filesystem::IOVecOutput memory(bytes);
        if (!out->set_ioproxy(&memory)) throw std::runtime_error(out->geterror());
        std::visit(
            [&](auto values) {
                const OIIO::TypeDesc type = kTypeOf<typename decltype(values)::value_type>;
                OIIO::ImageSpec spec(picture.width, picture.height, picture.channels, type);
                spec.attribute("compression", "zip");
                spec.attribute("oiio:ColorSpace", "Linear");
                assert(values.size() == spec.image_pixels() * static_cast<std::size_t>(spec.nchannels));
                if (!out->open(name_of(picture.format), spec) || !out->write_image(type, values.data()) ||
                    !out->close())
                    throw std::runtime_error(out->geterror());
            },
            picture.values);
        std::ofstream stream(file, std::ios::binary);
        stream.exceptions(std::ios::badbit | std::ios::failbit);
        stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        stream.close();
    }
    DrawnSvg draw_svg(std::string_view svg, double scale, const std::string& font) const override {
        return draw_svg_by_librsvg(svg, scale, font);
    }
};

}  // namespace
}  // namespace lucerna

extern "C" const lucerna::Pictures* lucerna_pictures_4() {
    static const lucerna::OpenImageIo all;
    return &all;
}
