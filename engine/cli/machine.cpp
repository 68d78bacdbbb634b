#include "engine/cli/machine.h"

#include <fmt/format.h>

#include <ctime>
#include <fstream>
#include <string_view>

#include "engine/base/parallel.h"

namespace lucerna {
namespace {

// Linux lists every processor; they are of one kind.
std::string processor_name() {
    std::ifstream in("/proc/cpuinfo");
    for (std::string line; std::getline(in, line);) {
        if (!line.starts_with("model name")) continue;
        const std::size_t colon = line.find(':');
        if (colon != std::string::npos && line.size() > colon + 2) return line.substr(colon + 2);
    }
    return "a processor without a name";
}

}  // namespace

std::string machine_text() {
    const int processors = Workers{}.threads;
    return fmt::format("{}, {} processor{}", processor_name(), processors, processors == 1 ? "" : "s");
}

std::string today_text() {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    gmtime_r(&now, &parts);
    return fmt::format("{:04d}-{:02d}-{:02d}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday);
}

}  // namespace lucerna
