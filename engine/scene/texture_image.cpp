#include "engine/scene/texture_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/colour/colour_space.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

[[noreturn]] void unreadable(const std::filesystem::path& file, const std::string& why) {
    throw InputError({file.string()}, "not a readable image: " + one_line(why));
}

// Holds the properties that a file states.
struct Header {
    int width, height;
    PictureChannels channels;
    bool whole_numbers;
    bool bytes;
    std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
    std::size_t values() const { return pixels() * static_cast<std::size_t>(channels.count); }
    // Returns the number of values read, including unwanted channels between the wanted ones.
    std::size_t read_values() const {
        return pixels() * static_cast<std::size_t>(channels.range.end - channels.range.first);
    }
    Header part(int w, int h) const { return {w, h, channels, whole_numbers, bytes}; }
};

Header header_of(const std::filesystem::path& file, const PictureHeader& spec) {
    if (!is_credible(file, spec)) {
        throw InputError({file.string()},
                         fmt::format("image size {} × {} is not plausible", spec.width, spec.height));
    }
    if (spec.channels < 1) throw InputError({file.string()}, "the image has no channels");
    const PictureChannels channels = colour_channels(spec);
    for (int c = channels.range.first; c < channels.range.end; ++c) {
        const bool integer = spec.integer_channels[static_cast<std::size_t>(c)];
        // Integers of other types have no largest value that stands for white.
        const bool known = spec.numbers == PictureNumbers::bytes || spec.numbers == PictureNumbers::words;
        if (integer && !known) {
            input_error({file.string()},
                        "channel {} holds integers ({}); expected half, float, or integers of 8 or 16 bits "
                        "without a sign",
                        spec.channel_names[static_cast<std::size_t>(c)], spec.kind);
        }
    }
    return {spec.width, spec.height, channels, are_whole(spec.numbers),
            spec.numbers == PictureNumbers::bytes};
}

// Turns an exception of the picture library into an InputError about the file.
template <typename Work>
auto with_input_errors(const std::filesystem::path& file, Work&& work) {
    try {
        return work();
    } catch (const std::runtime_error& error) {
        unreadable(file, error.what());
    }
}

// Moves the wanted channels of each pixel together, in their order, within the same memory.
template <typename Stored>
void pick_channels(const PictureChannels& channels, std::span<Stored> values) {
    if (channels.in_order()) return;
    const auto read = static_cast<std::size_t>(channels.range.end - channels.range.first);
    const auto count = static_cast<std::size_t>(channels.count);
    for (std::size_t pixel = 0; pixel < values.size() / read; ++pixel) {
        std::array<Stored, 3> picked{};
        for (std::size_t c = 0; c < count; ++c)
            picked[c] = values[pixel * read + static_cast<std::size_t>(channels.place[c])];
        std::copy_n(picked.begin(), count, &values[pixel * count]);
    }
}

// `copies` is the number of float RGB images that the caller makes of the values.
template <typename Stored>
std::vector<Stored> read_values(PictureReader& in, const Header& header, const std::filesystem::path& file,
                                int copies = 0) {
    require_memory(header.read_values() * sizeof(Stored) +
                       header.pixels() * 3 * sizeof(float) * static_cast<unsigned>(copies),
                   fmt::format("{}: an image of {} x {} pixels", file.string(), header.width, header.height),
                   "use fewer pixels");
    std::vector<Stored> values(header.read_values());
    with_input_errors(file, [&] { in.read(header.channels.range, std::span(values)); });
    pick_channels(header.channels, std::span(values));
    values.resize(header.values());
    return values;
}

// Tracks the range of values, and rejects those that are not finite or negative.
class RangeFinder {
  public:
    RangeFinder(const std::filesystem::path& file, int width, int channels)
        : file_(file),
          width_(static_cast<std::size_t>(width)),
          channels_(static_cast<std::size_t>(channels)) {}

    void add(float value) {
        if (!(value >= 0) || !std::isfinite(value)) {
            const std::size_t pixel = count_ / channels_;
            throw InputError({file_.string()},
                             fmt::format("pixel ({}, {}) holds {}; expected finite values, not negative",
                                         pixel % width_, pixel / width_, value));
        }
        range_.least = std::min(range_.least, value);
        range_.most = std::max(range_.most, value);
        ++count_;
    }
    ValueRange range() const { return range_; }

  private:
    const std::filesystem::path& file_;
    std::size_t width_, channels_, count_ = 0;
    ValueRange range_{std::numeric_limits<float>::max(), 0};
};

