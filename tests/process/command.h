// Runs the built command as a process: its output, how and when it ends, and signals sent to it in a phase
// that has provably begun.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace lucerna::testing {

struct Finished {
    int code = -1;           // exit code; -1: a signal ended it
    int signal = 0;          // the signal that ended it
    bool waited = false;     // it did not end by itself in time
    double seconds = 0;      // wall-clock time since the signal was sent, or since the start
    double cpu_seconds = 0;  // processor time
    bool sent = false;       // the signal was sent
    std::string out, err;
};

// A signal that is sent once `ready` accepts the text on standard output.
struct SignalAt {
    int signal;
    std::function<bool(const std::string& out)> ready;
    std::function<pid_t(pid_t)> to = [](pid_t started) { return started; };
};

// How to start the command, and how long to wait.
struct Start {
    std::filesystem::path folder = {};
    double patience = 30;                    // seconds, after which it is killed
    std::function<void()> in_child = [] {};  // runs before the command
    std::size_t close_after =
        std::string::npos;                   // bytes of standard output, after which the reader closes it
    std::vector<std::string> launcher = {};  // the program that starts the command, with its options
};

inline bool has_begun(const std::string& out, const std::string& phase) {
    return out.find(phase + " …\n") != out.npos;
}
inline bool has_ended(const std::string& out, const std::string& phase) {
    return out.find("\n" + phase + ": ") != out.npos;
}
// Returns the signal to be sent while the phase is running.
inline SignalAt in_phase(int signal, const std::string& phase) {
    return {signal,
            [phase](const std::string& out) { return has_begun(out, phase) && !has_ended(out, phase); }};
}

class RunningCommand {
  public:
    RunningCommand(const std::vector<std::string>& words, const Start& start) {
        const std::array<int, 2> out = new_pipe(), err = new_pipe();
        std::vector<std::string> all = start.launcher;
        all.push_back(LUCERNA_COMMAND);
        all.insert(all.end(), words.begin(), words.end());
        std::vector<char*> argv;
        for (std::string& word : all) argv.push_back(word.data());
        argv.push_back(nullptr);
        child_ = fork();
        if (child_ < 0) throw std::runtime_error("no process");
        if (child_ == 0) {
            dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
            dup2(out[1], STDOUT_FILENO);
            dup2(err[1], STDERR_FILENO);
            start.in_child();
            if (chdir(start.folder.c_str()) == 0) execvp(argv[0], argv.data());
            _exit(127);
        }
        close(out[1]);
        close(err[1]);
        from_ = {out[0], err[0]};
    }
    ~RunningCommand() {
        for (const int end : from_) {
            if (end >= 0) close(end);
        }
    }
    RunningCommand(const RunningCommand&) = delete;
    RunningCommand& operator=(const RunningCommand&) = delete;

    Finished finish(const Start& start, const SignalAt& when) {
        Finished finished;
        auto since = std::chrono::steady_clock::now();
        const auto elapsed = [&since] {
            return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
        };
        while (from_[0] >= 0 || from_[1] >= 0) {
            const double left = start.patience - elapsed();
            if (left <= 0 && !finished.waited) {
                finished.waited = true;
                kill(child_, SIGKILL);
            }
            std::array<pollfd, 2> both{pollfd{from_[0], POLLIN, 0}, pollfd{from_[1], POLLIN, 0}};
            // `ready` may depend on more than the output: a file that exists.
            const bool looks = when.ready && !finished.sent;
            poll(both.data(), both.size(),
                 finished.waited ? -1
                 : looks         ? 20
                                 : static_cast<int>(left * 1000) + 1);
            take(both[0], 0, finished.out);
            take(both[1], 1, finished.err);
            if (from_[0] >= 0 && finished.out.size() >= start.close_after) shut(0);
            if (when.ready && !finished.sent && when.ready(finished.out)) {
                since = std::chrono::steady_clock::now();
                finished.sent = kill(when.to(child_), when.signal) == 0;
            }
        }
        int status = 0;
        rusage usage{};
        wait4(child_, &status, 0, &usage);
        finished.seconds = elapsed();
        const auto seconds = [](const timeval& t) {
            return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
        };
        finished.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
        if (WIFEXITED(status)) finished.code = WEXITSTATUS(status);
        if (WIFSIGNALED(status)) finished.signal = WTERMSIG(status);
        return finished;
    }

  private:
    static std::array<int, 2> new_pipe() {
        std::array<int, 2> ends{};
        if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
        return ends;
    }
    void shut(std::size_t which) {
        close(from_[which]);
        from_[which] = -1;
    }
    void take(const pollfd& ready, std::size_t which, std::string& to) {
        if (from_[which] < 0 || ready.revents == 0) return;
        std::array<char, 4096> buffer{};
        const ssize_t got = read(from_[which], buffer.data(), buffer.size());
        if (got > 0) to.append(buffer.data(), static_cast<std::size_t>(got));
        if (got <= 0) shut(which);
    }

    pid_t child_ = 0;
    std::array<int, 2> from_{};  // standard output and error; -1: closed
};

inline Finished run_command(const std::vector<std::string>& words, const Start& start,
                            const SignalAt& when = {}) {
    return RunningCommand(words, start).finish(start, when);
}

}  // namespace lucerna::testing
