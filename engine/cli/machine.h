// What a time was measured on, and when: a time without them says nothing a year later.
#pragma once

#include <string>

namespace lucerna {

// "AMD EPYC 7763, 2 processors": the processor's own name where the system tells it.
std::string machine_text();

// "2026-11-22", of UTC.
std::string today_text();

}  // namespace lucerna
