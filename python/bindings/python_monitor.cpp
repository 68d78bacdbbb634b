#include "python/bindings/python_monitor.h"

#include "engine/base/error.h"

namespace lucerna {

namespace py = pybind11;

namespace {

constexpr auto kEvery = std::chrono::milliseconds(50);

}  // namespace

void PythonMonitor::begin(std::string_view phase, std::uint64_t total) {
    {
        const std::lock_guard lock(mutex_);
        if (!phases_.empty()) phases_.back().done = done_;
        phases_.push_back({std::string(phase), total, 0});
        done_ = 0;
    }
    look(true);
}

void PythonMonitor::advance(std::uint64_t units) {
    done_ += units;
    look();
}

void PythonMonitor::end() {
    done_ = phases_.empty() ? 0 : phases_.back().total;
    look(true);
    const std::lock_guard lock(mutex_);
    if (phases_.empty()) return;
    phases_.pop_back();
    done_ = phases_.empty() ? 0 : phases_.back().done;
}

void PythonMonitor::warn(std::string_view line) {
    const std::lock_guard lock(mutex_);
    warnings_.emplace_back(line);
}

bool PythonMonitor::stopped() const {
    look();
    return stopped_;
}

// Lets Python run the handlers of pending signals, and reports progress.
void PythonMonitor::look(bool now) const {
    if (!in_callers_thread() || stopped_ || (!now && Clock::now() < next_look_)) return;
    {
        const py::gil_scoped_acquire locked;
        try {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            speak();
        } catch (...) {
            raised_ = std::current_exception();
            stopped_ = true;
        }
    }
    next_look_ = Clock::now() + kEvery;
}

void PythonMonitor::speak() const {
    if (progress_.is_none()) return;
    PhaseState phase;
    {
        const std::lock_guard lock(mutex_);
        if (phases_.empty()) return;
        phase = phases_.back();
    }
    const double share =
        phase.total > 0 ? std::min(1.0, static_cast<double>(done_) / static_cast<double>(phase.total)) : 0;
    progress_(phase.name, share);
}

void PythonMonitor::pass_warnings() {
    const py::object category = py::module_::import("lucerna").attr("LucernaWarning");
    const py::object warn = py::module_::import("warnings").attr("warn");
    for (const std::string& line : warnings_) {
        // File names may not be UTF-8.
        const auto text = py::reinterpret_steal<py::object>(
            PyUnicode_DecodeUTF8(line.data(), static_cast<Py_ssize_t>(line.size()), "replace"));
        warn(text, category, py::arg("stacklevel") = 2);
    }
    warnings_.clear();
}

Workers workers_of(const std::optional<int>& threads) {
    Workers workers;
    if (!threads) return workers;
    if (*threads < 1 || *threads > 1024)
        throw InputError({"threads"}, fmt::format("{} is not accepted; expected 1 to 1024", *threads));
    workers.threads = *threads;
    return workers;
}

}  // namespace lucerna
