// Sends data over TCP to a viewer on this machine or another, which may be slow or disappear.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace lucerna {

struct Endpoint {
    std::string host;  // a name or an address
    int port = 0;
};
// Parses "host:port", "host", ":port", or "[::1]:port" for an address with colons. Without a host it is this
// machine. Throws InputError.
Endpoint parse_endpoint(const Location& at, std::string_view word, int default_port);
std::string to_string(const Endpoint& endpoint);

class Connection {
  public:
    // Both throw InputError with the endpoint and the cause, also if nothing is transferred for `patience` >
    // 0 seconds. (Name resolution has no such limit.)
    Connection(Endpoint to, double patience);
    void send(std::span<const std::byte> bytes);

    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

  private:
    void wait_until_writable() const;
    [[noreturn]] void fail(std::string_view cause) const;

    Endpoint to_;
    double patience_;
    int socket_ = -1;
};

}  // namespace lucerna
