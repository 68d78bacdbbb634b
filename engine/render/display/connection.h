// A TCP connection that sends: to a viewer on this machine or another, which may be slow, or go away.
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
// "host:port", "host" or ":port"; "[::1]:port" for an address with colons. No host: this machine. Throws
// InputError.
Endpoint parse_endpoint(const Location& at, std::string_view word, int default_port);
std::string to_string(const Endpoint& endpoint);

class Connection {
  public:
    // Both throw InputError that names the endpoint and the cause, also when nothing moved for `patience`
    // seconds (> 0). (A name is asked for without that limit.)
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
