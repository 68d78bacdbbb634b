// Faults of floating point that stop the program where they happen, in builds made to find them
// (-DLUCERNA_TRAPS=ON: the presets traps, asan-ubsan and fuzz). In all others this is nothing.
//
// What is armed in a thread is armed in the loops it starts (parallel.h). Libraries of others divide by zero
// and let comparisons sort it out; calls of theirs are made with nothing armed.
#pragma once

#include <cfenv>

namespace lucerna {

#ifdef LUCERNA_TRAPS
inline constexpr bool kTrapsBuilt = true;
#else
inline constexpr bool kTrapsBuilt = false;
#endif

// The faults that are never meant: 0/0 and its like, x/0, a finite result that is out of range.
inline constexpr int kFaults = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
inline constexpr int kNoFaults = 0;

// While it lives, exactly these faults stop the calling thread; then those that did before.
class FloatTraps {
  public:
    explicit FloatTraps(int faults) {
        if constexpr (kTrapsBuilt) arm(faults);
    }
    ~FloatTraps() {
        if constexpr (kTrapsBuilt) arm(before_);
    }
    FloatTraps(const FloatTraps&) = delete;
    FloatTraps& operator=(const FloatTraps&) = delete;

    // Which faults stop the calling thread now.
    static int armed() {
        if constexpr (kTrapsBuilt) return fegetexcept();
        return kNoFaults;
    }

  private:
    void arm(int faults) {
        before_ = fedisableexcept(FE_ALL_EXCEPT);
        if (faults == kNoFaults) return;
        std::feclearexcept(FE_ALL_EXCEPT);  // a flag of an earlier fault would stop the next x87 instruction
        feenableexcept(faults);
    }

    int before_ = kNoFaults;
};

}  // namespace lucerna
