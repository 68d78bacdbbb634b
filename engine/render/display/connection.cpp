#include "engine/render/display/connection.h"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr const char* kThisMachine = "127.0.0.1";

}  // namespace

Endpoint parse_endpoint(const Location& at, std::string_view word, int default_port) {
    const auto refuse = [&] {
        input_error(at, "\"{}\" is not HOST:PORT; expected for example 192.168.0.7:{}, localhost or [::1]:{}",
                    word, default_port, default_port);
    };
    if (word.empty()) refuse();
    std::string_view host = word;
    std::string_view port;
    if (word.front() == '[') {
        const std::size_t end = word.find(']');
        if (end == word.npos) refuse();
        host = word.substr(1, end - 1);
        port = word.substr(end + 1);
        if (host.empty() || (!port.empty() && port.front() != ':')) refuse();
    } else if (const std::size_t colon = word.find(':'); colon != word.npos) {
        host = word.substr(0, colon);
        port = word.substr(colon);
        if (port.find(':', 1) != port.npos) refuse();
    }
    if (port == ":") refuse();
    Endpoint endpoint{host.empty() ? kThisMachine : std::string(host), default_port};
    if (!port.empty()) endpoint.port = static_cast<int>(parse_whole(at, port.substr(1), 1, 65535));
    return endpoint;
}

std::string to_string(const Endpoint& endpoint) {
    const bool colons = endpoint.host.find(':') != std::string::npos;
    return fmt::format(fmt::runtime(colons ? "[{}]:{}" : "{}:{}"), endpoint.host, endpoint.port);
}

Connection::Connection(Endpoint to, double patience) : to_(std::move(to)), patience_(patience) {
    addrinfo hints{};
    hints.ai_family = AF_UNSPEC;
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* first = nullptr;
    const int unknown = getaddrinfo(to_.host.c_str(), std::to_string(to_.port).c_str(), &hints, &first);
    if (unknown != 0) fail(gai_strerror(unknown));
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(first, freeaddrinfo);

    // Connect to the first address that answers.
    std::string cause = "no address";
    for (const addrinfo* at = all.get(); at; at = at->ai_next) {
        socket_ = socket(at->ai_family, at->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, at->ai_protocol);
        if (socket_ < 0) {
            cause = std::strerror(errno);
            continue;
        }
        try {
            if (connect(socket_, at->ai_addr, at->ai_addrlen) == 0) return;
            if (errno != EINPROGRESS) fail(std::strerror(errno));
            wait_until_writable();
            int error = 0;
            socklen_t size = sizeof error;
            getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size);
            if (error == 0) return;
            cause = std::strerror(error);
        } catch (const InputError& error) {
            cause = std::string(error.what()).substr(to_string(to_).size() + 2);
        }
        close(socket_);
        socket_ = -1;
    }
    fail(cause);
}

Connection::~Connection() {
    if (socket_ >= 0) close(socket_);
}

void Connection::send(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        // MSG_NOSIGNAL turns a closed connection into an error like any other.
        const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (sent > 0) {
            bytes = bytes.subspan(static_cast<std::size_t>(sent));
        } else if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
            wait_until_writable();
        } else if (sent < 0 && errno != EINTR) {
            fail(std::strerror(errno));
        }
    }
}

void Connection::wait_until_writable() const {
    pollfd wanted{socket_, POLLOUT, 0};
    // At least 1 ms, and at most what an int holds, 24 days.
    const int milliseconds = static_cast<int>(std::clamp(patience_ * 1000, 1.0, 2e9));
    int ready = 0;
    do {
        ready = poll(&wanted, 1, milliseconds);
    } while (ready < 0 && errno == EINTR);
    if (ready < 0) fail(std::strerror(errno));
    if (ready == 0) fail(fmt::format("no answer for {}", duration_text(patience_)));
}

void Connection::fail(std::string_view cause) const {
    throw InputError({to_string(to_)}, std::string(cause));
}

}  // namespace lucerna
