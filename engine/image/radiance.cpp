// Reads Radiance pictures (.hdr, .pic): scan lines of four bytes a pixel, three mantissas with one exponent
// [Ward 1991].
//
// The reader follows the header: the order of the axes, the format (RGBE or XYZE), EXPOSURE and COLORCORR,
// by which the numbers were multiplied, and PRIMARIES.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

using Rgbe = std::array<std::uint8_t, 4>;

// Gives the directions in which pixels and scan lines follow each other.
struct Axes {
    bool columns = false;  // scan lines are columns
    bool up = false;       // y rises along the file, so that the bottom comes first
    bool left = false;     // x falls along the file
};

struct RadianceHeader {
    int width = 0, height = 0;
    Axes axes;
    bool xyz = false;
    std::array<double, 3> factor{1, 1, 1};  // products of EXPOSURE and COLORCORR
    std::optional<std::array<float, 8>> primaries;
};

// Returns the numbers of a text that consists of exactly `count` numbers.
template <typename Number, std::size_t count>
std::optional<std::array<Number, count>> numbers_in(std::string_view text) {
    std::array<Number, count> numbers{};
    const auto skip = [&text] { text.remove_prefix(std::min(text.find_first_not_of(" \t\r"), text.size())); };
    for (Number& number : numbers) {
        skip();
        if (text.starts_with('+')) text.remove_prefix(1);
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error != std::errc()) return std::nullopt;
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    }
    skip();
    return text.empty() ? std::optional(numbers) : std::nullopt;
}

// Reads the value of a line "NAME=...". The picture's numbers are divided by the product over all such lines.
template <std::size_t count>
std::array<double, count> factors_in(std::string_view name, std::string_view value) {
    const auto factors = numbers_in<double, count>(value);
    const auto is_factor = [](double f) { return f > 0 && std::isfinite(f); };
    if (!factors || !std::ranges::all_of(*factors, is_factor))
        throw InputError(fmt::format("{}={}; expected {} above 0", name, value,
                                     count == 1 ? "a number" : "three numbers"));
    return *factors;
}

void read_variable(std::string_view line, RadianceHeader& header) {
    const auto value_of = [line](std::string_view name) -> std::optional<std::string_view> {
        if (!line.starts_with(name) || line.size() == name.size() || line[name.size()] != '=')
            return std::nullopt;
        return line.substr(name.size() + 1);
    };
    if (const auto exposure = value_of("EXPOSURE")) {
        for (double& factor : header.factor) factor *= factors_in<1>("EXPOSURE", *exposure)[0];
    } else if (const auto correction = value_of("COLORCORR")) {
        const auto factors = factors_in<3>("COLORCORR", *correction);
        for (std::size_t c = 0; c < 3; ++c) header.factor[c] *= factors[c];
    } else if (const auto primaries = value_of("PRIMARIES")) {
        header.primaries = numbers_in<float, 8>(*primaries);
        if (!header.primaries)
            throw InputError(
                fmt::format("PRIMARIES={}; expected x and y of red, green, blue and white", *primaries));
    } else if (auto format = value_of("FORMAT")) {
        while (format->ends_with(' ') || format->ends_with('\r')) format->remove_suffix(1);
        header.xyz = *format == "32-bit_rle_xyze";
        if (!header.xyz && *format != "32-bit_rle_rgbe")
            throw InputError(fmt::format("FORMAT={}; expected 32-bit_rle_rgbe or 32-bit_rle_xyze", *format));
    }
}

// Reads "-Y 16 +X 32": the axis that changes from line to line comes first. The sign tells whether the
// coordinate rises along the file.
void read_resolution(std::string_view line, RadianceHeader& header) {
    struct Axis {
        char sign = 0, name = 0;
        int pixels = 0;
    };
    std::array<Axis, 2> axes;
    std::string_view rest = line;
    for (Axis& axis : axes) {
        rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
        if (rest.size() < 4) break;
        axis.sign = rest[0], axis.name = rest[1];
        rest.remove_prefix(std::min(rest.find_first_not_of(' ', 2), rest.size()));
        const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), axis.pixels);
        if (error != std::errc()) axis.pixels = 0;
        rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    }
    const auto is_axis = [](const Axis& a) { return (a.sign == '+' || a.sign == '-') && a.pixels > 0; };
    const bool rows = axes[0].name == 'Y' && axes[1].name == 'X',
               columns = axes[0].name == 'X' && axes[1].name == 'Y';
    if (!is_axis(axes[0]) || !is_axis(axes[1]) || (!rows && !columns))
        throw InputError(
            fmt::format("the size \"{}\" is not two axes and their pixels, as in \"-Y 512 +X 1024\"",
                        one_line(line.substr(0, 80))));
    const Axis &x = axes[rows ? 1 : 0], &y = axes[rows ? 0 : 1];
    header.width = x.pixels;
    header.height = y.pixels;
    header.axes = {columns, y.sign == '+', x.sign == '-'};
}

std::string header_line(std::istream& in) {
    constexpr std::size_t kLongest = 1 << 16;
    std::string line;
    for (char c = 0; in.get(c) && c != '\n';) {
        if (line.size() == kLongest) throw InputError("a line of its header does not end");
        line += c;
    }
    if (!in) throw InputError("it ends in its header");
    if (line.ends_with('\r')) line.pop_back();
    return line;
}

