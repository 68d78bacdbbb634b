#include "engine/integrators/setting_text.h"

#include <charconv>
#include <cmath>

namespace lucerna {

SettingValue parse_setting(const std::string& text) {
    if (text == "true" || text == "false") return SettingValue(text == "true");
    double number = 0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, number);
    if (error == std::errc() && rest == end && std::isfinite(number)) return number;
    return text;
}

}  // namespace lucerna
