// Starts the built command and kills it without warning (SIGKILL) at a verified moment: while a phase is
// running, or while a file is being written.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace lucerna::testing {

// When to kill: at the beginning of the phase (by the command's name for it), or when the temporary file of
// `file` ("*": any file) is created; the `count`-th time, from 1.
struct KillAt {
    std::string phase, file;
    int count = 1;
};

struct Ended {
    int code = 0;           // 128 + the signal if one ended it
    std::string said;       // standard output
    bool killed = false;    // by the test
    bool in_place = false;  // the phase had not ended, or the temporary file existed
    std::vector<std::string> lines() const {
        std::vector<std::string> all;
        for (std::size_t at = 0, end = 0; at < said.size(); at = end + 1) {
            end = std::min(said.find('\n', at), said.size());
            all.push_back(said.substr(at, end - at));
        }
        return all;
    }
};

// Returns the names of the phases that a command reports, in order, each once.
inline std::vector<std::string> phases_of(const Ended& ended) {
    constexpr std::string_view kBegun = " …";
    std::vector<std::string> names;
    for (const std::string& line : ended.lines()) {
        if (!line.ends_with(kBegun)) continue;
        std::string name = line.substr(0, line.size() - kBegun.size());
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(std::move(name));
    }
    return names;
}

// A file descriptor that is closed on destruction.
class Handle {
  public:
    explicit Handle(int number) : number_(number) {
        if (number < 0) throw std::runtime_error("no descriptor");
    }
    ~Handle() { close(number_); }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    operator int() const { return number_; }

  private:
    int number_;
};

class KillableCommand {
  public:
    // Runs in `folder` and watches `watched` for files.
    KillableCommand(std::filesystem::path folder, std::filesystem::path watched)
        : folder_(std::move(folder)), watched_(std::move(watched)) {}
    explicit KillableCommand(const std::filesystem::path& folder) : KillableCommand(folder, folder) {}

    // Runs the command to its end, or to the moment of the kill.
    Ended run(const std::vector<std::string>& words, const std::optional<KillAt>& when = {}) const {
        const Handle events(inotify_init1(IN_NONBLOCK | IN_CLOEXEC));
        if (inotify_add_watch(events, watched_.c_str(), IN_CREATE) < 0) throw std::runtime_error("no watch");
        std::array<int, 2> ends{};
        if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
        const Handle from(ends[0]);
        pid_t child = 0;
        {
            const Handle to(ends[1]);
            child = start(words, to);
        }
        Ended ended = watch(child, from, events, when);
        int status = 0;
        waitpid(child, &status, 0);
        ended.code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
        // The command may end before the signal arrives.
        ended.killed = ended.code == 128 + SIGKILL;
        if (ended.killed && when) ended.in_place = in_place(ended, child, *when);
        return ended;
    }

    // Repeats until the kill falls on the right moment; calls `before` each time.
    template <typename Before>
    Ended kill(const std::vector<std::string>& words, const KillAt& when, Before&& before) const {
        Ended ended;
        for (int attempt = 0; attempt < 40 && !ended.in_place; ++attempt) {
            before();
            ended = run(words, when);
        }
        return ended;
    }

  private:
    pid_t start(std::vector<std::string> words, int to) const {
        words.insert(words.begin(), LUCERNA_COMMAND);
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        const pid_t child = fork();
        if (child < 0) throw std::runtime_error("no process");
        if (child == 0) {
            dup2(to, STDOUT_FILENO);
            if (chdir(folder_.c_str()) == 0) execv(argv[0], argv.data());
            _exit(127);
        }
        return child;
    }

    // Watches the output until it is closed.
    static Ended watch(pid_t child, int from, int events, const std::optional<KillAt>& when) {
        Ended ended;
        bool sent = false;
        std::array<char, 4096> buffer{};
        int files = 0;
        for (;;) {
            std::array<pollfd, 2> both{pollfd{from, POLLIN, 0}, pollfd{events, POLLIN, 0}};
            poll(both.data(), both.size(), -1);
            if (both[1].revents != 0) files += files_made(events, child, when ? when->file : "");
            bool closed = false;
            if (both[0].revents != 0) {
                const ssize_t got = read(from, buffer.data(), buffer.size());
                closed = got <= 0;
                if (got > 0) ended.said.append(buffer.data(), static_cast<std::size_t>(got));
            }
            if (when && !sent && !closed && is_time(ended, files, *when)) {
                ::kill(child, SIGKILL);
                sent = true;
            }
            if (closed) return ended;
        }
    }

    // Returns whether the name is that of a temporary file of replace_file().
    static bool is_unfinished(std::string_view name, pid_t child, const std::string& file) {
        const std::string suffix = "." + std::to_string(child) + ".part";
        return file == "*" ? name.ends_with(suffix) : name == file + suffix;
    }

    static int files_made(int events, pid_t child, const std::string& file) {
        alignas(inotify_event) std::array<char, 4096> buffer{};
        int count = 0;
        for (ssize_t got = 0; (got = read(events, buffer.data(), buffer.size())) > 0;) {
            for (ssize_t at = 0; at < got;) {
                const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
                const std::string_view name = event->len > 0 ? event->name : "";
                count += !file.empty() && is_unfinished(name, child, file) ? 1 : 0;
                at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
            }
        }
        return count;
    }

    static int times_begun(const Ended& ended, const std::string& phase) {
        const std::vector<std::string> lines = ended.lines();
        return static_cast<int>(std::count(lines.begin(), lines.end(), phase + " …"));
    }
    static bool is_time(const Ended& ended, int files, const KillAt& when) {
        return when.phase.empty() ? files >= when.count : times_begun(ended, when.phase) >= when.count;
    }
    bool in_place(const Ended& ended, pid_t child, const KillAt& when) const {
        if (when.phase.empty()) {
            for (const auto& entry : std::filesystem::directory_iterator(watched_)) {
                if (is_unfinished(entry.path().filename().string(), child, when.file)) return true;
            }
            return false;
        }
        const std::vector<std::string> lines = ended.lines();
        const auto ends = std::count_if(lines.begin(), lines.end(), [&](const std::string& line) {
            return line.starts_with(when.phase + ": ") && line.find(" left") == line.npos;
        });
        return times_begun(ended, when.phase) == when.count && ends == when.count - 1;
    }

    std::filesystem::path folder_, watched_;
};

// Removes the temporary files that killed commands leave.
inline void remove_parts(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> parts;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() == ".part") parts.push_back(entry.path());
    }
    for (const auto& part : parts) std::filesystem::remove(part);
}

}  // namespace lucerna::testing
