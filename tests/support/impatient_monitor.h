// A monitor that requests a stop once `after` units are done.
#pragma once

#include <atomic>
#include <cstdint>

#include "engine/base/monitor.h"

namespace lucerna::testing {

class ImpatientMonitor : public Monitor {
  public:
    explicit ImpatientMonitor(std::uint64_t after) : after_(after) {}
    void advance(std::uint64_t units) override { done_ += units; }
    bool stopped() const override { return done_ >= after_; }

  private:
    std::uint64_t after_;
    std::atomic<std::uint64_t> done_{0};
};

}  // namespace lucerna::testing
