// The monitor that people see.
//
// On a terminal every phase is one line that is redrawn in place, with the time left. Elsewhere (a file, a
// pipe, a build log) phases are plain lines on `out`, so that `err` carries nothing but warnings and errors.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/monitor.h"

namespace lucerna {

struct ConsoleSettings {
    bool terminal = false;                   // `err` is a terminal
    bool quiet = false;                      // warnings only
    const std::atomic<int>* stop = nullptr;  // not 0 once the user asked to stop; may be null
    std::function<double()> seconds;         // a clock; empty: the steady clock
};

// advance() and stopped() may be called from any thread; the others from one at a time.
class ConsoleMonitor : public Monitor {
  public:
    ConsoleMonitor(std::ostream& out, std::ostream& err, ConsoleSettings settings);
    // Says how often warnings came again.
    ~ConsoleMonitor() override;
    ConsoleMonitor(const ConsoleMonitor&) = delete;
    ConsoleMonitor& operator=(const ConsoleMonitor&) = delete;

    void begin(std::string_view phase, std::uint64_t total) override;
    void advance(std::uint64_t units) override;
    void end() override;
    void info(std::string_view line) override;
    void warn(std::string_view line) override;
    bool stopped() const override;

    std::uint64_t warnings() const { return warnings_; }

  private:
    struct PhaseState {
        std::string name;
        std::uint64_t total = 0;  // 0: not known
        std::uint64_t done = 0;   // while an inner phase runs
        double start = 0;
        int tenths_said = 0;
    };

    void report_progress(double now, std::uint64_t done);
    void draw_bar(const PhaseState& phase, double now, std::uint64_t done);
    void clear_bar();

    std::ostream& out_;
    std::ostream& err_;
    ConsoleSettings settings_;
    std::mutex mutex_;
    std::vector<PhaseState> phases_;  // innermost last
    std::atomic<std::uint64_t> done_{0};
    std::atomic<double> next_report_{0};  // no look at the phases before this time
    bool bar_shown_ = false;
    std::map<std::string, std::uint64_t, std::less<>> said_;
    std::uint64_t warnings_ = 0;
};

}  // namespace lucerna
