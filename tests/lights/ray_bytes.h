// Builds the bytes of ray files for tests.
#pragma once

#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <string>

namespace lucerna::testing {

template <typename T>
void put(std::string& bytes, std::size_t at, const T& value) {
    std::memcpy(&bytes[at], &value, sizeof value);
}

inline std::string rows_of_floats(std::initializer_list<std::initializer_list<float>> values) {
    std::string bytes;
    for (const auto& row : values) {
        for (const float v : row) bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
    }
    return bytes;
}

}  // namespace lucerna::testing
