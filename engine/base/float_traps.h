// Traps stop the program where a floating-point fault happens, in builds made to find such faults
// (-DLUCERNA_TRAPS=ON: the presets traps, asan-ubsan and fuzz). In all other builds they do nothing.
//
// Faults armed in a thread are armed in the loops that it starts (parallel.h). Other libraries divide by zero
// on purpose, so that calls of theirs are made with no faults armed.
#pragma once

#include <cfenv>

namespace lucerna {

#ifdef LUCERNA_TRAPS
inline constexpr bool kTrapsBuilt = true;
#else
inline constexpr bool kTrapsBuilt = false;
#endif

// These faults are never intended: invalid operations such as 0/0, division by zero, overflow.
inline constexpr int kFaults = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
inline constexpr int kNoFaults = 0;

// Arms exactly these faults in the calling thread during its lifetime, then restores the previous ones.
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

    // Returns the faults that are armed in the calling thread.
    static int armed() {
        if constexpr (kTrapsBuilt) return fegetexcept();
        return kNoFaults;
    }

  private:
    void arm(int faults) {
        before_ = fedisableexcept(FE_ALL_EXCEPT);
        if (faults == kNoFaults) return;
        std::feclearexcept(FE_ALL_EXCEPT);  // a stale flag would stop the next x87 instruction
        feenableexcept(faults);
    }

    int before_ = kNoFaults;
};

}  // namespace lucerna
