// Computes a hash that names work and contents and checks files. It is not cryptographic.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace lucerna {

// Applies FNV-1a's step to words, and folds the high half down so that every bit affects all later ones.
class WordHash {
  public:
    void add(std::uint64_t word) {
        value_ = (value_ ^ word) * 0x100000001b3U;
        value_ ^= value_ >> 29;
    }
    void add(int number) { add(static_cast<std::uint64_t>(number)); }
    void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
    void add(float number) { add(std::uint64_t{std::bit_cast<std::uint32_t>(number)}); }
    // Includes the length, so that two texts in a row differ from their concatenation.
    void add(std::string_view text) {
        add(std::uint64_t{text.size()});
        for (const char c : text) add(std::uint64_t{static_cast<unsigned char>(c)});
    }
    // Adds eight bytes at a time, and the last ones one by one.
    void add_bytes(std::span<const std::byte> bytes) {
        std::size_t i = 0;
        for (; i + 8 <= bytes.size(); i += 8) {
            std::uint64_t word = 0;
            std::memcpy(&word, &bytes[i], 8);
            add(word);
        }
        for (; i < bytes.size(); ++i) add(static_cast<std::uint64_t>(bytes[i]));
    }
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 0xcbf29ce484222325U;
};

}  // namespace lucerna
