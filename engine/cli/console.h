// The monitor that reports to the user.
//
// On a terminal every phase is one line, redrawn in place with the time left. Elsewhere (a file, a pipe, a
// build log) phases are plain lines on `out`, so that `err` has only warnings and errors.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/text/plain_text.h"

namespace lucerna {

struct ConsoleSettings {
    bool terminal = false;                   // `err` is a terminal
    bool quiet = false;                      // warnings only
    const std::atomic<int>* stop = nullptr;  // nonzero once the user asked to stop; may be null
    std::function<double()> seconds;         // clock; empty: the steady clock
};

// advance() and stopped() may be called from any thread; the other functions by one thread at a time.
class ConsoleMonitor : public Monitor {
  public:
    ConsoleMonitor(std::ostream& out, std::ostream& err, ConsoleSettings settings);
    // Reports how often warnings were repeated.
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
        std::uint64_t total = 0;  // 0: unknown
        std::uint64_t done = 0;   // saved while an inner phase runs
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
    std::atomic<double> next_report_{0};  // phases are not examined before this time
    bool bar_shown_ = false;
    std::map<std::string, std::uint64_t, std::less<>> said_;
    std::uint64_t warnings_ = 0;
};

// The only way from the commands to standard output, which makes all output plain text.
class PlainBuffer : public std::streambuf {
  public:
    explicit PlainBuffer(std::ostream& to) : to_(to) {}
    ~PlainBuffer() override {
        if (held_.empty()) return;
        try {
            to_ << plain_text(held_);
        } catch (const std::exception&) {  // incomplete character on a failed stream: nothing is lost
        }
    }
    PlainBuffer(const PlainBuffer&) = delete;
    PlainBuffer& operator=(const PlainBuffer&) = delete;

  private:
    int_type overflow(int_type c) override {
        if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
        const char one = traits_type::to_char_type(c);
        return xsputn(&one, 1) == 1 ? c : traits_type::eof();
    }
    std::streamsize xsputn(const char* text, std::streamsize count) override {
        held_.append(text, static_cast<std::size_t>(count));
        // A character may arrive in pieces.
        const std::size_t whole = held_.size() - unfinished_bytes(held_);
        to_ << plain_text(std::string_view(held_).substr(0, whole));
        held_.erase(0, whole);
        return to_ ? count : 0;
    }
    int sync() override { return to_.flush() ? 0 : -1; }

    std::ostream& to_;
    std::string held_;
};

// Writes plain_text() of its input to another stream, which must outlive it.
class PlainStream : public std::ostream {
  public:
    explicit PlainStream(std::ostream& to) : std::ostream(nullptr), buffer_(to) {
        rdbuf(&buffer_);
        exceptions(to.exceptions());
    }

  private:
    PlainBuffer buffer_;
};

}  // namespace lucerna
