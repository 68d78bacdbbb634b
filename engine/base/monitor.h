// Long work reports progress to a Monitor. It is passed by reference; only the console prints.
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace lucerna {

// The default monitor is silent and never stops work, which suits tests and libraries. Any thread may call
// advance() and stopped(); only one thread calls the other functions.
class Monitor {
  public:
    virtual ~Monitor() = default;

    virtual void begin(std::string_view /*phase*/, std::uint64_t /*total units*/) {}
    virtual void advance(std::uint64_t /*units*/) {}
    virtual void end() {}
    virtual void info(std::string_view /*line*/) {}
    virtual void warn(std::string_view /*line*/) {}
    // Returns true once the user asked to stop: finish the present unit and keep the results.
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

// Reports that the user stopped work before it had any complete result to return: thrown where
// Monitor::stopped() was true. A command that ends with it has an exit code of its own.
class Stopped : public InputError {
  public:
    using InputError::InputError;
};

// Measures wall-clock time since its construction, for statistics.
class Stopwatch {
  public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Measures the processor time of all threads of this process since its construction, without waiting.
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
