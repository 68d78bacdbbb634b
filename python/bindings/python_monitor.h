// Communication of long C++ work with Python: progress, warnings, Ctrl-C.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"

namespace lucerna {

// The monitor is constructed and destroyed with the interpreter's lock; in between the work runs without it.
// Only the thread that made the monitor calls Python, several times a second; it takes part in all parallel
// loops.
class PythonMonitor : public Monitor {
  public:
    // `progress` is None, or is called with the phase's name and the share of it that is done, 0 to 1.
    explicit PythonMonitor(pybind11::object progress) : progress_(std::move(progress)) {}

    void begin(std::string_view phase, std::uint64_t total) override;
    void advance(std::uint64_t units) override;
    void end() override;
    void warn(std::string_view line) override;
    bool stopped() const override;

    std::uint64_t warnings() const { return warnings_.size(); }
    // Returns what Python raised meanwhile, from a signal handler or `progress`, or null.
    std::exception_ptr raised() const { return raised_; }
    // Issues the warnings in Python as lucerna.LucernaWarning.
    void pass_warnings();

    // Runs work() without the interpreter's lock, then issues the warnings. If Python raised meanwhile,
    // throws that instead of returning the result of work().
    template <typename Work>
    auto run(Work&& work) {
        std::optional<decltype(work())> result = run_to_end(std::forward<Work>(work));
        if (raised_) std::rethrow_exception(raised_);
        return std::move(*result);
    }
    // As above, but leaves what Python raised in raised(). Returns none if work() threw because of it.
    template <typename Work>
    auto run_to_end(Work&& work) {
        std::optional<decltype(work())> result;
        try {
            const pybind11::gil_scoped_release released;
            result.emplace(work());
        } catch (const Stopped&) {
            if (!raised_) throw;
        }
        pass_warnings();
        return result;
    }

  private:
    using Clock = std::chrono::steady_clock;
    struct PhaseState {
        std::string name;
        std::uint64_t total = 0, done = 0;
    };

    bool in_callers_thread() const { return std::this_thread::get_id() == caller_; }
    void look(bool now = false) const;
    void speak() const;

    std::thread::id caller_ = std::this_thread::get_id();
    pybind11::object progress_;
    mutable std::mutex mutex_;
    std::vector<PhaseState> phases_;  // innermost last
    std::atomic<std::uint64_t> done_{0};
    std::vector<std::string> warnings_;
    mutable std::atomic<bool> stopped_{false};
    mutable std::exception_ptr raised_;
    mutable Clock::time_point next_look_{};
};

// None stands for a thread for every processor.
Workers workers_of(const std::optional<int>& threads);

}  // namespace lucerna
