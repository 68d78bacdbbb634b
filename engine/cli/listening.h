// When a command is to be asked to stop, instead of being ended.
#pragma once

#include "engine/cli/run.h"

namespace lucerna {

// While one lives, a signal asks the command to stop, and it keeps what there is. Reading is not under one:
// what was read is worth nothing yet, and reading asks nobody.
class Listening {
  public:
    explicit Listening(const Surroundings& around) : listening_(around.listening) {
        if (listening_) *listening_ = true;
    }
    ~Listening() {
        if (listening_) *listening_ = false;
    }
    Listening(const Listening&) = delete;
    Listening& operator=(const Listening&) = delete;

  private:
    std::atomic<bool>* listening_;
};

}  // namespace lucerna
