// Starts the built command and kills it without warning (SIGKILL) at a verified moment: while a phase is
// running, or when a file has been written and has not yet replaced the old one.
#pragma once

#include <fcntl.h>
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
#include <utility>
#include <vector>

namespace lucerna::testing {

// When to kill: at the beginning of the phase (by the command's name for it), or when `file` ("out/": any
// file of that folder) is complete under its temporary name; the `count`-th time, from 1.
struct KillAt {
    std::string phase, file;
    int count = 1;
};

struct Ended {
    int code = 0;           // 128 + the signal if one ended it
    std::string said;       // standard output
    bool killed = false;    // by the test
    bool in_place = false;  // the phase had not ended, or the file had not been replaced
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
    explicit KillableCommand(std::filesystem::path folder) : folder_(std::move(folder)) {}

    // Runs the command to its end, or to the moment of the kill.
    Ended run(const std::vector<std::string>& words, const std::optional<KillAt>& when = {}) const {
        std::array<int, 2> ends{};
        if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
        const Handle from(ends[0]);
        pid_t child = 0;
        {
            const Handle to(ends[1]);
            child = start(words, to, when);
        }
        Ended ended = watch(child, from, when);
        int status = 0;
        waitpid(child, &status, 0);
        ended.code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
        // The command may end before the signal arrives.
        ended.killed = ended.code == 128 + SIGKILL;
        if (ended.killed && when) ended.in_place = in_place(ended, *when);
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
    pid_t start(std::vector<std::string> words, int to, const std::optional<KillAt>& when) const {
        words.insert(words.begin(), LUCERNA_COMMAND);
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        const pid_t child = fork();
        if (child < 0) throw std::runtime_error("no process");
        if (child == 0) {
            dup2(to, STDOUT_FILENO);
            if (when && !when->file.empty()) kill_at_file(*when);
            if (chdir(folder_.c_str()) == 0) execv(argv[0], argv.data());
            _exit(127);
        }
        return child;
    }

    // Has the library tests/process/preload/kill_at_file.cpp kill this process.
    void kill_at_file(const KillAt& when) const {
        const std::string file = (std::filesystem::canonical(folder_) / when.file).string();
        setenv("LD_PRELOAD", LUCERNA_KILL_AT_FILE, 1);
        setenv("LUCERNA_TEST_KILL_FILE", (file.ends_with('/') ? file : file + ".").c_str(), 1);
        setenv("LUCERNA_TEST_KILL_COUNT", std::to_string(when.count).c_str(), 1);
    }

    // Reads the output until it is closed.
    static Ended watch(pid_t child, int from, const std::optional<KillAt>& when) {
        Ended ended;
        bool sent = false;
        std::array<char, 4096> buffer{};
        for (;;) {
            const ssize_t got = read(from, buffer.data(), buffer.size());
            if (got <= 0) return ended;
            ended.said.append(buffer.data(), static_cast<std::size_t>(got));
            if (when && !when->phase.empty() && !sent && times_begun(ended, when->phase) >= when->count) {
                ::kill(child, SIGKILL);
                sent = true;
            }
        }
    }

    static int times_begun(const Ended& ended, const std::string& phase) {
        const std::vector<std::string> lines = ended.lines();
        return static_cast<int>(std::count(lines.begin(), lines.end(), phase + " …"));
    }
    static bool in_place(const Ended& ended, const KillAt& when) {
        if (when.phase.empty()) return true;
        const std::vector<std::string> lines = ended.lines();
        const auto ends = std::count_if(lines.begin(), lines.end(), [&](const std::string& line) {
            return line.starts_with(when.phase + ": ") && line.find(" left") == line.npos;
        });
        return times_begun(ended, when.phase) == when.count && ends == when.count - 1;
    }

    std::filesystem::path folder_;
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
