#include "engine/system/printed_page.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <span>
#include <string_view>
#include <system_error>
#include <vector>

#include "engine/base/error.h"
#include "engine/system/files.h"

extern char** environ;

namespace lucerna {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 5> kBrowsers{"chromium", "chromium-browser", "google-chrome",
                                               "google-chrome-stable", "microsoft-edge"};

// A folder that is removed with all in it.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::string name = (fs::temp_directory_path() / "lucerna-page-XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr)
            throw WriteError(Location{name}, std::generic_category().message(errno));
        path_ = name;
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

// Runs a program without input and output, and returns whether it ended well.
bool runs(const std::vector<std::string>& command) {
    std::vector<char*> words;
    for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        posix_spawn_file_actions_addopen(&files, stream, "/dev/null", O_RDWR, 0);
    pid_t child = 0;
    const int failed = posix_spawnp(&child, words.front(), &files, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    if (failed != 0) return false;
    int status = 0;
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return false;
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

std::string printing_browser(const std::string& option) {
    const char* path = std::getenv("PATH");
    for (std::string_view rest = path != nullptr ? path : ""; !rest.empty();) {
        const std::size_t colon = rest.find(':');
        const fs::path folder(rest.substr(0, colon));
        rest.remove_prefix(colon == rest.npos ? rest.size() : colon + 1);
        for (const char* browser : kBrowsers) {
            if (::access((folder / browser).c_str(), X_OK) == 0) return browser;
        }
    }
    throw InputError({option}, fmt::format("a PDF is printed by a browser, and none of {} is on the PATH; "
                                           "--html writes the page, which any browser prints",
                                           fmt::join(kBrowsers, ", ")));
}

void print_page(const std::string& html, const fs::path& file, const std::string& browser) {
    const TemporaryFolder folder;
    const fs::path page = folder.path() / "page.html", printed = folder.path() / "page.pdf";
    const auto bytes = std::as_bytes(std::span(html));
    replace_file(page, {{bytes}});
    std::vector<std::string> command{browser,
                                     "--headless",
                                     "--disable-gpu",
                                     "--no-pdf-header-footer",
                                     "--user-data-dir=" + (folder.path() / "profile").string(),
                                     "--print-to-pdf=" + printed.string(),
                                     "file://" + page.string()};
    // Chromium refuses to run as root with its sandbox; the page has no script.
    if (::geteuid() == 0) command.insert(command.begin() + 1, "--no-sandbox");
    if (!runs(command) || !fs::exists(printed))
        throw InputError({file.string()}, fmt::format("{} could not print the page", browser));
    const std::vector<std::byte> pdf = read_bytes(printed);
    const std::span<const std::byte> all(pdf);
    replace_file(file, {{all}});
}

}  // namespace lucerna
