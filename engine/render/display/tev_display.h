// The image as it converges, in a viewer that runs beside the render: tev, by its TCP protocol.
//
// https://github.com/Tom94/tev (include/tev/Ipc.h). A packet is its length in bytes, its own four included,
// and a byte that says what it is; numbers are little-endian, texts end in a zero byte. Two of its packets do
// all that is needed: an image is created by name with its channels (4), and a rectangle of one channel is
// updated (3), row by row.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/image/image.h"
#include "engine/render/display/connection.h"

namespace lucerna {

inline constexpr int kTevPort = 14158;

class TevDisplay {
  public:
    // `name`: under which the viewer lists the image. Connects when there is something to show.
    TevDisplay(Endpoint to, std::string name, Monitor& monitor);

    // Sends what has changed since the last time, R, G and B. Never throws: a viewer that is absent or lost
    // is a warning, and asked again some seconds later.
    void show(const Image& image);

  private:
    void send(const Image& image);
    void create(const Image& image);
    bool changed(const Image& image, const V2i& begin, const V2i& end) const;
    void update(const Image& image, const V2i& begin, const V2i& end);

    Endpoint to_;
    std::string name_;
    Monitor& monitor_;
    std::unique_ptr<Connection> connection_;
    Image sent_;  // what the viewer shows
    std::chrono::steady_clock::time_point next_try_;
};

}  // namespace lucerna
