// How long work speaks to whoever waits for it. Passed by reference; only the console prints.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lucerna {

// The default is a monitor that says nothing and never stops: what tests and libraries use.
// Calls to advance() and stopped() may come from any thread; the others come from one.
class Monitor {
  public:
    virtual ~Monitor() = default;

    virtual void begin(std::string_view /*phase*/, std::uint64_t /*total units*/) {}
    virtual void advance(std::uint64_t /*units*/) {}
    virtual void end() {}
    virtual void info(std::string_view /*line*/) {}
    virtual void warn(std::string_view /*line*/) {}
    // True once the user asked to stop: finish the unit at hand, keep what there is.
    virtual bool stopped() const { return false; }
};

// Ends the phase when it goes out of scope, also on an exception.
class Phase {
  public:
    Phase(Monitor& monitor, std::string_view name, std::uint64_t total) : monitor_(monitor) {
        monitor_.begin(name, total);
    }
    ~Phase() { monitor_.end(); }
    Phase(const Phase&) = delete;
    Phase& operator=(const Phase&) = delete;

    void advance(std::uint64_t units) { monitor_.advance(units); }

  private:
    Monitor& monitor_;
};

}  // namespace lucerna
