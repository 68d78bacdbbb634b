#include "engine/render/display/tev_display.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little-endian");

constexpr std::uint8_t kUpdateImage = 3;
constexpr std::uint8_t kCreateImage = 4;

constexpr const char* kChannels[] = {"R", "G", "B"};
constexpr int kTile = 64;  // pixels, the unit of updates

constexpr double kPatience = 2;                    // seconds to wait for a viewer
constexpr std::chrono::seconds kUntilNextTry{10};  // pause before a lost viewer is tried again

class Packet {
  public:
    explicit Packet(std::uint8_t kind) {
        put(std::uint32_t{0});  // the length, set in finished()
        put(kind);
    }
    template <typename Number>
    void put(Number number) {
        static_assert(std::is_arithmetic_v<Number>);
        const std::size_t at = bytes_.size();
        bytes_.resize(at + sizeof number);
        std::memcpy(&bytes_[at], &number, sizeof number);
    }
    void put(std::string_view text) {
        for (const char c : text) bytes_.push_back(static_cast<std::byte>(c));
        bytes_.push_back(std::byte{0});
    }
    std::span<const std::byte> finished() {
        const auto length = static_cast<std::uint32_t>(bytes_.size());
        std::memcpy(bytes_.data(), &length, sizeof length);
        return bytes_;
    }

  private:
    std::vector<std::byte> bytes_;
};

}  // namespace

TevDisplay::TevDisplay(Endpoint to, std::string name, Monitor& monitor)
    : to_(std::move(to)), name_(std::move(name)), monitor_(monitor) {}

void TevDisplay::show(const Image& image) {
    if (image.space) return show(brought_to_srgb(image, true));  // the viewer assumes sRGB
    if (!connection_ && std::chrono::steady_clock::now() < next_try_) return;
    try {
        send(image);
    } catch (const InputError& error) {
        const bool lost = connection_ != nullptr;
        connection_.reset();
        next_try_ = std::chrono::steady_clock::now() + kUntilNextTry;
        monitor_.warn(fmt::format("--display: {} ({}); the render continues", error.what(),
                                  lost ? "lost connection to the viewer" : "no viewer found"));
    }
}

void TevDisplay::send(const Image& image) {
    if (!connection_) {
        auto connection = std::make_unique<Connection>(to_, kPatience);
        connection_ = std::move(connection);
        create(image);
    }
    for (int y = 0; y < image.height; y += kTile) {
        for (int x = 0; x < image.width; x += kTile) {
            const V2i begin(x, y);
            const V2i end(std::min(x + kTile, image.width), std::min(y + kTile, image.height));
            if (changed(image, begin, end)) update(image, begin, end);
        }
    }
    sent_ = image;
}

// Creates the image in the viewer, black everywhere.
void TevDisplay::create(const Image& image) {
    Packet packet(kCreateImage);
    packet.put(std::uint8_t{0});  // the viewer stays in the background
    packet.put(std::string_view(name_));
    packet.put(std::int32_t{image.width});
    packet.put(std::int32_t{image.height});
    packet.put(std::int32_t{std::size(kChannels)});
    for (const char* channel : kChannels) packet.put(std::string_view(channel));
    connection_->send(packet.finished());
    sent_ = Image(image.width, image.height, image.channels);
}

bool TevDisplay::changed(const Image& image, const V2i& begin, const V2i& end) const {
    for (int y = begin.y; y < end.y; ++y) {
        for (int x = begin.x; x < end.x; ++x) {
            if (image.rgb_at(x, y) != sent_.rgb_at(x, y)) return true;
        }
    }
    return false;
}

void TevDisplay::update(const Image& image, const V2i& begin, const V2i& end) {
    for (int c = 0; c < static_cast<int>(std::size(kChannels)); ++c) {
        Packet packet(kUpdateImage);
        packet.put(std::uint8_t{0});
        packet.put(std::string_view(name_));
        packet.put(std::string_view(kChannels[c]));
        for (const int number : {begin.x, begin.y, end.x - begin.x, end.y - begin.y})
            packet.put(std::int32_t{number});
        for (int y = begin.y; y < end.y; ++y) {
            for (int x = begin.x; x < end.x; ++x) packet.put(image.value(x, y, c));
        }
        connection_->send(packet.finished());
    }
}

}  // namespace lucerna
