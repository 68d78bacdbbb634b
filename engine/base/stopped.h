// Work that ended because the user asked it to, and gave up what it was making.
#pragma once

#include "engine/base/error.h"

namespace lucerna {

// Thrown where Monitor::stopped() was heard and there is nothing whole to give back. A command that ends with
// it has an exit code of its own.
class Stopped : public InputError {
  public:
    using InputError::InputError;
};

}  // namespace lucerna