Rgb rgb_of(const float* values, int channels) {
    return channels == 1 ? Rgb(values[0]) : Rgb(values[0], values[1], values[2]);
}

std::array<float, 256> decoded_bytes(const Encoding& encoding) {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = encoding.decode(static_cast<float>(i) / 255);
    return table;
}

// Holds texels in memory: bytes, decoded by a table, or floats.
template <typename Stored>
class MemoryTexels final : public Texels {
  public:
    MemoryTexels(const Header& header, std::vector<Stored> values, const Encoding& encoding,
                 const std::filesystem::path& file)
        : header_(header), values_(std::move(values)), table_(decoded_bytes(encoding)) {
        RangeFinder finder(file, header.width, header.channels.count);
        for (Stored& value : values_) {
            if constexpr (std::is_same_v<Stored, float>) {
                if (header.whole_numbers) value = encoding.decode(value);
            }
            finder.add(decoded(value));
        }
        range_ = finder.range();
    }

    int width() const override { return header_.width; }
    int height() const override { return header_.height; }
    ValueRange range() const override { return range_; }
    std::array<Rgb, 4> square(const TexelSquare& at) const override {
        return {texel(at.x[0], at.y[0]), texel(at.x[1], at.y[0]), texel(at.x[0], at.y[1]),
                texel(at.x[1], at.y[1])};
    }
    void prefetch(const TexelSquare& at) const override {
        for (const int y : at.y) __builtin_prefetch(&values_[place(at.x[0], y)]);
    }

  private:
    // Returns the index of a texel's first value.
    std::size_t place(int x, int y) const {
        const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(header_.width) +
                                  static_cast<std::size_t>(x);
        return pixel * static_cast<std::size_t>(header_.channels.count);
    }
    float decoded(Stored value) const {
        if constexpr (std::is_same_v<Stored, float>) {
            return value;
        } else {
            return table_[value];
        }
    }
    Rgb texel(int x, int y) const {
        const Stored* v = &values_[place(x, y)];
        if (header_.channels.count == 1) return Rgb(decoded(v[0]));
        return {decoded(v[0]), decoded(v[1]), decoded(v[2])};
    }

    Header header_;
    std::vector<Stored> values_;  // rows from the top, channels interleaved
    std::array<float, 256> table_;
    ValueRange range_;
};

class ImageTexels final : public Texels {
  public:
    explicit ImageTexels(std::shared_ptr<const Image> image) : image_(std::move(image)) {
        const auto [least, most] = std::minmax_element(image_->data.begin(), image_->data.end());
        range_ = {*least, *most};
    }
    int width() const override { return image_->width; }
    int height() const override { return image_->height; }
    ValueRange range() const override { return range_; }
    std::array<Rgb, 4> square(const TexelSquare& at) const override {
        return {image_->rgb_at(at.x[0], at.y[0]), image_->rgb_at(at.x[1], at.y[0]),
                image_->rgb_at(at.x[0], at.y[1]), image_->rgb_at(at.x[1], at.y[1])};
    }

  private:
    std::shared_ptr<const Image> image_;
    ValueRange range_;
};

// Reads texels from the cache at each access, and decodes them as MemoryTexels does.
class CachedTexels final : public Texels {
  public:
    CachedTexels(const TileCache& cache, const std::filesystem::path& file, const Header& header,
                 const Encoding& encoding)
        : file_(file),
          picture_(with_input_errors(file, [&] { return cache.open(file, header.channels.range); })),
          header_(header),
          encoding_(encoding),
          table_(decoded_bytes(encoding)) {
        // Reads the whole image once, in bands of tiles, to find its range and its faults.
        RangeFinder finder(file_, header.width, header.channels.count);
        std::vector<float> band;
        for (int y = 0; y < header.height; y += kBand) {
            const int end = std::min(header.height, y + kBand);
            band.resize(header.part(header.width, end - y).values());
            read(0, header.width, y, end, band.data());
            for (const float value : band) finder.add(value);
        }
        range_ = finder.range();
    }

    int width() const override { return header_.width; }
    int height() const override { return header_.height; }
    ValueRange range() const override { return range_; }

