// How long work speaks to whoever waits for it. Passed by reference; only the console prints.
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>
#include <string>
#include <string_view>

#include "engine/base/error.h"

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

// Work that ended because the user asked it to, and gave up what it was making.

// Thrown where Monitor::stopped() was heard and there is nothing whole to give back. A command that ends with
// it has an exit code of its own.
class Stopped : public InputError {
  public:
    using InputError::InputError;
};

// How long a phase took, for the statistics.

// Runs from its construction.
class Stopwatch {
  public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Of all threads of this process, since it was made: what they worked, not what they waited.
class ProcessorStopwatch {
  public:
    double seconds() const { return now() - start_; }

  private:
    static double now() {
        std::timespec time{};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
        return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
    }
    double start_ = now();
};

}  // namespace lucerna
