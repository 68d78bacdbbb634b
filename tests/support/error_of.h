// Returns the message of the InputError that an action throws, or "no error".
#pragma once

#include <string>

#include "engine/base/error.h"

namespace lucerna::testing {

template <typename Action>
std::string error_of(Action&& action) {
    try {
        action();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

}  // namespace lucerna::testing
