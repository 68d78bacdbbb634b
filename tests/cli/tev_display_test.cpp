// Displays the image in a viewer, against a server that parses packets as tev does.
#include "engine/render/display/tev_display.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <map>
#include <thread>

#include "engine/base/error.h"
#include "engine/image/image.h"
#include "tests/cli/run_support.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/same_image.h"

namespace lucerna {
namespace tev_display_test {

using ::testing::ElementsAre;
using testing::error_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ListeningMonitor;
using testing::lucerna_run;
using ::testing::SizeIs;

// Reads one packet's contents, strictly.
class Contents {
  public:
    explicit Contents(std::span<const char> bytes) : bytes_(bytes) {}
    template <typename Number>
    Number number() {
        Number value{};
        if (bytes_.size() < sizeof value) throw std::runtime_error("packet too short");
        std::memcpy(&value, bytes_.data(), sizeof value);
        bytes_ = bytes_.subspan(sizeof value);
        return value;
    }
    std::string text() {
        const auto end = std::find(bytes_.begin(), bytes_.end(), '\0');
        if (end == bytes_.end()) throw std::runtime_error("text without an end");
        std::string text(bytes_.begin(), end);
        bytes_ = bytes_.subspan(text.size() + 1);
        return text;
    }
    void end() const {
        if (!bytes_.empty()) throw std::runtime_error("packet too long");
    }

  private:
    std::span<const char> bytes_;
};

// The viewer's side: accepts one connection after the other and keeps the received data.
class Viewer {
  public:
    struct Shown {
        Image image;
        int updates = 0;
    };

    struct Manners {
        int hangs_up_after = -1;  // packets; negative: never
        bool reads = true;
    };

    Viewer() : Viewer(Manners{}) {}
    explicit Viewer(Manners manners) : manners_(manners) {
        listener_ = socket(AF_INET, SOCK_STREAM, 0);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
            listen(listener_, 4) != 0) {
            throw std::runtime_error("no port to listen on");
        }
        socklen_t size = sizeof address;
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
        port_ = ntohs(address.sin_port);
        thread_ = std::thread([this] { serve(); });
    }
    ~Viewer() { close(); }
    // Waits until all sent data has arrived, then stops listening.
    void close() {
        if (!thread_.joinable()) return;
        closing_ = true;
        {
            // This connection comes after all data that others have sent.
            const Connection last(endpoint(), 10);
            thread_.join();
        }
        ::close(listener_);
    }

    Endpoint endpoint() const { return {"127.0.0.1", port_}; }
    std::string word() const { return fmt::format("127.0.0.1:{}", port_); }

    // Valid only after close().
    const std::map<std::string, Shown>& images() const { return images_; }
    const std::vector<std::string>& faults() const { return faults_; }
    int connections() const { return connections_; }

