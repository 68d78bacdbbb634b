// A monitor that ends work at a deadline.
#pragma once

#include <cstdint>
#include <string_view>

#include "engine/base/deadline.h"
#include "engine/base/monitor.h"

namespace lucerna {

// Passes everything on to another monitor, and stops work when a deadline has passed, too.
class DeadlineMonitor final : public Monitor {
  public:
    explicit DeadlineMonitor(Monitor& monitor, const Deadline& deadline = {})
        : monitor_(monitor), deadline_(deadline) {}
    void end_at(const Deadline& deadline) { deadline_ = deadline; }
    void begin(std::string_view phase, std::uint64_t total) override { monitor_.begin(phase, total); }
    void advance(std::uint64_t units) override { monitor_.advance(units); }
    void end() override { monitor_.end(); }
    void info(std::string_view line) override { monitor_.info(line); }
    void warn(std::string_view line) override { monitor_.warn(line); }
    bool stopped() const override { return deadline_.passed() || monitor_.stopped(); }

  private:
    Monitor& monitor_;
    Deadline deadline_;
};

}  // namespace lucerna
