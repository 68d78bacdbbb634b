#include "engine/cli/console.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <chrono>

#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr double kRedraw = 0.1;                  // seconds between two redraws of the bar
constexpr double kLongPhase = 5;                 // seconds; a plain log reports tenths of longer phases
constexpr int kBarWidth = 30;                    // characters
constexpr std::size_t kDistinctWarnings = 1000;  // remembered, which bounds the memory for distinct warnings

double steady_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double share(std::uint64_t done, std::uint64_t total) {
    return total == 0 ? 0 : std::min(1.0, static_cast<double>(done) / static_cast<double>(total));
}

}  // namespace

ConsoleMonitor::ConsoleMonitor(std::ostream& out, std::ostream& err, ConsoleSettings settings)
    : out_(out), err_(err), settings_(std::move(settings)) {
    if (!settings_.seconds) settings_.seconds = steady_seconds;
}

ConsoleMonitor::~ConsoleMonitor() {
    clear_bar();
    for (const auto& [line, times] : said_) {
        if (times > 1) fmt::print(err_, "lucerna: warning: {} more times: {}\n", times - 1, line);
    }
}

void ConsoleMonitor::begin(std::string_view phase, std::uint64_t total) {
    const std::lock_guard lock(mutex_);
    if (!phases_.empty()) phases_.back().done = done_.load();
    done_ = 0;
    const double now = settings_.seconds();
    phases_.push_back({plain_text(phase), total, 0, now, 0});
    if (settings_.quiet) return;
    if (settings_.terminal) {
        draw_bar(phases_.back(), now, 0);
    } else {
        fmt::print(out_, "{} …\n", phase);
        out_.flush();
    }
    next_report_ = now + kRedraw;
}

void ConsoleMonitor::advance(std::uint64_t units) {
    const std::uint64_t done = done_.fetch_add(units, std::memory_order_relaxed) + units;
    if (settings_.quiet) return;
    const double now = settings_.seconds();
    if (now < next_report_.load(std::memory_order_relaxed)) return;
    // A thread that finds the console busy returns to work, as a later one will report.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || phases_.empty() || now < next_report_.load(std::memory_order_relaxed)) return;
    next_report_ = now + kRedraw;
    report_progress(now, std::max(done, done_.load(std::memory_order_relaxed)));
}

void ConsoleMonitor::report_progress(double now, std::uint64_t done) {
    PhaseState& phase = phases_.back();
    if (settings_.terminal) return draw_bar(phase, now, done);
    const int tenths = static_cast<int>(share(done, phase.total) * 10);
    if (now - phase.start < kLongPhase || tenths <= phase.tenths_said || tenths >= 10) return;
    phase.tenths_said = tenths;
    const double left =
        (now - phase.start) * (1 / share(done, phase.total) - 1);  // tenths > 0, so the share is > 0
    fmt::print(out_, "{}: {} %, about {} left\n", phase.name, tenths * 10, duration_text(left));
    out_.flush();
}

void ConsoleMonitor::draw_bar(const PhaseState& phase, double now, std::uint64_t done) {
    const double part = share(done, phase.total);
    std::string line = phase.name;
    line.resize(std::max<std::size_t>(line.size(), 14), ' ');
    if (phase.total == 0) {
        line += fmt::format(" {}", duration_text(now - phase.start));
    } else {
        const auto full = static_cast<std::size_t>(part * kBarWidth);
        line += fmt::format(" [{}{}] {:3.0f} %", std::string(full, '#'), std::string(kBarWidth - full, '.'),
                            part * 100);
        // An estimate from a smaller part would be unreliable.
        if (part > 0.005)
            line += fmt::format("  {} left", duration_text((now - phase.start) * (1 / part - 1)));
    }
    if (settings_.stop && *settings_.stop != 0) line += "  stopping …";
    fmt::print(err_, "\r{}\x1b[K", line);
    err_.flush();
    bar_shown_ = true;
}

void ConsoleMonitor::clear_bar() {
    if (!bar_shown_) return;
    fmt::print(err_, "\r\x1b[K");
    err_.flush();
    bar_shown_ = false;
}

void ConsoleMonitor::end() {
    const std::lock_guard lock(mutex_);
    if (phases_.empty()) return;
    const PhaseState phase = std::move(phases_.back());
    phases_.pop_back();
    const std::uint64_t done = done_.exchange(phases_.empty() ? 0 : phases_.back().done);
    if (settings_.quiet) return;
    clear_bar();
    const std::string time = duration_text(settings_.seconds() - phase.start);
    const bool cut_short = phase.total > 0 && done < phase.total;
    std::ostream& to = settings_.terminal ? err_ : out_;
    if (cut_short) {
        fmt::print(to, "{}: {}, ended at {:.0f} %\n", phase.name, time, 100 * share(done, phase.total));
    } else {
        fmt::print(to, "{}: {}\n", phase.name, time);
    }
    to.flush();
}

void ConsoleMonitor::info(std::string_view line) {
    const std::lock_guard lock(mutex_);
    if (settings_.quiet) return;
    clear_bar();
    fmt::print(out_, "{}\n", line);
    out_.flush();
}

void ConsoleMonitor::warn(std::string_view line) {
    const std::lock_guard lock(mutex_);
    ++warnings_;
    const std::string text = plain_text(one_line(line));
    const auto known = said_.find(text);
    if (known != said_.end()) {
        ++known->second;
        return;
    }
    if (said_.size() < kDistinctWarnings) said_.emplace(text, 1);
    clear_bar();
    fmt::print(err_, "lucerna: warning: {}\n", text);
    err_.flush();
}

bool ConsoleMonitor::stopped() const {
    return settings_.stop && settings_.stop->load(std::memory_order_relaxed) != 0;
}

}  // namespace lucerna
