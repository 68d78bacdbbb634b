// What memory there is, and a refusal before long work rather than a kill in the middle of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace lucerna {

// Bytes that this process can still have: what the system calls available, with its swap, under the limits of
// the process and of its control group. None where the system does not say.
std::optional<std::uint64_t> available_memory();

// Throws InputError "WHAT: needs 18.3 GB of memory, 12.0 GB are available; INSTEAD" if `bytes` are more than
// there are. That they are enough is no promise: others may take them.
void require_memory(std::uint64_t bytes, std::string_view what, std::string_view instead);
// The same, of a machine that has `available` bytes.
void require_memory(std::uint64_t bytes, std::uint64_t available, std::string_view what,
                    std::string_view instead);

}  // namespace lucerna
