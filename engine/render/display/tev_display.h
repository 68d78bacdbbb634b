// Shows the image as it converges in tev, a viewer that runs beside the render, by its TCP protocol.
//
// Source: https://github.com/Tom94/tev (include/tev/Ipc.h). A packet consists of its length in bytes,
// including these four, a byte for its type, and its contents; numbers are little-endian, and texts end with
// a zero byte. Two types of packets suffice: one creates an image by name with its channels (4), the other
// updates a rectangle of one channel, row by row (3).
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
    // The viewer lists the image as `name`. Connects when there is an image to show.
    TevDisplay(Endpoint to, std::string name, Monitor& monitor);

    // Sends the changes since the last call, R, G and B. Never throws: if the viewer is absent or lost, it
    // warns and tries again some seconds later.
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