    std::array<Rgb, 4> square(const TexelSquare& at) const override {
        std::array<float, 12> v{};
        const int n = header_.channels.count;
        if (at.x[1] == at.x[0] + 1 && at.y[1] == at.y[0] + 1) {  // all squares but those at edges
            read(at.x[0], at.x[0] + 2, at.y[0], at.y[0] + 2, v.data());
        } else {
            for (int i = 0; i < 4; ++i) {
                const int x = at.x[i % 2], y = at.y[i / 2];
                read(x, x + 1, y, y + 1, v.data() + n * i);
            }
        }
        return {rgb_of(v.data(), n), rgb_of(v.data() + n, n), rgb_of(v.data() + 2 * n, n),
                rgb_of(v.data() + 3 * n, n)};
    }

  private:
    static constexpr int kBand = 64;

    void read(int x0, int x1, int y0, int y1, float* out) const {
        const PictureRegion box{x0, x1, y0, y1};
        const Header part = header_.part(x1 - x0, y1 - y0);
        if (header_.bytes) {
            read_into<std::uint8_t>(box, part, [&](std::size_t i, std::uint8_t v) { out[i] = table_[v]; });
        } else {
            read_into<float>(box, part, [&](std::size_t i, float v) {
                out[i] = header_.whole_numbers ? encoding_.decode(v) : v;
            });
        }
    }
    template <typename Stored, typename Put>
    void read_into(const PictureRegion& box, const Header& part, Put&& put) const {
        std::array<Stored, 16> few;
        std::vector<Stored> many(part.read_values() > few.size() ? part.read_values() : 0);
        const std::span<Stored> values(many.empty() ? few.data() : many.data(), part.read_values());
        with_input_errors(file_, [&] { picture_->read(box, values); });
        pick_channels(part.channels, values);
        for (std::size_t i = 0; i < part.values(); ++i) put(i, values[i]);
    }

    std::filesystem::path file_;
    std::unique_ptr<const TiledPicture> picture_;
    Header header_;
    Encoding encoding_;
    std::array<float, 256> table_;
    ValueRange range_;
};

StatedColours colours_of(const std::filesystem::path& file, const PictureHeader& header,
                         const PictureWarning& warn) {
    try {
        StatedColours stated = stated_colours(header);
        if (warn && !stated.ignored.empty()) warn(fmt::format("{}: {}", file.string(), stated.ignored));
        return stated;
    } catch (const InputError& error) {
        throw InputError({file.string()}, error.what());
    }
}

// Converts a file's colours to ratios of a working space.
class Conversion {
  public:
    Conversion(const ColourSpace& from, const WorkingSpace& to)
        : matrix_(to.from(from)), weights_(V3d(to.weights())) {
        for (const V3d& row : matrix_.rows) {
            inside_ = inside_ && row.x >= 0 && row.y >= 0 && row.z >= 0;
            most_ = std::max(most_, std::max(0.0, row.x) + std::max(0.0, row.y) + std::max(0.0, row.z));
            keeps_grey_ = keeps_grey_ && std::fabs(row.x + row.y + row.z - 1) < 1e-4;
        }
    }
    // Returns none if no conversion is needed.
    static std::optional<Conversion> of(const std::optional<ColourSpace>& stated, const WorkingSpace& to) {
        const ColourSpace& from = stated ? *stated : colour_spaces().front();
        if (!from.name.empty() && from.name == to.name()) return std::nullopt;
        return Conversion(from, to);
    }

    Rgb operator()(const Rgb& c) const {
        if (keeps_grey_ && c.x == c.y && c.y == c.z) return c;
        return Rgb(held_in_gamut(matrix_ * V3d(c), weights_));
    }
    ValueRange operator()(const ValueRange& range) const {
        if (inside_ && keeps_grey_) return range;  // the results are means of the channels
        return {0, range.most * static_cast<float>(most_)};
    }
    // Means stay within the range of their arguments except for rounding.
    Rgb within(const ValueRange& range, const Rgb& c) const {
        const Rgb made = (*this)(c);
        if (!inside_ || !keeps_grey_) return made;
        return {std::clamp(made.x, range.least, range.most), std::clamp(made.y, range.least, range.most),
                std::clamp(made.z, range.least, range.most)};
    }

  private:
    RgbMatrix matrix_;
    V3d weights_;
    bool inside_ = true;      // the file's gamut is within the working space's
    bool keeps_grey_ = true;  // true for every space but CIE XYZ
    double most_ = 1;         // largest component that a colour up to 1 becomes
};

// Converts at each access, so that bytes stay bytes in memory.
class ConvertedTexels final : public Texels {
  public:
    ConvertedTexels(std::shared_ptr<const Texels> of, const Conversion& conversion)
        : of_(std::move(of)), conversion_(conversion), before_(of_->range()), range_(conversion(before_)) {}