RadianceHeader read_header(std::istream& in) {
    RadianceHeader header;
    header_line(in);  // "#?RADIANCE" or the name of another program
    for (std::string line = header_line(in); !line.empty(); line = header_line(in))
        read_variable(line, header);
    read_resolution(header_line(in), header);
    return header;
}

// Unpacks scan lines, whose runs are of each of the four bytes separately, or of whole pixels in old files.
class ScanLines {
  public:
    explicit ScanLines(std::istream& in) : in_(in) {}

    void read(std::span<Rgbe> line) {
        constexpr std::size_t kShortest = 8,
                              kLongest = 0x7FFF;  // pixels of a line that is packed by runs of bytes
        Rgbe first = pixel();
        if (line.size() < kShortest || line.size() > kLongest || first[0] != 2 || first[1] != 2 ||
            first[2] >= 128)
            return read_old(line, first);
        if ((std::size_t{first[2]} << 8 | first[3]) != line.size())
            throw std::runtime_error("a scan line has another length than the picture");
        for (std::size_t c = 0; c < 4; ++c) {
            for (std::size_t at = 0; at < line.size();) {
                std::size_t count = byte();
                const bool run = count > 128;
                if (run) count -= 128;
                if (count == 0 || count > line.size() - at)
                    throw std::runtime_error("a run leaves its scan line");
                const std::uint8_t same = run ? byte() : std::uint8_t{0};
                for (; count > 0; --count) line[at++][c] = run ? same : byte();
            }
        }
    }

  private:
    void read_old(std::span<Rgbe> line, Rgbe next) {
        int shift = 0;  // of the next digits of a count that takes several pixels
        for (std::size_t at = 0; at < line.size();) {
            if (next[0] == 1 && next[1] == 1 && next[2] == 1) {
                const std::size_t count = shift < 32 ? std::size_t{next[3]} << shift : line.size() + 1;
                if (at == 0 || count > line.size() - at)
                    throw std::runtime_error("a run leaves its scan line");
                std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(at), count, line[at - 1]);
                at += count;
                shift += 8;
            } else {
                line[at++] = next;
                shift = 0;
            }
            if (at < line.size()) next = pixel();
        }
    }
    std::uint8_t byte() {
        const int c = in_.rdbuf()->sbumpc();
        if (c == std::char_traits<char>::eof()) throw std::runtime_error("it ends before its last pixel");
        return static_cast<std::uint8_t>(c);
    }
    Rgbe pixel() {
        Rgbe pixel;
        for (std::uint8_t& part : pixel) part = byte();
        return pixel;
    }

    std::istream& in_;
};

class RadianceReader final : public PictureReader {
  public:
    explicit RadianceReader(const std::filesystem::path& file)
        : in_(open_to_read(file)), radiance_(read_header(in_)), pixels_(in_.tellg()) {
        header_.width = radiance_.width;
        header_.height = radiance_.height;
        header_.numbers = PictureNumbers::floats;
        header_.kind = "float";
        header_.bits = 32;
        header_.channels = 3;
        header_.channel_names =
            radiance_.xyz ? std::vector<std::string>{"X", "Y", "Z"} : std::vector<std::string>{"R", "G", "B"};
        header_.integer_channels.assign(3, false);
        if (!radiance_.xyz) header_.chromaticities = radiance_.primaries;
    }

    const PictureHeader& header() const override { return header_; }
    void read(const ChannelRange& /*channels*/, std::span<std::uint8_t> /*out*/) override { refuse_whole(); }
    void read(const ChannelRange& /*channels*/, std::span<std::uint16_t> /*out*/) override { refuse_whole(); }
    void read(const ChannelRange& channels, std::span<float> out) override {
        const auto width = static_cast<std::size_t>(radiance_.width),
                   height = static_cast<std::size_t>(radiance_.height);
        const auto count = static_cast<std::size_t>(channels.end - channels.first);
        assert(out.size() == width * height * count);
        const Axes& axes = radiance_.axes;
        const std::size_t lines = axes.columns ? width : height;
        std::vector<Rgbe> line(axes.columns ? height : width);
        in_.clear();
        in_.seekg(pixels_);
        ScanLines packed(in_);
        for (std::size_t l = 0; l < lines; ++l) {
            packed.read(line);
            for (std::size_t p = 0; p < line.size(); ++p) {
                std::size_t x = axes.columns ? l : p, y = axes.columns ? p : l;
                if (axes.left) x = width - 1 - x;
                if (axes.up) y = height - 1 - y;
                const double scale = std::ldexp(1.0, line[p][3] - 136);
                for (std::size_t c = 0; c < count; ++c) {
                    const std::size_t from = static_cast<std::size_t>(channels.first) + c;
                    out[(y * width + x) * count + c] =
                        line[p][3] == 0 ? 0.0F
                                        : static_cast<float>(line[p][from] * scale / radiance_.factor[from]);
                }
            }
        }
    }

  private:
    [[noreturn]] static void refuse_whole() { throw std::logic_error("a Radiance picture holds floats"); }

    std::ifstream in_;
    RadianceHeader radiance_;
    std::streampos pixels_;
    PictureHeader header_;
};

}  // namespace

std::unique_ptr<PictureReader> open_radiance(const std::filesystem::path& file) {
    return std::make_unique<RadianceReader>(file);
}

}  // namespace lucerna
