// Settings as people write them after --set and in studies.
#pragma once

#include <string>

#include "engine/integrators/settings.h"

namespace lucerna {

// "1e6" as a number, "true" as a truth value, all else as a word.
SettingValue parse_setting(const std::string& text);

}  // namespace lucerna