    int width() const override { return of_->width(); }
    int height() const override { return of_->height(); }
    ValueRange range() const override { return range_; }
    std::array<Rgb, 4> square(const TexelSquare& at) const override {
        std::array<Rgb, 4> texels = of_->square(at);
        for (Rgb& texel : texels) texel = conversion_.within(before_, texel);
        return texels;
    }
    void prefetch(const TexelSquare& at) const override { of_->prefetch(at); }

  private:
    std::shared_ptr<const Texels> of_;
    Conversion conversion_;
    ValueRange before_, range_;
};

}  // namespace

TextureImages::TextureImages(const TextureMemory& memory) : memory_(memory) {}
TextureImages::~TextureImages() = default;

std::shared_ptr<const Texels> TextureImages::open(const std::filesystem::path& file, const Encoding& encoding,
                                                  const std::optional<WorkingSpace>& colours,
                                                  const PictureWarning& warn) {
    const Opened numbers = open_numbers(file, encoding, warn);
    if (!colours) return numbers.texels;
    const auto conversion = Conversion::of(numbers.space, *colours);
    if (!conversion) return numbers.texels;
    return std::make_shared<ConvertedTexels>(numbers.texels, *conversion);
}

TextureImages::Opened TextureImages::open_numbers(const std::filesystem::path& file, const Encoding& asked,
                                                  const PictureWarning& warn) {
    Opened& opened =
        opened_[fmt::format("{} {} {}", static_cast<int>(asked.kind), asked.exponent, file.string())];
    std::shared_ptr<const Texels>& known = opened.texels;
    if (known) return opened;
    OpenedPicture in = open_picture(file, PictureUse::colour);
    const Header header = header_of(file, in.header);
    Encoding encoding = asked;
    if (asked.kind == Encoding::Kind::of_file || !header.whole_numbers) {
        const StatedColours stated = colours_of(file, in.header, warn);
        encoding = stated.encoding;
        if (header.channels.count == 3) opened.space = stated.space;
    }
    const std::size_t bytes = header.values() * (header.bytes ? 1 : sizeof(float));
    const bool fits = bytes <= memory_.one && bytes <= memory_.all - std::min(in_memory_, memory_.all);
    if (!fits && in.tiled) {
        in.reader.reset();
        if (!cache_) cache_ = pictures(file).tiles(memory_.cache);
        known = std::make_shared<CachedTexels>(*cache_, file, header, encoding);
    } else if (header.bytes) {
        known = std::make_shared<MemoryTexels<std::uint8_t>>(
            header, read_values<std::uint8_t>(*in.reader, header, file), encoding, file);
        in_memory_ += bytes;
    } else {
        known = std::make_shared<MemoryTexels<float>>(header, read_values<float>(*in.reader, header, file),
                                                      encoding, file);
        in_memory_ += bytes;
    }
    return opened;
}

std::shared_ptr<const Texels> texels_of(std::shared_ptr<const Image> image) {
    return std::make_shared<ImageTexels>(std::move(image));
}

std::shared_ptr<const Image> read_texture_image(const std::filesystem::path& file,
                                                const WorkingSpace& colours, const PictureWarning& warn) {
    const OpenedPicture in = open_picture(file, PictureUse::colour);
    const Header header = header_of(file, in.header);
    const StatedColours stated = colours_of(file, in.header, warn);
    // The second copy is the image's sampling distribution.
    const std::vector<float> stored = read_values<float>(*in.reader, header, file, 2);
    auto image = std::make_shared<Image>(Image::rgb(header.width, header.height));
    RangeFinder finder(file, header.width, header.channels.count);
    const auto channels = static_cast<std::size_t>(header.channels.count);
    for (std::size_t i = 0; i < stored.size(); ++i) {
        const float value = header.whole_numbers ? stated.encoding.decode(stored[i]) : stored[i];
        finder.add(value);
        if (channels == 1) {
            std::fill_n(&image->data[3 * i], 3, value);
        } else {
            image->data[i] = value;
        }
    }
    const auto conversion = channels == 3 ? Conversion::of(stated.space, colours) : std::nullopt;
    for (int y = 0; conversion && y < image->height; ++y) {
        for (int x = 0; x < image->width; ++x)
            image->set_rgb(x, y, conversion->within(finder.range(), image->rgb_at(x, y)));
    }
    return image;
}

}  // namespace lucerna