  private:
    void serve() {
        // The last of several waiting connections is that of close().
        for (;;) {
            const int peer = accept(listener_, nullptr, nullptr);
            const bool last = closing_ && nobody_waits();
            if (!last) serve(peer);
            ::close(peer);
            if (last) return;
        }
    }
    void serve(int peer) {
        ++connections_;
        try {
            int packets = 0;
            while (packets != manners_.hangs_up_after && take_packet(peer)) ++packets;
        } catch (const std::exception& error) {
            faults_.emplace_back(error.what());
        }
        while (!manners_.reads && !closing_) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    bool nobody_waits() const {
        pollfd wanted{listener_, POLLIN, 0};
        return poll(&wanted, 1, 100) == 0;
    }
    static bool receive(int peer, char* to, std::size_t size) {
        while (size > 0) {
            const ssize_t got = recv(peer, to, size, 0);
            if (got <= 0) return false;
            to += got;
            size -= static_cast<std::size_t>(got);
        }
        return true;
    }
    bool take_packet(int peer) {
        std::uint32_t length = 0;  // of the packet, including these four bytes
        if (!receive(peer, reinterpret_cast<char*>(&length), sizeof length)) return false;
        if (length < 6 || length > (1U << 24)) throw std::runtime_error("a length that cannot be");
        std::vector<char> bytes(length - sizeof length);
        if (!receive(peer, bytes.data(), bytes.size())) throw std::runtime_error("half a packet");
        Contents contents(bytes);
        const int kind = contents.number<std::uint8_t>();
        if (contents.number<std::uint8_t>() != 0)
            throw std::runtime_error("the viewer is pushed to the front");
        if (kind == 4) {
            create(contents);
        } else if (kind == 3) {
            update(contents);
        } else {
            throw std::runtime_error("a packet of another kind");
        }
        contents.end();
        return true;
    }
    void create(Contents& contents) {
        const std::string name = contents.text();
        const int width = contents.number<std::int32_t>();
        const int height = contents.number<std::int32_t>();
        std::vector<std::string> channels(static_cast<std::size_t>(contents.number<std::int32_t>()));
        for (std::string& channel : channels) channel = contents.text();
        images_[name] = {Image(width, height, channels), 0};
    }
    void update(Contents& contents) {
        Shown& shown = images_.at(contents.text());
        const std::string channel = contents.text();
        const auto& channels = shown.image.channels;
        const auto c = std::find(channels.begin(), channels.end(), channel) - channels.begin();
        const int x0 = contents.number<std::int32_t>(), y0 = contents.number<std::int32_t>();
        const int width = contents.number<std::int32_t>(), height = contents.number<std::int32_t>();
        if (c == std::ssize(channels) || x0 < 0 || y0 < 0 || width < 1 || height < 1 ||
            x0 + width > shown.image.width || y0 + height > shown.image.height) {
            throw std::runtime_error("an update beside the image");
        }
        for (int y = y0; y < y0 + height; ++y) {
            for (int x = x0; x < x0 + width; ++x)
                shown.image.value(x, y, static_cast<int>(c)) = contents.number<float>();
        }
        ++shown.updates;
    }

    Manners manners_;
    int listener_ = -1;
    int port_ = 0;
    std::thread thread_;
    std::atomic<bool> closing_ = false;
    std::map<std::string, Shown> images_;
    std::vector<std::string> faults_;
    int connections_ = 0;
};

// Returns a picture in which every value is different, with a channel that is not for viewers.
Image picture(int width, int height) {
    Image image(width, height, {"R", "G", "B", "variance.R"});
    for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = 1e-3F * static_cast<float>(i) + 1;
    return image;
}

TEST(Display, AnImage_ArrivesAsItIs) {
    Viewer viewer;
    const Image image = picture(150, 70);
    ListeningMonitor monitor;
    {
        TevDisplay display(viewer.endpoint(), "a picture.exr", monitor);
        display.show(image);
    }
    viewer.close();
    EXPECT_THAT(viewer.faults(), IsEmpty());
    EXPECT_THAT(monitor.warnings, IsEmpty());
    ASSERT_TRUE(viewer.images().contains("a picture.exr"));
    const Viewer::Shown& shown = viewer.images().at("a picture.exr");
    EXPECT_THAT(shown.image.channels, ElementsAre("R", "G", "B"));
    ASSERT_EQ(shown.image.width, 150);
    ASSERT_EQ(shown.image.height, 70);
    EXPECT_TRUE(testing::same(shown.image, image));
    EXPECT_EQ(shown.updates, 3 * 3 * 2);  // channels, tiles of 64 pixels across and down
}

TEST(Display, OnlyWhatChanged_IsSentAgain) {
    Viewer viewer;
    Image image = picture(150, 70);
    Monitor silent;
    {
        TevDisplay display(viewer.endpoint(), "p", silent);
        display.show(image);
        image.set_rgb(149, 69, Rgb(7, 8, 9));
        display.show(image);
        display.show(image);
    }
    viewer.close();
    EXPECT_TRUE(testing::same(viewer.images().at("p").image, image));
    EXPECT_EQ(viewer.images().at("p").updates, 18 + 3);
    EXPECT_EQ(viewer.connections(), 1);
}

TEST(Display, ViewerAbsent_IsOneWarning) {
    ListeningMonitor monitor;
    TevDisplay absent({"127.0.0.1", 1}, "p", monitor);
    absent.show(picture(10, 10));
    ASSERT_THAT(monitor.warnings, SizeIs(1));
    EXPECT_THAT(monitor.warnings[0], HasSubstr("127.0.0.1:1: Connection refused (no viewer found)"));
    absent.show(picture(10, 10));
    EXPECT_THAT(monitor.warnings, SizeIs(1)) << "asked again only after a while";
    TevDisplay unknown({"no.such.host.invalid", 14158}, "p", monitor);
    unknown.show(picture(10, 10));
    ASSERT_THAT(monitor.warnings, SizeIs(2));
    EXPECT_THAT(monitor.warnings[1], HasSubstr("no.such.host.invalid:14158: "));
}

TEST(Display, ViewerThatHangsUp_IsAWarning) {
    Viewer viewer(Viewer::Manners{.hangs_up_after = 5});
    ListeningMonitor monitor;
    TevDisplay display(viewer.endpoint(), "p", monitor);
    Image image = picture(400, 300);
    // Data sent just after the viewer closes is lost without an error; the next data causes one.
    for (int i = 0; i < 200 && monitor.warnings.empty(); ++i) {
        for (float& value : image.data) value += 1;
        display.show(image);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ASSERT_THAT(monitor.warnings, SizeIs(1));
    EXPECT_THAT(monitor.warnings[0], HasSubstr("(lost connection to the viewer); the render continues"));
}

TEST(Display, ViewerThatNoLongerReads_IsLeftAfterTwoSeconds) {
    Viewer viewer(Viewer::Manners{.hangs_up_after = 0, .reads = false});
    ListeningMonitor monitor;
    TevDisplay display(viewer.endpoint(), "p", monitor);
    display.show(picture(2000, 2000));  // more than any socket buffer holds
    ASSERT_THAT(monitor.warnings, SizeIs(1));
    EXPECT_THAT(monitor.warnings[0], HasSubstr("no answer for 2 s (lost connection to the viewer)"));
}

TEST(Display, Endpoints_AreReadStrictly) {
    const auto read = [](std::string_view word) {
        return to_string(parse_endpoint({"--display"}, word, 14158));
    };
    EXPECT_EQ(read("localhost"), "localhost:14158");
    EXPECT_EQ(read("10.0.0.7:99"), "10.0.0.7:99");
    EXPECT_EQ(read(":99"), "127.0.0.1:99");
    EXPECT_EQ(read("[::1]"), "[::1]:14158");
    EXPECT_EQ(read("[::1]:99"), "[::1]:99");
    for (const char* bad : {"", "a:", "a:0", "a:65536", "a:x", "::1", "[::1", "[]:9", "[::1]9", "a:1:2"}) {
        EXPECT_THAT(error_of([&] { read(bad); }), HasSubstr("--display: ")) << bad;
    }
}

using RenderToDisplay = testing::RunTest;

TEST_F(RenderToDisplay, FinalImage_IsTheFile) {
    Viewer viewer;
    const auto outcome = lucerna_run(
        {"render", "scene.pbrt", "--resolution", "90x70", "-o", "a.exr", "--display", viewer.word()});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    viewer.close();
    EXPECT_THAT(viewer.faults(), IsEmpty());
    ASSERT_TRUE(viewer.images().contains("a.exr"));
    EXPECT_TRUE(testing::same(viewer.images().at("a.exr").image, read_exr("a.exr")));
}

TEST_F(RenderToDisplay, NoViewer_WarnsAndRenders) {
    const auto outcome = lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--display", "127.0.0.1:1"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_THAT(outcome.err, HasSubstr("warning: --display: 127.0.0.1:1: "));
    EXPECT_EQ(read_exr("a.exr").width, 12);
}

TEST_F(RenderToDisplay, BadEndpoint_IsRefused) {
    expect_refused({"render", "scene.pbrt", "--display", "a:b:c"}, {"--display", "\"a:b:c\"", "HOST:PORT"});
}

}  // namespace tev_display_test
}  // namespace lucerna
