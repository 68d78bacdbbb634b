#include "engine/base/version.h"

namespace lucerna {

std::string_view program_version() {
    return LUCERNA_VERSION;
}

}  // namespace lucerna
